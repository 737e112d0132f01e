#include "engine/lump/network/inverse_network.h"

#include <algorithm>
#include <cmath>

#include "engine/numeric/dense.h"

namespace palpate::lump {
namespace {

constexpr double kNear_mm = 0.3;  // a patch that lies as near to its lump is not moved again
constexpr int kMostMoves = 3;

}  // namespace

Eigen::MatrixXd components_at(const InverseNetwork& inverse, Eigen::Index fields, double load) {
  const auto components = inverse.components.cols();
  Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(fields, components + 1);
  for (size_t q = 0; q < inverse.loads.size(); ++q) {
    double weight = load;
    for (size_t other = 0; other < inverse.loads.size(); ++other)
      if (other != q) weight *= (load - inverse.loads[other]) / (inverse.loads[q] - inverse.loads[other]);
    const auto first = static_cast<Eigen::Index>(q) * fields;
    sum.leftCols(components) += weight * inverse.components.middleRows(first, fields).cast<double>();
    sum.col(components) += weight * inverse.middle.segment(first, fields).cast<double>();
  }
  return sum;
}

PatchObservation::PatchObservation(const Model& model, const PressedNodes& nodes, const PatchView& from)
    : view(from), sums(sum_patch(model.patch, nodes, from)), errors(model, nodes, sums, kGaugeFraction) {}

void PatchObservation::set_pattern(double size) {
  pattern = size;
  whitener = PatchWhitener(errors, pattern);
  observation = whitener.of(errors.observation());
}

Eigen::VectorXf network_features(const Model& model, const PressedNodes& nodes,
                                 const PatchObservation& patch) {
  const InverseNetwork& inverse = model.inverse;
  const Eigen::Index fields = model.patch.count(), components = inverse.components.cols();
  const auto loads = static_cast<Eigen::Index>(nodes.loads.size());
  std::vector<Eigen::MatrixXd> at_load;
  for (const double load : nodes.loads) at_load.push_back(components_at(inverse, fields, load));
  // The likeliest make-up, as a bell over all bumps has it: least squares with unit weight on each way.
  Eigen::MatrixXd shown(patch.whitener.size(), components + 1);
  Eigen::MatrixXd factors(fields, loads);
  for (Eigen::Index w = 0; w <= components; ++w) {
    for (Eigen::Index k = 0; k < loads; ++k) factors.col(k) = at_load[static_cast<size_t>(k)].col(w);
    shown.col(w) = patch.of_factors(factors);
  }
  const Eigen::VectorXd left = patch.observation - shown.col(components);
  shown.conservativeResize(Eigen::NoChange, components);
  Eigen::MatrixXd normal = dense::product_tn(shown, shown);
  normal.diagonal().array() += 1;
  const dense::Cholesky root(normal);
  const Eigen::VectorXd make_up = root.solve(dense::product_tn(shown, left));
  const Eigen::MatrixXd root_inverse = root.solve_lower(Eigen::MatrixXd::Identity(components, components));

  Eigen::VectorXd in(components + InverseNetwork::kOthers + InverseNetwork::kOpen);
  const double size = std::max(1e-9, make_up.norm());
  in.head(components) = make_up / size;
  for (Eigen::Index w = 0; w < InverseNetwork::kOpen; ++w)
    in(components + w) = w < components ? std::log(root_inverse.col(w).norm()) : 0;
  in.tail(InverseNetwork::kOthers) << std::log(size), patch.view.setting.thickness_mm,
      patch.view.setting.x_mm, patch.view.setting.y_mm, nodes.loads.back(),
      std::log(nodes.loads.front() / nodes.loads.back()), std::log(static_cast<double>(loads)),
      std::log(nodes.noise_fraction), std::log(patch.pattern / nodes.peak);
  return in.cast<float>();
}

Answer answer_of(const Model& model, const Eigen::VectorXf& features) {
  namespace at = reader_output;
  const InverseNetwork& inverse = model.inverse;
  const Eigen::MatrixXf in = (features - inverse.in_mean).array() * inverse.in_scale.array();
  Eigen::VectorXd out = Eigen::VectorXd::Zero(at::kCount);
  for (const SmallNetwork& member : inverse.ensemble)
    out += member.apply(in).cast<double>() / static_cast<double>(inverse.ensemble.size());
  Answer answer;
  const double most = out.head(at::kClasses).maxCoeff();
  double sum = 0;
  for (Eigen::Index c = 0; c < at::kClasses; ++c) {
    const auto shape = static_cast<size_t>(at::shape_of(c));
    const double probability = model.shapes[shape] ? std::exp(out(c) - most) : 0;
    sum += probability;
    answer.shape_probability[shape] += probability;
    if (c >= 4) answer.across_probability[shape] = probability;
  }
  for (size_t s = 0; s < 4; ++s) {
    answer.across_probability[s] /= std::max(1e-300, answer.shape_probability[s]);
    answer.shape_probability[s] /= sum;
    for (size_t p = 0; p < kParameters; ++p) {
      const auto first = at::kBells + 3 * static_cast<Eigen::Index>(kParameters * s + p);
      const double scale = inverse.scale[p];
      answer.marginals[s][p] = {inverse.mean[p] + scale * out(first), scale * std::exp(out(first + 1)),
                                scale * std::exp(out(first + 2))};
    }
  }
  for (size_t axis = 0; axis < 2; ++axis) {
    const auto place = at::kShift + static_cast<Eigen::Index>(axis);
    answer.shift_mm[axis] = out(place);
    answer.shift_sd_mm[axis] = std::exp(out(place + 2));
  }
  return answer;
}

Look look_for_lump(const Model& model, const PressedNodes& nodes) {
  const double reach = model.offset_mm + 2;
  PatchView view(model, nodes, find_bump(model, nodes), false);
  bool turned = false;
  for (int move = 0;; ++move) {
    PatchObservation patch(model, nodes, view);
    patch.set_pattern(kUsualPattern * nodes.peak);
    const Answer answer = answer_of(model, network_features(model, nodes, patch));
    double along = 0, across = 0;  // only long shapes have a say
    for (const InclusionShape shape : {InclusionShape::Ellipsoid, InclusionShape::LyingCylinder}) {
      const auto s = static_cast<size_t>(shape);
      across += answer.shape_probability[s] * answer.across_probability[s];
      along += answer.shape_probability[s] * (1 - answer.across_probability[s]);
    }
    const bool turn = !turned && across > along;
    if (move == kMostMoves || (!turn && std::hypot(answer.shift_mm[0], answer.shift_mm[1]) < kNear_mm))
      return {std::move(patch), answer};
    turned |= turn;
    const auto shift = view.to_block(answer.shift_mm[0], answer.shift_mm[1]);
    std::array<double, 2> place = view.center_mm;
    for (size_t axis = 0; axis < 2; ++axis)
      place[axis] = std::clamp(place[axis] + shift[axis], -reach, reach);
    view = PatchView(model, nodes, place, view.swapped != turn);
  }
}

}  // namespace palpate::lump
