// Slip of the gel on slides drawn at random, against the simulator's truth: frames that are wrong, warning
// before a slide and alarms at rest, by rate and by what the skin shows. Thresholds were chosen on the scenes
// slides-0 to slides-7; these are others.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <random>

#include "capture/synthetic/scene.h"
#include "engine/calibrate/force/fit.h"
#include "palpate/pipeline.h"
#include "tests/scenes/synthetic_run.h"
#include "tests/support/gpu_fixture.h"
#include "tests/support/thorough.h"

namespace palpate {
namespace {

constexpr uint32_t kFirstJudged = 200;

/// One frame as it was measured, and as it was.
struct SlideFrame {
  Slip said = Slip::NoContact;
  bool sees_contact = false;
  bool by_skin = false;  ///< the skin was followed under the contact
  double gray_sum = 0;
  Truth truth;
  bool rolls = false;  ///< of a touch that rolls
};

/// Touches of one object on one gel, drawn from a number.
struct SlideCase {
  SyntheticOptions options;
  double more_noise_gray = 0;

  SlideCase(uint32_t number, double rate_Hz, SyntheticSkin skin) {
    std::mt19937 random(1000 + number);
    const auto between = [&](double low, double high) {
      return low + (high - low) * (static_cast<double>(random()) / 4294967296.0);
    };
    options.scene = "slides-" + std::to_string(number);
    options.mode = SyntheticMode::Gel;
    options.skin = skin;
    options.width = 320;
    options.height = 240;
    options.rate_Hz = rate_Hz;
    options.seed = 1 + number;
    options.indenter_radius_mm = between(5, 12);
    options.friction = between(0.3, 0.9);
    more_noise_gray = between(0, 2);
  }
};

/// What a set of slides showed.
struct SlipScore {
  uint64_t frames = 0, wrong = 0, rolling_frames = 0, rolling_wrong = 0;
  uint64_t rolls_by_skin = 0;  ///< frames of rolls that are said to slide where the skin shows them
  uint64_t slides = 0, warned = 0, alarms = 0;
  double rest_s = 0;

  double wrong_percent() const { return 100 * double(wrong) / double(frames); }
  double warned_percent() const { return 100 * double(warned) / double(slides); }
  double alarms_per_min() const { return double(alarms) / rest_s * 60; }
};

/// An alarm: a slide, or a rim that slips where the whole contact sticks.
bool is_alarm(const SlideFrame& f) {
  return f.said == Slip::Slip || (f.said == Slip::Incipient && f.truth.stick_share > 0.97);
}

/// Nothing has moved and no force has changed for 0.1 s.
bool rests(std::span<const SlideFrame> frames, size_t k, size_t tenth) {
  if (k < tenth) return false;
  const Truth& now = frames[k].truth;
  return std::all_of(frames.begin() + static_cast<std::ptrdiff_t>(k - tenth),
                     frames.begin() + static_cast<std::ptrdiff_t>(k), [&](const SlideFrame& f) {
                       const Truth& t = f.truth;
                       return t.contact == now.contact && !t.slipping && !now.slipping &&
                              std::abs(t.force_N - now.force_N) < 1e-6 &&
                              std::hypot(t.center_x_px - now.center_x_px, t.center_y_px - now.center_y_px) <
                                  1e-3;
                     });
}

/// Incipient slip said two frames or more before the slide that begins at `k`, and not taken back.
bool is_warned(std::span<const SlideFrame> frames, size_t k) {
  size_t first = k;
  while (first > 0 && !frames[first - 1].truth.slipping &&
         (frames[first - 1].said == Slip::Incipient || frames[first - 1].said == Slip::Slip))
    --first;
  const auto begin = frames.begin();
  const auto found =
      std::find_if(begin + static_cast<std::ptrdiff_t>(first), begin + static_cast<std::ptrdiff_t>(k),
                   [](const SlideFrame& f) { return f.said == Slip::Incipient; });
  return k - static_cast<size_t>(found - begin) >= 2;
}

/// `rolling_counts`: only the skin shows a roll.
void add_score(std::span<const SlideFrame> frames, double rate_Hz, bool rolling_counts, SlipScore& score) {
  const auto tenth = static_cast<size_t>(std::lround(0.1 * rate_Hz));
  const auto slide = static_cast<size_t>(std::lround(0.15 * rate_Hz));
  for (size_t k = 3; k < frames.size(); ++k) {
    const SlideFrame& f = frames[k];
    if (f.truth.contact && f.sees_contact) {
      const bool wrong = (f.said == Slip::Slip) != f.truth.slipping;
      score.rolling_frames += f.rolls;
      score.rolling_wrong += f.rolls && wrong;
      score.rolls_by_skin += f.rolls && wrong && f.by_skin && f.said == Slip::Slip;
      if (rolling_counts || !f.rolls) {
        ++score.frames;
        score.wrong += wrong;
      }
    }
    if (rests(frames, k, tenth) && (rolling_counts || !f.rolls)) {
      score.rest_s += 1 / rate_Hz;
      score.alarms += is_alarm(f) && !is_alarm(frames[k - 1]);
    }
    const size_t end = std::min(k + slide, frames.size());
    if (f.truth.slipping && !frames[k - 1].truth.slipping && frames[k - 3].truth.contact &&
        std::all_of(frames.begin() + static_cast<std::ptrdiff_t>(k),
                    frames.begin() + static_cast<std::ptrdiff_t>(end),
                    [](const SlideFrame& later) { return later.truth.slipping; })) {
      ++score.slides;
      score.warned += is_warned(frames, k);
    }
  }
}

class SlipStudy : public GpuTest, public testing::WithParamInterface<double> {
 protected:
  static std::vector<SlideFrame> measure(const SlideCase& slide, const Sensor& sensor) {
    const SyntheticSensor source(slide.options);
    const Outputs outputs = sensor.skin ? Output::Force | Output::Skin : Outputs(Output::Force);
    Pipeline pipeline(context(), sensor, source.format(), {.outputs = outputs});
    pipeline.set_background(*source.own_background());
    std::mt19937 random(static_cast<uint32_t>(slide.options.seed));
    std::normal_distribution<double> normal(0, slide.more_noise_gray);
    std::vector<double> noise(1 << 16);
    for (double& n : noise) n = normal(random) + 0.5;
    const Script& script = find_scene(slide.options.scene).keyframes;
    std::vector<SlideFrame> seen;
    Frame frame;
    for (uint64_t k = 0; source.render(k, frame); ++k) {
      size_t next = random();
      for (uint8_t& byte : frame.bytes)
        byte = static_cast<uint8_t>(std::clamp(byte + noise[next++ % noise.size()], 0.0, 255.0));
      const Touch touch = pipeline.process(frame).touch;
      SlideFrame f{touch.slip, touch.contact, touch.skin.has_value(), touch.gray_sum, *source.truth(k)};
      f.truth.depth_mm = {};
      f.rolls = at(script, f.truth.time_s).roll_x_mm != 0;
      seen.push_back(std::move(f));
    }
    // The whole touch that rolls, from its onset on.
    for (size_t k = seen.size(); k-- > 1;)
      if (seen[k].rolls && seen[k - 1].truth.contact) seen[k - 1].rolls = true;
    return seen;
  }

