// The pipeline with unknown pixels, on the synthetic sensor: masked pixels do no harm, and a frame without
// any costs nothing extra.
#include "engine/stages/surface/weighted_surface.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "capture/synthetic/synthetic.h"
#include "palpate/error.h"
#include "palpate/pipeline.h"
#include "tests/support/gpu_fixture.h"
#include "tests/support/pipelines.h"

namespace palpate {
namespace {

constexpr Outputs kPlain = Output::Force | Output::Surface;
constexpr Outputs kWithConfidence = kPlain | Output::Confidence;

struct Press {
  explicit Press(const std::string& text) : source(parse_synthetic("synthetic:" + text)) {
    sensor = synthetic_sensor(parse_synthetic("synthetic:" + text));
    background = *source.own_background();
    const uint64_t k = *source.frame_count() / 2;
    source.render(k, frame);
    truth = *source.truth(k);
  }
  /// Sets pixels of frame and, where asked, background to a value.
  template <typename Where>
  void paint(const Where& where, uint32_t value, bool rest) {
    for (uint32_t y = 0; y < frame.format.height; ++y)
      for (uint32_t x = 0; x < frame.format.width; ++x)
        for (uint32_t c = 0; c < frame.format.channels && where(double(x), double(y)); ++c) {
          frame.set(c, x, y, value);
          if (rest) background.set(c, x, y, value);
        }
  }

