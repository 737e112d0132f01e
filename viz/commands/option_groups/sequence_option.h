// The option that says that pictures without a rate follow each other.
#pragma once

#include "viz/commands/support/options.h"

namespace palpate {

/// --sequence, as `one_sequence` of separate_presses().
inline void add_sequence(CommandLine& command, bool& one_sequence) {
  command.add_flag("--sequence", one_sequence,
                   "Images without a rate are one sequence, in their order: contacts, shear and light are "
                   "followed from one to the next (default: each is a press of its own; --rate says it too)");
}

}  // namespace palpate