  /// Gray sum to force by steps of the same object at another place, as `palpate demo` does it.
  static Sensor calibrated(const SlideCase& slide) {
    SlideCase steps = slide;
    steps.options.scene = "press";
    steps.options.rate_Hz = 10;
    steps.options.force_N = 1.8;
    steps.options.seed += 1000;
    Sensor sensor = synthetic_sensor(slide.options), bare = sensor;
    bare.shear.reset();
    std::vector<double> gray, force_N;
    for (const SlideFrame& f : measure(steps, bare)) {
      if (!f.sees_contact || f.truth.force_N < 0.05) continue;
      gray.push_back(f.gray_sum);
      force_N.push_back(f.truth.force_N);
    }
    sensor.force = line_calibration(gray, force_N);
    return sensor;
  }

  static SlipScore judge(double rate_Hz, SyntheticSkin skin, uint32_t scenes) {
    SlipScore score;
    for (uint32_t i = 0; i < scenes; ++i) {
      const SlideCase slide(kFirstJudged + i, rate_Hz, skin);
      add_score(measure(slide, calibrated(slide)), rate_Hz, skin != SyntheticSkin::None, score);
    }
    std::printf("%s,%g,%u,%llu,%.2f,%llu,%.0f,%.1f,%.2f,%.0f\n",
                skin == SyntheticSkin::None ? "none" : "markers", rate_Hz, scenes,
                static_cast<unsigned long long>(score.frames), score.wrong_percent(),
                static_cast<unsigned long long>(score.slides), score.warned_percent(), score.rest_s,
                score.alarms_per_min(),
                100 * double(score.rolling_wrong) / double(std::max<uint64_t>(score.rolling_frames, 1)));
    std::fflush(stdout);
    return score;
  }
};

TEST_P(SlipStudy, SaysSlipRightAtEveryRate) {
  const double rate_Hz = GetParam();
  std::puts(
      "skin,rate_Hz,scenes,frames,wrong_percent,slides,warned_two_frames_before_percent,rest_s,"
      "alarms_per_min,rolling_wrong_percent");
  for (const SyntheticSkin skin : {SyntheticSkin::None, SyntheticSkin::Markers}) {
    const SlipScore score = judge(rate_Hz, skin, of_sweep(12u, 4u));
    // Scenes differ: a third of them hold it less closely.
    EXPECT_LE(score.wrong_percent(), of_sweep(3.0, 4.0));
    EXPECT_GE(score.warned_percent(), 90);
    EXPECT_LE(score.alarms_per_min(), 1);
    EXPECT_GT(score.slides, 20u);
    EXPECT_EQ(score.rolls_by_skin, 0u);
  }
}

INSTANTIATE_TEST_SUITE_P(Rates, SlipStudy,
                         testing::ValuesIn(of_sweep<std::vector<double>>({30, 60, 240}, {30})));

}  // namespace
}  // namespace palpate
