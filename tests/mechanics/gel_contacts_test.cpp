// Contacts of a gel: what rings and dimples leave is one contact, specks, light and noise are none.
#include "engine/measure/contact/gel_contacts.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>
#include <random>

#include "tests/reference/cell_change.h"

namespace palpate {
namespace {

constexpr uint32_t kGelWidth = 380, kGelHeight = 277;
constexpr double kPitch_mm = 0.09;

/// Change of red, green and blue at a place.
using Change = std::function<std::array<double, 3>(double x_px, double y_px)>;

class GelContactsTest : public testing::Test {
 protected:
  GelContactsTest() {
    rest_ = picture([](double, double) { return std::array{0.0, 0.0, 0.0}; }, 0);
    contacts_.set_background(rest_);
  }

  /// Light that falls off to the sides, a lamp's edge, specks, noise of 1 gray level.
  Frame picture(const Change& change, double noise_gray, double gain = 1, double shift_px = 0) {
    Frame frame;
    frame.reshape({kGelWidth, kGelHeight, 3, 8});
    std::normal_distribution<double> noise(0, noise_gray > 0 ? noise_gray : 1);
    for (uint32_t y = 0; y < kGelHeight; ++y)
      for (uint32_t x = 0; x < kGelWidth; ++x) {
        const std::array<double, 3> more = change(x, y);
        for (uint32_t c = 0; c < 3; ++c) {
          const double u = x + shift_px;
          double gray = 90 + 20 * c + 0.1 * u - 0.05 * y;
          if (u < 20) gray += 60;
          if (std::abs(u - 150) < 1.5 && y % 60 == 30) gray += 100;
          gray = gain * gray + more[c] + (noise_gray > 0 ? noise(random_) : 0);
          frame.set(c, x, y, static_cast<uint32_t>(std::lround(std::clamp(gray, 0.0, 255.0))));
        }
      }
    return frame;
  }
  std::vector<ContactTouch> find(const Frame& frame, std::span<const ContactTouch> gray = {}) {
    std::vector<ContactTouch> found;
    contacts_.find(reference::cell_changes(frame, rest_), gray, found);
    return found;
  }
  std::vector<ContactTouch> find(const Change& change, double gain = 1, double shift_px = 0) {
    return find(picture(change, 1, gain, shift_px));
  }
  /// Untouched frames, as a recording begins with.
  void begin(int frames = 5) {
    for (int i = 0; i < frames; ++i) EXPECT_TRUE(find(nothing()).empty()) << "untouched frame " << i;
  }
  static Change nothing() {
    return [](double, double) { return std::array{0.0, 0.0, 0.0}; };
  }
  /// A ball: slopes along its rim, three lights from three sides, nothing in its middle.
  static Change ball(double x_px, double y_px, double radius_px, double gray = 40) {
    return [=](double x, double y) {
      const double r = std::hypot(x - x_px, y - y_px), angle = std::atan2(y - y_px, x - x_px);
      std::array<double, 3> more{};
      if (r >= radius_px) return more;
      for (int c = 0; c < 3; ++c)
        more[c] = gray * (r / radius_px) * std::cos(angle - c * 2 * std::numbers::pi / 3);
      return more;
    };
  }
  static Change both(const Change& a, const Change& b) {
    return [=](double x, double y) {
      const auto p = a(x, y), q = b(x, y);
      return std::array{p[0] + q[0], p[1] + q[1], p[2] + q[2]};
    };
  }
  static Sensor sensor() {
    Sensor s;
    s.pitch_mm_per_px = kPitch_mm;
    s.channels = 3;
    s.signal = Signal::Either;
    s.reading = SurfaceReading::Photometric;
    return s;
  }

