// A scan by hand that grows with its presses, held against the one of the recording.
#include "engine/palpation/hand/growing_scan.h"

#include <gtest/gtest.h>

#include <cmath>
#include <ctime>
#include <memory>

#include "capture/run/palpation/hand_recording.h"
#include "capture/synthetic/tissue.h"
#include "engine/palpation/press_monitor.h"

namespace palpate {
namespace {

constexpr const char* kHand = "synthetic:tissue?size=320x240&cells=16&hand=6&seed=3&d=12&h=3&ratio=4&rate=20";

/// A hand that presses six times, watched as in a window.
struct WatchedHand {
  WatchedHand() : monitor(tissue_sensor(options), *source.own_background(), setup()) {}

  PressSetup setup() {
    PressSetup s;
    s.block = {options.scene.block_mm, options.scene.young_Pa, {0, 0}};
    s.placed = false;
    s.force = [this](uint64_t sequence) { return std::optional(source.block_force_N(sequence)); };
    return s;
  }
  /// Plays until so many presses are over.
  void play(size_t presses) {
    Frame frame;
    Touch touch;
    touch.contact = true;
    while (monitor.status().last.value_or(PressAnswer{}).press < presses && source.next(frame)) {
      monitor.add(frame, touch);
      if (!monitor.status().pressing) monitor.finish();
    }
  }

  TissueOptions options = parse_tissue(kHand);
  TissueSensor source{options};
  PressMonitor monitor;
};

TEST(GrowingScan, SaysOfThePressesWhatTheirRecordingSays) {
  WatchedHand hand;
  GrowingScan& scan = *hand.monitor.scan();
  scan.switch_on(true);
  hand.play(1);
  scan.finish();
  ASSERT_TRUE(scan.status().seen);
  EXPECT_EQ(scan.status().seen->presses, 1u);
  EXPECT_FALSE(scan.status().seen->answer);
  EXPECT_NE(scan.status().seen->trouble.find("not enough presses"), std::string::npos);
  hand.play(6);
  scan.finish();
  const ScanStatus status = scan.status();
  EXPECT_TRUE(status.on);
  EXPECT_FALSE(status.working || status.full);
  ASSERT_TRUE(status.seen && status.seen->answer) << status.seen->trouble;
  EXPECT_EQ(status.seen->presses, 6u);

  std::vector<std::string> notes;
  const HandAnswer recorded = answer_by_hand(read_hand_presses({kHand}, "", {}, notes, {}), {}, {});
  const HandAnswer& live = *status.seen->answer;
  ASSERT_EQ(live.rows.size(), recorded.rows.size());
  for (size_t p = 0; p < live.rows.size(); ++p) {
    EXPECT_EQ(live.rows[p].name, recorded.rows[p].name);
    EXPECT_EQ(live.rows[p].left_out, recorded.rows[p].left_out);
    if (!live.rows[p].left_out.empty()) continue;
    for (size_t c = 0; c < 2; ++c)
      EXPECT_NEAR(live.rows[p].at_mm[c], recorded.rows[p].at_mm[c], 0.3) << live.rows[p].name;
    EXPECT_NEAR(live.rows[p].turn_deg, recorded.rows[p].turn_deg, 1.5) << live.rows[p].name;
  }
  const auto& seen = live.scan.map.observation.pressure_Pa.back();
  const auto& wanted = recorded.scan.map.observation.pressure_Pa.back();
  double square = 0, sum = 0, count = 0;
  for (size_t i = 0; i < seen.values.size(); ++i) {
    if (!std::isfinite(seen.values[i]) || !std::isfinite(wanted.values[i])) continue;
    square += std::pow(double{seen.values[i]} - double{wanted.values[i]}, 2);
    sum += double{wanted.values[i]};
    ++count;
  }
  ASSERT_GT(count, 100);
  EXPECT_LT(std::sqrt(square / count), 0.05 * sum / count) << "RMS of the pressure over its mean";

  scan.restart();
  EXPECT_FALSE(scan.status().seen);
  EXPECT_EQ(scan.status().presses, 0u);
}

TEST(GrowingScan, EndsWhileItPutsPressesTogether) {
  // Of the processor: others may use it as well.
  const auto since = [](std::clock_t begin) {
    return static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
  };
  auto hand = std::make_unique<WatchedHand>();
  GrowingScan& scan = *hand->monitor.scan();
  scan.switch_on(true);
  hand->play(5);
  EXPECT_TRUE(scan.status().working);
  // What is begun anew does not wait for what it drops.
  std::clock_t begin = std::clock();
  scan.restart();
  scan.finish();
  std::printf("anew after %.2f s\n", since(begin));
  EXPECT_LT(since(begin), 1.5);
  EXPECT_FALSE(scan.status().seen);
  hand->play(6);
  EXPECT_TRUE(scan.status().working);
  begin = std::clock();
  hand.reset();
  std::printf("ended after %.2f s\n", since(begin));
  EXPECT_LT(since(begin), 1.5);
}

TEST(GrowingScan, TakesNothingWhereNobodyAsks) {
  WatchedHand hand;
  hand.play(1);
  EXPECT_FALSE(hand.monitor.scan()->status().on);
  EXPECT_EQ(hand.monitor.scan()->status().presses, 0u);
  EXPECT_FALSE(hand.monitor.scan()->status().seen);
}

TEST(GrowingScan, ABrokenPressSaysWhyAndDoesNotCount) {
  const TissueOptions options = parse_tissue("synthetic:tissue?size=64x48&cells=16&hand=2&lump=none");
  const TissueSensor source(options);
  GrowingScan scan(tissue_sensor(options), *source.own_background());
  scan.switch_on(true);
  scan.begin_press();
  scan.add(*source.own_background(), 1);
  scan.end_press("lost contact", {});
  EXPECT_EQ(scan.status().broken, "lost contact");
  EXPECT_EQ(scan.status().presses, 0u);
  // A press without a frame near its loads cannot be the first.
  scan.begin_press();
  scan.add(*source.own_background(), 1);
  scan.end_press("", {});
  scan.finish();
  ASSERT_TRUE(scan.status().seen);
  EXPECT_NE(scan.status().seen->trouble.find("a first press that can be read"), std::string::npos)
      << scan.status().seen->trouble;
}

}  // namespace
}  // namespace palpate
