#include "engine/lump/fem_inverse/inversion.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "engine/base/normal.h"
#include "engine/base/text.h"
#include "engine/lump/fem_inverse/search.h"
#include "engine/lump/observation/gaussian_profile.h"
#include "palpate/error.h"

namespace palpate::lump {
namespace {

constexpr double kChance = 15.09;     // chi2 of five unknowns that chance reaches in 1 % of observations
constexpr size_t kFewestValues = 60;  // of a load
constexpr double kMostSaturated = 0.02;
// By how much elements misplace a lump's faces, shares of the finer cells' sides; more where a box of cells
// becomes an upright cylinder, whose edges bend them most. Found on blocks that other cells had pressed.
constexpr double kFaceDoubt = 0.06, kUprightDoubt = 0.1;
constexpr double kUprightRatioDoubt = 0.06, kLyingRatioDoubt = 0.04;  // of the logarithm
constexpr double kRivalLikelihood =
    0.1;  // likelihood relative to the best shape's from which on a shape counts
// Standard deviations of the ratio's logarithm, from which on the curvature at the best lump says too little
// of its likelihood further away.
constexpr double kCurved = 0.2;
// Detection statistic by the emulator up to which finite elements would not make it 1.
constexpr double kNearlyNothing = 0.6;
// chi2 above the best shape's from which on another is not followed: what the emulator expects of a shape may
// be off by much of it.
constexpr double kOutdone = 100;
constexpr const char* kSpent = "the finite elements reached their limit of work before the search converged";
constexpr uint32_t kMostBetter = 2;  // times that a better lump is found on the way along the ratios

void check_reading(const Observation& observation) {
  const auto refuse = [](const char* wanted, const std::string& found) {
    throw Error(Failure::Usage, wanted, found, "a reading as the sensor makes it");
  };
  if (observation.pressure_Pa.empty() || observation.pressure_Pa.size() != observation.force_N.size())
    refuse("one pressure map for each force", std::to_string(observation.pressure_Pa.size()) + " maps and " +
                                                  std::to_string(observation.force_N.size()) + " forces");
  for (const PressureMap& map : observation.pressure_Pa)
    if (map.width != observation.pressure_Pa[0].width || map.height != observation.pressure_Pa[0].height ||
        map.values.size() != size_t{map.width} * map.height)
      refuse("maps of one size", "others");
  double last = 0;
  for (const double force : observation.force_N) {
    if (!(force > last)) refuse("forces above zero in rising order", std::to_string(force) + " N");
    last = force;
  }
  if (!(observation.noise_Pa >= 0)) refuse("noise of 0 Pa or more", std::to_string(observation.noise_Pa));
}

void check(const ResponseOptions& model) {
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

Case::Lump first_guess(const Observation& observation) {
  Case::Lump lump;
  lump.diameter_mm = 0.4 * observation.block_mm[2];
  lump.depth_mm = 0.25 * observation.block_mm[2];
  lump.stiffness_ratio = 6;
  PressureMap map = observation.pressure_Pa.back();
  double sum = 0, seen = 0;
  for (const float value : map.values)
    if (std::isfinite(value)) {
      sum += double{value};
      seen += 1;
    }
  for (float& value : map.values)
    if (!std::isfinite(value)) value = static_cast<float>(sum / std::max(seen, 1.0));
  const std::array<double, 2> bump = bump_center_mm(map, 0.7);
  lump.offset_mm = {observation.window_mm[0] + bump[0], observation.window_mm[1] + bump[1]};
  return lump;
}

Value in_logarithm(double value, double sd) {
  return {value, value * std::exp(-kNormal90 * sd), value * std::exp(kNormal90 * sd)};
}
Value plain(double value, double sd) {
  return {value, value - kNormal90 * sd, value + kNormal90 * sd};
}

/// Standard deviations at the best lump.
struct Spread {
  LumpStep noise;  ///< of all that chi2 knows, more of it where the observation fits worse
  LumpStep cells;  ///< by how much cells misplace a lump's faces
};

/// One start's answer.
struct ShapeAnswer {
  Estimate estimate;
  std::optional<DirectSearch::State> best;
  Spread spread;
  double odds_chi2 = 0;  ///< what the start's odds are worth

  bool reports() const { return reports_numbers(estimate.verdict); }
  double chi2() const { return best ? best->chi2 + odds_chi2 : HUGE_VAL; }
};

Spread spread_at(const DirectSearch& search, const DirectSearch::State& best, double reduced_chi_square,
                 const Observation& observation, const ResponseOptions& model) {
  const DirectSearch::Step end = search.solve(best, 0, DirectSearch::Sought::Lump);
  Spread spread{end.sd * std::sqrt(std::max(1.0, reduced_chi_square)), LumpStep::Zero()};
  const Case::Lump& lump = best.lump;
  const bool upright = lump.shape == InclusionShape::Cylinder;
  const double finest_mm = observation.block_mm[0] / (model.cells[0] * model.grids.back());
  const double faces_mm = (upright ? kUprightDoubt : kFaceDoubt) * finest_mm;
  LumpStep& cells = spread.cells;
  cells(kLnSize) = faces_mm / lump.diameter_mm;
  cells(kLnDepth) = faces_mm / lump.depth_mm;
  if (upright) cells(kLnRatio) = kUprightRatioDoubt;
  if (lump.shape == InclusionShape::LyingCylinder) cells(kLnRatio) = kLyingRatioDoubt;
  return spread;
}

void take(const Case::Lump& lump, const Spread& spread, Estimate& into) {
  const LumpStep sd = (spread.noise.array().square() + spread.cells.array().square()).sqrt();
  into.size_mm = in_logarithm(lump.diameter_mm, sd(kLnSize));
  into.depth_mm = in_logarithm(lump.depth_mm, sd(kLnDepth));
  into.stiffness_ratio = in_logarithm(lump.stiffness_ratio, sd(kLnRatio));
  into.x_mm = plain(lump.offset_mm[0], sd(kPlaceX));
  into.y_mm = plain(lump.offset_mm[1], sd(kPlaceY));
  into.shape = lump.shape;
}

/// Intervals from the lumps at both ends of the likelihood along the ratio; those of size and depth hold
/// them.
void take_ends(const Case::Lump& lump, const std::array<Case::Lump, 2>& ends, const Spread& spread,
               Estimate& into) {
  const auto away = [&](const Case::Lump& end) {
    return std::exp(
        std::hypot(std::log(end.stiffness_ratio / lump.stiffness_ratio), kNormal90 * spread.cells(kLnRatio)));
  };
  into.stiffness_ratio.low = lump.stiffness_ratio / away(ends[0]);
  into.stiffness_ratio.high = lump.stiffness_ratio * away(ends[1]);
  for (const Case::Lump& end : ends) {
    widen(into.size_mm, {end.diameter_mm, end.diameter_mm, end.diameter_mm});
    widen(into.depth_mm, {end.depth_mm, end.depth_mm, end.depth_mm});
  }
}

class Inversion {
 public:
  Inversion(const Observation& observation, const DirectInversionOptions& options)
      : observation_(observation), options_(options), search_(observation, options) {}

  /// An answer without a lump where tissue alone by the elements leaves nothing that the emulator's best ball
  /// explains beyond chance; else, and without an emulator, none, and `start` is that ball.
  std::optional<ShapeAnswer> without_lump(DirectInversionOptions::Start& start) {
    ShapeAnswer answer = unanswered(start);
    if (!usable(answer)) return std::nullopt;
    std::optional<DirectSearch::Glimpse> glimpse = search_.glimpse(start.lump);
    if (!glimpse) return std::nullopt;
    start.lump = glimpse->best.lump;
    answer.best = std::move(glimpse->best);
    judge(answer, true);
    if (answer.estimate.detection_statistic > kNearlyNothing) return std::nullopt;
    return answer;
  }

  /// The best lump near a start, and what it is worth. chi2 above `most_chi2`, odds included, is not
  /// followed. `like`: another start's answer, null for none, which the first look at this one is corrected
  /// as.
  ShapeAnswer from(const DirectInversionOptions::Start& start, double most_chi2, const ShapeAnswer* like) {
    ShapeAnswer answer = unanswered(start);
    if (!usable(answer)) return answer;
    Case::Lump guess = start.lump;
    if (options_.model.centred) guess.offset_mm = {0, 0};
    if (guess.shape == InclusionShape::Ellipsoid || guess.shape == InclusionShape::LyingCylinder)
      guess.along_y = search_.lies_along_y(guess);
    answer.best = search_.state_at(search_.moved(guess, LumpStep::Zero()), like ? &*like->best : nullptr);
    if (answer.best)
      settle(answer, most_chi2);
    else
      summarise(answer, Status::Unusable,
                spent() ? kSpent : "the model found no equilibrium at these forces");
    return answer;
  }

  /// chi2 above an answer's from which on others are outdone.
  double outdone(const ShapeAnswer& by) const { return kOutdone * std::max(1.0, reduced_chi_square(by)); }

  bool spent() const { return search_.spent(); }

  /// Intervals from the likelihood along the ratio, where the curvature says too little of it.
  void follow_ratio(ShapeAnswer& answer) {
    for (uint32_t better = 0; answer.reports() && answer.spread.noise(kLnRatio) >= kCurved; ++better) {
      // Along the ratios all grids are asked everywhere, so here too: on a flat way the search stops early.
      if (!answer.best->emulated()) search_.correct(*answer.best);
      const double allowed = kNormal90 * kNormal90 * std::max(1.0, reduced_chi_square(answer));
      const double step = kNormal90 * answer.spread.noise(kLnRatio);
      std::array<Case::Lump, 2> ends;
      std::optional<DirectSearch::State> lower;
      for (size_t side = 0; side < 2 && !lower; ++side) {
        DirectSearch::RatioEnd end = search_.ratio_end(*answer.best, side == 0 ? -1 : 1, allowed, step);
        ends[side] = end.lump;
        if (better < kMostBetter) lower = std::move(end.lower);
      }
      if (!lower) return take_ends(answer.best->lump, ends, answer.spread, answer.estimate);
      answer.best = std::move(lower);
      settle(answer);
    }
  }

 private:
  static ShapeAnswer unanswered(const DirectInversionOptions::Start& start) {
    ShapeAnswer answer;
    answer.estimate.method = "direct inversion";
    answer.estimate.false_alarm_rate = 0.01;
    answer.odds_chi2 = -2 * std::log(std::max(start.odds, 1e-300));
    return answer;
  }

  /// The observation can be read; else the answer says why not.
  bool usable(ShapeAnswer& answer) const {
    if (search_.values() < kFewestValues)
      summarise(answer, Status::Unusable,
                "only " + std::to_string(search_.values()) + " places were seen at every load");
    else if (observation_.saturated_fraction > kMostSaturated)
      summarise(answer, Status::Unusable, "the sensor is saturated at the highest load: press less");
    else
      return true;
    return false;
  }

  double reduced_chi_square(const ShapeAnswer& answer) const {
    const auto values = static_cast<double>(search_.values() * observation_.force_N.size());
    return answer.best->chi2 / std::max(1.0, values - double{kLumpUnknowns});
  }

  static void summarise(ShapeAnswer& answer, Status verdict, const std::string& reason) {
    answer.estimate.verdict = verdict;
    answer.estimate.reasons.clear();
    if (!reason.empty()) answer.estimate.reasons.push_back(reason);
  }

  void settle(ShapeAnswer& answer, double most_chi2 = HUGE_VAL) {
    const DirectSearch::Settled settled = search_.settle(*answer.best, most_chi2 - answer.odds_chi2);
    judge(answer, settled != DirectSearch::Settled::No);
  }

  void judge(ShapeAnswer& answer, bool settled) {
    const DirectSearch::State& best = *answer.best;
    Estimate& estimate = answer.estimate;
    const double reduced = reduced_chi_square(answer);
    answer.spread = spread_at(search_, best, reduced, observation_, options_.model);
    take(best.lump, answer.spread, estimate);
    estimate.shape_probability = {};
    estimate.shape_probability[static_cast<size_t>(estimate.shape)] = 1;
    estimate.detection_statistic = 0;
    if (const std::optional<double> nothing = search_.without_lump(best))
      estimate.detection_statistic = std::max(0.0, *nothing - best.chi2) / (kChance * std::max(1.0, reduced));
    std::string line;
    if (!settled && spent()) return summarise(answer, Status::Unusable, kSpent);
    if (estimate.detection_statistic < 1)
      return summarise(answer, Status::NoLump, "tissue alone answers as well, but for chance");
    if (!settled) {
      line = text("the search did not end in %u rounds: the values are where it stood", options_.most_rounds);
      return summarise(answer, Status::Unusable, line);
    }
    if (reduced > 4) {
      line = text(
          "the best lump misses the reading by %.1f times its noise: not a lump of this shape in "
          "such tissue",
          std::sqrt(reduced));
      return summarise(answer, Status::OutsideTraining, line);
    }
    summarise(answer, Status::Found, "");
  }

  const Observation& observation_;
  const DirectInversionOptions& options_;
  DirectSearch search_;
};

// A search that did not end is no rival of one that did.
bool better(const ShapeAnswer& a, const ShapeAnswer& b) {
  return a.reports() != b.reports() ? a.reports() : a.chi2() < b.chi2();
}

/// Likelihood of an answer relative to the best one.
double likelihood(const ShapeAnswer& answer, const ShapeAnswer& best) {
  return answer.reports() ? std::exp(0.5 * (best.chi2() - answer.chi2())) : 0;
}

/// Answers of all starts. The likeliest is settled first: others end where they cannot come near it any more.
std::vector<ShapeAnswer> settled_shapes(Inversion& inversion,
                                        std::vector<DirectInversionOptions::Start> starts) {
  std::stable_sort(starts.begin(), starts.end(),
                   [](const auto& a, const auto& b) { return a.odds > b.odds; });
  std::vector<ShapeAnswer> answers;
  answers.reserve(starts.size());
  for (const DirectInversionOptions::Start& start : starts) {
    const auto best = std::min_element(answers.begin(), answers.end(), better);
    const bool any = best != answers.end() && best->reports();
    answers.push_back(inversion.from(start, any ? best->chi2() + inversion.outdone(*best) : HUGE_VAL,
                                     any ? &*best : nullptr));
  }
  return answers;
}

/// What is reported where the elements reached their limit of work.
Estimate at_limit(Estimate direct, const std::optional<Estimate>& otherwise) {
  if (!reports_numbers(direct.verdict)) {
    if (direct.verdict != Status::Unusable || !otherwise) return direct;
    direct = *otherwise;
    direct.reasons.push_back(text("%s: this is the %s's answer", kSpent, otherwise->method.c_str()));
    return direct;
  }
  const bool known = otherwise && reports_numbers(otherwise->verdict);
  if (known) {
    widen(direct.size_mm, otherwise->size_mm);
    widen(direct.depth_mm, otherwise->depth_mm);
    widen(direct.stiffness_ratio, otherwise->stiffness_ratio);
  }
  direct.reasons.push_back("the finite elements reached their limit of work before all was asked" +
                           (known ? ": intervals hold those of the " + otherwise->method : std::string()));
  return direct;
}

double seconds_since(std::chrono::steady_clock::time_point begin) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

}  // namespace

Estimate invert_directly(const Observation& observation, const DirectInversionOptions& options) {
  check_reading(observation);
  check(options.model);
  const auto begin = std::chrono::steady_clock::now();
  std::vector<DirectInversionOptions::Start> starts = options.starts;
  Inversion inversion(observation, options);
  if (starts.empty()) {
    starts.push_back({first_guess(observation), 1});
    if (std::optional<ShapeAnswer> nothing = inversion.without_lump(starts.front())) {
      nothing->estimate.wall_s = seconds_since(begin);
      return nothing->estimate;
    }
  }
  std::vector<ShapeAnswer> answers = settled_shapes(inversion, starts);
  const ShapeAnswer settled = *std::min_element(answers.begin(), answers.end(), better);
  for (ShapeAnswer& answer : answers)
    if (likelihood(answer, settled) >= kRivalLikelihood) inversion.follow_ratio(answer);

  const ShapeAnswer& best = *std::min_element(answers.begin(), answers.end(), better);
  Estimate estimate = best.estimate;
  if (best.reports()) {
    double sum = 1;
    for (const ShapeAnswer& other : answers) {
      if (&other == &best) continue;
      const double likely = likelihood(other, best);
      sum += likely;
      estimate.shape_probability[static_cast<size_t>(other.estimate.shape)] += likely;
      if (likely < kRivalLikelihood) continue;
      widen(estimate.size_mm, other.estimate.size_mm);
      widen(estimate.depth_mm, other.estimate.depth_mm);
      widen(estimate.stiffness_ratio, other.estimate.stiffness_ratio);
      estimate.reasons.push_back(std::string("one of shape ") + to_string(other.estimate.shape) +
                                 " answers as well: intervals hold both");
    }
    for (double& probability : estimate.shape_probability) probability /= sum;
  }
  if (inversion.spent()) estimate = at_limit(std::move(estimate), options.otherwise);
  open_wide_ratio(estimate);
  estimate.wall_s = seconds_since(begin);
  return estimate;
}

}  // namespace palpate::lump
