#include "engine/lump/direct_inversion.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>

#include "engine/error.h"
#include "engine/lump/profile.h"
#include "engine/median.h"

namespace palpate {
namespace {

constexpr double kNinetyPercent = 1.645;  // standard deviations to either side
constexpr double kChance = 15.09;         // chi2 of five unknowns that chance reaches in 1 % of readings
constexpr size_t kFewestValues = 60;      // of a load
constexpr double kMostSaturated = 0.02;
constexpr uint32_t kMostInVain = 3;
constexpr uint32_t kMostCorrections = 4;
constexpr double kStands = 0.2;  // standard deviations that count as none
constexpr double kFits = 1.2;    // chi2 of a value, of a reading that the lump explains
constexpr double kNoGain = 0.3;  // of chi2, before the finer grids are asked again
constexpr double kHeaviest = 1e3;
// By how much elements misplace a lump's faces, shares of the finer cells' sides; more where a box of cells
// becomes an upright cylinder, whose edges bend them most. Found on blocks that other cells had pressed.
constexpr double kFaceDoubt = 0.06, kUprightDoubt = 0.1;
constexpr double kUprightRatioDoubt = 0.06;  // of the logarithm
constexpr double kRival = 0.1;    // likelihood beside the best shape's from which on a shape counts
constexpr double kGridDoubt = 2;  // standard deviations of the change that fewer grids would make
// Of Gaussians that the elements' errors are sums of.
constexpr double kDoubtPitch_mm = 4, kDoubtSigma_mm = 3;
using Unknowns = Eigen::Matrix<double, kLumpUnknowns, 1>;
const Unknowns kLongestStep{{0.3, 0.4, 1.0, 2.0, 2.0}};

void check(const LumpReading& reading) {
  const auto refuse = [](const char* wanted, const std::string& found) {
    throw Error(Failure::Usage, wanted, found, "a reading as the sensor makes it");
  };
  if (reading.pressure_Pa.empty() || reading.pressure_Pa.size() != reading.force_N.size())
    refuse("one pressure map for each force", std::to_string(reading.pressure_Pa.size()) + " maps and " +
                                                  std::to_string(reading.force_N.size()) + " forces");
  for (const ForwardMap& map : reading.pressure_Pa)
    if (map.width != reading.pressure_Pa[0].width || map.height != reading.pressure_Pa[0].height ||
        map.values.size() != size_t{map.width} * map.height)
      refuse("maps of one size", "others");
  double last = 0;
  for (const double force : reading.force_N) {
    if (!(force > last)) refuse("forces that rise from above zero", std::to_string(force) + " N");
    last = force;
  }
  if (!(reading.noise_Pa >= 0)) refuse("noise of 0 Pa or more", std::to_string(reading.noise_Pa));
}

void check(const LumpResponseOptions& model) {
  uint32_t last = 0;
  for (const uint32_t times : model.grids) {
    if (times <= last || times > 8)
      throw Error(Failure::Usage, "grids of rising multiples of the cells, from 1 to 8",
                  std::to_string(times) + " after " + std::to_string(last), "1, 2, 3");
    last = times;
  }
  if (std::find(model.grids.begin(), model.grids.end(), model.searched) == model.grids.end())
    throw Error(Failure::Usage, "a grid to search on that is one of the grids",
                std::to_string(model.searched), "2 of 1, 2, 3");
}

/// Gaussians over the nodes, on a grid, scaled so that factors of unit variance make unit variance
/// everywhere; last what is the same everywhere.
Eigen::MatrixXd doubt_fields(const ComparedNodes& nodes) {
  std::array<double, 2> low = {HUGE_VAL, HUGE_VAL}, high = {-HUGE_VAL, -HUGE_VAL};
  for (size_t n = 0; n < nodes.count(); ++n) {
    const std::array<double, 2> at = {nodes.x_mm(n), nodes.y_mm(n)};
    for (size_t c = 0; c < 2; ++c) low[c] = std::min(low[c], at[c]), high[c] = std::max(high[c], at[c]);
  }
  std::vector<std::array<double, 2>> centres;
  for (double y = low[1]; y <= high[1] + kDoubtPitch_mm; y += kDoubtPitch_mm)
    for (double x = low[0]; x <= high[0] + kDoubtPitch_mm; x += kDoubtPitch_mm) centres.push_back({x, y});
  const auto gaussians = static_cast<Eigen::Index>(centres.size());
  Eigen::MatrixXd fields = Eigen::MatrixXd::Ones(static_cast<Eigen::Index>(nodes.count()), gaussians + 1);
  for (Eigen::Index n = 0; n < fields.rows(); ++n) {
    const auto node = static_cast<size_t>(n);
    for (Eigen::Index k = 0; k < gaussians; ++k) {
      const auto& [x, y] = centres[static_cast<size_t>(k)];
      fields(n, k) = std::exp(-0.5 * (std::pow(nodes.x_mm(node) - x, 2) + std::pow(nodes.y_mm(node) - y, 2)) /
                              (kDoubtSigma_mm * kDoubtSigma_mm));
    }
    fields.row(n).head(gaussians).normalize();
  }
  return fields;
}

class Search {
 public:
  Search(const LumpReading& reading, const DirectInversionOptions& options)
      : reading_(reading),
        options_(options),
        nodes_(reading, options.model.rim_mm),
        wanted_(nodes_.values()),
        doubt_(nodes_.count() > 0 ? doubt_fields(nodes_) : Eigen::MatrixXd()) {
    const double peak = wanted_.size() > 0 ? wanted_.maxCoeff() : 0;
    sigma_Pa_ = std::hypot(reading.noise_Pa, options.model_share * peak);
  }
  size_t values() const { return nodes_.count(); }

