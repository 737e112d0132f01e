// Common parts of the tests of the whole engine.
#pragma once

#include <cstring>
#include <string>

#include "palpate/pipeline.h"
#include "tests/support/gpu_fixture.h"

namespace palpate {

inline constexpr auto kForceOnly = Output::Force;

inline PipelineOptions force_only(uint32_t slots = 1) {
  return {kForceOnly, SurfaceSolver::Live, slots};
}

/// Equal to the last bit: everything that comes from integer sums.
inline void expect_identical(const Touch& a, const Touch& b, const std::string& what) {
  const auto bits = [](double value) {
    uint64_t whole = 0;
    std::memcpy(&whole, &value, sizeof whole);
    return whole;
  };
  EXPECT_EQ(a.sequence, b.sequence) << what;
  EXPECT_EQ(a.time_ns, b.time_ns) << what;
  EXPECT_EQ(a.contact, b.contact) << what;
  EXPECT_EQ(bits(a.gray_sum), bits(b.gray_sum)) << what;
  EXPECT_EQ(bits(a.centroid_x_px), bits(b.centroid_x_px)) << what;
  EXPECT_EQ(bits(a.centroid_y_px), bits(b.centroid_y_px)) << what;
  EXPECT_EQ(a.area_px, b.area_px) << what;
  EXPECT_EQ(bits(a.ellipse.major_mm), bits(b.ellipse.major_mm)) << what;
  EXPECT_EQ(bits(a.ellipse.minor_mm), bits(b.ellipse.minor_mm)) << what;
  EXPECT_EQ(bits(a.ellipse.angle_rad), bits(b.ellipse.angle_rad)) << what;
  EXPECT_EQ(bits(a.peak_gray), bits(b.peak_gray)) << what;
  EXPECT_EQ(a.saturated_px, b.saturated_px) << what;
  EXPECT_EQ(bits(a.force_N.value), bits(b.force_N.value)) << what;
  EXPECT_EQ(a.force_N.validity, b.force_N.validity) << what;
  EXPECT_EQ(bits(a.shear_x_N.value), bits(b.shear_x_N.value)) << what;
  EXPECT_EQ(bits(a.shear_y_N.value), bits(b.shear_y_N.value)) << what;
  EXPECT_EQ(a.slip, b.slip) << what;
}

/// On the device, fails on validation messages.
class PipelineTest : public GpuTest {};

}  // namespace palpate
