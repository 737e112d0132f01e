#include "engine/grip/grip.h"

#include <algorithm>
#include <cmath>
#include <initializer_list>

#include "engine/measure/quantities.h"

namespace palpate {
namespace {

/// Sum of parts with factors; of the first part's state that is not valid.
struct Part {
  double factor;
  Estimate of;
};
Estimate sum(std::initializer_list<Part> parts) {
  Estimate total{0, 0, Validity::Valid};
  double variance = 0;
  for (const auto& [factor, of] : parts) {
    total.value += factor * of.value;
    variance += factor * factor * of.standard_error * of.standard_error;
    if (total.valid()) total.validity = of.validity;
  }
  total.standard_error = std::sqrt(variance);
  return total;
}

/// Turn of the object about the closing direction that one pad's skin shows.
Estimate turn_of(const Touch& touch, const PadPose& pad, const Vector3& closing) {
  if (!touch.contact) return {0, 0, Validity::NoContact};
  if (!touch.skin) return {};
  const Vector3 normal = {pad.rotation[0][2], pad.rotation[1][2], pad.rotation[2][2]};
  return sum({{scalar_product(normal, closing), touch.skin->torsion_rad}});
}

/// Both, each by its error; of two that are not both valid the valid one.
Estimate joined(const Estimate& a, const Estimate& b) {
  if (!a.valid()) return b.valid() ? b : a;
  if (!b.valid()) return a;
  const double va = a.standard_error * a.standard_error, vb = b.standard_error * b.standard_error;
  const double share = va + vb > 0 ? vb / (va + vb) : 0.5;
  return sum({{share, a}, {1 - share, b}});
}

/// How much a slip says: one that is known before one that is not, the worse first.
int rank(Slip slip) {
  switch (slip) {
    case Slip::Slip:
      return 5;
    case Slip::Incipient:
      return 4;
    case Slip::PictureDamaged:
      return 3;
    case Slip::NotCalibrated:
      return 2;
    case Slip::Stick:
      return 1;
    case Slip::NoContact:
      return 0;
  }
  return 0;
}

Estimate indentation(const Touch& touch) {
  if (!touch.contact) return {0, 0, Validity::NoContact};
  if (!touch.surface) return {};
  return {touch.surface->depth_max_mm, touch.surface->depth_sd_mm, touch.surface->validity};
}

}  // namespace

const char* to_string(StiffnessState state) {
  switch (state) {
    case StiffnessState::Known:
      return "known";
    case StiffnessState::ForceInDoubt:
      return "force in doubt";
    case StiffnessState::NotGripped:
      return "not gripped";
    case StiffnessState::NoThickness:
      return "thickness not known";
    case StiffnessState::NotIdentifiable:
      return "not identifiable";
  }
  return "?";
}

void StiffnessFit::add(const Estimate& force_N, const Estimate& thickness_mm) {
  if (!has_value(force_N) || !thickness_mm.valid()) return;
  const double force = force_N.value, thickness = thickness_mm.value;
  if (frames_ == 0) thinnest_mm_ = thickest_mm_ = thickness;
  const double n = static_cast<double>(++frames_);
  const double from_force = force - mean_force_, from_thickness = thickness - mean_thickness_;
  mean_force_ += from_force / n;
  mean_thickness_ += from_thickness / n;
  force_squares_ += from_force * (force - mean_force_);
  thickness_squares_ += from_thickness * (thickness - mean_thickness_);
  products_ += from_thickness * (force - mean_force_);
  force_variances_ += force_N.standard_error * force_N.standard_error;
  thickness_variances_ += thickness_mm.standard_error * thickness_mm.standard_error;
  thinnest_mm_ = std::min(thinnest_mm_, thickness);
  thickest_mm_ = std::max(thickest_mm_, thickness);
  if (force > hardest_N_) {
    hardest_N_ = force;
    relative_force_ = force_N.standard_error / force;
    thickness_sd_mm_ = thickness_mm.standard_error;
  }
}

Estimate StiffnessFit::stiffness_N_per_mm() const {
  if (frames_ < kFewest || hardest_N_ <= 0 || thickness_squares_ <= 0 || force_squares_ <= 0) return {};
  // The line that lies nearest to the points in units of their errors (total least squares).
  const double n = static_cast<double>(frames_);
  const double force_unit = force_variances_ > 0 ? std::sqrt(force_variances_ / n) : 1;
  const double thickness_unit = thickness_variances_ > 0 ? std::sqrt(thickness_variances_ / n) : 1;
  const double a = thickness_squares_ / (thickness_unit * thickness_unit);
  const double b = force_squares_ / (force_unit * force_unit);
  const double c = products_ / (thickness_unit * force_unit);
  const double middle = (a + b) / 2, away = std::hypot((a - b) / 2, c);
  const double along = middle + away, across = std::max(0.0, middle - away);
  const double angle = std::atan2(2 * c, a - b) / 2, slope = std::tan(angle);
  const double value = -slope * force_unit / thickness_unit;
  const double angle_sd = std::sqrt(along * across / (n - 2)) / (along - across);
  const double relative_scatter = (1 + slope * slope) * angle_sd / std::abs(slope);
  const double relative_thickness = thickness_sd_mm_ / (thickest_mm_ - thinnest_mm_);
  const double relative = std::hypot(relative_scatter, relative_force_, relative_thickness);
  if (!(value > 0) || !(relative <= kLargestRelative)) return {};
  return {value, relative * value, Validity::Valid};
}

Grip GripMeter::add(const Touch& left, const Touch& right, const Estimate& opening_mm) {
  Grip grip;
  const auto& [pads, closing] = geometry_;
  grip.force_N = sum({{0.5, left.force_N}, {0.5, right.force_N}});
  grip.imbalance_N = sum({{-1, left.force_N}, {1, right.force_N}});
  Estimate* const load[] = {&grip.load_x_N, &grip.load_y_N, &grip.load_z_N};
  for (size_t axis = 0; axis < 3; ++axis) {
    const Vector3 &l = pads[0].rotation[axis], &r = pads[1].rotation[axis];
    *load[axis] = sum(
        {{l[0], left.shear_x_N}, {l[1], left.shear_y_N}, {r[0], right.shear_x_N}, {r[1], right.shear_y_N}});
  }
  grip.turn_rad = joined(turn_of(left, pads[0], closing), turn_of(right, pads[1], closing));
  grip.slip = rank(left.slip) >= rank(right.slip) ? left.slip : right.slip;
  const double faces_mm =
      scalar_product(pads[1].translation_mm, closing) - scalar_product(pads[0].translation_mm, closing);
  grip.thickness_mm = sum({{1, indentation(left)},
                           {1, indentation(right)},
                           {1, opening_mm},
                           {1, {faces_mm, 0, Validity::Valid}}});
  if (!left.contact || !right.contact) {
    fit_ = doubted_ = {};
    grip.stiffness_N_per_mm.validity = Validity::NoContact;
    return grip;
  }
  if (grip.force_N.valid())
    fit_.add(grip.force_N, grip.thickness_mm);
  else
    doubt_ = grip.force_N.validity;
  doubted_.add(grip.force_N, grip.thickness_mm);
  Estimate& stiffness = grip.stiffness_N_per_mm;
  stiffness = fit_.stiffness_N_per_mm();
  grip.stiffness = stiffness.valid()           ? StiffnessState::Known
                   : grip.thickness_mm.valid() ? StiffnessState::NotIdentifiable
                                               : StiffnessState::NoThickness;
  if (stiffness.valid()) return grip;
  stiffness = doubted_.stiffness_N_per_mm();
  if (!stiffness.valid()) return grip;
  stiffness.validity = doubt_;
  grip.stiffness = StiffnessState::ForceInDoubt;
  return grip;
}

}  // namespace palpate
