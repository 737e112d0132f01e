#include "engine/lump/tissue/found_tissue.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <optional>

#include "engine/base/normal.h"
#include "engine/base/text.h"
#include "engine/lump/tissue/block_stiffness.h"
#include "palpate/error.h"

namespace palpate::lump {
namespace {

constexpr double kGauge = 0.002;  // of each force by itself
constexpr double kAlike = 0.5;  // of the ways' variance, what is alike at all loads: where the plate touches
constexpr double kContradicts = 3;  // standard errors
constexpr double kGrid = 0.0025;    // of a block's force: what cells of other sizes make of it
constexpr std::array kThickness_mm = {15.5, 24.5};
constexpr double kMostCompression = 0.3;
constexpr int kRounds = 12;

/// A block as it is pressed, with what an estimate says of the lump in it.
class PressedBlock {
 public:
  PressedBlock(const Observation& observation, const Estimate& estimate) : o_(observation) {
    if (estimate.lumps.size() == 2 && estimate.lumps[0].size_mm.value > 0 &&
        estimate.lumps[1].size_mm.value > 0) {
      lump_ = lump_of(estimate.lumps[0]);
      ratio_ = estimate.lumps[0].stiffness_ratio;
      second_ = lump_of(estimate.lumps[1]);
      return;
    }
    if (!(estimate.detection_statistic >= 1) || !(estimate.size_mm.value > 0)) return;
    lump_ = lump_of(estimate);
    ratio_ = estimate.stiffness_ratio;
  }

  size_t loads() const { return o_.force_N.size(); }
  /// Logarithm of the force at a load that tissue of 1 Pa would answer to the way less `zero_mm`.
  double log_force(size_t k, double thickness_mm, double zero_mm) const {
    const std::array block = {o_.block_mm[0], o_.block_mm[1], thickness_mm};
    const double compression = std::clamp((o_.press_mm[k] - zero_mm) / thickness_mm, 1e-4, 0.49);
    const BlockStiffness& stiffness = BlockStiffness::built_in();
    double load = stiffness.load(block, lump_, compression);
    // Each of two lumps stiffens the block by its own factor.
    if (second_)
      load *= stiffness.load(block, second_, compression) / stiffness.load(block, std::nullopt, compression);
    return std::log(1e-6 * block[0] * block[1] * load);
  }
  /// Standard error of what the relation leaves, alike at all loads.
  double model_sd() const {
    const BlockStiffness& stiffness = BlockStiffness::built_in();
    const double plain = std::hypot(stiffness.plain_sd, kGrid);
    if (!lump_) return plain;
    const double compression = o_.press_mm.back() / o_.block_mm[2];
    const auto added = [&](double ratio) {
      Case::Lump lump = *lump_;
      lump.stiffness_ratio = ratio;
      return stiffness.by_lump(lump, o_.block_mm, compression);
    };
    const double open = (added(ratio_.high) - added(ratio_.low)) / (2 * kNormal90);
    return std::sqrt(plain * plain + std::pow(stiffness.lump_sd * added(ratio_.value), 2) + open * open);
  }

