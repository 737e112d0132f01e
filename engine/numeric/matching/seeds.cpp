#include "engine/numeric/matching/seeds.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "engine/numeric/dense.h"
#include "engine/numeric/matching/warp.h"

namespace palpate {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Vector2d;

constexpr Index kSeedPlaces = 16, kNeighbours = 12, kArms = 3;
constexpr int kMostMissed = 4;
// Shares of the points' spacing: how far a neighbour may be off, by the two points alone (less among many
// strangers, of whom chance finds one everywhere) and by all.
constexpr double kSeedReach = 0.5, kFineSeedReach = 0.2;
constexpr double kLeastSeedScale = 0.5, kMostSeedScale = 2;
constexpr int kMostCells = 128;

// Target points by square cells, so that the one near a place is found at once.
class Cells {
 public:
  Cells(const MatrixXd& points, double reach) : points_(points) {
    low_ = points.colwise().minCoeff().transpose();
    const Vector2d size = points.colwise().maxCoeff().transpose() - low_;
    width_ = std::max(reach, size.maxCoeff() / kMostCells);
    columns_ = static_cast<int>(size.x() / width_) + 1;
    rows_ = static_cast<int>(size.y() / width_) + 1;
    all_.resize(static_cast<size_t>(columns_) * static_cast<size_t>(rows_));
    for (Index j = 0; j < points.rows(); ++j)
      all_[at(static_cast<int>((points(j, 0) - low_.x()) / width_),
              static_cast<int>((points(j, 1) - low_.y()) / width_))]
          .push_back(j);
  }

  /// The nearest within `reach`, at most that of the constructor; -1: none.
  Index nearest(const Vector2d& place, double reach) const {
    const Vector2d cell = (place - low_) / width_;
    if (!(cell.x() > -1 && cell.y() > -1 && cell.x() < columns_ + 1 && cell.y() < rows_ + 1)) return -1;
    const int x = static_cast<int>(std::floor(cell.x())), y = static_cast<int>(std::floor(cell.y()));
    double least = reach * reach;
    Index found = -1;
    for (int r = std::max(y - 1, 0); r <= std::min(y + 1, rows_ - 1); ++r)
      for (int c = std::max(x - 1, 0); c <= std::min(x + 1, columns_ - 1); ++c)
        for (const Index j : all_[at(c, r)]) {
          const double d = std::pow(points_(j, 0) - place.x(), 2) + std::pow(points_(j, 1) - place.y(), 2);
          if (d < least) least = d, found = j;
        }
    return found;
  }

 private:
  size_t at(int column, int row) const {
    return static_cast<size_t>(row) * static_cast<size_t>(columns_) + static_cast<size_t>(column);
  }

  const MatrixXd& points_;
  Vector2d low_;
  double width_ = 1;
  int columns_ = 1, rows_ = 1;
  std::vector<std::vector<Index>> all_;
};

class Finder {
 public:
  Finder(const MatrixXd& from, const MatrixXd& to, double spacing, double most_turn_deg)
      : from_(from),
        to_(to),
        spacing_(spacing),
        reach_(kSeedReach * spacing *
               std::sqrt(std::min(1., static_cast<double>(from.rows()) / static_cast<double>(to.rows())))),
        most_turn_(most_turn_deg * std::numbers::pi / 180),
        cells_(to, std::max(reach_, kFineSeedReach * spacing)) {}

  std::vector<Seed> find(size_t most) {
    for (const Index centre : spread_subset(from_, kSeedPlaces)) look_about(centre);
    std::stable_sort(seeds_.begin(), seeds_.end(), [](const Seed& a, const Seed& b) {
      return a.pairs.size() != b.pairs.size() ? a.pairs.size() > b.pairs.size() : a.miss < b.miss;
    });
    std::vector<Seed> kept;
    for (Seed& seed : seeds_) {
      if (kept.size() >= most) break;
      if (std::none_of(kept.begin(), kept.end(), [&](const Seed& k) { return alike(k, seed); }))
        kept.push_back(std::move(seed));
    }
    return kept;
  }

 private:
  // Half of the pairs or more are the same.
  static bool alike(const Seed& a, const Seed& b) {
    size_t same = 0;
    for (const auto& pair : b.pairs) same += std::find(a.pairs.begin(), a.pairs.end(), pair) != a.pairs.end();
    return 2 * same >= b.pairs.size();
  }

