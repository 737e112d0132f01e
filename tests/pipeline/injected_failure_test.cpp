// A device that runs out of memory or is lost, at every call where that can happen: one clear line, nothing
// leaked, and the frames before it whole in their files. A small Vulkan layer (failing_layer.cpp) makes it
// happen.
#include <dlfcn.h>

#include <array>
#include <cmath>
#include <string_view>

#include "engine/gpu/context.h"
#include "engine/stages/surface/surface.h"
#include "palpate/error.h"
#include "palpate/pipeline.h"
#include "tests/scenes/dent.h"
#include "tests/support/failing_layer.h"
#include "tests/support/json.h"
#include "tests/support/leased_memory.h"
#include "tests/support/pipelines.h"
#include "tests/support/program_fixture.h"
#include "tests/support/stage_run.h"
#include "tests/support/thorough.h"

namespace palpate {
namespace {

constexpr const char* kLayer = "VK_LAYER_PALPATE_failing";

std::map<std::string, std::string> with_layer() {
  return {{"VK_LAYER_PATH", PALPATE_LAYER_DIR}, {"VK_INSTANCE_LAYERS", kLayer}};
}

/// A context of this process with the layer in it, and the layer's handles.
class FailingDevice : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    library_ = dlopen(PALPATE_LAYER_FILE, RTLD_NOW | RTLD_LOCAL);
    ASSERT_NE(library_, nullptr) << dlerror();
    arm_ = reinterpret_cast<decltype(arm_)>(dlsym(library_, "palpate_layer_arm"));
    calls_ = reinterpret_cast<decltype(calls_)>(dlsym(library_, "palpate_layer_calls"));
    failed_ = reinterpret_cast<decltype(failed_)>(dlsym(library_, "palpate_layer_failed"));
    live_ = reinterpret_cast<decltype(live_)>(dlsym(library_, "palpate_layer_live"));
    ASSERT_TRUE(arm_ && calls_ && failed_ && live_);
    for (const auto& [name, value] : with_layer()) setenv(name.c_str(), value.c_str(), 1);
    arm_("", 0, true);
    context_ = std::make_unique<gpu::Context>(gpu::ContextOptions{});
    ASSERT_GT(calls_(), 0u) << "the loader did not take the layer";
  }
  static void TearDownTestSuite() {
    context_.reset();
    EXPECT_EQ(live_(), 0) << "Vulkan objects were left behind";
    for (const auto& [name, value] : with_layer()) unsetenv(name.c_str());
    dlclose(library_);
  }

  /// Lets the first, second, ... fallible call of `act` fail until none is left; each must end in one
  /// Error(Device) and leave nothing. Returns how many there were.
  template <typename Act>
  static uint64_t fail_everywhere(const Act& act) {
    for (const char* call : {"vkQueueSubmit2", "vkWaitForFences"}) fail_each(call, false, act);
    uint64_t places = fail_each("", true, act);
    for (const std::string_view call : kOfKernels) places += fail_each(call.data(), true, act);
    return places;
  }
  template <typename Act>
  static uint64_t fail_each(const char* only, bool device_lost, const Act& act) {
    // What is made once and kept (caches) is there from now on; kernels too, unless their calls shall fail.
    const auto forget_kernels = [compiles = std::ranges::find(kOfKernels, only) != kOfKernels.end()] {
      if (context_ && compiles) context_->drop_unused_kernels();
    };
    arm_("", 0, true);
    act();
    forget_kernels();
    const int64_t before = live_();
    std::map<std::string, int> where;
    for (uint64_t at = 1;; ++at) {
      arm_(only, at, device_lost);
      try {
        act();
      } catch (const Error& e) {
        const std::string line = e.what(), call = failed_();
        EXPECT_EQ(e.failure(), Failure::Device) << "at " << at << ", " << call << ": " << line;
        for (const char* word : {"wanted ", "; found ", "; try "})
          EXPECT_TRUE(contains(line, word)) << call << ": " << line;
        EXPECT_FALSE(contains(line, "\n")) << line;
      } catch (const std::exception& e) {
        ADD_FAILURE() << "at " << at << ", " << failed_() << ": " << e.what();
      }
      forget_kernels();
      EXPECT_EQ(live_(), before) << "leaked after failure " << at << ", " << failed_();
      if (calls_() < at) {
        std::printf("%llu places:", static_cast<unsigned long long>(at - 1));
        for (const auto& [call, times] : where) std::printf(" %s %d", call.c_str(), times);
        std::printf("\n");
        arm_("", 0, true);
        return at - 1;
      }
      ++where[failed_()];
      if (HasFailure()) return at;
    }
  }

