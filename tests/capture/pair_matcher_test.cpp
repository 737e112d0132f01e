// The matcher of two fingers' frames: nearest in time, each frame once, nothing held back without bound.
#include "capture/pair/pair_matcher.h"

#include <gtest/gtest.h>

#include <random>

namespace palpate {
namespace {

constexpr int64_t kMs = 1'000'000;

struct Taken {
  Side side;
  int64_t time_ns;
};
using Stream = std::vector<int64_t>;
using Matcher = PairMatcher<int64_t>;  // the item is its own time

/// Each frame within `jitter_ms` of its place, some lost.
Stream stream(std::mt19937& random, double rate_Hz, double phase_ms, double jitter_ms, double loss,
              double seconds = 20) {
  std::uniform_real_distribution<double> one(0, 1);
  Stream times;
  for (int k = 0; k < seconds * rate_Hz; ++k) {
    const double at_ms = 1e3 * k / rate_Hz + phase_ms + (2 * one(random) - 1) * jitter_ms;
    if (one(random) >= loss) times.push_back(std::llround(at_ms * kMs));
  }
  return times;
}

/// All frames in an order that mixes the sides at random, neither ahead by more than `ahead_ms`.
std::vector<Taken> mixed(std::mt19937& random, const Stream& left, const Stream& right, double ahead_ms) {
  std::vector<Taken> all;
  size_t l = 0, r = 0;
  while (l < left.size() || r < right.size()) {
    bool take_left = l < left.size() && (r == right.size() || random() % 2 == 0);
    if (l < left.size() && r < right.size()) {
      const double lead_ms = static_cast<double>(left[l] - right[r]) / kMs;
      if (std::abs(lead_ms) > ahead_ms) take_left = lead_ms < 0;
    }
    all.push_back(take_left ? Taken{Side::Left, left[l++]} : Taken{Side::Right, right[r++]});
  }
  return all;
}

Matcher::Out play(Matcher& matcher, const std::vector<Taken>& frames) {
  Matcher::Out all;
  const auto add = [&](Matcher::Out out) { all.insert(all.end(), out.begin(), out.end()); };
  for (const Taken& t : frames) add(matcher.add(t.side, t.time_ns, t.time_ns));
  for (const Side side : kSides) add(matcher.leave(side));
  return all;
}

/// Every frame came out once and in order; skews are as the times say and within the window.
void expect_whole(const Matcher::Out& out, const Stream& left, const Stream& right, int64_t window_ns) {
  std::array<Stream, 2> seen;
  for (const Matched<int64_t>& m : out) {
    for (const Side side : kSides)
      if (m.of[index(side)]) seen[index(side)].push_back(*m.of[index(side)]);
    if (!m.both()) continue;
    EXPECT_EQ(m.skew_ns, *m.right() - *m.left());
    EXPECT_LE(std::abs(m.skew_ns), window_ns);
  }
  EXPECT_EQ(seen[0], left);
  EXPECT_EQ(seen[1], right);
}

/// Pairs that are each other's nearest, by looking at all.
std::vector<std::pair<int64_t, int64_t>> nearest_pairs(const Stream& left, const Stream& right,
                                                       int64_t window_ns) {
  const auto nearest = [](const Stream& in, int64_t to) {
    return *std::min_element(in.begin(), in.end(),
                             [to](int64_t a, int64_t b) { return std::abs(a - to) < std::abs(b - to); });
  };
  std::vector<std::pair<int64_t, int64_t>> pairs;
  for (const int64_t l : left) {
    const int64_t r = nearest(right, l);
    if (nearest(left, r) == l && std::abs(r - l) <= window_ns) pairs.emplace_back(l, r);
  }
  return pairs;
}

std::vector<std::pair<int64_t, int64_t>> pairs_of(const Matcher::Out& out) {
  std::vector<std::pair<int64_t, int64_t>> pairs;
  for (const Matched<int64_t>& m : out)
    if (m.both()) pairs.emplace_back(*m.left(), *m.right());
  return pairs;
}

struct Case {
  double left_Hz, right_Hz, skew_ms, jitter_ms, loss;
};

TEST(PairMatcher, PairsTheNearestWhateverSideIsFaster) {
  const Case cases[] = {{30, 30, 0, 0, 0},    {30, 30, 5, 2, 0},     {30, 30, -12, 3, 0.1},
                        {60, 30, 3, 2, 0.05}, {30, 7.5, 10, 4, 0.2}, {29.97, 30, 0, 1, 0},
                        {100, 30, 0, 1, 0.3}};
  std::mt19937 random(7);
  for (const Case& c : cases) {
    const Stream left = stream(random, c.left_Hz, 0, c.jitter_ms, c.loss);
    const Stream right = stream(random, c.right_Hz, c.skew_ms, c.jitter_ms, c.loss);
    const int64_t window_ns = std::llround(0.5e9 / std::min(c.left_Hz, c.right_Hz));
    Matcher::Out before;
    for (int round = 0; round < 4; ++round) {
      Matcher matcher(window_ns, 1000);
      const Matcher::Out out = play(matcher, mixed(random, left, right, 400));
      expect_whole(out, left, right, window_ns);
      if (c.left_Hz == c.right_Hz) {
        EXPECT_EQ(pairs_of(out), nearest_pairs(left, right, window_ns));
      }
      if (round > 0) {
        EXPECT_EQ(pairs_of(out), pairs_of(before));
      }
      before = out;
    }
    // Of cameras of two rates nearly every frame of the slower one has a partner where none is lost.
    if (c.loss == 0) {
      EXPECT_GE(pairs_of(before).size(), std::min(left.size(), right.size()) * 95 / 100) << c.right_Hz;
    }
  }
}

TEST(PairMatcher, StatesSkewAndItsSpread) {
  std::mt19937 random(3);
  Matcher matcher(16 * kMs, 8);
  Stream left, right;
  for (int k = 0; k < 500; ++k) {
    left.push_back(k * 33 * kMs);
    right.push_back(left.back() + (k % 2 ? 5 : 3) * kMs);
  }
  play(matcher, mixed(random, left, right, 40));
  EXPECT_EQ(matcher.skew().pairs(), 500u);
  EXPECT_NEAR(matcher.skew().mean_ms(), 4, 1e-9);
  EXPECT_NEAR(matcher.skew().sd_ms(), std::sqrt(500. / 499), 1e-9);
}

TEST(PairMatcher, PairsAtOnceWhereTheSkewIsSmall) {
  Matcher matcher(16 * kMs, 8);
  EXPECT_TRUE(matcher.add(Side::Left, 0, 0).empty());
  const Matcher::Out out = matcher.add(Side::Right, 6 * kMs, 6 * kMs);
  ASSERT_EQ(out.size(), 1u);
  EXPECT_TRUE(out[0].both());
}

TEST(PairMatcher, HoldsNoMoreThanItsBoundForASilentSide) {
  Matcher matcher(16 * kMs, 8);
  size_t delivered = 0;
  for (int k = 0; k < 100; ++k) {
    delivered += matcher.add(Side::Left, k * 33 * kMs, k).size();
    EXPECT_GE(delivered + 8, static_cast<size_t>(k + 1));
  }
  // One that is known to be gone is not waited for at all.
  delivered += matcher.leave(Side::Right).size();
  EXPECT_EQ(delivered, 100u);
  EXPECT_EQ(matcher.add(Side::Left, 100 * 33 * kMs, 100).size(), 1u);
  EXPECT_EQ(matcher.alone(Side::Left), 101u);
  // When it comes back pairs go on.
  EXPECT_TRUE(matcher.add(Side::Right, 101 * 33 * kMs, 101).empty());
  EXPECT_TRUE(matcher.add(Side::Left, 101 * 33 * kMs, 101).at(0).both());
}

TEST(PairMatcher, LosesNothingWhenAClockSteps) {
  std::mt19937 random(11);
  for (const int64_t step_ms : {-3'600'000, -500, -20, 20, 500, 3'600'000}) {
    Stream left = stream(random, 30, 0, 2, 0), right = stream(random, 30, 4, 2, 0);
    const size_t from = left.size() / 3, until = 2 * left.size() / 3;
    std::vector<Taken> frames;
    for (size_t k = 0; k < left.size(); ++k) {
      if (k >= from && k < until) left[k] += step_ms * kMs;
      frames.push_back({Side::Left, left[k]});
      frames.push_back({Side::Right, right[k]});
    }
    Matcher matcher(16 * kMs, 8);
    const Matcher::Out out = play(matcher, frames);
    expect_whole(out, left, right, 16 * kMs);
    // Pairs on both sides of the step; an even larger part where it is short.
    EXPECT_GE(matcher.skew().pairs(), left.size() / 2) << step_ms;
  }
}

}  // namespace
}  // namespace palpate
