// Boundary of the module that speaks to other processes: all that needs MPI.
#pragma once

#include "engine/lump/study/processes.h"

namespace palpate {

struct MpiModule {
  struct Place {
    uint32_t rank = 0, size = 1;
  };
  /// Joins the others. Throws Error(Failure::Usage) where their MPI is another.
  Place (*join)();
  void (*leave)();
  void (*send)(uint32_t to, Processes::Kind kind, const std::string& bytes);
  /// Never waits.
  std::optional<Processes::Message> (*receive)();
};

}  // namespace palpate
