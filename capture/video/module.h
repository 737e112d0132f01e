// Interface of the video module: everything that needs libav goes through these functions.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "capture/video/session_video.h"

namespace palpate {

/// A picture in memory that its owner keeps: interleaved blue, green, red of 8 bits.
struct BgrView {
  const uint8_t* pixels = nullptr;
  uint32_t width = 0;   ///< px
  uint32_t height = 0;  ///< px
  size_t row_bytes = 0;
};

/// Faults of a film, as far as it has been decoded; counts begin anew with a jump.
struct FilmFaults {
  uint64_t left_out = 0;  ///< frames that do not decode whole
  uint64_t seen = 0;      ///< frames up to here, with those
  uint64_t placed = 0;    ///< frames whose time stamps do not rise (RisingTimes)
};

/// Frames of a video file in order, turned upright where the file says how. Those that do not decode whole,
/// and those that may refer to them, are left out.
class VideoDecoder {
 public:
  virtual ~VideoDecoder() = default;
  virtual uint32_t width() const = 0;   ///< px, as the container states it
  virtual uint32_t height() const = 0;  ///< px
  /// Frames in one second; 0 or less where the container states none.
  virtual double rate_Hz() const = 0;
  /// As the container announces; less than 1: not at all.
  virtual double frame_count() const = 0;
  /// Whether that is a count, not a duration times a rate.
  virtual bool frames_are_counted() const = 0;
  /// By how much more than by a long pause the container states a later end than its last frame's, s; 0: not
  /// at all.
  virtual double missing_end_s() const = 0;
  /// Times of all frames as `time_ns`, from the packets alone; empty where they do not simply rise.
  virtual std::vector<int64_t> times_ns() const = 0;
  /// Decodes the next whole frame; false at the end.
  virtual bool grab() = 0;
  /// Number of the frame of the last `grab`, from 0; frames that are left out count.
  virtual uint64_t index() const = 0;
  /// Its time by the stream's own stamps, less the first frame's; without stamps by the rate, else 0.
  virtual int64_t time_ns() const = 0;
  virtual FilmFaults faults() const = 0;
  /// The next `grab` gives frame `index`, or where that does not decode the next one after it. False where
  /// there is none.
  virtual bool seek(uint64_t index) = 0;
  /// The frame of the last `grab`, valid until the next; empty where it cannot be converted.
  virtual std::optional<BgrView> picture() = 0;
};

/// The undecoded frames of a video file.
class VideoPackets {
 public:
  virtual ~VideoPackets() = default;
  /// Valid until the next call; empty at the end.
  virtual std::span<const uint8_t> next() = 0;
  /// The next one will be number `index`, from 0, or none.
  virtual void seek(uint64_t index) = 0;
};

/// A film of pictures of one size: MPEG-4 in .mp4, motion JPEG in .avi.
class VideoEncoder {
 public:
  virtual ~VideoEncoder() = default;
  /// Interleaved red, green, blue. Throws Error(Failure::Output).
  virtual void write(std::span<const uint8_t> rgb) = 0;
  /// Throws Error(Failure::Output).
  virtual void close() = 0;
};

struct VideoModule {
  std::unique_ptr<SessionVideoReader> (*read_session)(const std::filesystem::path& file);
  std::unique_ptr<SessionVideoWriter> (*write_session)(const std::filesystem::path& file,
                                                       const FrameFormat& format, double rate_Hz,
                                                       const std::string& session_text);
  /// Null where the file is no video that can be decoded.
  std::unique_ptr<VideoDecoder> (*decode)(const std::filesystem::path& file);
  std::unique_ptr<VideoPackets> (*packets)(const std::filesystem::path& file);
  /// Errors call the file `name`. Throws Error(Failure::Output) where the file cannot be made.
  std::unique_ptr<VideoEncoder> (*encode)(const std::filesystem::path& file, const std::string& name,
                                          uint32_t width, uint32_t height, double rate_Hz);
};

/// Loads the module at its first call. Throws Error(Failure::Input) where it is missing.
const VideoModule& video_module();

}  // namespace palpate
