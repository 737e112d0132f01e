// A recording as one file of HDF5, for learning: a group for each stream, at its own rate with its own times.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "capture/hdf5/module.h"
#include "capture/messages/number_table.h"
#include "capture/messages/ros_messages.h"
#include "engine/measure/quantities.h"
#include "palpate/sensor.h"

namespace palpate {

struct EpisodeOptions {
  Sensor sensor;
  FrameFormat format;
  Outputs outputs = {};
  MeasuredColumns columns = {};
  /// Attributes of the file: name and value.
  std::map<std::string, std::string> facts = {};
  /// "left" or "right" of two fingers in one file: their groups, and what begins the attributes; empty: one.
  std::string side = {};
};

/// A file of one recording, or of two fingers. Written under a name of its own, and there as `file` once
/// commit() is called; without it nothing stays. Every member throws Error(Failure::Output). README.md has
/// the layout.
class EpisodeFile {
 public:
  explicit EpisodeFile(std::filesystem::path file);
  ~EpisodeFile();
  EpisodeFile(const EpisodeFile&) = delete;
  EpisodeFile& operator=(const EpisodeFile&) = delete;

  Hdf5Writer& writer() { return *writer_; }
  /// A group of its own, `/NAME` behind `root`: `time_s` and a dataset for each column.
  void add(const NumberTable& table, const std::string& root = {});
  void commit();

 private:
  std::filesystem::path file_, partial_;
  std::unique_ptr<Hdf5Writer> writer_;
};

/// The streams of one sensor in a file that outlives it. Every member throws Error(Failure::Output).
class Episode {
 public:
  Episode(EpisodeFile& file, const EpisodeOptions& options);

  /// A frame with what was measured of it. `depth`: none where it is not known; `time_s`: since the recording
  /// began.
  void add(const Frame& frame, const Touch& touch, const std::optional<DepthMap>& depth, double time_s);

 private:
  /// Times and numbers of a stream's rows.
  struct Stream {
    size_t time, frame;
  };
  Stream add_stream(const std::string& group);
  void stamp(const Stream& stream, const Touch& touch, double time_s);
  template <typename Of>
  void add_columns(std::span<const MeasuredQuantity<Of>> quantities);
  template <typename Of>
  void add_values(std::span<const MeasuredQuantity<Of>> quantities, const Of& of);
  void add_image(const Frame& frame);
  void add_skin(const Touch& touch, double time_s);

  Hdf5Writer* writer_;
  std::string root_;  ///< "/left" of two
  MeasuredColumns columns_;
  Stream frames_, touches_;
  size_t images_;
  std::map<std::string, size_t> values_;  ///< datasets of the touch, by name
  struct Map {
    Stream stream;
    size_t values;
  };
  std::optional<Map> depth_, skin_;
  size_t skin_points_ = 0;
  std::vector<uint8_t> pixels_;
  std::vector<float> map_;
};

}  // namespace palpate
