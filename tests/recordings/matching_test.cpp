// Matching on the point sets of Chui and Rangarajan, which the literature compares methods by. They are not
// part of the repository: looked for next to it, and skipped loudly.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <filesystem>
#include <map>
#include <memory>
#include <numeric>
#include <random>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

#include "capture/synthetic/bent_points.h"
#include "engine/numeric/matching/matching.h"
#include "tests/support/recordings.h"
#include "tests/support/thorough.h"

namespace palpate {
namespace {

namespace fs = std::filesystem;
const fs::path kData = recordings_folder() / "registration";

struct Trial {
  PointSet from, truth, seen;
};

std::map<int, Trial> read_trials(const std::string& level) {
  const std::string command = "zcat '" + (kData / (level + ".csv.gz")).string() + "'";
  const std::unique_ptr<FILE, int (*)(FILE*)> pipe(popen(command.c_str(), "r"), pclose);
  std::map<int, Trial> trials;
  char line[256];
  while (pipe && std::fgets(line, sizeof line, pipe.get())) {
    int trial = 0, index = 0;
    char set[8] = {};
    double x = 0, y = 0;
    if (std::sscanf(line, "%d,%7[^,],%d,%lf,%lf", &trial, set, &index, &x, &y) != 5) continue;
    Trial& t = trials[trial];
    const std::string name = set;
    PointSet* into = name == "x1" ? &t.from : name == "y2" ? &t.truth : name == "y2a" ? &t.seen : nullptr;
    if (into) into->coordinates.insert(into->coordinates.end(), {x, y});
  }
  return trials;
}

// The observed points come in the template's order, which a mistake could hide behind.
PointSet shuffled(const PointSet& set, uint32_t seed) {
  std::vector<size_t> order(set.size());
  std::iota(order.begin(), order.end(), size_t{0});
  std::mt19937 random(seed);
  for (size_t i = order.size() - 1; i > 0; --i) std::swap(order[i], order[random() % (i + 1)]);
  PointSet result;
  for (const size_t i : order)
    result.coordinates.insert(result.coordinates.end(), {set.at(i)[0], set.at(i)[1]});
  return result;
}

// Some more than was measured: rounding differs from machine to machine. None may be wrong and reliable.
struct Level {
  const char* name;
  double most_miss;
  int most_failures;  // trials above 0.05
  int most_refused;   // not called reliable
};
const std::vector<Level> kLevels = {{"fish_def_1", 0.0005, 0, 0},
                                    {"fish_def_2", 0.0005, 0, 0},
                                    {"fish_def_3", 0.0005, 0, 0},
                                    {"fish_def_4", 0.0005, 0, 0},
                                    {"fish_def_4_trials_21_to_60", 0.0005, 0, 0},
                                    {"fish_def_5", 0.0005, 0, 0},
                                    {"fish_def_5_trials_21_to_60", 0.0045, 1, 1},
                                    {"fish_noise_1", 0.0005, 0, 0},
                                    {"fish_noise_2", 0.0058, 0, 0},
                                    {"fish_noise_3", 0.0115, 0, 0},
                                    {"fish_noise_4", 0.0178, 0, 0},
                                    {"fish_noise_5", 0.0215, 0, 5},
                                    {"fish_noise_6", 0.0275, 0, 6},
                                    {"fish_noise_6_trials_21_to_60", 0.0258, 0, 6},
                                    {"fish_occlusion_1", 0.0005, 0, 0},
                                    {"fish_occlusion_2", 0.0008, 0, 0},
                                    {"fish_occlusion_3", 0.0014, 0, 0},
                                    {"fish_occlusion_4", 0.0015, 0, 0},
                                    {"fish_occlusion_5", 0.0028, 0, 0},
                                    {"fish_occlusion_6", 0.0145, 2, 5},
                                    {"fish_outlier_1", 0.0006, 0, 0},
                                    {"fish_outlier_2", 0.0006, 0, 0},
                                    {"fish_outlier_3", 0.0006, 0, 0},
                                    {"fish_outlier_4", 0.0006, 0, 0},
                                    {"fish_outlier_5", 0.0006, 0, 0},
                                    {"fish_outlier_5_trials_21_to_60", 0.0006, 0, 0},
                                    {"fish_rot_1", 0.0005, 0, 0},
                                    {"fish_rot_2", 0.0005, 0, 0},
                                    {"fish_rot_3", 0.0005, 0, 0},
                                    {"fish_rot_4", 0.0005, 0, 0},
                                    {"fish_rot_5", 0.0005, 0, 0},
                                    {"fish_rot_6", 0.0005, 0, 0},
                                    {"fish_rot_6_trials_21_to_60", 0.0005, 0, 0},
                                    {"chinese_def_3", 0.0008, 0, 0},
                                    {"chinese_def_4", 0.0008, 0, 0},
                                    {"chinese_def_5", 0.0025, 0, 1},
                                    {"chinese_noise_4", 0.0185, 0, 2},
                                    {"chinese_noise_5", 0.0252, 0, 2},
                                    {"chinese_noise_6", 0.0305, 0, 10},
                                    {"chinese_occlusion_4", 0.0035, 0, 1},
                                    {"chinese_occlusion_5", 0.0125, 2, 4},
                                    {"chinese_occlusion_6", 0.0275, 6, 8},
                                    {"chinese_outlier_3", 0.0008, 0, 0},
                                    {"chinese_outlier_4", 0.0012, 0, 0},
                                    {"chinese_outlier_5", 0.0055, 1, 2},
                                    {"chinese_rot_1", 0.0008, 0, 0},
                                    {"chinese_rot_2", 0.0008, 0, 0},
                                    {"chinese_rot_3", 0.0008, 0, 0},
                                    {"chinese_rot_4", 0.0008, 0, 0},
                                    {"chinese_rot_5", 0.0008, 0, 0},
                                    {"chinese_rot_6", 0.0008, 0, 0}};

/// All in a thorough run, otherwise one of each kind and shape; occlusion, by far the longest, on one shape.
std::vector<Level> levels() {
  constexpr std::array kSome = {"fish_def_5_trials_21_to_60",
                                "fish_noise_6",
                                "fish_occlusion_6",
                                "fish_outlier_5",
                                "fish_rot_6",
                                "chinese_def_5",
                                "chinese_noise_6",
                                "chinese_outlier_3",
                                "chinese_rot_6"};
  std::vector<Level> chosen;
  for (const Level& level : kLevels)
    if (thorough() || std::ranges::find(kSome, std::string_view(level.name)) != kSome.end())
      chosen.push_back(level);
  return chosen;
}

class SharedShapes : public testing::TestWithParam<Level> {};
TEST_P(SharedShapes, HoldTheGoalAndNoFailureIsCalledReliable) {
  if (!fs::exists(kData)) GTEST_SKIP() << "no point sets at " << kData;
  const std::map<int, Trial> trials = read_trials(GetParam().name);
  ASSERT_GE(trials.size(), 20u);
  double sum = 0;
  int failures = 0, refused = 0;
  for (const auto& [number, trial] : trials) {
    const MatchResult result = match_points(trial.from, shuffled(trial.seen, static_cast<uint32_t>(number)));
    // Of occluded sets the truth names the points that are left, the first of the template.
    const double miss = mean_miss(trial.truth, result.warped);
    sum += miss;
    failures += miss > 0.05;
    refused += !result.reliable();
    EXPECT_TRUE(miss <= 0.05 || !result.reliable()) << number << ": " << miss << " off and called reliable";
  }
  const double mean = sum / static_cast<double>(trials.size());
  std::printf("%s: mean distance %.4f, above 0.05: %d of %zu, refused %d\n", GetParam().name, mean, failures,
              trials.size(), refused);
  EXPECT_LE(mean, GetParam().most_miss);
  EXPECT_LE(failures, GetParam().most_failures);
  EXPECT_LE(refused, GetParam().most_refused);
}
INSTANTIATE_TEST_SUITE_P(Levels, SharedShapes, testing::ValuesIn(levels()),
                         [](const auto& level) { return std::string(level.param.name); });

}  // namespace
}  // namespace palpate
