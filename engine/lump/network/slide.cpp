#include "engine/lump/network/slide.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "engine/base/statistics.h"
#include "engine/numeric/dense.h"

namespace palpate::lump {
namespace {

constexpr double kStep_mm = 0.5;

/// Without noise: the block's own pressure and the patch's fields fitted to the rest, at places moved by some
/// mm.
class SmoothMap {
 public:
  SmoothMap(const Model& model, const PressedNodes& nodes, Eigen::Index load)
      : model_(model),
        nodes_(nodes),
        place_(find_bump(model, nodes)),
        quarter_(model.base.quarter(nodes.thickness_mm, nodes.loads[static_cast<size_t>(load)])) {
    const Eigen::MatrixXd fields = fields_at(0, 0);
    Eigen::MatrixXd normal = dense::product_tn(fields, fields);
    normal.diagonal().array() += 1e-3 * std::max(1e-9, normal.diagonal().maxCoeff());
    factors_ =
        dense::Cholesky(normal).solve(dense::product_tn(fields, Eigen::VectorXd(nodes.rest.col(load))));
  }

  Eigen::VectorXd at(double x_mm, double y_mm) const {
    Eigen::VectorXd values = dense::product(fields_at(x_mm, y_mm), Eigen::MatrixXd(factors_));
    for (Eigen::Index n = 0; n < values.size(); ++n) {
      const auto i = static_cast<size_t>(n);
      values(n) += model_.base.at(quarter_, nodes_.x_mm[i] + x_mm, nodes_.y_mm[i] + y_mm);
    }
    return values;
  }

 private:
  Eigen::MatrixXd fields_at(double x_mm, double y_mm) const {
    const double reach = model_.patch.reach_mm();
    Eigen::MatrixXd fields =
        Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(nodes_.x_mm.size()), model_.patch.count());
    Eigen::VectorXf at(model_.patch.count());
    for (size_t n = 0; n < nodes_.x_mm.size(); ++n) {
      const double u = nodes_.x_mm[n] + x_mm - place_[0], v = nodes_.y_mm[n] + y_mm - place_[1];
      model_.patch.at(std::clamp(u, -reach, reach), std::clamp(v, -reach, reach), at.data());
      fields.row(static_cast<Eigen::Index>(n)) = at.cast<double>().transpose();
    }
    return fields;
  }

  const Model& model_;
  const PressedNodes& nodes_;
  std::array<double, 2> place_;
  Eigen::VectorXf quarter_;
  Eigen::VectorXd factors_;
};

}  // namespace

std::optional<Slide> find_slide(const Model& model, const PressedNodes& nodes) {
  const auto loads = static_cast<Eigen::Index>(nodes.loads.size());
  if (loads < 2) return std::nullopt;
  const Eigen::Index last = loads - 1;
  const SmoothMap smooth(model, nodes, last);
  Eigen::MatrixXd columns(nodes.total.rows(), 4);
  columns.col(0) = nodes.total.col(last);
  columns.col(2) = (smooth.at(kStep_mm, 0) - smooth.at(-kStep_mm, 0)) / (2 * kStep_mm);
  columns.col(3) = (smooth.at(0, kStep_mm) - smooth.at(0, -kStep_mm)) / (2 * kStep_mm);
  std::vector<std::array<double, 2>> shift(static_cast<size_t>(loads), {0, 0});
  std::vector<double> sd(static_cast<size_t>(loads), 0);
  for (Eigen::Index k = 0; k < last; ++k) {
    columns.col(1) = (nodes.total - nodes.rest).col(k);
    Eigen::MatrixXd normal = dense::product_tn(columns, columns);
    normal.diagonal() *= 1 + 1e-9;
    const Eigen::VectorXd right = dense::product_tn(columns, Eigen::VectorXd(nodes.total.col(k)));
    const Eigen::VectorXd factors = dense::solve_lu(normal, right);
    const double left = std::max(0.0, nodes.total.col(k).squaredNorm() - right.dot(factors));
    const double per_node =
        std::max(nodes.noise * nodes.noise, left / static_cast<double>(nodes.total.rows()));
    const Eigen::MatrixXd covariance = per_node * dense::inverse(normal);
    // Slopes belong to the highest load's map, scaled to this one's height.
    const double height = nodes.total.col(k).mean() / nodes.total.col(last).mean();
    const auto i = static_cast<size_t>(k);
    shift[i] = {-factors(2) / height, -factors(3) / height};
    sd[i] = std::sqrt(std::max(covariance(2, 2), covariance(3, 3))) / height;
  }
  std::array<double, 2> middle{};
  for (size_t axis = 0; axis < 2; ++axis) {
    std::vector<double> values;
    for (const auto& one : shift) values.push_back(one[axis]);
    middle[axis] = median(values);
  }
  if (loads == 2) middle = {0, 0};
  Slide slide;
  const double worst_sd = *std::max_element(sd.begin(), sd.end());
  for (size_t k = 0; k < shift.size(); ++k) {
    const double x = shift[k][0] - middle[0], y = shift[k][1] - middle[1], distance = std::hypot(x, y);
    if (distance <= slide.distance_mm) continue;
    slide = {k, {x, y}, distance, sd[k] > 0 ? sd[k] : worst_sd};
  }
  return slide;
}

}  // namespace palpate::lump
