// Shear, stick, incipient slip, slide and torsion of a pad whose skin is followed, against the truth of the
// scene; the trackers alone on scripted points.
#include "engine/measure/motion/slip.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <random>

#include "engine/measure/contact/contact_tracker.h"
#include "engine/measure/motion/skin_motion.h"
#include "palpate/pipeline.h"
#include "tests/scenes/synthetic_run.h"
#include "tests/support/gpu_fixture.h"

namespace palpate {
namespace {

constexpr double kSlipPitch_mm = 0.05;

/// Points on a grid under and around a round contact that was pulled and turned.
struct Scripted {
  double radius_px = 60, x_px = 200, y_px = 150;
  double pull_x_px = 0, pull_y_px = 0, turn_rad = 0, stick_share = 1;
  double noise_px = 0.05;
  std::mt19937 random{5};

  std::vector<SkinPoint> points() {
    std::normal_distribution<float> noise(0, static_cast<float>(noise_px));
    std::vector<SkinPoint> all;
    for (float y = 20; y < 300; y += 20)
      for (float x = 20; x < 400; x += 20) {
        // The field is that at the place where the point is now, as for the synthetic pad.
        double u = 0, v = 0;
        for (int i = 0; i < 60; ++i) {
          const double dx = double{x} + u - x_px, dy = double{y} + v - y_px, r = std::hypot(dx, dy);
          const double fraction = cattaneo_fraction(r / radius_px, stick_share),
                       turn = r < radius_px ? turn_rad : 0;
          u = pull_x_px * fraction - turn * dy;
          v = pull_y_px * fraction + turn * dx;
        }
        all.push_back(
            {x, y, static_cast<float>(u) + noise(random), static_cast<float>(v) + noise(random), 0.95f});
      }
    return all;
  }
  ContactOutline outline() const { return {x_px, y_px, 2 * radius_px, 2 * radius_px, 0}; }
  SkinMotion measure(SkinTracker& tracker) {
    const auto all = points();
    const std::vector<float> sd(all.size(), static_cast<float>(noise_px));
    const ContactOutline here = outline();
    return tracker.update(&here, all, sd);
  }
};

TEST(CattaneoShare, IsTheDisplacementOfItsTractions) {
  // Displacement at r under the axially symmetric traction t(s): sum of t / distance over rings and angles.
  const auto displacement = [](double r, double c) {
    double sum = 0;
    const int rings = 400, angles = 720;
    for (int k = 0; k < rings; ++k) {
      const double s = (k + 0.5) / rings;
      const double t = std::sqrt(1 - s * s) - (s < c ? std::sqrt(c * c - s * s) : 0);
      for (int j = 0; j < angles; ++j) {
        const double angle = 2 * 3.14159265358979 * (j + 0.5) / angles;
        sum += t * s / std::hypot(r - s * std::cos(angle), s * std::sin(angle));
      }
    }
    return sum;
  };
  for (const double c : {0.0, 0.4, 0.8}) {
    const double core = displacement(0.0006, c);
    for (const double r : {0.3, 0.7, 0.9, 1.2, 2.0})
      EXPECT_NEAR(displacement(r, c) / core, cattaneo_fraction(r, c), 0.01) << "c " << c << " r " << r;
  }
  for (const double r : {0.5, 1.0, 1.3})
    EXPECT_NEAR(cattaneo_fraction(r, 0.9998), cattaneo_fraction(r, 1), 0.02);
}

TEST(SkinTracker, FindsShiftTurnAndStickShareWithinItsErrors) {
  for (const double fraction : {1.0, 0.8, 0.5, 0.2, 0.0}) {
    Scripted s;
    s.stick_share = fraction;
    s.pull_x_px = 6;
    s.pull_y_px = -3;
    s.turn_rad = 0.03;
    s.noise_px = 0.1;
    double shift = 0, turn = 0, stick = 0, stick_sd = 0, turn_sd = 0;
    const int trials = 60;
    for (int k = 0; k < trials; ++k) {
      SkinTracker tracker(kSlipPitch_mm);
      const SkinMotion m = s.measure(tracker);
      ASSERT_GT(m.touching, 20u);
      EXPECT_EQ(m.stick_share.validity, Validity::Valid);
      shift = std::max(
          shift, std::hypot(m.shift_x_mm.value / kSlipPitch_mm - 6, m.shift_y_mm.value / kSlipPitch_mm + 3));
      turn += std::pow(m.torsion_rad.value - 0.03, 2) / trials;
      turn_sd += m.torsion_rad.standard_error / trials;
      stick += std::pow(m.stick_share.value - fraction, 2) / trials;
      stick_sd += m.stick_share.standard_error / trials;
    }
    EXPECT_LT(shift, 0.35) << fraction;
    EXPECT_LT(std::sqrt(turn), 1.5 * turn_sd) << fraction;
    EXPECT_LT(std::sqrt(turn), 1e-3) << fraction;
    EXPECT_LT(std::sqrt(stick), std::max(2 * stick_sd, 0.05)) << fraction;
    EXPECT_LT(stick_sd, 0.12) << fraction;
  }
}

TEST(SkinTracker, StrangersLostPointsAndTinyMotionSayWhatTheyAre) {
  Scripted s;
  s.pull_x_px = 5;
  auto all = s.points();
  const std::vector<float> sd(all.size(), 0.05f);
  const ContactOutline here = s.outline();
  for (size_t i = 0; i < all.size(); i += 9) all[i].shift_x_px += 20;  // took a neighbour's place
  for (size_t i = 4; i < all.size(); i += 9) all[i].correlation = 0;
  SkinTracker tracker(kSlipPitch_mm);
  const SkinMotion m = tracker.update(&here, all, sd);
  EXPECT_EQ(m.lost, (all.size() - 4 + 8) / 9);
  EXPECT_EQ(m.points + m.lost, all.size());
  EXPECT_NEAR(m.shift_x_mm.value / kSlipPitch_mm, 5, 0.1);
  EXPECT_NEAR(m.torsion_rad.value, 0, 0.002);

  Scripted still;
  SkinTracker other(kSlipPitch_mm);
  EXPECT_EQ(still.measure(other).stick_share.validity, Validity::BelowRange);
  EXPECT_EQ(other.update(nullptr, still.points(), sd).shift_x_mm.validity, Validity::NoContact);
  const ContactOutline tiny{200, 150, 5, 5, 0};
  const SkinMotion none = other.update(&tiny, still.points(), sd);
  EXPECT_LT(none.touching, 3u);
  EXPECT_EQ(none.shift_x_mm.validity, Validity::NoContact);

  // After an interruption motion counts from there, and says so.
  tracker.interrupt();
  EXPECT_NEAR(s.measure(tracker).shift_x_mm.value, 0, 0.2 * kSlipPitch_mm);
  s.pull_x_px = 8;
  const SkinMotion on = s.measure(tracker);
  EXPECT_NEAR(on.shift_x_mm.value / kSlipPitch_mm, 3, 0.2);
  EXPECT_EQ(on.shift_x_mm.validity, Validity::OnsetUnseen);
}

// A contact that is pulled to and fro and then slides, at each rate the same in seconds.
TEST(SlipWatch, SeesASlideWithinTwoFramesOrATenthOfASecondAndKeepsStill) {
  for (const double rate_Hz : {30.0, 60.0, 240.0, 1000.0}) {
    std::mt19937 random(3);
    std::normal_distribution<double> noise(0, 0.03 * kSlipPitch_mm);
    SlipWatch watch;
    FrictionState now;
    now.foot_seen = true;
    now.error_mm = 0.03 * kSlipPitch_mm;
    double time_s = 0, contact_mm = 0, foot_mm = 0;
    const auto see = [&] {
      now.time_s = time_s += 1 / rate_Hz;
      now.x_mm = 10 + contact_mm + noise(random);
      now.y_mm = 5 + noise(random);
      now.foot_x_mm = 10 + foot_mm + noise(random);
      now.foot_y_mm = 5 + noise(random);
      return watch.slides(now);
    };
    // Stick: the skin goes with the contact, the foot stays.
    for (int k = 0; k < int(60 * rate_Hz); ++k) {
      contact_mm = 0.4 * std::sin(6 * time_s);
      ASSERT_FALSE(see()) << rate_Hz << " " << time_s;
    }
    const auto slide_until = [&](bool slides, double speed_mm_per_s) {
      int frames = 0;
      do {
        foot_mm += speed_mm_per_s / rate_Hz;
        contact_mm += speed_mm_per_s / rate_Hz;
        ++frames;
      } while (see() != slides && frames < 10000);
      return frames;
    };
    EXPECT_LE(slide_until(true, 0.5), std::max(2.0, 0.1 * rate_Hz)) << rate_Hz;
    for (int k = 0; k < int(rate_Hz); ++k) EXPECT_EQ(slide_until(true, 0.5), 1) << rate_Hz;
    EXPECT_LE(slide_until(false, 0), std::max(3.0, 0.1 * rate_Hz)) << rate_Hz;
    for (int k = 0; k < int(rate_Hz); ++k) EXPECT_FALSE(see()) << rate_Hz;
  }
}

TEST(SlipWatch, WhatRestsAtItsLimitSticksAndALimitThatFallsLetsItSlide) {
  SlipWatch watch;
  FrictionState now{.x_mm = 0.5, .error_mm = 0.001, .limit_known = true, .limit_mm = 0.5};
  const auto see = [&] {
    now.time_s += 1 / 60.0;
    return watch.slides(now);
  };
  for (int k = 0; k < 60; ++k) EXPECT_FALSE(see()) << k;
  int frames = 0;
  for (; frames < 20 && !see(); ++frames) now.limit_mm -= 0.002;
  EXPECT_LE(frames, 4);
  // Far below the limit it rolls, where the foot is seen.
  watch.restart();
  now.foot_seen = true;
  now.foot_x_mm = now.x_mm - 0.3 * now.limit_mm;
  for (int k = 0; k < 60; ++k) {
    now.x_mm += 0.02;
    now.foot_x_mm += 0.02;
    EXPECT_FALSE(see()) << k;
  }
}

TEST(ContactTrackerWithSkin, EachContactHasItsOwnShear) {
  Sensor sensor;
  sensor.name = "two";
  sensor.pitch_mm_per_px = kSlipPitch_mm;
  sensor.shear = ShearCalibration{2, 2, 0.5, 0.01};
  sensor.shear->signal = ShearSignal::Skin;
  sensor.force = ForceCalibration{};
  sensor.force->c1_N_per_gray = 1e-3;
  sensor.force->gray_max = 1e6;
  ContactTracker tracker(sensor, {500, 300, 1, 8});
  Touch touch;
  for (int frame = 0; frame < 10; ++frame) {
    Scripted left, right;
    left.radius_px = right.radius_px = 50;
    left.x_px = 100;
    right.x_px = 300;
    left.pull_x_px = 0.4 * frame;
    right.pull_y_px = -0.3 * frame;
    touch = {};
    touch.contact = true;
    touch.skin.emplace();
    touch.regions.emplace();
    const auto here = left.points(), there = right.points();
    for (size_t i = 0; i < here.size(); ++i)
      touch.skin_points.push_back(here[i].rest_x_px < 200 ? here[i] : there[i]);
    for (const Scripted* one : {&left, &right}) {
      ContactTouch region;
      region.centroid_x_px = one->x_px + one->pull_x_px;
      region.centroid_y_px = one->y_px + one->pull_y_px;
      region.area_px = 7854;
      region.gray_sum = 2000;
      region.ellipse = {100 * kSlipPitch_mm, 100 * kSlipPitch_mm, 0, 100, 100};
      touch.contacts.push_back(region);
    }
    tracker.update(touch, std::vector<float>(touch.skin_points.size(), 0.05f));
  }
  ASSERT_EQ(touch.contacts.size(), 2u);
  const ContactTouch &a = touch.contacts[0], &b = touch.contacts[1];
  EXPECT_NEAR(a.shear_x_N.value, 2 * 3.6 * kSlipPitch_mm, 0.03);
  EXPECT_NEAR(a.shear_y_N.value, 0, 0.03);
  EXPECT_NEAR(b.shear_x_N.value, 0, 0.03);
  EXPECT_NEAR(b.shear_y_N.value, -2 * 2.7 * kSlipPitch_mm, 0.03);
  EXPECT_NEAR(touch.shear_x_N.value, a.shear_x_N.value + b.shear_x_N.value, 1e-12);
  EXPECT_EQ(a.slip, Slip::Stick);
  EXPECT_EQ(touch.skin->torsion_rad.validity, Validity::NoContact);
  EXPECT_GT(touch.skin->touching, 20u);
}

// Signal ten times the noise: a pressure hill with 20 gray at its top under a noise of 2 gray.
struct CentroidError : GpuTest {};

TEST_F(CentroidError, IsBelowATwentiethPixelAtTwentyDecibels) {
  Sensor sensor;
  sensor.name = "hill";
  sensor.pitch_mm_per_px = kSlipPitch_mm;
  sensor.threshold_gray = 4;
  const FrameFormat format{320, 240, 1, 8};
  Pipeline pipeline(context(), sensor, format, {.outputs = Output::Force});
  Frame frame;
  frame.reshape(format);
  std::fill(frame.bytes.begin(), frame.bytes.end(), uint8_t{30});
  pipeline.set_background(frame);
  std::mt19937 random(9);
  std::normal_distribution<double> noise(0, 2);
  std::uniform_real_distribution<double> place(-20, 20);
  const double radius_px = 45;
  double squares = 0;
  const int trials = 60;
  for (int k = 0; k < trials; ++k) {
    const double cx = 160 + place(random), cy = 120 + place(random);
    for (uint32_t y = 0; y < format.height; ++y)
      for (uint32_t x = 0; x < format.width; ++x) {
        const double r2 = (std::pow(x - cx, 2) + std::pow(y - cy, 2)) / (radius_px * radius_px);
        frame.set(
            0, x, y,
            static_cast<uint32_t>(std::lround(30 + 20 * std::sqrt(std::max(0.0, 1 - r2)) + noise(random))));
      }
    const Touch touch = pipeline.process(frame).touch;
    squares += std::pow(touch.centroid_x_px - cx, 2) + std::pow(touch.centroid_y_px - cy, 2);
  }
  const double rms = std::sqrt(squares / (2 * trials));
  std::printf("centroid error RMS %.4f px\n", rms);
  EXPECT_LT(rms, 0.05);
}

struct SkinScene : GpuTest {
  struct Seen {
    Touch touch;
    Truth truth;
  };
  std::vector<Seen> play(const std::string& text, uint64_t first = 0, uint64_t last = UINT64_MAX) {
    SyntheticRun run(text);
    Pipeline pipeline = run.pipeline(context(), {.outputs = Output::Force | Output::Skin});
    std::vector<Seen> seen;
    for (uint64_t k = first; k < std::min(last, run.count()); ++k) {
      seen.push_back({pipeline.process(run.frame(k)).touch, run.truth(k)});
      seen.back().truth.depth_mm = {};
    }
    return seen;
  }
};

void judge(const char* text, const std::vector<SkinScene::Seen>& seen, size_t least_slides) {
  double largest_N = 0, squares = 0;
  size_t count = 0, slides = 0, latest = 0, wrong = 0, judged = 0, incipient = 0, incipient_true = 0;
  for (size_t k = 1; k < seen.size(); ++k) {
    const Touch& t = seen[k].touch;
    const Truth& truth = seen[k].truth;
    if (!truth.contact || truth.force_N < 0.5 || !t.contact) continue;
    const double error =
        std::hypot(t.shear_x_N.value - truth.shear_x_N, t.shear_y_N.value - truth.shear_y_N) /
        (0.5 * truth.force_N);
    largest_N = std::max(largest_N, error);
    squares += error * error;
    ++count;
    ++judged;
    wrong += (t.slip == Slip::Slip) != truth.slipping;
    incipient += t.slip == Slip::Incipient;
    incipient_true += t.slip == Slip::Incipient && truth.stick_share < 0.9;
    if (truth.slipping && !seen[k - 1].truth.slipping) {
      ++slides;
      size_t late = 0;
      while (k + late < seen.size() && seen[k + late].touch.slip != Slip::Slip) ++late;
      latest = std::max(latest, late);
    }
  }
  const double rms = std::sqrt(squares / static_cast<double>(count));
  std::printf(
      "%s: shear error RMS %.2f %%, largest %.2f %% of the friction limit; %zu slides, seen after %zu "
      "frames at most; "
      "%zu of %zu frames judged wrong, %zu incipient\n",
      text, 100 * rms, 100 * largest_N, slides, latest, wrong, judged, incipient);
  EXPECT_GE(slides, least_slides) << text;
  EXPECT_LE(latest, 2u) << text;
  EXPECT_LT(rms, 0.03) << text;
  EXPECT_LT(wrong, judged * 3 / 100) << text;
  EXPECT_GT(incipient, 5u) << text;
  EXPECT_GE(incipient_true, incipient * 9 / 10) << text;
}

TEST_F(SkinScene, SlideIsSeenWithinTwoFramesAndShearIsRightOnTexture) {
  const char* text = "drag?size=320x240&skin=texture&seed=3";
  judge(text, play(text, 30, 330), 3);
}

TEST_F(SkinScene, SlideIsSeenWithinTwoFramesAndShearIsRightOnMarkers) {
  const char* text = "drag?size=640x480&skin=markers&seed=4";
  judge(text, play(text, 36, 170), 1);
}

// Set PALPATE_LONG_STICK to the number of frames; 18000 are ten minutes.
TEST_F(SkinScene, StickIsNeverTakenForASlide) {
  const char* frames = std::getenv("PALPATE_LONG_STICK");
  const uint64_t last = frames ? std::strtoull(frames, nullptr, 10) : 240;
  const auto seen = play("stick?size=320x240&repeat=10&skin=texture&seed=8", 0, last);
  size_t sliding = 0, contact = 0, judged = 0;
  double largest = 0;
  for (const Seen& s : seen) {
    ASSERT_FALSE(s.truth.slipping);
    contact += s.truth.contact;
    judged += s.touch.slip == Slip::Stick || s.touch.slip == Slip::Incipient;
    sliding += s.touch.slip == Slip::Slip;
    if (s.truth.force_N > 0.3)
      largest = std::max(largest, std::hypot(s.touch.shear_x_N.value - s.truth.shear_x_N,
                                             s.touch.shear_y_N.value - s.truth.shear_y_N) /
                                      (0.5 * s.truth.force_N));
  }
  std::printf(
      "%zu frames, %zu with contact, %zu told, %zu taken for a slide; largest shear error %.2f %% of the "
      "limit\n",
      seen.size(), contact, judged, sliding, 100 * largest);
  EXPECT_EQ(sliding, 0u);
  EXPECT_GT(judged, contact * 9 / 10);
}

TEST_F(SkinScene, TorsionIsRightWithinItsError) {
  for (const char* text :
       {"twist?size=480x360&rate=8&skin=texture", "twist?size=480x360&rate=8&skin=markers"}) {
    double squares = 0, stated = 0, largest = 0;
    size_t count = 0;
    for (const Seen& s : play(text, 10, 70)) {
      if (s.truth.force_N < 0.9) continue;
      const double error = s.touch.skin->torsion_rad.value - s.truth.torsion_rad;
      squares += error * error;
      stated += s.touch.skin->torsion_rad.standard_error;
      largest = std::max(largest, std::abs(s.truth.torsion_rad));
      ++count;
      EXPECT_NE(s.touch.slip, Slip::Slip) << s.truth.sequence;
    }
    const double rms = std::sqrt(squares / static_cast<double>(count));
    std::printf("%s: torsion error RMS %.2f mrad of up to %.0f mrad, stated %.2f mrad\n", text, 1e3 * rms,
                1e3 * largest, 1e3 * stated / static_cast<double>(count));
    EXPECT_GT(largest, 0.05);
    EXPECT_LT(rms, 3e-3) << text;
  }
}

}  // namespace
}  // namespace palpate