  /// Each failure of these compiles the kernels before it again.
  static constexpr std::array<std::string_view, 4> kOfKernels = {
      "vkCreateDescriptorSetLayout", "vkCreatePipelineLayout", "vkCreateShaderModule",
      "vkCreateComputePipelines"};

  static inline void* library_ = nullptr;
  static inline decltype(&palpate_layer_arm) arm_ = nullptr;
  static inline decltype(&palpate_layer_calls) calls_ = nullptr;
  static inline decltype(&palpate_layer_failed) failed_ = nullptr;
  static inline decltype(&palpate_layer_live) live_ = nullptr;
  static inline std::unique_ptr<gpu::Context> context_;
};

/// The calls that tell most, for what is slow to make.
constexpr std::array kTelling = {"vkAllocateMemory", "vkCreateComputePipelines", "vkEndCommandBuffer",
                                 "vkQueueSubmit2", "vkWaitForFences"};

// Making a pipeline, giving it its background and three frames, reading a depth map: everything that a
// recording does.
TEST_F(FailingDevice, EveryCallOfAPipelineMayFail) {
  const FrameFormat format{48, 40, 1, 8};
  Sensor sensor;
  sensor.name = "test";
  sensor.pitch_mm_per_px = 0.1;
  sensor.reading = SurfaceReading::Shading;
  sensor.shading.facing_gray = 200;
  const Frame dark = uniform_frame(format, 10), bright = uniform_frame(format, 120);
  const auto record = [&](const PipelineOptions& options) {
    Pipeline pipeline(*context_, sensor, format, options);
    pipeline.set_background(dark);
    for (int i = 0; i < 4; ++i) {
      while (!pipeline.submit(bright)) pipeline.wait();
      pipeline.poll();
    }
    while (const auto result = pipeline.wait()) {
      result->depth_mm();
    }
  };
  PipelineOptions options;
  options.outputs = Output::Force;
  EXPECT_GT(fail_everywhere([&] { record(options); }), 50u);
  options.outputs = Output::Force | Output::Surface;
  options.slots = 1;
  options = solved(Solve::Exact, options);
  if (thorough()) {
    EXPECT_GT(fail_everywhere([&] { record(options); }), 90u);
    options.solver = SurfaceSolver::Live;
  }
  for (const char* call : kTelling) EXPECT_GT(fail_each(call, true, [&] { record(options); }), 1u) << call;
}

// Plain descriptor sets come from pools, and either may find no memory.
TEST_F(FailingDevice, EveryDescriptorSetMayFail) {
  gpu::ContextOptions plain;
  plain.push_descriptors = false;
  context_.reset();
  context_ = std::make_unique<gpu::Context>(plain);
  const FrameFormat format{48, 40, 1, 8};
  Sensor sensor;
  sensor.name = "test";
  sensor.pitch_mm_per_px = 0.1;
  PipelineOptions options;
  options.outputs = Output::Force;
  options.slots = 1;
  const auto record = [&] {
    Pipeline pipeline(*context_, sensor, format, options);
    pipeline.set_background(uniform_frame(format, 10));
    pipeline.submit(uniform_frame(format, 120));
    pipeline.wait();
  };
  for (const char* call : {"vkCreateDescriptorPool", "vkAllocateDescriptorSets"})
    EXPECT_GT(fail_each(call, true, record), 0u) << call;
  context_.reset();
  context_ = std::make_unique<gpu::Context>(gpu::ContextOptions{});
}

/// The frames of a camera, read in place.
class FailingImport : public FailingDevice {
 protected:
  void SetUp() override {
    if (context_->host_import_alignment() == 0) GTEST_SKIP() << "the device imports no host memory";
    sensor_.name = "test";
    sensor_.pitch_mm_per_px = 0.1;
    options_.outputs = Output::Force;
    options_.upload = Upload::Import;
  }

  const FrameFormat format_{48, 40, 1, 8};
  const Frame dark_ = uniform_frame(format_, 10), bright_ = uniform_frame(format_, 120);
  Sensor sensor_;
  PipelineOptions options_;
};