  void look_about(Index centre) {
    const Index n = from_.rows(), size = std::min(kNeighbours, n - 1);
    std::vector<std::pair<double, Index>> near;
    for (Index k = 0; k < n; ++k)
      if (k != centre) near.emplace_back((from_.row(k) - from_.row(centre)).squaredNorm(), k);
    std::partial_sort(near.begin(), near.begin() + size, near.end());
    around_ = {centre};
    for (Index k = 0; k < size; ++k) around_.push_back(near[static_cast<size_t>(k)].second);
    for (Index arm = 0; arm < std::min(kArms, size); ++arm) {
      const Index tip = near[static_cast<size_t>(size - 1 - arm * 2)].second;
      const Vector2d a = (from_.row(tip) - from_.row(centre)).transpose();
      const double length = a.norm();
      if (!(length > 0)) continue;
      for (Index j = 0; j < to_.rows(); ++j)
        for (Index l = 0; l < to_.rows(); ++l) {
          const Vector2d b = (to_.row(l) - to_.row(j)).transpose();
          const double scale = b.norm() / length;
          if (scale < kLeastSeedScale || scale > kMostSeedScale) continue;
          // As complex numbers: the similarity is a factor.
          const Vector2d factor = Vector2d(a.dot(b), a.x() * b.y() - a.y() * b.x()) / (length * length);
          if (std::abs(std::atan2(factor.y(), factor.x())) > most_turn_) continue;
          try_similarity(j, factor);
        }
    }
  }

  void try_similarity(Index j, const Vector2d& factor) {
    const Vector2d start = from_.row(around_.front()).transpose(), end = to_.row(j).transpose();
    Seed seed;
    int missed = 0;
    for (const Index k : around_) {
      const Vector2d d = from_.row(k).transpose() - start;
      const Vector2d place =
          end + Vector2d(factor.x() * d.x() - factor.y() * d.y(), factor.x() * d.y() + factor.y() * d.x());
      const Index found = cells_.nearest(place, reach_);
      if (found >= 0)
        seed.pairs.emplace_back(k, found);
      else if (++missed > kMostMissed)
        return;
    }
    for (int round = 0; round < 2; ++round)
      if (!refit(seed)) return;
    if (static_cast<int>(seed.pairs.size()) + kMostMissed >= static_cast<int>(around_.size()))
      seeds_.push_back(std::move(seed));
  }

  // An affine map to the pairs, and the pairs that it brings about.
  bool refit(Seed& seed) const {
    const auto count = static_cast<Index>(seed.pairs.size());
    if (count < 6) return false;
    Eigen::Matrix3d gram = Eigen::Matrix3d::Identity() * 1e-9;
    Eigen::Matrix<double, 3, 2> right = Eigen::Matrix<double, 3, 2>::Zero();
    const Eigen::RowVector2d origin = from_.row(around_.front()), end = to_.row(seed.pairs.front().second);
    for (const auto& [i, j] : seed.pairs) {
      const Eigen::Vector3d p(1, from_(i, 0) - origin.x(), from_(i, 1) - origin.y());
      gram += p * p.transpose();
      right += p * (to_.row(j) - end);
    }
    const MatrixXd map = dense::Cholesky(gram).solve(MatrixXd(right));
    const double area = map(1, 0) * map(2, 1) - map(1, 1) * map(2, 0);
    if (!(area > 0.5 * kLeastSeedScale * kLeastSeedScale && area < 2 * kMostSeedScale * kMostSeedScale))
      return false;
    seed.pairs.clear();
    seed.miss = 0;
    std::vector<Index> taken;
    for (const Index k : around_) {
      const Eigen::RowVector3d p(1, from_(k, 0) - origin.x(), from_(k, 1) - origin.y());
      const Vector2d place = (p * map + end).transpose();
      const Index found = cells_.nearest(place, kFineSeedReach * spacing_);
      if (found < 0 || std::find(taken.begin(), taken.end(), found) != taken.end()) continue;
      taken.push_back(found);
      seed.pairs.emplace_back(k, found);
      seed.miss += 0.5 * (to_.row(found).transpose() - place).squaredNorm();
    }
    seed.miss /= std::max(1., static_cast<double>(seed.pairs.size()));
    return true;
  }

  const MatrixXd &from_, &to_;
  double spacing_, reach_, most_turn_;
  Cells cells_;
  std::vector<Index> around_;
  std::vector<Seed> seeds_;
};

}  // namespace

std::vector<Seed> find_seeds(const MatrixXd& from, const MatrixXd& to, double spacing, double most_turn_deg,
                             size_t most) {
  if (from.cols() != 2 || from.rows() < kNeighbours || !(spacing > 0)) return {};
  return Finder(from, to, spacing, most_turn_deg).find(most);
}

}  // namespace palpate
