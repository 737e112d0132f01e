// Pictures that were spoilt on their way: they are found, nothing is measured of them, and what touch and
// light do to a picture is not taken for damage.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <random>

#include "capture/files/measurements.h"
#include "capture/synthetic/scene.h"
#include "capture/synthetic/synthetic.h"
#include "engine/measure/picture/picture_check.h"
#include "engine/sensor/outline.h"
#include "palpate/pipeline.h"
#include "tests/support/gpu_fixture.h"

namespace palpate {
namespace {

SyntheticOptions scene(const std::string& name, SyntheticMode mode, bool noise = true) {
  SyntheticOptions options;
  options.scene = name;
  options.mode = mode;
  options.noise = noise;
  options.width = 160;
  options.height = 120;
  return options;
}

using Spoiler = std::function<void(const Frame& from, const Frame& before, Frame& to)>;

/// Pixel (x, y) of each channel comes from elsewhere.
void take_from(const Frame& from, Frame& to,
               const std::function<std::array<uint32_t, 3>(uint32_t c, uint32_t x, uint32_t y)>& place) {
  for (uint32_t c = 0; c < to.format.channels; ++c)
    for (uint32_t y = 0; y < to.format.height; ++y)
      for (uint32_t x = 0; x < to.format.width; ++x) {
        const auto [channel, u, v] = place(c, x, y);
        to.set(c, x, y, from.at(channel, u, v));
      }
}

const std::map<std::string, std::pair<PictureFault, Spoiler>>& spoilers() {
  constexpr uint32_t kWidth = 160, kHeight = 120;
  const auto one_colour = [](std::array<uint32_t, 3> colour) -> Spoiler {
    return [colour](const Frame&, const Frame&, Frame& to) {
      for (uint32_t c = 0; c < to.format.channels; ++c)
        for (uint32_t y = 70; y < kHeight; ++y)
          for (uint32_t x = 0; x < kWidth; ++x) to.set(c, x, y, colour[c]);
    };
  };
  static const std::map<std::string, std::pair<PictureFault, Spoiler>> all = {
      {"green below", {PictureFault::OneColour, one_colour({0, 135, 0})}},
      {"gray below", {PictureFault::OneColour, one_colour({100, 100, 100})}},
      {"black below", {PictureFault::OneColour, one_colour({0, 0, 0})}},
      {"colours exchanged",
       {PictureFault::ColourOrder,
        [](const Frame& from, const Frame&, Frame& to) {
          take_from(from, to, [](uint32_t c, uint32_t x, uint32_t y) { return std::array{2 - c, x, y}; });
        }}},
      {"rolled to the right",
       {PictureFault::Moved,
        [](const Frame& from, const Frame&, Frame& to) {
          take_from(from, to, [](uint32_t c, uint32_t x, uint32_t y) {
            return std::array{c, (x + kWidth - 37) % kWidth, y};
          });
        }}},
      {"rolled down",
       {PictureFault::Moved,
        [](const Frame& from, const Frame&, Frame& to) {
          take_from(from, to, [](uint32_t c, uint32_t x, uint32_t y) {
            return std::array{c, x, (y + kHeight - 51) % kHeight};
          });
        }}},
      {"rolled from a row on",
       {PictureFault::Moved,
        [](const Frame& from, const Frame&, Frame& to) {
          take_from(from, to, [](uint32_t c, uint32_t x, uint32_t y) {
            return std::array{c, y < 40 ? x : (x + 90) % kWidth, y};
          });
        }}},
      {"twice side by side",
       {PictureFault::Moved,
        [](const Frame& from, const Frame&, Frame& to) {
          take_from(from, to, [](uint32_t c, uint32_t x, uint32_t y) {
            return std::array{c, 2 * x % kWidth, y};
          });
        }}},
  };
  return all;
}

TEST(PictureCheckTest, EverySpoiltPictureIsFoundTouchedOrNot) {
  SyntheticSensor source(scene("press", SyntheticMode::Gel));
  PictureCheck check(source.format(), 255);
  check.set_reference(*source.own_background());
  Frame frame, before;
  for (const uint64_t number : {3u, 60u, 120u, 170u}) {
    source.render(number, frame);
    source.render(number > 30 ? number - 30 : 0, before);
    EXPECT_EQ(check.look_at(frame), PictureFault::None) << number;
    for (const auto& [name, spoiler] : spoilers()) {
      Frame spoilt = frame;
      spoiler.second(frame, before, spoilt);
      EXPECT_EQ(to_string(check.look_at(spoilt)), std::string(to_string(spoiler.first)))
          << name << " " << number;
    }
  }
}

// A nearly gray gel under a touch that changes most of it by far more than its colours differ.
TEST(PictureCheckTest, ExchangedColoursOfAGrayGelAreFoundUnderAStrongTouch) {
  const FrameFormat format{320, 240, 3, 8};
  std::mt19937 random(3);
  const auto picture = [&](double touch, const std::array<double, 3>& light, bool exchanged) {
    Frame frame;
    frame.reshape(format);
    for (uint32_t y = 0; y < format.height; ++y)
      for (uint32_t x = 0; x < format.width; ++x) {
        const double dent = touch * std::exp(-(std::pow(x - 150.0, 2) + std::pow(y - 110.0, 2)) / 20000);
        for (uint32_t c = 0; c < 3; ++c) {
          const double tint = 3 * std::sin(x / 50.0 + 2 * c) + 2 * (static_cast<double>(c) - 1);
          const double gray = (110 + tint - dent) * light[c] + static_cast<int>(random() % 5) - 2;
          frame.set(exchanged ? 2 - c : c, x, y, static_cast<uint32_t>(std::lround(gray)));
        }
      }
    return frame;
  };
  PictureCheck check(format, 255);
  check.set_reference(picture(0, {1, 1, 1}, false));
  for (const double touch : {0.0, 15.0, 50.0, 80.0}) {
    EXPECT_EQ(check.look_at(picture(touch, {1, 1, 1}, false)), PictureFault::None) << touch;
    EXPECT_EQ(check.look_at(picture(touch, {1.02, 1, 0.98}, false)), PictureFault::None) << touch;
    EXPECT_EQ(check.look_at(picture(touch, {1, 1, 1}, true)), PictureFault::ColourOrder) << touch;
  }
}

TEST(PictureCheckTest, APartInOneColourIsFoundOnAWaveguide) {
  SyntheticSensor source(scene("press", SyntheticMode::Waveguide));
  PictureCheck check(source.format(), 255);
  check.set_reference(*source.own_background());
  Frame frame;
  source.render(120, frame);
  EXPECT_EQ(check.look_at(frame), PictureFault::None);
  for (uint32_t y = 90; y < 120; ++y)
    for (uint32_t x = 0; x < 160; ++x) frame.set(0, x, y, 128);
  EXPECT_EQ(check.look_at(frame), PictureFault::OneColour);
}

/// The lower part is of another moment, when the light or what touches differed all across; a straight edge
/// that ends within the frame may be an object's.
TEST(PictureCheckTest, ATearAcrossTheFrameIsFoundAndAnObjectsEdgeIsNone) {
  SyntheticSensor source(scene("press", SyntheticMode::Gel));
  PictureCheck check(source.format(), 255);
  check.set_reference(*source.own_background());
  Frame frame;
  source.render(3, frame);
  const auto changed = [&](uint32_t from, uint32_t to) {
    Frame other = frame;
    for (uint32_t c = 0; c < 3; ++c)
      for (uint32_t y = 55; y < 80; ++y)
        for (uint32_t x = from; x < to; ++x)
          other.set(c, x, y, std::min(254u, other.at(c, x, y) + (c == 0 ? 30 : 5) * (80 - y) / 25));
    return other;
  };
  EXPECT_EQ(check.look_at(changed(0, 160)), PictureFault::Torn);
  EXPECT_EQ(check.look_at(changed(40, 120)), PictureFault::None);
}

constexpr PadEllipse kRound{.x = 80, .y = 60, .radius_x = 50, .radius_y = 55};
constexpr PadRectangle kSquare{.x = 32, .y = 16, .width = 96, .height = 88};

/// `inside` on the pad, `around` beyond it.
Frame joined(const Frame& inside, const Frame& around, const PadOutline& pad) {
  Frame frame = inside;
  for (uint32_t c = 0; c < frame.format.channels; ++c)
    for (uint32_t y = 0; y < frame.format.height; ++y)
      for (uint32_t x = 0; x < frame.format.width; ++x)
        if (!contains(pad, x, y)) frame.set(c, x, y, around.at(c, x, y));
  return frame;
}

/// A housing with stripes.
Frame housing(const FrameFormat& format) {
  Frame frame;
  frame.reshape(format);
  for (uint32_t c = 0; c < format.channels; ++c)
    for (uint32_t y = 0; y < format.height; ++y)
      for (uint32_t x = 0; x < format.width; ++x) frame.set(c, x, y, 40 + (x / 5 + y / 7) % 2 * 60);
  return frame;
}

class AroundThePad : public testing::TestWithParam<PadOutline> {
 protected:
  AroundThePad() : source_(scene("press", SyntheticMode::Gel)), check_(source_.format(), 255, GetParam()) {
    housing_ = housing(source_.format());
    check_.set_reference(joined(*source_.own_background(), housing_, GetParam()));
    source_.render(60, touched_);
  }
  Frame spoilt(const std::string& how, const Frame& frame) const {
    Frame to = frame;
    spoilers().at(how).second(frame, frame, to);
    return to;
  }