// Whatever fails while pages are imported, the frame is copied and its numbers are the same; the device is
// not asked again for these pages, and is for others.
TEST_F(FailingImport, IsACopy) {
  arm_("", 0, true);
  Pipeline pipeline(*context_, sensor_, format_, options_);
  pipeline.set_background(dark_);
  const double wanted = pipeline.process(bright_).touch.gray_sum;
  const auto measure = [&](const std::shared_ptr<MappedPages>& pages, uint32_t copies) {
    std::atomic<int> returned = 0;
    ASSERT_TRUE(pipeline.submit(lease(bright_, pages, 16, &returned)));
    const Result result = *pipeline.wait();
    EXPECT_EQ(result.copies, copies);
    EXPECT_EQ(result.touch.gray_sum, wanted);
    EXPECT_EQ(returned, 1);
  };
  const int64_t before = live_();
  for (const auto& [call, at] : {std::pair{"vkCreateBuffer", 1u},
                                 {"vkGetMemoryHostPointerPropertiesEXT", 1u},
                                 {"vkAllocateMemory", 1u},
                                 {"vkBindBufferMemory", 1u},
                                 {"vkCreateBufferView", 1u},
                                 {"vkCreateBufferView", 2u}}) {
    SCOPED_TRACE(std::string(call) + " " + std::to_string(at));
    const auto pages = map_pages(8192), others = map_pages(8192);
    arm_(call, at, false);
    measure(pages, 1);
    EXPECT_STREQ(failed_(), call);
    EXPECT_EQ(live_(), before) << "an import that failed leaves nothing";
    arm_("vkCreateBuffer", 0, false);
    measure(pages, 1);
    EXPECT_EQ(calls_(), 0u);
    measure(others, 0);
    EXPECT_EQ(live_(), before + 4);  // buffer, memory, two views
  }
  EXPECT_EQ(live_(), before) << "imports go with their pages";
}

TEST_F(FailingImport, EveryCallOfItMayFail) {
  std::atomic<int> leased = 0, returned = 0;
  EXPECT_GT(fail_everywhere([&] {
              const auto pages = map_pages(8192), others = map_pages(8192);
              Pipeline pipeline(*context_, sensor_, format_, options_);
              pipeline.set_background(dark_);
              for (int i = 0; i < 4; ++i) {
                const Frame frame = lease(bright_, i % 2 ? pages : others, 0, &returned);
                ++leased;
                while (!pipeline.submit(frame)) pipeline.wait();
              }
              while (pipeline.wait()) {
              }
            }),
            60u);
  EXPECT_EQ(returned, leased) << "every buffer is the driver's again, whatever failed";
}

TEST_F(FailingDevice, EveryCallOfAnIntegrationMayFail) {
  const NpyArray slopes = gaussian_slopes(40, 56, 9, 12);
  const auto solve = [&](Solve solver) {
    return [&slopes, solver] { integrate_gradients(*context_, slopes.values, 40, 56, solver); };
  };
  EXPECT_GT(fail_everywhere(solve(Solve::Exact)), 40u);
  for (const char* call : kTelling) EXPECT_GT(fail_each(call, true, solve(Solve::Converged)), 0u) << call;
}

// After a failed allocation the same context works on, with the same numbers.
TEST_F(FailingDevice, AFailedAllocationHarmsNothingElse) {
  const NpyArray slopes = gaussian_slopes(40, 56, 9, 12);
  const auto solve = [&] {
    return integrate_gradients(*context_, slopes.values, 40, 56, Solve::Live).values;
  };
  arm_("", 0, true);
  const std::vector<float> wanted = solve();
  arm_("vkAllocateMemory", 7, true);
  EXPECT_THROW(solve(), Error);
  EXPECT_EQ(solve(), wanted);
}

// Opening a device: every call fails once.
TEST_F(FailingDevice, EveryCallOfOpeningADeviceMayFail) {
  context_.reset();  // the layer serves one device at a time
  EXPECT_EQ(live_(), 0);
  EXPECT_GE(fail_everywhere([] { gpu::Context(gpu::ContextOptions{}); }), 2u);
  context_ = std::make_unique<gpu::Context>(gpu::ContextOptions{});
}

/// The program with a layer that fails the n-th call of one Vulkan function.
class FailingProgram : public Program {
 protected:
  static Surroundings failing(const std::string& call, uint64_t at) {
    Surroundings around{.environment = with_layer()};
    around.environment["PALPATE_FAIL_CALL"] = call;
    around.environment["PALPATE_FAIL_AT"] = std::to_string(at);
    return around;
  }
  /// From the n-th submission on the device does nothing. The limit is only what the line says: the layer
  /// ends the wait.
  static Surroundings hanging(uint64_t at) {
    Surroundings around = failing("vkQueueSubmit2", at);
    around.environment["PALPATE_FAIL_HANG"] = "1";
    around.environment["PALPATE_WAIT_LIMIT_S"] = "1e-06";
    return around;
  }
};

