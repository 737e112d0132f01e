// Force by the elastic layer on recordings of a real gel sensor with a gauge: one modulus from some
// objects, judged by others. The recordings are not part of the repository; the test says loudly when it is
// skipped.
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdio>
#include <map>
#include <string>
#include <vector>

#include "tests/recordings/wedge_clips.h"

namespace palpate {
namespace {

constexpr double kFull_N = 24;

/// A clip's frames above 1 N.
struct Clip {
  std::vector<double> layer_N, sd_N, gauge_N;
};

class TractionRecordings : public WedgeClips {
 protected:
  TractionRecordings() : WedgeClips("FORCE BY THE LAYER NOT CHECKED AGAINST A REAL GAUGE") {}

  /// A gauge that jumps beyond what was pressed has a glitch.
  static bool is_press(double force_N) { return force_N > 1 && force_N < 1.25 * kFull_N; }
  /// Frames by which the gauge comes late: where it goes best with the sum of the change's gradients, which
  /// no way of measuring force is chosen by here.
  static int lag_of(const GaugedRecording& recording) {
    const auto frames = static_cast<int>(recording.frames.size());
    double best = -1;
    int found = 0;
    for (int lag = -2; lag <= 5; ++lag) {
      double n = 0, a = 0, b = 0, aa = 0, bb = 0, ab = 0;
      for (int i = std::max(0, -lag); i < std::min(frames, frames - lag); ++i) {
        const double x = recording.frames[static_cast<size_t>(i)].touch.gradient_sum.value_or(0);
        const double y = recording.frames[static_cast<size_t>(i + lag)].force_N;
        if (!is_press(y)) continue;
        n += 1, a += x, b += y, aa += x * x, bb += y * y, ab += x * y;
      }
      const double correlation = (n * ab - a * b) / std::sqrt((n * aa - a * a) * (n * bb - b * b));
      if (!(correlation > best)) continue;
      best = correlation;
      found = lag;
    }
    return found;
  }
  static Clip clip(const std::filesystem::path& video) {
    MeasuredInput input{
        video.string(),
        load_sensor(shipped_sensor("gelsight_wedge")),
        {},
        Output::Force | Output::Contacts | Output::Surface | Output::Gradient | Output::Traction};
    const std::filesystem::path table = std::filesystem::path(video).replace_extension(".csv");
    const GaugedRecording recording =
        measure_with_gauge(context(), input, {table.string(), {}, parse_alignment("none"), 0}, {});
    Clip found;
    const int lag = lag_of(recording);
    const auto frames = static_cast<int>(recording.frames.size());
    for (int i = 0; i < frames; ++i) {
      if (i + lag < 0 || i + lag >= frames) continue;
      const GaugedFrame& frame = recording.frames[static_cast<size_t>(i)];
      const double gauge_N = recording.frames[static_cast<size_t>(i + lag)].force_N;
      if (!is_press(gauge_N) || !frame.touch.contact) continue;
      found.layer_N.push_back(frame.touch.traction->fz_N.value);
      found.sd_N.push_back(frame.touch.traction->fz_N.standard_error);
      found.gauge_N.push_back(gauge_N);
    }
    return found;
  }
  using Clips = std::vector<const Clip*>;
  /// Of F = scale times the layer's force.
  static double scale_of(const Clips& clips) {
    double products = 0, squares = 0;
    for (const Clip* one : clips)
      for (size_t i = 0; i < one->layer_N.size(); ++i) {
        products += one->layer_N[i] * one->gauge_N[i];
        squares += one->layer_N[i] * one->layer_N[i];
      }
    return products / squares;
  }
  /// Mean absolute error, fraction of full scale.
  static double error(const Clip& clip, double scale) {
    double sum = 0;
    for (size_t i = 0; i < clip.layer_N.size(); ++i)
      sum += std::abs(scale * clip.layer_N[i] - clip.gauge_N[i]);
    return sum / static_cast<double>(clip.layer_N.size()) / kFull_N;
  }
};

TEST_F(TractionRecordings, OneModulusForObjectsNeverPressed) {
  std::map<std::string, Clip> first, second;
  for (const std::filesystem::path& video : both_days(3)) {
    const bool day2 = video.parent_path().filename() == "gelsight_wedge_day2";
    (day2 ? second : first)[video.stem().string()] = clip(video);
  }
  if (second.size() < of_sweep<size_t>(8, 3)) GTEST_SKIP() << "no recordings of the second day";
  Clips day1;
  for (const auto& [name, one] : first) day1.push_back(&one);
  double across = 0;
  for (const auto& [name, one] : second)
    across += error(one, scale_of(day1)) / static_cast<double>(second.size());
  std::printf("day 1 -> day 2: mean error %.1f %% of full scale\n", 100 * across);
  EXPECT_LT(across, 0.15);
  if (!thorough()) return;
  std::vector<std::string> names;
  for (const auto& [name, one] : second) {
    names.push_back(name);
    std::printf("day 2 %-30s %3zu frames, scale %.3f\n", name.c_str(), one.layer_N.size(), scale_of({&one}));
  }
  // Every way to calibrate on four objects and to judge by the other four, the strawberry among these.
  double sum = 0, worst_sum = 0, least = 1, most = 0;
  size_t splits = 0;
  std::map<std::string, std::pair<double, size_t>> each;
  for (uint32_t chosen = 0; chosen < 256; ++chosen) {
    if (std::popcount(chosen) != 4) continue;
    Clips calibrated;
    bool strawberry = true;
    for (size_t i = 0; i < 8; ++i)
      if (chosen >> i & 1) {
        calibrated.push_back(&second[names[i]]);
        strawberry = strawberry && names[i] != "rigid_strawberry";
      }
    if (!strawberry) continue;
    const double scale = scale_of(calibrated);
    double mean = 0, worst = 0;
    for (size_t i = 0; i < 8; ++i) {
      if (chosen >> i & 1) continue;
      const double off = error(second[names[i]], scale);
      mean += off / 4;
      worst = std::max(worst, off);
      each[names[i]].first += off;
      ++each[names[i]].second;
    }
    sum += mean;
    worst_sum += worst;
    least = std::min(least, mean);
    most = std::max(most, mean);
    ++splits;
  }
  const double mean = sum / static_cast<double>(splits);
  std::printf(
      "day 2, four objects -> the other four, %zu ways: mean error %.1f %% of full scale (%.1f to %.1f), "
      "worst "
      "object %.1f %%\n",
      splits, 100 * mean, 100 * least, 100 * most, 100 * worst_sum / static_cast<double>(splits));
  for (const auto& [name, total] : each)
    std::printf("  %-30s %.1f %%\n", name.c_str(), 100 * total.first / static_cast<double>(total.second));

  Clips trials;
  for (const auto& [name, one] : first)
    if (name.ends_with("_1")) trials.push_back(&one);
  const double scale = scale_of(trials);
  double pooled = 0, own = 0;
  for (const auto& [name, one] : first) {
    if (!name.ends_with("_2")) continue;
    const double by_own = error(one, scale_of({&first[name.substr(0, name.size() - 1) + "1"]}));
    pooled += error(one, scale) / 5;
    own += by_own / 5;
    std::printf(
        "day 1 %-30s scale %.3f, error with the first trials' modulus %.1f %%, with its own first's %.1f "
        "%%\n",
        name.c_str(), scale_of({&one}), 100 * error(one, scale), 100 * by_own);
  }
  std::printf("day 1, first trials -> second: %.1f %% (each object by its own first: %.1f %%)\n",
              100 * pooled, 100 * own);
  std::printf(
      "modulus: %.0f kPa by day 1, %.0f kPa by day 2 (nominal 150)\n", 150 * scale_of(day1), 150 * [&] {
        Clips all;
        for (const auto& [name, one] : second) all.push_back(&one);
        return scale_of(all);
      }());
  EXPECT_LT(mean, 0.10);
  EXPECT_LT(own, 0.12);
  EXPECT_LT(pooled, 0.16);
  // The intervals of objects that the modulus was not found with.
  size_t held = 0, count = 0;
  for (const auto& [name, one] : second) {
    Clips others;
    for (const auto& [other, clip] : second)
      if (other != name) others.push_back(&clip);
    const double by = scale_of(others);
    size_t here = 0;
    for (size_t i = 0; i < one.layer_N.size(); ++i)
      here += std::abs(by * one.layer_N[i] - one.gauge_N[i]) <= 1.96 * by * one.sd_N[i];
    held += here;
    count += one.layer_N.size();
    std::printf("  95 %% interval of %-30s holds %.0f %%\n", name.c_str(),
                100.0 * static_cast<double>(here) / static_cast<double>(one.layer_N.size()));
  }
  std::printf("intervals of 95 %% hold %.0f %% of %zu\n",
              100.0 * static_cast<double>(held) / static_cast<double>(count), count);
  EXPECT_GE(static_cast<double>(held), 0.9 * static_cast<double>(count));
}

}  // namespace
}  // namespace palpate
