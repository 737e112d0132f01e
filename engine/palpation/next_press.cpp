#include "engine/palpation/next_press.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <vector>

#include "engine/base/numbers.h"
#include "engine/base/text.h"
#include "engine/lump/network/fit.h"
#include "engine/lump/network/view.h"
#include "engine/numeric/dense.h"
#include "palpate/error.h"

namespace palpate {
namespace {

using lump::Fit;
using lump::Model;
using lump::PressedNodes;
using Place = std::array<double, 2>;

constexpr double kOver_mm = 1.5, kStep_mm = 2;
constexpr double kRim_mm = 1.25;  // as far as nodes are used
constexpr double kLeastHarder = 1.05, kMostHarder = 1.5;
constexpr double kHarder = 0.9;       // of the intervals' length: worth pressing all of it again
constexpr double kHeadroom = 0.9;     // of the sensor's range
constexpr double kLeastShown = 0.02;  // of the block

bool shows(const Place& at, const Place& window_mm, double x, double y) {
  return std::abs(x - at[0]) <= window_mm[0] / 2 && std::abs(y - at[1]) <= window_mm[1] / 2;
}

/// Middles of windows along one side of the block.
std::vector<double> along(double block_mm, double window_mm) {
  const double way_mm = std::max(0.0, block_mm / 2 + kOver_mm - window_mm / 2);
  const int steps = static_cast<int>(std::floor(way_mm / kStep_mm));
  std::vector<double> places;
  for (int i = -steps; i <= steps; ++i) places.push_back(i * kStep_mm);
  return places;
}

/// The block's nodes and how many presses showed each.
struct Coverage {
  std::vector<double> x_mm, y_mm, presses;

  explicit Coverage(const lump::ScanMap& map) {
    const PressureMap& seen = map.presses;
    for (uint32_t j = 0; j < seen.height; ++j)
      for (uint32_t i = 0; i < seen.width; ++i) {
        const double x = (i - (seen.width - 1) / 2.0) * seen.pitch_mm[0],
                     y = (j - (seen.height - 1) / 2.0) * seen.pitch_mm[1];
        if (std::abs(x) > map.observation.block_mm[0] / 2 - kRim_mm + 1e-6 ||
            std::abs(y) > map.observation.block_mm[1] / 2 - kRim_mm + 1e-6)
          continue;
        x_mm.push_back(x);
        y_mm.push_back(y);
        presses.push_back(static_cast<double>(seen.at(i, j)));
      }
  }
  void add(const Place& at, const Place& window_mm) {
    for (size_t n = 0; n < x_mm.size(); ++n) presses[n] += shows(at, window_mm, x_mm[n], y_mm[n]);
  }
  double seen_fraction() const {
    const auto seen = std::count_if(presses.begin(), presses.end(), [](double p) { return p > 0; });
    return static_cast<double>(seen) / static_cast<double>(std::max<size_t>(1, presses.size()));
  }
  /// Variance of a blended value, over that of one press: the mean of what was seen.
  double share_of_variance() const {
    double sum = 0, count = 0;
    for (const double p : presses)
      if (p > 0) {
        sum += 1 / p;
        ++count;
      }
    return count > 0 ? sum / count : 1;
  }
};

/// Variances of size, depth and ratio (logarithms) by the lump that explains the map best, and by its bump
/// alone: from nodes that need not have been pressed.
class Expectation {
 public:
  Expectation(const Model& model, const PressedNodes& nodes)
      : model_(model), nodes_(nodes), weighing_(lump::weigh(model, nodes, lump::Method::Refined)) {
    const lump::Fitter fitter(model, nodes, weighing_.look.patch);
    fit_ = lump::best_of(weighing_.fits);
    factors_ = fitter.factors(fit_);
  }

  /// `harder`: all loads, over those of the map.
  std::array<double, 3> variances(const Coverage& coverage, double one_press_noise, double harder = 1) const;
  /// The highest pressure over modulus.
  double peak() const { return nodes_.peak; }

 private:
  const Model& model_;
  const PressedNodes& nodes_;
  lump::Weighing weighing_;
  Fit fit_;
  Eigen::MatrixXd factors_;
};

std::array<double, 3> Expectation::variances(const Coverage& coverage, double one_press_noise,
                                             double harder) const {
  const lump::PatchView& view = weighing_.look.patch.view;
  PressedNodes expected;
  for (const double load : nodes_.loads) expected.loads.push_back(harder * load);
  expected.thickness_mm = nodes_.thickness_mm;
  expected.peak = harder * nodes_.peak;
  expected.noise = one_press_noise * std::sqrt(coverage.share_of_variance());
  expected.noise_fraction = expected.noise / expected.peak;
  std::vector<size_t> seen;
  for (size_t n = 0; n < coverage.presses.size(); ++n)
    if (coverage.presses[n] > 0) seen.push_back(n);
  const auto loads = static_cast<Eigen::Index>(expected.loads.size());
  Eigen::MatrixXd factors = factors_;
  if (harder != 1) {
    const lump::Guess guess{fit_.shape, fit_.at(0), fit_.at(1), fit_.at(2)};
    factors = lump::bump_factors(model_, guess, view.setting, expected.loads, -1);
  }
  expected.rest = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(seen.size()), loads);
  expected.total = expected.rest;
  std::vector<Eigen::VectorXf> quarters;
  for (const double load : expected.loads)
    quarters.push_back(model_.base.quarter(expected.thickness_mm, load));
  for (size_t n = 0; n < seen.size(); ++n) {
    const double x = coverage.x_mm[seen[n]], y = coverage.y_mm[seen[n]];
    expected.x_mm.push_back(x);
    expected.y_mm.push_back(y);
    for (Eigen::Index k = 0; k < loads; ++k)
      expected.total(static_cast<Eigen::Index>(n), k) =
          model_.base.at(quarters[static_cast<size_t>(k)], x, y);
  }
  lump::add_bump(model_, view, factors, expected);
  expected.total += expected.rest;
  lump::PatchObservation patch(model_, expected, view);
  patch.set_pattern(weighing_.look.patch.pattern * harder);
  Fit fit = fit_;
  const lump::Fitter fitter(model_, expected, patch);
  fitter.search(fit, 0);
  const auto covariance = dense::inverse(fit.normal);
  return {covariance(0, 0), covariance(1, 1), covariance(2, 2)};
}

std::array<double, 3> over(const std::array<double, 3>& now, const std::array<double, 3>& before) {
  std::array<double, 3> share{};
  for (size_t p = 0; p < 3; ++p) share[p] = std::sqrt(now[p] / before[p]);
  return share;
}

double mean_of(const std::array<double, 3>& shares) {
  return std::cbrt(shares[0] * shares[1] * shares[2]);
}

}  // namespace

