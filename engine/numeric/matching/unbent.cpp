#include "engine/numeric/matching/unbent.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "engine/numeric/dense.h"
#include "engine/numeric/matching/spacing.h"
#include "engine/numeric/matching/start.h"
#include "engine/numeric/matching/symmetry.h"
#include "engine/numeric/matching/warp.h"

namespace palpate {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::RowVectorXd;
using Eigen::VectorXd;
using Indices = std::vector<Index>;

constexpr double kMostMaps = 4e4;  // that are tried
// Choices of template points that a map is made from: of a similarity, and of an affine map.
constexpr Index kAnchorSets = 6, kAffineAnchorSets = 3;
constexpr double kPartnerReach = 0.5;  // of the points' spacing: how far a partner may lie
constexpr double kLeastMapScale = 0.2, kMostMapScale = 5;
constexpr double kLeastFound = 0.3;
constexpr double kLeastUnbentSd = 1e-6;  // of the target's RMS radius
constexpr double kDecades = 13.8;        // ln of the range that the noise lies in beforehand
constexpr int kRefits = 2;
constexpr size_t kKept = 400;

double rms_radius(const MatrixXd& points) {
  return std::sqrt((points.rowwise() - points.colwise().mean()).rowwise().squaredNorm().mean());
}

struct Pairs {
  Indices from, to;
};

struct Fitted {
  MatrixXd map;
  double squares = 0;
  Index freedom = 0;      // of the map
  double log_narrow = 0;  // half the log determinant of the normal equations
};

enum class Kind : uint8_t { Similar, Mirrored, Affine };

class Maps {
 public:
  Maps(const MatrixXd& from, const MatrixXd& to, const UnbentOptions& options)
      : from_(from),
        to_(to),
        options_(options),
        axes_(from.cols()),
        smaller_(std::min(from.rows(), to.rows())),
        least_pairs_(std::max<Index>(
            axes_ + 2, static_cast<Index>(std::ceil(kLeastFound * static_cast<double>(smaller_))))),
        radius_(rms_radius(to)),
        from_ones_(with_ones(from)) {}

  std::optional<UnbentMap> best() {
    if (smaller_ < axes_ + 2 || !(radius_ > 0)) return std::nullopt;
    for (const Kind kind : {Kind::Similar, Kind::Mirrored, Kind::Affine}) {
      if (kind == Kind::Mirrored && !options_.reflections) continue;
      const bool affine = kind == Kind::Affine;
      const Index size = axes_ + (affine ? 1 : 0), sets = affine ? kAffineAnchorSets : kAnchorSets;
      const double maps =
          static_cast<double>(sets) * std::pow(static_cast<double>(to_.rows()), static_cast<double>(size));
      if (maps > kMostMaps) continue;
      if (!(spacing_ > 0)) spacing_ = median_spacing(to_);
      kind_ = kind;
      Indices targets;
      for (const Indices& anchors : anchor_sets(size, sets)) extend(anchors, targets);
    }
    if (found_.empty()) return std::nullopt;
    return judged();
  }

 private:
  // Points that span the template: the farthest apart, beginning at one point after the other.
  std::vector<Indices> anchor_sets(Index size, Index most) const {
    std::vector<Indices> sets;
    const Index n = from_.rows();
    const double scale = rms_radius(from_);
    VectorXd first = (from_.rowwise() - from_.colwise().mean()).rowwise().squaredNorm();
    std::vector<std::pair<double, Index>> starts;
    for (Index i = 0; i < n; ++i) starts.emplace_back(-first[i], i);
    std::sort(starts.begin(), starts.end());
    for (const auto& [unused, start] : starts) {
      if (static_cast<Index>(sets.size()) >= most) break;
      Indices chosen{start};
      MatrixXd span(0, axes_);  // orthonormal rows
      while (static_cast<Index>(chosen.size()) < size) {
        MatrixXd d = from_.rowwise() - from_.row(start);
        if (span.rows() > 0) d -= dense::product(d, dense::product_tn(span, span));
        Index next = 0;
        const double farthest = std::sqrt(d.rowwise().squaredNorm().maxCoeff(&next));
        if (!(farthest > 1e-3 * scale)) break;
        chosen.push_back(next);
        span.conservativeResize(span.rows() + 1, Eigen::NoChange);
        span.row(span.rows() - 1) = d.row(next) / farthest;
      }
      if (static_cast<Index>(chosen.size()) == size) sets.push_back(std::move(chosen));
    }
    return sets;
  }

