#include "engine/motion/registration.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "engine/motion/pad_error.h"
#include "engine/motion/residual_noise.h"

namespace palpate {
namespace {

constexpr size_t kLeastPixels = 60;                          // pixels that a motion takes
constexpr double kFilter_px2 = 1;                            // variance of ContactSurface's filter
constexpr double kFineStep_px = 0.01, kCoarseStep_px = 0.1;  // steps below these end a search

/// The search for a guess that leaves little over; what the last one left.
class Search {
 public:
  Search(const ContactSurface& key, const ContactSurface& now, const RegistrationOptions& options,
         PixelSums& sums)
      : key_(key),
        now_(now),
        options_(options),
        sums_(sums),
        radius_mm_(std::max(key.radius_mm(), key.levels().front().pitch_mm)) {
    sums.set(key, now);
  }

  /// The best of three searches down to level `first`: on that one alone, and on all from the coarsest with
  /// and without strangers. A dome slides along itself where a level is too coarse for its texture.
  MotionGuess coarse(size_t first, const MotionGuess& start);
  /// Fine steps on one level; returns whether the last one was next to nothing.
  bool fine(size_t level, MotionGuess& guess);

  const LeftOver& left() const { return left_; }
  int steps() const { return steps_; }
  double radius_mm() const { return radius_mm_; }
  size_t levels() const { return std::min(key_.levels().size(), now_.levels().size()); }

 private:
  bool on_level(size_t level, MotionGuess& guess, Spread by, double enough_px);

