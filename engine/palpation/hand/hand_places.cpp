#include "engine/palpation/hand/hand_places.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <optional>

#include "engine/base/text.h"
#include "engine/motion/rigid_motion.h"
#include "engine/numeric/dense.h"
#include "engine/palpation/hand/skin_fit.h"
#include "engine/palpation/hand/skin_overlap.h"
#include "palpate/error.h"

namespace palpate {
namespace {

constexpr double kLeastOverlap = 0.15;
constexpr double kFarFromStart_mm = 1;  // of a fit from where it starts
constexpr int kUnknowns = 5;            // of each press
constexpr double kMostMisfit = 4.5;     // standard errors of a pair, of its four numbers together
constexpr double kWider_sd = 0.1;       // share of what a block is wider by, where it is pressed harder
constexpr double kOverlapLooked = 0.3;  // of places that are known: from so much on a pair is looked at

using Vector3 = Eigen::Vector3d;
/// A pad's place and turn, and its tilts about the axes of the first one.
using Pose = Eigen::Matrix<double, 5, 1>;
using Misses = Eigen::Vector4d;
using Plane = std::complex<double>;

/// Where the second press lies, seen from the first, with the inverse covariance of that.
struct Link {
  size_t first, second;
  SkinFit fit;
  Eigen::Matrix4d information;
};

RigidMotion pose_of(const Pose& pose) {
  return {turn_of({0, 0, pose(2)}), {pose(0), pose(1), 0}};
}

/// Skin's motion between pads at two places.
RigidMotion motion_between(const Pose& first, const Pose& second) {
  return pose_of(second).inverse() * pose_of(first);
}

class Placement {
 public:
  Placement(const std::vector<HandPress>& presses, const HandPlaceOptions& options)
      : presses_(presses), options_(options) {
    for (const HandPress& press : presses) {
      check_stop(options.stop);
      skins_.emplace_back(press.relief);
    }
    out_.places.resize(presses.size());
  }

  HandPlaces run();

 private:
  std::optional<Link> link(size_t first, size_t second, const RigidMotion& start) const;
  std::optional<Link> search(size_t first, size_t second) const;
  Misses miss(const Link& link, const Pose& first, const Pose& second) const;
  double misfit(const Link& link) const;
  void place_each();
  void link_neighbours();
  double overlap(size_t first, size_t second) const;
  void solve();
  bool drop_worst();
  double spread() const;

