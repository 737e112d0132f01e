// A recording as an MCAP file: each frame's topics (capture/messages), the sensor file and the session's
// description attached, and beside it the metadata.yaml with which ROS 2 plays the folder.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "capture/files/event_log.h"
#include "capture/mcap/writer.h"
#include "capture/messages/number_table.h"
#include "capture/messages/ros_messages.h"
#include "capture/messages/topics.h"
#include "capture/messages/touch_json.h"
#include "palpate/sensor.h"

namespace palpate {

inline constexpr const char* kMcapFile = "recording.mcap";
inline constexpr const char* kMcapYaml = "metadata.yaml";

struct McapOptions {
  Sensor sensor;
  Outputs outputs = {};
  MeasuredColumns columns = {};
  /// Points too. They follow from the depth and mm_per_px among the facts, and make the file three times as
  /// large.
  bool cloud = false;
  /// Name and value of what is known of the recording, such as its input.
  std::map<std::string, std::string> facts = {};
  /// session.json, where a session was recorded; empty: none.
  std::string session = {};
  /// "left" or "right" of two fingers in one file, in front of topics and names; empty: one.
  std::string side = {};
};

/// A file of one recording, or of two fingers. Writes `folder`/recording.mcap and, at the end, metadata.yaml.
/// Every member throws Error(Failure::Output). One thread.
class McapFile {
 public:
  explicit McapFile(const std::filesystem::path& folder);

  McapWriter& writer() { return writer_; }
  /// A topic, for metadata.yaml too.
  uint16_t add_channel(const Topic& topic);
  /// Rows as JSON under `/log/NAME`, behind `root`. `begun_ns`: what its times count from, since 1970.
  void add(const NumberTable& table, int64_t begun_ns, const std::string& root = {});
  /// Makes the disk have all whole chunks.
  void sync() { writer_.sync(); }
  void close();
  McapCounts counts() const { return writer_.counts(); }

 private:
  std::filesystem::path folder_;
  McapWriter writer_;
  std::vector<std::pair<Topic, uint16_t>> topics_;
};

/// What one sensor sends, in a file that outlives it. Every member throws Error(Failure::Output). One thread.
class McapRecording {
 public:
  McapRecording(McapFile& file, const McapOptions& options);

  /// A frame with what was measured of it. `depth`: none where it is not known. `stamp_ns`: of the exposure,
  /// since 1970, or since the recording began where its date is not known; negative counts as 0. `source`: as
  /// Source::frame_name.
  void add(const Frame& frame, const Touch& touch, const std::optional<DepthMap>& depth, int64_t stamp_ns,
           std::string_view source = {});
  void add(const viz::Event& event, int64_t stamp_ns);

 private:
  void write(TopicKind kind, uint64_t sequence, int64_t stamp_ns);

  McapWriter& writer_;
  std::string root_;    ///< "/left" of two
  std::string sensor_;  ///< as frame_id names it
  MeasuredColumns columns_;
  std::map<TopicKind, uint16_t> channels_;
  MessageBytes message_;
};

}  // namespace palpate
