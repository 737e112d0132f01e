// Words, units and colour bars of plots.
#include "viz/report/plot.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "viz/report/gnuplot.h"

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
  EXPECT_EQ(plot_lines("one\ntwo", 20), "'one'.\"\\n\".'two'");
}

TEST(PlotScript, AMapOfOneValueHasNoScale) {
  EXPECT_EQ(plot_colour_bar(1, 1), "unset colorbox\n");
  EXPECT_EQ(plot_colour_bar(1, 1 + 1e-9), "unset colorbox\n");
  EXPECT_EQ(plot_colour_bar(0, 0), "unset colorbox\n");
  EXPECT_EQ(plot_colour_bar(0.9, 1), "set colorbox\n");
}

bool holds(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

TEST(Plot, DrawsCurvesAndMaps) {
  Plot plot{.title = "It's a title", .across = 2};
  plot.panels.push_back({.title = "curves",
                         .x_label = "x, mm",
                         .y_label = "y, Pa",
                         .second_label = "width, mm^2",
                         .curves = {{.title = "first", .x = {1, 2, 3}, .y = {1, NAN, 3}},
                                    {.title = "second",
                                     .x = {1, 2, 3},
                                     .y = {10, 20, 30},
                                     .style = PlotCurve::Style::LinesAndPoints,
                                     .colour = 1,
                                     .dashed = true,
                                     .second_axis = true}},
                         .log_x = true,
                         .x_tics = {{"one", 1}, {"three", 3}}});
  plot.panels.push_back({.title = "map", .map = PlotMap{2, 2, 1, 1, {0, 1, 2, 3}}});
  plot.panels.push_back({.title = "nothing"});
  const std::string script = plot_script(plot, PlotKind::Svg);
  for (const char* part : {"'It''s a title'", "layout 2,2", "set logscale x", "2 NaN", "axes x1y2", "dt 2",
                           "'one' 1, 'three' 3", "'width, mm²'", "with image", "plot NaN notitle"})
    EXPECT_TRUE(holds(script, part)) << part << " is not in\n" << script;
  const Picture picture = run_gnuplot(script);
  if (picture.missing) GTEST_SKIP() << "NO gnuplot HERE: the picture is not tested";
  EXPECT_EQ(picture.error, "");
  for (const char* part : {"<svg", "first", "second", "nothing"})
    EXPECT_TRUE(holds(picture.bytes, part)) << part;
}

/// gnuplot takes the name of a tic for a format of its number.
TEST(Plot, NamesOfTicsMayHavePercentSigns) {
  Plot plot;
  PlotPanel panel{.title = "costs", .x_label = "ms", .y_label = ""};
  panel.curves = {{.x = {1, 2, 3}, .y = {0, 1, 2}}};
  panel.y_tics = {{"force (10 % touched)", 0.0}, {"all", 2.0}};
  plot.panels.push_back(panel);
  const Picture picture = run_gnuplot(plot_script(plot, PlotKind::Svg));
  if (picture.missing) GTEST_SKIP() << "no gnuplot";
  EXPECT_EQ(picture.error, "");
  EXPECT_TRUE(holds(picture.bytes, "force (10 % touched)"));
}

TEST(Plot, DrawsEveryStyleAndItsInterval) {
  using Style = PlotCurve::Style;
  PlotPanel panel{"a title\nof two lines", "x, mm", "y, Pa"};
  panel.y_range = {{0, kPlotAuto}};
  panel.down = true;
  for (const Style style : {Style::Lines, Style::Points, Style::LinesAndPoints, Style::Steps,
                            Style::FilledSteps, Style::Band, Style::Bars, Style::Rows, Style::Arrows}) {
    PlotCurve& curve = panel.add("", {1, 2, 3}, {2, 3, 4}, panel.curves.size(), style);
    curve.low = {1, 2, 3};
    curve.high = {3, 4, 5};
  }
  panel.add("", {1, 2}, {2, 3}, kPlotBlack, Style::Words).words = {"word one", "word two"};
  panel.add_line("limit", {0, 1}, {4, 1});
  PlotPanel space{"in space", "x", "y"};
  space.z_label = "z";
  space.add("", {1, 2}, {2, 3}, 0, Style::Points).z = {4, 5};
  PlotPanel map{.title = "signs", .map = PlotMap{2, 2, 1, 1, {NAN, -3, 2, 1}, {}, 5, 6, "Pa", true}};
  PlotPanel legend{.key = "left center", .bare = true};
  legend.add("only in the key", {-1}, {0});
  const Plot plot{"", {panel, space, map, legend}, 2};
  const std::string script = plot_script(plot, PlotKind::Svg, "a-name");
  for (const char* part :
       {"'a title'.\"\\n\".'of two lines'", "set yrange [0:*] reverse", "1:3:4 with filledcurves",
        "1:2:3:4 with yerrorbars", "with fillsteps", "with boxxyerror", "with vectors", "1 2 \"word one\"",
        "splot $p1_0", "set cbrange [-3:3]", "4.5 5.5 NaN", "unset border", "name 'a_name'"})
    EXPECT_TRUE(holds(script, part)) << part << " is not in\n" << script;
  const Picture picture = run_gnuplot(script);
  if (picture.missing) GTEST_SKIP() << "NO gnuplot HERE: the picture is not tested";
  EXPECT_EQ(picture.error, "");
  for (const char* part : {"word two", "of two lines", "in space", "limit", "only in the key"})
    EXPECT_TRUE(holds(picture.bytes, part)) << part;
}

}  // namespace
}  // namespace palpate
