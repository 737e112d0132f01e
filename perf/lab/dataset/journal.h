// Cases that are done, kept as they come: what survives a kill at any byte.
#pragma once

#include <chrono>
#include <filesystem>
#include <map>
#include <string>

#include "perf/lab/dataset/sample.h"

namespace palpate::lump {

/// A file next to a data set that is being made: a head that names sweep and program, then a record of one
/// length per case with a check sum, whole when append() returns whatever kills the process, on the disk
/// within 0.2 s of the next case. A record that is cut off or damaged is one that is not there. Only one
/// process has it open.
class Journal {
 public:
  /// Opens it, or makes it. Throws Error(Failure::Input) where it belongs to another sweep or program, is no
  /// journal, or another process has it open; Error(Failure::Output) where it cannot be written.
  Journal(const std::filesystem::path& path, const Sweep& sweep, const std::string& program);
  ~Journal();
  Journal(const Journal&) = delete;
  Journal& operator=(const Journal&) = delete;

  /// Keeps one; packed as pack() does it. A case that is there already is passed over.
  void append(const std::string& packed);
  bool has(uint32_t number) const { return at_.count(number) != 0; }
  /// Throws Error(Failure::Input) where the disk gives back other bytes.
  Sample read(uint32_t number) const;
  size_t size() const { return at_.size(); }
  const std::map<uint32_t, uint64_t>& cases() const { return at_; }
  size_t damaged() const { return damaged_; }  ///< records that were found damaged
  /// Ends it: the file is no more.
  void remove();

  /// The sweep and the program that a journal says it belongs to, and how many whole cases it holds, without
  /// changing it. Throws as the constructor, but never waits for another process.
  struct Glance {
    Sweep sweep;
    std::string program;
    size_t cases = 0;
  };
  static Glance glance(const std::filesystem::path& path);

 private:
  void open_and_read();

  std::filesystem::path path_;
  Sweep sweep_;
  int file_ = -1;
  uint64_t end_ = 0;                 // of the last whole record
  std::map<uint32_t, uint64_t> at_;  // case, begin of its record
  size_t damaged_ = 0;
  std::chrono::steady_clock::time_point synced_{};
};

}  // namespace palpate::lump
