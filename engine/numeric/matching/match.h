// Options and result of a match of two point sets.
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

namespace palpate {

/// Points of the plane (2) or of space (3), one after the other. Any unit: nothing below depends on it.
struct PointSet {
  uint32_t axes = 2;
  std::vector<double> coordinates;  ///< size() x axes

  size_t size() const { return coordinates.size() / axes; }
  std::span<const double> at(size_t i) const { return std::span(coordinates).subspan(i * axes, axes); }
};

/// One template point's partner.
struct Partner {
  std::optional<uint32_t> target;  ///< none: nil, the point has no partner
  double probability =
      std::numeric_limits<double>::quiet_NaN();  ///< of this target, or of nil; 0 to 1; NaN without a
                                                 ///< reliable match. One target is never given to two points
};

/// Where the winning answer began.
enum class MatchStart : uint8_t {
  Context,  ///< where the template stands, neighbourhoods compared
  Near,     ///< where the template stands, but for a point or two
  Plain,    ///< where the template stands, distances alone
  Turned,   ///< turned, scaled and moved as most neighbourhoods ask for
  Local,    ///< grown from one neighbourhood that was found again
  Slid,     ///< slid along the one curve that the template's points lie on
  Unbent,   ///< a similarity or an affine map by itself, of sets of few points
};
std::string_view to_string(MatchStart start);

enum class MatchVerdict : uint8_t {
  Reliable,
  TooFewPoints,  ///< any order of so few points fits an affine map
  TooVague,      ///< what is left after the warp is as large as unrelated points would leave
  TooFewFound,   ///< most of the smaller set has no partner
  NotSettled,    ///< the iteration ended at its limit
  Ambiguous,     ///< another warp explains the target nearly as well
  Bent,          ///< little noise is left, but only because the warp is free to bend
  PartlyWrong,   ///< neighbourhoods are found again far closer than the warp leaves its points
};
std::string_view to_string(MatchVerdict verdict);

/// How one start ended. Lengths over the template's RMS distance from its centre.
struct MatchAttempt {
  MatchStart start{};
  double turn_deg = 0;  ///< of Turned, about the last axis; in space the angle of the whole rotation
  double energy = 0;    ///< -log posterior: the least wins; noise below 2e-3 counts as 2e-3
  double bending = 0;   ///< the part of it that the warp costs
  double noise_sd = 0;  ///< per axis
  uint32_t iterations = 0;
  bool converged = false;
};

struct MatchOptions {
  /// Starts that are turned by more are not tried (a round shape fits itself after any turn). From 60 deg on
  /// every turn is tried, and another warp that does nearly as well makes the answer Ambiguous.
  double most_turn_deg = 180;
  bool reflections = false;  ///< the target may be the template's mirror image
};

struct MatchResult {
  MatchVerdict verdict = MatchVerdict::TooFewPoints;
  std::vector<Partner> partners;  ///< of each template point; all nil without a reliable match
  PointSet warped;                ///< the template brought onto the target, in the template's order
  uint32_t iterations = 0;        ///< of all starts
  bool converged = false;
  double noise_sd = 0;       ///< of the target's points about the warped template, per axis, target units
  bool noise_below = false;  ///< less noise than noise_sd is not told apart: it is an upper bound
  double target_outlier_fraction = 0;  ///< of the target's points, expected
  double template_nil_fraction = 0;    ///< of the template's points, expected
  /// Nats per target point by which the warped template explains the target better than one normal
  /// distribution or an even spread does, whichever is better.
  double log_likelihood_gain = 0;
  /// Nats by which it explains the target better once the warp's freedom is paid for (Laplace's approximation
  /// of the marginal likelihood).
  double evidence = 0;
  /// log_likelihood_gain of target points that were left out of the warp's fit, a fifth at a time.
  double held_out_gain = 0;
  /// Posterior of the warp that won against all other warps that a start ended in, by their likelihoods. 1
  /// where `most_turn_deg` says where the template lies.
  double posterior = 1;
  double scale = 1;   ///< template's RMS distance from its centre, in its unit
  size_t winner = 0;  ///< of `attempts`
  std::vector<MatchAttempt> attempts;

  bool reliable() const { return verdict == MatchVerdict::Reliable; }
};

}  // namespace palpate
