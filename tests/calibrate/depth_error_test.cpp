// Standard errors of a gel's depth, from presses of a simulated gel to frames of it: intervals hold the true
// depth, and what calibration never saw is marked.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <random>
#include <vector>

#include "engine/calibrate/photometric/fit.h"
#include "engine/measure/depth_error.h"
#include "palpate/pipeline.h"
#include "tests/support/gpu_fixture.h"

namespace palpate {
namespace {

constexpr FrameFormat kGelFormat{320, 240, 3, 8};
constexpr double kGelPitch_mm = 0.06;

/// A ball in a pad, which leaves it gradually.
struct Press {
  double x_px = 0, y_px = 0, contact_px = 0, ball_mm = 0;

  double contact_mm() const { return contact_px * kGelPitch_mm; }
  double reach_mm() const { return 0.25 * contact_mm(); }
  double rim_slope() const { return contact_mm() / std::sqrt(ball_mm * ball_mm - std::pow(contact_mm(), 2)); }
  /// Slope downwards from the middle.
  double slope(double r_mm) const {
    if (r_mm < contact_mm()) return r_mm / std::sqrt(ball_mm * ball_mm - r_mm * r_mm);
    return rim_slope() * std::exp(-(r_mm - contact_mm()) / reach_mm());
  }
  double depth_mm(double r_mm) const {
    const double rim_mm = rim_slope() * reach_mm();
    if (r_mm >= contact_mm()) return rim_mm * std::exp(-(r_mm - contact_mm()) / reach_mm());
    return rim_mm + std::sqrt(ball_mm * ball_mm - r_mm * r_mm) -
           std::sqrt(ball_mm * ball_mm - std::pow(contact_mm(), 2));
  }
};

class DepthErrorTest : public GpuTest {
 protected:
  /// Three lamps close to the pad's rim: their directions, not only their strength, depend on the place.
  Frame render(const Press& press) {
    constexpr std::array<std::array<double, 3>, 3> kLamps_mm{{{-16, 2, 9}, {9, -15, 8}, {11, 14, 10}}};
    std::normal_distribution<double> noise(0, 1);
    Frame f;
    f.reshape(kGelFormat);
    for (uint32_t y = 0; y < kGelFormat.height; ++y)
      for (uint32_t x = 0; x < kGelFormat.width; ++x) {
        const double dx = (x - press.x_px) * kGelPitch_mm, dy = (y - press.y_px) * kGelPitch_mm;
        const double r_mm = std::hypot(dx, dy);
        const double slope = press.contact_px > 0 ? press.slope(r_mm) : 0, nz = 1 / std::hypot(1.0, slope);
        const double nx = r_mm > 0 ? -dx / r_mm * slope * nz : 0, ny = r_mm > 0 ? -dy / r_mm * slope * nz : 0;
        for (uint32_t c = 0; c < 3; ++c) {
          const double lx = kLamps_mm[c][0] - (x - kGelFormat.width / 2.0) * kGelPitch_mm;
          const double ly = kLamps_mm[c][1] - (y - kGelFormat.height / 2.0) * kGelPitch_mm,
                       lz = kLamps_mm[c][2];
          const double away = std::hypot(lx, ly, lz);
          const double light = std::max(0.0, (lx * nx + ly * ny + lz * nz) / away) * 200 / (away * away);
          f.set(c, x, y,
                static_cast<uint32_t>(std::clamp(255 * 0.75 * light + noise(random_) + 0.5, 0.0, 254.0)));
        }
      }
    return f;
  }
  Press press_within(double left, double top, double right, double bottom, double contact_px,
                     double ball_mm) {
    std::uniform_real_distribution<double> across(left, right), down(top, bottom);
    return {across(random_), down(random_), contact_px, ball_mm};
  }
  /// By 20 presses with their middles in a rectangle.
  Sensor calibrated(double left, double top, double right, double bottom, double ball_mm = 3) {
    PhotometricFit fit(kGelFormat, kGelPitch_mm);
    std::uniform_real_distribution<double> contact(20, 32);
    for (int i = 0; i < 20; ++i) {
      const Press p = press_within(left, top, right, bottom, contact(random_), ball_mm);
      fit.add_ball(render(p), untouched_, p.x_px, p.y_px, p.contact_px, p.ball_mm, "ball");
    }
    Sensor s;
    s.pitch_mm_per_px = kGelPitch_mm;
    s.channels = 3;
    s.signal = Signal::Either;
    s.threshold_gray = 6;
    s.reading = SurfaceReading::Photometric;
    s.photometric = fit.solve(1, NormalModel::Best).calibration;
    return s;
  }
  /// Frames are measured by this sensor from now on.
  void use(const Sensor& sensor) {
    pipeline_.emplace(context(), sensor, kGelFormat,
                      PipelineOptions{.outputs = Output::Force | Output::Contacts | Output::Surface,
                                      .solver = SurfaceSolver::Best,
                                      .fixed_light = true,
                                      .separate = true});
    pipeline_->set_background(untouched_);
  }
  Result measured(const Press& press) { return pipeline_->process(render(press)); }
  static bool holds(const Result& result, const Press& press) {
    const SurfaceSummary& s = *result.touch.surface;
    return std::abs(s.depth_max_mm - press.depth_mm(0)) <= 1.96 * s.depth_sd_mm;
  }