std::optional<NextPress> next_press(const Model& model, const lump::ScanMap& map,
                                    const lump::Estimate& estimate, const NextPressOptions& options) {
  const auto& block_mm = map.observation.block_mm;
  if (!(options.window_mm[0] > 1 && options.window_mm[1] > 1 && options.worth >= 0 && options.worth < 1))
    throw Error(Failure::Usage, "a window above 1 mm and a worth of 0 to 1",
                text("%g x %g mm, %g", options.window_mm[0], options.window_mm[1], options.worth),
                "the presses' own window");
  std::vector<Place> places;
  for (const double y : along(block_mm[1], options.window_mm[1]))
    for (const double x : along(block_mm[0], options.window_mm[0])) places.push_back({x, y});
  const Coverage today(map);
  const double seen = today.seen_fraction();
  NextPress best;
  best.force_N = map.observation.force_N.back();
  best.window_mm = options.window_mm;
  best.narrower.fill(kNaN);
  best.harder_narrower.fill(kNaN);

  lump::Estimate unused;
  const auto nodes =
      reports_numbers(estimate.verdict) ? lump::pressed_nodes(model, map.observation, unused) : std::nullopt;
  if (!nodes) {
    for (const Place& place : places) {
      Coverage then = today;
      then.add(place, options.window_mm);
      const double shown = then.seen_fraction() - seen;
      if (shown > best.shows_fraction + 1e-9) {
        best.at_mm = place;
        best.shows_fraction = shown;
      }
    }
    if (best.shows_fraction < kLeastShown) return std::nullopt;
    best.reason = text("%.2g %% of the block was not seen, of which it shows %.2g %%", 100 * (1 - seen),
                       100 * best.shows_fraction / (1 - seen));
    return best;
  }
  const Expectation expectation(model, *nodes);
  const double one_press = nodes->noise / std::sqrt(today.share_of_variance());
  const auto now = expectation.variances(today, one_press);
  double least = 1 - options.worth;
  bool found = false;
  Coverage with = today;
  for (const Place& place : places) {
    Coverage then = today;
    then.add(place, options.window_mm);
    const auto narrower = over(expectation.variances(then, one_press), now);
    if (!(mean_of(narrower) < least)) continue;
    found = true;
    least = mean_of(narrower);
    best.at_mm = place;
    best.narrower = narrower;
    best.shows_fraction = then.seen_fraction() - seen;
    with = std::move(then);
  }
  if (!found) return std::nullopt;
  best.reason = text("intervals of size, depth and stiffness would have %.2g, %.2g and %.2g of their length",
                     best.narrower[0], best.narrower[1], best.narrower[2]);
  const double peak_Pa = expectation.peak() * map.observation.young_Pa;
  double harder = std::min(kMostHarder, model.load[1] / nodes->loads.back());
  if (options.full_scale_Pa > 0) harder = std::min(harder, kHeadroom * options.full_scale_Pa / peak_Pa);
  if (harder < kLeastHarder) return best;
  const auto narrower = over(expectation.variances(with, one_press, harder), now);
  if (mean_of(narrower) < kHarder * least) {
    best.harder_N = harder * best.force_N;
    best.harder_peak_Pa = harder * peak_Pa;
    best.harder_narrower = narrower;
  }
  return best;
}

std::array<std::array<double, 2>, 4> corners_of(const NextPress& n) {
  const double x = n.at_mm[0], y = n.at_mm[1], w = n.window_mm[0] / 2, h = n.window_mm[1] / 2;
  return {{{x - w, y - h}, {x + w, y - h}, {x + w, y + h}, {x - w, y + h}}};
}

std::vector<std::pair<std::string, std::string>> next_press_rows(const std::optional<NextPress>& next,
                                                                 const lump::Estimate& estimate) {
  if (!next)
    return {{"place", reports_numbers(estimate.verdict) ? "none: no press would narrow the intervals by 5 %"
                                                        : "none: all of the block was seen"}};
  std::vector<std::pair<std::string, std::string>> rows;
  rows.emplace_back("place", text("the window's middle at %g, %g mm, up to %.3g N", next->at_mm[0],
                                  next->at_mm[1], next->force_N));
  rows.emplace_back("why", next->reason);
  if (next->harder_N > 0)
    rows.emplace_back("or harder", text("all presses again, up to %.3g N (%.3g kPa): %.2g, %.2g, %.2g",
                                        next->harder_N, next->harder_peak_Pa / 1000, next->harder_narrower[0],
                                        next->harder_narrower[1], next->harder_narrower[2]));
  return rows;
}

}  // namespace palpate