  std::mt19937 random_{7};
  Frame rest_;
  GelContacts contacts_{sensor(), {kGelWidth, kGelHeight, 3, 8}};
};

TEST_F(GelContactsTest, ABallIsOneContactWhereItIs) {
  begin();
  for (const double radius_px : {25.0, 45.0, 80.0}) {
    find(ball(210, 130, radius_px));  // one that is not sure has to be seen twice
    const std::vector<ContactTouch> found = find(ball(210, 130, radius_px));
    ASSERT_EQ(found.size(), 1u) << radius_px;
    EXPECT_NEAR(found[0].centroid_x_px, 210, 3);
    EXPECT_NEAR(found[0].centroid_y_px, 130, 3);
    const double area_px = std::numbers::pi * radius_px * radius_px;
    EXPECT_GT(static_cast<double>(found[0].area_px), 0.8 * area_px) << radius_px;
    EXPECT_LT(std::sqrt(static_cast<double>(found[0].area_px) / std::numbers::pi), radius_px + 2 / kPitch_mm);
    EXPECT_FALSE(found[0].at_border);
    EXPECT_EQ(contacts_.whole().area_px, found[0].area_px);
  }
  EXPECT_TRUE(find(nothing()).empty()) << "after the touch";
}

TEST_F(GelContactsTest, DimplesAreOneContact) {
  begin();
  const Change dimples = [](double x, double y) {
    const bool inside = std::hypot(x - 200, y - 140) < 75;
    const double gray = inside ? 30 * std::sin(x / 5) * std::sin(y / 5) : 0;
    return std::array{gray, -gray, gray / 2};
  };
  EXPECT_EQ(find(dimples).size(), 1u);
}

TEST_F(GelContactsTest, WhatIsHardlySeenIsSeenWhereItIsWide) {
  begin();
  const Change faint = [](double x, double y) {
    const double gray = std::hypot(x - 200, y - 140) < 90 ? 4 * std::sin(x / 3) * std::cos(y / 4) + 1.2 : 0;
    return std::array{gray, gray, -gray};
  };
  find(faint);
  EXPECT_EQ(find(faint).size(), 1u);
}

// A disc's flat face changes nothing; its rim is closed, and a scratch as long is not.
TEST_F(GelContactsTest, AFlatDiscIsAContactByItsRim) {
  const auto rim = [](double from_rad) {
    return Change([=](double x, double y) {
      const double r = std::hypot(x - 200, y - 140), angle = std::atan2(y - 140, x - 200);
      std::array<double, 3> more{};
      if (std::abs(r - 60) > 1.5 || angle < from_rad) return more;
      for (int c = 0; c < 3; ++c) more[c] = 40 * std::cos(angle - c * 2 * std::numbers::pi / 3);
      return more;
    });
  };
  begin();
  EXPECT_TRUE(find(rim(-2.5)).empty());
  for (int frame = 0; frame < 3; ++frame) {
    const auto found = find(rim(-4));
    ASSERT_EQ(found.size(), 1u) << frame;
    EXPECT_NEAR(found[0].centroid_x_px, 200, 4);
    EXPECT_NEAR(found[0].centroid_y_px, 140, 4);
    EXPECT_NEAR(std::sqrt(static_cast<double>(found[0].area_px) / std::numbers::pi) * kPitch_mm, 5.4, 2);
  }
}

TEST_F(GelContactsTest, TwoSideBySideAreTwo) {
  begin();
  const std::vector<ContactTouch> found = find(both(ball(110, 140, 45), ball(280, 140, 45)));
  ASSERT_EQ(found.size(), 2u);
  EXPECT_NEAR(found[0].centroid_x_px, 110, 4);
  EXPECT_NEAR(found[1].centroid_x_px, 280, 4);
}

TEST_F(GelContactsTest, ContactsAtTheBorderAreContacts) {
  begin();
  const std::vector<ContactTouch> found = find(ball(380, 140, 40));
  ASSERT_EQ(found.size(), 1u);
  EXPECT_TRUE(found[0].at_border);
}

TEST_F(GelContactsTest, SpecksScratchesAndLampEdgesThatMoveAreNone) {
  begin();
  EXPECT_TRUE(find(nothing(), 1, 0.3).empty());
  const Change specks = [](double x, double y) {
    const bool speck = std::fmod(x, 71) < 3 && std::fmod(y, 53) < 3;
    return std::array{speck ? 120.0 : 0.0, speck ? 120.0 : 0.0, speck ? 120.0 : 0.0};
  };
  EXPECT_TRUE(find(specks).empty());
}

TEST_F(GelContactsTest, ExposureAndWhiteBalanceAreNoTouch) {
  begin();
  for (const double gain : {0.85, 0.95, 1.06, 1.15}) {
    EXPECT_TRUE(find(nothing(), gain).empty()) << gain;
    EXPECT_TRUE(contacts_.light_known());
    for (const LightChange& light : contacts_.light())
      EXPECT_NEAR(light.gain * 120 + light.offset_gray, gain * 120, 1.0) << gain;
  }
  const Change warmer = [](double, double) { return std::array{9.0, 0.0, -6.0}; };
  EXPECT_TRUE(find(warmer).empty());
  EXPECT_NEAR(contacts_.light()[0].offset_gray, 9, 0.5);
  EXPECT_NEAR(contacts_.light()[2].offset_gray, -6, 0.5);
  // And a touch under another exposure is one.
  const std::vector<ContactTouch> found = find(ball(210, 130, 50), 1.1);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_NEAR(found[0].centroid_x_px, 210, 4);
}

TEST_F(GelContactsTest, ANoisyCameraIsLearned) {
  const auto frames_with = [&](int frames) {
    int with = 0;
    for (int i = 0; i < frames; ++i) with += !find(picture(nothing(), 1.35)).empty();
    return with;
  };
  begin(10);
  EXPECT_EQ(frames_with(40), 0);
  EXPECT_EQ(find(picture(ball(210, 130, 40), 1.35)).size(), 1u);
}

TEST_F(GelContactsTest, APressKeepsItsLineageWhileItComesAndGoes) {
  begin();
  uint32_t lineage = 0;
  for (const double gray : {15.0, 40.0, 40.0, 20.0, 10.0}) {
    const std::vector<ContactTouch> found = find(ball(190 + gray, 130, 40 + gray / 2, gray));
    ASSERT_EQ(found.size(), 1u) << gray;
    if (lineage == 0) lineage = found[0].id;
    EXPECT_NE(found[0].id, 0u);
    EXPECT_EQ(found[0].id, lineage) << gray;
  }
  EXPECT_TRUE(find(nothing()).empty());
  const std::vector<ContactTouch> next = find(ball(100, 130, 40));
  ASSERT_EQ(next.size(), 1u);
  EXPECT_NE(next[0].id, lineage);
}

// A fading press is one contact or none, unless its parts are clear by themselves.
TEST_F(GelContactsTest, APressThatFallsApartIsOne) {
  begin();
  const auto bar = [](double x, double y) {
    const bool in = std::abs(y - 130) < 25 && std::abs(x - 190) < 100;
    const double slope = in ? (std::fmod(x, 12) - 6) * 5 : 0;
    return std::array{slope, -slope / 2, -slope / 2};
  };
  ASSERT_EQ(find(bar).size(), 1u);
  for (const double gray : {5.2, 4.8, 4.5, 4.2}) {
    const Change parts = both(ball(110, 130, 20, gray), ball(270, 130, 25, gray));
    EXPECT_EQ(find(parts).size(), 1u) << gray;
  }
  find(both(ball(110, 130, 25, 40), ball(270, 130, 25, 40)));
  const std::vector<ContactTouch> sure = find(both(ball(110, 130, 25, 40), ball(270, 130, 25, 40)));
  EXPECT_EQ(sure.size(), 2u);
}

// Dots all over hide the picture's structure; they move with the skin.
TEST_F(GelContactsTest, PrintedMarkersHideNoContact) {
  const auto dots = [](double shift_px) -> Change {
    return [=](double x, double y) {
      const double u = std::remainder(x + shift_px, 18.0), v = std::remainder(y, 18.0);
      const double gray = std::hypot(u, v) < 5 ? -70 : 0;
      return std::array{gray, gray, gray};
    };
  };
  rest_ = picture(dots(0), 0);
  contacts_.set_background(rest_);
  for (int i = 0; i < 5; ++i) EXPECT_TRUE(find(dots(0)).empty());
  const Change moved = [=](double x, double y) {
    return std::hypot(x - 210, y - 130) < 60 ? dots(2)(x, y) : dots(0)(x, y);
  };
  const std::vector<ContactTouch> found = find(both(moved, ball(210, 130, 45)));
  ASSERT_EQ(found.size(), 1u);
  EXPECT_NEAR(found[0].centroid_x_px, 210, 6);
  EXPECT_NEAR(found[0].centroid_y_px, 130, 6);
  const uint32_t cells_x = (kGelWidth + 3) / 4;
  EXPECT_EQ(contacts_.at_rest()[130 / 4 * cells_x + 210 / 4], 0);
  EXPECT_EQ(contacts_.at_rest()[20 / 4 * cells_x + 20 / 4], 1);
}

TEST_F(GelContactsTest, GrayOfPiecesGoesToTheirContact) {
  begin();
  ContactTouch rim, middle, speck;
  rim.centroid_x_px = 190, rim.centroid_y_px = 130, rim.gray_sum = 100, rim.peak_gray = 50;
  middle.centroid_x_px = 215, middle.centroid_y_px = 135, middle.gray_sum = 10, middle.peak_gray = 70;
  middle.saturated_px = 2;
  speck.centroid_x_px = 20, speck.centroid_y_px = 20, speck.gray_sum = 7, speck.saturated_px = 5;
  const std::vector<ContactTouch> pieces{rim, middle, speck};
  const std::vector<ContactTouch> found = find(picture(ball(210, 130, 50), 1), pieces);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].gray_sum, 110);
  EXPECT_EQ(found[0].peak_gray, 70);
  EXPECT_EQ(found[0].saturated_px, 2u);
}

