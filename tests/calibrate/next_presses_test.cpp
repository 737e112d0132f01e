// Where further presses serve a calibration best.
#include "capture/calibrate/photometric/next_presses.h"

#include <gtest/gtest.h>

#include <vector>

namespace palpate {
namespace {

/// One press in the middle of each ninth of 300 x 240 px, except in `without`.
std::vector<FoundPress> everywhere(int without = -1) {
  std::vector<FoundPress> presses;
  for (int i = 0; i < 9; ++i) {
    const int column = i % 3, row = i / 3;
    if (i != without) presses.push_back({"press", 50.0 + 100 * column, 40.0 + 80 * row, 20, 0.02, ""});
  }
  return presses;
}

TEST(PlaceForPresses, IsThePartWithoutOne) {
  const auto place = place_for_presses(everywhere(5), 300, 240);
  ASSERT_TRUE(place);
  EXPECT_DOUBLE_EQ(place->left_px, 200);
  EXPECT_DOUBLE_EQ(place->right_px, 300);
  EXPECT_DOUBLE_EQ(place->top_px, 80);
  EXPECT_DOUBLE_EQ(place->bottom_px, 160);
}

TEST(PlaceForPresses, IsTheOneFarthestFromAllOfSeveral) {
  const auto place = place_for_presses(std::vector<FoundPress>{{"corner", 40, 30, 20, 0.02, ""}}, 300, 240);
  ASSERT_TRUE(place);
  EXPECT_DOUBLE_EQ(place->right_px, 300);
  EXPECT_DOUBLE_EQ(place->bottom_px, 240);
}

TEST(PlaceForPresses, ARefusedPressCoversNothing) {
  std::vector<FoundPress> presses = everywhere();
  EXPECT_FALSE(place_for_presses(presses, 300, 240)) << "all parts are alike";
  presses[0].refusal = "cut by the frame";
  const auto place = place_for_presses(presses, 300, 240);
  ASSERT_TRUE(place);
  EXPECT_DOUBLE_EQ(place->left_px, 0);
  EXPECT_DOUBLE_EQ(place->top_px, 0);
}

TEST(PlaceForPresses, IsTheWorstPartWhereAllHaveSome) {
  std::vector<FoundPress> presses = everywhere();
  presses[7].depth_error_mm = 0.029;
  EXPECT_FALSE(place_for_presses(presses, 300, 240)) << "not much worse than the others";
  presses[7].depth_error_mm = 0.05;
  const auto place = place_for_presses(presses, 300, 240);
  ASSERT_TRUE(place);
  EXPECT_DOUBLE_EQ(place->left_px, 100);
  EXPECT_DOUBLE_EQ(place->top_px, 160);
  EXPECT_NE(place->reason.find("0.05 mm"), std::string::npos) << place->reason;
}

TEST(PlaceForPresses, NothingIsSaidWithoutAPress) {
  EXPECT_FALSE(place_for_presses({}, 300, 240));
  std::vector<FoundPress> refused = everywhere();
  for (FoundPress& press : refused) press.refusal = "not a ball";
  EXPECT_FALSE(place_for_presses(refused, 300, 240));
}

}  // namespace
}  // namespace palpate
