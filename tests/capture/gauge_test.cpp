// A gauge's table: what is read, and what is refused with one clear line.
#include "capture/files/tables/gauge.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <fstream>

#include "palpate/error.h"

namespace palpate {
namespace {

namespace fs = std::filesystem;

class GaugeFile : public testing::Test {
 protected:
  void SetUp() override {
    file_ = fs::temp_directory_path() / ("palpate-gauge-" + std::to_string(getpid()) + ".csv");
  }
  void TearDown() override { fs::remove(file_); }
  Gauge read(const std::string& text, GaugeColumns wanted = GaugeColumns::Normal) const {
    std::ofstream(file_) << text;
    return read_gauge(file_, wanted);
  }
  /// Error text for a table that cannot be used.
  std::string refusal(const std::string& text, GaugeColumns wanted = GaugeColumns::Normal) const {
    try {
      read(text, wanted);
    } catch (const Error& error) {
      EXPECT_EQ(error.failure(), Failure::Input);
      const std::string what = error.what();
      EXPECT_EQ(std::count(what.begin(), what.end(), '\n'), 0) << what;
      return what;
    }
    ADD_FAILURE() << "not refused: " << text;
    return {};
  }
  fs::path file_;
};

TEST_F(GaugeFile, UnitsComeFromTheHeader) {
  for (const auto& [header, time, force] : {std::tuple{"time_s,force_N", 1.0, 1.0},
                                            {"time_ms,force_mN", 1e-3, 1e-3},
                                            {"time_us,fz_kN", 1e-6, 1e3},
                                            {"Time [ns],Force [gf]", 1e-9, 9.80665e-3},
                                            {"t (s),load (kgf)", 1.0, 9.80665},
                                            {"\"time_s\",force_lbf", 1.0, 4.4482216152605}}) {
    const Gauge g = read(std::string(header) + "\n1,0\n2,10\n3,-5\n");
    ASSERT_EQ(g.size(), 3u) << header;
    EXPECT_NEAR(g.time_s[2], 3 * time, 1e-12 * time) << header;
    EXPECT_NEAR(g.force_N[1], 10 * force, 1e-12 * force) << header;
    EXPECT_NEAR(g.force_N[2], -5 * force, 1e-12 * force) << header;
    EXPECT_FALSE(g.by_frame());
  }
}

TEST_F(GaugeFile, UnitsOfScalesAndOtherSpellingsAreConvertedAndSaid) {
  for (const auto& [header, force] : {std::pair{"time_s,force_kg", 9.80665},
                                      {"time_s,force_g", 9.80665e-3},
                                      {"time_s,force_KG", 9.80665},
                                      {"time_s,Force [Kgf]", 9.80665},
                                      {"time_s,load (lbs)", 4.4482216152605},
                                      {"time_s,force_lb", 4.4482216152605},
                                      {"time_s,force_GF", 9.80665e-3},
                                      {"time_s,Fz (KN)", 1e3},
                                      {"time_s,Force mn", 1e-3},
                                      {"time_s,weight_g", 9.80665e-3},
                                      {"time_s,force_n", 1.0}}) {
    const Gauge g = read(std::string(header) + "\n1,0\n2,10\n3,5\n");
    EXPECT_NEAR(g.force_N[1], 10 * force, 1e-12 * force) << header;
    ASSERT_EQ(g.notes.size(), 1u) << header;
    EXPECT_NE(g.notes[0].find("is read in "), std::string::npos) << g.notes[0];
  }
  EXPECT_TRUE(read("time_s,force_N\n1,0\n2,1\n3,2\n").notes.empty());
  EXPECT_NE(read("frame,force_kg\n1,0\n2,1\n3,2\n").notes[0].find("kgf (9.80665 N each)"), std::string::npos);
  // A column of another meaning that begins alike is passed over.
  EXPECT_EQ(read("time_s,force_state,force_N\n1,0,3\n2,1,4\n3,2,5\n").force_N[0], 3);
}

TEST_F(GaugeFile, AMissingDirectionIsSaid) {
  const Gauge g = read("time_s,fx_N\n1,0\n2,1\n3,2\n", GaugeColumns::Tangential);
  ASSERT_EQ(g.notes.size(), 1u);
  EXPECT_NE(g.notes[0].find("no column fy_N"), std::string::npos) << g.notes[0];
}

TEST_F(GaugeFile, AGaugeToWhichAPressIsNegativeIsTurned) {
  Gauge g = read("time_s,force_N\n1,0.1\n2,-4\n3,-2\n");
  EXPECT_TRUE(g.reads_negative());
  g.turn();
  EXPECT_EQ(g.force_N[1], 4);
  EXPECT_NE(g.notes.back().find("down to -4 N"), std::string::npos) << g.notes.back();
  EXPECT_FALSE(g.reads_negative());
  EXPECT_FALSE(read("time_s,force_N\n1,-1\n2,4\n3,2\n").reads_negative());
}

TEST_F(GaugeFile, WhatItReadsUntouchedIsTakenOffOrRefused) {
  std::vector<double> force(60, 0.8);
  std::vector<bool> touched(60);
  for (size_t i = 20; i < 40; ++i) force[i] = 2.3, touched[i] = true;
  const std::string said = take_off_zero(force, touched, "fx of gauge.csv");
  EXPECT_NE(said.find("fx of gauge.csv reads +0.8 +- 0 N where nothing touches"), std::string::npos) << said;
  EXPECT_NEAR(force[0], 0, 1e-12);
  EXPECT_NEAR(force[30], 1.5, 1e-12);
  EXPECT_EQ(take_off_zero(force, touched, ""), "") << "now it is right";
  EXPECT_NE(take_off_zero(force, std::vector<bool>(60, true), "it").find("not known"), std::string::npos);
  for (size_t i = 40; i < 60; ++i) force[i] += 0.4;
  try {
    take_off_zero(force, touched, "it");
    FAIL() << "a zero that moves";
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("differs by 0.4 N"), std::string::npos) << error.what();
  }
}

TEST_F(GaugeFile, TablesAsProgramsWriteThem) {
  // Byte order mark, comments, foreign columns, line ends and decimal commas of other countries.
  const Gauge g =
      read("\xef\xbb\xbf# rig 3\r\nframe;width_mm;force_N\r\n0;50,6;0,25\r\n\r\n7;50,5;+1,5e0\r\n9;x;2\r\n");
  EXPECT_TRUE(g.by_frame());
  EXPECT_EQ(g.frames, (std::vector<uint64_t>{0, 7, 9}));
  EXPECT_EQ(g.force_N, (std::vector<double>{0.25, 1.5, 2}));
  EXPECT_EQ(gauge_at_frame(g, g.force_N, 7), 1.5);
  EXPECT_FALSE(gauge_at_frame(g, g.force_N, 8));
  const Gauge shear =
      read("time_s\tshear_mN\tdirection_deg\n0\t0\t0\n1\t2000\t90\n2\t1000\t180\n", GaugeColumns::Tangential);
  EXPECT_NEAR(shear.fy_N[1], 2, 1e-12);
  EXPECT_NEAR(shear.fx_N[1], 0, 1e-12);
  EXPECT_NEAR(shear.fx_N[2], -1, 1e-12);
  EXPECT_TRUE(shear.force_N.empty());
}

TEST_F(GaugeFile, GapsAreNotBridged) {
  std::string text = "time_s,force_N\n";
  for (int i = 0; i < 100; ++i)
    if (i < 40 || i >= 60) text += std::to_string(0.01 * i) + "," + std::to_string(i) + "\n";
  const Gauge g = read(text);
  ASSERT_EQ(g.gaps.size(), 1u);
  EXPECT_NEAR(g.gaps[0].from_s, 0.39, 1e-9);
  EXPECT_NEAR(g.gaps[0].to_s, 0.60, 1e-9);
  EXPECT_NE(describe_gaps(g).find("0.21 s in all, the longest from 0.39 s to 0.6 s"), std::string::npos)
      << describe_gaps(g);
  EXPECT_NEAR(*gauge_at(g, g.force_N, 0.205), 20.5, 1e-6);
  EXPECT_FALSE(gauge_at(g, g.force_N, 0.5));
  EXPECT_TRUE(gauge_at(g, g.force_N, 0.60));
  EXPECT_FALSE(gauge_at(g, g.force_N, -0.001));
  EXPECT_FALSE(gauge_at(g, g.force_N, 1.0));
}

TEST_F(GaugeFile, RefusesWithWhatIsWrong) {
  const auto says = [&](const std::string& text, const std::string& part,
                        GaugeColumns wanted = GaugeColumns::Normal) {
    const std::string said = refusal(text, wanted);
    EXPECT_NE(said.find(part), std::string::npos) << said;
  };
  says("", "an empty file");
  says("# only remarks\n", "an empty file");
  says("time_s,force_N\n", "at least 3 readings");
  says("time_s,force_N\n0,1\n1,2\n", "at least 3 readings");
  says("time_s,force\n0,1\n1,2\n2,3\n", "a unit (N, mN, kN, gf, kgf, lbf) in the header of column 'force'");
  says("time_s,force_oz\n0,1\n1,2\n2,3\n", "found 'oz'");
  says("time_s,force_MN\n0,1\n1,2\n2,3\n", "found 'MN'");
  says("time_s,force_N\n0,1,25\n1,2,5\n2,3,0\n", "decimal commas");
  says("frame,force_gf\n0,0,00\n1,0,50\n2,1,00\n", "semicolons between the cells");
  says("time_s,force_N,fx_N,fy_N\n0,04,1,25\n0,08,1,26\n0,12,1,27\n", "commas may have cut numbers");
  says("time_h,force_N\n0,1\n1,2\n2,3\n", "found 'h'");
  says("time,force_N\n0,1\n1,2\n2,3\n", "a unit (s, ms, us, ns)");
  says("seconds,force_N\n0,1\n1,2\n2,3\n", "a column time_s");
  says("time_s,newton\n0,1\n1,2\n2,3\n", "a column force_N");
  says("0,1\n1,2\n2,3\n", "a column time_s");
  says("time_s,force_N\n0,1\n2,2\n1,3\n", "1 s after 2 s in line 4");
  says("time_s,force_N\n0,1\n1,2\n1,3\n", "times that rise");
  says("time_s,force_N\n0,1\n1,nan\n2,3\n", "column 'force_N', line 3");
  says("time_s,force_N\n0,1\n1,inf\n2,3\n", "found 'inf'");
  says("time_s,force_N\n0,1\n1\n2,3\n", "found none");
  says("time_s,force_N\n0,1\n1,2 N\n2,3\n", "found '2 N'");
  says("frame,force_N\n0,1\n0,2\n2,3\n", "frames that rise");
  says("frame,force_N\n0,1\n1.5,2\n2,3\n", "whole frame numbers");
  says("frame,force_N\n-1,1\n1,2\n2,3\n", "whole frame numbers");
  says("time_s,force_N\n0,1\n1,2\n2,3\n", "tangential forces", GaugeColumns::Tangential);
  says("time_s,shear_N,direction\n0,1,0\n1,2,0\n2,3,0\n", "a unit (rad, deg)", GaugeColumns::Tangential);
  EXPECT_THROW(read_gauge("/nowhere/gauge.csv", GaugeColumns::Normal), Error);
  EXPECT_THROW(read_gauge(fs::temp_directory_path(), GaugeColumns::Normal), Error);
}

}  // namespace
}  // namespace palpate
