// The headline of a picture: what is the largest, when, and what of it is in doubt.
#include "viz/panels/headline.h"

#include <gtest/gtest.h>

namespace palpate::viz {
namespace {

Touch touch_at(double time_s, double force_N, Validity validity = Validity::Valid) {
  Touch touch;
  touch.contact = true;
  touch.time_ns = static_cast<int64_t>(1e9 * time_s);
  touch.area_px = 700;
  touch.force_N = {force_N, 0.021, validity};
  touch.surface.emplace().depth_max_mm = 0.5 * force_N;
  touch.surface->depth_sd_mm = 0.004;
  touch.surface->validity = validity;
  return touch;
}

TEST(Headline, SaysTheLargestSoFarAndWhen) {
  Headline headline;
  EXPECT_EQ(headline.answer(false), "nothing touches");
  headline.follow(touch_at(1.5, 1.2), false);
  headline.follow(touch_at(2.5, 0.8), false);
  EXPECT_EQ(headline.answer(false), "1.200 \xc2\xb1 0.021 N at 1.50 s");
  EXPECT_EQ(headline.rest(false), "largest force;  largest depth 0.600 \xc2\xb1 0.004 mm at 1.50 s");
}

TEST(Headline, NamesADoubtfulLargestAndTheLargestValid) {
  Headline headline;
  headline.follow(touch_at(1, 1.2), false);
  headline.follow(touch_at(2, 1.9, Validity::AtBorder), false);
  EXPECT_EQ(headline.answer(false), "1.900 \xc2\xb1 0.021 N at 2.00 s");
  const std::string rest = headline.rest(false);
  EXPECT_NE(rest.find(to_string(Validity::AtBorder)), std::string::npos) << rest;
  EXPECT_NE(rest.find("valid 1.200 \xc2\xb1 0.021 N at 1.00 s"), std::string::npos) << rest;
}

TEST(Headline, OfSeparatePicturesIsThePicturesOwn) {
  Headline headline;
  headline.follow(touch_at(0, 1.2), true);
  headline.follow(touch_at(0, 0.8), true);
  EXPECT_EQ(headline.answer(true), "0.800 \xc2\xb1 0.021 N");
  Touch bare = touch_at(0, 0, Validity::NotCalibrated);
  bare.surface.reset();
  headline.follow(bare, true);
  EXPECT_EQ(headline.answer(true), "700 px");
  EXPECT_NE(headline.rest(true).find("not calibrated"), std::string::npos);
}

}  // namespace
}  // namespace palpate::viz
