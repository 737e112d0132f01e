#include "engine/lump/network/view.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/base/text.h"
#include "engine/lump/observation/saturated_loads.h"
#include "engine/tissue/map_sampling.h"
#include "palpate/error.h"

namespace palpate::lump {
namespace {

constexpr double kRim_mm = 1.25;         // nearer to the rim a grid's own error is larger than a lump's trace
constexpr double kUnseenFraction = 0.1;  // of a load's values: more, and the load is left out
constexpr size_t kFewestNodes = 100;
constexpr double kBeyond = 0.03;      // of a range: as far outside of training as is still taken
constexpr double kFind_mm = 2.5;      // Gaussian that looks for bumps
constexpr double kLeastNoise = 3e-4;  // of the peak: no sensor is better
constexpr double kPatternCost = 4;    // of a pattern beyond the largest, by the square of its logarithm

std::string quantity_text(double value, const char* unit) {
  return text("%.3g%s%s", value, *unit ? " " : "", unit);
}

std::string range_text(const std::array<double, 2>& range) {
  return text("%.3g to %.3g", range[0], range[1]);
}

bool outside(double value, const std::array<double, 2>& range) {
  return !(value >= range[0] * (1 - kBeyond) && value <= range[1] * (1 + kBeyond));
}

void check(const Observation& observation) {
  const auto refuse = [](const std::string& wanted, const std::string& found) {
    throw Error(Failure::Usage, wanted, found,
                "an observation with one map a force, all of one size and pitch");
  };
  if (observation.pressure_Pa.empty() || observation.pressure_Pa.size() > 32 ||
      observation.pressure_Pa.size() != observation.force_N.size())
    refuse("1 to 32 pressure maps and a force for each",
           std::to_string(observation.pressure_Pa.size()) + " maps and " +
               std::to_string(observation.force_N.size()) + " forces");
  const PressureMap& first = observation.pressure_Pa.front();
  for (const PressureMap& map : observation.pressure_Pa)
    if (map.width != first.width || map.height != first.height || map.pitch_mm != first.pitch_mm ||
        map.values.size() != size_t{map.width} * map.height || map.width < 4 || map.height < 4)
      refuse("maps of the same nodes, 4 x 4 or more",
             std::to_string(map.width) + " x " + std::to_string(map.height));
  for (const double pitch : first.pitch_mm)
    if (!(pitch > 0.01 && pitch < 100)) refuse("nodes 0.01 to 100 mm apart", quantity_text(pitch, "mm"));
  for (const double force : observation.force_N)
    if (!(force > 0 && force < 1e6)) refuse("forces above 0 N", quantity_text(force, "N"));
  for (size_t k = 1; k < observation.force_N.size(); ++k)
    if (!(observation.force_N[k] > observation.force_N[k - 1]))
      refuse("forces that rise from map to map", quantity_text(observation.force_N[k - 1], "N") + ", " +
                                                     quantity_text(observation.force_N[k], "N"));
  if (!(observation.young_Pa > 0 && observation.young_Pa < 1e12))
    refuse("a tissue's modulus above 0 Pa", quantity_text(observation.young_Pa, "Pa"));
  if (!(observation.noise_Pa >= 0 && std::isfinite(observation.noise_Pa)))
    refuse("a noise of 0 Pa or more", quantity_text(observation.noise_Pa, "Pa"));
}

// Puts an observation's nodes together; `verdict` and reasons go to the estimate where it cannot be used.
class NodeChoice {
 public:
  NodeChoice(const Model& model, const Observation& observation, Estimate& estimate)
      : model_(model), observation_(observation), estimate_(estimate) {}

  std::optional<PressedNodes> run() {
    if (!block_known() || !choose_loads() || !choose_maps() || !choose_nodes()) return std::nullopt;
    fill_values();
    return std::move(nodes_);
  }

 private:
  bool end(Status verdict, const std::string& why) {
    estimate_.verdict = verdict;
    estimate_.reasons.push_back(why);
    return false;
  }

