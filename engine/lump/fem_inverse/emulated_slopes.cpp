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

}  // namespace

EmulatedSlopes::EmulatedSlopes(std::shared_ptr<const Model> model, const ComparedNodes& nodes)
    : model_(std::move(model)), nodes_(nodes) {
  const Observation& o = nodes.observation();
  loads_ = loads_of(o);
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

Eigen::MatrixXd EmulatedSlopes::tissue_Pa(const std::vector<double>& loads) const {
  const Observation& o = nodes_.observation();
  Eigen::MatrixXd values(nodes_.count(), loads.size());
  for (size_t l = 0; l < loads.size(); ++l) {
    const Eigen::VectorXf quarter = model_->base.quarter(o.block_mm[2], loads[l]);
    for (size_t n = 0; n < nodes_.count(); ++n)
      values(static_cast<Eigen::Index>(n), static_cast<Eigen::Index>(l)) =
          o.young_Pa * model_->base.at(quarter, nodes_.x_mm(n), nodes_.y_mm(n));
  }
  return values;
}

Eigen::MatrixXd EmulatedSlopes::bump_Pa(const Case::Lump& lump, const std::vector<double>& loads) const {
  const Observation& o = nodes_.observation();
  PressedNodes block;
  block.thickness_mm = o.block_mm[2];
  const PatchView view(*model_, block, lump.offset_mm, lump.along_y);
  const Guess guess{lump.shape, std::log(lump.diameter_mm), std::log(lump.depth_mm),
                    std::log(lump.stiffness_ratio)};
  const Eigen::MatrixXd factors = o.young_Pa * bump_factors(*model_, guess, view.setting, loads, -1);
  Eigen::MatrixXd values = Eigen::MatrixXd::Zero(nodes_.count(), loads.size());
  Eigen::VectorXf fields(model_->patch.count());
  for (size_t n = 0; n < nodes_.count(); ++n) {
    const auto [u, v] = view.to_patch(nodes_.x_mm(n), nodes_.y_mm(n));
    if (std::max(std::abs(u), std::abs(v)) > model_->patch.reach_mm()) continue;
    model_->patch.at(u, v, fields.data());
    values.row(static_cast<Eigen::Index>(n)) = fields.cast<double>().transpose() * factors;
  }
  return values;
}

Eigen::VectorXd EmulatedSlopes::tissue_Pa() const {
  return tissue_Pa(loads_).reshaped();
}

void EmulatedSlopes::fill(const Case::Lump& lump, Prediction& prediction) const {
  const auto count = static_cast<Eigen::Index>(nodes_.count()),
             loads = static_cast<Eigen::Index>(loads_.size());
  prediction.by_unknown.resize(count * loads, kLumpUnknowns);
  for (size_t p = 0; p < kLumpUnknowns; ++p) {
    const double half = kHalfSlope[p];
    prediction.by_unknown.col(static_cast<Eigen::Index>(p)) =
        (bump_Pa(changed(lump, p, half), loads_) - bump_Pa(changed(lump, p, -half), loads_)).reshaped() /
        (2 * half);
  }
  const auto forced_Pa = [&](double log_factor) -> Eigen::MatrixXd {
    std::vector<double> forced = loads_;
    for (double& load : forced) load *= std::exp(log_factor);
    return tissue_Pa(forced) + bump_Pa(lump, forced);
  };
  // A force alone changes its own load's pressure alone; modulus and forces together scale everything.
  const Eigen::MatrixXd by_force = (forced_Pa(kHalfForce) - forced_Pa(-kHalfForce)) / (2 * kHalfForce);
  prediction.by_force = Eigen::MatrixXd::Zero(count * loads, loads);
  for (Eigen::Index l = 0; l < loads; ++l)
    prediction.by_force.col(l).segment(l * count, count) = by_force.col(l);
  prediction.by_modulus = prediction.pressure_Pa - by_force.reshaped();
}

}  // namespace palpate::lump
