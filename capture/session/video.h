// frames.mkv: the frames of a session as FFV1 in Matroska. Every frame stands by itself: a key frame in a
// cluster of its own, handed to the file at once, with its number, times and check sum in its block.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>

#include "palpate/frame.h"

namespace palpate {

/// What a frame is besides its pixels.
struct FrameStamp {
  uint64_t sequence = 0;
  int64_t time_ns = 0;
  int64_t exposed_ns = 0;
  int64_t delivered_ns = 0;
  bool after_gap = false;

  bool operator==(const FrameStamp&) const = default;
};
FrameStamp stamp_of(const Frame& frame);
void put_stamp(const FrameStamp& stamp, Frame& frame);

class SessionVideoWriter {
 public:
  /// Makes a new file whose head, with `session_text` in it, is on the disk when this returns. Gray of 8 to
  /// 16 bits or colour of 8. Throws Error(Failure::Output), as every member; also where the file exists.
  SessionVideoWriter(const std::filesystem::path& file, const FrameFormat& format, double rate_Hz,
                     const std::string& session_text);
  ~SessionVideoWriter();

  /// Encodes a frame of noise, which takes the longest, and writes nothing: a frame's time on this machine,
  /// s.
  double rehearse();
  /// After a failure the file ends with the last whole frame and takes no more.
  void write(const Frame& frame);
  /// Adds the index that makes seeking fast, and the duration.
  void finish();
  /// Makes the disk have what was written; from any thread.
  void sync();
  uint64_t bytes() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

class SessionVideoReader {
 public:
  enum class Step { Frame, Damaged, End };

  /// Throws Error(Failure::Input) where this is no such file, or not even its head is there.
  explicit SessionVideoReader(const std::filesystem::path& file);
  ~SessionVideoReader();

  /// As it was given to the writer.
  const std::string& session_text() const;
  /// What `decode` shall deliver. Throws Error(Failure::Input) where the file holds frames of other sides.
  void expect(const FrameFormat& format);

  /// Goes to the next frame without decoding it.
  Step step(FrameStamp& stamp);
  /// Pixels and stamp of the frame of the last `step`; false where they do not decode.
  bool decode(Frame& frame);
  /// Frames by the file's own index; 0 where it has none.
  uint64_t indexed();
  /// The next `step` will reach frame `index`, counted from 0; false where the file's index has none such.
  bool seek(uint64_t index);
  /// Counts what can be read from here to the end by looking at every frame, and makes an index of it. Ends
  /// at the start of the file.
  struct Found {
    uint64_t frames = 0;
    uint64_t damaged = 0;
    uint64_t last_sequence = 0;
  };
  Found scan();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace palpate
