#include "engine/lump/fem_inverse/emulated_slopes.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "engine/lump/network/view.h"

namespace palpate::lump {
namespace {

/// Half the differences that slopes are taken over: logarithms, and mm.
constexpr std::array<double, kLumpUnknowns> kHalfSlope = {0.02, 0.02, 0.02, 0.1, 0.1};
constexpr double kHalfForce = 0.02;
constexpr double kPastRange = 0.1;  // of the training's ranges, as far outside as slopes still serve

bool within(double value, const std::array<double, 2>& range) {
  return value >= range[0] * (1 - kPastRange) && value <= range[1] * (1 + kPastRange);
}

Case::Lump changed(Case::Lump lump, size_t unknown, double by) {
  switch (unknown) {
    case kLnSize:
      lump.diameter_mm *= std::exp(by);
      break;
    case kLnDepth:
      lump.depth_mm *= std::exp(by);
      break;
    case kLnRatio:
      lump.stiffness_ratio *= std::exp(by);
      break;
    default:
      lump.offset_mm[unknown - kPlaceX] += by;
  }
  return lump;
}

}  // namespace

EmulatedSlopes::EmulatedSlopes(std::shared_ptr<const Model> model, const ComparedNodes& nodes)
    : model_(std::move(model)), nodes_(nodes) {
  const Observation& o = nodes.observation();
  for (const double force_N : o.force_N)
    loads_.push_back(force_N / (1e-6 * o.block_mm[0] * o.block_mm[1] * o.young_Pa));
  knows_block_ = model_ && std::abs(o.block_mm[0] / model_->block_mm[0] - 1) < 0.02 &&
                 std::abs(o.block_mm[1] / model_->block_mm[1] - 1) < 0.02 &&
                 within(o.block_mm[2], model_->thickness_mm) && !loads_.empty() &&
                 loads_.back() <= model_->load[1] * (1 + kPastRange);
}

bool EmulatedSlopes::knows(const Case::Lump& lump) const {
  return knows_block_ && model_->shapes[static_cast<size_t>(lump.shape)] &&
         within(lump.diameter_mm, model_->size_mm) && within(lump.depth_mm, model_->depth_mm) &&
         within(lump.stiffness_ratio, model_->ratio) &&
         std::max(std::abs(lump.offset_mm[0]), std::abs(lump.offset_mm[1])) < model_->offset_mm + 2;
}

Eigen::VectorXd EmulatedSlopes::values_Pa(const Case::Lump* lump, double force_factor) const {
  std::vector<double> loads = loads_;
  for (double& load : loads) load *= force_factor;
  const double young_Pa = nodes_.observation().young_Pa, thickness_mm = nodes_.observation().block_mm[2];
  const auto count = static_cast<Eigen::Index>(nodes_.count());
  Eigen::MatrixXd values(count, static_cast<Eigen::Index>(loads.size()));
  for (Eigen::Index l = 0; l < values.cols(); ++l) {
    const Eigen::VectorXf quarter = model_->base.quarter(thickness_mm, loads[static_cast<size_t>(l)]);
    for (Eigen::Index n = 0; n < count; ++n)
      values(n, l) =
          model_->base.at(quarter, nodes_.x_mm(static_cast<size_t>(n)), nodes_.y_mm(static_cast<size_t>(n)));
  }
  if (lump != nullptr) {
    PressedNodes block;
    block.thickness_mm = thickness_mm;
    const PatchView view(*model_, block, lump->offset_mm, lump->along_y);
    const Guess guess{lump->shape, std::log(lump->diameter_mm), std::log(lump->depth_mm),
                      std::log(lump->stiffness_ratio)};
    const Eigen::MatrixXd factors = bump_factors(*model_, guess, view.setting, loads, -1);
    Eigen::VectorXf fields(model_->patch.count());
    for (Eigen::Index n = 0; n < count; ++n) {
      const auto [u, v] =
          view.to_patch(nodes_.x_mm(static_cast<size_t>(n)), nodes_.y_mm(static_cast<size_t>(n)));
      if (std::max(std::abs(u), std::abs(v)) > model_->patch.reach_mm()) continue;
      model_->patch.at(u, v, fields.data());
      values.row(n) += fields.cast<double>().transpose() * factors;
    }
  }
  return young_Pa * values.reshaped();
}

Eigen::VectorXd EmulatedSlopes::tissue_Pa() const {
  return values_Pa(nullptr, 1);
}

void EmulatedSlopes::fill(const Case::Lump& lump, Prediction& prediction) const {
  const auto count = static_cast<Eigen::Index>(nodes_.count()),
             loads = static_cast<Eigen::Index>(loads_.size());
  prediction.by_unknown.resize(count * loads, kLumpUnknowns);
  for (size_t p = 0; p < kLumpUnknowns; ++p) {
    const Case::Lump above = changed(lump, p, kHalfSlope[p]), below = changed(lump, p, -kHalfSlope[p]);
    prediction.by_unknown.col(static_cast<Eigen::Index>(p)) =
        (values_Pa(&above, 1) - values_Pa(&below, 1)) / (2 * kHalfSlope[p]);
  }
  // A force alone changes its own load's pressure alone; modulus and forces together scale everything.
  const Eigen::VectorXd by_force =
      (values_Pa(&lump, std::exp(kHalfForce)) - values_Pa(&lump, std::exp(-kHalfForce))) / (2 * kHalfForce);
  prediction.by_force = Eigen::MatrixXd::Zero(count * loads, loads);
  for (Eigen::Index l = 0; l < loads; ++l)
    prediction.by_force.col(l).segment(l * count, count) = by_force.segment(l * count, count);
  prediction.by_modulus = prediction.pressure_Pa - by_force;
}

}  // namespace palpate::lump
