// Messages for others: bytes as ROS 2 has them, names of topics, stamps.
#include "capture/messages/ros_messages.h"

#include <cmath>
#include <cstring>
#include <limits>

#include <opencv2/core.hpp>

#include "capture/files/images/images.h"
#include "capture/files/images/jpeg_writer.h"
#include "capture/messages/topics.h"
#include "capture/messages/touch_json.h"
#include "engine/base/clock.h"
#include "tests/support/json.h"
#include "tests/support/text_file.h"

namespace palpate {
namespace {

using Bytes = std::vector<uint8_t>;

const MessageHeader kHeader{.time_ns = 1'700'000'000'000'000'005, .frame_id = "gel"};
// Little endian; 1700000000 s, 5 ns, 4 letters with the zero byte.
const Bytes kHeaderBytes = {0, 1, 0, 0, 0x00, 0xf1, 0x53, 0x65, 5, 0, 0, 0, 4, 0, 0, 0, 'g', 'e', 'l', 0};

Bytes operator+(Bytes a, const Bytes& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}
template <typename T>
Bytes bytes_of(std::initializer_list<T> values) {
  Bytes bytes(values.size() * sizeof(T));
  std::memcpy(bytes.data(), values.begin(), bytes.size());
  return bytes;
}
Bytes text(const std::string& letters, size_t padding) {
  Bytes bytes = bytes_of({static_cast<uint32_t>(letters.size() + 1)});
  bytes.insert(bytes.end(), letters.begin(), letters.end());
  bytes.resize(bytes.size() + 1 + padding);
  return bytes;
}

Frame frame_of(const FrameFormat& format, const Bytes& pixels) {
  Frame frame;
  frame.reshape(format);
  frame.bytes = pixels;
  return frame;
}

TEST(Messages, ImagesAreThoseOfRos) {
  MessageBytes message = {9, 9, 9};  // of an earlier message
  write_image(message, kHeader, frame_of({2, 1, 1, 8}, {7, 8}));
  const Bytes size = bytes_of<uint32_t>({1, 2});
  const auto tail = [&](const char* encoding, uint32_t step, const Bytes& pixels) {
    const size_t letters = std::strlen(encoding) + 1;
    Bytes bytes = size + text(encoding, 0) + Bytes{0};
    bytes.resize(bytes.size() + (4 - (letters + 1) % 4) % 4);
    return kHeaderBytes + bytes + bytes_of<uint32_t>({step, static_cast<uint32_t>(pixels.size())}) + pixels;
  };
  EXPECT_EQ(message, tail("mono8", 2, {7, 8}));
  write_image(message, kHeader, frame_of({2, 1, 1, 12}, {0x34, 0x02, 0xff, 0x0f}));
  EXPECT_EQ(message, tail("mono16", 4, {0x34, 0x02, 0xff, 0x0f}));
  write_image(message, kHeader, frame_of({2, 1, 3, 8}, {1, 2, 3, 4, 5, 6}));
  EXPECT_EQ(message, tail("rgb8", 6, {1, 3, 5, 2, 4, 6}));
}

TEST(Messages, DepthIsInMetresAndNanWhereUnknown) {
  const std::vector<float> depth_mm = {0.5f, -0.25f};
  const std::vector<uint16_t> confidence = {0x0400, 0x01ff};
  MessageBytes message;
  const DepthMap map{depth_mm, confidence, 2, 1, 0.1};
  write_depth_image(message, kHeader, map);
  float depth_m[2];
  ASSERT_EQ(message.size(), kHeaderBytes.size() + 8 + 4 + 6 + 2 + 8 + 8);
  std::memcpy(depth_m, message.data() + message.size() - 8, 8);
  EXPECT_TRUE(std::isnan(depth_m[0]));
  EXPECT_EQ(depth_m[1], -0.00025f);

  write_cloud(message, kHeader, map);
  float points[6];
  ASSERT_GT(message.size(), 25u);
  std::memcpy(points, message.data() + message.size() - 25, 24);
  for (int i = 0; i < 3; ++i) EXPECT_TRUE(std::isnan(points[i]));
  EXPECT_EQ(points[3], 0.00005f);
  EXPECT_EQ(points[4], 0);
  EXPECT_EQ(points[5], -0.00025f);
  EXPECT_EQ(message.back(), 0);  // is_dense
  const Bytes fields = bytes_of<uint32_t>({1, 2, 3}) + text("x", 2) + bytes_of<uint32_t>({0}) +
                       Bytes{7, 0, 0, 0} + bytes_of<uint32_t>({1});
  EXPECT_EQ(Bytes(message.begin() + 20, message.begin() + 20 + static_cast<long>(fields.size())), fields);
  write_cloud(message, kHeader, {depth_mm, {}, 2, 1, 0.1});
  EXPECT_EQ(message.back(), 1);
}

TEST(Messages, WrenchIsThereWhileItIsValid) {
  Touch touch;
  MessageBytes message;
  EXPECT_FALSE(wrench_of(touch));
  TractionSummary& on_pad = touch.traction.emplace();
  on_pad.fz_N = {2, 0.1, Validity::AtBorder};
  EXPECT_FALSE(wrench_of(touch));
  on_pad.fz_N.validity = on_pad.fx_N.validity = on_pad.mx_Nmm.validity = Validity::Valid;
  on_pad.fx_N.value = -0.5;
  on_pad.mx_Nmm.value = 1500;
  ASSERT_TRUE(wrench_of(touch));
  write_wrench(message, kHeader, *wrench_of(touch));
  ASSERT_EQ(message.size(), kHeaderBytes.size() + 48);  // 16 bytes of header: eights follow without a gap
  double values[6];
  std::memcpy(values, message.data() + kHeaderBytes.size(), sizeof values);
  EXPECT_EQ(values[0], -0.5);
  EXPECT_TRUE(std::isnan(values[1]));
  EXPECT_EQ(values[2], 2);
  EXPECT_EQ(values[3], 1.5);
  // A longer name moves the numbers to the next multiple of eight, from behind the 4 bytes.
  write_wrench(message, {0, "longer"}, *wrench_of(touch));
  EXPECT_EQ(message.size(), 4u + 24 + 48);
}

TEST(Messages, StampsHoldTheTimeOfExposure) {
  MessageBytes message;
  write_image(message, {-1, ""}, frame_of({1, 1, 1, 8}, {0}));
  int32_t seconds = 0;
  uint32_t nanoseconds = 0;
  std::memcpy(&seconds, message.data() + 4, 4);
  std::memcpy(&nanoseconds, message.data() + 8, 4);
  EXPECT_EQ(seconds, -1);
  EXPECT_EQ(nanoseconds, 999'999'999u);
  const WallClock clock = wall_clock();
  EXPECT_GE(clock.error_ns, 0);
  EXPECT_LT(clock.error_ns, 1'000'000'000);
  EXPECT_GT(monotonic_ns() + clock.ahead_ns, 1'700'000'000'000'000'000);
}

TEST(Messages, TopicsNameTheSensor) {
  EXPECT_EQ(topic_name("GelSight Mini (left)"), "gelsight_mini_left");
  EXPECT_EQ(topic_name("9DTact"), "sensor_9dtact");
  EXPECT_EQ(topic_name("--"), "sensor");
  EXPECT_EQ(topic_name("\xc3\xa4"
                       "B"),
            "b");
  std::vector<std::string> names;
  Sensor sensor;
  sensor.name = "gel";
  sensor.pitch_mm_per_px = 0.1;
  for (const Topic& topic : topics_of(sensor, Output::Force | Output::Surface, {}, "left")) {
    names.push_back(topic.name);
    EXPECT_EQ(topic.encoding == "json", topic.schema_encoding == "jsonschema");
    if (topic.encoding == "json") {
      EXPECT_EQ(parse_json(topic.schema).at("type"), "object");
    } else {
      EXPECT_NE(topic.schema.find("\nMSG: std_msgs/Header\n"), std::string::npos);
      EXPECT_NE(topic.schema.find("\nMSG: builtin_interfaces/Time\n"), std::string::npos);
    }
  }
  EXPECT_EQ(names, (std::vector<std::string>{"/left/gel/image", "/left/gel/image/compressed",
                                             "/left/gel/depth", "/left/gel/depth/preview", "/left/gel/cloud",
                                             "/left/gel/wrench", "/left/gel/touch", "/left/gel/events"}));
}

TEST(Messages, PreviewAndJpegShowTheSameInLess) {
  std::vector<float> depth_mm(640 * 480);
  for (size_t i = 0; i < depth_mm.size(); ++i) depth_mm[i] = static_cast<float>(i);
  MessageBytes message;
  write_depth_preview(message, kHeader, {depth_mm, {}, 640, 480, 0.1});
  std::vector<float> small(160 * 120);
  ASSERT_GT(message.size(), 4 * small.size());
  std::memcpy(small.data(), message.data() + message.size() - 4 * small.size(), 4 * small.size());
  EXPECT_EQ(small[0], 0);
  EXPECT_FLOAT_EQ(small[161], 1e-3f * (4 * 640 + 4));
  Frame frame;
  frame.reshape({64, 48, 3, 8});
  for (size_t i = 0; i < frame.bytes.size(); ++i)
    frame.bytes[i] = static_cast<uint8_t>(100 + 50 * (i / (64 * 48)));
  const std::vector<uint8_t> jpeg = encode_jpeg(frame, 90);
  const std::filesystem::path file = std::filesystem::temp_directory_path() / "palpate-messages-test.jpg";
  spill(file, std::string(jpeg.begin(), jpeg.end()));
  const cv::Mat image = read_image(file);
  std::filesystem::remove(file);
  ASSERT_EQ(image.size(), cv::Size(64, 48));
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(image.at<cv::Vec3b>(20, 20)[c], 200 - 50 * c, 3);
}

TEST(Messages, EventsKeepTheirText) {
  const Json event =
      parse_json(event_json({.frame = 12, .time_s = 0.4, .kind = "mark", .text = "a \"b\"\n"}, 5));
  EXPECT_EQ(event.at("frame"), 12);
  EXPECT_EQ(event.at("time_s"), 0.4);
  EXPECT_EQ(event.at("text"), "a \"b\"\n");
  for (const auto& [key, value] : event.items())
    EXPECT_TRUE(parse_json(event_json_schema()).at("properties").contains(key)) << key;
}

}  // namespace
}  // namespace palpate
