// Many starts, few finished: which basin the target's template lies in.
#pragma once

#include <Eigen/Core>
#include <limits>
#include <optional>
#include <vector>

#include "engine/numeric/matching/curve.h"
#include "engine/numeric/matching/flow.h"
#include "engine/numeric/matching/match.h"
#include "engine/numeric/matching/seeds.h"

namespace palpate {

/// Variance of a unit mode: that of shapes which bend as skin does.
inline constexpr double kAmplitude = 0.1;
/// Who allows smaller turns than this knows where the template lies; else every turn is tried.
inline constexpr double kLeastSearched_deg = 60;
inline bool tries_every_turn(const MatchOptions& options) {
  return options.most_turn_deg >= kLeastSearched_deg;
}

/// Nothing another start could do better: hardly any noise, and hardly a point left over.
bool fits_exactly(const FlowState& state, double spacing, Eigen::Index smaller);

/// Noise leaves every point about as far off as any other; a warp that is right in part only leaves most
/// points next to nothing and the others much.
bool uneven(const FlowState& state, const Eigen::MatrixXd& to);

/// The search for one pair of sets. Screens every start with a stiff warp and few iterations, finishes the
/// best few to the end, and lets the parts that fit grow over the rest where the fit is not exact.
class Search {
 public:
  /// `energy_without`: of all target points without any template.
  Search(const FlowProblem& problem, const Eigen::MatrixXd& to, const MatchOptions& options,
         double energy_without);

  void run(bool in_place, const Eigen::MatrixXd& as_it_lies, MatchResult& result);
  FlowState& best() { return best_; }
  /// Neighbourhoods are found again far closer than the best warp leaves their points: parts of it are wrong.
  bool contradicted() const;
  /// Posterior of the best warp against all others that a start ended in, each basin once.
  double posterior() const;

 private:
  struct Candidate {
    MatchStart start{};
    double turn_deg = 0;
    double context_weight = 0;
    double sd = 0;           ///< to begin with
    Eigen::MatrixXd placed;  ///< at first
    FlowState state;
  };

  void screen(MatchStart start, double turn_deg, const Eigen::MatrixXd& placed, double sd,
              double context_weight, const Eigen::MatrixXf* likeness);
  void screen_all(bool in_place, const Eigen::MatrixXd& as_it_lies);
  void finish(Candidate candidate, MatchResult& result);
  void finish_some(MatchResult& result);
  void finish_all(MatchResult& result);
  void grow_some(size_t most, MatchResult& result);
  void grow_seeds(size_t first, MatchResult& result);
  double squared_miss(const Seed& seed, bool nearest) const;
  void try_self_maps(MatchResult& result);
  void try_slides(MatchResult& result);
  std::optional<FlowState> slid(const Curve& curve, int64_t step) const;
  double paid_energy(const FlowState& state) const;
  double left_over_worth() const;
  void settle(Candidate candidate, MatchResult& result);
  bool clean() const;
  bool unproven() const;
  bool doubtful() const;

  const FlowProblem& problem_;
  const Eigen::MatrixXd& to_;
  MatchOptions options_;
  double energy_without_ = 0, spacing_ = 0, least_ = 0;
  FlowProblem stiff_;
  std::vector<Candidate> screened_;
  std::vector<Eigen::MatrixXd> grown_;
  std::vector<Seed> seeds_;
  std::vector<Candidate> ended_;  ///< as the attempts
  FlowState best_;
  bool finished_all_ = false;
  /// Nats by which the best warp is worth more than the best of its slides along the template's curve.
  double slide_margin_ = std::numeric_limits<double>::infinity();
};

}  // namespace palpate
