// Inside the guest: the kernel's virtual cameras, their knobs, and the rows of the matrix of results.
#pragma once

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/time.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <deque>
#include <functional>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "capture/v4l2/camera.h"
#include "capture/v4l2/device.h"

namespace palpate {

/// The cameras that tests/v4l2/matrix asks the kernel for.
inline constexpr const char* kFirst = "/dev/video0";   // a webcam
inline constexpr const char* kSecond = "/dev/video1";  // another
inline constexpr const char* kLoopIn = "/dev/video2";  // takes what is put out on the next
inline constexpr const char* kLoopOut = "/dev/video3";

inline Sensor gray_sensor(uint32_t bit_depth = 8) {
  Sensor s;
  s.name = "guest";
  s.pitch_mm_per_px = 0.05;
  s.bit_depth = bit_depth;
  s.saturation_gray = (1u << bit_depth) - 1;
  return s;
}

inline Sensor colour_sensor() {
  Sensor s = gray_sensor();
  s.channels = 3;
  return s;
}

/// The knobs of one node, turned from outside while someone else streams.
class Knobs {
 public:
  explicit Knobs(const std::string& node) : device_(node) {}
  const v4l2::Control& find(const std::string& name) {
    controls_ = device_.controls();
    for (const v4l2::Control& c : controls_)
      if (c.name == name) return c;
    throw std::runtime_error("no control " + name);
  }
  void turn(const std::string& name, int64_t value) {
    const int error = device_.set(find(name).id, value);
    if (error != 0) throw std::runtime_error(name + ": " + std::strerror(error));
  }
  /// By the name of one of its items.
  void choose(const std::string& name, const std::string& item) {
    for (const auto& [value, text] : std::vector(find(name).items))
      if (text == item) return turn(name, value);
    throw std::runtime_error(name + " has no " + item);
  }
  int64_t read(const std::string& name) { return find(name).value.value_or(-1); }

 private:
  v4l2::Device device_;
  std::vector<v4l2::Control> controls_;
};

/// One row of the matrix, said when the test ends.
struct Row {
  std::string camera = "webcam", format, size, rate = "-", fault = "none";
  uint64_t frames = 0;
  CaptureCounts counts;
  std::string copies = "-", found;
  bool failed = false;
};

inline std::string detail(const Source& source, const std::string& name) {
  for (const auto& [key, value] : source.details())
    if (key == name) return value;
  return {};
}
inline void fill_row(Row& r, const Source& source) {
  r.counts = source.counts();
  r.format = detail(source, "format");
  r.size = detail(source, "size");
  r.rate = detail(source, "rate");
  r.copies = detail(source, "copies per frame").substr(0, 1);
}

class Guest : public testing::Test {
 protected:
  void SetUp() override { reset(kFirst); }
  void TearDown() override {
    close_row();
    for (const Row& r : rows_)
      std::printf("row,%s,%s,%s,%s,%s,%llu,%llu,%llu,%llu,%s,%s,%s\n", r.camera.c_str(), r.format.c_str(),
                  r.size.c_str(), r.rate.c_str(), r.fault.c_str(), static_cast<unsigned long long>(r.frames),
                  static_cast<unsigned long long>(r.counts.lost),
                  static_cast<unsigned long long>(r.counts.damaged),
                  static_cast<unsigned long long>(r.counts.gaps), r.copies.c_str(), r.found.c_str(),
                  r.failed ? "failed" : "ok");
    std::fflush(stdout);
  }
  /// As the kernel made it, but with stamps of now and without text over the picture.
  static void reset(const std::string& node) {
    Knobs knobs(node);
    knobs.turn("timestamp_source", 1);
    knobs.turn("osd_text_mode", 2);
    knobs.turn("percentage_of_dropped_buffers", 0);
    knobs.turn("wrap_sequence_number", 0);
    knobs.turn("wrap_timestamp", 0);
    knobs.turn("test_pattern", 0);
    knobs.turn("gain_automatic", 0);
    for (const char* name : {"brightness", "contrast", "gain"}) knobs.turn(name, knobs.find(name).initial);
  }
  /// Opens a row; what fails from here on to the next is its failure.
  Row& row() {
    close_row();
    failures_before_ = rows_.empty() ? 0 : failures();
    return rows_.emplace_back();
  }

  static int failures() {
    const testing::TestResult& result = *testing::UnitTest::GetInstance()->current_test_info()->result();
    int count = 0;
    for (int i = 0; i < result.total_part_count(); ++i) count += result.GetTestPartResult(i).failed();
    return count;
  }
  void close_row() {
    if (!rows_.empty()) rows_.back().failed = failures() > failures_before_;
  }

  int failures_before_ = 0;
  std::deque<Row> rows_;  // rows are held by reference while more are added
};

inline void sleep_ms(int ms) {
  std::this_thread::sleep_for(std::chrono::milliseconds(ms));
}

}  // namespace palpate
