// Distributions in constant memory against sorted samples; the rows of a run's latencies.
#include "capture/live/latency.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <random>
#include <vector>

namespace palpate {
namespace {

TEST(Durations, PercentilesAreThoseOfTheSortedSamplesToOnePercent) {
  std::mt19937 random(5);
  std::lognormal_distribution<double> ms(2.0, 1.3);
  Durations durations;
  std::vector<double> samples;
  for (int i = 0; i < 20000; ++i) durations.add(samples.emplace_back(ms(random)));
  std::sort(samples.begin(), samples.end());
  const auto at = [&](double fraction) {
    return samples[static_cast<size_t>(fraction * static_cast<double>(samples.size() - 1))];
  };
  const Percentiles p = durations.percentiles();
  EXPECT_EQ(p.count, 20000u);
  EXPECT_NEAR(p.p50_ms / at(0.5), 1, 0.01);
  EXPECT_NEAR(p.p95_ms / at(0.95), 1, 0.01);
  EXPECT_NEAR(p.p99_ms / at(0.99), 1, 0.01);
}

TEST(Durations, NothingAndTheAbsurdHaveTheirPlace) {
  Durations durations;
  EXPECT_EQ(durations.percentiles().count, 0u);
  EXPECT_EQ(durations.percentiles().p99_ms, 0);
  for (const double ms : {-5.0, 0.0, 1e-9, 1e30}) durations.add(ms);
  EXPECT_EQ(durations.percentiles().count, 4u);
  EXPECT_GT(durations.percentiles().p50_ms, 0);
}

TEST(RecentDurations, TheOldAreForgotten) {
  RecentDurations recent;
  for (int i = 0; i < 1000; ++i) recent.add(100);
  for (int i = 0; i < 240; ++i) recent.add(1);
  EXPECT_EQ(recent.percentiles().count, 240u);
  EXPECT_EQ(recent.percentiles().p99_ms, 1);
}

FrameTimes times(uint64_t sequence, int64_t exposed_ms, int64_t delivered_ms, int64_t measured_ms,
                 int64_t shown_ms) {
  FrameTimes t;
  t.sequence = sequence;
  t.exposed_ns = exposed_ms * 1'000'000;
  t.delivered_ns = delivered_ms * 1'000'000;
  t.measured_ns = measured_ms * 1'000'000;
  t.shown_ns = shown_ms * 1'000'000;
  return t;
}

TEST(LatencyLog, CountsFromExposureWhereItIsKnownAndWritesOneRowAFrame) {
  const auto file = std::filesystem::temp_directory_path() / ("latency-" + std::to_string(getpid()) + ".csv");
  {
    LatencyLog log(file);
    log.add(times(7, 100, 110, 125, 160));
    log.add(times(8, 120, 130, 150, 0));  // measured, never shown
    EXPECT_TRUE(log.from_exposure());
    EXPECT_EQ(log.to_measured().count, 2u);
    EXPECT_EQ(log.to_shown().count, 1u);
    EXPECT_NEAR(log.to_shown().p50_ms, 60, 0.6);
    log.add(times(9, 0, 140, 150, 170));  // delivery is all that this one knows
    EXPECT_FALSE(log.from_exposure());
    log.close();
  }
  std::ifstream in(file);
  std::string line;
  std::vector<std::string> lines;
  while (std::getline(in, line)) lines.push_back(line);
  ASSERT_EQ(lines.size(), 4u);
  EXPECT_EQ(lines[0], "frame,exposed_ns,delivered_ns,measured_ns,shown_ns,to_measured_ms,to_shown_ms");
  EXPECT_EQ(lines[1], "7,100000000,110000000,125000000,160000000,25.000,60.000");
  EXPECT_EQ(lines[2], "8,120000000,130000000,150000000,,30.000,");
  EXPECT_EQ(lines[3], "9,,140000000,150000000,170000000,10.000,30.000");
  std::filesystem::remove(file);
}

}  // namespace
}  // namespace palpate
