#pragma once

#include "viz/command.h"

namespace palpate {

void add_contact(CLI::App& program, Common& common, Command& chosen);

}  // namespace palpate
