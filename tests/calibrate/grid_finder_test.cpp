// Chessboards of any size and turn in a picture: corners and scale against the board that was drawn; pictures
// without a board have none.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "capture/calibrate/frame/scale.h"
#include "engine/calibrate/grid_fit.h"

namespace palpate {
namespace {

constexpr uint32_t kCardWidth = 640, kCardHeight = 480;
constexpr int kColumns = 8, kRows = 6;
constexpr double kSquare_mm = 1.5;

/// A board with a margin on a brighter table, under light that falls off to one side.
struct Board {
  double share = 0.3;  ///< of the picture's width that its squares take
  double turn_deg = 0;
  double noise_gray = 2, uneven = 0.3;
  uint32_t seed = 1;

  double square_px() const { return share * kCardWidth / (kColumns + 1); }
  /// Place in squares from its first corner.
  std::array<double, 2> squares(double x, double y) const {
    const double turn = turn_deg * std::numbers::pi / 180, dx = x - kCardWidth * 0.48,
                 dy = y - kCardHeight * 0.53;
    return {(dx * std::cos(turn) + dy * std::sin(turn)) / square_px() + 0.5 * (kColumns - 1),
            (dy * std::cos(turn) - dx * std::sin(turn)) / square_px() + 0.5 * (kRows - 1)};
  }
  Frame picture() const {
    Frame frame;
    frame.reshape({kCardWidth, kCardHeight, 1, 8});
    std::mt19937 random(seed);
    std::normal_distribution<double> noise(0, noise_gray);
    constexpr int kFine = 3;
    for (uint32_t y = 0; y < kCardHeight; ++y)
      for (uint32_t x = 0; x < kCardWidth; ++x) {
        double gray = 0;
        for (int j = 0; j < kFine; ++j)
          for (int i = 0; i < kFine; ++i) {
            // Over 1.5 px, as a lens blurs.
            const auto [a, b] =
                squares(x + 1.5 * ((i + 0.5) / kFine - 0.5), y + 1.5 * ((j + 0.5) / kFine - 0.5));
            const bool on = a > -1 && a < kColumns && b > -1 && b < kRows;
            const bool paper = a > -2 && a < kColumns + 1 && b > -2 && b < kRows + 1;
            const bool dark =
                on && (static_cast<int>(std::floor(a)) + static_cast<int>(std::floor(b))) % 2 == 0;
            gray += dark ? 40 : paper ? 170 : 225;
          }
        const double light = (1 + uneven * (2.0 * x / kCardWidth - 1)) / (1 + uneven);
        frame.set(0, x, y,
                  static_cast<uint32_t>(
                      std::lround(std::clamp(gray / (kFine * kFine) * light + noise(random), 0.0, 255.0))));
      }
    return frame;
  }
};

TEST(GridFinder, SmallAndTurnedBoardsAreFoundWithTheRightScale) {
  uint32_t seed = 1;
  for (const auto& [share, turn_deg] : {std::pair{0.15, 0.0},
                                        {0.15, 31.0},
                                        {0.28, 2.0},
                                        {0.28, 45.0},
                                        {0.28, 118.0},
                                        {0.42, -2.5},
                                        {0.42, 200.0},
                                        {0.6, 90.0}}) {
    const Board board{share, turn_deg, 3, 0.4, seed++};
    const std::string name = std::to_string(share) + " of the width, turned by " + std::to_string(turn_deg);
    const auto view =
        find_grid(board.picture(), nullptr, GridPattern::Chessboard, kColumns, kRows, kSquare_mm);
    ASSERT_TRUE(view.has_value()) << name;
    double square = 0;
    for (const auto& p : view->seen_px) {
      const auto [a, b] = board.squares(p[0], p[1]);
      square += std::pow(a - std::round(a), 2) + std::pow(b - std::round(b), 2);
    }
    const double error_px = board.square_px() * std::sqrt(square / static_cast<double>(view->seen_px.size()));
    const GridFit fit = fit_grid({*view}, kCardWidth, kCardHeight);
    const PadFrame pad = pad_frame(fit, *view, kCardWidth, kCardHeight, 0.002);
    const double truth = kSquare_mm / board.square_px();
    std::printf(
        "%s: corners off by %.3f px RMS, %d terms, reach %.2f, pitch %.5f +- %.5f (true %.5f), %u x %u px\n",
        name.c_str(), error_px, fit.terms, fit.reach, pad.pitch_mm_per_px, pad.pitch_sd_mm_per_px, truth,
        pad.size_px[0], pad.size_px[1]);
    EXPECT_LT(error_px, 0.35) << name;
    EXPECT_NEAR(pad.pitch_mm_per_px, truth, 0.01 * truth) << name;
    EXPECT_LT(std::abs(pad.pitch_mm_per_px - truth), 3 * pad.pitch_sd_mm_per_px + 0.002 * truth) << name;
    // The frame is the picture, whatever way the board lies in it.
    EXPECT_NEAR(pad.size_px[0], kCardWidth, 0.05 * kCardWidth) << name;
    EXPECT_NEAR(pad.size_px[1], kCardHeight, 0.05 * kCardHeight) << name;
    EXPECT_NEAR(pad.quad_px[0][0], 0, 0.05 * kCardWidth) << name;
    EXPECT_NEAR(pad.quad_px[2][1], kCardHeight, 0.05 * kCardHeight) << name;
  }
}

TEST(GridFinder, DistortionIsNotDrawnOutBeyondASmallBoard) {
  const Board board{0.15, 1, 3, 0.4, 7};
  const auto view = find_grid(board.picture(), nullptr, GridPattern::Chessboard, kColumns, kRows, kSquare_mm);
  ASSERT_TRUE(view.has_value());
  const GridFit fit = fit_grid({*view}, kCardWidth, kCardHeight);
  EXPECT_EQ(fit.terms, 0);
  EXPECT_LT(fit.reach, 0.5);
}

TEST(GridFinder, PicturesWithoutABoardHaveNone) {
  std::mt19937 random(5);
  std::normal_distribution<double> noise(0, 6);
  const auto picture = [&](const auto& gray) {
    Frame frame;
    frame.reshape({320, 240, 1, 8});
    for (uint32_t y = 0; y < 240; ++y)
      for (uint32_t x = 0; x < 320; ++x)
        frame.set(0, x, y,
                  static_cast<uint32_t>(std::lround(std::clamp(
                      gray(static_cast<double>(x), static_cast<double>(y)) + noise(random), 0.0, 255.0))));
    return frame;
  };
  const auto found = [](const Frame& frame) {
    return find_grid(frame, nullptr, GridPattern::Chessboard, 5, 4, 1).has_value();
  };
  EXPECT_FALSE(found(picture([](double, double) { return 120; }))) << "noise";
  EXPECT_FALSE(found(picture([](double x, double y) {
    return std::hypot(x - 160, y - 120) < 60 ? 40 : 180;
  }))) << "a disc";
  EXPECT_FALSE(found(picture([](double x, double y) {
    return std::hypot(std::fmod(x, 24) - 12, std::fmod(y, 24) - 12) < 6 ? 40 : 180;
  }))) << "printed dots";
}

}  // namespace
}  // namespace palpate
