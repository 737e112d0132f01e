#include "engine/calibrate/force/thickness.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

#include "engine/base/text.h"

namespace palpate {
namespace {

constexpr int kThicknessSteps = 120;  // between the ends of kThicknesses, by ratio
constexpr double kClearly = 0.1;      // of the error by the modulus alone: less of a gain is none
constexpr double kTheory = 0.02;      // of the force, by which the layer's force errs where all is known
constexpr double kMostRelativeSd = 0.15;

struct Readings {
  std::vector<const ThicknessForces*> layer_N;
  std::vector<double> force_N;
};
using Objects = std::vector<Readings>;

double thickness_at(int step) {
  return kThicknesses.front() *
         std::pow(kThicknesses.back() / kThicknesses.front(), double{1} * step / kThicknessSteps);
}

/// The layer's force at another thickness: a polynomial through all of them, by the logarithm of thickness.
std::array<double, kThicknesses.size()> shares_at(double thickness) {
  std::array<double, kThicknesses.size()> shares{};
  for (size_t i = 0; i < shares.size(); ++i) {
    shares[i] = 1;
    for (size_t k = 0; k < shares.size(); ++k)
      if (k != i)
        shares[i] *= std::log(thickness / kThicknesses[k]) / std::log(kThicknesses[i] / kThicknesses[k]);
  }
  return shares;
}

struct Fit {
  double thickness = 1, scale = 1, misfit = 0;
  double squares = 0;  ///< of the gauge's forces, as `misfit` counts them
  bool at_end = false;
  std::array<double, kThicknesses.size()> shares{};

  double force_N(const ThicknessForces& layer_N) const {
    double force = 0;
    for (size_t i = 0; i < layer_N.size(); ++i) force += shares[i] * layer_N[i];
    return scale * force;
  }
};

Fit fit_scale(const Objects& objects, size_t left_out, double thickness) {
  Fit fit{.thickness = thickness, .shares = shares_at(thickness)};
  double products = 0, squares = 0;
  for (size_t o = 0; o < objects.size(); ++o) {
    if (o == left_out) continue;
    const double weight = 1 / static_cast<double>(objects[o].force_N.size());
    for (size_t i = 0; i < objects[o].force_N.size(); ++i) {
      const double layer = fit.force_N(*objects[o].layer_N[i]), force = objects[o].force_N[i];
      products += weight * layer * force;
      squares += weight * layer * layer;
      fit.squares += weight * force * force;
    }
  }
  fit.scale = squares > 0 ? products / squares : 0;
  fit.misfit = fit.squares - fit.scale * products;
  return fit;
}

Fit fit_both(const Objects& objects, size_t left_out) {
  Fit best = fit_scale(objects, left_out, thickness_at(0));
  best.at_end = true;
  for (int step = 1; step <= kThicknessSteps; ++step) {
    Fit fit = fit_scale(objects, left_out, thickness_at(step));
    fit.at_end = step == kThicknessSteps;
    if (fit.misfit < best.misfit) best = fit;
  }
  return best;
}

/// Standard error of the thickness' logarithm where each object errs by kTheory.
double theory_sd(const Objects& objects, const Fit& best) {
  const double most = best.misfit + kTheory * kTheory * best.squares / static_cast<double>(objects.size());
  int within = 0;
  for (int step = 0; step <= kThicknessSteps; ++step)
    within += fit_scale(objects, objects.size(), thickness_at(step)).misfit <= most;
  return 0.5 * within / kThicknessSteps * std::log(kThicknesses.back() / kThicknesses.front());
}

double error_N(const Fit& fit, const Readings& readings) {
  double sum = 0;
  for (size_t i = 0; i < readings.force_N.size(); ++i)
    sum += std::abs(fit.force_N(*readings.layer_N[i]) - readings.force_N[i]);
  return sum / static_cast<double>(readings.force_N.size());
}

}  // namespace

ThicknessChoice choose_thickness(std::span<const ForceSample> samples,
                                 std::span<const ThicknessForces> layer_N) {
  std::map<uint32_t, Readings> by_object;
  for (size_t i = 0; i < samples.size(); ++i) {
    if (!is_used(samples[i]) || !std::ranges::all_of(layer_N[i], [](double n) { return std::isfinite(n); }))
      continue;
    Readings& readings = by_object[object_of(samples[i])];
    readings.layer_N.push_back(&layer_N[i]);
    readings.force_N.push_back(samples[i].force_N);
  }
  Objects objects;
  for (auto& [object, readings] : by_object) objects.push_back(std::move(readings));
  ThicknessChoice choice{.objects = objects.size()};
  if (objects.size() < kFewestObjects) return choice;
  const auto n = static_cast<double>(objects.size());
  double gain = 0, gains = 0, ratio = 0, ratios = 0, mean_N = 0;
  bool at_end = false;
  for (size_t o = 0; o < objects.size(); ++o) {
    const Fit both = fit_both(objects, o), alone = fit_scale(objects, o, 1);
    const std::vector<double>& forces = objects[o].force_N;
    const double free_N = error_N(both, objects[o]), stated_N = error_N(alone, objects[o]);
    at_end = at_end || both.at_end;
    choice.error_N += free_N / n;
    mean_N += std::accumulate(forces.begin(), forces.end(), 0.0) / static_cast<double>(forces.size()) / n;
    choice.stated_error_N += stated_N / n;
    gain += stated_N - free_N;
    gains += std::pow(stated_N - free_N, 2);
    ratio += std::log(both.thickness);
    ratios += std::pow(std::log(both.thickness), 2);
  }
  const Fit all = fit_both(objects, objects.size());
  choice.factor = all.thickness;
  choice.relative_sd = std::hypot(std::sqrt((n - 1) * std::max(ratios / n - std::pow(ratio / n, 2), 0.0)),
                                  theory_sd(objects, all));
  const double gain_sd = std::sqrt(std::max(gains / n - std::pow(gain / n, 2), 0.0) / (n - 1));
  const double least_N = std::max({gain_sd, kClearly * choice.stated_error_N, kTheory * mean_N});
  choice.decided = !all.at_end && !at_end && choice.relative_sd < kMostRelativeSd && gain / n > least_N;
  return choice;
}

std::string ThicknessChoice::line() const {
  if (objects < kFewestObjects)
    return text("thickness: not looked for by fewer than %zu objects; the modulus alone was found",
                kFewestObjects);
  const std::string found =
      text("%.3g +- %.2g of the stated one, error of objects left out %.3g N, by the modulus alone %.3g N",
           factor, factor * relative_sd, error_N, stated_error_N);
  return decided ? "thickness: " + found
                 : "thickness: these presses do not decide it (" + found +
                       "): the stated one stays, the modulus alone was found";
}

}  // namespace palpate