  bool block_known() {
    for (size_t axis = 0; axis < 2; ++axis)
      if (outside(observation_.block_mm[axis], {model_.block_mm[axis], model_.block_mm[axis]}))
        return end(Status::OutsideTraining,
                   "the block is " + quantity_text(observation_.block_mm[axis], "mm") +
                       " wide; the model knows " + quantity_text(model_.block_mm[axis], "mm"));
    if (outside(observation_.block_mm[2], model_.thickness_mm))
      return end(Status::OutsideTraining, "the tissue is " + quantity_text(observation_.block_mm[2], "mm") +
                                              " thick; the model knows " + range_text(model_.thickness_mm) +
                                              " mm");
    nodes_.thickness_mm = observation_.block_mm[2];
    return true;
  }

  // Those that are neither saturated nor outside of training.
  bool choose_loads() {
    // A window's edge that lies off the block is unseen at all loads; what only some loads miss is saturated.
    double always = 1;
    for (const PressureMap& map : observation_.pressure_Pa) always = std::min(always, unseen_fraction(map));
    bool saturated = false;
    const std::vector<double> loads = loads_of(observation_);
    for (size_t k = 0; k < loads.size(); ++k) {
      const double load = loads[k];
      const std::string name = "the load of " + quantity_text(observation_.force_N[k], "N");
      const double unseen = unseen_fraction(observation_.pressure_Pa[k]);
      if (unseen > always + kUnseenFraction) {
        saturated = true;
        nodes_.reasons.push_back(
            name + " is left out: " + text("%.3g %% of its values are saturated", 100 * (unseen - always)));
      } else if (outside(load, model_.load)) {
        nodes_.reasons.push_back(
            name +
            text(
                " is left out: over the block's area it is %.3g times the tissue's modulus; the model knows ",
                load) +
            range_text(model_.load) + " times");
      } else {
        used_.push_back(k);
        nodes_.loads.push_back(load);
      }
    }
    estimate_.reasons.insert(estimate_.reasons.end(), nodes_.reasons.begin(), nodes_.reasons.end());
    return !used_.empty() || end(saturated ? Status::Unusable : Status::OutsideTraining, "no load is left");
  }

  // The used loads' maps at the model's pitch, and the noise that their values have there.
  bool choose_maps() {
    noise_Pa_ = observation_.noise_Pa;
    const double pitch = observation_.pressure_Pa.front().pitch_mm[0];
    const bool fits =
        std::abs(pitch / model_.node_pitch_mm - 1) < 0.02 &&
        std::abs(observation_.pressure_Pa.front().pitch_mm[1] / model_.node_pitch_mm - 1) < 0.02;
    for (const size_t k : used_) {
      const PressureMap& map = observation_.pressure_Pa[k];
      maps_.push_back(fits ? map
                           : node_means(map, {0, 0},
                                        {map.width * map.pitch_mm[0], map.height * map.pitch_mm[1]},
                                        model_.node_pitch_mm));
    }
    if (fits) return true;
    if (pitch > 2 * model_.node_pitch_mm)
      return end(Status::Unusable, "nodes are " + quantity_text(pitch, "mm") + " apart; at most " +
                                       quantity_text(2 * model_.node_pitch_mm, "mm") + " serve");
    noise_Pa_ *= std::min(1.0, pitch / model_.node_pitch_mm);
    return true;
  }

  // Those that all loads saw, off the rim.
  bool choose_nodes() {
    const PressureMap& first = maps_.front();
    for (uint32_t j = 0; j < first.height; ++j)
      for (uint32_t i = 0; i < first.width; ++i) {
        const double x = observation_.window_mm[0] + (i - (first.width - 1) / 2.0) * first.pitch_mm[0];
        const double y = observation_.window_mm[1] + (j - (first.height - 1) / 2.0) * first.pitch_mm[1];
        if (std::abs(x) > observation_.block_mm[0] / 2 - kRim_mm + 1e-6 ||
            std::abs(y) > observation_.block_mm[1] / 2 - kRim_mm + 1e-6)
          continue;
        const size_t n = size_t{j} * first.width + i;
        if (!std::all_of(maps_.begin(), maps_.end(),
                         [n](const PressureMap& map) { return std::isfinite(map.values[n]); }))
          continue;
        seen_.push_back(n);
        nodes_.x_mm.push_back(x);
        nodes_.y_mm.push_back(y);
        peak_Pa_ = std::max(peak_Pa_, static_cast<double>(maps_.back().values[n]));
      }
    if (seen_.size() < kFewestNodes)
      return end(Status::Unusable, std::to_string(seen_.size()) + " nodes were seen; " +
                                       std::to_string(kFewestNodes) + " are needed");
    return peak_Pa_ > 0 || end(Status::Unusable, "no pressure at the highest load");
  }