  struct State {
    LumpCase::Lump lump;
    LumpCells cells;
    LumpPrediction prediction;
    double chi2 = HUGE_VAL;  ///< with the forces and the modulus that suit it best
  };

  /// In cells that follow other lumps too, so that states compare, and under the last correction.
  std::optional<State> at(const LumpCase::Lump& lump, const LumpCells& cells) const {
    State state{lump, cells, predict(nodes_, FittedLump{lump, cells}, options_.model, true), 0};
    if (!state.prediction.converged) return std::nullopt;
    state.prediction.pressure_Pa += correction_.add_Pa;
    state.chi2 = solve(state.prediction, 0, false).chi2;
    return state;
  }

  /// In cells of its own, with what a finer grid says there; both go on to the states after it.
  std::optional<State> corrected_at(const LumpCase::Lump& lump) {
    const LumpCells cells = response_cells(reading_, lump, options_.model);
    GridCorrection now = grid_correction(nodes_, FittedLump{lump, cells}, options_.model);
    if (!now.converged) return std::nullopt;
    std::swap(now, correction_);
    std::optional<State> state = at(lump, cells);
    if (!state) std::swap(now, correction_);
    return state;
  }
  /// Whether that gave the state new numbers.
  bool correct(State& state) {
    GridCorrection now = grid_correction(nodes_, FittedLump{state.lump, state.cells}, options_.model);
    if (!now.converged) return false;
    state.prediction.pressure_Pa += now.add_Pa - correction_.add_Pa;
    correction_ = std::move(now);
    state.chi2 = solve(state.prediction, 0, false).chi2;
    return true;
  }
  bool suits(const State& state) const { return suit(state.cells, reading_, state.lump, options_.model); }

  /// chi2 of tissue alone, on which forces and modulus act as they do with a lump, nearly.
  std::optional<double> without_lump(LumpPrediction with_lump) {
    if (tissue_Pa_.size() == 0) {
      const LumpPrediction tissue = predict(nodes_, std::nullopt, options_.model, false);
      if (!tissue.converged) return std::nullopt;
      const GridCorrection grids = grid_correction(nodes_, std::nullopt, options_.model);
      if (!grids.converged) return std::nullopt;
      tissue_Pa_ = tissue.pressure_Pa + grids.add_Pa;
    }
    with_lump.pressure_Pa = tissue_Pa_;
    return solve(with_lump, 0, false).chi2;
  }

