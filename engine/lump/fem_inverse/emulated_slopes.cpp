#include "engine/lump/fem_inverse/emulated_slopes.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "engine/numeric/dense.h"

namespace palpate::lump {
namespace {

/// Half the differences that slopes are taken over: logarithms, and mm.
constexpr std::array<double, kLumpUnknowns> kHalfSlope = {0.02, 0.02, 0.02, 0.1, 0.1};
constexpr double kHalfForce = 0.02;
constexpr double kPastRange = 0.1;  // of the training's ranges, as far outside as the emulator is asked

constexpr double kFarPastRange = 0.3;  // the same of differences that elements are asked about again
constexpr double kFarOff_mm = 4;
/// Patches look from the block's middle outwards. A lump in the middle looks the same to both sides, which
/// the emulator does not quite: the nearer to it, the more both ways are averaged.
constexpr double kBlend_mm = 1;

/// How the bump of a small ball grows with its stiffness, in tissue that keeps its volume.
double contrast(double ratio) {
  return (ratio - 1) / (ratio + 1.5);
}

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

bool EmulatedSlopes::reaches(const Case::Lump& lump) const {
  return knows_block_ && model_->shapes[static_cast<size_t>(lump.shape)] &&
         lump.diameter_mm < model_->size_mm[1] * (1 + kFarPastRange) &&
         lump.depth_mm > model_->depth_mm[0] * (1 - kFarPastRange) &&
         lump.depth_mm < model_->depth_mm[1] * (1 + kFarPastRange) &&
         std::max(std::abs(lump.offset_mm[0]), std::abs(lump.offset_mm[1])) < model_->offset_mm + kFarOff_mm;
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

PatchView EmulatedSlopes::view_of(const Case::Lump& lump) const {
  PressedNodes block;
  block.thickness_mm = nodes_.observation().block_mm[2];
  return {*model_, block, lump.offset_mm, lump.along_y};
}

Eigen::MatrixXd EmulatedSlopes::fields_at(const PatchView& view) const {
  Eigen::MatrixXd all =
      Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(nodes_.count()), model_->patch.count());
  Eigen::VectorXf fields(model_->patch.count());
  const double side_u = std::min(1.0, std::abs(view.setting.x_mm) / kBlend_mm),
               side_v = std::min(1.0, std::abs(view.setting.y_mm) / kBlend_mm);
  for (size_t n = 0; n < nodes_.count(); ++n) {
    const auto [u, v] = view.to_patch(nodes_.x_mm(n), nodes_.y_mm(n));
    if (std::max(std::abs(u), std::abs(v)) > model_->patch.reach_mm()) continue;
    for (const double to_u : {1.0, -1.0})
      for (const double to_v : {1.0, -1.0}) {
        const double weight = (1 + to_u * side_u) * (1 + to_v * side_v) / 4;
        if (weight == 0) continue;
        model_->patch.at(to_u * u, to_v * v, fields.data());
        all.row(static_cast<Eigen::Index>(n)) += weight * fields.cast<double>();
      }
  }
  return all;
}

Eigen::MatrixXd EmulatedSlopes::factors_Pa(const Case::Lump& lump, const PatchView& view,
                                           const std::vector<double>& loads) const {
  const double size_mm = std::max(lump.diameter_mm, model_->size_mm[0] * (1 - kPastRange)),
               smaller = lump.diameter_mm / size_mm,
               ratio =
                   std::clamp(lump.stiffness_ratio, model_->ratio[0], model_->ratio[1] * (1 + kPastRange));
  // The middle of a smaller lump stays where it is.
  const double depth_mm =
      std::max(lump.depth_mm - size_mm * (1 - smaller) / 2, model_->depth_mm[0] * (1 - kFarPastRange));
  const Guess guess{lump.shape, std::log(size_mm), std::log(depth_mm), std::log(ratio)};
  const double scale =
      nodes_.observation().young_Pa * std::pow(smaller, 3) * contrast(lump.stiffness_ratio) / contrast(ratio);
  return scale * bump_factors(*model_, guess, view.setting, loads, -1);
}

Eigen::MatrixXd EmulatedSlopes::bump_Pa(const Case::Lump& lump, const std::vector<double>& loads) const {
  const PatchView view = view_of(lump);
  return dense::product(fields_at(view), factors_Pa(lump, view, loads));
}

Eigen::VectorXd EmulatedSlopes::bump_Pa(const Case::Lump& lump) const {
  return bump_Pa(lump, loads_).reshaped();
}

Eigen::VectorXd EmulatedSlopes::tissue_Pa() const {
  return tissue_Pa(loads_).reshaped();
}

void EmulatedSlopes::fill(const Case::Lump& lump, Prediction& prediction) const {
  const auto count = static_cast<Eigen::Index>(nodes_.count()),
             loads = static_cast<Eigen::Index>(loads_.size());
  prediction.by_unknown.resize(count * loads, kLumpUnknowns);
  const PatchView view = view_of(lump);
  const Eigen::MatrixXd fields = fields_at(view);
  for (size_t p = 0; p < kLumpUnknowns; ++p) {
    const double half = kHalfSlope[p];
    const Case::Lump above = changed(lump, p, half), below = changed(lump, p, -half);
    const Eigen::MatrixXd change =
        p < kPlaceX
            ? dense::product(fields, factors_Pa(above, view, loads_) - factors_Pa(below, view, loads_))
            : bump_Pa(above, loads_) - bump_Pa(below, loads_);
    prediction.by_unknown.col(static_cast<Eigen::Index>(p)) = change.reshaped() / (2 * half);
  }
  const auto forced_Pa = [&](double log_factor) -> Eigen::MatrixXd {
    std::vector<double> forced = loads_;
    for (double& load : forced) load *= std::exp(log_factor);
    return tissue_Pa(forced) + dense::product(fields, factors_Pa(lump, view, forced));
  };
  // A force alone changes its own load's pressure alone; modulus and forces together scale everything.
  const Eigen::MatrixXd by_force = (forced_Pa(kHalfForce) - forced_Pa(-kHalfForce)) / (2 * kHalfForce);
  prediction.by_force = Eigen::MatrixXd::Zero(count * loads, loads);
  for (Eigen::Index l = 0; l < loads; ++l)
    prediction.by_force.col(l).segment(l * count, count) = by_force.col(l);
  prediction.by_modulus = prediction.pressure_Pa - by_force.reshaped();
}

}  // namespace palpate::lump