  const ContactSurface &key_, &now_;
  const RegistrationOptions& options_;
  PixelSums& sums_;
  double radius_mm_;
  LeftOver left_;
  int steps_ = 0;
};

bool Search::on_level(size_t level, MotionGuess& guess, Spread by, double enough_px) {
  const double pitch_mm = now_.levels()[level].pitch_mm;
  for (int step = 0; step < options_.most_steps; ++step) {
    ++steps_;
    left_ = sums_.compare(level, guess, by);
    if (left_.compared < kLeastPixels) return false;
    const MotionSums sums = sums_.step();
    // Far from the truth the two frames' slopes have nothing in common: only the floor bounds a step.
    const Solution solution = solve({.information = sums.square,
                                     .noise = Matrix6d::Zero(),
                                     .weight = sums.weight,
                                     .pixels = double(left_.compared)},
                                    guess.middle, radius_mm_, options_.freedom);
    Vector6d move = -(solution.inverse * sums.gradient);
    const double size_mm = move.head<3>().norm() + move.tail<3>().norm() * radius_mm_;
    const double most_mm = 4 * pitch_mm;
    if (size_mm > most_mm) move *= most_mm / size_mm;
    guess.add(move);
    if (size_mm < enough_px * pitch_mm) return true;
  }
  return false;
}

bool Search::fine(size_t level, MotionGuess& guess) {
  const bool converged = on_level(level, guess, Spread::Median, kFineStep_px);
  // A last step of next to nothing leaves the residuals as they are.
  if (!converged) left_ = sums_.compare(level, guess, Spread::Median);
  return converged;
}

MotionGuess Search::coarse(size_t first, const MotionGuess& start) {
  if (first >= levels()) return start;
  std::array<MotionGuess, 3> guesses = {start, start, start};
  double scale = INFINITY;
  for (size_t k = 0; k < guesses.size(); ++k) {
    for (size_t level = k == 0 ? first + 1 : levels(); level-- > first;)
      on_level(level, guesses[k], k == 1 ? Spread::Squares : Spread::Median, kCoarseStep_px);
    if (k == 1) left_ = sums_.compare(first, guesses[k], Spread::Median);
    if (left_.compared < kLeastPixels) continue;
    if (k == 0 && left_.residual_mm() <= options_.enough_residual_mm) return guesses[k];
    scale = std::min(scale, left_.scale);
  }
  size_t best = 0;
  double least = INFINITY;
  for (size_t k = 0; k < guesses.size(); ++k) {
    if (sums_.compare(first, guesses[k], Spread::Median).compared < kLeastPixels) continue;
    const double left = sums_.loss(scale);
    if (left < least) best = k;
    least = std::min(left, least);
  }
  return guesses[best];
}

/// Registration::disagreement. Noise of shorter reaches makes slopes that differ, too, and is left out.
double slopes_disagree(const MotionSums& sums, const ScoreNoise& noise, double least_slope) {
  const double apart = sums.difference.diagonal().head<2>().sum() / 2;
  const double both = 2 * sums.square.diagonal().head<2>().sum() + apart;  // of each frame's, summed
  if (both < 2 * std::pow(2 * least_slope, 2) * sums.weight) return 0;
  double all = 0, wide = 0;
  for (size_t k = 0; k < ScoreNoise::kReaches; ++k) {
    const double slope = noise.variance[k] / std::pow(std::max(ScoreNoise::reach_px(k), 1.0), 2);
    all += slope;
    if (k >= 2) wide += slope;
  }
  return all > 0 ? std::min(2 * apart / both, 1.0) * wide / all : 0;
}

/// The fit's gradient by a smoothing of depth along the pad whose variance is 2 mm2. It raises each frame's
/// surface along z by the sum of its second derivatives, which a tilt changes, and z is another direction of
/// the object's after it: where x goes on by tilt z, with slopes s and second derivatives H, 2 tilt . H s of
/// it is left over. A motion without tilt has none of it, and no noise.
Vector6d smoothing_gradient(const ScoreField& field, const Eigen::Matrix3d& turn,
                            const ContactSurface::Level& now, double slope_of_score) {
  const Eigen::Vector3d about = turn_vector(turn);
  const Eigen::Vector2d tilt(about[1], -about[0]);
  const double per_way = 1 / (2 * now.pitch_mm);
  Vector6d sum = Vector6d::Zero();
  double weights = 0;
  for (size_t i = 0; i < field.pixel.size(); ++i) {
    const uint32_t at = field.pixel[i], x = at % now.width, y = at / now.width;
    if (x == 0 || y == 0 || x + 1 == now.width || y + 1 == now.height) continue;
    const auto change = [&](const std::vector<float>& of, uint32_t step) {
      return double{of[at + step] - of[at - step]} * per_way;
    };
    const double xx = change(now.slope_x, 1), yy = change(now.slope_y, now.width),
                 xy = (change(now.slope_x, now.width) + change(now.slope_y, 1)) / 2;
    // Halfway between both frames.
    const Eigen::Vector2d slope =
        Eigen::Vector2d(double{now.slope_x[at]}, double{now.slope_y[at]}) + tilt / 2;
    const double changed =
        2 * (tilt[0] * (xx * slope[0] + xy * slope[1]) + tilt[1] * (xy * slope[0] + yy * slope[1]));
    const auto scaled = double{field.row[i][2]};
    for (size_t k = 0; k < 6; ++k)
      sum[static_cast<Eigen::Index>(k)] += double{field.row[i][k]} * scaled * changed;
    weights += scaled * scaled;
  }
  return weights > 0 ? Vector6d(sum * (slope_of_score / weights)) : sum;
}

/// What is left over, and what it makes of the motion.
void judge(PixelSums& by, const LeftOver& left, const ContactSurface::Level& now, double radius_mm,
           const MotionGuess& guess, const RegistrationOptions& options, Registration& out) {
  const MotionSums sums = by.judged();
  const double way_mm = std::hypot(guess.shift.norm(), turn_vector(guess.turn).norm() * radius_mm / 2);
  const PadError pad(options.pad_slope_sd, options.pad_reach_mm, way_mm, now.pitch_mm, radius_mm);
  FreedomOptions freedom = options.freedom;
  freedom.least_slope = std::max(freedom.least_slope, pad.slope_of_place());
  const Solution solution = solve({.information = sums.square - sums.difference / 4,
                                   .noise = sums.difference / 2,
                                   .weight = sums.weight,
                                   .pixels = double(left.compared)},
                                  guess.middle, radius_mm, freedom);
  const ScoreField field = by.field();
  out.fitting = static_cast<double>(field.pixel.size()) / static_cast<double>(left.compared);
  out.residual_mm = left.residual_mm();
  const ReachSums reaches(field);
  const ScoreNoise noise = reaches.noise(solution.inverse, radius_mm / now.pitch_mm);
  out.disagreement = slopes_disagree(sums, noise, options.least_slope());
  Matrix6d scores = reaches.covariance(noise);
  if (options.pad_slope_sd > 0) scores += reaches.covariance(pad.noise(left.mean_precision));
  const Matrix6d turned = carried_by({guess.turn, Eigen::Vector3d::Zero()});
  const Matrix6d spread = turned * solution.inverse;
  out.covariance = spread * scores * spread.transpose();
  out.by_smoothing = -(spread * smoothing_gradient(field, guess.turn, now, sums.weight));
  out.freedom = solution.freedom.after(out.motion);
}

}  // namespace

Registration register_surface(const ContactSurface& key, const ContactSurface& now, const RigidMotion& start,
                              const RegistrationOptions& options) {
  return register_surface(key, now, start, options, *host_sums());
}

Registration register_surface(const ContactSurface& key, const ContactSurface& now, const RigidMotion& start,
                              const RegistrationOptions& options, PixelSums& sums) {
  Registration out;
  if (std::min(key.count(), now.count()) < kLeastPixels) return out;
  Search search(key, now, options, sums);
  const size_t finest = std::min<size_t>(options.finest_level, search.levels() - 1);
  const ContactSurface::Level &there = key.levels()[finest], &here = now.levels()[finest];
  const Eigen::Vector3d& middle = key.centroid_mm();
  MotionGuess guess = search.coarse(finest + 1, MotionGuess(start, middle));
  const auto take = [&] {
    out.converged = search.fine(finest, guess);
    out.steps = search.steps();
    out.found = search.left().compared >= kLeastPixels;
    if (!out.found) return;
    out.motion = guess.motion();
    out.at_mm = guess.middle + guess.shift;
    judge(sums, search.left(), here, search.radius_mm(), guess, options, out);
  };
  take();
  if (!out.found) return out;
  out.overlap = static_cast<double>(search.left().compared) /
                static_cast<double>(std::min(there.inside.size(), here.inside.size()));
  // What slides along itself only nearly fits again after a step or two.
  constexpr double kLargeTurn = 0.002;
  const RigidMotion least = out.freedom.least_turn(out.motion);
  if (turn_vector(least.turn * out.motion.turn.transpose()).norm() > kLargeTurn) {
    guess = MotionGuess(least, middle);
    take();
    if (!out.found) return {};
  }
  out.motion = out.freedom.least_turn(out.motion);
  const Eigen::Vector3d at = out.motion * middle;
  const Matrix6d moved = seen_at(out.at_mm, at);
  out.covariance = moved * out.covariance * moved.transpose();
  out.by_smoothing = moved * out.by_smoothing;
  out.freedom = out.freedom.at(at);
  out.at_mm = at;
  const double own_mm2 = kFilter_px2 / 2 * std::pow(key.levels().front().pitch_mm, 2);
  out.motion = motion_about(at, -(options.skin_smoothing_mm2 + own_mm2) * out.by_smoothing) * out.motion;
  out.of_levels = key.error_of_level() + now.error_of_level();
  out.covariance += out.of_levels;
  for (Eigen::Index k = 3; k < 5; ++k)
    out.covariance(k, k) += std::pow(key.tilt_sd_rad(), 2) + std::pow(now.tilt_sd_rad(), 2);
  return out;
}

}  // namespace palpate
