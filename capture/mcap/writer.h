// MCAP files (mcap.dev): messages of channels with their schemas, in chunks compressed by zstd with check
// sums and indices. A file that is cut short reads up to its last whole chunk.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <string_view>

#include "capture/messages/topics.h"

namespace palpate {

/// What a file holds: for statistics and for descriptions beside it.
struct McapCounts {
  std::map<uint16_t, uint64_t> messages;  ///< by channel
  uint64_t all = 0;                       ///< messages
  int64_t first_ns = 0, last_ns = 0;      ///< of the stamps; 0 without messages
  uint64_t bytes = 0;                     ///< of the file
};

/// Not thread safe. Every member throws Error(Failure::Output) where the system refuses; the file then ends
/// with its last whole chunk.
class McapWriter {
 public:
  /// Makes the file, or empties it. `profile`: "ros2" where messages of ROS 2 are in it.
  McapWriter(const std::filesystem::path& file, std::string_view profile);
  ~McapWriter();  ///< without close() the file is as after a kill

  /// The channel of a topic. Before the first message.
  uint16_t add_channel(const Topic& topic);
  void attach(std::string_view name, std::string_view media_type, std::string_view bytes);
  void add_metadata(std::string_view name, const std::map<std::string, std::string>& values);
  /// A message in the present chunk. `stamp_ns` >= 0.
  void write(uint16_t channel, uint32_t sequence, int64_t stamp_ns, std::span<const uint8_t> message);
  /// Ends a chunk of more than 1 MiB, and one begun more than 0.4 s before `now_ns`, which counts from
  /// anywhere.
  void end_chunk_if_due(int64_t now_ns);
  /// Hands all to the disk.
  void sync();
  /// Writes the last chunk and the summary.
  void close();
  McapCounts counts() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace palpate
