// frames.mkv as bytes. Its frames are found by themselves: each has check sums of its own, so that no length
// or place that the file states needs to be right.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "capture/video/packet.h"

namespace palpate {

/// Head of the file, needed to read its frames.
struct VideoHead {
  std::string text;                    ///< the session's; empty: none that is whole
  uint32_t width = 0, height = 0;      ///< px, as coded; 0: not known
  std::vector<uint8_t> codec_private;  ///< FFV1's parameters; empty: none that are whole
};

/// A Matroska element that players pass over and that holds the head with a check sum.
std::vector<uint8_t> spare_head(const VideoHead& head);

struct VideoBlock {
  uint64_t begin = 0, end = 0;    ///< bytes of its cluster in the file
  PacketRecord record;            ///< of the frame
  std::span<const uint8_t> data;  ///< coded, until the next call to SessionFile::read
};

class SessionFile {
 public:
  /// Throws Error(Failure::Input) where the file cannot be read, or holds neither a session's head nor
  /// frames.
  explicit SessionFile(const std::filesystem::path& file);
  ~SessionFile();
  SessionFile(const SessionFile&) = delete;
  SessionFile& operator=(const SessionFile&) = delete;

  uint64_t bytes() const { return bytes_; }
  const VideoHead& head() const { return head_; }
  /// Larger clusters are taken for damaged.
  void limit_clusters(uint64_t most_bytes) { most_bytes_ = most_bytes; }

  /// The frame whose cluster begins at `begin`; false where no whole one does.
  bool read(uint64_t begin, VideoBlock& block);
  /// The first whole frame from `begin` on, and the frames before it of which some part is left.
  struct Gap {
    uint64_t next = 0;     ///< bytes() where there is none
    uint64_t damaged = 0;  ///< a frame that the file's end cuts is none of these
  };
  Gap pass_damage(uint64_t begin);
  /// Where the clusters begin, by the file's own index; empty where that is missing or damaged.
  std::vector<uint64_t> index() const;

 private:
  int file_ = -1;
  uint64_t bytes_ = 0;
  uint64_t most_bytes_ = uint64_t{1} << 30;
  std::vector<uint8_t> start_;  ///< of the file, up to its first cluster
  VideoHead head_;
  std::vector<uint8_t> cluster_;

  std::vector<uint8_t> bytes_at(uint64_t begin, uint64_t count) const;
  void read_start();
};

}  // namespace palpate
