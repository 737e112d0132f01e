// frames.mkv: the frames of a session as FFV1 in Matroska. Every frame stands by itself: a key frame in a
// cluster of its own, handed to the file at once, with its number, times and check sum in its block.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "palpate/frame.h"

namespace palpate {

/// Metadata of a frame.
struct FrameStamp {
  uint64_t sequence = 0;
  int64_t time_ns = 0;
  int64_t exposed_ns = 0;
  int64_t delivered_ns = 0;
  bool after_gap = false;

  bool operator==(const FrameStamp&) const = default;
};
inline FrameStamp stamp_of(const Frame& frame) {
  return {frame.sequence, frame.time_ns, frame.exposed_ns, frame.delivered_ns, frame.after_gap};
}
inline void put_stamp(const FrameStamp& stamp, Frame& frame) {
  frame.sequence = stamp.sequence;
  frame.time_ns = stamp.time_ns;
  frame.exposed_ns = stamp.exposed_ns;
  frame.delivered_ns = stamp.delivered_ns;
  frame.after_gap = stamp.after_gap;
}

class SessionVideoWriter {
 public:
  /// Makes a new file whose head, with `session_text` in it, is on the disk when this returns. Gray of 8 to
  /// 16 bits or colour of 8. Throws Error(Failure::Output), as every member; also where the file exists.
  static std::unique_ptr<SessionVideoWriter> create(const std::filesystem::path& file,
                                                    const FrameFormat& format, double rate_Hz,
                                                    const std::string& session_text);
  virtual ~SessionVideoWriter() = default;

  /// Encodes a frame of noise, which takes the longest, and writes nothing: a frame's time on this machine,
  /// s.
  virtual double rehearse() = 0;
  /// After a failure the file ends with the last whole frame and takes no more.
  virtual void write(const Frame& frame) = 0;
  /// Adds the index that makes seeking fast, and the duration.
  virtual void finish() = 0;
  /// Makes the disk have what was written; from any thread.
  virtual void sync() = 0;
  virtual uint64_t bytes() const = 0;
};

class SessionVideoReader {
 public:
  enum class Step { Frame, Damaged, End };

  /// Throws Error(Failure::Input) where this is no such file, or not even its head is there.
  static std::unique_ptr<SessionVideoReader> open(const std::filesystem::path& file);
  virtual ~SessionVideoReader() = default;

  /// As it was given to the writer.
  virtual const std::string& session_text() const = 0;
  /// Format that `decode` shall deliver. Throws Error(Failure::Input) where the file holds frames of other
  /// sides.
  virtual void expect(const FrameFormat& format) = 0;

  /// Goes to the next frame without decoding it.
  virtual Step step(FrameStamp& stamp) = 0;
  /// Pixels and stamp of the frame of the last `step`; false where they do not decode.
  virtual bool decode(Frame& frame) = 0;
  /// Frames by the file's own index; 0 where it has none.
  virtual uint64_t indexed() = 0;
  /// The next `step` will reach frame `index`, counted from 0; false where the file's index has none such.
  virtual bool seek(uint64_t index) = 0;
  /// Number of the frame of the last `step`, as `seek` counts; nothing without an index or before that.
  virtual std::optional<uint64_t> place() const = 0;
  /// Counts what can be read from here to the end by looking at every frame, and makes an index of it. Ends
  /// at the start of the file.
  struct Found {
    uint64_t frames = 0;
    uint64_t damaged = 0;
    uint64_t last_sequence = 0;
  };
  virtual Found scan() = 0;
};

}  // namespace palpate
