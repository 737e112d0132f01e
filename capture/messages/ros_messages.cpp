#include "capture/messages/ros_messages.h"

#include <algorithm>
#include <array>
#include <limits>

#include "capture/files/images/jpeg_writer.h"
#include "engine/base/numbers.h"

namespace palpate {
namespace {

constexpr float kUnknown = std::numeric_limits<float>::quiet_NaN();
constexpr float kMetres = 1e-3f;  // in a millimetre

void add_header(CdrWriter& out, const MessageHeader& header) {
  constexpr int64_t kSecond_ns = 1'000'000'000;
  int64_t seconds = header.time_ns / kSecond_ns, rest = header.time_ns % kSecond_ns;
  if (rest < 0) --seconds, rest += kSecond_ns;
  out.add(static_cast<int32_t>(seconds));
  out.add(static_cast<uint32_t>(rest));
  out.add(header.frame_id);
}

/// Up to the pixels.
void add_image_head(CdrWriter& out, const MessageHeader& header, uint32_t width, uint32_t height,
                    const char* encoding, uint32_t pixel_bytes) {
  add_header(out, header);
  out.add(height);
  out.add(width);
  out.add(std::string_view(encoding));
  out.add(uint8_t{0});  // little endian
  out.add(width * pixel_bytes);
}

bool known(const DepthMap& map, size_t i) {
  return map.confidence.empty() || (map.confidence[i] & 0xff) != 0;
}

float depth_at(const DepthMap& map, size_t i) {
  return known(map, i) ? kMetres * map.depth_mm[i] : kUnknown;
}

constexpr const char* kHeaderSchema = R"(MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id)";
constexpr const char* kTimeSchema = R"(MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec)";
constexpr const char* kPointFieldSchema = R"(MSG: sensor_msgs/PointField
uint8 INT8=1
uint8 UINT8=2
uint8 INT16=3
uint8 UINT16=4
uint8 INT32=5
uint8 UINT32=6
uint8 FLOAT32=7
uint8 FLOAT64=8
string name
uint32 offset
uint8 datatype
uint32 count)";
constexpr const char* kWrenchSchema = R"(MSG: geometry_msgs/Wrench
geometry_msgs/Vector3 force
geometry_msgs/Vector3 torque)";
constexpr const char* kVectorSchema = R"(MSG: geometry_msgs/Vector3
float64 x
float64 y
float64 z)";

struct RosSchema {
  const char* name;
  const char* text;
  std::array<const char*, 4> needs;
};
constexpr std::array kSchemas = {
    RosSchema{"sensor_msgs/msg/Image",
              "std_msgs/Header header\nuint32 height\nuint32 width\nstring encoding\nuint8 is_bigendian\n"
              "uint32 step\nuint8[] data",
              {kHeaderSchema, kTimeSchema}},
    RosSchema{"sensor_msgs/msg/CompressedImage",
              "std_msgs/Header header\nstring format\nuint8[] data",
              {kHeaderSchema, kTimeSchema}},
    RosSchema{"sensor_msgs/msg/PointCloud2",
              "std_msgs/Header header\nuint32 height\nuint32 width\nsensor_msgs/PointField[] fields\n"
              "bool is_bigendian\nuint32 point_step\nuint32 row_step\nuint8[] data\nbool is_dense",
              {kHeaderSchema, kTimeSchema, kPointFieldSchema}},
    RosSchema{"geometry_msgs/msg/WrenchStamped",
              "std_msgs/Header header\ngeometry_msgs/Wrench wrench",
              {kHeaderSchema, kTimeSchema, kWrenchSchema, kVectorSchema}}};

}  // namespace

std::optional<DepthMap> depth_map_of(const Result& result, const Touch& touch, const FrameFormat& format,
                                     double pitch_mm_per_px) {
  if (!touch.surface || touch.picture != PictureFault::None) return std::nullopt;
  const std::span<const uint16_t> confidence =
      touch.confidence ? result.confidence() : std::span<const uint16_t>();
  return DepthMap{result.depth_mm(), confidence, format.width, format.height, pitch_mm_per_px};
}

void write_image(MessageBytes& out, const MessageHeader& header, const Frame& frame) {
  const FrameFormat& f = frame.format;
  CdrWriter cdr(out);
  const bool colour = f.channels == 3;
  const auto pixel_bytes = static_cast<uint32_t>(f.channels * f.bytes_per_pixel());
  add_image_head(cdr, header, f.width, f.height,
                 colour            ? "rgb8"
                 : f.bit_depth > 8 ? "mono16"
                                   : "mono8",
                 pixel_bytes);
  uint8_t* to = cdr.add_bytes(f.frame_bytes());
  if (!colour) {
    std::memcpy(to, frame.pixels(), f.frame_bytes());
    return;
  }
  const uint8_t *red = frame.pixels(), *green = red + f.plane_bytes(), *blue = green + f.plane_bytes();
  for (size_t i = 0; i < f.plane_bytes(); ++i) {
    to[3 * i] = red[i];
    to[3 * i + 1] = green[i];
    to[3 * i + 2] = blue[i];
  }
}

