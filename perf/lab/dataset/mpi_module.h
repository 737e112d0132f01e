// Boundary of the module that speaks to other processes: all that needs MPI.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace palpate::lump {

struct MpiModule {
  struct Place {
    uint32_t rank = 0, size = 1;
  };
  struct Message {
    uint32_t from = 0;
    uint8_t kind = 0;
    std::string bytes;
  };
  /// Joins the others. Throws Error(Failure::Usage) where their MPI is another.
  Place (*join)();
  void (*leave)();
  void (*send)(uint32_t to, uint8_t kind, const std::string& bytes);
  /// Never waits.
  std::optional<Message> (*receive)();
};

}  // namespace palpate::lump