// The device is lost in the middle of a recording: the rows before it stand and are those of a run without
// trouble.
TEST_F(FailingProgram, FramesBeforeADeviceLossAreKept) {
  constexpr int kFrames = 12;
  const fs::path rec = recording(kFrames);
  const auto arguments = [&](const fs::path& out) {
    return std::vector<std::string>{"process", rec / "frames", "--sensor", rec / "sensor.json", "--out",
                                    out,       "--outputs",    "force"};
  };
  ASSERT_EQ(run(arguments(folder_ / "whole")).exit_code, 0);
  const std::string whole = slurp(folder_ / "whole" / "measurements.csv");
  const Table all(whole);
  for (const char* call : {"vkQueueSubmit2", "vkWaitForFences"}) {
    size_t most = 0;
    for (const uint64_t at : {1u, 2u, 4u, 7u, 10u}) {
      SCOPED_TRACE(std::string(call) + " " + std::to_string(at));
      const fs::path out = folder_ / (std::string(call) + std::to_string(at));
      expect_refusal(arguments(out), 5, {"device lost", "wanted", "try"}, failing(call, at));
      EXPECT_FALSE(fs::exists(out / "recording.mp4"));
      if (!fs::exists(out / "measurements.csv")) continue;  // lost before the first frame
      const std::string text = slurp(out / "measurements.csv");
      EXPECT_EQ(whole.rfind(text, 0), 0u) << "the rows so far are those of the whole run:\n" << text;
      EXPECT_EQ(text.back(), '\n');
      const Table table(text);
      table.expect_whole();
      EXPECT_LT(table.rows.size(), all.rows.size());
      most = std::max(most, table.rows.size());
      if (table.rows.empty()) continue;
      const Json summary = parse_json(slurp(out / "summary.json"));
      EXPECT_FALSE(summary.at("complete").get<bool>());
      EXPECT_EQ(summary.at("frames").get<size_t>(), table.rows.size());
      EXPECT_TRUE(contains(summary.at("ended_by").get<std::string>(), "device lost"));
    }
    EXPECT_GT(most, 3u) << call;
  }
}

// A device that never finishes what it is given is given up after its time; the frames before it are kept.
TEST_F(FailingProgram, ADeviceThatHangsEndsInOneLine) {
  const fs::path out = folder_ / "out";
  Surroundings around = hanging(10);
  expect_refusal({"process", "synthetic:press?size=96x80&mode=gel", "--frames", "10", "--out", out}, 5,
                 {"device hangs", "1e-06 s", "PALPATE_WAIT_LIMIT_S"}, around);
  const Table table(slurp(out / "measurements.csv"));
  table.expect_whole();
  EXPECT_GT(table.rows.size(), 2u);
  around.environment["PALPATE_WAIT_LIMIT_S"] = "soon";
  expect_refusal({"process", "synthetic:press?size=96x80&mode=gel", "--frames", "10", "--out", out}, 2,
                 {"PALPATE_WAIT_LIMIT_S in seconds", "'soon'"}, around);
}

// A live session goes on: the device is opened anew, no frame of the recording is missing, and all are
// measured.
TEST_F(FailingProgram, ARecordingOutlivesItsDevice) {
  for (const auto& [name, around] : {std::pair{"lost", failing("vkQueueSubmit2", 30)},
                                     {"lost waiting", failing("vkWaitForFences", 30)},
                                     {"hung", hanging(30)}}) {
    SCOPED_TRACE(name);
    const fs::path out = folder_ / name;
    const Ended ended = run({"record", "synthetic:slide?size=96x80&mode=gel", "--frames", "60", "--no-drop",
                             "--out", out, "--json"},
                            around);
    ASSERT_EQ(ended.exit_code, 0) << ended.err;
    EXPECT_TRUE(contains(ended.err, "opened anew")) << ended.err;
    const Json value = parse_json(ended.out);
    EXPECT_EQ(value.at("device_losses"), 1);
    EXPECT_EQ(value.at("captured"), 60);
    const Table rows(slurp(out / "frames.csv"));
    rows.expect_whole();
    ASSERT_EQ(rows.rows.size(), 60u);
    size_t measured_after = 0;
    for (size_t i = 40; i < 60; ++i) measured_after += rows.at(i, "measured") == "1";
    EXPECT_EQ(measured_after, 20u);
  }
}