// A strong press's effect on the gel around it is no second object: a smooth band across the picture, a
// ring around it, a change of the light alone at the border.
TEST_F(GelContactsTest, WhatAPressDoesAroundItIsNoOther) {
  const auto grown = [](double from, double to, double at) {
    return std::clamp((at - from) / (to - from), 0., 1.);
  };
  const auto waves = [](double gray, double x, double y) {
    return std::array{gray * std::sin(x / 7), gray * std::sin(y / 8), gray * std::sin((x + y) / 9)};
  };
  const Change glow = [=](double x, double) {
    const double gray = 5 * grown(120, 200, x);
    return std::array{gray, gray, gray};
  };
  const Change band = [=](double x, double y) { return waves(20 * grown(290, 310, x), x, y); };
  const Change ring = [=](double x, double y) {
    // Open at its right, as rings are that leave the picture.
    const double r = std::hypot(x - 190, y - 138);
    const bool open = x > 190 && std::abs(y - 138) < 50;
    return waves(open ? 0 : 50 * grown(96, 102, r) * (1 - grown(122, 128, r)), x, y);
  };
  const Change around = [=](double x, double y) {
    const double gray = std::hypot(x - 190, y - 138) < 128 ? 5 : 0;
    return std::array{gray, gray, gray};
  };
  const Change patch = [](double x, double y) {
    const double gray = x > 345 && y > 170 && y < 260 ? 4.5 : 0;
    return std::array{gray, gray, gray};
  };
  for (const auto& [what, change] : {std::pair{"band", both(ball(100, 138, 60, 90), both(glow, band))},
                                     {"ring", both(ball(190, 138, 50, 110), both(around, ring))},
                                     {"patch", both(ball(120, 138, 60, 60), patch)}}) {
    contacts_.set_background(rest_);
    begin();
    find(change);  // what falls apart has to be seen twice
    for (int i = 0; i < 3; ++i) EXPECT_EQ(find(change).size(), 1u) << what << " in frame " << i;
  }
  // An object is one there too.
  contacts_.set_background(rest_);
  begin();
  const Change two = both(ball(100, 138, 60, 90), ball(330, 138, 45, 60));
  find(two);
  EXPECT_EQ(find(two).size(), 2u);
}