  void fill_values() {
    const auto rows = static_cast<Eigen::Index>(seen_.size()), cols = static_cast<Eigen::Index>(used_.size());
    nodes_.total.resize(rows, cols);
    nodes_.rest.resize(rows, cols);
    for (Eigen::Index k = 0; k < cols; ++k) {
      const Eigen::VectorXf quarter =
          model_.base.quarter(nodes_.thickness_mm, nodes_.loads[static_cast<size_t>(k)]);
      for (Eigen::Index n = 0; n < rows; ++n) {
        const auto i = static_cast<size_t>(n);
        nodes_.total(n, k) =
            static_cast<double>(maps_[static_cast<size_t>(k)].values[seen_[i]]) / observation_.young_Pa;
        nodes_.rest(n, k) = nodes_.total(n, k) - model_.base.at(quarter, nodes_.x_mm[i], nodes_.y_mm[i]);
      }
    }
    double rough_Pa = 0;
    for (const PressureMap& map : maps_) rough_Pa += roughness(map) / static_cast<double>(maps_.size());
    nodes_.noise_fraction = std::max({noise_Pa_ / peak_Pa_, rough_Pa / peak_Pa_, kLeastNoise});
    nodes_.peak = peak_Pa_ / observation_.young_Pa;
    nodes_.noise = nodes_.noise_fraction * nodes_.peak;
  }

