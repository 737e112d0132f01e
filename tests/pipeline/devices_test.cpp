// One scene on every device of the machine, and on each in every way that devices may need: sums and contacts
// are the same to the last bit, surfaces within rounding.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "engine/pipeline/surface_map.h"
#include "tests/pipeline/pipeline_fixture.h"
#include "tests/scenes/synthetic_run.h"
#include "tests/support/pipelines.h"
#include "tests/support/second_driver.h"
#include "tests/support/thorough.h"

namespace palpate {
namespace {

struct Way {
  std::string name;
  std::unique_ptr<gpu::Context> context;
};

/// Results of a few frames.
struct Measured {
  std::vector<Touch> touches;
  std::vector<std::vector<float>> depth_mm;
};

Measured measure(gpu::Context& context, SyntheticRun& scene, const PipelineOptions& options) {
  const uint64_t frames = of_sweep<uint64_t>(3, 2);
  Pipeline pipeline = scene.pipeline(context, options);
  Measured measured;
  for (uint64_t k = scene.count() / 2; k < scene.count() / 2 + frames; ++k) {
    EXPECT_TRUE(pipeline.submit(scene.frame(k)));
    const std::optional<Result> result = pipeline.wait();
    measured.touches.push_back(result->touch);
    if (surface_of(*result).buffer) measured.depth_mm.push_back(depth_map(*result));
  }
  return measured;
}

/// Root of the mean square of the difference, over that of the depth itself.
double relative_difference(const std::vector<float>& a, const std::vector<float>& b) {
  double apart = 0, whole = 0;
  for (size_t i = 0; i < a.size(); ++i) {
    apart += std::pow(double{a[i]} - double{b[i]}, 2);
    whole += std::pow(double{a[i]}, 2);
  }
  EXPECT_GT(whole, 0);
  return std::sqrt(apart / whole);
}

void expect_same_contacts(const Touch& a, const Touch& b, const std::string& what) {
  ASSERT_EQ(a.contacts.size(), b.contacts.size()) << what;
  for (size_t i = 0; i < a.contacts.size(); ++i) {
    EXPECT_EQ(a.contacts[i].id, b.contacts[i].id) << what;
    EXPECT_EQ(a.contacts[i].area_px, b.contacts[i].area_px) << what;
    EXPECT_EQ(a.contacts[i].gray_sum, b.contacts[i].gray_sum) << what;
    EXPECT_EQ(a.contacts[i].centroid_x_px, b.contacts[i].centroid_x_px) << what;
    EXPECT_EQ(a.contacts[i].centroid_y_px, b.contacts[i].centroid_y_px) << what;
  }
}

/// The skin is followed in single precision: so is the shear that it gives.
void expect_same_skin(const Touch& a, const Touch& b, const std::string& what) {
  constexpr float kShift_px = 1e-4f;
  EXPECT_EQ(a.gray_sum, b.gray_sum) << what;
  EXPECT_EQ(a.area_px, b.area_px) << what;
  EXPECT_NEAR(a.shear_x_N.value, b.shear_x_N.value, 1e-5) << what;
  EXPECT_NEAR(a.shear_y_N.value, b.shear_y_N.value, 1e-5) << what;
  EXPECT_GT(a.skin_points.size(), 100u) << what;
  ASSERT_EQ(a.skin_points.size(), b.skin_points.size()) << what;
  for (size_t i = 0; i < a.skin_points.size(); ++i) {
    EXPECT_NEAR(a.skin_points[i].shift_x_px, b.skin_points[i].shift_x_px, kShift_px) << what;
    EXPECT_NEAR(a.skin_points[i].shift_y_px, b.skin_points[i].shift_y_px, kShift_px) << what;
  }
}

class Devices : public testing::Test {
 protected:
  /// Every usable device as it is, then without what some devices lack: opened once, since each compiles its
  /// kernels.
  static void SetUpTestSuite() {
    const WithSecondDriver second;
    for (const gpu::DeviceReport& device : gpu::list_devices()) {
      if (!device.refusals.empty()) continue;
      gpu::ContextOptions usual;
      usual.device = std::to_string(device.index);
      usual.validation = true;
      const gpu::Context& plain =
          *ways_.emplace_back(Way{device.name, std::make_unique<gpu::Context>(usual)}).context;
      for (bool gpu::ContextOptions::*feature :
           {&gpu::ContextOptions::push_descriptors, &gpu::ContextOptions::texel_buffers}) {
        gpu::ContextOptions options = usual;
        options.*feature = false;
        auto without = std::make_unique<gpu::Context>(options);
        const bool differs =
            (plain.push_descriptors() != nullptr) != (without->push_descriptors() != nullptr) ||
            plain.storage_texels() != without->storage_texels();
        const char* lacks =
            feature == &gpu::ContextOptions::texel_buffers ? ", storage buffers" : ", plain sets";
        if (differs) ways_.push_back({device.name + lacks, std::move(without)});
      }
    }
  }
  static void TearDownTestSuite() { ways_.clear(); }

