#include "engine/lump/pair/pair_sight.h"

#include <algorithm>
#include <cmath>

#include "engine/numeric/dense.h"

namespace palpate::lump {
namespace {

constexpr double kLeastSeen = 1e-3;          // of the best seen sum of fields: less is not seen
constexpr double kInteractionLength_mm = 4;  // over which what two lumps do to each other is alike

/// exp(-r^2 / (2 length^2)) between nodes.
Eigen::MatrixXd alike(const PressedNodes& nodes, const std::vector<Eigen::Index>& at, double length_mm) {
  const auto count = static_cast<Eigen::Index>(at.size());
  Eigen::MatrixXd all(count, count);
  for (Eigen::Index a = 0; a < count; ++a)
    for (Eigen::Index b = 0; b <= a; ++b) {
      const auto i = static_cast<size_t>(at[static_cast<size_t>(a)]),
                 j = static_cast<size_t>(at[static_cast<size_t>(b)]);
      const double x = nodes.x_mm[i] - nodes.x_mm[j], y = nodes.y_mm[i] - nodes.y_mm[j];
      all(a, b) = all(b, a) = std::exp(-0.5 * (x * x + y * y) / (length_mm * length_mm));
    }
  return all;
}

}  // namespace

PairSight::PairSight(const Model& model, const PressedNodes& nodes, const std::array<PatchView, 2>& views)
    : model_(&model), nodes_(&nodes), views_(views) {
  const double reach = model.patch.reach_mm() + 1e-6;
  const Eigen::Index count = model.patch.count(), loads = nodes.rest.cols();
  Eigen::MatrixXf shown = Eigen::MatrixXf::Zero(2 * count, nodes.rest.rows());
  for (size_t n = 0; n < nodes.x_mm.size(); ++n) {
    bool held = false;
    const auto column = static_cast<Eigen::Index>(inside_.size());
    for (size_t lump = 0; lump < 2; ++lump) {
      const auto [u, v] = views_[lump].to_patch(nodes.x_mm[n], nodes.y_mm[n]);
      if (std::abs(u) > reach || std::abs(v) > reach) continue;
      model.patch.at(u, v, shown.col(column).data() + static_cast<Eigen::Index>(lump) * count);
      held = true;
    }
    if (held) inside_.push_back(static_cast<Eigen::Index>(n));
  }
  shown.conservativeResize(Eigen::NoChange, static_cast<Eigen::Index>(inside_.size()));
  fields_ = shown.transpose().cast<double>();
  // Sums of fields that are nearly the same in both patches, or that the window cuts off, count once or not.
  const dense::SymmetricEigen sums = dense::symmetric_eigen(dense::product_tn(fields_, fields_));
  const double least = kLeastSeen * kLeastSeen * sums.values(sums.values.size() - 1);
  Eigen::Index hidden = 0;
  while (sums.values(hidden) < least) ++hidden;
  const Eigen::Index numbers = 2 * count - hidden;
  const Eigen::MatrixXd kept =
      sums.vectors.rightCols(numbers) * sums.values.tail(numbers).cwiseSqrt().cwiseInverse().asDiagonal();
  basis_ = dense::product(fields_, kept);
  for (size_t lump = 0; lump < 2; ++lump)
    in_basis_[lump] = dense::product_tn(
        basis_, Eigen::MatrixXd(fields_.middleCols(static_cast<Eigen::Index>(lump) * count, count)));

  const Eigen::MatrixXd seen = nodes.rest(inside_, Eigen::all);
  const Eigen::MatrixXd of_rest = dense::product_tn(basis_, seen);
  observation_ = of_rest.reshaped();
  const double free = static_cast<double>((seen.rows() - numbers) * loads);
  rest_ = free > 0
              ? std::max(0.0, seen.squaredNorm() - of_rest.squaredNorm()) / (nodes.noise * nodes.noise * free)
              : 1;

  Eigen::MatrixXd smooth = Eigen::MatrixXd::Identity(numbers, numbers);
  for (const double length_mm : kPatternLengths_mm)
    smooth += dense::product_tn(basis_, dense::product(alike(nodes, inside_, length_mm), basis_));
  pattern_.resize(numbers * loads, numbers * loads);
  for (Eigen::Index k = 0; k < loads; ++k)
    for (Eigen::Index l = 0; l < loads; ++l) {
      const auto share = [&nodes](Eigen::Index load) {
        return nodes.loads[static_cast<size_t>(load)] / nodes.loads.back();
      };
      const double fixed = 0.5 * (1 + share(k) * share(l)) + (k == l ? kLoadPattern : 0);
      pattern_.block(k * numbers, l * numbers, numbers, numbers) = fixed * smooth;
    }
  const Eigen::MatrixXd whole = dense::product_tn(basis_, Eigen::MatrixXd(nodes.total(inside_, Eigen::all)));
  gauge_ = Eigen::MatrixXd::Zero(numbers * loads, loads + 1);
  for (Eigen::Index k = 0; k < loads; ++k)
    gauge_.col(k).segment(k * numbers, numbers) = kGaugeFraction * whole.col(k);
  gauge_.col(loads) = kModulusFraction * whole.reshaped();
}

Eigen::VectorXd PairSight::of_factors(size_t lump, const Eigen::MatrixXd& factors) const {
  return dense::product(in_basis_[lump], factors).reshaped();
}

Eigen::MatrixXd PairSight::of_interaction(const PairBumps& bumps, double size) const {
  const Eigen::Index count = model_->patch.count(), loads = nodes_->rest.cols();
  // Both bumps at the nodes, highest load; the others are about as much less as their own.
  Eigen::VectorXd both = Eigen::VectorXd::Ones(fields_.rows());
  for (size_t lump = 0; lump < 2; ++lump)
    both.array() *=
        (fields_.middleCols(static_cast<Eigen::Index>(lump) * count, count) * bumps[lump].col(loads - 1))
            .array()
            .abs()
            .sqrt();
  const Eigen::MatrixXd weighed = both.asDiagonal() * basis_;
  const Eigen::MatrixXd one =
      size * size *
      dense::product_tn(weighed, dense::product(alike(*nodes_, inside_, kInteractionLength_mm), weighed));
  const Eigen::Index numbers = basis_.cols();
  Eigen::MatrixXd all(numbers * loads, numbers * loads);
  const auto share = [&](Eigen::Index load) {
    double product = 1;
    for (const Eigen::MatrixXd& bump : bumps)
      product *= bump.col(load).norm() / std::max(1e-12, bump.col(loads - 1).norm());
    return std::sqrt(product);
  };
  for (Eigen::Index k = 0; k < loads; ++k)
    for (Eigen::Index l = 0; l < loads; ++l)
      all.block(k * numbers, l * numbers, numbers, numbers) = share(k) * share(l) * one;
  return all;
}

void PairSight::weigh(const PairBumps& bumps, double pattern, double interaction) {
  const Eigen::Index numbers = basis_.cols(), loads = nodes_->rest.cols();
  plain_ = of_interaction(bumps, interaction);
  // The emulator's error grows with the bump and is much alike at all loads.
  for (size_t lump = 0; lump < 2; ++lump) {
    const Eigen::MatrixXd error =
        dense::product_nt(dense::product(in_basis_[lump], model_->discrepancy), in_basis_[lump]);
    for (Eigen::Index k = 0; k < loads; ++k)
      for (Eigen::Index l = 0; l < loads; ++l)
        plain_.block(k * numbers, l * numbers, numbers, numbers) += (k == l ? 1 : model_->load_correlation) *
                                                                    bumps[lump].col(k).norm() *
                                                                    bumps[lump].col(l).norm() * error;
  }
  plain_.diagonal().array() += nodes_->noise * nodes_->noise;
  dense::add_square(plain_, gauge_);
  plain_ = dense::from_lower(plain_);
  const Eigen::MatrixXd all = covariance(pattern);
  root_inverse_ = dense::Cholesky(all).solve_lower(Eigen::MatrixXd::Identity(all.rows(), all.cols()));
}

Eigen::MatrixXd PairSight::whitened(const Eigen::MatrixXd& numbers) const {
  return dense::product(root_inverse_, numbers);
}

PatternSize PairSight::pattern_of(const Eigen::VectorXd& remainder) const {
  std::array<double, kPatterns.size()> energy{};
  for (size_t p = 0; p < energy.size(); ++p) {
    const PatternCovariance at(covariance(kPatterns[p] * nodes_->peak), kPatterns[p]);
    energy[p] = at.squares(Eigen::MatrixXd(remainder))(0) + at.cost();
  }
  return pattern_size(energy, nodes_->peak);
}

PressedNodes PairSight::without(size_t lump, const Eigen::MatrixXd& factors) const {
  const Eigen::Index count = model_->patch.count();
  PressedNodes left = *nodes_;
  const Eigen::MatrixXd bump =
      dense::product(fields_.middleCols(static_cast<Eigen::Index>(lump) * count, count), factors);
  for (size_t i = 0; i < inside_.size(); ++i)
    for (Eigen::MatrixXd* values : {&left.rest, &left.total})
      values->row(inside_[i]) -= bump.row(static_cast<Eigen::Index>(i));
  return left;
}

}  // namespace palpate::lump