// Frames of another picture, or of another noise, leave nothing.
TEST_F(GelContactsTest, ARestartForgetsTheFramesBefore) {
  const Frame press = picture(ball(210, 130, 45), 1);
  contacts_.restart();
  const std::vector<ContactTouch> expected = find(press);
  ASSERT_EQ(expected.size(), 1u);
  for (int i = 0; i < 20; ++i) find(picture(ball(100, 100, 30), 4));
  contacts_.restart();
  const std::vector<ContactTouch> found = find(press);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].area_px, expected[0].area_px);
  EXPECT_EQ(found[0].centroid_x_px, expected[0].centroid_x_px);
}

// A ball on an elastic pad: it touches up to a, and draws the pad down beyond. However clearly the picture
// shows it there, the area in contact is that of the radius a.
TEST_F(GelContactsTest, TheAreaInContactIsWhereTheDentIsSteepest) {
  constexpr double kDeepest_mm = 0.4;
  const uint32_t cells_x = (kGelWidth + 3) / 4, cells_y = (kGelHeight + 3) / 4;
  std::normal_distribution<double> noise_mm(0, 0.004);
  const auto hertz = [](double rho) {
    if (rho <= 1) return 1 - rho * rho / 2;
    return ((2 - rho * rho) * std::asin(1 / rho) + std::sqrt(rho * rho - 1)) / std::numbers::pi;
  };
  for (const double radius_px : {28.0, 45.0})
    for (const double gray : {15.0, 45.0, 110.0})
      for (const auto& [x_px, y_px] : {std::pair{190.0, 138.0}, {300.0, 200.0}}) {
        contacts_.set_background(rest_);
        begin();
        // The picture changes as far as the pad is dented.
        const Change change = ball(x_px, y_px, 1.6 * radius_px, gray);
        find(change);
        std::vector<ContactTouch> found = find(change);
        ASSERT_EQ(found.size(), 1u);
        const uint64_t outline_px = found[0].area_px;
        std::vector<float> depth_mm;
        for (uint32_t y = 0; y < cells_y; ++y)
          for (uint32_t x = 0; x < cells_x; ++x) {
            const double rho = std::hypot(4 * x + 1.5 - x_px, 4 * y + 1.5 - y_px) / radius_px;
            const double share = (hertz(rho) - hertz(2.5)) / (1 - hertz(2.5));
            depth_mm.push_back(static_cast<float>(kDeepest_mm * std::max(share, 0.0) + noise_mm(random_)));
          }
        contacts_.split(depth_mm, 0.004, {}, found);
        contacts_.shrink_to_depth(depth_mm, {}, found);
        ASSERT_EQ(found.size(), 1u);
        const double area_px = std::numbers::pi * radius_px * radius_px;
        EXPECT_NEAR(static_cast<double>(found[0].area_px), area_px, 0.2 * area_px)
            << radius_px << " px, " << gray << " gray, outline " << outline_px;
        EXPECT_EQ(contacts_.whole().area_px, found[0].area_px);
        EXPECT_GT(contacts_.dent(depth_mm).area_px, 1.5 * area_px);
        EXPECT_LT(contacts_.dent(depth_mm).area_px, 6.3 * area_px);
      }
}