  SyntheticSensor source;
  Sensor sensor;
  Frame background, frame;
  Truth truth;
};

struct Answer {
  Touch touch;
  std::vector<float> depth_mm;
  std::vector<uint16_t> confidence;
};

/// Parts of the frames are painted in one colour, which no camera sees.
Answer measure(gpu::Context& context, const Press& press, Outputs outputs, Solve solve) {
  Pipeline pipeline(context, press.sensor, press.frame.format,
                    solved(solve, {.outputs = outputs, .slots = 2, .any_picture = true}));
  pipeline.set_background(press.background);
  EXPECT_TRUE(pipeline.submit(press.frame));
  EXPECT_TRUE(pipeline.submit(press.frame));  // the second one must not disturb what the first one leaves
  const Result result = *pipeline.wait();
  const std::span<const uint16_t> pixels = result.confidence();
  Answer answer{result.touch, depth_map(result), {pixels.begin(), pixels.end()}};
  const Result second = *pipeline.wait();
  EXPECT_EQ(second.touch.surface->weighted->residual, answer.touch.surface->weighted->residual);
  EXPECT_EQ(depth_map(second), answer.depth_mm);
  return answer;
}

/// RMS of the depth error over known pixels, less its mean, mm.
double error_mm(const Answer& got, const std::vector<float>& truth, const std::vector<uint16_t>& confidence) {
  double sum = 0, squares = 0, count = 0;
  for (size_t i = 0; i < truth.size(); ++i) {
    if ((confidence[i] & 255u) == 0) continue;
    const double e = double{got.depth_mm[i]} - double{truth[i]};
    EXPECT_TRUE(std::isfinite(e));
    sum += e;
    squares += e * e;
    count += 1;
  }
  return std::sqrt(squares / count - (sum / count) * (sum / count));
}

using WeightedFrameTest = GpuTest;

// A highlight in the contact spoils the surface around it; masked it does not.
TEST_F(WeightedFrameTest, SaturatedPixelsDoNoHarm) {
  Press press("press?mode=gel&size=320x240");
  const double clean = error_mm(measure(context(), press, kPlain, Solve::Converged), press.truth.depth_mm,
                                std::vector<uint16_t>(press.truth.depth_mm.size(), 255));
  const double x0 = press.truth.center_x_px + press.truth.radius_px * 0.6, y0 = press.truth.center_y_px;
  uint64_t painted = 0;
  press.paint([&](double x, double y) { return std::hypot(x - x0, y - y0) < 9; }, 255, false);
  for (uint32_t y = 0; y < 240; ++y)
    for (uint32_t x = 0; x < 320; ++x)
      painted += press.frame.at(0, x, y) == 255 && press.frame.at(1, x, y) == 255;
  for (const Solve solver : {Solve::Live, Solve::Converged, Solve::Exact}) {
    const Answer masked = measure(context(), press, kWithConfidence, solver);
    const Answer plain = measure(context(), press, kPlain, solver);
    const double with = error_mm(masked, press.truth.depth_mm, masked.confidence);
    const double without = error_mm(plain, press.truth.depth_mm, masked.confidence);
    std::printf("error of depth: clean %.5f, masked %.5f, not masked %.5f mm; residual %.1e misfit %.3f\n",
                clean, with, without, masked.touch.surface->weighted->residual.value(),
                masked.touch.surface->weighted->unexplained.value());
    EXPECT_GE(masked.touch.confidence->unknown_px, painted);
    EXPECT_EQ(masked.touch.confidence->unknown_px, masked.touch.saturated_px);
    EXPECT_TRUE(masked.touch.surface->weighted.has_value());
    EXPECT_EQ(masked.touch.surface->weighted->islands, 1u);
    EXPECT_LT(with, 1.3 * clean);
    EXPECT_GT(without, 2 * with);
    EXPECT_FALSE(plain.touch.confidence.has_value());
    EXPECT_TRUE(plain.confidence.empty());
  }
}

// Where everything is known, asking for confidence changes no bit of the surface, and nothing is solved
// twice.
TEST_F(WeightedFrameTest, NothingUnknownNothingSolved) {
  const Press press("press?mode=gel&size=160x120");
  const Answer plain = measure(context(), press, kPlain, Solve::Live);
  const Answer got = measure(context(), press, kWithConfidence, Solve::Live);
  EXPECT_TRUE(got.touch.confidence.has_value());
  EXPECT_EQ(got.touch.confidence->unknown_px, 0u);
  EXPECT_FALSE(got.touch.surface->weighted.has_value());
  EXPECT_EQ(got.depth_mm, plain.depth_mm);
  EXPECT_EQ(std::count(got.confidence.begin(), got.confidence.end(), uint16_t{255}),
            static_cast<std::ptrdiff_t>(got.confidence.size()));
  Pipeline lean(context(), press.sensor, press.frame.format, {.outputs = kPlain, .slots = 1});
  Pipeline full(context(), press.sensor, press.frame.format, {.outputs = kWithConfidence, .slots = 1});
  EXPECT_LT(lean.memory_bytes(), full.memory_bytes());
}

// A round pad before a bright room: what is around it moves nothing.
TEST_F(WeightedFrameTest, OutsideOfThePadDoesNotMatter) {
  Press press("press?mode=gel&size=320x240");
  const double radius = 115;
  press.sensor.pad = PadEllipse{159.5, 119.5, radius, radius, 0};
  const auto outside = [&](double x, double y) { return std::hypot(x - 159.5, y - 119.5) > radius; };
  Answer last;
  for (const uint32_t room : {90u, 200u}) {
    press.paint(outside, room, false);
    const Answer got = measure(context(), press, kPlain, Solve::Converged);
    EXPECT_TRUE(got.touch.surface->weighted.has_value());
    EXPECT_EQ(got.touch.confidence->outside_px, got.touch.confidence->unknown_px);
    EXPECT_NEAR(static_cast<double>(got.touch.confidence->unknown_px),
                320 * 240 - std::numbers::pi * radius * radius, 100);
    const double wrong = error_mm(got, press.truth.depth_mm, got.confidence);
    std::printf("round pad: depth error %.5f of %.3f mm\n", wrong, press.truth.indentation_mm);
    EXPECT_LT(wrong, 0.04 * press.truth.indentation_mm);
    if (!last.depth_mm.empty())
      for (size_t i = 0; i < got.depth_mm.size(); ++i) {
        if (got.confidence[i] != 255) continue;
        ASSERT_NEAR(got.depth_mm[i] - got.touch.surface->depth_offset_mm,
                    last.depth_mm[i] - last.touch.surface->depth_offset_mm, 1e-5);
      }
    last = got;
  }
}

// Weights are expected where the frame before needed them: that moves no bit of any frame.
TEST_F(WeightedFrameTest, AFrameDoesNotDependOnTheOneBefore) {
  for (const char* scene : {"press?mode=gel&size=160x120", "press?mode=lambert&size=160x120"}) {
    Press clean(scene), spoiled(scene);
    clean.sensor.saturation_gray = spoiled.sensor.saturation_gray = 255;
    spoiled.paint([](double x, double y) { return std::hypot(x - 80, y - 60) < 4; }, 255, false);
    clean.sensor.pad = PadEllipse{79.5, 59.5, 56, 56, 0};
    const auto alone = [&](const Frame& frame) {
      Pipeline pipeline(context(), clean.sensor, frame.format, {.outputs = kPlain});
      pipeline.set_background(clean.background);
      EXPECT_TRUE(pipeline.submit(frame));
      return depth_map(*pipeline.wait());
    };
    const std::vector<float> of_clean = alone(clean.frame), of_spoiled = alone(spoiled.frame);
    for (const uint32_t slots : {1u, 3u}) {
      Pipeline pipeline(context(), clean.sensor, clean.frame.format, {.outputs = kPlain, .slots = slots});
      pipeline.set_background(clean.background);
      const std::vector<bool> spoils{false, true, true, true, false, false, true, false};
      for (size_t sent = 0, got = 0; got < spoils.size(); ++got) {
        while (sent < spoils.size() && pipeline.submit(spoils[sent] ? spoiled.frame : clean.frame)) ++sent;
        const Result result = *pipeline.wait();
        EXPECT_EQ(result.touch.surface->weighted->residual.has_value(), spoils[got]) << scene << ' ' << got;
        EXPECT_EQ(depth_map(result), spoils[got] ? of_spoiled : of_clean) << scene << ' ' << got;
      }
    }
  }
}

// A dark line across the frame: two islands, and the depth says that it cannot know.
TEST_F(WeightedFrameTest, IslandsAreSaid) {
  Press press("press?mode=gel&size=160x120");
  press.paint([](double x, double) { return x >= 20 && x < 23; }, 0, true);
  for (const Solve solver : {Solve::Live, Solve::Exact}) {
    const Answer got = measure(context(), press, kWithConfidence, solver);
    EXPECT_EQ(got.touch.confidence->shadowed_px, 3u * 120);
    EXPECT_EQ(got.touch.surface->weighted->islands, 2u);
    EXPECT_EQ(got.touch.surface->validity, Validity::Apart);
  }
}

// One gray image: the 5 x 5 filter carries a saturated pixel two pixels far.
TEST_F(WeightedFrameTest, ShadingMasksWhatTheFilterReaches) {
  Press press("press?mode=lambert&size=160x120");
  press.sensor.saturation_gray = 255;
  press.paint([](double x, double y) { return x == 40 && y == 30; }, 255, false);
  const Answer got = measure(context(), press, kWithConfidence, Solve::Live);
  EXPECT_EQ(got.touch.saturated_px, 1u);
  EXPECT_EQ(got.touch.confidence->unknown_px, 25u);
  EXPECT_TRUE(got.touch.surface->weighted.has_value());
  for (const float depth : got.depth_mm) ASSERT_TRUE(std::isfinite(depth));
}

TEST_F(WeightedFrameTest, RefusesAPadThatIsNotInTheFrame) {
  Press press("press?mode=gel&size=160x120");
  press.sensor.pad = PadRectangle{500, 500, 10, 10};
  EXPECT_THROW(Pipeline(context(), press.sensor, press.frame.format, {.outputs = kPlain}), Error);
}

}  // namespace
}  // namespace palpate
