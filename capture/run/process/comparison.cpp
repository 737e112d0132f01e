#include "capture/run/process/comparison.h"

#include <algorithm>
#include <cmath>
#include <string_view>

#include "capture/files/true_quantities.h"

namespace palpate {
namespace {

struct Pair {
  const MeasuredQuantity<Touch>* measured;
  const MeasuredQuantity<TrueFrame>* truth;
};

/// The estimates whose truth is known.
const std::vector<Pair>& pairs() {
  static const std::vector<Pair> all = [] {
    constexpr std::string_view kPrefix = "true_";
    std::vector<Pair> found;
    for (const MeasuredQuantity<TrueFrame>& truth : true_quantities())
      for (const MeasuredQuantity<Touch>& measured : touch_quantities())
        if (measured.kind == QuantityKind::Estimated && truth.name == std::string(kPrefix) + measured.name)
          found.push_back({&measured, &truth});
    return found;
  }();
  return all;
}

/// Whether an error in that state counts; in others the number is doubtful or a bound, and says so.
bool is_judged(const MeasuredQuantity<Touch>& quantity, Validity state) {
  if (quantity.group == MeasuredColumns::Force) return state == Validity::Valid;
  if (quantity.group == MeasuredColumns::Depth)
    return state != Validity::Saturated && state != Validity::AtBorder && state != Validity::Clipped;
  return state != Validity::BelowRange;
}

}  // namespace

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

Comparison::Comparison() {
  for (const auto& [measured, truth] : pairs())
    compared_.push_back({measured->name, words_of(measured->name, measured->unit), {}});
  compared_.push_back({"center_px", "centre, px", {}});
  compared_.push_back({"depth_map_rms_mm", "depth map RMS, mm", {}});
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
  if (!truth.contact) return;
  const TrueFrame frame{&truth, depth_rms_error_mm};
  const std::vector<Pair>& all = pairs();
  bool depth_judged = false;
  for (size_t i = 0; i < all.size(); ++i) {
    const auto& [measured, known] = all[i];
    const bool depth = measured->group == MeasuredColumns::Depth;  // known without contact too
    const QuantityValue value = measured->value(touch);
    const Estimate* estimate = shown_estimate(*measured, value);
    if (!estimate || (!touch.contact && !depth)) continue;
    if (!is_judged(*measured, estimate->validity)) {
      counts_.flagged += measured->group == MeasuredColumns::Force;
      counts_.depth_flagged += depth;
      continue;
    }
    const double true_value = std::get<double>(known->value(frame));
    compared_[i].errors.add(estimate->value - true_value, true_value);
    depth_judged |= depth;
  }
  if (depth_judged && depth_rms_error_mm)
    compared_.back().errors.add(*depth_rms_error_mm, truth.indentation_mm);
  if (!touch.contact) return;
  if (touch.slip == Slip::Stick || touch.slip == Slip::Incipient || touch.slip == Slip::Slip) {
    ++counts_.slip_judged;
    if ((touch.slip == Slip::Slip) == truth.slipping) ++counts_.slip_agrees;
  }
  compared_[all.size()].errors.add(
      std::hypot(touch.centroid_x_px - truth.center_x_px, touch.centroid_y_px - truth.center_y_px), 0);
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
