// The processes that mpirun started together, on one machine or several; one process where it did not.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace palpate::lump {

/// Joins the others if mpirun started this process; otherwise MPI is not touched. One at a time in a program,
/// used from the thread that made it.
class Processes {
 public:
  enum class Kind : uint8_t { Ready, Work, Result, Failed, Stop, Bye };
  struct Message {
    uint32_t from = 0;
    Kind kind = Kind::Stop;
    std::string bytes;
  };

  /// Throws Error(Failure::Usage) where mpirun's MPI and ours do not understand each other.
  Processes();
  /// Leaves them. All must do so before any returns from it.
  ~Processes();
  Processes(const Processes&) = delete;
  Processes& operator=(const Processes&) = delete;

  uint32_t rank() const { return rank_; }
  uint32_t size() const { return size_; }
  /// Started by mpirun, be it as the only one.
  bool joined() const { return joined_; }

  void send(uint32_t to, Kind kind, const std::string& bytes = {}) const;
  /// The next message to this process; none where none is there. Never waits.
  std::optional<Message> receive() const;

 private:
  uint32_t rank_ = 0, size_ = 1;
  bool joined_ = false;
};

}  // namespace palpate::lump
