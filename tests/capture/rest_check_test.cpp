// An untouched image that shows a touch is reported, in a waveguide and in a gel; one that shows none is not.
#include "capture/run/rest_check.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "capture/synthetic/synthetic.h"

namespace palpate {
namespace {

class RestCheckOf : public testing::TestWithParam<const char*> {
 protected:
  /// Balls pressed one after the other at several places.
  void SetUp() override {
    const SyntheticOptions options =
        parse_synthetic(std::string("synthetic:palpation?size=320x240&rate=4&mode=") + GetParam());
    sensor_ = synthetic_sensor(options);
    SyntheticSensor source(options);
    rest_ = *source.own_background();
    Frame frame;
    while (source.next(frame)) {
      const std::optional<Truth> truth = source.truth(frame.sequence);
      if (truth->contact && truth->radius_px > radius_px_) {
        radius_px_ = truth->radius_px;
        x_px_ = truth->center_x_px;
        y_px_ = truth->center_y_px;
        pressed_ = frames_.size();
      }
      frames_.push_back(frame);
    }
    ASSERT_GT(radius_px_, 15);
  }
  std::string said(const Frame& background) {
    RestCheck check(background, sensor_);
    for (const Frame& frame : frames_) check.add(frame);
    return check.warning();
  }

  Sensor sensor_;
  Frame rest_;
  std::vector<Frame> frames_;
  size_t pressed_ = 0;
  double radius_px_ = 0, x_px_ = 0, y_px_ = 0;
};

TEST_P(RestCheckOf, LeavesAnUntouchedImageAlone) {
  EXPECT_EQ(said(rest_), "");
}

TEST_P(RestCheckOf, TellsWhereAPressedOneIsTouched) {
  const std::string warning = said(frames_[pressed_]);
  double wide = 0, x = 0, y = 0;
  unsigned long long missing = 0, looked = 0;
  ASSERT_EQ(std::sscanf(warning.c_str(),
                        "the untouched image shows a touch itself, %lf px wide around (%lf, %lf) px, that is "
                        "missing in %llu of %llu",
                        &wide, &x, &y, &missing, &looked),
            5)
      << warning;
  EXPECT_NEAR(x, x_px_, 12);
  EXPECT_NEAR(y, y_px_, 12);
  EXPECT_NEAR(wide, 2 * radius_px_, 1.2 * radius_px_);
  EXPECT_GT(missing, looked / 4);
  EXPECT_LE(looked, frames_.size());
}

TEST_P(RestCheckOf, ASignalOfTheWrongSignIsTold) {
  if (sensor_.signal == Signal::Either) GTEST_SKIP() << "both ways";
  const bool brighter = sensor_.signal == Signal::Brighter;
  sensor_.signal = brighter ? Signal::Darker : Signal::Brighter;
  const std::string wrong = said(rest_);
  EXPECT_NE(wrong.find(brighter ? "makes the picture brighter" : "makes the picture darker"),
            std::string::npos)
      << wrong;
  // One picture alone leaves both open.
  RestCheck one(rest_, sensor_);
  one.add(frames_[pressed_]);
  EXPECT_NE(one.warning().find("if it shows none"), std::string::npos) << one.warning();
}

TEST_P(RestCheckOf, LightThatChangesIsNoTouch) {
  Frame brighter = rest_;
  const FrameFormat& f = brighter.format;
  for (uint32_t c = 0; c < f.channels; ++c)
    for (uint32_t y = 0; y < f.height; ++y)
      for (uint32_t x = 0; x < f.width; ++x)
        brighter.set(c, x, y, std::min(rest_.at(c, x, y) + 6 + 3 * c, f.max_gray()));
  const std::string warning = said(brighter);
  EXPECT_EQ(warning.find("shows a touch"), std::string::npos) << warning;
  // A gel's light is followed, a waveguide's is not.
  EXPECT_EQ(warning.empty(), sensor_.signal == Signal::Either) << warning;
}

TEST_P(RestCheckOf, AnotherExposureInTheMiddleOfARunIsSaidWhereLightIsNotFollowed) {
  const std::vector<Frame> as_they_were = frames_;
  for (const double gain : {1.02, 0.8, 1.25}) {
    frames_ = as_they_were;
    for (size_t k = frames_.size() / 2; k < frames_.size(); ++k)
      for (uint8_t& value : frames_[k].bytes)
        value = static_cast<uint8_t>(std::min(std::lround(gain * value), 255L));
    const std::string warning = said(rest_);
    if (sensor_.signal == Signal::Either || gain == 1.02)
      EXPECT_EQ(warning, "") << gain;
    else
      EXPECT_NE(warning.find(gain < 1 ? "% darker than the untouched" : "% brighter than the untouched"),
                std::string::npos)
          << gain << " " << warning;
  }
}

INSTANTIATE_TEST_SUITE_P(Sensors, RestCheckOf, testing::Values("waveguide", "gel"));

}  // namespace
}  // namespace palpate
