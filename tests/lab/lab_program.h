// Fixture that runs palpate-lab.
#pragma once

#include "tests/support/program_fixture.h"

namespace palpate {

class LabProgram : public Program {
 protected:
  LabProgram() { program_ = PALPATE_LAB_PROGRAM; }
};

}  // namespace palpate
