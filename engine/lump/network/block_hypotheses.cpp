#include "engine/lump/network/block_hypotheses.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/lump/network/inverse_network.h"
#include "engine/numeric/dense.h"

namespace palpate::lump {
namespace {

// Standard deviations, shares of the block's own pressure.
constexpr double kGain = 0.01;    // gauge and modulus
constexpr double kModel = 0.005;  // what sums of components leave of a bump, of its peak or of kLeastPeak
constexpr double kLeastPeak = 0.3;
constexpr double kSpread = 2;  // bumps differ by so much more than those of the training
constexpr double kUnknown = 1e3;
constexpr double kTail = 0.1;  // a bump that is higher than this at its patch's edge goes on beyond it

/// The block's own pressure, straight on beyond its outer nodes.
double block_at(const Base& base, const Eigen::VectorXf& quarter, double x_mm, double y_mm) {
  const double rim = (base.side - 1) * base.pitch_mm, step = base.pitch_mm;
  const double x = std::abs(x_mm), y = std::abs(y_mm), in_x = std::min(x, rim), in_y = std::min(y, rim);
  double value = base.at(quarter, in_x, in_y);
  if (x > rim) value += (x - rim) / step * (base.at(quarter, rim, in_y) - base.at(quarter, rim - step, in_y));
  if (y > rim) value += (y - rim) / step * (base.at(quarter, in_x, rim) - base.at(quarter, in_x, rim - step));
  return std::max(0.0, value);
}

/// The patch's fields at all nodes, those of the patch's edge beyond it; and how far beyond a node lies.
struct Shown {
  Eigen::MatrixXd fields;                        ///< nodes x fields
  std::vector<std::array<double, 2>> beyond_mm;  ///< along the patch's axes, with sign; 0: on it
  bool inside(Eigen::Index n) const { return beyond_mm[static_cast<size_t>(n)] == std::array{0.0, 0.0}; }
};
Shown fields_at_nodes(const Model& model, const PressedNodes& nodes, const PatchView& view) {
  const auto count = static_cast<Eigen::Index>(nodes.x_mm.size());
  const double reach = model.patch.reach_mm();
  Shown shown{Eigen::MatrixXd(count, model.patch.count()), {}};
  Eigen::VectorXf at(model.patch.count());
  for (Eigen::Index n = 0; n < count; ++n) {
    const auto [u, v] = view.to_patch(nodes.x_mm[static_cast<size_t>(n)], nodes.y_mm[static_cast<size_t>(n)]);
    const double in_u = std::clamp(u, -reach, reach), in_v = std::clamp(v, -reach, reach);
    model.patch.at(in_u, in_v, at.data());
    shown.fields.row(n) = at.cast<double>().transpose();
    shown.beyond_mm.push_back({u - in_u, v - in_v});
  }
  return shown;
}

/// A bump's factors by least squares on the nodes of its patch alone.
Eigen::VectorXd free_factors(const Shown& shown, const Eigen::VectorXd& rest) {
  std::vector<Eigen::Index> inside;
  for (Eigen::Index n = 0; n < rest.size(); ++n)
    if (shown.inside(n)) inside.push_back(n);
  const Eigen::MatrixXd fields = shown.fields(inside, Eigen::all);
  Eigen::MatrixXd normal = dense::product_tn(fields, fields);
  normal.diagonal().array() += 1e-2 * std::max(1e-9, normal.diagonal().maxCoeff());
  return dense::Cholesky(normal).solve(dense::product_tn(fields, Eigen::VectorXd(rest(inside))));
}

/// Past which of the patch's sides (left, right, up, down) the bump goes on: there is more of it than the
/// fields know.
std::array<bool, 4> goes_on_beyond(const Eigen::VectorXd& bump, const Shown& shown) {
  std::array<bool, 4> on{};
  for (Eigen::Index n = 0; n < bump.size(); ++n) {
    const auto& [u, v] = shown.beyond_mm[static_cast<size_t>(n)];
    if (bump(n) <= kTail) continue;
    if (v == 0 && u != 0) on[u < 0 ? 0 : 1] = true;
    if (u == 0 && v != 0) on[v < 0 ? 2 : 3] = true;
  }
  return on;
}

}  // namespace

BlockHypotheses::BlockHypotheses(const Model& model, const PressedNodes& nodes, double uneven_sd)
    : model_(model), nodes_(nodes) {
  const auto count = static_cast<Eigen::Index>(nodes.x_mm.size());
  double sum = 0;
  for (const double load : nodes.loads) sum += load * load;
  for (const double load : nodes.loads) weights_.push_back(load / sum);
  observed_ = Eigen::VectorXd::Zero(count);
  for (size_t k = 0; k < weights_.size(); ++k)
    observed_ += weights_[k] * nodes.total.col(static_cast<Eigen::Index>(k));
  plain_ = block({});
  const Eigen::VectorXd rest = observed_ - plain_;
  const double noise = nodes.noise / std::sqrt(sum);
  const double own = kModel * std::max(kLeastPeak, rest.maxCoeff());

  const Eigen::Index fields = model.patch.count(), components = model.inverse.components.cols();
  Eigen::MatrixXd bumps = Eigen::MatrixXd::Zero(fields, components + 1);
  for (size_t k = 0; k < weights_.size(); ++k)
    bumps += weights_[k] * components_at(model.inverse, fields, nodes.loads[k]);
  const std::array<double, 2> place = find_bump(model, nodes);
  double best = std::numeric_limits<double>::infinity();
  for (const bool swap : {false, true}) {
    const Shown shown = fields_at_nodes(model, nodes, PatchView(model, nodes, place, swap));
    const Eigen::VectorXd free = free_factors(shown, rest);
    // Components are those of bumps over the root of their size.
    const double amplitude = std::sqrt(2 * free.norm());
    const std::array<bool, 4> goes_on =
        goes_on_beyond(dense::product(shown.fields, Eigen::MatrixXd(free)), shown);
    Eigen::VectorXd sd = Eigen::VectorXd::Constant(count, std::hypot(noise, own));
    double counted = 0;
    for (Eigen::Index n = 0; n < count; ++n) {
      const auto& [u, v] = shown.beyond_mm[static_cast<size_t>(n)];
      const bool open =
          (u < 0 && goes_on[0]) || (u > 0 && goes_on[1]) || (v < 0 && goes_on[2]) || (v > 0 && goes_on[3]);
      if (open) sd(n) = kUnknown;
      counted += !open;
    }
    Eigen::MatrixXd other(count, components + 7);
    other.leftCols(components + 1) = amplitude * kSpread * dense::product(shown.fields, bumps);
    for (Eigen::Index n = 0; n < count; ++n) {
      const double x = 2 * nodes.x_mm[static_cast<size_t>(n)] / model.block_mm[0],
                   y = 2 * nodes.y_mm[static_cast<size_t>(n)] / model.block_mm[1];
      other.row(n).tail(6) << kGain, uneven_sd * x, uneven_sd * y, uneven_sd * x * x, uneven_sd * y * y,
          uneven_sd * x * y;
      other.row(n).tail(6) *= plain_(n);
    }
    other = sd.cwiseInverse().asDiagonal() * other;
    Eigen::MatrixXd normal = dense::product_tn(other, other);
    normal.diagonal().array() += 1;
    auto root = std::make_shared<const dense::Cholesky>(normal);
    const Eigen::VectorXd left = rest.cwiseQuotient(sd);
    const Eigen::MatrixXd shared = root->solve_lower(Eigen::MatrixXd(dense::product_tn(other, left)));
    const double score = left.squaredNorm() - shared.squaredNorm() +
                         2 * root->lower().diagonal().array().log().sum() + 2 * sd.array().log().sum();
    if (score >= best) continue;
    best = score;
    sd_ = sd;
    nodes_counted_ = counted;
    other_ = std::move(other);
    root_ = std::move(root);
  }
  told_ = squares(rest.cwiseQuotient(sd_));
}

Eigen::VectorXd BlockHypotheses::block(const Change& change) const {
  const auto count = static_cast<Eigen::Index>(nodes_.x_mm.size());
  const double stiffer = 1 + change.young;
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(count);
  for (size_t k = 0; k < weights_.size(); ++k) {
    const Eigen::VectorXf quarter =
        model_.base.quarter(nodes_.thickness_mm * (1 + change.thickness), nodes_.loads[k] / stiffer);
    for (Eigen::Index n = 0; n < count; ++n) {
      const auto i = static_cast<size_t>(n);
      sum(n) += weights_[k] * stiffer *
                block_at(model_.base, quarter, (1 + change.pitch) * nodes_.x_mm[i] + change.shift_mm[0],
                         (1 + change.pitch) * nodes_.y_mm[i] + change.shift_mm[1]);
    }
  }
  return sum;
}

double BlockHypotheses::squares(const Eigen::VectorXd& left) const {
  const Eigen::MatrixXd shared = root_->solve_lower(Eigen::MatrixXd(dense::product_tn(other_, left)));
  return left.squaredNorm() - shared.squaredNorm();
}

double BlockHypotheses::chi_square(const Change& change) const {
  return squares((observed_ - block(change)).cwiseQuotient(sd_));
}

template <typename At>
ChangeFit BlockHypotheses::search(const std::vector<double>& grid, const At& at) const {
  // The lowest of the grid, then of a parabola around it.
  std::vector<double> values;
  values.reserve(grid.size());
  for (const double value : grid) values.push_back(chi_square(at(value)));
  const auto least = static_cast<size_t>(std::min_element(values.begin(), values.end()) - values.begin());
  ChangeFit fit{at(grid[least]), values[least], 0};
  double centre = grid[least],
         step = least + 1 < grid.size() ? grid[least + 1] - centre : centre - grid[least - 1];
  for (int round = 0; round < 4; ++round) {
    step /= 2;
    const double below = chi_square(at(centre - step)), above = chi_square(at(centre + step));
    const double bend = (below + above - 2 * fit.chi_square) / (step * step);
    if (bend > 0) fit.sd = std::sqrt(2 / bend * std::max(1.0, fit.chi_square / nodes()));
    const double move = bend > 0 ? std::clamp((below - above) / (2 * step * bend), -step, step)
                                 : (below < above ? -step : step);
    const double value = chi_square(at(centre + move));
    if (value < fit.chi_square) {
      centre += move;
      fit.change = at(centre);
      fit.chi_square = value;
    }
  }
  return fit;
}

ChangeFit BlockHypotheses::best_pitch() const {
  std::vector<double> grid;
  for (double factor = 0.55; factor < 1.9; factor *= 1.08) grid.push_back(factor - 1);
  return search(grid, [](double pitch) {
    Change change;
    change.pitch = pitch;
    return change;
  });
}

ChangeFit BlockHypotheses::best_thickness() const {
  std::vector<double> grid;
  for (double factor = model_.thickness_mm[0]; factor < model_.thickness_mm[1] + 0.01; factor += 0.8)
    grid.push_back(factor / nodes_.thickness_mm - 1);
  return search(grid, [](double thickness) {
    Change change;
    change.thickness = thickness;
    return change;
  });
}

ChangeFit BlockHypotheses::best_shift() const {
  constexpr double kStep_mm = 0.3, kLongest_mm = 3, kFarthest_mm = 15;
  ChangeFit fit{{}, told_, 0};
  const auto at = [&](double x, double y) {
    Change change;
    change.shift_mm = {std::clamp(x, -kFarthest_mm, kFarthest_mm),
                       std::clamp(y, -kFarthest_mm, kFarthest_mm)};
    return ChangeFit{change, chi_square(change), 0};
  };
  for (int round = 0; round < 10; ++round) {
    const auto [x, y] = fit.change.shift_mm;
    const double right = at(x + kStep_mm, y).chi_square, left = at(x - kStep_mm, y).chi_square,
                 down = at(x, y + kStep_mm).chi_square, up = at(x, y - kStep_mm).chi_square,
                 both = at(x + kStep_mm, y + kStep_mm).chi_square;
    const Eigen::Vector2d slope((right - left) / (2 * kStep_mm), (down - up) / (2 * kStep_mm));
    Eigen::Matrix2d bend;
    bend(0, 0) = (right + left - 2 * fit.chi_square) / (kStep_mm * kStep_mm);
    bend(1, 1) = (down + up - 2 * fit.chi_square) / (kStep_mm * kStep_mm);
    bend(0, 1) = bend(1, 0) = (both - right - down + fit.chi_square) / (kStep_mm * kStep_mm);
    const double scale = std::max(1.0, fit.chi_square / nodes());
    const double trace = bend.trace(), split = std::hypot((bend(0, 0) - bend(1, 1)) / 2, bend(0, 1));
    const double weakest = trace / 2 - split;
    if (weakest > 0) fit.sd = std::sqrt(2 / weakest * scale);
    bool moved = false;
    for (double damp = std::max(0.0, -1.5 * weakest); !moved && damp < 1e6;
         damp = 4 * damp + 0.05 * (trace / 2 + split)) {
      const Eigen::Matrix2d damped = bend + damp * Eigen::Matrix2d::Identity();
      const double det = damped(0, 0) * damped(1, 1) - damped(0, 1) * damped(0, 1);
      if (!(det > 0)) {
        if (trace / 2 + split <= 0) break;
        continue;
      }
      Eigen::Vector2d step(-(damped(1, 1) * slope(0) - damped(0, 1) * slope(1)) / det,
                           -(damped(0, 0) * slope(1) - damped(0, 1) * slope(0)) / det);
      if (step.norm() > kLongest_mm) step *= kLongest_mm / step.norm();
      if (step.norm() < 0.02) break;
      const ChangeFit next = at(x + step(0), y + step(1));
      if (next.chi_square < fit.chi_square) {
        const double sd = fit.sd;
        fit = next;
        fit.sd = sd;
        moved = true;
      }
    }
    if (!moved) break;
  }
  return fit;
}

LinearFit BlockHypotheses::linear(const Eigen::MatrixXd& columns, const Eigen::VectorXd& expected_sd) const {
  const Eigen::MatrixXd scaled = sd_.cwiseInverse().asDiagonal() * columns;
  const Eigen::VectorXd left = (observed_ - plain_).cwiseQuotient(sd_);
  const Eigen::MatrixXd shared = root_->solve_lower(dense::product_tn(other_, scaled));
  const Eigen::MatrixXd own = root_->solve_lower(Eigen::MatrixXd(dense::product_tn(other_, left)));
  const Eigen::MatrixXd normal = dense::product_tn(scaled, scaled) - dense::product_tn(shared, shared);
  const Eigen::VectorXd right = dense::product_tn(scaled, left) - dense::product_tn(shared, own).col(0);
  Eigen::MatrixXd expected = normal;
  // What the model leaves counts as noise.
  if (expected_sd.size() > 0)
    expected.diagonal() += std::max(1.0, told_ / nodes()) * expected_sd.cwiseAbs2().cwiseInverse();
  LinearFit fit;
  fit.value = dense::solve_lu(expected, right);
  fit.chi_square = told_ - 2 * right.dot(fit.value) + fit.value.dot(normal * fit.value);
  fit.sd = (std::max(1.0, fit.chi_square / nodes()) * dense::inverse(expected).diagonal()).cwiseSqrt();
  return fit;
}

LinearFit BlockHypotheses::pattern(const Eigen::MatrixXd& at_nodes) const {
  Eigen::MatrixXd column = Eigen::MatrixXd::Zero(at_nodes.rows(), 1);
  for (size_t k = 0; k < weights_.size(); ++k)
    column += weights_[k] * at_nodes.col(static_cast<Eigen::Index>(k));
  return linear(column);
}

LinearFit BlockHypotheses::tilt(double expected_sd) const {
  Eigen::MatrixXd columns(plain_.size(), 2);
  for (Eigen::Index n = 0; n < plain_.size(); ++n) {
    columns(n, 0) = plain_(n) * 2 * nodes_.x_mm[static_cast<size_t>(n)] / model_.block_mm[0];
    columns(n, 1) = plain_(n) * 2 * nodes_.y_mm[static_cast<size_t>(n)] / model_.block_mm[1];
  }
  if (expected_sd <= 0) return linear(columns);
  return linear(columns, Eigen::Vector2d(expected_sd, expected_sd));
}

}  // namespace palpate::lump
