// The scenes for several contacts, force rigs, pulling, dragging and twisting, and the skin that goes with
// them.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "capture/synthetic/skin.h"
#include "capture/synthetic/synthetic.h"
#include "palpate/error.h"

namespace palpate {
namespace {

SyntheticOptions options(const std::string& text) {
  return parse_synthetic("synthetic:" + text);
}

std::vector<Truth> truths(const std::string& text) {
  SyntheticSensor sensor(options(text));
  std::vector<Truth> all;
  for (uint64_t k = 0; k < *sensor.frame_count(); ++k) all.push_back(*sensor.truth(k));
  return all;
}

/// Sum of the change from the untouched image.
double light(const SyntheticSensor& sensor, uint64_t sequence) {
  const Frame background = *sensor.own_background();
  Frame frame;
  sensor.render(sequence, frame);
  double sum = 0;
  for (uint32_t y = 0; y < frame.format.height; ++y)
    for (uint32_t x = 0; x < frame.format.width; ++x)
      sum += static_cast<double>(frame.at(0, x, y)) - background.at(0, x, y);
  return sum;
}

TEST(SyntheticScenes, FingersComeMoveAndGoEachWithItsOwnTruth) {
  size_t most = 0;
  std::set<size_t> counts;
  for (const Truth& t : truths("fingers?size=160x120&rate=10")) {
    most = std::max(most, t.contacts.size());
    counts.insert(t.contacts.size());
    double force_N = 0, x = 0, y = 0;
    for (const TrueContact& c : t.contacts) {
      force_N += c.force_N;
      x += c.force_N * c.center_x_px;
      y += c.force_N * c.center_y_px;
      for (const TrueContact& other : t.contacts)
        if (&other != &c) {
          EXPECT_GT(std::hypot(c.center_x_px - other.center_x_px, c.center_y_px - other.center_y_px),
                    c.radius_px + other.radius_px + 4);
        }
    }
    EXPECT_NEAR(t.force_N, force_N, 1e-12);
    EXPECT_EQ(t.contact, !t.contacts.empty());
    if (t.contact) {
      EXPECT_NEAR(t.center_x_px, x / force_N, 1e-9);
      EXPECT_NEAR(t.center_y_px, y / force_N, 1e-9);
      EXPECT_GT(t.volume_mm3, 0);
    }
  }
  EXPECT_EQ(most, 5u);
  EXPECT_GE(counts.size(), 5u);
  // Light of five is the sum of five forces.
  const SyntheticOptions o = options("fingers?size=320x240&noise=off&falloff=0&bits=12");
  const SyntheticSensor sensor(o);
  const double pitch = 27.84 / 320;
  EXPECT_NEAR(light(sensor, 100) * pitch * pitch / gray_per_MPa(o) / sensor.truth(100)->force_N, 1, 0.01);
}

TEST(SyntheticScenes, RigHoldsThePapersForcesOnTheWayUpAndDown) {
  std::vector<double> held_N;
  const auto all = truths("rig?size=64x48");
  for (size_t k = 6; k < all.size(); ++k)
    if (all[k].force_N > 0 && std::abs(all[k].force_N - all[k - 6].force_N) < 1e-9)
      held_N.push_back(all[k].force_N);
  for (const double wanted : {0.537, 0.966, 1.503})
    EXPECT_GT(
        std::count_if(held_N.begin(), held_N.end(), [&](double f) { return std::abs(f - wanted) < 1e-9; }),
        15)
        << wanted;
  EXPECT_NEAR(*std::max_element(held_N.begin(), held_N.end()), 2, 1e-12);
}

TEST(SyntheticScenes, HysteresisAndDriftAreWhatTheyAreCalled) {
  const double fraction = 0.06;
  const SyntheticSensor lossy(options("rig?size=128x96&noise=off&bits=16&hysteresis=0.06")),
      plain(options("rig?size=128x96&noise=off&bits=16")),
      drifting(options("rig?size=128x96&noise=off&bits=16&drift=0.1"));
  const uint64_t frames = *plain.frame_count();
  uint64_t top = 0;
  for (uint64_t k = 0; k < frames; ++k)
    if (plain.truth(k)->force_N > plain.truth(top)->force_N) top = k;
  const double full = light(plain, top);
  double largest = 0;
  for (uint64_t k = 20; k < frames; k += 9) {
    const double difference = (light(lossy, k) - light(plain, k)) / full;
    if (k < top) {
      EXPECT_NEAR(difference, 0, 1e-3) << k;
    } else {
      EXPECT_GT(difference, -1e-3);
      largest = std::max(largest, difference);
    }
    if (plain.truth(k)->force_N > 0.3) {
      EXPECT_NEAR(light(drifting, k) / light(plain, k), 1 + 0.1 * static_cast<double>(k) / 30 / 60, 1e-3)
          << k;
    }
  }
  EXPECT_NEAR(largest, fraction, 0.1 * fraction);
  EXPECT_THROW(SyntheticSensor(options("rig?mode=gel&hysteresis=0.1")), Error);
  EXPECT_THROW(SyntheticSensor(options("rig?mode=gel&drift=0.1")), Error);
  EXPECT_THROW(SyntheticSensor(options("rig?hysteresis=-1")), Error);
}

TEST(SyntheticScenes, PullStickAndTwistNeverSlipAndDragDoes) {
  for (const char* text :
       {"pull?size=64x48", "stick?size=64x48&rate=20", "twist?size=64x48", "pull?size=64x48&force=0.2"}) {
    double largest = 0, turn = 0;
    for (const Truth& t : truths(text)) {
      ASSERT_FALSE(t.slipping) << text << ' ' << t.sequence;
      if (t.contact) largest = std::max(largest, std::hypot(t.shear_x_N, t.shear_y_N) / (0.5 * t.force_N));
      turn = std::max(turn, std::abs(t.torsion_rad));
      EXPECT_GT(t.stick_share, 0.4);
    }
    if (text[0] == 't') {
      EXPECT_GT(turn, 0.05);
    } else {
      EXPECT_NEAR(largest, text[0] == 'p' ? 0.8 : 0.85, 0.02) << text;
    }
  }
  int slides = 0;
  bool before = false, incipient = false;
  for (const Truth& t : truths("drag?size=64x48")) {
    slides += t.slipping && !before;
    incipient |= !t.slipping && t.contact && t.stick_share > 0.3 && t.stick_share < 0.6;
    before = t.slipping;
    if (t.contact) {
      const double load = std::hypot(t.shear_x_N, t.shear_y_N) / (0.5 * t.force_N);
      EXPECT_LE(load, 1 + 1e-9);
      EXPECT_NEAR(t.stick_share, t.slipping ? 0 : std::cbrt(std::max(0.0, 1 - load)), 1e-6);
    }
  }
  EXPECT_GE(slides, 3);
  EXPECT_TRUE(incipient);
}

TEST(SyntheticScenes, TheSkinsCoreMovesWithTheLoadAndTheFarSkinDoesNot) {
  const SyntheticOptions o = options("pull?size=320x240&skin=texture");
  const SyntheticSensor sensor(o);
  const double pitch = 27.84 / 320, stiffness = shear_stiffness_N_per_mm(o);
  bool moved = false;
  for (const uint64_t k : {60u, 75u, 150u, 250u}) {
    const Truth t = *sensor.truth(k);
    ASSERT_TRUE(t.contact);
    const double x = t.shear_x_N / stiffness / pitch, y = t.shear_y_N / stiffness / pitch;
    const auto core = sensor.skin_shift_px(k, t.center_x_px - x, t.center_y_px - y);
    EXPECT_NEAR(core[0], x, 1e-3);
    EXPECT_NEAR(core[1], y, 1e-3);
    const auto far = sensor.skin_shift_px(k, 5, 5);
    EXPECT_LT(std::hypot(far[0], far[1]), 0.05 * std::hypot(x, y) + 1e-6);
    moved |= std::hypot(x, y) > 2;
  }
  EXPECT_TRUE(moved);
  // Inside it turns like a plate, and on both sides of the rim alike.
  EXPECT_NEAR(turned_fraction(0.5, 1, 6), 0.5, 1e-12);
  EXPECT_NEAR(turned_fraction(1.0001, 1, 6), turned_fraction(1, 1, 6), 0.03);
  EXPECT_THROW(SyntheticSensor(options("pull?size=160x120&skin=markers")), Error);
}

TEST(SyntheticScenes, ThePatternModulatesTheLightAndItsMeanIsCalibrated) {
  for (const char* skin : {"markers", "texture"}) {
    const SyntheticOptions o =
        options(std::string("press?size=640x480&noise=off&bits=12&falloff=0&skin=") + skin);
    const SyntheticSensor sensor(o);
    const Sensor calibration = synthetic_sensor(o);
    ASSERT_TRUE(calibration.skin && calibration.force);
    EXPECT_EQ(calibration.shear->signal, ShearSignal::Skin);
    EXPECT_NEAR(light(sensor, 130) * calibration.force->c1_N_per_gray / sensor.truth(130)->force_N, 1, 0.03)
        << skin;
  }
  EXPECT_EQ(to_string(options("press")).find("skin"), std::string::npos);
  const std::string text = to_string(options("rig?skin=markers&hysteresis=0.1&drift=-0.02"));
  EXPECT_EQ(to_string(parse_synthetic(text)), text);
}

}  // namespace
}  // namespace palpate