  const std::vector<HandPress>& presses_;
  const HandPlaceOptions& options_;
  std::vector<SkinLevels> skins_;
  std::vector<Link> links_;
  std::vector<Pose> pose_ = std::vector<Pose>(presses_.size(), Pose::Zero());
  Eigen::MatrixXd inverse_;  // of the normal equations, the first press held
  HandPlaces out_;
};

std::optional<Link> Placement::link(size_t first, size_t second, const RigidMotion& start) const {
  check_stop(options_.stop);
  const std::optional<SkinFit> found = fit_skin(skins_[first], skins_[second], start);
  if (!found || found->overlap < kLeastOverlap) return std::nullopt;
  // A fit that ran off has found another place than the texture.
  const Vector3 from(found->from_mm[0], found->from_mm[1], 0);
  if ((found->motion() * from - start * from).norm() > kFarFromStart_mm) return std::nullopt;
  Eigen::Matrix4d covariance = found->covariance;
  for (int c = 0; c < 4; ++c)
    covariance(c, c) += std::pow(c < 2 ? options_.skin_sd_mm : options_.skin_sd_rad, 2);
  return Link{first, second, *found, dense::inverse(covariance)};
}

std::optional<Link> Placement::search(size_t first, size_t second) const {
  check_stop(options_.stop);
  const SkinOverlap seen =
      find_skin_overlap(presses_[first].relief, presses_[second].relief, options_.most_turn_rad);
  if (!seen.sure()) return std::nullopt;
  Pose there = Pose::Zero();
  there.head<3>() << seen.shift_mm[0], seen.shift_mm[1], seen.turn_rad;
  return link(first, second, motion_between(Pose::Zero(), there));
}

/// What the pair's fit has more than the pads' places and tilts say: shift, turn, stretch. A tilted plate
/// bends the block as a column, and its end's skin is stretched as z - (a - ib) z^2 about the block's middle,
/// a and b the tilts over four heights.
Misses Placement::miss(const Link& link, const Pose& first, const Pose& second) const {
  const Plane middle = Plane(options_.first_mm[0], options_.first_mm[1]) / presses_[0].wider;
  const double four_mm = 4 * presses_[0].observation.block_mm[2];
  const auto at = [&](const Pose& pose, const Eigen::Vector2d& seen) {
    return middle + Plane(pose(0), pose(1)) + std::polar(1.0, pose(2)) * Plane(seen[0], seen[1]);
  };
  const auto bent = [&](const Pose& pose) { return Plane(pose(3), -pose(4)) / four_mm; };
  const Plane z1 = at(first, link.fit.from_mm), z2 = at(second, link.fit.at_mm);
  const Plane k1 = bent(first), k2 = bent(second);
  const Plane shift = (z2 - k2 * z2 * z2 - z1 + k1 * z1 * z1) * std::polar(1.0, -second(2));
  const Plane swell = std::log((1.0 - 2.0 * k2 * z2) / (1.0 - 2.0 * k1 * z1));
  return {shift.real(), shift.imag(), swell.imag() + second(2) - first(2) + link.fit.turn_rad,
          swell.real() + std::log(link.fit.stretch)};
}

double Placement::misfit(const Link& link) const {
  const Misses off = miss(link, pose_[link.first], pose_[link.second]);
  return std::sqrt(off.dot(link.information * off));
}

/// Each press where it fits one that is placed, from that before it to those farther in the row.
void Placement::place_each() {
  std::vector<size_t> order = {0};
  out_.places[0].placed = true;
  std::vector<size_t> asked(presses_.size(), 0);  // of those that are placed, by how many
  for (bool more = true; more;) {
    more = false;
    for (size_t p = 1; p < presses_.size(); ++p) {
      if (out_.places[p].placed) continue;
      std::vector<size_t> from(order.begin() + std::ptrdiff_t(asked[p]), order.end());
      asked[p] = order.size();
      std::stable_sort(from.begin(), from.end(), [p](size_t a, size_t b) {
        return std::abs(double(a) - double(p)) < std::abs(double(b) - double(p));
      });
      for (const size_t q : from) {
        const std::optional<Link> found = search(q, p);
        if (!found) continue;
        links_.push_back(*found);
        const RigidMotion at = pose_of(pose_[q]) * found->fit.motion().inverse();
        pose_[p].head<3>() << at.shift_mm[0], at.shift_mm[1], turn_vector(at.turn)[2];
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
      std::optional<Link> found = link(p, q, motion_between(pose_[p], pose_[q]));
      if (!found) found = search(p, q);
      if (found) links_.push_back(*found);
    }
}

/// Gauss-Newton on the pairs' misses and on tilts, of which a hand makes small ones; the first press stays.
void Placement::solve() {
  const auto unknowns = static_cast<Eigen::Index>(kUnknowns * presses_.size());
  for (int round = 0; round < 6; ++round) {
    Eigen::MatrixXd normal = Eigen::MatrixXd::Identity(unknowns, unknowns) * 1e-9;
    normal.topLeftCorner<3, 3>() += Eigen::Matrix3d::Identity() * 1e12;
    Eigen::VectorXd right = Eigen::VectorXd::Zero(unknowns);
    for (size_t p = 0; p < presses_.size(); ++p)
      for (const Eigen::Index c : {3, 4}) {
        normal.diagonal()[kUnknowns * Eigen::Index(p) + c] += std::pow(options_.tilt_sd_rad, -2);
        right[kUnknowns * Eigen::Index(p) + c] -= pose_[p](c) * std::pow(options_.tilt_sd_rad, -2);
      }
    for (const Link& l : links_) {
      const Misses off = miss(l, pose_[l.first], pose_[l.second]);
      Eigen::Matrix<double, 4, 2 * kUnknowns> slope;
      constexpr double kStep = 1e-6;
      for (int c = 0; c < 2 * kUnknowns; ++c) {
        std::array<Pose, 2> moved = {pose_[l.first], pose_[l.second]};
        moved[size_t(c / kUnknowns)](c % kUnknowns) += kStep;
        slope.col(c) = (miss(l, moved[0], moved[1]) - off) / kStep;
      }
      const Eigen::Matrix<double, 2 * kUnknowns, 4> weighted = slope.transpose() * l.information;
      const Eigen::Matrix<double, 2 * kUnknowns, 2 * kUnknowns> square = weighted * slope;
      const Eigen::Matrix<double, 2 * kUnknowns, 1> pull = weighted * off;
      const Eigen::Index at[2] = {kUnknowns * Eigen::Index(l.first), kUnknowns * Eigen::Index(l.second)};
      for (int a = 0; a < 2; ++a) {
        right.segment<kUnknowns>(at[a]) -= pull.segment<kUnknowns>(kUnknowns * a);
        for (int b = 0; b < 2; ++b)
          normal.block<kUnknowns, kUnknowns>(at[a], at[b]) +=
              square.block<kUnknowns, kUnknowns>(kUnknowns * a, kUnknowns * b);
      }
    }
    const Eigen::VectorXd step = dense::Ldlt(normal).solve(right);
    for (size_t p = 0; p < presses_.size(); ++p)
      pose_[p] += step.segment<kUnknowns>(kUnknowns * Eigen::Index(p));
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
    const double far = misfit(links_[l]);
    if (far > most && hangs_on(links_[l].first) > 1 && hangs_on(links_[l].second) > 1) {
      most = far;
      worst = l;
    }
  }
  if (worst == links_.size()) return false;
  links_.erase(links_.begin() + std::ptrdiff_t(worst));
  return true;
}

/// Mean square of the misses and tilts in their errors, by what they have more than the unknowns; 1 or more.
double Placement::spread() const {
  size_t placed = 0;
  double square = 0;
  for (size_t p = 0; p < presses_.size(); ++p) {
    placed += out_.places[p].placed;
    square += (pose_[p].tail<2>() / options_.tilt_sd_rad).squaredNorm();
  }
  for (const Link& l : links_) square += std::pow(misfit(l), 2);
  return std::max(square / (4.0 * double(links_.size()) - 3.0 * double(placed - 1)), 1.0);
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
  const double by_misses = spread();
  for (size_t p = 0; p < presses_.size(); ++p) {
    HandPlace& place = out_.places[p];
    if (!place.placed) {
      place.reason = !(skins_[p].texture[0].power() > 0)
                         ? "the skin does not touch the pad"
                         : "its skin fits that of no other press: no texture or no overlap";
      continue;
    }
    const double wider = presses_[p].wider;
    for (size_t c = 0; c < 2; ++c)
      place.at_mm[c] =
          wider * (options_.first_mm[c] / presses_[0].wider + pose_[p](static_cast<Eigen::Index>(c)));
    place.turn_rad = pose_[p](2);
    for (size_t q = 0; q < presses_.size(); ++q)
      if (out_.places[q].placed)
        covariance.block<3, 3>(3 * Eigen::Index(p), 3 * Eigen::Index(q)) =
            by_misses * inverse_.block<3, 3>(kUnknowns * Eigen::Index(p), kUnknowns * Eigen::Index(q));
    for (Eigen::Index c = 0; c < 2; ++c)
      covariance(3 * Eigen::Index(p) + c, 3 * Eigen::Index(p) + c) +=
          std::pow(kWider_sd * (wider - 1) * place.at_mm[static_cast<size_t>(c)], 2);
  }
  out_.covariance.assign(covariance.data(), covariance.data() + covariance.size());
  for (const Link& l : links_) out_.pairs.push_back({l.first, l.second, l.fit.overlap, misfit(l)});
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
