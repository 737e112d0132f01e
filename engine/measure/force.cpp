#include "engine/measure/force.h"

#include <algorithm>
#include <cmath>
#include <span>

namespace palpate {
namespace {

using Knots = std::span<const std::array<double, 2>>;

double chord(Knots knots, size_t i) {
  return (knots[i + 1][1] - knots[i][1]) / (knots[i + 1][0] - knots[i][0]);
}

/// Slope at a knot that keeps the cubic monotone: the weighted harmonic mean of the chords on both sides
/// (Fritsch and Butland's choice of Fritsch and Carlson's), 0 at a level chord; at the ends the parabola's,
/// limited.
double slope_at(Knots knots, size_t i) {
  const size_t last = knots.size() - 1;
  if (last == 1) return chord(knots, 0);
  const auto width = [&](size_t k) { return knots[k + 1][0] - knots[k][0]; };
  if (i == 0 || i == last) {
    const size_t near = i == 0 ? 0 : last - 1, next = i == 0 ? 1 : last - 2;
    const double d0 = chord(knots, near), d1 = chord(knots, next);
    const double slope =
        ((2 * width(near) + width(next)) * d0 - width(near) * d1) / (width(near) + width(next));
    if (slope * d0 <= 0) return 0;
    return d0 * d1 <= 0 && std::abs(slope) > 3 * std::abs(d0) ? 3 * d0 : slope;
  }
  const double d0 = chord(knots, i - 1), d1 = chord(knots, i);
  if (d0 * d1 <= 0) return 0;
  const double w0 = 2 * width(i) + width(i - 1), w1 = width(i) + 2 * width(i - 1);
  return (w0 + w1) / (w0 / d0 + w1 / d1);
}

double spline_at(Knots knots, double s) {
  if (knots.empty()) return 0;
  if (!(s > knots.front()[0])) return knots.front()[1];
  if (!(s < knots.back()[0])) return knots.back()[1];
  size_t i = 0;
  while (s >= knots[i + 1][0]) ++i;
  const double h = knots[i + 1][0] - knots[i][0], t = (s - knots[i][0]) / h;
  const double t2 = t * t, t3 = t2 * t;
  return (2 * t3 - 3 * t2 + 1) * knots[i][1] + (t3 - 2 * t2 + t) * h * slope_at(knots, i) +
         (3 * t2 - 2 * t3) * knots[i + 1][1] + (t3 - t2) * h * slope_at(knots, i + 1);
}

/// The factor of c1.
double basis(ForceModel model, double exponent, double s) {
  return model == ForceModel::Power ? std::pow(std::max(s, 0.0), exponent) : s;
}

double value_at(ForceModel model, double c1, double c0_N, double exponent, Knots knots, double s) {
  if (model == ForceModel::Spline) return spline_at(knots, s);
  return c1 * basis(model, exponent, s) + c0_N;
}

constexpr double kNormal95 = 1.96;  // half an interval of 95 %, standard errors
constexpr double kBlindPixels = 9;  // whose slopes a saturated pixel spoils

template <typename Shape>
double hidden_gray(const Shape& shape) {
  if (shape.saturated_px == 0) return 0;
  const double most_gray = static_cast<double>(shape.saturated_px) * shape.peak_gray;
  return most_gray < shape.gray_sum ? most_gray / shape.gray_sum : 1;
}

template <typename Shape>
double hidden_slopes(const Shape& shape) {
  if (shape.saturated_px == 0) return 0;
  const double most_px = kBlindPixels * static_cast<double>(shape.saturated_px);
  return most_px < static_cast<double>(shape.area_px) ? most_px / static_cast<double>(shape.area_px) : 1;
}

double hidden_fraction(ForceSignal signal, const ForceFeatures& r) {
  if (signal == ForceSignal::Area) return 0;
  return signal == ForceSignal::GraySum ? r.hidden_gray : r.hidden_slopes;
}

}  // namespace

ForceFeatures force_features(const Touch& t) {
  return {t.gray_sum,
          static_cast<double>(t.area_px),
          t.surface ? t.surface->volume_mm3 : 0,
          t.surface.has_value(),
          t.contact,
          hidden_gray(t),
          hidden_slopes(t),
          t.at_border,
          t.gradient_sum.value_or(0),
          t.gradient_sum.has_value(),
          t.traction ? t.traction->fz_N.value : 0,
          t.traction ? t.traction->fz_N.standard_error : 0,
          t.traction.has_value(),
          t.traction ? t.traction->fz_N.validity : Validity::NotCalibrated,
          t.traction ? t.traction->bending_mm.value_or(0) : 0,
          t.traction && t.traction->bending_mm.value_or(0) > 0};
}

ForceFeatures force_features(const ContactTouch& c) {
  return {c.gray_sum,
          static_cast<double>(c.area_px),
          0,
          false,
          true,
          hidden_gray(c),
          hidden_slopes(c),
          c.at_border,
          0,
          false,
          0,
          0,
          false,
          Validity::NotCalibrated,
          0,
          false};
}

ForceFeatures reading_at(const ForceCalibration& c, double signal) {
  ForceFeatures reading;
  if (c.bending_N_per_mm > 0) reading.bending_mm = signal / c.bending_N_per_mm;
  reading.gray_sum = reading.area_px = reading.volume_mm3 = reading.gradient_sum = reading.layer_N = signal;
  reading.has_volume = reading.has_gradient = reading.has_layer = reading.has_bending = reading.contact =
      true;
  reading.layer_validity = Validity::Valid;
  return reading;
}

bool has_signal(ForceSignal signal, const ForceFeatures& r) {
  switch (signal) {
    case ForceSignal::GraySum:
    case ForceSignal::Area:
      return true;
    case ForceSignal::Volume:
      return r.has_volume;
    case ForceSignal::Gradient:
      return r.has_gradient;
    case ForceSignal::Layer:
      return r.has_layer;
    case ForceSignal::LayerAndBending:
      return r.has_layer && r.has_bending;
  }
  return false;
}

double signal_of(const ForceCalibration& c, const ForceFeatures& r) {
  switch (c.signal) {
    case ForceSignal::GraySum:
      return r.gray_sum;
    case ForceSignal::Area:
      return r.area_px;
    case ForceSignal::Volume:
      return r.volume_mm3;
    case ForceSignal::Gradient:
      return r.gradient_sum;
    case ForceSignal::Layer:
      return r.layer_N;
    case ForceSignal::LayerAndBending:
      return 0.5 * (r.layer_N + c.bending_N_per_mm * r.bending_mm);
  }
  return 0;
}

double growing_scatter_N(const ForceCalibration& c, double force_N) {
  const double end_N = c.residual_grows_to_N, size_N = std::abs(force_N);
  return c.residual_fraction * (end_N > 0 ? std::min(size_N, end_N) : size_N);
}

double force_at(const ForceCalibration& c, double s) {
  return value_at(c.model, c.c1_N_per_gray, c.c0_N, c.exponent, c.knots, s);
}

double force_at(ForceModel model, const ForceCurve& c, double s) {
  return value_at(model, c.c1, c.c0_N, c.exponent, c.knots, s);
}

void LoadDirection::interrupt() {
  in_contact_ = false;
  interrupted_ = true;
}

double LoadDirection::update(bool contact, double signal, double width) {
  const bool unseen = interrupted_;
  interrupted_ = false;
  if (!contact) {
    in_contact_ = false;
    return unloading_ = 0;
  }
  if (!in_contact_) {
    in_contact_ = true;
    unloading_ = unseen ? 0.5 : 0;
  } else if (width > 0) {
    unloading_ = std::clamp(unloading_ - (signal - last_) / width, 0.0, 1.0);
  }
  last_ = signal;
  return unloading_;
}

Estimate force_of(const ForceCalibration& c, const ForceFeatures& r, double unloading) {
  if (!r.contact) return {0, 0, Validity::NoContact};
  if (!has_signal(c.signal, r)) return {};
  const double s = signal_of(c, r);
  double value = force_at(c, s), scatter_N = c.residual_sd_N, gap_sd_N = 0;
  if (c.loading && c.unloading) {
    const double up = force_at(c.model, *c.loading, s), down = force_at(c.model, *c.unloading, s);
    const double w = std::clamp(unloading, 0.0, 1.0);
    value = (1 - w) * up + w * down;
    scatter_N =
        std::hypot(std::sqrt(1 - w) * c.loading->residual_sd_N, std::sqrt(w) * c.unloading->residual_sd_N);
    gap_sd_N = std::sqrt(w * (1 - w)) * std::abs(up - down);
  }
  const auto& [var_c0, covariance, var_c1] = c.covariance;
  const double g = basis(c.model, c.exponent, s);
  const double share_N = growing_scatter_N(c, value);
  double variance = scatter_N * scatter_N + share_N * share_N + gap_sd_N * gap_sd_N + var_c0 +
                    2 * g * covariance + g * g * var_c1;
  // The layer's solve states an error of its own, of the same force: the larger one holds.
  if (c.signal == ForceSignal::Layer) variance = std::max(variance, r.layer_sd_N * r.layer_sd_N);
  if (c.signal == ForceSignal::LayerAndBending)
    variance = std::max(
        variance, std::pow((force_at(c, r.layer_N) - force_at(c, c.bending_N_per_mm * r.bending_mm)) / 2, 2));
  Estimate force{value, std::sqrt(std::max(variance, 0.0)), Validity::Valid};
  if (is_by_layer(c.signal)) force.validity = r.layer_validity;
  if (!c.shapes_judged) force.validity = Validity::ShapeUnjudged;
  if (s < c.gray_min) force.validity = Validity::BelowRange;
  if (s > c.gray_max) force.validity = Validity::AboveRange;
  if (r.at_border) force.validity = Validity::AtBorder;
  const double hidden_N = hidden_fraction(c.signal, r) * std::abs(value);
  if (hidden_N > kNormal95 * force.standard_error) force.validity = Validity::Saturated;
  force.standard_error += hidden_N / kNormal95;
  if (!c.fit_for_use) force.validity = Validity::Unfit;
  return force;
}

Estimate ForceHistory::update(const ForceCalibration& c, const ForceFeatures& r) {
  const double w = direction_.update(r.contact, signal_of(c, r), kTurn_fraction * (c.gray_max - c.gray_min));
  return force_of(c, r, w);
}

Estimate force_from_gray(const ForceCalibration& c, double gray_sum, bool contact, double hidden_gray) {
  ForceFeatures features;
  features.gray_sum = gray_sum;
  features.contact = contact;
  features.hidden_gray = hidden_gray;
  return force_of(c, features);
}

}  // namespace palpate
