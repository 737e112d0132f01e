// The skin's strain over the raw image: from followed places to a map, its range, its error, and the reasons
// for its absence.
#include "viz/render/image/strain_view.h"

#include <gtest/gtest.h>

#include <cmath>
#include <ctime>
#include <random>

#include "tests/support/gpu_fixture.h"
#include "viz/render/view_state.h"

namespace palpate::viz {
namespace {

class StrainMapTest : public GpuTest {};
const FrameFormat kFormat{320, 240, 1, 8};

/// Places `step` px apart that moved by an affine motion about the frame's middle and noise.
Touch followed(double ux, double uy, double vx, double vy, double noise_px = 0, int step = 16) {
  Touch t;
  t.skin.emplace();
  std::mt19937 random(3);
  std::normal_distribution<double> noise(0, 1);
  for (int y = step / 2; y < 240; y += step)
    for (int x = step / 2; x < 320; x += step) {
      const double dx = x - 160, dy = y - 120;
      t.skin_points.push_back({static_cast<float>(x), static_cast<float>(y),
                               static_cast<float>(ux * dx + uy * dy + noise_px * noise(random)),
                               static_cast<float>(vx * dx + vy * dy + noise_px * noise(random)), 1});
    }
  return t;
}

TEST_F(StrainMapTest, ShowsTheStrainOfItsPlaces) {
  StrainMap map(context(), 2);
  const StrainTexels& stretch = map.update(followed(0.03, 0, 0, -0.01), kFormat, SkinStrain::Stretch);
  ASSERT_NE(stretch.texels, nullptr);
  EXPECT_NEAR(stretch.largest, 0.03 + 0.00045, 2e-5);
  const StrainTexels& shear = map.update(followed(0.03, 0, 0, -0.01), kFormat, SkinStrain::Shear);
  EXPECT_NEAR(shear.largest, (0.03045 - (-0.01 + 0.00005)) / 2, 2e-5);
  // The same places with other shifts, without another factorisation.
  EXPECT_NEAR(map.update(followed(0, 0.02, 0, 0), kFormat, SkinStrain::Shear).largest,
              std::hypot(0.0001, 0.01), 2e-5);
  // Turned as a whole: nothing.
  const double c = std::cos(0.1) - 1, s = std::sin(0.1);
  EXPECT_NEAR(map.update(followed(c, -s, s, c), kFormat, SkinStrain::Stretch).largest, 0, 2e-5);
}

TEST_F(StrainMapTest, SaysHowSureItIs) {
  StrainMap map(context(), 2);
  const double quiet = map.update(followed(0.03, 0, 0, 0, 0.02), kFormat, SkinStrain::Stretch).sd;
  const double loud = map.update(followed(0.03, 0, 0, 0, 0.2), kFormat, SkinStrain::Stretch).sd;
  EXPECT_GT(quiet, 1e-5);
  EXPECT_LT(quiet, 1e-3);
  EXPECT_GT(loud, 5 * quiet);
}

TEST_F(StrainMapTest, SaysWhyThereIsNone) {
  StrainMap map(context(), 2);
  Touch t = followed(0.03, 0, 0, 0);
  for (size_t i = 9; i < t.skin_points.size(); ++i) t.skin_points[i].correlation = 0;
  EXPECT_EQ(map.update(t, kFormat, SkinStrain::Stretch).texels, nullptr);
  EXPECT_EQ(map.last().missing, "9 of 10 places are followed");
  t = followed(0.03, 0, 0, 0);
  t.skin.reset();
  EXPECT_EQ(map.update(t, kFormat, SkinStrain::Stretch).missing, "the skin is not followed");
  t = followed(0.03, 0, 0, 0);
  t.skin_points.resize(20);  // the first row
  EXPECT_EQ(map.update(t, kFormat, SkinStrain::Stretch).texels, nullptr);
  EXPECT_EQ(map.last().missing, "the followed places lie in one line");
}

TEST_F(StrainMapTest, KeepsUpWithACamera) {
  const FrameFormat format{640, 480, 1, 8};
  StrainMap map(context(), 2);
  Touch t = followed(0.03, 0, 0, 0, 0.02);
  const Touch extra = followed(0.01, 0, 0, 0, 0.02, 15);
  t.skin_points.insert(t.skin_points.end(), extra.skin_points.begin(), extra.skin_points.end());
  ASSERT_GT(t.skin_points.size(), 500u);
  std::vector<double> kept, changed;
  for (int i = 0; i < 8; ++i) {
    for (std::vector<double>* ms : {&kept, &changed}) {
      if (ms == &changed) t.skin_points[static_cast<size_t>(i)].correlation = 0;  // one more is lost
      const std::clock_t start = std::clock();  // of the whole process: what else runs here does not count
      map.update(t, format, SkinStrain::Stretch);
      ms->push_back(1e3 * static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC);
    }
  }
  std::sort(kept.begin() + 1, kept.end());
  std::sort(changed.begin(), changed.end());
  RecordProperty("kept_ms", std::to_string(kept[4]));
  RecordProperty("changed_ms", std::to_string(changed[4]));
  EXPECT_LT(kept[4], 80);
  EXPECT_LT(changed[4], 160);
}

TEST_F(StrainMapTest, TheRangeFollows) {
  ViewState state;
  state.follow_skin_strain(0.012);
  EXPECT_NEAR(state.skin_strain_range, 0.015, 1e-12);
  state.follow_skin_strain(0.009);  // colours keep their meaning
  EXPECT_NEAR(state.skin_strain_range, 0.015, 1e-12);
  state.follow_skin_strain(0.2);
  EXPECT_NEAR(state.skin_strain_range, 0.2, 1e-12);
  state.follow_skin_strain(0);
  EXPECT_NEAR(state.skin_strain_range, 0.005, 1e-12);
}

}  // namespace
}  // namespace palpate::viz
