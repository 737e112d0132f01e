// Calibration of intervals and verdicts on observations of cases that were kept out of training.
#include <algorithm>
#include <atomic>
#include <cmath>
#include <functional>
#include <random>

#include "engine/base/normal.h"
#include "engine/lump/network/fit.h"
#include "engine/lump/observation/fixed_pattern.h"
#include "engine/tissue/map_sampling.h"
#include "perf/lab/training/steps.h"

namespace palpate::lump {
namespace {

constexpr std::array<double, 2> kWindow_mm = {40, 30};  // of the sensors that are imitated
constexpr double kSensorGauge = 0.001;
constexpr double kCoverage = 0.9;
// Share of the observations that were kept aside which the model explains least: they are called strange too,
// which lumps in the corners of its ranges, where it errs most, deserve.
constexpr double kStrange = 0.03;
// Patterns of the imitated sensors, fraction of the peak; one in three has none.
constexpr std::array<double, 2> kPattern = {2e-4, kLargestPattern};
constexpr double kLocalCost = 0.01;         // of the squares of local factors
constexpr double kTold = 0.2, kFrom = 0.8;  // fraction of the training, for progress

double quantile(std::vector<double> values, double fraction) {
  std::erase_if(values, [](double value) { return !std::isfinite(value); });
  if (values.empty()) return 0;
  // The place that holds with one more of the kind.
  const auto place =
      static_cast<size_t>(std::clamp(std::ceil(fraction * static_cast<double>(values.size() + 1)) - 1, 0.0,
                                     static_cast<double>(values.size() - 1)));
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(place), values.end());
  return values[place];
}

/// The example as a noisy sensor with a window reads it, at `count` of its loads.
Observation noisy(const Observation& ideal, size_t count, double noise_fraction, uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  Observation observation = ideal;
  const size_t all = ideal.force_N.size();
  observation.pressure_Pa.clear();
  observation.force_N.clear();
  const PressureMap& last = ideal.pressure_Pa.back();
  double peak = 0;
  const uint32_t half_x = std::min(window_nodes(kWindow_mm[0], last.pitch_mm[0]), last.width) / 2,
                 half_y = std::min(window_nodes(kWindow_mm[1], last.pitch_mm[1]), last.height) / 2;
  for (size_t k = 0; k < count; ++k) {
    const size_t load = all - 1 - (count - 1 - k) * all / count;
    const PressureMap& from = ideal.pressure_Pa[load];
    PressureMap map;
    map.pitch_mm = from.pitch_mm;
    map.width = 2 * half_x + 1;
    map.height = 2 * half_y + 1;
    for (uint32_t y = 0; y < map.height; ++y)
      for (uint32_t x = 0; x < map.width; ++x)
        map.values.push_back(from.at(from.width / 2 - half_x + x, from.height / 2 - half_y + y));
    for (const float value : map.values) peak = std::max(peak, static_cast<double>(value));
    observation.pressure_Pa.push_back(std::move(map));
    observation.force_N.push_back(ideal.force_N[load]);
  }
  observation.noise_Pa = noise_fraction * peak;
  std::uniform_real_distribution<double> share(0, 1);
  const double pattern_Pa =
      share(random) < 1. / 3 ? 0 : peak * kPattern[0] * std::pow(kPattern[1] / kPattern[0], share(random));
  const PatternKind kind = any_pattern(random);
  const PressureMap& any = observation.pressure_Pa.front();
  const Eigen::MatrixXd pattern =
      fixed_pattern(any.width, any.height, any.pitch_mm[0], kind.length_mm, random);
  for (PressureMap& map : observation.pressure_Pa)
    for (size_t n = 0; n < map.values.size(); ++n) {
      float& value = map.values[n];
      const double fixed =
          pattern(static_cast<Eigen::Index>(n / map.width), static_cast<Eigen::Index>(n % map.width));
      value += static_cast<float>(pattern_Pa * fixed * (kind.gain ? static_cast<double>(value) / peak : 1) +
                                  observation.noise_Pa * normal(random));
    }
  for (double& force : observation.force_N) force *= 1 + kSensorGauge * normal(random);
  for (size_t k = 1; k < observation.force_N.size(); ++k)
    observation.force_N[k] = std::max(observation.force_N[k], observation.force_N[k - 1] * 1.0001);
  return observation;
}

struct Trial {
  bool usable = false;
  Inference found;
};

/// Trials of one method at one number of loads and one noise.
class Calibrator {
 public:
  Calibrator(const Model& model, const Examples& all, const TrainingOptions& options);

