// What the network's answers are worth, from readings of cases that the member at work has not seen.
#include <algorithm>
#include <atomic>
#include <cmath>
#include <random>

#include "engine/lump/lump_fit.h"
#include "engine/lump/lump_training_parts.h"
#include "engine/lump/map_sampling.h"

namespace palpate {
namespace {

constexpr std::array<double, 2> kWindow_mm = {40, 30};  // of the sensors that are imitated
constexpr double kGaugeShare = 0.001;
constexpr double kCoverage = 0.9;
constexpr double kTold = 0.34, kFrom = 0.66;  // share of the training, for progress

double quantile(std::vector<double> values, double share) {
  std::erase_if(values, [](double value) { return !std::isfinite(value); });
  if (values.empty()) return 0;
  // The place that holds with one more of the kind.
  const auto place =
      static_cast<size_t>(std::clamp(std::ceil(share * static_cast<double>(values.size() + 1)) - 1, 0.0,
                                     static_cast<double>(values.size() - 1)));
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(place), values.end());
  return values[place];
}

/// The example as a noisy sensor with a window reads it, at `count` of its loads.
LumpReading noisy(const LumpReading& ideal, size_t count, double noise_share, uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  LumpReading reading = ideal;
  const size_t all = ideal.force_N.size();
  reading.pressure_Pa.clear();
  reading.force_N.clear();
  const ForwardMap& last = ideal.pressure_Pa.back();
  double peak = 0;
  const uint32_t half_x = std::min(window_nodes(kWindow_mm[0], last.pitch_mm[0]), last.width) / 2,
                 half_y = std::min(window_nodes(kWindow_mm[1], last.pitch_mm[1]), last.height) / 2;
  for (size_t k = 0; k < count; ++k) {
    const size_t load = all - 1 - (count - 1 - k) * all / count;
    const ForwardMap& from = ideal.pressure_Pa[load];
    ForwardMap map;
    map.pitch_mm = from.pitch_mm;
    map.width = 2 * half_x + 1;
    map.height = 2 * half_y + 1;
    for (uint32_t y = 0; y < map.height; ++y)
      for (uint32_t x = 0; x < map.width; ++x)
        map.values.push_back(from.at(from.width / 2 - half_x + x, from.height / 2 - half_y + y));
    for (const float value : map.values) peak = std::max(peak, static_cast<double>(value));
    reading.pressure_Pa.push_back(std::move(map));
    reading.force_N.push_back(ideal.force_N[load]);
  }
  reading.noise_Pa = noise_share * peak;
  for (ForwardMap& map : reading.pressure_Pa)
    for (float& value : map.values) value += static_cast<float>(reading.noise_Pa * normal(random));
  for (double& force : reading.force_N) force *= 1 + kGaugeShare * normal(random);
  for (size_t k = 1; k < reading.force_N.size(); ++k)
    reading.force_N[k] = std::max(reading.force_N[k], reading.force_N[k - 1] * 1.0001);
  return reading;
}

struct Trial {
  bool usable = false;
  LumpEvidence found;
};

}  // namespace

