// Words, units and colour bars of plots.
#include "viz/report/plot_script.h"

#include <gtest/gtest.h>

#include <cmath>

namespace palpate {
namespace {

TEST(PlotScript, UnitsKeepValuesReadable) {
  for (const auto& [largest, unit, shown] : {std::tuple{2600.0, "kPa", 2.6},
                                             {470.0, "Pa", 470.0},
                                             {3.2e6, "MPa", 3.2},
                                             {0.02, "mPa", 20.0},
                                             {4e-5, "µPa", 40.0},
                                             {0.0, "Pa", 0.0}}) {
    const PlotUnit found = plot_unit(largest, "Pa");
    EXPECT_EQ(found.name, unit);
    EXPECT_NEAR(found.factor * largest, shown, 1e-9);
  }
  EXPECT_EQ(plot_unit(12, "Pa").column(3), "3");
  EXPECT_EQ(plot_unit(1200, "Pa").column(3), "(0.001*$3)");
  EXPECT_EQ(plot_unit(NAN, "Pa").factor, 1);
}

TEST(PlotScript, PowersAreRaisedAndQuotesKept) {
  EXPECT_EQ(plot_words("R^2 0.99, 12 mm2, the LED's 3 mm^3"), "'R² 0.99, 12 mm², the LED''s 3 mm³'");
}

TEST(PlotScript, LongTitlesTakeLines) {
  EXPECT_EQ(plot_lines("two words", 20), "'two words'");
  EXPECT_EQ(plot_lines("it's two words", 9), "'it''s two'.\"\\n\".'words'");
  EXPECT_EQ(plot_lines("unbreakable as", 5), "'unbreakable'.\"\\n\".'as'");
  EXPECT_EQ(plot_lines("", 5), "''");
}

TEST(PlotScript, AMapOfOneValueHasNoScale) {
  EXPECT_EQ(plot_colour_bar(1, 1), "unset colorbox\n");
  EXPECT_EQ(plot_colour_bar(1, 1 + 1e-9), "unset colorbox\n");
  EXPECT_EQ(plot_colour_bar(0, 0), "unset colorbox\n");
  EXPECT_EQ(plot_colour_bar(0.9, 1), "set colorbox\n");
}

}  // namespace
}  // namespace palpate