  std::mt19937 random_{3};
  Frame untouched_ = render({});
  std::optional<Pipeline> pipeline_;
};

TEST_F(DepthErrorTest, IntervalsHoldTheDepthOfOtherPresses) {
  const Sensor sensor = calibrated(50, 45, 270, 195);
  use(sensor);
  EXPECT_EQ(sensor.photometric.presses.size(), 20u);
  constexpr int kPresses = 40;
  int held = 0, extrapolated = 0, seen = 0;
  double inside = 0, inside_held = 0, error = 0, stated = 0;
  std::uniform_real_distribution<double> contact(20, 32);
  for (int i = 0; i < kPresses; ++i) {
    const Press p = press_within(50, 45, 270, 195, contact(random_), i % 2 == 0 ? 3 : 4.5);
    const Result result = measured(p);
    const SurfaceSummary& s = *result.touch.surface;
    held += holds(result, p);
    extrapolated += s.validity == Validity::Extrapolated;
    // What is extrapolated in part widens the error by that part.
    if (s.extrapolated_px == 0u) {
      ++seen;
      error += std::pow(s.depth_max_mm - p.depth_mm(0), 2);
      stated += s.depth_sd_mm * s.depth_sd_mm;
    }
    const std::span<const float> depth_mm = result.depth_mm();
    for (uint32_t y = 0; y < kGelFormat.height; ++y)
      for (uint32_t x = 0; x < kGelFormat.width; ++x) {
        const double r_px = std::hypot(x - p.x_px, y - p.y_px);
        if (r_px > p.contact_px) continue;
        inside += 1;
        const double read_mm = static_cast<double>(depth_mm[size_t{y} * kGelFormat.width + x]);
        const double error_mm = read_mm - p.depth_mm(r_px * kGelPitch_mm);
        inside_held += std::abs(error_mm) <= 1.96 * s.depth_sd_mm;
      }
  }
  std::printf(
      "held: %d of %d deepest, %.1f %% of the pixels; RMS error %.4f mm, stated %.4f mm; %d extrapolated\n",
      held, kPresses, 100 * inside_held / inside, std::sqrt(error / seen), std::sqrt(stated / seen),
      extrapolated);
  EXPECT_GE(seen, kPresses / 4);
  EXPECT_GE(held, kPresses * 9 / 10);
  EXPECT_GE(inside_held, 0.9 * inside);
  EXPECT_LT(stated, 4 * error);
  EXPECT_LE(extrapolated, kPresses / 10) << "next to the outermost presses";
}

TEST_F(DepthErrorTest, WherePressesWereNotIsExtrapolated) {
  use(calibrated(40, 35, 110, 90));
  const Press near{80, 65, 26, 3}, far{250, 185, 26, 3};
  const Result here = measured(near);
  EXPECT_EQ(here.touch.surface->validity, Validity::Valid);
  EXPECT_TRUE(holds(here, near));
  const double here_sd_mm = here.touch.surface->depth_sd_mm;
  const Result there = measured(far);
  const SurfaceSummary& s = *there.touch.surface;
  std::printf("in the corner %.3f +- %.3f mm, far from it %.3f +- %.3f mm, truly %.3f mm\n",
              here.touch.surface->depth_max_mm, here_sd_mm, s.depth_max_mm, s.depth_sd_mm, far.depth_mm(0));
  EXPECT_EQ(s.validity, Validity::Extrapolated);
  EXPECT_GT(s.depth_sd_mm, 5 * here_sd_mm);
  EXPECT_TRUE(holds(there, far));
  // The map: what is dented there, and nothing where presses were.
  const ExtrapolatedCells& map = there.extrapolated;
  ASSERT_EQ(map.cells.size(), size_t{map.width} * map.height);
  uint64_t px = 0;
  int of_contact = 0, of_contact_marked = 0;
  for (uint32_t y = 0; y < map.height; ++y)
    for (uint32_t x = 0; x < map.width; ++x) {
      const double x_px = (x + 0.5) * map.cell_px, y_px = (y + 0.5) * map.cell_px;
      const bool marked = map.cells[size_t{y} * map.width + x] != 0;
      px += marked ? uint64_t{map.cell_px} * map.cell_px : 0;
      const bool of_far = std::hypot(x_px - far.x_px, y_px - far.y_px) < 0.5 * far.contact_px;
      const bool of_presses = x_px < 110 && y_px < 90;
      of_contact += of_far;
      of_contact_marked += of_far && marked;
      EXPECT_FALSE(marked && of_presses) << x << ' ' << y;
    }
  EXPECT_EQ(px, s.extrapolated_px);
  EXPECT_GT(of_contact_marked, 0.8 * of_contact);
}

TEST_F(DepthErrorTest, ColoursBeyondThoseOfThePressesAreExtrapolated) {
  use(calibrated(50, 45, 270, 195, 9));
  const Press known{160, 120, 28, 9}, steep{160, 120, 28, 2.6};
  EXPECT_EQ(measured(known).touch.surface->validity, Validity::Valid);
  const Result result = measured(steep);
  const SurfaceSummary& s = *result.touch.surface;
  const double dented_px = *s.dented_mm2 / (kGelPitch_mm * kGelPitch_mm);
  std::printf("steep: %.3f +- %.3f mm, truly %.3f mm, %.2f of the dent extrapolated\n", s.depth_max_mm,
              s.depth_sd_mm, steep.depth_mm(0), static_cast<double>(*s.extrapolated_px) / dented_px);
  EXPECT_EQ(s.validity, Validity::Extrapolated);
  EXPECT_TRUE(holds(result, steep));
}

TEST_F(DepthErrorTest, AFileThatStatesNothingMarksNothing) {
  Sensor sensor = calibrated(50, 45, 270, 195);
  sensor.photometric.presses.clear();
  sensor.photometric.colours.reset();
  use(sensor);
  const Result result = measured({280, 200, 26, 3});
  EXPECT_EQ(result.touch.surface->depth_sd_mm, 0);
  EXPECT_FALSE(result.touch.surface->extrapolated_px);
  EXPECT_TRUE(result.extrapolated.cells.empty());
  EXPECT_NE(result.touch.surface->validity, Validity::Extrapolated);
}

PressError press(double across, double down, double error) {
  return {.across = across, .down = down, .radius = 0.1, .depth_error = error};
}

TEST(DepthErrorOfPresses, IsThatOfThoseNearby) {
  PhotometricCalibration c;
  for (const double at : {-0.8, -0.7, -0.6}) c.presses.push_back(press(at, 0, 0.2));
  for (const double at : {0.6, 0.7, 0.8}) c.presses.push_back(press(at, 0, -0.02));
  const DepthError error(c, kGelFormat);
  const double left = error.relative(48, 120), right = error.relative(272, 120);
  // Six presses: Student's variance, 7/6 of 5/3; one press's weight for the mean of all.
  EXPECT_NEAR(left, std::sqrt(7.0 / 6 * 5 / 3) * 0.2, 0.03);
  EXPECT_GT(left, 1.5 * right);
  EXPECT_GT(right, 0.03);
  c.presses.resize(DepthError::kFewest - 1);
  EXPECT_EQ(DepthError(c, kGelFormat).relative(48, 120), 0) << "too few to state an error";
}

TEST(DepthErrorOfPresses, PlacesBetweenAndNearThemWereSeen) {
  PhotometricCalibration c;
  for (const auto& [x, y] : {std::pair{-0.9, -0.9}, {0.9, -0.9}, {-0.9, 0.9}, {0.9, 0.9}})
    c.presses.push_back(press(x, y, 0.1));
  EXPECT_TRUE(DepthError(c, kGelFormat).saw_place(160, 120)) << "between";
  c.presses.pop_back();
  const DepthError corner(c, kGelFormat);
  EXPECT_TRUE(corner.saw_place(100, 80));
  EXPECT_TRUE(corner.saw_place(0, 0)) << "near one";
  EXPECT_FALSE(corner.saw_place(280, 210));
  // One press alone: a circle of a tenth of the half width and what it reaches.
  c.presses.assign(1, press(-0.5, 0, 0.1));
  const DepthError::SeenPart seen = DepthError(c, kGelFormat).seen_part();
  EXPECT_NEAR(seen.share, 3.1416 * 45 * 45 / (320 * 240), 0.01);
  EXPECT_NEAR(seen.around.x, 80 - 45, 8);
  EXPECT_NEAR(seen.around.x + seen.around.width, 80 + 45, 8);
  EXPECT_NEAR(seen.around.y, 120 - 45, 8);
  EXPECT_NEAR(seen.around.y + seen.around.height, 120 + 45, 8);
  EXPECT_EQ(DepthError({}, kGelFormat).seen_part().share, 1) << "of presses that are not known";
}

TEST(DepthErrorOfPresses, ColoursWithinABinWereSeen) {
  PhotometricCalibration c;
  SeenColours& seen = c.colours.emplace();
  seen.low = {-0.4, -0.4, -0.4};
  seen.high = {0.4, 0.4, 0.4};
  seen.bins[2] = uint64_t{1} << (5 * SeenColours::kSide + 7);
  const DepthError error(c, kGelFormat);
  EXPECT_TRUE(error.saw_colour({0.35, 0.15, -0.15}));
  EXPECT_TRUE(error.saw_colour({0.45, 0.15, -0.15})) << "one bin beyond the box";
  EXPECT_FALSE(error.saw_colour({0.55, 0.15, -0.15})) << "two";
  EXPECT_TRUE(error.saw_colour({0.25, 0.05, -0.25})) << "a neighbour in each colour";
  EXPECT_FALSE(error.saw_colour({0.35, 0.15, 0.05}));
  EXPECT_FALSE(error.saw_colour({-5, -5, -5}));
}

}  // namespace
}  // namespace palpate