  const Model& model_;
  const Observation& observation_;
  Estimate& estimate_;
  PressedNodes nodes_;
  std::vector<size_t> used_;       // loads
  std::vector<PressureMap> maps_;  // of those
  std::vector<size_t> seen_;       // nodes of the maps
  double noise_Pa_ = 0, peak_Pa_ = 0;
};

}  // namespace

std::optional<PressedNodes> pressed_nodes(const Model& model, const Observation& observation,
                                          Estimate& estimate) {
  check(observation);
  return NodeChoice(model, observation, estimate).run();
}

std::array<double, 2> find_bump(const Model& model, const PressedNodes& nodes) {
  const double pitch = model.node_pitch_mm, reach = model.offset_mm + 2;
  const auto half = static_cast<int>(std::ceil((std::max(model.block_mm[0], model.block_mm[1]) / 2) / pitch));
  const int side = 2 * half + 1;
  std::vector<double> sum(static_cast<size_t>(side) * static_cast<size_t>(side)), weight(sum.size());
  const auto at = [&](int i, int j) {
    return static_cast<size_t>(j) * static_cast<size_t>(side) + static_cast<size_t>(i);
  };
  for (size_t n = 0; n < nodes.x_mm.size(); ++n) {
    const int i = static_cast<int>(std::lround(nodes.x_mm[n] / pitch)) + half,
              j = static_cast<int>(std::lround(nodes.y_mm[n] / pitch)) + half;
    if (i < 0 || j < 0 || i >= side || j >= side) continue;
    double value = 0;
    for (size_t k = 0; k < nodes.loads.size(); ++k)
      value += nodes.loads[k] * nodes.rest(static_cast<Eigen::Index>(n), static_cast<Eigen::Index>(k));
    sum[at(i, j)] += value;
    weight[at(i, j)] += 1;
  }
  const int taps = static_cast<int>(std::ceil(2.5 * kFind_mm / pitch));
  std::vector<double> gauss(static_cast<size_t>(taps) + 1);
  for (int t = 0; t <= taps; ++t)
    gauss[static_cast<size_t>(t)] = std::exp(-0.5 * std::pow(t * pitch / kFind_mm, 2));
  const auto smooth = [&](std::vector<double>& values, bool along_x) {
    std::vector<double> out(values.size());
    for (int j = 0; j < side; ++j)
      for (int i = 0; i < side; ++i) {
        double s = 0;
        for (int t = -taps; t <= taps; ++t) {
          const int a = along_x ? i + t : i, b = along_x ? j : j + t;
          if (a >= 0 && b >= 0 && a < side && b < side)
            s += gauss[static_cast<size_t>(std::abs(t))] * values[at(a, b)];
        }
        out[at(i, j)] = s;
      }
    values.swap(out);
  };
  for (std::vector<double>* values : {&sum, &weight}) {
    smooth(*values, true);
    smooth(*values, false);
  }
  const double least_weight = 0.4 * *std::max_element(weight.begin(), weight.end());
  double highest = -std::numeric_limits<double>::infinity();
  std::array<double, 2> place{};
  for (int pass = 0; pass < 2; ++pass) {
    double mass = 0;
    std::array<double, 2> moment{};
    const std::array<double, 2> peak = place;
    for (int j = 0; j < side; ++j)
      for (int i = 0; i < side; ++i) {
        const double x = (i - half) * pitch, y = (j - half) * pitch;
        if (weight[at(i, j)] < least_weight || (pass == 0 && (std::abs(x) > reach || std::abs(y) > reach)))
          continue;
        const double value = sum[at(i, j)] / weight[at(i, j)];
        if (pass == 0) {
          if (value > highest) {
            highest = value;
            place = {x, y};
          }
        } else if (value > 0.6 * highest && std::hypot(x - peak[0], y - peak[1]) < 11) {
          // Long and flat bumps have no sharp top: the middle of their upper part.
          const double w = value - 0.6 * highest;
          mass += w;
          moment[0] += w * x;
          moment[1] += w * y;
        }
      }
    if (pass == 1 && mass > 0)
      place = {std::clamp(moment[0] / mass, -reach, reach), std::clamp(moment[1] / mass, -reach, reach)};
  }
  return place;
}

PatchView::PatchView(const Model& model, const PressedNodes& nodes, std::array<double, 2> place_mm, bool swap)
    : center_mm(place_mm),
      swapped(swap),
      sign_x_(place_mm[0] < 0 ? -1 : 1),
      sign_y_(place_mm[1] < 0 ? -1 : 1) {
  setting.thickness_mm = nodes.thickness_mm;
  setting.cell_mm = model.cell_mm;
  setting.x_mm = std::min(std::abs(place_mm[swap ? 1 : 0]), model.offset_mm);
  setting.y_mm = std::min(std::abs(place_mm[swap ? 0 : 1]), model.offset_mm);
}

std::array<double, 2> PatchView::to_patch(double x_mm, double y_mm) const {
  const double u = sign_x_ * (x_mm - center_mm[0]), v = sign_y_ * (y_mm - center_mm[1]);
  return swapped ? std::array{v, u} : std::array{u, v};
}

std::array<double, 2> PatchView::to_block(double u_mm, double v_mm) const {
  if (swapped) std::swap(u_mm, v_mm);
  return {sign_x_ * u_mm, sign_y_ * v_mm};
}

std::array<double, 2> PatchView::place_mm(double u_mm, double v_mm) const {
  const auto move = to_block(u_mm, v_mm);
  return {center_mm[0] + move[0], center_mm[1] + move[1]};
}

void add_bump(const Model& model, const PatchView& view, const Eigen::MatrixXd& factors,
              PressedNodes& nodes) {
  const double reach = model.patch.reach_mm() + 1e-6;
  Eigen::VectorXf fields(model.patch.count());
  for (size_t n = 0; n < nodes.x_mm.size(); ++n) {
    const auto [u, v] = view.to_patch(nodes.x_mm[n], nodes.y_mm[n]);
    if (std::abs(u) > reach || std::abs(v) > reach) continue;
    model.patch.at(u, v, fields.data());
    nodes.rest.row(static_cast<Eigen::Index>(n)) += fields.cast<double>().transpose() * factors;
  }
}

PatchSums sum_patch(const Patch& patch, const PressedNodes& nodes, const PatchView& view) {
  const double reach = patch.reach_mm() + 1e-6;
  std::vector<Eigen::Index> inside;
  Eigen::MatrixXf fields(patch.count(), static_cast<Eigen::Index>(nodes.x_mm.size()));
  for (size_t n = 0; n < nodes.x_mm.size(); ++n) {
    const auto [u, v] = view.to_patch(nodes.x_mm[n], nodes.y_mm[n]);
    if (std::abs(u) > reach || std::abs(v) > reach) continue;
    patch.at(u, v, fields.col(static_cast<Eigen::Index>(inside.size())).data());
    inside.push_back(static_cast<Eigen::Index>(n));
  }
  PatchSums sums;
  sums.nodes = static_cast<Eigen::Index>(inside.size());
  const Eigen::MatrixXd rest = nodes.rest(inside, Eigen::all), total = nodes.total(inside, Eigen::all);
  fields.conservativeResize(Eigen::NoChange, sums.nodes);
  Eigen::MatrixXf gram = Eigen::MatrixXf::Zero(patch.count(), patch.count());
  dense::add_square(gram, fields);
  sums.gram = dense::from_lower(gram).cast<double>();
  sums.right = dense::product(fields, rest.cast<float>()).cast<double>();
  sums.total = dense::product(fields, total.cast<float>()).cast<double>();
  sums.rest_squares = rest.squaredNorm();
  return sums;
}

PatchErrors::PatchErrors(const Model& model, const PressedNodes& nodes, const PatchSums& sums,
                         double gauge_fraction)
    : noise_(nodes.noise) {
  const Eigen::Index count = sums.gram.rows(), loads = sums.right.cols();
  // Fields that the window cuts off are hardly seen; a trace of weight keeps the factors finite.
  Eigen::MatrixXd gram = sums.gram;
  gram.diagonal().array() += 1e-4 * gram.diagonal().maxCoeff();
  lower_ = dense::Cholesky(gram).lower();
  observation_ = of_right(sums.right);
  const Eigen::MatrixXd seen = observation_.reshaped(count, loads);

  // The network's error grows with the bump and is much alike at all loads.
  Eigen::VectorXd size(loads), share(loads);
  for (Eigen::Index k = 0; k < loads; ++k) {
    size(k) =
        std::sqrt(std::max(0.0, seen.col(k).squaredNorm() - static_cast<double>(count) * noise_ * noise_));
    share(k) = nodes.loads[static_cast<size_t>(k)] / nodes.loads.back();
  }
  // size is measured in the sums' weights: per unit of the patch's own.
  const double per_area = static_cast<double>(count) / std::max(1e-12, sums.gram.trace());
  const Eigen::MatrixXd error =
      dense::product(dense::product_tn(lower_, model.discrepancy), lower_) * per_area;
  // A white pattern counts as noise does, one value a node.
  Eigen::MatrixXd pattern = dense::product(dense::product_tn(lower_, model.patch.smooth_pattern), lower_);
  pattern.diagonal().array() += 1;
  plain_.resize(count * loads, count * loads);
  pattern_.resize(count * loads, count * loads);
  for (Eigen::Index k = 0; k < loads; ++k)
    for (Eigen::Index l = 0; l < loads; ++l) {
      const double alike = k == l ? 1 : model.load_correlation;
      plain_.block(k * count, l * count, count, count) = alike * size(k) * size(l) * error;
      const double fixed = 0.5 * (1 + share(k) * share(l)) + (k == l ? kLoadPattern : 0);
      pattern_.block(k * count, l * count, count, count) = fixed * pattern;
    }
  plain_.diagonal().array() += noise_ * noise_;
  // Errors of the gauge scale a load's whole pressure; one of the tissue's modulus scales all loads alike.
  const Eigen::MatrixXd whole = dense::solve_lower(lower_, sums.total);
  gauge_ = Eigen::MatrixXd::Zero(count * loads, loads + 1);
  for (Eigen::Index k = 0; k < loads; ++k)
    gauge_.col(k).segment(k * count, count) = gauge_fraction * whole.col(k);
  gauge_.col(loads) = kModulusFraction * whole.reshaped();
  dense::add_square(plain_, gauge_);
  plain_ = dense::from_lower(plain_);
  const double freedom = static_cast<double>((sums.nodes - count) * loads);
  rest_ =
      freedom > 0 ? std::max(0.0, sums.rest_squares - seen.squaredNorm()) / (noise_ * noise_ * freedom) : 1;
}

Eigen::VectorXd PatchErrors::of_factors(const Eigen::MatrixXd& factors) const {
  return dense::product_tn(lower_, factors).reshaped();
}

Eigen::VectorXd PatchErrors::of_right(const Eigen::MatrixXd& right) const {
  return dense::solve_lower(lower_, right).reshaped();
}

Eigen::MatrixXd PatchErrors::covariance(double pattern) const {
  return plain_ + pattern * pattern * pattern_;
}

Eigen::MatrixXd PatchErrors::of_one_press() const {
  Eigen::MatrixXd own = Eigen::MatrixXd::Zero(plain_.rows(), plain_.cols());
  own.diagonal().setConstant(noise_ * noise_);
  dense::add_square(own, gauge_.leftCols(gauge_.cols() - 1));
  return dense::from_lower(own);
}

PatternCovariance::PatternCovariance(const Eigen::MatrixXd& covariance, double pattern_fraction)
    : root_(covariance) {
  const double beyond = std::max(0.0, std::log(pattern_fraction / kLargestPattern));
  cost_ = 2 * root_.lower().diagonal().array().log().sum() + kPatternCost * beyond * beyond;
}

Eigen::RowVectorXd PatternCovariance::squares(const Eigen::MatrixXd& numbers) const {
  return root_.solve_lower(numbers).colwise().squaredNorm();
}

PatternSize pattern_size(const std::array<double, kPatterns.size()>& energy, double peak) {
  const double least = *std::min_element(energy.begin(), energy.end());
  double sum = 0, logs = 0;
  for (size_t p = 0; p < energy.size(); ++p) {
    const double weight = std::exp(-0.5 * (energy[p] - least));
    sum += weight;
    logs += weight * std::log(kPatterns[p]);
  }
  return {peak * std::exp(logs / sum), least};
}

std::vector<PatternSize> pattern_sizes(const PatchErrors& errors, const PressedNodes& nodes,
                                       const Eigen::MatrixXd& remainders) {
  const Eigen::Index count = remainders.cols();
  Eigen::MatrixXd energy(static_cast<Eigen::Index>(kPatterns.size()), count);
  for (size_t p = 0; p < kPatterns.size(); ++p) {
    const PatternCovariance at(errors, nodes.peak, kPatterns[p]);
    energy.row(static_cast<Eigen::Index>(p)) = at.squares(remainders).array() + at.cost();
  }
  std::vector<PatternSize> sizes;
  for (Eigen::Index c = 0; c < count; ++c) {
    std::array<double, kPatterns.size()> of{};
    for (size_t p = 0; p < of.size(); ++p) of[p] = energy(static_cast<Eigen::Index>(p), c);
    sizes.push_back(pattern_size(of, nodes.peak));
  }
  return sizes;
}

PatchWhitener::PatchWhitener(const PatchErrors& errors, double pattern) {
  const Eigen::MatrixXd covariance = errors.covariance(pattern);
  root_inverse_ = dense::Cholesky(covariance)
                      .solve_lower(Eigen::MatrixXd::Identity(covariance.rows(), covariance.cols()));
}

Eigen::VectorXd PatchWhitener::of(const Eigen::VectorXd& numbers) const {
  return dense::lower_times(root_inverse_, numbers);
}

Eigen::MatrixXd PatchWhitener::of_covariance(const Eigen::MatrixXd& numbers) const {
  return dense::product(root_inverse_, dense::product(numbers, root_inverse_.transpose()));
}

}  // namespace palpate::lump
