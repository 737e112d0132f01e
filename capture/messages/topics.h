// The topics under which a sensor's data go out, live and in files.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "engine/measure/measured_columns.h"
#include "palpate/frame.h"
#include "palpate/options.h"
#include "palpate/sensor.h"

namespace palpate {

enum class TopicKind : uint8_t {
  Image,
  Compressed,  ///< the same as JPEG, a thirtieth of the bytes
  Depth,
  Preview,  ///< of the depth, a part of its pixels
  Cloud,
  Wrench,
  Touch,
  Events,
  Grip,  ///< of two fingers
};
/// True for pictures, of which only the newest counts.
bool is_picture(TopicKind kind);

struct Topic {
  TopicKind kind = TopicKind::Image;
  std::string name;             ///< "/pad/depth"
  std::string encoding;         ///< of messages: "cdr" or "json"
  std::string schema_name;      ///< "sensor_msgs/msg/Image", "palpate.Touch"
  std::string schema_encoding;  ///< "ros2msg" or "jsonschema"
  std::string schema;
};

/// A sensor's name as a part of a topic and as a frame_id: small letters, digits and underscores, beginning
/// with a letter; "sensor" where it has none.
std::string topic_name(const std::string& sensor_name);

/// What a sensor with these outputs sends: image, touch and events always, depth, its preview and the cloud
/// with a surface (and a scale), wrench with a force. `side`: "left" or "right" of two, in front of the
/// sensor's name; empty: one.
std::vector<Topic> topics_of(const Sensor& sensor, Outputs outputs, MeasuredColumns columns,
                             const std::string& side = {});
/// "/grip": what two fingers hold, a message a pair of frames and one a frame without a partner.
Topic grip_topic();

}  // namespace palpate
