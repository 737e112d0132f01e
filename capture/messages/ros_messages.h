// Messages of ROS 2 made of a measured frame: image, depth, points, wrench.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "capture/messages/cdr.h"
#include "palpate/frame.h"
#include "palpate/pipeline.h"
#include "palpate/touch.h"

namespace palpate {

/// Header of a message: when the frame was exposed (CLOCK_REALTIME, ns since 1970) and of which sensor.
struct MessageHeader {
  int64_t time_ns = 0;
  std::string frame_id;
};

/// Depths of a frame as a message needs them.
struct DepthMap {
  std::span<const float> depth_mm;         ///< height x width, below rest level
  std::span<const uint16_t> confidence{};  ///< as Result::confidence(); empty: all is known
  uint32_t width = 0, height = 0;
  double pitch_mm_per_px = 0;
};

/// That of a frame; none where it has no surface, or its picture is damaged. The result outlives it.
std::optional<DepthMap> depth_map_of(const Result& result, const Touch& touch, const FrameFormat& format,
                                     double pitch_mm_per_px);

/// sensor_msgs/msg/Image: mono8, mono16 (values in the low bits) or rgb8.
void write_image(MessageBytes& out, const MessageHeader& header, const Frame& frame);
/// sensor_msgs/msg/CompressedImage: JPEG, of more than 8 bits the upper ones.
void write_compressed(MessageBytes& out, const MessageHeader& header, const Frame& frame);
/// sensor_msgs/msg/Image of 32FC1: depth in metres, NaN where it is not known.
void write_depth_image(MessageBytes& out, const MessageHeader& header, const DepthMap& map);
/// The same of every n-th pixel in rows and columns, with at most kPreview_px of them in each.
void write_depth_preview(MessageBytes& out, const MessageHeader& header, const DepthMap& map);
inline constexpr uint32_t kPreview_px = 200;
/// sensor_msgs/msg/PointCloud2, organised: x right, y down from the frame's middle, z depth into the pad,
/// metres, float32; NaN where it is not known.
void write_cloud(MessageBytes& out, const MessageHeader& header, const DepthMap& map);

/// Force and moment on the pad about the frame's middle: x right, y down, z into the pad.
struct MessageWrench {
  double force_N[3];    ///< NaN: not known
  double torque_Nm[3];  ///< NaN: not known
};
/// By the elastic layer, else the calibrated force with its shear, whose moments are not known. None while
/// its normal force is not valid.
std::optional<MessageWrench> wrench_of(const Touch& touch);
/// geometry_msgs/msg/WrenchStamped.
void write_wrench(MessageBytes& out, const MessageHeader& header, const MessageWrench& wrench);

/// Definition of a message by its name ("sensor_msgs/msg/Image"), with those that it needs, as bags hold them
/// (schema encoding ros2msg). Empty for others than those above.
std::string ros_schema(const std::string& name);

}  // namespace palpate