  static void expect_agreement(const std::string& text, const PipelineOptions& options, double surface) {
    SyntheticRun scene(text);
    std::optional<Measured> first;
    for (const Way& way : ways_) {
      const size_t seen = way.context->validation_messages().size();
      const Measured found = measure(*way.context, scene, options);
      const std::vector<std::string> messages = way.context->validation_messages();
      for (size_t i = seen; i < messages.size(); ++i) ADD_FAILURE() << way.name << ": " << messages[i];
      if (!first) {
        first = found;
        EXPECT_TRUE(first->touches.front().contact) << text;
        std::printf("%s\n  %-52s\n", text.c_str(), way.name.c_str());
        continue;
      }
      double worst = 0;
      for (size_t k = 0; k < found.touches.size(); ++k) {
        const std::string what = text + " on " + way.name;
        if (wants(options.outputs, Output::Skin))
          expect_same_skin(found.touches[k], first->touches[k], what);
        else
          expect_identical(found.touches[k], first->touches[k], what);
        expect_same_contacts(found.touches[k], first->touches[k], what);
        if (!first->depth_mm.empty())
          worst = std::max(worst, relative_difference(first->depth_mm[k], found.depth_mm[k]));
      }
      std::printf("  %-52s sums the same; surface %.1e apart (relative RMS)\n", way.name.c_str(), worst);
      EXPECT_LT(worst, surface) << text << " on " << way.name;
    }
  }

  static inline std::vector<Way> ways_;
};

TEST_F(Devices, ThereAreTwo) {
  std::string names;
  for (const Way& way : ways_) names += "\n  " + way.name;
  std::printf("devices:%s\n", names.c_str());
  if (second_driver().empty())
    GTEST_SKIP() << "*** ONE VULKAN DRIVER ONLY: SwiftShader (package chromium-common) is not installed ***";
  EXPECT_NE(names.find("SwiftShader"), std::string::npos);
}

TEST_F(Devices, AgreeOnAWaveguide) {
  expect_agreement("press?size=640x480", {Output::Force | Output::Surface | Output::Contacts}, 2e-5);
}
TEST_F(Devices, AgreeOnShading) {
  expect_agreement("slide?mode=lambert&size=333x251", {Output::Force | Output::Surface | Output::Confidence},
                   2e-5);
}
TEST_F(Devices, AgreeOnAGel) {
  PipelineOptions options{Output::Force | Output::Surface | Output::Contacts};
  expect_agreement("press?mode=gel&size=320x240&force=1", options, 2e-5);
}
TEST_F(Devices, AgreeOnAGelWithMarkersAndItsSkin) {
  PipelineOptions options{Output::Force | Output::Surface | Output::Confidence | Output::Skin,
                          SurfaceSolver::Best};
  expect_agreement("drag?size=320x240&mode=gel&skin=markers", options, 2e-5);
}
TEST_F(Devices, AgreeOnSixteenBits) {
  expect_agreement("press?size=641x479&bits=12", {Output::Force}, 1);
}

}  // namespace
}  // namespace palpate
