#include "engine/measure/contact/contact_tracker.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <random>
#include <set>

#include "engine/numeric/assignment.h"

namespace palpate {
namespace {

constexpr FrameFormat kFormat{640, 480, 1, 8};

Sensor rigged() {
  Sensor sensor;
  sensor.name = "rig";
  sensor.pitch_mm_per_px = 0.05;
  sensor.smallest_contact_px = 50;
  ForceCalibration force;
  force.c1_N_per_gray = 1e-5;
  force.c0_N = 0.01;
  force.residual_sd_N = 0.003;
  force.covariance = {4e-6, 0, 1e-14};
  force.gray_min = 0;
  force.gray_max = 1e6;
  sensor.force = force;
  ShearCalibration shear;
  shear.kx_N_per_mm = shear.ky_N_per_mm = 1;
  shear.friction = 0.5;
  shear.relative_sd = 0.01;
  sensor.shear = shear;
  return sensor;
}

ContactTouch region(double x, double y, uint64_t area, double gray_sum = 1e5) {
  ContactTouch contact;
  contact.centroid_x_px = x;
  contact.centroid_y_px = y;
  contact.area_px = area;
  contact.gray_sum = gray_sum;
  return contact;
}

/// One frame through a tracker.
Touch follow(ContactTracker& tracker, std::vector<ContactTouch> regions) {
  Touch touch;
  touch.regions.emplace();
  touch.contact = !regions.empty();
  touch.contacts = std::move(regions);
  tracker.update(touch);
  return touch;
}

std::vector<uint32_t> ids(const Touch& touch) {
  std::vector<uint32_t> result;
  for (const ContactTouch& contact : touch.contacts) result.push_back(contact.id);
  return result;
}
using Ids = std::vector<uint32_t>;

// Against trying every way.
TEST(Assignment, IsTheLeastOfAll) {
  std::mt19937 random(3);
  for (int i = 0; i < 300; ++i) {
    const auto below = [&](int limit) { return std::uniform_int_distribution(0, limit - 1)(random); };
    const auto rows = static_cast<uint32_t>(1 + below(5)), columns = rows + static_cast<uint32_t>(below(3));
    std::vector<double> cost(size_t{rows} * columns);
    for (double& c : cost) c = i % 2 == 0 ? below(10) : std::uniform_real_distribution(-1.0, 5.0)(random);
    const auto total = [&](const std::vector<uint32_t>& of) {
      double sum = 0;
      for (uint32_t row = 0; row < rows; ++row) sum += cost[size_t{row} * columns + of[row]];
      return sum;
    };
    std::vector<uint32_t> order(columns);
    std::iota(order.begin(), order.end(), 0u);
    double least = std::numeric_limits<double>::infinity();
    do least = std::min(least, total(order));
    while (std::next_permutation(order.begin(), order.end()));
    const std::vector<uint32_t> got = assign(cost, rows, columns);
    EXPECT_EQ(std::set<uint32_t>(got.begin(), got.end()).size(), rows);
    EXPECT_NEAR(total(got), least, 1e-9) << rows << " x " << columns << ", case " << i;
  }
}

TEST(ContactTracker, IdsStayWhileContactsMoveComeAndGo) {
  ContactTracker tracker(rigged(), kFormat);
  EXPECT_EQ(ids(follow(tracker, {region(100, 100, 800), region(300, 100, 800)})), (Ids{1, 2}));
  for (int i = 1; i <= 40; ++i) {
    // The order in which regions are found says nothing.
    std::vector<ContactTouch> frame{region(300 + 3 * i, 100 + i, 800), region(100 + 5 * i, 100, 800)};
    if (i >= 20) frame.push_back(region(100, 400, 500));
    if (i % 2) std::ranges::reverse(frame);
    const Touch touch = follow(tracker, frame);
    EXPECT_EQ(ids(touch), i >= 20 ? (Ids{1, 2, 3}) : (Ids{1, 2}));
    EXPECT_NEAR(touch.contacts[0].centroid_x_px, 100 + 5 * i, 1e-9);
    EXPECT_EQ(touch.contacts[0].frames, 1u + static_cast<uint64_t>(i));
  }
  // One leaves; a new one elsewhere gets a number that was never used.
  EXPECT_EQ(ids(follow(tracker, {region(425, 140, 800), region(100, 400, 500)})), (Ids{2, 3}));
  EXPECT_EQ(ids(follow(tracker, {region(425, 140, 800), region(100, 400, 500), region(500, 400, 500)})),
            (Ids{2, 3, 4}));
}

// Five touching neighbours move together by more than half their spacing: the nearest region of each is its
// neighbour's, the assignment as a whole is right.
TEST(ContactTracker, ARowThatMovesTogetherIsNotMixedUp) {
  ContactTracker tracker(rigged(), kFormat);
  const auto row = [](double x) {
    std::vector<ContactTouch> regions;
    regions.reserve(5);
    for (int i = 0; i < 5; ++i) regions.push_back(region(x + 60 * i, 200, 2000));
    return regions;
  };
  follow(tracker, row(100));
  for (int i = 1; i < 4; ++i) {
    const Touch touch = follow(tracker, row(100 + 35 * i));
    ASSERT_EQ(ids(touch), (Ids{1, 2, 3, 4, 5}));
    for (int k = 0; k < 5; ++k)
      EXPECT_NEAR(touch.contacts[static_cast<size_t>(k)].centroid_x_px, 100 + 35 * i + 60 * k, 1e-9);
  }
}

TEST(ContactTracker, FlickerKeepsIdAndOnsetForThreeFrames) {
  ContactTracker tracker(rigged(), kFormat);
  follow(tracker, {region(100, 100, 800)});
  for (uint32_t away = 1; away <= ContactTracker::kHeldFrames; ++away) {
    for (uint32_t i = 0; i < away; ++i) EXPECT_TRUE(follow(tracker, {}).contacts.empty());
    EXPECT_EQ(ids(follow(tracker, {region(102, 100, 800)})), Ids{1}) << away << " frames away";
  }
  EXPECT_NEAR(follow(tracker, {region(104, 100, 800)}).contacts[0].shift_x_mm, 4 * 0.05, 1e-9);
  for (uint32_t i = 0; i < ContactTracker::kHeldFrames + 1; ++i) follow(tracker, {});
  const Touch anew = follow(tracker, {region(104, 100, 800)});
  EXPECT_EQ(ids(anew), Ids{2});
  EXPECT_EQ(anew.contacts[0].frames, 1u);
  EXPECT_EQ(anew.contacts[0].shift_x_mm, 0);
}

TEST(ContactTracker, SizeHasHysteresis) {
  ContactTracker tracker(rigged(), kFormat);
  Touch touch = follow(tracker, {region(100, 100, 49)});
  EXPECT_TRUE(touch.contacts.empty());
  EXPECT_EQ(touch.regions->small, 1u);
  EXPECT_EQ(ids(follow(tracker, {region(100, 100, 50)})), Ids{1});
  EXPECT_EQ(ids(follow(tracker, {region(100, 100, 25)})), Ids{1});
  touch = follow(tracker, {region(100, 100, 24)});
  EXPECT_TRUE(touch.contacts.empty());
  EXPECT_EQ(touch.regions->small, 1u);
  // The default: 1/4000 of the frame.
  Sensor sensor = rigged();
  sensor.smallest_contact_px = 0;
  ContactTracker usual(sensor, kFormat);
  EXPECT_TRUE(follow(usual, {region(100, 100, 75)}).contacts.empty());
  EXPECT_EQ(follow(usual, {region(100, 100, 76)}).contacts.size(), 1u);
  // A skin's pattern changes the picture where it moves: one marker, where it was and where it is, is no
  // contact.
  sensor.skin = SkinPattern{};
  sensor.skin->size_px = 8;
  EXPECT_EQ(smallest_contact_px(sensor, kFormat), 226u);
  sensor.skin->kind = SkinKind::Texture;
  EXPECT_EQ(smallest_contact_px(sensor, kFormat), 256u);
  sensor.smallest_contact_px = 20;
  EXPECT_EQ(smallest_contact_px(sensor, kFormat), 20u);
}

TEST(ContactTracker, MergeAndSplitKeepTheLargerOnesId) {
  ContactTracker tracker(rigged(), kFormat);
  follow(tracker, {region(100, 100, 2000), region(150, 100, 500)});
  // Merged: the common centroid is nearer to the larger one's.
  EXPECT_EQ(ids(follow(tracker, {region(110, 100, 2500)})), Ids{1});
  // Apart again within three frames: both are themselves.
  Touch touch = follow(tracker, {region(150, 100, 500), region(100, 100, 2000)});
  EXPECT_EQ(ids(touch), (Ids{1, 2}));
  EXPECT_EQ(touch.contacts[0].area_px, 2000u);
  // Later, the smaller part is new.
  for (int i = 0; i < 6; ++i) EXPECT_EQ(ids(follow(tracker, {region(110, 100, 2500)})), Ids{1});
  touch = follow(tracker, {region(150, 100, 500), region(100, 100, 2000)});
  EXPECT_EQ(ids(touch), (Ids{1, 3}));
  EXPECT_EQ(touch.contacts[0].area_px, 2000u);
}

TEST(ContactTracker, FarJumpIsANewContact) {
  ContactTracker tracker(rigged(), kFormat);
  follow(tracker, {region(100, 100, 300)});
  const double reach_px = 2 * std::sqrt(300 / std::numbers::pi) + 4;
  EXPECT_EQ(ids(follow(tracker, {region(100 + reach_px - 0.1, 100, 300)})), Ids{1});
  EXPECT_EQ(ids(follow(tracker, {region(100 + 2 * reach_px + 0.1, 100, 300)})), Ids{2});
}

TEST(ContactTracker, ALineageIsFollowedHoweverFar) {
  ContactTracker tracker(rigged(), kFormat);
  const auto of = [](uint32_t lineage, ContactTouch contact) {
    contact.id = lineage;
    return contact;
  };
  EXPECT_EQ(ids(follow(tracker, {of(7, region(100, 100, 400)), of(9, region(400, 100, 400))})), (Ids{1, 2}));
  // The nearer one is of the other's lineage, but goes on by itself.
  EXPECT_EQ(ids(follow(tracker, {of(7, region(100, 400, 400)), of(9, region(405, 100, 400))})), (Ids{1, 2}));
  EXPECT_EQ(ids(follow(tracker, {of(9, region(600, 400, 400)), of(7, region(100, 405, 400))})), (Ids{1, 2}));
  // Two of one lineage: the second is new.
  const Touch split = follow(tracker, {of(7, region(100, 410, 400)), of(7, region(300, 410, 400))});
  EXPECT_EQ(ids(split), (Ids{1, 3}));
  EXPECT_EQ(ids(follow(tracker, {region(30, 30, 400)})), (Ids{4})) << "0 is no lineage";
}

TEST(ContactTracker, AfterAGapAllIsNewAndItsOnsetUnseen) {
  ContactTracker tracker(rigged(), kFormat);
  EXPECT_EQ(follow(tracker, {region(100, 100, 800)}).contacts[0].shear_x_N.validity, Validity::Valid);
  tracker.interrupt();
  Touch touch = follow(tracker, {region(100, 100, 800)});
  EXPECT_EQ(ids(touch), Ids{2});
  EXPECT_EQ(touch.contacts[0].shear_x_N.validity, Validity::OnsetUnseen);
  touch = follow(tracker, {region(100, 100, 800), region(300, 300, 800)});
  EXPECT_EQ(touch.contacts[0].shear_x_N.validity, Validity::OnsetUnseen);
  EXPECT_EQ(touch.contacts[1].shear_x_N.validity, Validity::Valid);
  EXPECT_EQ(touch.shear_x_N.validity, Validity::OnsetUnseen);
}

// Each has its own force and shear; the touch's are the sums. The calibration's error is common, scatter is
// not.
TEST(ContactTracker, ForcesAndShearsAddUp) {
  const Sensor sensor = rigged();
  ContactTracker tracker(sensor, kFormat);
  follow(tracker, {region(100, 100, 800, 1e5), region(300, 100, 800, 4e4)});
  const Touch touch = follow(tracker, {region(102, 100, 800, 1e5), region(300, 97, 800, 4e4)});
  ASSERT_EQ(touch.contacts.size(), 2u);
  EXPECT_NEAR(touch.contacts[0].force_N.value, 1.01, 1e-12);
  EXPECT_NEAR(touch.contacts[1].force_N.value, 0.41, 1e-12);
  EXPECT_NEAR(touch.force_N.value, 1.42, 1e-12);
  EXPECT_EQ(touch.force_N.validity, Validity::Valid);
  const double common_N = std::sqrt(4e-6 + 1e10 * 1e-14) + std::sqrt(4e-6 + 1.6e9 * 1e-14);
  EXPECT_NEAR(touch.force_N.standard_error, std::hypot(0.003 * std::sqrt(2.0), common_N), 1e-12);
  EXPECT_NEAR(touch.contacts[0].shear_x_N.value, 0.1, 1e-12);
  EXPECT_NEAR(touch.contacts[1].shear_y_N.value, -0.15, 1e-12);
  EXPECT_NEAR(touch.shear_x_N.value, 0.1, 1e-12);
  EXPECT_NEAR(touch.shear_y_N.value, -0.15, 1e-12);
  // The second's rim slips, at 0.15 N of the 0.2 N that it holds.
  EXPECT_EQ(touch.slip, Slip::Incipient);
  // The second is dragged beyond its friction limit.
  const Touch slid = follow(tracker, {region(102, 100, 800, 1e5), region(300, 90, 800, 4e4)});
  EXPECT_EQ(slid.contacts[0].slip, Slip::Stick);
  EXPECT_EQ(slid.contacts[1].slip, Slip::Slip);
  EXPECT_NEAR(std::hypot(slid.contacts[1].shear_x_N.value, slid.contacts[1].shear_y_N.value), 0.205, 1e-9);
  EXPECT_EQ(slid.slip, Slip::Slip);
}

// The gravest state of a contact is the sum's.
TEST(ContactTracker, TheSumSaysWhatItsPartsLack) {
  const auto state = [](auto change) {
    ContactTracker tracker(rigged(), kFormat);
    std::vector<ContactTouch> regions{region(100, 100, 800), region(300, 100, 800)};
    change(regions[1]);
    return follow(tracker, regions);
  };
  EXPECT_EQ(state([](ContactTouch&) {}).force_N.validity, Validity::Valid);
  EXPECT_EQ(state([](ContactTouch& c) { c.gray_sum = 2e6; }).force_N.validity, Validity::AboveRange);
  const Touch border = state([](ContactTouch& c) { c.at_border = true; });
  EXPECT_EQ(border.force_N.validity, Validity::AtBorder);
  EXPECT_EQ(border.contacts[0].force_N.validity, Validity::Valid);
  EXPECT_EQ(border.contacts[1].shear_x_N.validity, Validity::AtBorder);
  const auto saturated_too = [](ContactTouch& c) {
    c.at_border = true;
    c.saturated_px = 3;
    c.peak_gray = c.gray_sum / 3;
  };
  EXPECT_EQ(state(saturated_too).force_N.validity, Validity::Saturated);
}

TEST(ContactTracker, NoMoreThanTheLargestAreFollowed) {
  ContactTracker tracker(rigged(), kFormat);
  std::vector<ContactTouch> regions;
  for (uint32_t i = 0; i < 70; ++i) regions.push_back(region(9.0 * i, 100, 100 + i));
  const Touch touch = follow(tracker, regions);
  EXPECT_TRUE(touch.regions->overflow);
  EXPECT_EQ(touch.contacts.size(), ContactTracker::kMostContacts);
  for (const ContactTouch& contact : touch.contacts) EXPECT_GE(contact.area_px, 106u);
}

}  // namespace
}  // namespace palpate
