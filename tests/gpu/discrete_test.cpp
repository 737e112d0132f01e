// A card with memory of its own, as a layer (discrete_layer.cpp) shows the processor's driver: pixels go
// through staging buffers or are read from the host's pages, results come back by copies, and the numbers are
// those of the processor. Under validation.
#include <gtest/gtest.h>

#include <array>
#include <cstdlib>

#include "capture/synthetic/synthetic.h"
#include "engine/fem/solve.h"
#include "engine/gpu/buffer.h"
#include "engine/gpu/commands.h"
#include "engine/gpu/context.h"
#include "engine/gpu/tuning.h"
#include "engine/pipeline/pipeline_access.h"
#include "engine/pipeline/surface/surface_sample.h"
#include "palpate/pipeline.h"
#include "tests/support/leased_memory.h"
#include "tests/support/pipelines.h"

namespace palpate {
namespace {

class Discrete : public testing::Test {
 protected:
  void SetUp() override {
    gpu::ContextOptions options;
    options.validation = true;
    options.timers = true;
    plain_ = std::make_unique<gpu::Context>(options);
    if (!plain_->is_software()) GTEST_SKIP() << "a real GPU is the default device: see the other tests";
    setenv("VK_ADD_LAYER_PATH", PALPATE_LAYER_DIR, 1);
    setenv("VK_INSTANCE_LAYERS", "VK_LAYER_PALPATE_discrete", 1);
    card_ = std::make_unique<gpu::Context>(options);
    unsetenv("VK_INSTANCE_LAYERS");
    ASSERT_EQ(card_->report().type, "discrete GPU") << "the loader did not take the layer";
  }
  void TearDown() override {
    for (const auto* context : {plain_.get(), card_.get()}) {
      if (!context) continue;
      for (const std::string& message : context->validation_messages())
        ADD_FAILURE() << "validation: " << message;
    }
  }

  std::unique_ptr<gpu::Context> plain_, card_;
};

TEST_F(Discrete, MemoryOfItsOwnIsNotMapped) {
  EXPECT_FALSE(gpu::DeviceBuffer(*card_, "own", 64, gpu::Memory::Device).mapped());
  EXPECT_TRUE(gpu::DeviceBuffer(*card_, "up", 64, gpu::Memory::Upload).mapped());
  EXPECT_TRUE(gpu::DeviceBuffer(*card_, "down", 64, gpu::Memory::Readback).mapped());
}

TEST_F(Discrete, NumbersAreThoseOfTheProcessor) {
  for (const char* scene :
       {"synthetic:press?size=161x120&mode=gel", "synthetic:slide?size=160x121&bits=12"}) {
    for (const Solve solve : {Solve::Live, Solve::Exact}) {
      SCOPED_TRACE(scene);
      const SyntheticOptions synthetic = parse_synthetic(scene);
      SyntheticSensor source(synthetic);
      const Sensor sensor = synthetic_sensor(synthetic);
      PipelineOptions options =
          solved(solve, {.outputs = Output::Force | Output::Contacts | Output::Surface});
      const Tuning tuning = default_tuning(*plain_);  // the same tiles: the same order of sums
      const auto make = [&](gpu::Context& context, Upload upload) {
        options.upload = upload;
        Pipeline pipeline = PipelineAccess::tuned(context, sensor, source.format(), options, tuning);
        pipeline.set_background(*source.own_background());
        return pipeline;
      };
      Pipeline wanted = make(*plain_, Upload::Copy), staged = make(*card_, Upload::Copy),
               automatic = make(*card_, Upload::Auto);
      const auto pages = map_pages(source.format().frame_bytes());
      for (const uint64_t k : {0u, 10u, 20u, 21u}) {
        Frame image;
        ASSERT_TRUE(source.render(k, image));
        const Frame leased = lease(image, pages, 0);
        ASSERT_TRUE(wanted.submit(leased) && staged.submit(leased) && automatic.submit(leased));
        const Result a = *wanted.wait(), b = *staged.wait(), c = *automatic.wait();
        EXPECT_EQ(a.copies, 1u);
        EXPECT_EQ(b.copies, 1u);
        EXPECT_EQ(c.copies, card_->host_import_alignment() ? 0u : 1u) << "cards read in place by default";
        EXPECT_EQ(a.touch.gray_sum, b.touch.gray_sum);
        EXPECT_EQ(a.touch.gray_sum, c.touch.gray_sum);
        const std::vector<float> depth = depth_map(a);
        EXPECT_EQ(depth, depth_map(b)) << "frame " << k;
        EXPECT_EQ(depth, depth_map(c)) << "frame " << k;
        EXPECT_EQ(PipelineAccess::times(staged, b).front().name, "upload");
        // What the host has changed is on the card too.
        const double offset_mm = b.touch.surface->depth_offset_mm;
        const std::array<std::array<double, 2>, 2> places{{{80, 60}, {7, 100}}};
        const std::vector<float> own = sample_depths(*card_, surface_of(b), offset_mm, places);
        for (size_t i = 0; i < places.size(); ++i)
          EXPECT_EQ(own[i], depth[static_cast<size_t>(places[i][1]) * source.format().width +
                                  static_cast<size_t>(places[i][0])]);
      }
      // Frames that are not leased, after some that were: the staged pixels are these.
      Frame image;
      ASSERT_TRUE(source.render(15, image));
      ASSERT_TRUE(wanted.submit(image) && automatic.submit(image));
      const Result a = *wanted.wait(), c = *automatic.wait();
      EXPECT_EQ(c.copies, 1u);
      EXPECT_EQ(depth_map(a), depth_map(c));
    }
  }
}

TEST_F(Discrete, ForwardModelIsTheProcessors) {
  if (!card_->has_double()) GTEST_SKIP() << card_->report().name << " has no double precision";
  fem::Scene scene;
  scene.cells = {16, 16, 8};
  fem::Options options;
  options.threads = 1;
  const fem::Result wanted = fem::solve(scene, options);
  options.worker = fem::Worker::Device;
  options.device = [&] { return card_.get(); };
  const fem::Result found = fem::solve(scene, options);
  ASSERT_TRUE(wanted.converged && found.converged);
  EXPECT_NEAR(found.force_N / wanted.force_N, 1, 1e-6);
  EXPECT_NEAR(found.center_stress_Pa / wanted.center_stress_Pa, 1, 1e-5);
}

}  // namespace
}  // namespace palpate