  /// With the local factors of the model as they are.
  Calibration calibration(Method method, size_t loads, size_t noise) const;
  /// The local factors, of trials at all numbers of loads and noise together.
  std::array<std::array<double, kLocal>, kParameters> local(Method method) const;
  /// Told after each trial; false stops all.
  std::function<bool()> reported = [] { return true; };

 private:
  struct Setting {
    Method method;
    size_t loads, noise;
  };
  Trial trial(const Setting& at, size_t number, bool lump, double temperature) const;
  std::vector<Trial> trials(const Setting& at, size_t count, bool lump, double temperature) const;
  struct Miss {
    std::array<double, kParameters> logs{}, score{}, error{};  ///< score: of the interval's half
  };
  Miss miss(const Setting& at, size_t number, const Trial& t) const;
  size_t example(const Setting& at, size_t number, bool lump) const {
    const std::vector<size_t>& from = lump ? lumps_ : plain_;
    return from[(number * 7919 + 13 * at.noise + 5 * at.loads) % from.size()];
  }

  const Model& model_;
  const Examples& all_;
  const TrainingOptions& options_;
  std::vector<size_t> lumps_, plain_;
  std::vector<size_t> part_;    ///< by example: who judges it, where it holds no lump
  std::vector<Model> without_;  ///< with bases that were made without a part of the blocks without a lump
};

Calibrator::Calibrator(const Model& model, const Examples& all, const TrainingOptions& options)
    : model_(model), all_(all), options_(options), part_(all.examples.size()) {
  for (size_t i = 0; i < all.examples.size(); ++i) {
    if (!all.finest(i)) continue;
    if (!all.examples[i].lump)
      plain_.push_back(i);
    else if (all.aside(i))
      lumps_.push_back(i);
  }
  if (all.unseen) {
    without_.assign(1, model);
    return;
  }
  // All are needed for the base: blocks without a lump are judged by one that was made without them.
  const size_t parts = std::min<size_t>(options.ensemble, plain_.size());
  for (size_t p = 0; p < plain_.size(); ++p) part_[plain_[p]] = part_of(p, parts);
  without_.assign(parts, model);
  for (size_t p = 0; p < parts; ++p)
    without_[p].base = fit_base(model, all, [&](size_t i) { return all.finest(i) && part_[i] != p; });
}

Trial Calibrator::trial(const Setting& at, size_t number, bool lump, double temperature) const {
  const uint64_t seed = options_.seed * 1000003 + (at.loads * kCalibrationNoise.size() + at.noise) * 100000;
  const size_t example = this->example(at, number, lump);
  const Observation& ideal = all_.observations[example];
  const Observation observation =
      noisy(ideal, std::min<size_t>(kCalibrationLoads[at.loads], ideal.force_N.size()),
            kCalibrationNoise[at.noise], seed + 2 * number + (lump ? 1 : 0));
  const Model& judge = lump ? model_ : without_[part_[example]];
  Trial t;
  Estimate ignored;
  if (const auto nodes = pressed_nodes(judge, observation, ignored)) {
    t.found = weigh_lumps(judge, *nodes, at.method, temperature);
    t.usable = true;
  }
  return t;
}

std::vector<Trial> Calibrator::trials(const Setting& at, size_t count, bool lump, double temperature) const {
  std::vector<Trial> found(count);
  std::atomic<bool> stop = false;
  in_parallel(options_.threads, count, [&](size_t i) {
    if (stop) return;
    found[i] = trial(at, i, lump, temperature);
    if (!reported()) stop = true;
  });
  if (stop) throw Stopped();
  return found;
}

Calibrator::Miss Calibrator::miss(const Setting& at, size_t number, const Trial& t) const {
  const Example& truth = all_.examples[example(at, number, true)];
  const std::array<double, kParameters> wanted = {std::log(truth.size_mm), std::log(truth.depth_mm),
                                                  std::log(truth.stiffness_ratio)};
  Miss miss;
  for (const Parameter p : {kSize, kDepth, kRatio}) {
    miss.logs[p] = t.found.posterior.quantile(p, 0.5);
    const double off = wanted[p] - miss.logs[p];
    const double half = off > 0 ? t.found.posterior.quantile(p, 0.95) - miss.logs[p]
                                : miss.logs[p] - t.found.posterior.quantile(p, 0.05);
    miss.score[p] = std::abs(off) / std::max(1e-4, half);
    miss.error[p] = std::abs(std::expm1(-off));
  }
  return miss;
}

std::array<std::array<double, kLocal>, kParameters> Calibrator::local(Method method) const {
  std::vector<Miss> misses;
  for (size_t l = 0; l < kCalibrationLoads.size(); ++l)
    for (size_t n = 0; n < kCalibrationNoise.size(); ++n) {
      const Setting at{method, l, n};
      const std::vector<Trial> all = trials(at, options_.trials, true, 1);
      for (size_t i = 0; i < all.size(); ++i)
        if (all[i].usable && !all[i].found.posterior.parts.empty()) misses.push_back(miss(at, i, all[i]));
    }
  std::array<std::array<double, kLocal>, kParameters> factors{};
  if (misses.empty()) return factors;
  for (const Parameter p : {kSize, kDepth, kRatio}) {
    // Scores as Laplace's distribution has them whose width depends on the place: likeliest factors, by
    // steps along the slope. A few surprises count as large, not as endless.
    Eigen::Matrix<double, kLocal + 1, 1> factor = Eigen::Matrix<double, kLocal + 1, 1>::Zero();
    for (int step = 0; step < 600; ++step) {
      Eigen::Matrix<double, kLocal + 1, 1> slope = Eigen::Matrix<double, kLocal + 1, 1>::Zero(), terms;
      for (const Miss& m : misses) {
        terms << local_terms(model_, m.logs), 1;
        slope += (1 - std::min(4.0, m.score[p] / std::exp(terms.dot(factor)))) * terms;
      }
      slope /= static_cast<double>(misses.size());
      slope.head<kLocal>() += kLocalCost * factor.head<kLocal>();
      factor -= 0.4 * slope;
    }
    for (size_t f = 0; f < kLocal; ++f) factors[p][f] = factor(static_cast<Eigen::Index>(f));
  }
  return factors;
}

Calibration Calibrator::calibration(Method method, size_t loads, size_t noise) const {
  const Setting at{method, loads, noise};
  const double false_alarms = model_.false_alarm_rate;
  Calibration calibration;
  std::vector<double> chi_squares;
  if (method == Method::Refined) {
    // How much larger chi-squares are than noise and emulator account for.
    for (const Trial& t : trials(at, options_.trials / 3, true, 1))
      if (t.usable) chi_squares.push_back(t.found.chi_square);
    calibration.temperature = std::clamp(quantile(chi_squares, 0.6), 1.0, 30.0);
    chi_squares.clear();
  }
  std::vector<double> log_likelihood_ratio, plain_pattern;
  for (const Trial& t : trials(at, options_.trials, false, calibration.temperature))
    if (t.usable) {
      log_likelihood_ratio.push_back(t.found.log_likelihood_ratio);
      plain_pattern.push_back(t.found.plain_pattern);
    }
  calibration.log_likelihood_ratio = std::max(6.0, quantile(log_likelihood_ratio, 1 - false_alarms));
  calibration.plain_pattern = std::max(kLargestPattern, 1.1 * quantile(plain_pattern, 1 - false_alarms));

  std::array<std::vector<double>, kParameters> scores, errors;
  std::vector<double> place, rest, misfit;
  double right = 0;
  const std::vector<Trial> lumps = trials(at, options_.trials, true, calibration.temperature);
  for (size_t i = 0; i < lumps.size(); ++i) {
    const Trial& t = lumps[i];
    if (!t.usable || t.found.log_likelihood_ratio < calibration.log_likelihood_ratio) continue;
    const Example& truth = all_.examples[example(at, i, true)];
    const Miss off = miss(at, i, t);
    for (const Parameter p : {kSize, kDepth, kRatio}) {
      scores[p].push_back(off.score[p] / local_inflation(model_, method, p, off.logs));
      errors[p].push_back(off.error[p]);
    }
    for (size_t axis = 0; axis < 2; ++axis)
      place.push_back(std::abs(t.found.place_mm[axis] - truth.offset_mm[axis]) /
                      (kNormal90 * std::max(1e-3, t.found.place_sd_mm[axis])));
    misfit.push_back(t.found.misfit);
    rest.push_back(t.found.rest);
    const auto& probability = t.found.posterior.shape_probability;
    right += std::max_element(probability.begin(), probability.end()) - probability.begin() ==
             static_cast<std::ptrdiff_t>(truth.shape);
  }
  if (scores[0].size() < 10) {
    // Too much noise to find lumps at all: nothing was learnt, and what is found nevertheless is doubted.
    calibration.inflation.fill(3);
    calibration.place_inflation = 3;
    return calibration;
  }
  for (const Parameter p : {kSize, kDepth, kRatio}) {
    calibration.inflation[p] = std::clamp(quantile(scores[p], kCoverage), 0.2, 30.0);
    calibration.median_error[p] = quantile(errors[p], 0.5);
  }
  calibration.shape_rate = right / static_cast<double>(misfit.size());
  calibration.place_inflation = std::clamp(quantile(place, kCoverage), 0.2, 30.0);
  calibration.misfit = 1.1 * quantile(misfit, 1 - kStrange);
  calibration.rest = 1.1 * quantile(rest, 1 - kStrange);
  return calibration;
}

}  // namespace

