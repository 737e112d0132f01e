#include "viz/report/comparison.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <utility>

#include "capture/files/measurements.h"

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
  ++frames_;
  if (touch.contact == truth.contact) {
    ++contact_agrees_;
  } else if (truth.contact) {
    ++contact_missed_;
    largest_missed_N_ = std::max(largest_missed_N_, truth.force_N);
  } else {
    ++contact_invented_;
  }
  if (touch.contact && truth.contact) {
    if (touch.force_N.validity == Validity::Valid) {
      force_N_.add(touch.force_N.value - truth.force_N, truth.force_N);
    } else if (has_value(touch.force_N)) {
      ++flagged_;
    }
    if (has_value(touch.shear_x_N)) {
      shear_x_N_.add(touch.shear_x_N.value - truth.shear_x_N, truth.shear_x_N);
      shear_y_N_.add(touch.shear_y_N.value - truth.shear_y_N, truth.shear_y_N);
    }
    if (touch.has_skin && has_value(touch.skin.torsion_rad))
      torsion_rad_.add(touch.skin.torsion_rad.value - truth.torsion_rad, truth.torsion_rad);
    if (touch.has_skin && has_value(touch.skin.stick_share) &&
        touch.skin.stick_share.validity != Validity::BelowRange)
      stick_share_.add(touch.skin.stick_share.value - truth.stick_share, truth.stick_share);
    if (touch.slip == Slip::Stick || touch.slip == Slip::Incipient || touch.slip == Slip::Slip) {
      ++slip_judged_;
      if ((touch.slip == Slip::Slip) == truth.slipping) ++slip_agrees_;
    }
    center_px_.add(
        std::hypot(touch.centroid_x_px - truth.center_x_px, touch.centroid_y_px - truth.center_y_px), 0);
  }
  const bool bounded = touch.depth_validity == Validity::Saturated ||
                       touch.depth_validity == Validity::AtBorder ||
                       touch.depth_validity == Validity::Clipped;
  if (touch.has_surface && truth.contact && bounded) {
    ++depth_flagged_;
  } else if (touch.has_surface && truth.contact) {
    depth_mm_.add(touch.depth_max_mm - truth.indentation_mm, truth.indentation_mm);
    if (depth_rms_error_mm) depth_map_mm_.add(*depth_rms_error_mm, truth.indentation_mm);
  }
}

std::string Comparison::table() const {
  const std::array<std::pair<const char*, const ErrorStatistics*>, 8> lines = {
      {{"force, N", &force_N_},
       {"shear x, N", &shear_x_N_},
       {"shear y, N", &shear_y_N_},
       {"torsion, rad", &torsion_rad_},
       {"stick share", &stick_share_},
       {"centre, px", &center_px_},
       {"depth, mm", &depth_mm_},
       {"depth map RMS, mm", &depth_map_mm_}}};
  std::string text = "measured - true        frames   mean error    RMS error      largest   full scale\n";
  char line[160];
  for (const auto& [name, errors] : lines) {
    if (errors->count() == 0) continue;
    std::snprintf(line, sizeof line, "%-20s %8llu %12.4f %12.4f %12.4f ", name,
                  static_cast<unsigned long long>(errors->count()), errors->mean(), errors->rms(),
                  errors->largest());
    text += line;
    if (errors->full_scale() > 0) {
      std::snprintf(line, sizeof line, "%12.4f\n", errors->full_scale());
      text += line;
    } else {
      text += "           -\n";
    }
  }
  std::snprintf(line, sizeof line, "contact told right in %llu of %llu frames",
                static_cast<unsigned long long>(contact_agrees_), static_cast<unsigned long long>(frames_));
  text += line;
  if (contact_missed_) {
    std::snprintf(line, sizeof line, "; %llu touches of up to %.4f N were too light to see",
                  static_cast<unsigned long long>(contact_missed_), largest_missed_N_);
    text += line;
  }
  if (contact_invented_)
    text += "; " + std::to_string(contact_invented_) + " frames without touch were taken for one";
  text += "\n";
  if (slip_judged_) {
    text += "stick or slip told right in " + std::to_string(slip_agrees_) + " of " +
            std::to_string(slip_judged_) + " frames\n";
  }
  if (flagged_) {
    text += std::to_string(flagged_) +
            " frames with a flagged force (out of range or saturated) are not in the force line\n";
  }
  if (depth_flagged_) {
    text += std::to_string(depth_flagged_) +
            " frames with a flagged depth (saturated, at the border or slopes clipped) are not in the depth "
            "lines\n";
  }
  return text;
}

std::string Comparison::json() const {
  nlohmann::ordered_json value = {{"frames", frames_},
                                  {"contact_agrees", contact_agrees_},
                                  {"contact_missed", contact_missed_},
                                  {"contact_missed_largest_N", largest_missed_N_},
                                  {"contact_invented", contact_invented_},
                                  {"force_flagged", flagged_},
                                  {"depth_flagged", depth_flagged_},
                                  {"slip_judged", slip_judged_},
                                  {"slip_agrees", slip_agrees_}};
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

}  // namespace palpate