  SyntheticSensor source_;
  PictureCheck check_;
  Frame housing_, touched_;
};

TEST_P(AroundThePad, DamageIsFoundInsideAStructuredBorderThatStays) {
  PictureCheck everywhere(source_.format(), 255);
  everywhere.set_reference(joined(*source_.own_background(), housing_, GetParam()));
  EXPECT_EQ(check_.look_at(joined(touched_, housing_, GetParam())), PictureFault::None);
  uint32_t missed = 0;
  for (const std::string how : {"green below", "gray below", "black below", "colours exchanged"}) {
    const Frame frame = joined(spoilt(how, touched_), housing_, GetParam());
    EXPECT_EQ(to_string(check_.look_at(frame)), std::string(to_string(spoilers().at(how).first))) << how;
    missed += everywhere.look_at(frame) == PictureFault::None;
  }
  EXPECT_GT(missed, 0u);  // the outline is needed
  // Of another moment from a row on, when the light differed.
  Frame torn = touched_;
  for (uint32_t y = 55; y < 80; ++y)
    for (uint32_t x = 0; x < 160; ++x)
      torn.set(0, x, y, std::min(254u, torn.at(0, x, y) + 30 * (80 - y) / 25));
  EXPECT_EQ(check_.look_at(joined(torn, housing_, GetParam())), PictureFault::Torn);
  // A picture that moved takes its border with it.
  for (const char* how : {"rolled to the right", "rolled down", "rolled from a row on"})
    EXPECT_EQ(check_.look_at(spoilt(how, joined(touched_, housing_, GetParam()))), PictureFault::Moved)
        << how;
}

TEST_P(AroundThePad, WhatHappensBeyondItIsNoDamage) {
  for (const auto& [how, spoiler] : spoilers())
    for (const Frame& around : {spoilt(how, housing_), spoilt(how, touched_)})
      EXPECT_EQ(to_string(check_.look_at(joined(touched_, around, GetParam()))), std::string("whole")) << how;
}

INSTANTIATE_TEST_SUITE_P(Outlines, AroundThePad, testing::Values(PadOutline(kSquare), PadOutline(kRound)));

TEST(PictureCheckTest, NoTouchOfAnySceneIsTakenForDamage) {
  for (const SyntheticMode mode : {SyntheticMode::Waveguide, SyntheticMode::Gel, SyntheticMode::Lambert})
    for (const bool noise : {true, false})
      for (const auto& [name, said] : synthetic_scenes()) {
        SyntheticSensor source(scene(name, mode, noise));
        PictureCheck check(source.format(), 255);
        check.set_reference(*source.own_background());
        Frame frame;
        const uint64_t frames = source.frame_count().value_or(60);
        for (uint64_t i = 0; i < frames; i += std::max<uint64_t>(1, frames / 12)) {
          source.render(i, frame);
          EXPECT_EQ(to_string(check.look_at(frame)), std::string("whole"))
              << name << ", mode " << static_cast<int>(mode) << ", noise " << noise << ", frame " << i;
        }
      }
}

TEST(PictureCheckTest, NoLightIsTakenForDamage) {
  SyntheticSensor source(scene("press", SyntheticMode::Gel));
  PictureCheck check(source.format(), 255);
  check.set_reference(*source.own_background());
  Frame frame;
  source.render(120, frame);
  const auto changed =
      [&](const std::function<double(uint32_t c, uint32_t x, uint32_t y, double gray)>& light) {
        Frame other = frame;
        for (uint32_t c = 0; c < 3; ++c)
          for (uint32_t y = 0; y < other.format.height; ++y)
            for (uint32_t x = 0; x < other.format.width; ++x)
              other.set(c, x, y,
                        static_cast<uint32_t>(std::clamp(light(c, x, y, other.at(c, x, y)), 0.0, 255.0)));
        return std::string(to_string(check.look_at(other)));
      };
  for (const double gain : {0.1, 0.5, 0.8, 1.3, 4.0, 100.0})
    EXPECT_EQ(changed([&](uint32_t, uint32_t, uint32_t, double gray) { return gain * gray; }), "whole")
        << gain;
  for (const uint32_t lamp : {0u, 1u, 2u})
    EXPECT_EQ(
        changed([&](uint32_t c, uint32_t, uint32_t, double gray) { return c == lamp ? 0.6 * gray : gray; }),
        "whole")
        << lamp;
  // A lamp beside the pad, and bands of a lamp that flickers faster than the rows are read.
  EXPECT_EQ(
      changed([](uint32_t c, uint32_t x, uint32_t, double gray) { return gray + (c == 1 ? 0.2 * x : 0); }),
      "whole");
  EXPECT_EQ(changed([](uint32_t, uint32_t, uint32_t y, double gray) {
              return gray * (1 + 0.1 * std::sin(y / 6.0));
            }),
            "whole");
}

TEST(PictureCheckTest, ARepeatedFrameIsSeenInEveryDepth) {
  for (const uint32_t bits : {8u, 12u}) {
    SyntheticOptions options = scene("press", SyntheticMode::Waveguide);
    options.bit_depth = bits;
    SyntheticSensor source(options);
    PictureCheck check(source.format(), (1u << bits) - 1);
    check.set_reference(*source.own_background());
    Frame frame;
    source.render(50, frame);
    EXPECT_EQ(check.look_at(frame), PictureFault::None);
    EXPECT_FALSE(check.repeats());
    check.look_at(frame);
    EXPECT_TRUE(check.repeats());
    frame.set(0, 159, 119, frame.at(0, 159, 119) ^ 1u);
    check.look_at(frame);
    EXPECT_FALSE(check.repeats());
  }
}

class DamagedPicture : public GpuTest {
 protected:
  /// The first of 16 frames in a row that are touched by more than 0.3 N.
  static uint64_t held() {
    const SyntheticSensor source(scene("press", SyntheticMode::Gel));
    uint64_t frames = 0, i = 0;
    for (; frames < 16; ++i) frames = source.truth(i)->force_N > 0.3 ? frames + 1 : 0;
    return i - 16;
  }
  /// Frames `from` to `to` of a press, with those in `spoilt` partly green.
  std::vector<Touch> measured(uint64_t from, uint64_t to, const std::vector<uint64_t>& spoilt) {
    const SyntheticOptions options = scene("press", SyntheticMode::Gel);
    SyntheticSensor source(options);
    Sensor sensor = synthetic_sensor(options);
    Pipeline pipeline(context(), sensor, source.format(),
                      {.outputs = Output::Force | Output::Surface | Output::Contacts | Output::Traction});
    pipeline.set_background(*source.own_background());
    std::vector<Touch> touches;
    Frame frame;
    for (uint64_t i = from; i < to; ++i) {
      source.render(i, frame);
      frame.sequence = i;
      if (std::ranges::find(spoilt, i) != spoilt.end()) {
        Frame green = frame;
        spoilers().at("green below").second(frame, frame, green);
        touches.push_back(pipeline.process(green).touch);
      } else {
        touches.push_back(pipeline.process(frame).touch);
      }
    }
    return touches;
  }
};

TEST_F(DamagedPicture, NothingIsMeasuredOfItAndEveryStateSaysSo) {
  const uint64_t from = held();
  const std::vector<Touch> touches = measured(from, from + 4, {from + 2});
  EXPECT_TRUE(touches[1].contact);
  const Touch& bad = touches[2];
  EXPECT_EQ(bad.picture, PictureFault::OneColour);
  EXPECT_FALSE(bad.contact);
  EXPECT_TRUE(bad.contacts.empty());
  for (const Validity state : {bad.force_N.validity, bad.shear_x_N.validity, bad.shear_y_N.validity,
                               bad.surface->validity, bad.traction->fz_N.validity})
    EXPECT_EQ(state, Validity::PictureDamaged);
  EXPECT_EQ(bad.slip, Slip::PictureDamaged);
  EXPECT_EQ(bad.light->state, LightState::Unknown);
  EXPECT_TRUE(std::isnan(bad.surface->depth_max_mm));
  EXPECT_FALSE(has_value(bad.force_N));
  const MeasuredColumns columns = MeasuredColumns::of(synthetic_sensor(scene("press", SyntheticMode::Gel)),
                                                      Output::Force | Output::Surface | Output::Contacts);
  const std::string row = Measurements::row(bad, columns, Digits::Deserved);
  EXPECT_NE(row.find("picture damaged"), std::string::npos) << row;
  EXPECT_EQ(row.find("nan"), std::string::npos) << row;
  EXPECT_EQ(row.find("valid"), std::string::npos) << row;
  EXPECT_EQ(row.find(",0"), std::string::npos) << row;  // what is not known is no zero
}

TEST_F(DamagedPicture, TheFramesBesideItAreMeasuredAsWithoutIt) {
  const uint64_t from = held();
  const std::vector<Touch> whole = measured(from, from + 16, {}),
                           with = measured(from, from + 16, {from + 5});
  EXPECT_TRUE(whole.back().contact);
  ASSERT_EQ(whole.size(), with.size());
  for (size_t i = 0; i < whole.size(); ++i) {
    if (i == 5) continue;
    SCOPED_TRACE(i);
    EXPECT_EQ(whole[i].picture, PictureFault::None);
    EXPECT_EQ(with[i].picture, PictureFault::None);
    EXPECT_EQ(with[i].surface->depth_max_mm, whole[i].surface->depth_max_mm);
    ASSERT_EQ(with[i].contacts.size(), whole[i].contacts.size());
    for (size_t k = 0; k < whole[i].contacts.size(); ++k)
      EXPECT_EQ(with[i].contacts[k].id, whole[i].contacts[k].id);
    EXPECT_EQ(with[i].slip, whole[i].slip);
  }
}

TEST_F(DamagedPicture, AfterMoreThanThreeContactsBeginAnew) {
  const uint64_t from = held();
  const auto id_and_frames = [&](uint64_t count) {
    std::vector<uint64_t> spoilt;
    for (uint64_t i = 0; i < count; ++i) spoilt.push_back(from + 3 + i);
    const Touch last = measured(from, from + 12, spoilt).back();
    return std::pair{last.contacts.at(0).id, last.contacts.at(0).frames};
  };
  const auto [same, all_frames] = id_and_frames(3);
  EXPECT_EQ(same, 1u);
  EXPECT_GT(all_frames, 6u);
  const auto [anew, frames_since] = id_and_frames(4);
  EXPECT_EQ(anew, 2u);
  EXPECT_EQ(frames_since, 5u);
}

}  // namespace
}  // namespace palpate
