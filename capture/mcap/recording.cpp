#include "capture/mcap/recording.h"

#include <algorithm>
#include <cmath>

#include "capture/files/measurements.h"
#include "capture/files/output_file.h"
#include "engine/base/clock.h"
#include "engine/base/json.h"
#include "palpate/version.h"

namespace palpate {
namespace {

/// The description that rosbag2 keeps beside its files. Only its own messages are named: it would refuse to
/// play others, which the file holds all the same.
std::string rosbag_text(const std::vector<std::pair<Topic, uint16_t>>& topics, const McapCounts& counts) {
  const std::string start = std::to_string(counts.first_ns);
  const std::string length = std::to_string(counts.last_ns - counts.first_ns);
  std::string list;
  uint64_t all = 0;
  for (const auto& [topic, channel] : topics) {
    if (topic.encoding != "cdr") continue;
    const auto found = counts.messages.find(channel);
    const uint64_t messages = found == counts.messages.end() ? 0 : found->second;
    all += messages;
    list += "    - topic_metadata:\n        name: " + topic.name + "\n        type: " + topic.schema_name +
            "\n        serialization_format: cdr\n        offered_qos_profiles: \"\"\n      message_count: " +
            std::to_string(messages) + "\n";
  }
  const std::string count = std::to_string(all);
  return "rosbag2_bagfile_information:\n  version: 5\n  storage_identifier: mcap\n"
         "  duration:\n    nanoseconds: " +
         length + "\n  starting_time:\n    nanoseconds_since_epoch: " + start +
         "\n  message_count: " + count + "\n  topics_with_message_count:\n" + list +
         "  compression_format: \"\"\n  compression_mode: \"\"\n  relative_file_paths:\n    - " + kMcapFile +
         "\n  files:\n    - path: " + kMcapFile +
         "\n      starting_time:\n        nanoseconds_since_epoch: " + start +
         "\n      duration:\n        nanoseconds: " + length + "\n      message_count: " + count + "\n";
}

}  // namespace

McapFile::McapFile(const std::filesystem::path& folder)
    : folder_(folder), writer_(folder / kMcapFile, "ros2") {
  std::filesystem::remove(folder / kMcapYaml);  // of an earlier file
}

uint16_t McapFile::add_channel(const Topic& topic) {
  const uint16_t channel = writer_.add_channel(topic);
  topics_.emplace_back(topic, channel);
  return channel;
}

void McapFile::add(const NumberTable& table, int64_t begun_ns, const std::string& root) {
  const auto kind = [](const char* type) { return json::Value{{"type", type}}; };
  json::Value properties{{"time_s", kind("number")}, {"stamp", kind("object")}};
  for (const NumberColumn& column : table.columns) {
    properties[column.name] = kind("number");
    properties[column.name]["description"] = column.unit;
  }
  const json::Value schema{{"title", "palpate.Log"},
                           {"description", table.origin},
                           {"type", "object"},
                           {"properties", properties}};
  const uint16_t channel = add_channel({.kind = TopicKind::Events,
                                        .name = root + "/log/" + table.name,
                                        .encoding = "json",
                                        .schema_name = "palpate.Log",
                                        .schema_encoding = "jsonschema",
                                        .schema = schema.dump(-1, json::Utf8::Replace)});
  for (size_t row = 0; row < table.time_s.size(); ++row) {
    const int64_t stamp = std::max<int64_t>(begun_ns + std::llround(1e9 * table.time_s[row]), 0);
    json::Value line{{"time_s", table.time_s[row]},
                     {"stamp", {{"sec", stamp / 1'000'000'000}, {"nanosec", stamp % 1'000'000'000}}}};
    for (const NumberColumn& column : table.columns) line[column.name] = column.values[row];
    const std::string text = line.dump(-1, json::Utf8::Replace);
    const MessageBytes message(text.begin(), text.end());
    writer_.write(channel, static_cast<uint32_t>(row), stamp, message);
    writer_.end_chunk_if_due(monotonic_ns());
  }
}

void McapFile::close() {
  writer_.close();
  write_whole(folder_ / kMcapYaml, std::string_view(rosbag_text(topics_, writer_.counts())));
}

McapRecording::McapRecording(McapFile& file, const McapOptions& options)
    : writer_(file.writer()),
      root_(options.side.empty() ? "" : "/" + options.side),
      sensor_((options.side.empty() ? "" : options.side + "/") + topic_name(options.sensor.name)),
      columns_(options.columns) {
  // Topics that follow from another one are left out, the points unless they were asked for.
  for (const Topic& topic : topics_of(options.sensor, options.outputs, options.columns, options.side))
    if (topic.kind != TopicKind::Compressed && topic.kind != TopicKind::Preview &&
        (topic.kind != TopicKind::Cloud || options.cloud))
      channels_[topic.kind] = file.add_channel(topic);
  std::map<std::string, std::string> facts = options.facts;
  facts["sensor"] = options.sensor.name;
  if (has_scale(options.sensor)) facts["mm_per_px"] = shortest(options.sensor.pitch_mm_per_px);
  facts["program_version"] = PALPATE_VERSION_TEXT;
  writer_.add_metadata("palpate" + root_, facts);
  const std::string within = options.side.empty() ? "" : options.side + "/";
  if (has_scale(options.sensor))
    writer_.attach(within + "sensor.json", "application/json", sensor_text(options.sensor));
  if (!options.session.empty()) writer_.attach(within + "session.json", "application/json", options.session);
}

void McapRecording::write(TopicKind kind, uint64_t sequence, int64_t stamp_ns) {
  writer_.write(channels_.at(kind), static_cast<uint32_t>(sequence), stamp_ns, message_);
}

void McapRecording::add(const Frame& frame, const Touch& touch, const std::optional<DepthMap>& depth,
                        int64_t stamp_ns, std::string_view source) {
  const int64_t stamp = std::max<int64_t>(stamp_ns, 0);
  const MessageHeader header{stamp, sensor_};
  const auto wanted = [&](TopicKind kind) { return channels_.contains(kind); };
  write_image(message_, header, frame);
  write(TopicKind::Image, touch.sequence, stamp);
  if (depth && wanted(TopicKind::Depth)) {
    write_depth_image(message_, header, *depth);
    write(TopicKind::Depth, touch.sequence, stamp);
  }
  if (depth && wanted(TopicKind::Cloud)) {
    write_cloud(message_, header, *depth);
    write(TopicKind::Cloud, touch.sequence, stamp);
  }
  if (const auto wrench = wrench_of(touch); wrench && wanted(TopicKind::Wrench)) {
    write_wrench(message_, header, *wrench);
    write(TopicKind::Wrench, touch.sequence, stamp);
  }
  const std::string text = touch_json(touch, columns_, stamp, false, source);
  message_.assign(text.begin(), text.end());
  write(TopicKind::Touch, touch.sequence, stamp);
  writer_.end_chunk_if_due(monotonic_ns());
}

void McapRecording::add(const viz::Event& event, int64_t stamp_ns) {
  const int64_t stamp = std::max<int64_t>(stamp_ns, 0);
  const std::string text = event_json({event.frame, event.time_s, event.kind, event.text}, stamp);
  message_.assign(text.begin(), text.end());
  write(TopicKind::Events, event.frame, stamp);
}

}  // namespace palpate
