// Assembly of a frame: where several faults hold, which one is said.
#include "engine/pipeline/assemble.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <string>
#include <vector>

namespace palpate {
namespace {

template <typename Faults>
struct Fault {
  Validity says;
  std::function<void(Faults&)> set;
};

/// Each fault alone, each pair, and all of them: the first one of the list is said.
template <typename Faults>
void expect_order(const std::vector<Fault<Faults>>& gravest_first) {
  EXPECT_EQ(validity_of(Faults{}), Validity::Valid);
  Faults all;
  for (size_t i = 0; i < gravest_first.size(); ++i) {
    gravest_first[i].set(all);
    for (size_t j = i; j < gravest_first.size(); ++j) {
      Faults pair;
      gravest_first[j].set(pair);
      gravest_first[i].set(pair);
      EXPECT_EQ(validity_of(pair), gravest_first[i].says)
          << to_string(gravest_first[i].says) << " and " << to_string(gravest_first[j].says);
    }
  }
  EXPECT_EQ(validity_of(all), gravest_first.front().says);
}

TEST(Assemble, OfTwoFaultsOfADepthTheGraverIsSaid) {
  expect_order<DepthFaults>({{Validity::LightUnknown, [](DepthFaults& f) { f.light_unknown = true; }},
                             {Validity::Apart, [](DepthFaults& f) { f.apart = true; }},
                             {Validity::Saturated, [](DepthFaults& f) { f.saturated = true; }},
                             {Validity::AtBorder, [](DepthFaults& f) { f.at_border = true; }},
                             {Validity::AboveRange, [](DepthFaults& f) { f.above_range = true; }},
                             {Validity::Clipped, [](DepthFaults& f) { f.clipped = true; }},
                             {Validity::TooDeep, [](DepthFaults& f) { f.too_deep = true; }},
                             {Validity::Covered, [](DepthFaults& f) { f.covered = true; }},
                             {Validity::NoContact, [](DepthFaults& f) { f.untouched = true; }}});
}

TEST(Assemble, OfTwoFaultsOfAWrenchTheGraverIsSaid) {
  for (const Validity depth : {Validity::Apart, Validity::Saturated, Validity::Clipped, Validity::Covered})
    expect_order<WrenchFaults>({{Validity::LightUnknown, [](WrenchFaults& f) { f.light_unknown = true; }},
                                {Validity::NotConverged, [](WrenchFaults& f) { f.not_converged = true; }},
                                {depth, [&](WrenchFaults& f) { f.depth = depth; }},
                                {Validity::AtBorder, [](WrenchFaults& f) { f.at_border = true; }},
                                {Validity::TooDeep, [](WrenchFaults& f) { f.too_deep = true; }},
                                {Validity::Covered, [](WrenchFaults& f) { f.covered = true; }}});
  EXPECT_EQ(validity_of(WrenchFaults{.depth = Validity::NoContact}), Validity::Valid);
}

/// A contact with depth, a wrench of which the tangential part is not known, and a calibrated force.
class AssembleFrame : public testing::Test {
 protected:
  AssembleFrame() {
    sensor_.pitch_mm_per_px = 0.1;
    ForceCalibration& force = sensor_.force.emplace();
    force.c1_N_per_gray = 0.001;
    force.gray_min = 1;
    force.gray_max = 1e6;
    parts_.whole.gray_sum = 2000;
    parts_.whole.area_px = 300;
    parts_.whole.centroid_x_px = parts_.whole.centroid_y_px = 50;
    parts_.surface.emplace().summary.depth_max_mm = 0.5;
    TractionSummary& t = parts_.traction.emplace().summary;
    for (Estimate* one : {&t.fz_N, &t.mx_Nmm, &t.my_Nmm}) *one = {1, 0.1, Validity::Valid};
  }
  Touch assembled(const FrameStamp& stamp = {.sequence = 7}) {
    TouchHistory history(sensor_, {100, 100, 1, 8}, false);
    Touch touch;
    assemble(parts_, stamp, history, touch);
    return touch;
  }

  Sensor sensor_;
  FrameParts parts_;
};

TEST_F(AssembleFrame, WithoutFaultsAllIsValid) {
  const Touch touch = assembled();
  EXPECT_EQ(touch.sequence, 7u);
  EXPECT_TRUE(touch.contact);
  EXPECT_NEAR(touch.force_N.value, 2, 1e-9);
  EXPECT_TRUE(touch.force_N.valid());
  EXPECT_EQ(touch.surface->validity, Validity::Valid);
  EXPECT_EQ(touch.surface->depth_max_mm, 0.5);
  EXPECT_TRUE(touch.traction->fz_N.valid());
  EXPECT_EQ(touch.traction->fx_N.validity, Validity::NotCalibrated) << "never known, whatever else";
}

TEST_F(AssembleFrame, ADepthsFaultIsItsWrenchesToo) {
  parts_.surface->faults.clipped = parts_.traction->too_deep = true;
  const Touch touch = assembled();
  EXPECT_EQ(touch.surface->validity, Validity::Clipped);
  EXPECT_EQ(touch.traction->fz_N.validity, Validity::Clipped);
  EXPECT_EQ(touch.traction->fx_N.validity, Validity::NotCalibrated);
  EXPECT_TRUE(touch.force_N.valid()) << "of the gray sum";
}

TEST_F(AssembleFrame, UnknownLightIsSaidOfAllThatIsKnown) {
  const FrameStamp dark{.light = LightSummary{LightState::Unknown, 0}};
  parts_.surface->faults.saturated = true;
  const Touch touch = assembled(dark);
  for (const Validity state :
       {touch.surface->validity, touch.traction->fz_N.validity, touch.force_N.validity})
    EXPECT_EQ(state, Validity::LightUnknown);
  EXPECT_EQ(touch.traction->fx_N.validity, Validity::NotCalibrated);
  EXPECT_EQ(touch.shear_x_N.validity, Validity::NotCalibrated);
  sensor_.force->fit_for_use = false;
  EXPECT_EQ(assembled(dark).force_N.validity, Validity::Unfit) << "the graver doubt";
  parts_.whole.area_px = 0;
  const Touch untouched = assembled(dark);
  EXPECT_EQ(untouched.force_N.validity, Validity::NoContact);
  EXPECT_EQ(untouched.surface->validity, Validity::LightUnknown) << "it may hide a touch";
}

TEST_F(AssembleFrame, ASpoiltPictureSaysNothing) {
  parts_.surface->faults.apart = parts_.traction->not_converged = true;
  const Touch touch = assembled({.fault = PictureFault::Torn, .light = LightSummary{LightState::Unknown, 0}});
  EXPECT_EQ(touch.picture, PictureFault::Torn);
  EXPECT_FALSE(touch.contact);
  EXPECT_TRUE(std::isnan(touch.gray_sum) && std::isnan(touch.surface->depth_max_mm));
  for (const Validity state : {touch.surface->validity, touch.traction->fx_N.validity,
                               touch.traction->fz_N.validity, touch.force_N.validity})
    EXPECT_EQ(state, Validity::PictureDamaged);
}

}  // namespace
}  // namespace palpate
