// Pixel sums: what a search for a motion asks of two surfaces' pixels, whoever adds them up.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <memory>

#include "engine/motion/contact_surface.h"
#include "engine/motion/residual_noise.h"
#include "engine/motion/rigid_motion.h"

namespace palpate {

/// A motion about the middle of the key frame's contact: q = turn (p - middle) + middle + shift.
struct MotionGuess {
  Eigen::Vector3d middle;
  Eigen::Matrix3d turn;
  Eigen::Vector3d shift;

  MotionGuess(const RigidMotion& motion, const Eigen::Vector3d& about)
      : middle(about), turn(motion.turn), shift(motion * about - about) {}
  RigidMotion motion() const { return {turn, middle + shift - turn * middle}; }
  /// A small motion before this one, seen at the middle.
  void add(const Vector6d& step) {
    shift += turn * step.head<3>();
    turn = turn * turn_of(step.tail<3>());
  }
};

/// What Tukey's weights are about. By squares nothing is a stranger yet: relief on flat ground fits almost
/// everywhere, and by the median its edges would be left out before they fit.
enum class Spread { Squares, Median };

/// What a guess leaves over: residuals of depth, each divided by its standard error (up to a common factor).
struct LeftOver {
  size_t compared = 0;  ///< pixels
  double scale = 0;     ///< standard deviation of the residual, by the median or by squares
  double mean_precision = 0;
  double residual_mm() const;
};

/// The sums of a Gauss-Newton step, over rows of a small motion seen at the guess's middle.
struct MotionSums {
  Matrix6d square = Matrix6d::Zero();      ///< of the rows (the mean of both frames'), weighted
  Matrix6d difference = Matrix6d::Zero();  ///< of the two frames' rows' differences; only where judged
  Vector6d gradient = Vector6d::Zero();
  double weight = 0;  ///< times each pixel's inverse variance
};

/// Sums over the pixels of two surfaces, in an order that does not change from run to run.
class PixelSums {
 public:
  virtual ~PixelSums() = default;
  /// The surfaces that all that follows is about; they must live as long.
  virtual void set(const ContactSurface& key, const ContactSurface& now) = 0;
  /// The pixels of both frames' `level` at a guess.
  virtual LeftOver compare(size_t level, const MotionGuess& guess, Spread by) = 0;

  // Of what was compared last:
  /// Weighed by Tukey about the scale that compare() gave.
  virtual MotionSums step() = 0;
  /// Products of rows weighed by the slope of Tukey's score, and those of differences.
  virtual MotionSums judged() = 0;
  /// The terms of step()'s gradient whose weight is not 0. Call judged() before.
  virtual ScoreField field() = 0;
  /// Mean of the residuals' squares, none above Tukey's bound about `scale`.
  virtual double loss(double scale) = 0;
  virtual uint64_t memory_bytes() const { return 0; }  ///< on a device
};

/// Sums by the processor's widest vectors.
std::unique_ptr<PixelSums> host_sums();

}  // namespace palpate
