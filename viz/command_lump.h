// What `palpate lump` holds.
#pragma once

#include "viz/command.h"

namespace palpate {

void add_lump_figures(CLI::App& group, Common& common, Command& chosen);

}  // namespace palpate
