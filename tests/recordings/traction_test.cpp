// Force by the elastic layer on recordings of a real gel sensor with a gauge, alone and with the bending:
// calibrated on some objects, judged by others and on another day. The recordings are not part of the
// repository; the test says loudly when it is skipped.
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdio>
#include <map>
#include <ranges>
#include <string>
#include <vector>

#include "engine/calibrate/force/choice.h"
#include "engine/measure/force.h"
#include "tests/recordings/wedge_clips.h"

namespace palpate {
namespace {

constexpr double kFull_N = 24;

/// A clip's frames above 1 N.
struct Clip {
  std::string object;  ///< without the number of its trial
  std::vector<double> layer_N, sd_N, gauge_N;
  std::vector<ForceSample> samples;
};

class TractionRecordings : public WedgeClips {
 protected:
  TractionRecordings() : WedgeClips("FORCE BY THE LAYER NOT CHECKED AGAINST A REAL GAUGE") {}

  /// A gauge that jumps beyond what was pressed has a glitch.
  static bool is_press(double force_N) { return force_N > 1 && force_N < 1.25 * kFull_N; }
  /// Frames by which the gauge comes late: where it goes best with the sum of the change's gradients, which
  /// no way of measuring force is chosen by here.
  static int lag_of(const GaugedRecording& recording) {
    const std::ptrdiff_t frames = std::ssize(recording.frames);
    double best = -1;
    int found = 0;
    for (int lag = -2; lag <= 5; ++lag) {
      double n = 0, a = 0, b = 0, aa = 0, bb = 0, ab = 0;
      for (std::ptrdiff_t i = std::max(0, -lag); i < std::min(frames, frames - lag); ++i) {
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
  static const Clip& clip(const std::filesystem::path& video) {
    static std::map<std::string, Clip> clips;
    const auto [found, measures] = clips.try_emplace(video.string());
    if (measures) found->second = measure(video);
    return found->second;
  }
  static Clip measure(const std::filesystem::path& video) {
    MeasuredInput input{
        video.string(),
        load_sensor(shipped_sensor("gelsight_wedge")),
        {},
        Output::Force | Output::Contacts | Output::Surface | Output::Gradient | Output::Traction};
    const std::filesystem::path table = std::filesystem::path(video).replace_extension(".csv");
    const GaugedRecording recording =
        measure_with_gauge(context(), input, {table.string(), {}, parse_alignment("none"), 0}, {});
    Clip found;
    const std::string name = video.stem().string();
    found.object = name.ends_with("_1") || name.ends_with("_2") ? name.substr(0, name.size() - 2) : name;
    const int lag = lag_of(recording);
    const std::ptrdiff_t frames = std::ssize(recording.frames);
    for (std::ptrdiff_t i = 0; i < frames; ++i) {
      if (i + lag < 0 || i + lag >= frames) continue;
      const GaugedFrame& frame = recording.frames[static_cast<size_t>(i)];
      const double gauge_N = recording.frames[static_cast<size_t>(i + lag)].force_N;
      if (!is_press(gauge_N) || !frame.touch.contact) continue;
      found.layer_N.push_back(frame.touch.traction->fz_N.value);
      found.sd_N.push_back(frame.touch.traction->fz_N.standard_error);
      found.gauge_N.push_back(gauge_N);
      found.samples.push_back({.features = force_features(frame.touch),
                               .force_N = gauge_N,
                               .time_s = frame.time_s,
                               .frame = frame.touch.sequence});
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

/// What a calibration is worth on clips that it was not made of: errors and half intervals as shares of full
/// scale.
struct Worth {
  double clips = 0, error = 0, held = 0, half = 0, usable = 0;  ///< sums over clips, each of its frames' mean
  void add(const ForceCalibration& calibration, const Clip& clip) {
    double off = 0, in = 0, wide = 0, fit = 0, small = 0;
    for (const ForceSample& s : clip.samples) {
      const Estimate e = force_of(calibration, s.features);
      const double half_N = 1.96 * e.standard_error;
      off += std::abs(e.value - s.force_N) / kFull_N;
      in += std::abs(e.value - s.force_N) <= half_N;
      if (s.force_N > 20) continue;
      ++small;
      wide += half_N / kFull_N;
      fit += e.validity == Validity::Valid || half_N <= 0.15 * kFull_N;
    }
    const auto n = static_cast<double>(clip.samples.size());
    clips += 1, error += off / n, held += in / n, half += wide / small, usable += fit / small;
  }
  void print(const char* signal, const char* what) const {
    std::printf("  %-18s %-42s error %4.1f %%, 95 %% holds %3.0f %%, half of it %4.1f %%, usable %3.0f %%\n",
                signal, what, 100 * error / clips, 100 * held / clips, 100 * half / clips,
                100 * usable / clips);
  }
  double mean() const { return error / clips; }
};

ForceCalibration calibrated(ForceSignal signal, const std::vector<const Clip*>& clips) {
  std::vector<ForceSample> samples;
  for (size_t i = 0; i < clips.size(); ++i)
    for (ForceSample s : clips[i]->samples) {
      s.recording = s.press = static_cast<uint32_t>(i);
      samples.push_back(s);
    }
  return choose_force(samples, {.signal = signal, .branches = false}).calibration;
}

/// Every clip by a calibration on those of `from` that show another object.
Worth left_out(ForceSignal signal, const std::vector<const Clip*>& from,
               const std::vector<const Clip*>& judged) {
  Worth worth;
  for (const Clip* one : judged) {
    std::vector<const Clip*> others;
    std::ranges::copy_if(from, std::back_inserter(others),
                         [&](const Clip* other) { return other->object != one->object; });
    worth.add(calibrated(signal, others), *one);
  }
  return worth;
}

// The layer's force and the bending err for different reasons: their mean is better than either on objects
// and on a day that it never saw.
TEST_F(TractionRecordings, MeanWithTheBendingHoldsOnAnotherDay) {
  std::vector<const Clip*> days[2], all;
  for (const std::filesystem::path& video : both_days(2)) {
    days[video.parent_path().filename() == "gelsight_wedge_day2"].push_back(&clip(video));
    all.push_back(&clip(video));
  }
  if (days[1].size() < of_sweep<size_t>(8, 2)) GTEST_SKIP() << "no recordings of the second day";
  double another_day[2] = {}, another_object[2] = {};
  for (const ForceSignal signal : {ForceSignal::Layer, ForceSignal::LayerAndBending}) {
    const char* name = to_string(signal);
    const size_t k = signal == ForceSignal::LayerAndBending;
    const char* kDay[] = {"day 1, its objects and day left out", "day 2, its objects and day left out"};
    const char* kOwn[] = {"day 1, objects left out", "day 2, objects left out"};
    const char* kBoth[] = {"day 1, objects of both days left out", "day 2, objects of both days left out"};
    for (const size_t day : {0, 1}) {
      Worth whole_day;
      const ForceCalibration of_other = calibrated(signal, days[1 - day]);
      for (const Clip* one : days[day]) whole_day.add(of_other, *one);
      whole_day.print(name, day == 0 ? "day 2 -> day 1" : "day 1 -> day 2");
      another_day[k] += whole_day.mean() / 2;
      left_out(signal, days[1 - day], days[day]).print(name, kDay[day]);
      left_out(signal, days[day], days[day]).print(name, kOwn[day]);
      const Worth objects = left_out(signal, all, days[day]);
      objects.print(name, kBoth[day]);
      another_object[k] += objects.mean() / 2;
    }
  }
  std::printf("another day: %.1f %%, by the layer alone %.1f %%; another object: %.1f %%, %.1f %%\n",
              100 * another_day[1], 100 * another_day[0], 100 * another_object[1], 100 * another_object[0]);
  EXPECT_LT(another_day[1], 0.85 * another_day[0]);
  EXPECT_LT(another_object[1], 0.85 * another_object[0]);
  EXPECT_LT(another_day[1], of_sweep(0.10, 0.12));
  EXPECT_LT(another_object[1], 0.10);
}

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