void calibrate(Model& model, const Examples& all, const TrainingOptions& options) {
  model.local = {};
  Calibrator calibrator(model, all, options);
  const size_t settings = kCalibrationLoads.size() * kCalibrationNoise.size();
  const size_t total = settings * (6 * options.trials + options.trials / 3);
  std::atomic<size_t> done = 0;
  if (options.progress)
    calibrator.reported = [&] {
      return options.progress("calibrating intervals",
                              kFrom + kTold * static_cast<double>(++done) / static_cast<double>(total));
    };
  for (const Method method : {Method::Network, Method::Refined})
    model.local[static_cast<size_t>(method)] = calibrator.local(method);
  decltype(model.calibration) tables;
  for (const Method method : {Method::Network, Method::Refined})
    for (size_t l = 0; l < kCalibrationLoads.size(); ++l)
      for (size_t n = 0; n < kCalibrationNoise.size(); ++n)
        tables[static_cast<size_t>(method)][l][n] = calibrator.calibration(method, l, n);
  // Few observations lie beyond a threshold, so the largest threshold of all noise levels is used for each:
  // an error then is on the cautious side.
  for (Model::CalibrationTable& table : tables)
    for (auto& row : table) {
      double log_likelihood_ratio = 0;
      for (const Calibration& calibration : row)
        log_likelihood_ratio = std::max(log_likelihood_ratio, calibration.log_likelihood_ratio);
      for (Calibration& calibration : row) calibration.log_likelihood_ratio = log_likelihood_ratio;
    }
  model.calibration = tables;
}

}  // namespace palpate::lump
