// Offset between two clocks from signals recorded by both.
#include "engine/calibrate/time_alignment.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "palpate/error.h"

namespace palpate {
namespace {

/// Presses of different heights and lengths, N.
double force(double t) {
  double f = 0;
  for (const auto& [at, length, height] : {std::tuple{1.0, 1.4, 0.8}, {3.1, 0.9, 1.7}, {5.2, 2.1, 1.2}}) {
    const double x = (t - at) / length;
    if (x > 0 && x < 1) f += height * std::pow(std::sin(M_PI * x), 2);
  }
  return f;
}

struct Records {
  std::vector<double> frame_s, signal, gauge_s, gauge_N;
};
/// A camera at 30 Hz whose signal is not linear in the force, a gauge at 97 Hz whose clock is `offset_s`
/// behind.
Records record(double offset_s, double noise, uint32_t seed, double (*f)(double) = force) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal(0, 1);
  Records r;
  for (int i = 0; i < 240; ++i) {
    r.frame_s.push_back(i / 30.0);
    r.signal.push_back(1e6 * (std::pow(f(i / 30.0), 0.8) + noise * normal(random)));
  }
  for (int i = 0; i < 750; ++i) {
    r.gauge_s.push_back(i / 97.0);
    r.gauge_N.push_back(f(i / 97.0 + offset_s) + 0.5 * noise * normal(random));
  }
  return r;
}

TEST(TimeAlignment, FindsTheOffsetBelowASample) {
  for (const double offset_s : {0.0, 0.4123, -0.8377, 0.0071}) {
    const Records r = record(offset_s, 0, 1);
    const TimeAlignment a = align_in_time(r.frame_s, r.signal, r.gauge_s, r.gauge_N);
    EXPECT_NEAR(a.offset_s, offset_s, 0.002) << "a sixteenth of a frame";
    EXPECT_GT(a.correlation, 0.98);
  }
}

TEST(TimeAlignment, StatesItsError) {
  int inside = 0;
  double squares = 0, stated = 0;
  constexpr int kTries = 60;
  for (int i = 0; i < kTries; ++i) {
    const Records r = record(0.2, 0.03, 100 + static_cast<uint32_t>(i));
    const TimeAlignment a = align_in_time(r.frame_s, r.signal, r.gauge_s, r.gauge_N);
    inside += std::abs(a.offset_s - 0.2) <= 1.96 * a.sd_s;
    squares += std::pow(a.offset_s - 0.2, 2);
    stated += a.sd_s;
  }
  // The curve's deviation from a line counts as error too: the statement is on the safe side, by less than 4.
  EXPECT_GE(inside, 54);
  EXPECT_LT(stated / kTries, 4 * std::sqrt(squares / kTries));
  EXPECT_LT(std::sqrt(squares / kTries), 0.005);
}

TEST(TimeAlignment, GapsCarryNothing) {
  Records r = record(0.3, 0, 1);
  // The gauge shows nonsense between 2 s and 3 s of its clock.
  for (size_t i = 0; i < r.gauge_s.size(); ++i)
    if (r.gauge_s[i] > 2 && r.gauge_s[i] < 3) r.gauge_N[i] = 40;
  const std::vector<std::pair<double, double>> breaks{{2 - 0.02, 3 + 0.02}};
  EXPECT_NEAR(align_in_time(r.frame_s, r.signal, r.gauge_s, r.gauge_N, breaks).offset_s, 0.3, 0.004);
}

std::string refusal(const Records& r) {
  try {
    align_in_time(r.frame_s, r.signal, r.gauge_s, r.gauge_N);
  } catch (const Error& error) {
    return error.what();
  }
  return "not refused";
}

TEST(TimeAlignment, TheOtherSignIsNamed) {
  for (const double zero_N : {0.0, 3.0}) {
    Records r = record(0.4, 0.01, 4);
    for (double& f : r.gauge_N) f = zero_N - f;
    EXPECT_NE(refusal(r).find("reads less there (correlation -0.9"), std::string::npos) << refusal(r);
    EXPECT_NE(refusal(r).find("sign turned"), std::string::npos) << refusal(r);
  }
}

TEST(TimeAlignment, RefusesWhatIsNotOneOffset) {
  // The same press every second: any whole second fits.
  const Records periodic = record(0.2, 0.01, 3, [](double t) { return 1 - std::cos(2 * M_PI * t); });
  EXPECT_NE(refusal(periodic).find("two that fit alike"), std::string::npos) << refusal(periodic);
  Records other = record(0, 0, 1);
  std::mt19937 random(9);
  std::normal_distribution<double> normal(0, 1);
  for (double& f : other.gauge_N) f = normal(random);
  EXPECT_NE(refusal(other).find("at best"), std::string::npos) << refusal(other);
  Records still = record(0, 0, 1);
  std::fill(still.signal.begin(), still.signal.end(), 0.0);
  EXPECT_NE(refusal(still).find("nothing is pressed"), std::string::npos);
  still = record(0, 0, 1);
  std::fill(still.gauge_N.begin(), still.gauge_N.end(), 2.0);
  EXPECT_NE(refusal(still).find("reads the same all the time"), std::string::npos);
  still.gauge_s.resize(5);
  still.gauge_N.resize(5);
  EXPECT_NE(refusal(still).find("5 readings"), std::string::npos);
}

}  // namespace
}  // namespace palpate
