#include "capture/run/comparison.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "capture/files/measurements.h"
#include "engine/base/json.h"

namespace palpate {

void ErrorStatistics::add(double error, double truth) {
  ++count_;
  sum_ += error;
  sum_of_squares_ += error * error;
  largest_ = std::max(largest_, std::abs(error));
  full_scale_ = std::max(full_scale_, std::abs(truth));
}

double ErrorStatistics::rms() const {
  return count_ ? std::sqrt(sum_of_squares_ / static_cast<double>(count_)) : 0;
}

void Comparison::add(const Touch& touch, const Truth& truth, std::optional<double> depth_rms_error_mm) {
  ++counts_.frames;
  if (touch.contact == truth.contact) {
    ++counts_.contact_agrees;
  } else if (truth.contact) {
    ++counts_.contact_missed;
    counts_.largest_missed_N = std::max(counts_.largest_missed_N, truth.force_N);
  } else {
    ++counts_.contact_invented;
  }
  if (touch.contact && truth.contact) {
    if (touch.force_N.validity == Validity::Valid) {
      force_N_.add(touch.force_N.value - truth.force_N, truth.force_N);
    } else if (has_value(touch.force_N)) {
      ++counts_.flagged;
    }
    if (has_value(touch.shear_x_N)) {
      shear_x_N_.add(touch.shear_x_N.value - truth.shear_x_N, truth.shear_x_N);
      shear_y_N_.add(touch.shear_y_N.value - truth.shear_y_N, truth.shear_y_N);
    }
    if (touch.skin && has_value(touch.skin->torsion_rad))
      torsion_rad_.add(touch.skin->torsion_rad.value - truth.torsion_rad, truth.torsion_rad);
    if (touch.skin && has_value(touch.skin->stick_fraction) &&
        touch.skin->stick_fraction.validity != Validity::BelowRange)
      stick_share_.add(touch.skin->stick_fraction.value - truth.stick_fraction, truth.stick_fraction);
    if (touch.slip == Slip::Stick || touch.slip == Slip::Incipient || touch.slip == Slip::Slip) {
      ++counts_.slip_judged;
      if ((touch.slip == Slip::Slip) == truth.slipping) ++counts_.slip_agrees;
    }
    center_px_.add(
        std::hypot(touch.centroid_x_px - truth.center_x_px, touch.centroid_y_px - truth.center_y_px), 0);
  }
  const Validity depth = touch.surface ? touch.surface->validity : Validity::NotCalibrated;
  const bool bounded =
      depth == Validity::Saturated || depth == Validity::AtBorder || depth == Validity::Clipped;
  if (truth.contact && bounded) {
    ++counts_.depth_flagged;
  } else if (touch.surface && truth.contact) {
    depth_mm_.add(touch.surface->depth_max_mm - truth.indentation_mm, truth.indentation_mm);
    if (depth_rms_error_mm) depth_map_mm_.add(*depth_rms_error_mm, truth.indentation_mm);
  }
}

std::string Comparison::json() const {
  json::Value value = {{"frames", counts_.frames},
                       {"contact_agrees", counts_.contact_agrees},
                       {"contact_missed", counts_.contact_missed},
                       {"contact_missed_largest_N", counts_.largest_missed_N},
                       {"contact_invented", counts_.contact_invented},
                       {"force_flagged", counts_.flagged},
                       {"depth_flagged", counts_.depth_flagged},
                       {"slip_judged", counts_.slip_judged},
                       {"slip_agrees", counts_.slip_agrees}};
  const std::array<std::pair<const char*, const ErrorStatistics*>, 8> parts = {
      {{"force_N", &force_N_},
       {"shear_x_N", &shear_x_N_},
       {"shear_y_N", &shear_y_N_},
       {"torsion_rad", &torsion_rad_},
       {"stick_share", &stick_share_},
       {"center_px", &center_px_},
       {"depth_max_mm", &depth_mm_},
       {"depth_map_rms_mm", &depth_map_mm_}}};
  for (const auto& [name, errors] : parts) {
    if (errors->count() == 0) continue;
    value[name] = {{"frames", errors->count()},
                   {"mean_error", errors->mean()},
                   {"rms_error", errors->rms()},
                   {"largest_error", errors->largest()},
                   {"full_scale", errors->full_scale()}};
  }
  return value.dump();
}

double rms_difference(std::span<const float> a, std::span<const float> b) {
  double squares = 0;
  for (size_t i = 0; i < a.size(); ++i) {
    const double d = double{a[i]} - double{b[i]};
    squares += d * d;
  }
  return a.empty() ? 0 : std::sqrt(squares / static_cast<double>(a.size()));
}

}  // namespace palpate