// One device of two fingers: whichever finds it lost, both go on, and so do their pairs.
TEST_F(FailingProgram, BothFingersOutliveTheirDevice) {
  for (const auto& [name, around] :
       {std::pair{"lost", failing("vkQueueSubmit2", 90)}, {"lost waiting", failing("vkWaitForFences", 90)}}) {
    SCOPED_TRACE(name);
    const fs::path out = folder_ / name;
    const std::string scene = "synthetic:grip?size=96x80&side=";
    const Ended ended =
        run({"record", "--left", scene + "left", "--right", scene + "right", "--out", out, "--json"}, around);
    ASSERT_EQ(ended.exit_code, 0) << ended.err;
    EXPECT_TRUE(contains(ended.err, "opened anew")) << ended.err;
    const Json value = parse_json(ended.out);
    EXPECT_EQ(value["pairs"], 180);
    for (const char* side : {"left", "right"}) {
      EXPECT_EQ(value[side]["device_losses"], 1) << side;
      EXPECT_EQ(value[side]["processed"], 180) << side;
      const Table rows(slurp(out / side / "frames.csv"));
      rows.expect_whole();
      ASSERT_EQ(rows.rows.size(), 180u);
      for (size_t i = 0; i < 180; ++i) EXPECT_EQ(rows.at(i, "measured"), "1") << side << ' ' << i;
    }
  }
}

// A device that is lost before it has measured anything is not opened for ever.
TEST_F(FailingProgram, ADeviceThatMeasuresNothingIsGivenUp) {
  const fs::path out = folder_ / "out";
  const Ended ended = run({"record", "synthetic:slide?size=96x80&mode=gel", "--frames", "20", "--out", out},
                          failing("vkWaitForFences", 2));
  EXPECT_EQ(ended.exit_code, 5) << ended.err;
  EXPECT_TRUE(contains(ended.err, "device lost")) << ended.err;
  EXPECT_TRUE(fs::exists(out / "frames.mkv")) << "what was captured is kept";
}

// Depth maps and the film of the frames before a loss are whole too.
TEST_F(FailingProgram, DepthFilesBeforeADeviceLossAreWhole) {
  const fs::path out = folder_ / "out";
  expect_refusal(
      {"process", "synthetic:press?size=96x80&mode=gel", "--frames", "10", "--out", out, "--depth", "npy"}, 5,
      {"device lost"}, failing("vkQueueSubmit2", 10));
  const Table table(slurp(out / "measurements.csv"));
  table.expect_whole();
  ASSERT_GT(table.rows.size(), 2u);
  for (size_t i = 0; i < table.rows.size(); ++i) {
    const NpyArray map = read_npy(out / "depth" / (std::string("00000") + std::to_string(i) + ".npy"));
    EXPECT_EQ(map.shape, (std::vector<size_t>{80, 96}));
    for (const float depth : map.values) ASSERT_TRUE(std::isfinite(depth));
  }
  EXPECT_FALSE(
      fs::exists(out / "depth" / (std::string("00000") + std::to_string(table.rows.size()) + ".npy")));
  for (const auto& entry : fs::recursive_directory_iterator(out))
    EXPECT_FALSE(contains(entry.path().filename(), ".partial")) << entry.path();
}

TEST_F(FailingProgram, OutOfMemoryIsOneLine) {
  for (const uint64_t at : {1u, 3u, 9u}) {
    const fs::path out = folder_ / std::to_string(at);
    expect_refusal({"process", "synthetic:press?size=96x80&mode=gel", "--frames", "3", "--out", out}, 5,
                   {"device memory", "smaller frame"}, failing("vkAllocateMemory", at));
    EXPECT_FALSE(fs::exists(out / "summary.json"));
  }
  write_npy(folder_ / "slopes.npy", gaussian_slopes(40, 56, 9, 12).values, {40, 56, 2});
  expect_refusal({"integrate", folder_ / "slopes.npy", "--out", folder_ / "o"}, 5, {"device memory"},
                 failing("vkAllocateMemory", 2));
  EXPECT_FALSE(fs::exists(folder_ / "o" / "height.npy"));
}

}  // namespace
}  // namespace palpate