  struct Step {
    Unknowns change = Unknowns::Zero();
    Unknowns sd = Unknowns::Zero();        ///< of noise
    Unknowns by_grids = Unknowns::Zero();  ///< change by what the grids leave open
    double chi2 = 0;                       ///< of the linear model after the step
  };
  /// The best step of the unknowns (none: of the forces and the modulus alone) from a prediction.
  Step solve(const LumpPrediction& p, double damping, bool unknowns) const {
    const Eigen::Index first = !unknowns                ? 0
                               : options_.model.centred ? kPlaceX
                                                        : kLumpUnknowns,
                       loads = p.by_force.cols(), doubts = first + loads + 1,
                       columns = doubts + 2 * doubt_.cols();
    Eigen::MatrixXd j(p.pressure_Pa.size(), columns);
    j.leftCols(first) = p.by_unknown.leftCols(first);
    j.middleCols(first, loads) = p.by_force;
    j.col(doubts - 1) = p.by_modulus;
    j.rightCols(2 * doubt_.cols()) = doubted(p.pressure_Pa);
    j /= sigma_Pa_;
    const Eigen::VectorXd open = (wanted_ - p.pressure_Pa) / sigma_Pa_;
    Eigen::MatrixXd normal = j.transpose() * j;
    for (Eigen::Index l = 0; l < loads; ++l)
      normal(first + l, first + l) += 1 / (options_.gauge_share * options_.gauge_share);
    normal(doubts - 1, doubts - 1) += 1 / (options_.young_share * options_.young_share);
    normal.diagonal().tail(2 * doubt_.cols()).array() += 1;
    Step step;
    Eigen::MatrixXd damped = normal;
    for (Eigen::Index k = 0; k < first; ++k) damped(k, k) *= 1 + damping;
    const Eigen::VectorXd right = j.transpose() * open;
    const Eigen::VectorXd found = damped.ldlt().solve(right);
    step.chi2 = open.squaredNorm() - 2 * found.dot(right) + found.dot(normal * found);
    if (unknowns) {
      step.change.head(first) = found.head(first);
      const Eigen::MatrixXd covariance = normal.ldlt().solve(Eigen::MatrixXd::Identity(columns, columns));
      step.by_grids.head(first) =
          covariance.topRows(first) * (j.transpose() * correction_.open_Pa) / -sigma_Pa_;
      step.sd.head(first) = covariance.diagonal().head(first).cwiseMax(0).cwiseSqrt();
    }
    return step;
  }

  /// A lump that the block can hold.
  LumpCase::Lump moved(const LumpCase::Lump& from, const Unknowns& by) const {
    LumpCase::Lump lump = from;
    const double thickness = reading_.block_mm[2];
    lump.diameter_mm = std::clamp(from.diameter_mm * std::exp(by(kLnSize)), 1.0, 0.8 * thickness);
    lump.depth_mm =
        std::clamp(from.depth_mm * std::exp(by(kLnDepth)), 0.3, 0.97 * thickness - lump.diameter_mm);
    lump.stiffness_ratio = std::clamp(from.stiffness_ratio * std::exp(by(kLnRatio)), 0.02, 1000.0);
    const std::array<double, 3> size = lump.size_mm();
    for (size_t c = 0; c < 2; ++c) {
      const double room = std::max(0.0, 0.98 * (reading_.block_mm[c] - size[c]) / 2);
      lump.offset_mm[c] =
          std::clamp(from.offset_mm[c] + by(kPlaceX + static_cast<Eigen::Index>(c)), -room, room);
    }
    return lump;
  }

 private:
  /// What a prediction may be off by, per factor of unit variance.
  Eigen::MatrixXd doubted(const Eigen::VectorXd& pressure_Pa) const {
    const Eigen::Index count = doubt_.rows(), fields = doubt_.cols();
    Eigen::MatrixXd by_factor(pressure_Pa.size(), 2 * fields);
    const std::vector<double>& force_N = reading_.force_N;
    for (Eigen::Index l = 0; l < static_cast<Eigen::Index>(force_N.size()); ++l) {
      const auto of_load = pressure_Pa.segment(l * count, count);
      const Eigen::ArrayXd bump =
          of_load.array() - median(std::vector<double>(of_load.begin(), of_load.end()));
      const double change = force_N[static_cast<size_t>(l)] / force_N.back() - 0.5;
      by_factor.block(l * count, 0, count, fields) =
          options_.bump_share * (doubt_.array().colwise() * bump).matrix();
      by_factor.block(l * count, fields, count, fields) =
          options_.bump_change_share * change * (doubt_.array().colwise() * bump).matrix();
    }
    return by_factor;
  }

