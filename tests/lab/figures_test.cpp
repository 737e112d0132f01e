// The paper's figures from the forward model: the orderings by size and by material, and the report where a
// press does not reach its force.
#include "perf/lab/study/figures.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/lab/lab_program.h"
#include "tests/lump/press_slightly.h"
#include "tests/support/json.h"

namespace palpate {
namespace {

const auto kSilent = [](uint64_t, uint64_t) {};

TEST(LumpFigures, BiggerAndStifferHaveTheLargerAmplitude) {
  const lump::Figures figures = lump::make_figures({}, press_slightly, kSilent);
  ASSERT_EQ(figures.by_size.size(), 3u);
  ASSERT_EQ(figures.by_material.size(), 2u);
  for (const std::string& broken : broken_orderings(figures)) ADD_FAILURE() << broken;
  for (const auto* rows : {&figures.by_size, &figures.by_material})
    for (size_t i = 0; i + 1 < rows->size(); ++i) {
      const lump::FigurePress &more = (*rows)[i].press, &less = (*rows)[i + 1].press;
      EXPECT_GT(more.fit.amplitude, less.fit.amplitude) << more.name;
      EXPECT_GT(more.bump_fit.amplitude, less.bump_fit.amplitude) << more.name;
      // The paper's own numbers are in the same order.
      EXPECT_GT((*rows)[i].paper.amplitude_gray, (*rows)[i + 1].paper.amplitude_gray);
    }
  EXPECT_EQ(figures.by_size[1].press.press.force_N, 2);
  EXPECT_EQ(figures.by_material[0].press.press.force_N, 2.35);
  EXPECT_DOUBLE_EQ(figures.by_material[1].press.scene.inclusion->stiffness_ratio, 10);
}

// The bump is what the inclusion adds: with an inclusion as stiff as the tissue there is none.
TEST(LumpFigures, NoInclusionNoBump) {
  lump::FigureOptions options;
  options.play_doh_Pa = options.rubber_Pa = options.tissue_Pa;
  options.cells = {16, 16, 8};
  const lump::Figures figures = lump::make_figures(options, press_slightly, kSilent);
  for (const lump::FigureRow& row : figures.by_size)
    for (const double value : row.press.bump.value) EXPECT_NEAR(value, 0, 1e-2) << row.press.name;
  EXPECT_FALSE(broken_orderings(figures).empty());
}

TEST(LumpFigures, OrderingsThatDoNotHoldAreNamed) {
  lump::FigureOptions options;
  options.cells = {16, 16, 8};
  std::swap(options.play_doh_Pa, options.rubber_Pa);
  const std::vector<std::string> broken =
      broken_orderings(lump::make_figures(options, press_slightly, kSilent));
  ASSERT_EQ(broken.size(), 2u);
  EXPECT_NE(broken[0].find("rubber has no larger amplitude than Play-Doh"), std::string::npos) << broken[0];
}

TEST(LumpFigures, APressThatEndedHasNoNumbers) {
  lump::FigureOptions options;
  options.cells = {16, 16, 8};
  const fem::PressSolver gives_up = [](const fem::Scene& scene, const std::vector<fem::PressLoad>& loads) {
    fem::LargeStrainResult result = press_slightly(scene, loads);
    if (scene.inclusion && scene.inclusion->size_mm[0] == 12) {
      result.converged = false;
      result.loads.clear();
      result.last_force_N = 1.25;
    }
    return result;
  };
  const lump::Figures figures = lump::make_figures(options, gives_up, kSilent);
  EXPECT_FALSE(figures.by_size[0].press.good);
  EXPECT_TRUE(figures.by_size[0].press.profile.value.empty());
  EXPECT_EQ(figures.by_size[0].press.last_force_N, 1.25);
  const std::vector<std::string> broken = broken_orderings(figures);
  ASSERT_FALSE(broken.empty());
  EXPECT_NE(broken[0].find("1.25 N"), std::string::npos) << broken[0];
}

TEST(LumpFigures, EveryInputIsVaried) {
  lump::FigureOptions options;
  options.cells = {16, 16, 8};
  uint64_t last = 0;
  const std::vector<lump::InputRow> rows =
      vary_inputs(options, press_slightly, [&](uint64_t done, uint64_t total) {
        EXPECT_LE(done, total);
        last = done == total ? total : last;
      });
  EXPECT_GT(last, 0u);
  for (const char* input : {"d", "h", "E_r", "s", "t", "l"}) {
    const auto count = std::count_if(rows.begin(), rows.end(),
                                     [&](const lump::InputRow& row) { return row.input == input; });
    EXPECT_GE(count, 4) << input;
  }
  // With a solver that is linear itself, small strain is the same line.
  for (const lump::InputRow& row : rows) {
    EXPECT_EQ(row.small_strain.has_value(), row.input == "l");
    if (!row.small_strain) continue;
    for (size_t i = 0; i < row.small_strain->value.size(); ++i)
      EXPECT_NEAR(row.small_strain->value[i], row.press.profile.value[i], 1e-3 * row.press.profile.value[i]);
  }
}

using FiguresCommand = LabProgram;

TEST_F(FiguresCommand, FiguresAreWritten) {
  const fs::path out = folder_ / "figures";
  const Ended ended =
      run({"figures", "--no-inputs", "--cells", "16", "16", "8", "--out", out.string(), "--json"});
  ASSERT_EQ(ended.exit_code, 0) << ended.err;
  const Json value = parse_json(ended.out);
  EXPECT_EQ(value["figure_20"].size(), 3u);
  EXPECT_EQ(value["figure_22"].size(), 2u);
  EXPECT_TRUE(value["broken_orderings"].empty());
  EXPECT_TRUE(fs::exists(out / "fig20_sizes.svg") && fs::exists(out / "fits.csv"));
  expect_refusal({"figures", "--young-Pa", "-1"}, 2, {"--young-Pa"});
}

}  // namespace
}  // namespace palpate
