// The program with unknown pixels: weights of gradients, confidence of pixels.
#include <cmath>
#include <limits>
#include <opencv2/imgcodecs.hpp>
#include <sstream>

#include "capture/files/npy.h"
#include "tests/support/json.h"
#include "tests/support/program_fixture.h"

namespace palpate {
namespace {

constexpr uint32_t kRows = 60, kColumns = 80;

/// Slopes of a tilted plane, unknown (NaN) in three columns.
std::vector<float> slopes_with_gap() {
  std::vector<float> slopes;
  for (uint32_t i = 0; i < kRows * kColumns; ++i) {
    const bool gap = i % kColumns >= 40 && i % kColumns < 43;
    slopes.push_back(gap ? std::numeric_limits<float>::quiet_NaN() : 0.1f);
    slopes.push_back(gap ? std::numeric_limits<float>::quiet_NaN() : -0.05f);
  }
  return slopes;
}

TEST_F(Program, IntegratesWithWeights) {
  std::vector<float> weights(kRows * kColumns, 2.5f);
  for (size_t i = 0; i < weights.size(); ++i)
    if (i % kColumns >= 40 && i % kColumns < 43) weights[i] = 0;
  write_npy(folder_ / "slopes.npy", slopes_with_gap(), {kRows, kColumns, 2});
  write_npy(folder_ / "weights.npy", weights, {kRows, kColumns});
  for (const std::string solver : {"live", "best"}) {
    const Ended ended = run({"integrate", folder_ / "slopes.npy", "--weights", folder_ / "weights.npy",
                             "--out", folder_ / "out", "--solver", solver, "--json", "--validation"});
    ASSERT_EQ(ended.exit_code, 0) << ended.err;
    EXPECT_TRUE(contains(ended.err, "2 islands")) << ended.err;
    const Json said = parse_json(ended.out);
    EXPECT_EQ(said.at("islands"), 2);
    EXPECT_EQ(said.at("unknown_px"), 3 * kRows);
    const NpyArray height = read_npy(folder_ / "out" / "height.npy");
    const double tolerance = solver == "live" ? 0.05 : 1e-4;
    for (const size_t first : {size_t{0}, size_t{43}})  // each island by itself
      for (size_t i = 0; i < weights.size(); ++i)
        if (i % kColumns >= first && i % kColumns < first + 37) {
          const double x = static_cast<double>(i % kColumns - first), y = static_cast<double>(i / kColumns);
          ASSERT_NEAR(height.values[i] - height.values[first], 0.1 * x - 0.05 * y, tolerance)
              << solver << " " << i;
        }
  }
}

TEST_F(Program, UnknownSlopesWithoutWeightsAreToldOfThem) {
  write_npy(folder_ / "slopes.npy", slopes_with_gap(), {kRows, kColumns, 2});
  expect_refusal({"integrate", folder_ / "slopes.npy", "--out", folder_ / "out"}, 3,
                 {"NaN at row 0, column 40", "--weights FILE.npy"});
}

TEST_F(Program, SlopesOfNoSurfaceAreSaidToBeWithWeightsToo) {
  std::vector<float> turning;
  for (uint32_t i = 0; i < kRows * kColumns; ++i) {
    turning.push_back(-0.01f * (static_cast<float>(i / kColumns) - 30));
    turning.push_back(0.01f * (static_cast<float>(i % kColumns) - 40));
  }
  write_npy(folder_ / "slopes.npy", turning, {kRows, kColumns, 2});
  write_npy(folder_ / "weights.npy", std::vector<float>(kRows * kColumns, 1.0f), {kRows, kColumns});
  for (const bool weighted : {false, true}) {
    std::vector<std::string> line{"integrate", folder_ / "slopes.npy", "--out", folder_ / "out"};
    if (weighted) line.insert(line.end(), {"--weights", folder_ / "weights.npy"});
    const Ended ended = run(line);
    ASSERT_EQ(ended.exit_code, 0) << ended.err;
    EXPECT_TRUE(contains(ended.err, "of the gradients belong to no surface")) << weighted << ended.err;
  }
}

TEST_F(Program, RefusesWeightsThatAreNone) {
  write_npy(folder_ / "slopes.npy", std::vector<float>(2 * kRows * kColumns, 0.1f), {kRows, kColumns, 2});
  const auto refused = [&](const std::vector<float>& values, const std::vector<size_t>& shape,
                           const std::string& word) {
    write_npy(folder_ / "weights.npy", values, shape);
    const Ended ended = run({"integrate", folder_ / "slopes.npy", "--weights", folder_ / "weights.npy",
                             "--out", folder_ / "out"});
    EXPECT_EQ(ended.exit_code, 3) << ended.err;
    EXPECT_TRUE(contains(ended.err, word)) << ended.err;
    EXPECT_FALSE(fs::exists(folder_ / "out" / "height.npy"));
  };
  std::vector<float> weights(kRows * kColumns, 1.0f);
  refused(weights, {kColumns, kRows}, "60 x 80");
  weights[kColumns + 7] = -1;
  refused(weights, {kRows, kColumns}, "row 1, column 7");
  weights[kColumns + 7] = std::numeric_limits<float>::quiet_NaN();
  refused(weights, {kRows, kColumns}, "row 1, column 7");
}

TEST_F(Program, WritesConfidenceAndLeavesOutWhatIsNotKnown) {
  const fs::path rec = folder_ / "rec", out = folder_ / "out";
  ASSERT_EQ(
      run({"simulate", "press", "--mode", "gel", "--out", rec, "--size", "96x80", "--frames", "6"}).exit_code,
      0);
  Json sensor = parse_json(slurp(rec / "sensor.json"));
  sensor["pad"] = {{"circle_px", {47.5, 39.5, 36}}};
  spill(rec / "sensor.json", sensor.dump());
  fs::create_directories(out / "confidence");
  spill(out / "confidence" / "000900.png", "left by a longer run");
  const Ended ended =
      run({"process", rec / "frames", "--sensor", rec / "sensor.json", "--out", out, "--confidence", "png16",
           "--confidence", "npy", "--json", "--validation", "--pictures"});
  ASSERT_EQ(ended.exit_code, 0) << ended.err;
  EXPECT_FALSE(fs::exists(out / "confidence" / "000900.png"));
  EXPECT_EQ(parse_json(ended.out).at("weighted_frames"), 6);
  const NpyArray map = read_npy(out / "confidence" / "000003.npy");
  EXPECT_EQ(map.shape, (std::vector<size_t>{80, 96, 2}));
  const cv::Mat png = cv::imread((out / "confidence" / "000003.png").string(), cv::IMREAD_UNCHANGED);
  ASSERT_EQ(png.type(), CV_16UC1);
  size_t unknown = 0;
  for (int y = 0; y < 80; ++y) {
    for (int x = 0; x < 96; ++x) {
      const uint16_t count = png.at<uint16_t>(y, x);
      const size_t at = 2 * (static_cast<size_t>(y) * 96 + static_cast<size_t>(x));
      EXPECT_FLOAT_EQ(map.values[at], static_cast<float>(count % 256) / 255);
      EXPECT_EQ(map.values[at + 1], static_cast<float>(count / 256));
      EXPECT_EQ(count / 256 == 4, std::hypot(x - 47.5, y - 39.5) > 36);
      unknown += count % 256 == 0;
    }
  }
  std::istringstream rows(slurp(out / "measurements.csv"));
  std::string header, row;
  std::getline(rows, header);
  std::getline(rows, row);
  EXPECT_TRUE(
      contains(header, ",unknown_px,shadowed_px,outside_px,islands,weighted_residual,weighted_misfit"));
  EXPECT_TRUE(contains(row, "," + std::to_string(unknown) + ",0," + std::to_string(unknown) + ",1,")) << row;
  EXPECT_TRUE(fs::exists(out / "pictures" / "000003.png"));
}

}  // namespace
}  // namespace palpate