  // Edges of a similarity are all longer by one factor.
  bool similar(const Indices& anchors, const Indices& targets) const {
    double least = kMostMapScale, most = kLeastMapScale;
    const size_t last = targets.size() - 1;
    for (size_t a = 0; a <= last; ++a)
      for (size_t b = 0; b < a; ++b) {
        const double was = (from_.row(anchors[a]) - from_.row(anchors[b])).norm();
        const double is = (to_.row(targets[a]) - to_.row(targets[b])).norm();
        least = std::min(least, is / was), most = std::max(most, is / was);
      }
    return targets.size() < 2 || (least >= kLeastMapScale && most <= kMostMapScale && most <= 1.3 * least);
  }

  void extend(const Indices& anchors, Indices& targets) {
    if (targets.size() == anchors.size()) {
      try_map({anchors, targets});
      return;
    }
    for (Index j = 0; j < to_.rows(); ++j) {
      if (std::find(targets.begin(), targets.end(), j) != targets.end()) continue;
      targets.push_back(j);
      if (kind_ == Kind::Affine || similar(anchors, targets)) extend(anchors, targets);
      targets.pop_back();
    }
  }

  bool allowed(const MatrixXd& map, double& turn_deg) const {
    const MatrixXd linear = map.bottomRows(axes_);
    const dense::Svd svd = dense::svd(linear, Eigen::ComputeFullU | Eigen::ComputeFullV);
    if (svd.values.minCoeff() < kLeastMapScale || svd.values.maxCoeff() > kMostMapScale) return false;
    const MatrixXd turn = dense::product_nt(svd.u, svd.v);
    if (dense::determinant(turn) < 0 && !options_.reflections) return false;
    turn_deg = angle_of(turn);
    return std::abs(turn_deg) <= options_.most_turn_deg;
  }

  std::optional<Fitted> fit(const Pairs& pairs) const {
    const MatrixXd a = from_(pairs.from, Eigen::all), b = to_(pairs.to, Eigen::all);
    const RowVectorXd ca = a.colwise().mean(), cb = b.colwise().mean();
    const MatrixXd x = a.rowwise() - ca, y = b.rowwise() - cb;
    const auto k = static_cast<double>(a.rows());
    const MatrixXd spread = dense::product_tn(x, x);
    const double size = spread.trace();
    if (!(size > 0)) return std::nullopt;
    Fitted f;
    MatrixXd linear;
    if (kind_ == Kind::Affine) {
      const double volume = dense::determinant(spread);
      if (!(volume > std::pow(1e-4 * size, static_cast<double>(axes_)))) return std::nullopt;
      linear = dense::solve_lu(spread, dense::product_tn(x, y));
      f.freedom = axes_ * (axes_ + 1);
      f.log_narrow = 0.5 * static_cast<double>(axes_) * (std::log(volume) + std::log(k));
    } else {
      dense::Svd svd = dense::svd(dense::product_tn(x, y), Eigen::ComputeFullU | Eigen::ComputeFullV);
      MatrixXd turn = dense::product_nt(svd.u, svd.v);
      double along = svd.values.sum();
      if ((dense::determinant(turn) < 0) != (kind_ == Kind::Mirrored)) {
        along -= 2 * svd.values.minCoeff();
        svd.u.rightCols(1) *= -1;
        turn = dense::product_nt(svd.u, svd.v);
      }
      linear = turn * (along / size);
      const Index turns = axes_ * (axes_ - 1) / 2;
      f.freedom = axes_ + turns + 1;
      f.log_narrow =
          0.5 * (static_cast<double>(turns + 1) * std::log(size) + static_cast<double>(axes_) * std::log(k));
    }
    f.squares = (y - dense::product(x, linear)).squaredNorm();
    f.map.resize(axes_ + 1, axes_);
    f.map.bottomRows(axes_) = linear;
    f.map.row(0) = cb - ca * linear;
    return f;
  }

  // The closest first, each point once.
  Pairs partners(const MatrixXd& placed, double reach) const {
    struct Candidate {
      double squared;
      Index from, to;
    };
    std::vector<Candidate> all;
    for (Index i = 0; i < placed.rows(); ++i)
      for (Index j = 0; j < to_.rows(); ++j)
        if (const double d = (placed.row(i) - to_.row(j)).squaredNorm(); d <= reach * reach)
          all.push_back({d, i, j});
    std::sort(all.begin(), all.end(), [](const Candidate& a, const Candidate& b) {
      return a.squared != b.squared ? a.squared < b.squared
             : a.from != b.from     ? a.from < b.from
                                    : a.to < b.to;
    });
    std::vector<char> from_taken(static_cast<size_t>(placed.rows()), 0),
        to_taken(static_cast<size_t>(to_.rows()), 0);
    Pairs pairs;
    for (const Candidate& c : all)
      if (!from_taken[static_cast<size_t>(c.from)] && !to_taken[static_cast<size_t>(c.to)]) {
        from_taken[static_cast<size_t>(c.from)] = to_taken[static_cast<size_t>(c.to)] = 1;
        pairs.from.push_back(c.from), pairs.to.push_back(c.to);
      }
    return pairs;
  }

