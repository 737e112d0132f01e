#include "engine/palpation/hand/hand_places.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "engine/base/text.h"
#include "engine/motion/registration.h"
#include "engine/numeric/dense.h"
#include "engine/palpation/hand/skin_overlap.h"
#include "palpate/error.h"

namespace palpate {
namespace {

constexpr double kLeastSignificance = 9;  // of a place that was searched without a guess
constexpr double kLeastOverlap = 0.15, kLeastFitting = 0.6;
constexpr double kMostMisfit = 4.5;     // standard errors of a pair, of its three numbers together
constexpr double kOverlapLooked = 0.3;  // of places that are known: from so much on a pair is looked at

using Vector3 = Eigen::Vector3d;

/// Where the second press lies, seen from the first, with the inverse covariance of that.
struct Link {
  size_t first, second;
  RigidMotion motion;  // of the skin from the first pad's frame to the second's
  Eigen::Vector3d at_mm;
  Eigen::Matrix3d information;
  double overlap;
};

RigidMotion pose_of(const Vector3& place) {
  return {turn_of({0, 0, place(2)}), {place(0), place(1), 0}};
}

/// Three numbers of a small motion: along x and y, turn.
Vector3 planar(const Vector6d& twist) {
  return {twist(0), twist(1), twist(5)};
}

/// Skin's motion between pads at two places.
RigidMotion motion_between(const Vector3& first, const Vector3& second) {
  return pose_of(second).inverse() * pose_of(first);
}

/// The link's measured motion flattened: a pad lies on the skin, and tilt and depth are its own.
Vector3 miss(const Link& link, const Vector3& first, const Vector3& second) {
  return planar(twist_between(motion_between(first, second), link.motion, link.at_mm));
}

class Placement {
 public:
  Placement(const std::vector<HandPress>& presses, const HandPlaceOptions& options)
      : presses_(presses), options_(options) {
    for (const HandPress& press : presses) surfaces_.emplace_back(press.relief.map());
    out_.places.resize(presses.size());
  }

  HandPlaces run();

 private:
  std::optional<Link> link(size_t first, size_t second, const RigidMotion& start) const;
  std::optional<Link> search(size_t first, size_t second) const;
  void place_each();
  void link_neighbours();
  double overlap(size_t first, size_t second) const;
  void solve();
  bool drop_worst();
  double spread() const;