void calibrate(LumpModel& model, const LumpExamples& all, const LumpTrainingOptions& options) {
  std::vector<size_t> lumps, plain;
  for (size_t i = 0; i < all.examples.size(); ++i) (all.examples[i].lump ? lumps : plain).push_back(i);
  // Blocks without a lump are judged by a base that was made without them.
  const size_t parts = std::min<size_t>(options.members, plain.size());
  std::vector<LumpModel> without(parts, model);
  for (size_t p = 0; p < parts; ++p) {
    size_t number = 0;
    std::vector<bool> used(all.examples.size(), true);
    for (const size_t i : plain) used[i] = fold_of(number++, parts) != p;
    without[p].base = fit_base(model, all, [&used](size_t i) { return used[i]; });
  }
  std::atomic<size_t> done = 0;
  std::atomic<bool> stop = false;
  const size_t settings = kTrustLoads.size() * kTrustNoise.size();
  const size_t total = settings * (2 * options.trials + options.trials / 3);
  const auto told = [&] {
    if (options.progress &&
        !options.progress("calibrating intervals",
                          kFrom + kTold * static_cast<double>(++done) / static_cast<double>(total)))
      stop = true;
  };
  for (size_t l = 0; l < kTrustLoads.size(); ++l)
    for (size_t n = 0; n < kTrustNoise.size(); ++n) {
      const uint64_t seed = options.seed * 1000003 + (l * kTrustNoise.size() + n) * 100000;
      LumpTrust trust;
      const auto trial = [&](size_t number, bool lump, double warmth) {
        Trial t;
        if (stop) return t;
        const std::vector<size_t>& from = lump ? lumps : plain;
        const size_t example = from[(number * 7919 + 13 * n + 5 * l) % from.size()];
        const LumpReading reading = noisy(
            all.readings[example], std::min<size_t>(kTrustLoads[l], all.readings[example].force_N.size()),
            kTrustNoise[n], seed + 2 * number + (lump ? 1 : 0));
        const size_t part = fold_of((number * 7919 + 13 * n + 5 * l) % from.size(), parts);
        const LumpModel& judge = lump ? model : without[part];
        LumpEstimate ignored;
        if (const auto nodes = pressed_nodes(judge, reading, ignored)) {
          t.found = weigh_lumps(judge, *nodes, warmth, static_cast<int>(fold_of(example, options.members)));
          t.usable = true;
        }
        told();
        return t;
      };
      // How much larger misfits are than noise and network account for.
      std::vector<Trial> trials(options.trials / 3);
      in_parallel(options.threads, trials.size(), [&](size_t i) { trials[i] = trial(i, true, 1); });
      std::vector<double> misfits;
      for (const Trial& t : trials)
        if (t.usable) misfits.push_back(t.found.misfit);
      trust.warmth = std::clamp(quantile(misfits, 0.6), 1.0, 30.0);

      trials.assign(options.trials, {});
      in_parallel(options.threads, trials.size(),
                  [&](size_t i) { trials[i] = trial(i, false, trust.warmth); });
      std::vector<double> evidence, plain_misfit;
      for (const Trial& t : trials)
        if (t.usable) {
          evidence.push_back(t.found.evidence);
          plain_misfit.push_back(t.found.no_lump_misfit);
        }
      trust.evidence = std::max(6.0, quantile(evidence, 1 - model.false_alarm_rate));
      trust.no_lump_misfit = std::max(1.05, 1.02 * quantile(plain_misfit, 1 - model.false_alarm_rate));

      trials.assign(options.trials, {});
      in_parallel(options.threads, trials.size(),
                  [&](size_t i) { trials[i] = trial(i, true, trust.warmth); });
      std::array<std::vector<double>, kParameters> scores;
      std::vector<double> place, rest;
      misfits.clear();
      for (size_t i = 0; i < trials.size(); ++i) {
        const Trial& t = trials[i];
        if (!t.usable || t.found.evidence < trust.evidence) continue;
        const LumpExample& truth = all.examples[lumps[(i * 7919 + 13 * n + 5 * l) % lumps.size()]];
        const std::array<double, kParameters> wanted = {std::log(truth.size_mm), std::log(truth.depth_mm),
                                                        std::log(truth.stiffness_ratio)};
        for (const LumpParameter p : {kSize, kDepth, kRatio}) {
          const double middle = t.found.posterior.quantile(p, 0.5);
          const double off = wanted[p] - middle;
          const double half = off > 0 ? t.found.posterior.quantile(p, 0.95) - middle
                                      : middle - t.found.posterior.quantile(p, 0.05);
          scores[p].push_back(std::abs(off) / std::max(1e-4, half));
        }
        for (size_t axis = 0; axis < 2; ++axis)
          place.push_back(std::abs(t.found.place_mm[axis] - truth.offset_mm[axis]) /
                          (1.645 * std::max(1e-3, t.found.place_sd_mm[axis])));
        misfits.push_back(t.found.misfit);
        rest.push_back(t.found.rest);
      }
      if (scores[0].size() >= 10) {
        for (const LumpParameter p : {kSize, kDepth, kRatio})
          trust.stretch[p] = std::clamp(quantile(scores[p], kCoverage), 0.2, 30.0);
        trust.place_stretch = std::clamp(quantile(place, kCoverage), 0.2, 30.0);
        trust.misfit = 1.1 * quantile(misfits, 1 - model.false_alarm_rate);
        trust.rest = 1.1 * quantile(rest, 1 - model.false_alarm_rate);
      } else {
        // Too much noise to find lumps at all: nothing was learnt, and what is found nevertheless is doubted.
        trust.stretch.fill(3);
        trust.place_stretch = 3;
      }
      model.trust[l][n] = trust;
      if (stop) throw Stopped();
    }
  // Few readings lie beyond a threshold: those of other noise speak too, and what errs, errs to caution.
  for (auto& row : model.trust) {
    double evidence = 0;
    for (const LumpTrust& trust : row) evidence = std::max(evidence, trust.evidence);
    for (LumpTrust& trust : row) trust.evidence = evidence;
  }
}

}  // namespace palpate