  double evidence(const Fitted& f, Index pairs, double& sd) const {
    const auto m = static_cast<double>(to_.rows()), n = static_cast<double>(from_.rows()),
               k = static_cast<double>(pairs), axes = static_cast<double>(axes_);
    const double over = k * axes - static_cast<double>(f.freedom);
    const double least = std::max(kLeastUnbentSd * radius_, options_.resolution / std::sqrt(12.));
    const double squares = f.squares + k * axes * least * least;
    sd = std::sqrt(squares / over);
    // Prior of the map's own numbers: normal, as wide as the target.
    const RowVectorXd middle = (RowVectorXd(axes_ + 1) << 1, from_.colwise().mean()).finished() * f.map;
    const auto freedom = static_cast<double>(f.freedom);
    const double before =
        -0.5 * freedom * std::log(2 * std::numbers::pi) - freedom * std::log(radius_) -
        0.5 * (middle.squaredNorm() + f.map.bottomRows(axes_).squaredNorm()) / (radius_ * radius_);
    const double strangers = (m - k + 0.5) / (m + 1);
    const double chosen =
        k * std::log((1 - strangers) / n) + (m - k) * (std::log(strangers) - options_.log_volume);
    const double marginal = std::lgamma(over / 2) - 0.5 * over * std::log(std::numbers::pi * squares) -
                            std::log(2 * kDecades) - f.log_narrow + before;
    return options_.energy_without + chosen + marginal;
  }

  void try_map(const Pairs& anchors) {
    std::optional<Fitted> f = fit(anchors);
    double turn = 0;
    if (!f || !allowed(f->map, turn)) return;
    Pairs pairs;
    for (int round = 0; round <= kRefits; ++round) {
      pairs = partners(dense::product(from_ones_, f->map), kPartnerReach * spacing_);
      if (static_cast<Index>(pairs.from.size()) < least_pairs_) return;
      f = fit(pairs);
      if (!f || !allowed(f->map, turn)) return;
    }
    const auto count = static_cast<Index>(pairs.from.size());
    UnbentMap one{f->map, 0, count, 0, turn, 1};
    one.evidence = evidence(*f, count, one.sd);
    keep(std::move(one));
  }

  void keep(UnbentMap one) {
    const MatrixXd placed = dense::product(from_ones_, one.map);
    for (size_t k = 0; k < found_.size(); ++k)
      if ((placed - placed_[k]).rowwise().norm().mean() <= kOtherWarp * radius_) {
        if (one.evidence > found_[k].evidence) found_[k] = std::move(one), placed_[k] = placed;
        return;
      }
    if (found_.size() >= kKept) {
      const auto worst =
          std::min_element(found_.begin(), found_.end(),
                           [](const UnbentMap& a, const UnbentMap& b) { return a.evidence < b.evidence; });
      if (worst->evidence >= one.evidence) return;
      placed_[static_cast<size_t>(worst - found_.begin())] = placed;
      *worst = std::move(one);
      return;
    }
    found_.push_back(std::move(one));
    placed_.push_back(placed);
  }

  UnbentMap judged() const {
    const auto best =
        std::max_element(found_.begin(), found_.end(),
                         [](const UnbentMap& a, const UnbentMap& b) { return a.evidence < b.evidence; });
    double all = 0;
    for (const UnbentMap& one : found_) all += std::exp(one.evidence - best->evidence);
    UnbentMap answer = *best;
    answer.posterior = 1 / all;
    return answer;
  }

  const MatrixXd &from_, &to_;
  const UnbentOptions& options_;
  Index axes_, smaller_, least_pairs_;
  double radius_, spacing_ = 0;
  MatrixXd from_ones_;
  Kind kind_ = Kind::Similar;
  std::vector<UnbentMap> found_;
  std::vector<MatrixXd> placed_;
};

}  // namespace

std::optional<UnbentMap> find_unbent(const MatrixXd& from, const MatrixXd& to, const UnbentOptions& options) {
  return Maps(from, to, options).best();
}

}  // namespace palpate