  const std::vector<HandPress>& presses_;
  const HandPlaceOptions& options_;
  std::vector<ContactSurface> surfaces_;
  std::vector<Link> links_;
  std::vector<Vector3> pose_ = std::vector<Vector3>(presses_.size(), Vector3::Zero());
  Eigen::MatrixXd inverse_;  // of the normal equations, the first press held
  HandPlaces out_;
};

std::optional<Link> Placement::link(size_t first, size_t second, const RigidMotion& start) const {
  if (surfaces_[first].count() == 0 || surfaces_[second].count() == 0) return std::nullopt;
  const Registration found = register_surface(surfaces_[first], surfaces_[second], start);
  if (!found.found || !found.converged || found.overlap < kLeastOverlap || found.fitting < kLeastFitting)
    return std::nullopt;
  for (const int c : {0, 1, 5})
    if (!found.freedom.determined(c)) return std::nullopt;
  Link link{first, second, found.motion, found.at_mm, Eigen::Matrix3d::Zero(), found.overlap};
  Eigen::MatrixXd covariance(3, 3);
  constexpr int kAxes[] = {0, 1, 5};
  for (int a = 0; a < 3; ++a)
    for (int b = 0; b < 3; ++b) covariance(a, b) = found.covariance(kAxes[a], kAxes[b]);
  for (int c = 0; c < 3; ++c)
    covariance(c, c) += std::pow(c < 2 ? options_.skin_sd_mm : options_.skin_sd_rad, 2);
  link.information = dense::inverse(covariance);
  return link;
}

std::optional<Link> Placement::search(size_t first, size_t second) const {
  const SkinOverlap seen =
      find_skin_overlap(presses_[first].relief, presses_[second].relief, options_.most_turn_rad);
  if (seen.significance < kLeastSignificance) return std::nullopt;
  const RigidMotion start =
      motion_between(Vector3::Zero(), {seen.shift_mm[0], seen.shift_mm[1], seen.turn_rad});
  std::optional<Link> found = link(first, second, start);
  // A search that ran off has found another place than the texture.
  if (found && planar(twist_between(start, found->motion, found->at_mm)).head<2>().norm() > 1.5)
    found.reset();
  return found;
}

/// Each press where it fits one that is placed: the one before it, then the others.
void Placement::place_each() {
  std::vector<size_t> order = {0};
  out_.places[0].placed = true;
  for (bool more = true; more;) {
    more = false;
    for (size_t p = 1; p < presses_.size(); ++p) {
      if (out_.places[p].placed) continue;
      std::vector<size_t> from = order;
      std::stable_sort(from.begin(), from.end(), [p](size_t a, size_t b) {
        return std::abs(double(a) - double(p)) < std::abs(double(b) - double(p));
      });
      if (from.size() > 4) from.resize(4);
      if (from.back() != 0) from.push_back(0);  // the first one lies in the middle
      for (const size_t q : from) {
        const std::optional<Link> found = search(q, p);
        if (!found) continue;
        links_.push_back(*found);
        const RigidMotion at = pose_of(pose_[q]) * found->motion.inverse();
        pose_[p] = {at.shift_mm[0], at.shift_mm[1], turn_vector(at.turn)[2]};
        out_.places[p].placed = more = true;
        order.push_back(p);
        break;
      }
    }
  }
}

/// Of the first press's window, what the second one's covers.
double Placement::overlap(size_t first, size_t second) const {
  const SkinRelief& relief = presses_[first].relief;
  const RigidMotion motion = motion_between(pose_[first], pose_[second]);
  const double half_x = relief.width * relief.pitch_mm / 2, half_y = relief.height * relief.pitch_mm / 2;
  int inside = 0;
  constexpr int kSide = 12;
  for (int j = 0; j < kSide; ++j)
    for (int i = 0; i < kSide; ++i) {
      const Eigen::Vector3d there = motion * Eigen::Vector3d((2 * i + 1.0 - kSide) / kSide * half_x,
                                                             (2 * j + 1.0 - kSide) / kSide * half_y, 0);
      inside += std::abs(there[0]) < half_x && std::abs(there[1]) < half_y;
    }
  return inside / double(kSide * kSide);
}

void Placement::link_neighbours() {
  for (size_t p = 0; p < presses_.size(); ++p)
    for (size_t q = p + 1; q < presses_.size(); ++q) {
      if (!out_.places[p].placed || !out_.places[q].placed || overlap(p, q) < kOverlapLooked) continue;
      const bool known = std::any_of(links_.begin(), links_.end(), [&](const Link& l) {
        return std::minmax(l.first, l.second) == std::minmax(p, q);
      });
      if (known) continue;
      const RigidMotion start = motion_between(pose_[p], pose_[q]);
      const std::optional<Link> found = link(p, q, start);
      if (found && planar(twist_between(start, found->motion, found->at_mm)).head<2>().norm() < 1)
        links_.push_back(*found);
    }
}

/// Gauss-Newton on the pairs' misses; the first press stays.
void Placement::solve() {
  const auto unknowns = static_cast<Eigen::Index>(3 * presses_.size());
  for (int round = 0; round < 6; ++round) {
    Eigen::MatrixXd normal = Eigen::MatrixXd::Identity(unknowns, unknowns) * 1e-9;
    normal.topLeftCorner<3, 3>() += Eigen::Matrix3d::Identity() * 1e12;
    Eigen::VectorXd right = Eigen::VectorXd::Zero(unknowns);
    for (const Link& l : links_) {
      const Vector3 off = miss(l, pose_[l.first], pose_[l.second]);
      Eigen::Matrix<double, 3, 6> slope;
      constexpr double kStep = 1e-6;
      for (int c = 0; c < 6; ++c) {
        std::array<Vector3, 2> moved = {pose_[l.first], pose_[l.second]};
        moved[size_t(c / 3)](c % 3) += kStep;
        slope.col(c) = (miss(l, moved[0], moved[1]) - off) / kStep;
      }
      const Eigen::Matrix<double, 6, 3> weighted = slope.transpose() * l.information;
      const Eigen::Matrix<double, 6, 6> square = weighted * slope;
      const Eigen::Matrix<double, 6, 1> pull = weighted * off;
      const Eigen::Index at[2] = {3 * Eigen::Index(l.first), 3 * Eigen::Index(l.second)};
      for (int a = 0; a < 2; ++a) {
        right.segment<3>(at[a]) -= pull.segment<3>(3 * a);
        for (int b = 0; b < 2; ++b) normal.block<3, 3>(at[a], at[b]) += square.block<3, 3>(3 * a, 3 * b);
      }
    }
    const Eigen::VectorXd step = dense::Ldlt(normal).solve(right);
    for (size_t p = 0; p < presses_.size(); ++p) pose_[p] += step.segment<3>(3 * Eigen::Index(p));
    inverse_ = dense::inverse(normal);
    if (step.cwiseAbs().maxCoeff() < 1e-7) break;
  }
}

/// The pair that is farthest from the others, where a press hangs on others too.
bool Placement::drop_worst() {
  size_t worst = links_.size();
  double most = kMostMisfit;
  for (size_t l = 0; l < links_.size(); ++l) {
    const auto hangs_on = [&](size_t p) {
      return std::count_if(links_.begin(), links_.end(),
                           [p](const Link& k) { return k.first == p || k.second == p; });
    };
    const Vector3 off = miss(links_[l], pose_[links_[l].first], pose_[links_[l].second]);
    const double far = std::sqrt(off.dot(links_[l].information * off));
    if (far > most && hangs_on(links_[l].first) > 1 && hangs_on(links_[l].second) > 1) {
      most = far;
      worst = l;
    }
  }
  if (worst == links_.size()) return false;
  links_.erase(links_.begin() + std::ptrdiff_t(worst));
  return true;
}

/// Mean square of the pairs' misses in their errors, by what they have more than the places need; 1 or more.
double Placement::spread() const {
  size_t placed = 0;
  for (const HandPlace& place : out_.places) placed += place.placed;
  if (links_.size() < placed) return 1;
  double square = 0;
  for (const Link& l : links_) {
    const Vector3 off = miss(l, pose_[l.first], pose_[l.second]);
    square += off.dot(l.information * off);
  }
  return std::max(square / (3.0 * double(links_.size() - (placed - 1))), 1.0);
}

HandPlaces Placement::run() {
  place_each();
  if (links_.empty())
    throw Error(Failure::Input, "two presses that see the same skin",
                "no relief of '" + presses_[0].name + "' fits that of another press",
                "a skin with texture, and presses that overlap by half");
  link_neighbours();
  solve();
  while (drop_worst()) solve();
  const auto unknowns = static_cast<Eigen::Index>(3 * presses_.size());
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(unknowns, unknowns);
  const double wider = spread();
  const RigidMotion first = pose_of({options_.first_mm[0], options_.first_mm[1], 0});
  for (size_t p = 0; p < presses_.size(); ++p) {
    HandPlace& place = out_.places[p];
    if (!place.placed) {
      place.reason = surfaces_[p].count() == 0
                         ? "the skin does not touch the pad"
                         : "its skin fits that of no other press: no texture or no overlap";
      continue;
    }
    const RigidMotion at = first * pose_of(pose_[p]);
    place.at_mm = {at.shift_mm[0], at.shift_mm[1]};
    place.turn_rad = pose_[p](2);
    for (size_t q = 0; q < presses_.size(); ++q)
      if (out_.places[q].placed)
        covariance.block<3, 3>(3 * Eigen::Index(p), 3 * Eigen::Index(q)) =
            wider * inverse_.block<3, 3>(3 * Eigen::Index(p), 3 * Eigen::Index(q));
  }
  out_.covariance.assign(covariance.data(), covariance.data() + covariance.size());
  for (const Link& l : links_) {
    const Vector3 off = miss(l, pose_[l.first], pose_[l.second]);
    out_.pairs.push_back({l.first, l.second, l.overlap, std::sqrt(off.dot(l.information * off))});
  }
  return out_;
}

}  // namespace

HandPlaces place_presses(const std::vector<HandPress>& presses, const HandPlaceOptions& options) {
  if (presses.size() < 2)
    throw Error(Failure::Input, "two presses by hand or more", std::to_string(presses.size()),
                "presses that overlap by half");
  const SkinRelief& first = presses[0].relief;
  for (const HandPress& press : presses) {
    const SkinRelief& r = press.relief;
    if (r.width != first.width || r.height != first.height || r.pitch_mm != first.pitch_mm)
      throw Error(
          Failure::Input,
          text("the pad of press '%s', %u x %u px of %g mm", presses[0].name.c_str(), first.width,
               first.height, first.pitch_mm),
          text("%u x %u px of %g mm in press '%s'", r.width, r.height, r.pitch_mm, press.name.c_str()),
          "presses of one pad");
  }
  return Placement(presses, options).run();
}

}  // namespace palpate
