#include "engine/lump/network/limit_search.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "engine/base/normal.h"
#include "engine/base/numbers.h"

namespace palpate::lump {
namespace {

constexpr int kHalvings = 12;
constexpr std::array<double, 3> kRatiosShown = {2, 4, 10};
constexpr double kFirstDepth_mm = 2, kDepthStep_mm = 2, kLastDepth_mm = 10;

PatchView view_at(const Model& model, const PressedNodes& nodes, std::array<double, 2> place_mm) {
  for (double& along : place_mm) along = std::clamp(along, -model.offset_mm, model.offset_mm);
  return {model, nodes, place_mm, false};
}

std::array<double, 2> middle_of(const PressedNodes& nodes) {
  const auto mean = [](const std::vector<double>& of) {
    return std::accumulate(of.begin(), of.end(), 0.0) / static_cast<double>(of.size());
  };
  return {mean(nodes.x_mm), mean(nodes.y_mm)};
}

}  // namespace

DetectionLimits::DetectionLimits(const Model& model, const PressedNodes& nodes, Method method,
                                 std::array<double, 2> place_mm)
    : model_(model),
      nodes_(nodes),
      view_(view_at(model, nodes, place_mm)),
      errors_(model, nodes, sum_patch(model.patch, nodes, view_), kGaugeFraction) {
  for (const double pattern : kPatterns) {
    patterns_.emplace_back(errors_, nodes.peak, pattern);
    energy_.push_back(patterns_.back().squares(errors_.observation())(0) + patterns_.back().cost());
  }
  const double told =
      calibration_at(model, method, nodes.loads.size(), nodes.noise_fraction).log_likelihood_ratio;
  needed_ = std::pow(std::sqrt(told) + kNineInTen, 2);
}

Eigen::MatrixXd DetectionLimits::factors_of(const Guess& guess) const {
  const double size = std::exp(guess.log_size), known = std::max(size, model_.size_mm[0]);
  Guess at = guess;
  at.log_size = std::log(known);
  // The same centre.
  at.log_depth = std::log(std::max(std::exp(guess.log_depth) - 0.5 * (known - size), model_.depth_mm[0]));
  return std::pow(size / known, 3) * bump_factors(model_, at, view_.setting, nodes_.loads, -1);
}

double DetectionLimits::evidence(const Guess& guess) const {
  const Eigen::VectorXd bump = errors_.of_factors(factors_of(guess));
  double least = std::numeric_limits<double>::infinity();
  for (size_t p = 0; p < patterns_.size(); ++p)
    least = std::min(least, energy_[p] + patterns_[p].squares(bump)(0));
  return (least - *std::ranges::min_element(energy_)) / needed_;
}

double DetectionLimits::size_mm(InclusionShape shape, double depth_mm, double stiffness_ratio) const {
  const double largest = std::min(model_.size_mm[1], nodes_.thickness_mm - model_.floor_mm - depth_mm);
  const auto seen = [&](double log_size) {
    return evidence({shape, log_size, std::log(depth_mm), std::log(stiffness_ratio)}) >= 1;
  };
  double low = std::log(kLeastSeen_mm), high = std::log(largest);
  if (!(largest > kLeastSeen_mm) || !seen(high)) return kNaN;
  if (seen(low)) return kLeastSeen_mm;
  for (int i = 0; i < kHalvings; ++i) (seen(0.5 * (low + high)) ? high : low) = 0.5 * (low + high);
  return std::exp(high);
}

std::vector<DetectionLimit> detection_limits(const Model& model, const PressedNodes& nodes, Method method) {
  const DetectionLimits here(model, nodes, method, middle_of(nodes));
  const double last =
      std::min({kLastDepth_mm, model.depth_mm[1], nodes.thickness_mm - model.floor_mm - model.size_mm[0]});
  std::vector<DetectionLimit> limits;
  for (const double ratio : kRatiosShown)
    for (double depth = kFirstDepth_mm; depth <= last; depth += kDepthStep_mm)
      limits.push_back({depth, ratio, here.size_mm(InclusionShape::Sphere, depth, ratio)});
  return limits;
}

Observation plain_observation(const Model& model, double thickness_mm, double young_Pa,
                              const std::vector<double>& force_N, const PalpationSensor& sensor,
                              uint64_t seed) {
  const double area_m2 = 1e-6 * model.block_mm[0] * model.block_mm[1];
  std::vector<PressureMap> maps;
  for (const double force : force_N) {
    const Eigen::VectorXf quarter = model.base.quarter(thickness_mm, force / (area_m2 * young_Pa));
    PressureMap map;
    map.width = map.height = 2 * model.base.side - 1;
    map.pitch_mm = {model.base.pitch_mm, model.base.pitch_mm};
    const double rim_mm = (model.base.side - 1) * model.base.pitch_mm;
    for (uint32_t j = 0; j < map.height; ++j)
      for (uint32_t i = 0; i < map.width; ++i)
        map.values.push_back(
            static_cast<float>(young_Pa * model.base.at(quarter, i * model.base.pitch_mm - rim_mm,
                                                        j * model.base.pitch_mm - rim_mm)));
    maps.push_back(std::move(map));
  }
  return sensor_observation(maps, force_N, {model.block_mm[0], model.block_mm[1], thickness_mm}, young_Pa,
                            sensor, seed);
}

}  // namespace palpate::lump