// Without a dent the outline stays.
TEST_F(GelContactsTest, AnOutlineWithoutADentStaysTheArea) {
  begin();
  find(ball(210, 130, 45));
  std::vector<ContactTouch> found = find(ball(210, 130, 45));
  ASSERT_EQ(found.size(), 1u);
  const uint64_t outline_px = found[0].area_px;
  std::normal_distribution<float> noise_mm(0, 0.01f);
  std::vector<float> flat(size_t{(kGelWidth + 3) / 4} * ((kGelHeight + 3) / 4));
  for (float& depth : flat) depth = noise_mm(random_);
  contacts_.shrink_to_depth(flat, {}, found);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].area_px, outline_px);
}

TEST_F(GelContactsTest, FramesOfAnySize) {
  for (const auto& [width, height] : {std::pair{1u, 1u}, {3u, 9u}, {16u, 16u}, {641u, 13u}}) {
    const FrameFormat format{width, height, 3, 8};
    GelContacts contacts(sensor(), format);
    Frame rest, white;
    rest.reshape(format);
    white.reshape(format);
    std::fill(white.bytes.begin(), white.bytes.end(), uint8_t{255});
    contacts.set_background(rest);
    std::vector<ContactTouch> found;
    for (const Frame* frame : {&rest, &white, &rest})
      contacts.find(reference::cell_changes(*frame, rest), {}, found);
    EXPECT_TRUE(found.empty());
  }
}

}  // namespace
}  // namespace palpate
