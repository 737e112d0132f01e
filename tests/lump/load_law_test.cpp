// A slide's places at other loads, held against the block at those loads.
#include "engine/palpation/hand/load_law.h"

#include <gtest/gtest.h>

#include <cmath>

#include "capture/synthetic/tissue.h"

namespace palpate {
namespace {

/// What a window sees of a block with a ball, at the first frame of a force.
class Window {
 public:
  explicit Window(double x_mm)
      : options_(parse_tissue("synthetic:tissue?size=64x48&cells=16&rate=15&force=2.6&loads=8&d=12&h=3&"
                              "ratio=4&noise=off&x=" +
                              std::to_string(x_mm))),
        block_(options_) {}

  PressureMap at(double& force_N) const {
    uint64_t frame = 0;
    while (block_.block_force_N(frame) < force_N) ++frame;
    force_N = block_.block_force_N(frame);
    PressureMap map{21, 15, {1.25, 1.25}, {}};
    for (uint32_t j = 0; j < map.height; ++j)
      for (uint32_t i = 0; i < map.width; ++i)
        map.values.push_back(
            static_cast<float>(block_.pressure_Pa(frame, (i - 10.0) * 1.25, (j - 7.0) * 1.25)));
    return map;
  }
  lump::Observation press() const {
    lump::Observation press;
    for (double force_N : {0.6, 0.8, 1.0, 1.5, 2.0, 2.5}) {
      press.pressure_Pa.push_back(at(force_N));
      press.force_N.push_back(force_N);
    }
    return press;
  }
  const TissueOptions& options() const { return options_; }

 private:
  TissueOptions options_;
  TissueSensor block_;
};

/// RMS over the mean of the truth.
double off(const PressureMap& map, const PressureMap& truth) {
  double square = 0, sum = 0;
  for (size_t i = 0; i < truth.values.size(); ++i) {
    square += std::pow(double{map.values[i]} - double{truth.values[i]}, 2);
    sum += double{truth.values[i]};
  }
  return std::sqrt(square * static_cast<double>(truth.values.size())) / sum;
}

TEST(LoadLaw, BringsAPlaceOfASlideToAnotherLoad) {
  const Window began(0), later(6);
  const auto& block_mm = began.options().scene.block_mm;
  const double young_Pa = began.options().scene.young_Pa;
  double from_N = 2.4, to_N = 0.9, seen_Pa = 0, unseen_Pa = 0;
  const PressureMap seen = later.at(from_N), truth = later.at(to_N);
  PressureMap straight = seen;
  for (float& value : straight.values) value *= static_cast<float>(to_N / from_N);
  const SlideWay way{{6, 0}, 0};
  const double by_proportion = off(straight, truth),
               by_law =
                   off(LoadLaw(began.press(), block_mm, young_Pa).change(seen, from_N, to_N, way, seen_Pa),
                       truth),
               by_mean =
                   off(LoadLaw({}, block_mm, young_Pa).change(seen, from_N, to_N, way, unseen_Pa), truth);
  double mean_Pa = 0;
  for (const float value : truth.values) mean_Pa += double{value} / static_cast<double>(truth.values.size());
  std::printf(
      "%.2f N told as %.2f N: %.2f %% off in proportion, %.2f %% by the mean law (stated %.2f), %.2f %% by "
      "what "
      "its beginning showed (stated %.2f)\n",
      from_N, to_N, 100 * by_proportion, 100 * by_mean, 100 * unseen_Pa / mean_Pa, 100 * by_law,
      100 * seen_Pa / mean_Pa);
  EXPECT_GT(by_proportion, 0.08);
  EXPECT_LT(by_mean, 1.5 * unseen_Pa / mean_Pa);
  EXPECT_LT(by_law, 0.02);
  EXPECT_LT(by_law, 1.5 * seen_Pa / mean_Pa);
  EXPECT_LT(seen_Pa, 0.7 * unseen_Pa);
}

TEST(LoadLaw, LeavesWhatIsAtItsLoadAsItIs) {
  const PressureMap map{3, 3, {1.25, 1.25}, std::vector<float>(9, 500)};
  double error_Pa = 1;
  const LoadLaw law({}, {40, 40, 20}, 4000);
  EXPECT_EQ(law.change(map, 1, 1, {}, error_Pa).values, map.values);
  EXPECT_EQ(error_Pa, 0);
  EXPECT_NEAR(law.wider(2, 1) * law.wider(1, 2), 1, 1e-12);
  EXPECT_GT(law.wider(2, 1), 1.01);
  const SlideWay back = SlideWay{{3, 1}, 0.1}.then(SlideWay{{0, 2}, -0.1});
  EXPECT_NEAR(back.turn_rad, 0, 1e-12);
  EXPECT_NEAR(back.at_mm[1], 1 + 2 * std::cos(0.1), 1e-12);
}

}  // namespace
}  // namespace palpate
