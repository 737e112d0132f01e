// Errors of a synthetic recording: measured against true values.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "capture/truth.h"
#include "palpate/touch.h"

namespace palpate {

/// Errors of one quantity over the frames in which both sides have it. The unit is the quantity's.
class ErrorStatistics {
 public:
  void add(double error, double truth);
  uint64_t count() const { return count_; }
  double mean() const { return count_ ? sum_ / static_cast<double>(count_) : 0; }
  double rms() const;
  double largest() const { return largest_; }        ///< of the absolute error
  double full_scale() const { return full_scale_; }  ///< largest absolute truth

 private:
  uint64_t count_ = 0;
  double sum_ = 0;
  double sum_of_squares_ = 0;
  double largest_ = 0;
  double full_scale_ = 0;
};

/// Collects frame by frame. Forces and depths that the engine itself flags (saturated, out of range, at the
/// border) are counted, not averaged in.
class Comparison {
 public:
  Comparison();
  void add(const Touch& touch, const Truth& truth, std::optional<double> depth_rms_error_mm);

  struct Counts {
    uint64_t frames = 0;
    uint64_t contact_agrees = 0;
    uint64_t contact_missed = 0;    ///< truth says contact, we do not
    uint64_t contact_invented = 0;  ///< the reverse
    double largest_missed_N = 0;
    uint64_t flagged = 0;  ///< forces
    uint64_t depth_flagged = 0;
    uint64_t slip_agrees = 0;
    uint64_t slip_judged = 0;
  };
  const Counts& counts() const { return counts_; }

  /// Errors of one quantity.
  struct Compared {
    std::string name;   ///< "force_N"
    std::string words;  ///< "force, N"
    ErrorStatistics errors;
  };
  /// Each estimate whose truth is known, then the distance of the centres and the RMS of the depth maps.
  const std::vector<Compared>& compared() const { return compared_; }

 private:
  Counts counts_;
  std::vector<Compared> compared_;
};

/// RMS difference of two maps of one size; 0 where they are empty.
double rms_difference(std::span<const float> a, std::span<const float> b);

}  // namespace palpate