  const LumpReading& reading_;
  const DirectInversionOptions& options_;
  ComparedNodes nodes_;
  Eigen::VectorXd wanted_;
  Eigen::MatrixXd doubt_;      ///< nodes x fields
  Eigen::VectorXd tissue_Pa_;  ///< of tissue alone, once it was asked for
  double sigma_Pa_ = 1;
  GridCorrection correction_;
};

LumpCase::Lump first_guess(const LumpReading& reading) {
  LumpCase::Lump lump;
  lump.diameter_mm = 0.4 * reading.block_mm[2];
  lump.depth_mm = 0.25 * reading.block_mm[2];
  lump.stiffness_ratio = 6;
  ForwardMap map = reading.pressure_Pa.back();
  double sum = 0, seen = 0;
  for (const float value : map.values)
    if (std::isfinite(value)) {
      sum += double{value};
      seen += 1;
    }
  for (float& value : map.values)
    if (!std::isfinite(value)) value = static_cast<float>(sum / std::max(seen, 1.0));
  const std::array<double, 2> bump = bump_center_mm(map, 0.7);
  lump.offset_mm = {reading.window_mm[0] + bump[0], reading.window_mm[1] + bump[1]};
  return lump;
}

LumpValue in_logarithm(double value, double sd) {
  return {value, value * std::exp(-kNinetyPercent * sd), value * std::exp(kNinetyPercent * sd)};
}
LumpValue plain(double value, double sd) {
  return {value, value - kNinetyPercent * sd, value + kNinetyPercent * sd};
}

/// From one lump to another.
Unknowns difference(const LumpCase::Lump& to, const LumpCase::Lump& from) {
  return Unknowns{{std::log(to.diameter_mm / from.diameter_mm), std::log(to.depth_mm / from.depth_mm),
                   std::log(to.stiffness_ratio / from.stiffness_ratio), to.offset_mm[0] - from.offset_mm[0],
                   to.offset_mm[1] - from.offset_mm[1]}};
}

/// Moves the state to the best one under the search's correction; false where `rounds` ran out before.
bool descend(Search& search, Search::State& best, uint32_t& rounds) {
  double damping = 5e-3;
  uint32_t in_vain = 0;  // rounds in a row
  const auto values = static_cast<double>(best.prediction.pressure_Pa.size());
  for (; rounds > 0; --rounds) {
    const Search::Step step = search.solve(best.prediction, damping, true);
    const double shorten = std::max(1.0, (step.change.cwiseAbs().cwiseQuotient(kLongestStep)).maxCoeff());
    const Unknowns change = step.change / shorten;
    const bool fits = best.chi2 < kFits * values;
    if ((fits && best.chi2 - step.chi2 < kNoGain) ||
        (change.cwiseAbs() - kStands * step.sd).maxCoeff() <= 0 || change.cwiseAbs().maxCoeff() < 2e-3)
      return true;
    std::optional<Search::State> next = search.at(search.moved(best.lump, change), best.cells);
    if (next && next->chi2 < best.chi2) {
      const bool settled = best.chi2 - next->chi2 < 0.05;
      best = std::move(*next);
      if (!search.suits(best))
        if (std::optional<Search::State> fresh = search.corrected_at(best.lump)) best = std::move(*fresh);
      if (settled) return true;
      in_vain = 0;
      damping = std::max(damping / 4, 1e-6);
    } else {
      damping *= 6;
      if ((++in_vain >= kMostInVain && fits) || damping > kHeaviest) return fits;
    }
  }
  return false;
}

/// One start's answer.
struct Answer {
  LumpEstimate estimate;
  double chi2 = HUGE_VAL;
};

Answer invert_from(const LumpCase::Lump& start, Search& search, const LumpReading& reading,
                   const DirectInversionOptions& options) {
  Answer answer;
  LumpEstimate& estimate = answer.estimate;
  estimate.method = "direct inversion";
  estimate.false_alarm_rate = 0.01;
  const auto done = [&](LumpVerdict verdict, const std::string& reason) {
    estimate.verdict = verdict;
    if (!reason.empty()) estimate.reasons.push_back(reason);
    return answer;
  };
  if (search.values() < kFewestValues)
    return done(LumpVerdict::Unusable,
                "only " + std::to_string(search.values()) + " places were seen at every load");
  if (reading.saturated_share > kMostSaturated)
    return done(LumpVerdict::Unusable, "the sensor is saturated at the highest load: press less");

  LumpCase::Lump guess = start;
  if (options.model.centred) guess.offset_mm = {0, 0};
  std::optional<Search::State> best = search.corrected_at(search.moved(guess, Unknowns::Zero()));
  if (!best) return done(LumpVerdict::Unusable, "the model found no equilibrium at these forces");
  uint32_t rounds = options.most_rounds;
  bool settled = descend(search, *best, rounds);
  for (uint32_t again = 0; again < kMostCorrections && settled; ++again) {
    const LumpCase::Lump from = best->lump;
    if (!search.correct(*best)) break;
    settled = descend(search, *best, rounds);
    const Unknowns sd = search.solve(best->prediction, 0, true).sd;
    if ((difference(best->lump, from).cwiseAbs() - kStands * sd).maxCoeff() <= 0) break;
  }
  const Search::Step end = search.solve(best->prediction, 0, true);
  const double values = static_cast<double>(search.values() * reading.force_N.size());
  const double misfit = best->chi2 / std::max(1.0, values - double{kLumpUnknowns});
  const LumpCase::Lump& lump = best->lump;
  answer.chi2 = best->chi2;
  // Noise, more of it where the reading fits worse, and what the grids leave open.
  Unknowns sd =
      (end.sd.array().square() * std::max(1.0, misfit) + (kGridDoubt * end.by_grids.array()).square()).sqrt();
  const double finest_mm = reading.block_mm[0] / (options.model.cells[0] * options.model.grids.back());
  const double faces_mm = (lump.shape == LumpShape::Cylinder ? kUprightDoubt : kFaceDoubt) * finest_mm;
  sd(kLnSize) = std::hypot(sd(kLnSize), faces_mm / lump.diameter_mm);
  sd(kLnDepth) = std::hypot(sd(kLnDepth), faces_mm / lump.depth_mm);
  if (lump.shape == LumpShape::Cylinder) sd(kLnRatio) = std::hypot(sd(kLnRatio), kUprightRatioDoubt);
  estimate.size_mm = in_logarithm(lump.diameter_mm, sd(kLnSize));
  estimate.depth_mm = in_logarithm(lump.depth_mm, sd(kLnDepth));
  estimate.stiffness_ratio = in_logarithm(lump.stiffness_ratio, sd(kLnRatio));
  estimate.x_mm = plain(lump.offset_mm[0], sd(kPlaceX));
  estimate.y_mm = plain(lump.offset_mm[1], sd(kPlaceY));
  estimate.shape = lump.shape;
  estimate.shape_probability[static_cast<size_t>(lump.shape)] = 1;

  char line[200];
  const std::optional<double> nothing = search.without_lump(std::move(best->prediction));
  if (nothing) estimate.evidence = std::max(0.0, *nothing - best->chi2) / (kChance * std::max(1.0, misfit));
  if (estimate.evidence < 1) return done(LumpVerdict::NoLump, "tissue alone answers as well, but for chance");
  if (!settled) {
    std::snprintf(line, sizeof line, "the search did not end in %u rounds: the values are where it stood",
                  options.most_rounds);
    return done(LumpVerdict::Unusable, line);
  }
  if (misfit > 4) {
    std::snprintf(
        line, sizeof line,
        "the best lump misses the reading by %.1f times its noise: not a lump of this shape in such "
        "tissue",
        std::sqrt(misfit));
    return done(LumpVerdict::OutsideTraining, line);
  }
  return done(LumpVerdict::Found, "");
}

}  // namespace

LumpEstimate invert_directly(const LumpReading& reading, const DirectInversionOptions& options) {
  check(reading);
  check(options.model);
  const auto begin = std::chrono::steady_clock::now();
  std::vector<DirectInversionOptions::Start> starts = options.starts;
  if (starts.empty()) starts.push_back({first_guess(reading), 1});
  Search search(reading, options);
  std::vector<Answer> answers;
  for (const DirectInversionOptions::Start& start : starts) {
    answers.push_back(invert_from(start.lump, search, reading, options));
    answers.back().chi2 -= 2 * std::log(std::max(start.odds, 1e-300));
  }
  // A search that did not end is no rival of one that did.
  const auto better = [](const Answer& a, const Answer& b) {
    const bool tells = tells_numbers(a.estimate.verdict);
    return tells != tells_numbers(b.estimate.verdict) ? tells : a.chi2 < b.chi2;
  };
  const Answer& best = *std::min_element(answers.begin(), answers.end(), better);
  LumpEstimate estimate = best.estimate;
  if (tells_numbers(estimate.verdict)) {
    double sum = 1;
    for (const Answer& other : answers) {
      if (&other == &best || !tells_numbers(other.estimate.verdict)) continue;
      const double likely = std::exp(0.5 * (best.chi2 - other.chi2));
      sum += likely;
      estimate.shape_probability[static_cast<size_t>(other.estimate.shape)] += likely;
      if (likely < kRival) continue;
      widen(estimate.size_mm, other.estimate.size_mm);
      widen(estimate.depth_mm, other.estimate.depth_mm);
      widen(estimate.stiffness_ratio, other.estimate.stiffness_ratio);
      estimate.reasons.push_back(std::string("one of shape ") + to_string(other.estimate.shape) +
                                 " answers as well: intervals hold both");
    }
    for (double& probability : estimate.shape_probability) probability /= sum;
    open_wide_ratio(estimate);
  }
  estimate.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  return estimate;
}

}  // namespace palpate