 private:
  const Observation& o_;
  std::optional<Case::Lump> lump_, second_;
  Value ratio_;
};

/// Unknowns: logarithms of modulus and thickness, the way at which the plate touches, what the relation is
/// off.
enum Unknown : uint8_t { kYoung, kThickness, kZero, kModel, kUnknowns };
using Vector4 = Eigen::Matrix<double, kUnknowns, 1>;
using Matrix4 = Eigen::Matrix<double, kUnknowns, kUnknowns>;

struct TissuePosterior {
  Vector4 at = Vector4::Zero();
  Matrix4 covariance = Matrix4::Zero();
  double chi_square = 0;  ///< of the ways and forces, and of where the plate touches
};

/// Least squares by Gauss and Newton. `prior_sd` of each unknown around `middle`; infinite: none.
TissuePosterior fit(const PressedBlock& block, const Observation& o, const Vector4& middle,
                    const Vector4& prior_sd) {
  const double way_sd = o.press_sd_mm * std::sqrt(1 - kAlike);
  TissuePosterior p;
  p.at = middle;
  const auto residual = [&](size_t k, const Vector4& x) {
    return std::log(o.force_N[k]) - block.log_force(k, std::exp(x(kThickness)), x(kZero)) - x(kYoung) -
           x(kModel);
  };
  for (int round = 0; round < kRounds; ++round) {
    Matrix4 normal = Matrix4::Zero();
    Vector4 right = Vector4::Zero();
    p.chi_square = 0;
    for (Eigen::Index i = 0; i < kUnknowns; ++i) {
      if (!(prior_sd(i) > 0)) continue;
      normal(i, i) = std::pow(prior_sd(i), -2);
      right(i) = (middle(i) - p.at(i)) * normal(i, i);
    }
    p.chi_square += prior_sd(kZero) > 0 ? std::pow((p.at(kZero) - middle(kZero)) / prior_sd(kZero), 2) : 0;
    for (size_t k = 0; k < block.loads(); ++k) {
      Vector4 slope = Vector4::Zero();
      for (Eigen::Index i = 0; i < kUnknowns; ++i) {
        constexpr double kStep = 1e-4;
        Vector4 more = p.at, less = p.at;
        more(i) += kStep;
        less(i) -= kStep;
        slope(i) = (residual(k, less) - residual(k, more)) / (2 * kStep);
      }
      const double variance = kGauge * kGauge + std::pow(slope(kZero) * way_sd, 2);
      const double left = residual(k, p.at);
      for (Eigen::Index i = 0; i < kUnknowns; ++i)
        if (!(prior_sd(i) > 0)) slope(i) = 0;
      normal += slope * slope.transpose() / variance;
      right += slope * left / variance;
      p.chi_square += left * left / variance;
    }
    for (Eigen::Index i = 0; i < kUnknowns; ++i)
      if (!(prior_sd(i) > 0)) normal(i, i) = 1e18;  // exact
    p.covariance = normal.inverse();
    const Vector4 step = p.covariance * right;
    p.at += step;
    if (step.cwiseAbs().maxCoeff() < 1e-9) break;
  }
  return p;
}

void check(const Observation& o) {
  if (o.press_mm.size() != o.force_N.size())
    throw Error(Failure::Usage, text("a way of the plate for each of %zu forces", o.force_N.size()),
                std::to_string(o.press_mm.size()), "--press-mm P1,P2,...");
  if (!(o.press_sd_mm >= 0))
    throw Error(Failure::Usage, "a standard error of the way of 0 mm or more", text("%g", o.press_sd_mm),
                "0.05");
  for (size_t k = 0; k < o.press_mm.size(); ++k)
    if (!(o.press_mm[k] > (k > 0 ? o.press_mm[k - 1] : 0)) || !std::isfinite(o.press_mm[k]))
      throw Error(Failure::Usage, "ways of the plate from where it touches, mm, that rise with the force",
                  text("%g mm at load %zu", o.press_mm[k], k + 1), "--press-mm 0.8,1.5,2.1,2.6");
}

/// Why the relation does not hold for this block; empty: it does.
std::string out_of_range(const Observation& o) {
  if (std::abs(o.block_mm[0] - 40) > 0.5 || std::abs(o.block_mm[1] - 40) > 0.5)
    return text("the way of the plate tells the modulus of blocks of 40 x 40 mm, this one has %.3g x %.3g mm",
                o.block_mm[0], o.block_mm[1]);
  if (o.block_mm[2] < kThickness_mm[0] || o.block_mm[2] > kThickness_mm[1])
    return text("the way of the plate tells the modulus of tissue 16 to 24 mm thick, this one is %.3g mm",
                o.block_mm[2]);
  if (o.press_mm.back() > kMostCompression * o.block_mm[2])
    return text("the way of the plate tells the modulus up to %.2g of the thickness, %.3g mm is more",
                kMostCompression, o.press_mm.back());
  return {};
}

}  // namespace

Tissue FoundTissue::tissue() const {
  const auto around = [](double value, double sd) {
    return Value{value, value * std::exp(-kNormal90 * sd), value * std::exp(kNormal90 * sd)};
  };
  return {around(young_Pa, young_sd), around(thickness_mm, thickness_sd)};
}

FoundTissue find_tissue(const Observation& o, const TissuePrior& prior, const Estimate& lump) {
  check(o);
  FoundTissue found;
  found.unusable = out_of_range(o);
  if (!found.unusable.empty()) return found;
  const PressedBlock block(o, lump);
  const double zero_sd = o.press_sd_mm * std::sqrt(kAlike);
  const auto infinite = std::numeric_limits<double>::infinity();
  // Without a prior of the modulus first: what the way says alone.
  const double start = std::log(o.force_N.back()) - block.log_force(o.force_N.size() - 1, o.block_mm[2], 0);
  const TissuePosterior by_way = fit(block, o, {start, std::log(o.block_mm[2]), 0, 0},
                                     {infinite, prior.thickness_sd, zero_sd, block.model_sd()});
  const auto loads = static_cast<double>(block.loads());
  // Twice what is as good as never exceeded: more of the ways' errors may be each load's own than is taken
  // here.
  if (by_way.chi_square > 2 * (loads + 4 * std::sqrt(2 * loads)))
    found.contradiction = text(
        "ways of the plate and forces fit no tissue of one modulus: they are off by %.2g times their "
        "standard "
        "errors; is the way counted from where the plate touches, in mm, and known to %.2g mm?",
        std::sqrt(by_way.chi_square / loads), o.press_sd_mm);
  TissuePosterior p = by_way;
  const double told = std::log(o.young_Pa), sd = std::sqrt(by_way.covariance(kYoung, kYoung));
  if (std::isfinite(prior.young_sd) &&
      std::abs(by_way.at(kYoung) - told) > kContradicts * std::hypot(sd, prior.young_sd)) {
    const double young_Pa = std::exp(by_way.at(kYoung)), factor = std::exp(kNormal90 * sd);
    found.contradiction = text(
        "by the way of the plate the tissue's modulus is %.4g Pa (%.4g to %.4g), %.4g Pa is stated: was that "
        "measured on this tissue, is the way counted from where the plate touches, does the floor hold the "
        "block and the plate let it slide, is a skin on it that was not told?",
        young_Pa, young_Pa / factor, young_Pa * factor, o.young_Pa);
  } else if (std::isfinite(prior.young_sd)) {
    p = fit(block, o, {told, std::log(o.block_mm[2]), 0, 0},
            {prior.young_sd, prior.thickness_sd, zero_sd, block.model_sd()});
  }
  const double of_thickness = p.covariance(kThickness, kThickness);
  found.young_Pa = std::exp(p.at(kYoung));
  found.thickness_mm = std::exp(p.at(kThickness));
  found.young_sd = std::sqrt(p.covariance(kYoung, kYoung));
  found.thickness_sd = prior.thickness_sd > 0 ? std::sqrt(of_thickness) : 0;
  found.young_by_thickness = prior.thickness_sd > 0 ? p.covariance(kYoung, kThickness) / of_thickness : 0;
  found.young_sd_at_thickness = std::sqrt(std::max(
      0.0, p.covariance(kYoung, kYoung) - found.young_by_thickness * p.covariance(kYoung, kThickness)));
  return found;
}

}  // namespace palpate::lump