void write_depth_image(MessageBytes& out, const MessageHeader& header, const DepthMap& map) {
  CdrWriter cdr(out);
  add_image_head(cdr, header, map.width, map.height, "32FC1", sizeof(float));
  uint8_t* to = cdr.add_bytes(map.depth_mm.size_bytes());
  for (size_t i = 0; i < map.depth_mm.size(); ++i, to += sizeof(float)) {
    const float depth_m = depth_at(map, i);
    std::memcpy(to, &depth_m, sizeof depth_m);
  }
}

void write_compressed(MessageBytes& out, const MessageHeader& header, const Frame& frame) {
  constexpr int kQuality = 80;
  CdrWriter cdr(out);
  add_header(cdr, header);
  cdr.add(std::string_view("jpeg"));
  const std::vector<uint8_t> jpeg = encode_jpeg(frame, kQuality);
  std::memcpy(cdr.add_bytes(jpeg.size()), jpeg.data(), jpeg.size());
}

void write_depth_preview(MessageBytes& out, const MessageHeader& header, const DepthMap& map) {
  const uint32_t step = (std::max(map.width, map.height) + kPreview_px - 1) / kPreview_px;
  const uint32_t width = (map.width + step - 1) / step, height = (map.height + step - 1) / step;
  CdrWriter cdr(out);
  add_image_head(cdr, header, width, height, "32FC1", sizeof(float));
  uint8_t* to = cdr.add_bytes(size_t{width} * height * sizeof(float));
  for (uint32_t y = 0; y < map.height; y += step)
    for (uint32_t x = 0; x < map.width; x += step, to += sizeof(float)) {
      const float depth_m = depth_at(map, size_t{y} * map.width + x);
      std::memcpy(to, &depth_m, sizeof depth_m);
    }
}

void write_cloud(MessageBytes& out, const MessageHeader& header, const DepthMap& map) {
  constexpr uint8_t kFloat32 = 7;
  constexpr uint32_t kPoint_B = 3 * sizeof(float);
  CdrWriter cdr(out);
  add_header(cdr, header);
  cdr.add(map.height);
  cdr.add(map.width);
  cdr.add_length(3);
  uint32_t offset = 0;
  for (const char* axis : {"x", "y", "z"}) {
    cdr.add(std::string_view(axis));
    cdr.add(offset);
    cdr.add(kFloat32);
    cdr.add(uint32_t{1});
    offset += sizeof(float);
  }
  cdr.add(false);
  cdr.add(kPoint_B);
  cdr.add(kPoint_B * map.width);
  uint8_t* to = cdr.add_bytes(map.depth_mm.size() * kPoint_B);
  const double pitch_m = 1e-3 * map.pitch_mm_per_px;
  const double middle_x = 0.5 * (map.width - 1.0), middle_y = 0.5 * (map.height - 1.0);
  bool dense = true;
  for (uint32_t y = 0; y < map.height; ++y)
    for (uint32_t x = 0; x < map.width; ++x, to += kPoint_B) {
      const size_t i = size_t{y} * map.width + x;
      const bool there = known(map, i);
      dense = dense && there;
      const std::array<float, 3> point = {there ? static_cast<float>(pitch_m * (x - middle_x)) : kUnknown,
                                          there ? static_cast<float>(pitch_m * (y - middle_y)) : kUnknown,
                                          depth_at(map, i)};
      std::memcpy(to, point.data(), kPoint_B);
    }
  cdr.add(dense);
}

std::optional<MessageWrench> wrench_of(const Touch& touch) {
  const auto known = [](const Estimate& estimate, double factor = 1) {
    return estimate.valid() ? factor * estimate.value : kNaN;
  };
  if (touch.traction && touch.traction->fz_N.valid()) {
    const TractionSummary& t = *touch.traction;
    return MessageWrench{{known(t.fx_N), known(t.fy_N), t.fz_N.value},
                         {known(t.mx_Nmm, 1e-3), known(t.my_Nmm, 1e-3), known(t.mz_Nmm, 1e-3)}};
  }
  if (!touch.force_N.valid()) return std::nullopt;
  return MessageWrench{{known(touch.shear_x_N), known(touch.shear_y_N), touch.force_N.value},
                       {kNaN, kNaN, kNaN}};
}

void write_wrench(MessageBytes& out, const MessageHeader& header, const MessageWrench& wrench) {
  CdrWriter cdr(out);
  add_header(cdr, header);
  for (const double force_N : wrench.force_N) cdr.add(force_N);
  for (const double torque_Nm : wrench.torque_Nm) cdr.add(torque_Nm);
}

std::string ros_schema(const std::string& name) {
  for (const RosSchema& schema : kSchemas) {
    if (name != schema.name) continue;
    std::string text = schema.text;
    for (const char* needed : schema.needs)
      if (needed) text += "\n" + std::string(80, '=') + "\n" + needed;
    return text;
  }
  return {};
}

}  // namespace palpate
