// palpate wrench and the files of a frame's traction, as other programs read them.
#include <algorithm>
#include <cmath>
#include <opencv2/imgcodecs.hpp>

#include "capture/files/npy.h"
#include "palpate/error.h"
#include "tests/support/json.h"
#include "tests/support/program_fixture.h"

namespace palpate {
namespace {

class WrenchProgram : public Program {};

constexpr const char* kGel = "synthetic:press?mode=gel&size=320x240";

TEST_F(WrenchProgram, OfASimulatedGelAgainstItsTruth) {
  const Ended done = run({"wrench", kGel, "--gauge", "truth", "--out", folder_ / "out", "--json"});
  ASSERT_EQ(done.exit_code, 0) << done.err;
  const Json value = Json::parse(done.out);
  ASSERT_EQ(value["touches"].size(), 1u);
  const Json peak = value["touches"][0];
  EXPECT_NEAR(peak["fz_N"]["value"].get<double>(), 1.5, 0.05);
  EXPECT_EQ(peak["fz_N"]["state"], "valid");
  EXPECT_EQ(peak["fx_N"]["state"], "not calibrated");
  EXPECT_LT(value["gauge"]["mean_error_N"].get<double>(), 0.05);
  EXPECT_NEAR(value["gauge"]["scale"].get<double>(), 1, 0.03);
  EXPECT_GT(value["gauge"]["coverage_95"].get<double>(), 0.9);
  const std::string table = slurp(folder_ / "out" / "wrench.csv");
  EXPECT_EQ(std::count(table.begin(), table.end(), '\n'),
            static_cast<long>(value["frames"].get<size_t>()) + 1);
  for (const char* picture : {"wrench.png", "pressure.png"})
    EXPECT_GT(cv::imread((folder_ / "out" / picture).string()).cols, 500) << picture;
}

// A skin with a pattern is not missing where the pictures are only taken to be separate.
TEST_F(WrenchProgram, SeparatePicturesOfAMarkedSkinNeedASequence) {
  const Ended made = run({"simulate", "press", "--mode", "gel", "--skin", "markers", "--size", "320x240",
                          "--frames", "30", "--out", folder_ / "made"});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  std::vector<std::string> arguments = {"wrench", folder_ / "made" / "frames", "--sensor",
                                        folder_ / "made" / "sensor.json"};
  const Ended separate = run(arguments);
  ASSERT_EQ(separate.exit_code, 0) << separate.err;
  EXPECT_NE(separate.out.find("frames that follow each other (--rate, or --sequence)"), std::string::npos)
      << separate.out;
  EXPECT_EQ(separate.out.find("\"skin\""), std::string::npos) << separate.out;
  arguments.emplace_back("--sequence");
  const Ended followed = run(arguments);
  EXPECT_EQ(followed.out.find("Fx, Fy and Mz need"), std::string::npos) << followed.out;
}

TEST_F(WrenchProgram, FilesOfPressure) {
  const Ended done =
      run({"export", kGel, "--traction", "npy,tiff,ply", "--frames", "120:121", "--out", folder_ / "out"});
  ASSERT_EQ(done.exit_code, 0) << done.err;
  const fs::path stem = folder_ / "out" / "traction" / "000120";
  const NpyArray cells = read_npy(stem.string() + ".npy");
  ASSERT_EQ(cells.shape.size(), 3u);
  ASSERT_EQ(cells.shape[2], 3u);
  double most = 0;
  for (size_t i = 0; i < cells.values.size(); i += 3) most = std::max(most, double{cells.values[i]});
  EXPECT_GT(most, 50);
  EXPECT_TRUE(std::isnan(cells.values[1])) << "no skin is followed";
  const cv::Mat tiff = cv::imread(stem.string() + ".tif", cv::IMREAD_UNCHANGED);
  ASSERT_EQ(tiff.type(), CV_32FC1);
  ASSERT_EQ(tiff.rows, static_cast<int>(cells.shape[0]));
  double largest = 0;
  cv::minMaxLoc(tiff, nullptr, &largest);
  EXPECT_NEAR(largest, most, 1e-4);
  const std::string mesh = slurp(stem.string() + ".ply");
  EXPECT_NE(mesh.find("property float pressure_kPa\n"), std::string::npos);
  EXPECT_NE(mesh.find("property float shear_over_pressure\n"), std::string::npos);
  EXPECT_NE(mesh.find("element vertex " + std::to_string(320 * 240) + "\n"), std::string::npos);
}

TEST_F(WrenchProgram, WhatIsMissingIsSaid) {
  expect_refusal({"wrench", "synthetic:press?mode=lambert"}, static_cast<int>(Failure::Sensor),
                 {"elastic layer", "--young-kPa"});
  expect_refusal({"export", "synthetic:press?mode=lambert", "--traction", "npy", "--out", folder_ / "out"},
                 static_cast<int>(Failure::Usage), {"elastic layer"});
  expect_refusal({"wrench", kGel, "--thickness-mm", "0.001"}, static_cast<int>(Failure::Sensor),
                 {"3 pixels"});
}

}  // namespace
}  // namespace palpate
