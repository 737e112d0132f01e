#include "capture/messages/topics.h"

#include "capture/messages/ros_messages.h"
#include "capture/messages/touch_json.h"

namespace palpate {

std::string topic_name(const std::string& sensor_name) {
  std::string name;
  for (const char c : sensor_name) {
    const bool plain = (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9');
    const bool capital = c >= 'A' && c <= 'Z';
    if (plain || capital)
      name += capital ? static_cast<char>(c - 'A' + 'a') : c;
    else if (!name.empty() && name.back() != '_')
      name += '_';
  }
  while (!name.empty() && name.back() == '_') name.pop_back();
  if (name.empty()) return "sensor";
  return name.front() >= '0' && name.front() <= '9' ? "sensor_" + name : name;
}

bool is_picture(TopicKind kind) {
  return kind != TopicKind::Wrench && kind != TopicKind::Touch && kind != TopicKind::Events &&
         kind != TopicKind::Grip;
}

std::vector<Topic> topics_of(const Sensor& sensor, Outputs outputs, MeasuredColumns columns,
                             const std::string& side) {
  const std::string root = (side.empty() ? "/" : "/" + side + "/") + topic_name(sensor.name) + "/";
  std::vector<Topic> topics;
  const auto ros = [&](TopicKind kind, const char* name, const char* schema) {
    topics.push_back({kind, root + name, "cdr", schema, "ros2msg", ros_schema(schema)});
  };
  ros(TopicKind::Image, "image", "sensor_msgs/msg/Image");
  ros(TopicKind::Compressed, "image/compressed", "sensor_msgs/msg/CompressedImage");
  if (wants(outputs, Output::Surface)) {
    ros(TopicKind::Depth, "depth", "sensor_msgs/msg/Image");
    ros(TopicKind::Preview, "depth/preview", "sensor_msgs/msg/Image");
    if (has_scale(sensor)) ros(TopicKind::Cloud, "cloud", "sensor_msgs/msg/PointCloud2");
  }
  if (columns.groups & (MeasuredColumns::Force | MeasuredColumns::Traction))
    ros(TopicKind::Wrench, "wrench", "geometry_msgs/msg/WrenchStamped");
  topics.push_back(
      {TopicKind::Touch, root + "touch", "json", "palpate.Touch", "jsonschema", touch_json_schema(columns)});
  topics.push_back(
      {TopicKind::Events, root + "events", "json", "palpate.Event", "jsonschema", event_json_schema()});
  return topics;
}

Topic grip_topic() {
  return {TopicKind::Grip, "/grip", "json", "palpate.Grip", "jsonschema", grip_json_schema()};
}

}  // namespace palpate
