#include "engine/motion/pose_tracker.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <utility>
#include <vector>

#include "engine/motion/repeats.h"

namespace palpate {

PoseComponents Pose::components(const Eigen::Vector3d& place_mm) const {
  const Eigen::Vector3d shift = place_mm - motion.inverse() * place_mm, turn = turn_vector(motion.turn);
  // A shift is counted from where the place was, which an error now moves as the motion turns it back.
  Matrix6d told_by = Matrix6d::Zero();
  told_by.topLeftCorner<3, 3>() = motion.turn.transpose();
  told_by.bottomRightCorner<3, 3>() = turn_vector_slope(turn);
  const Matrix6d change = told_by * seen_at(at_mm, place_mm);
  const Matrix6d spread = change * covariance * change.transpose();
  const Freedom there = freedom.at(place_mm).told_by(told_by);
  const auto told = [&](int k, double value) {
    return there.determined(k) ? value : std::numeric_limits<double>::quiet_NaN();
  };
  PoseComponents out;
  for (int k = 0; k < 3; ++k) {
    out.shift_mm[k] = told(k, shift[k]);
    out.shift_sd_mm[k] = told(k, std::hypot(std::sqrt(spread(k, k)), there.unknown_sd(k, roll_rad)));
    out.turn_rad[k] = told(k + 3, turn[k]);
    out.turn_sd_rad[k] =
        told(k + 3, std::hypot(std::sqrt(spread(k + 3, k + 3)), there.unknown_sd(k + 3, roll_rad)));
  }
  return out;
}

namespace {

/// The largest of several contacts; nothing where there is one, or the others are less than a tenth of it.
std::vector<uint8_t> largest_of_several(const HeightMap& map) {
  std::vector<uint32_t> label(map.contact.size()), size = {0}, waiting;
  for (uint32_t first = 0; first < label.size(); ++first) {
    if (map.contact[first] == 0 || label[first] != 0) continue;
    const auto name = static_cast<uint32_t>(size.size());
    size.push_back(0);
    label[first] = name;
    waiting.push_back(first);
    while (!waiting.empty()) {
      const uint32_t pixel = waiting.back(), column = pixel % map.width, row = pixel / map.width;
      waiting.pop_back();
      ++size[name];
      for (uint32_t y = std::max(row, 1u) - 1; y <= std::min(row + 1, map.height - 1); ++y)
        for (uint32_t x = std::max(column, 1u) - 1; x <= std::min(column + 1, map.width - 1); ++x) {
          const uint32_t near = y * map.width + x;
          if (map.contact[near] == 0 || label[near] != 0) continue;
          label[near] = name;
          waiting.push_back(near);
        }
    }
  }
  const auto largest = std::ranges::max_element(size);
  const auto all = std::accumulate(size.begin(), size.end(), 0u);
  if (all - *largest < *largest / 10) return {};
  std::vector<uint8_t> out(label.size());
  for (size_t i = 0; i < out.size(); ++i) out[i] = label[i] == largest - size.begin() && label[i] > 0 ? 1 : 0;
  return out;
}

constexpr size_t kLeastContact = 200;  // pixels of a contact

}  // namespace

const Pose& PoseTracker::update(const HeightMap& map) {
  ContactSurface surface(map, options_.surface);
  if (surface.count() < kLeastContact) return lift();
  if (pose_.state == PoseState::NoContact || pose_.state == PoseState::Lost) {
    begin(std::move(surface), pose_.track + 1);
    return pose_;
  }
  Found found = find(surface);
  const bool apart = find_apart(map, found, surface);
  if (found.loss != PoseLoss::None) {
    pose_ = {.state = PoseState::Lost, .loss = found.loss, .track = pose_.track, .keys = pose_.keys};
    return pose_;
  }
  if (still_grows(surface, found.registration)) {
    begin(std::move(surface), pose_.track);
    return pose_;
  }
  take(key_, found.registration);
  go_on(found.registration);
  pose_.doubt = apart ? PoseDoubt::OthersMove : doubt_of(found.registration);
  if (!needs_key(found.registration)) return pose_;
  look_back(surface);
  memory_.keep(std::move(key_));
  make_key(std::move(surface));
  return pose_;
}

const Pose& PoseTracker::lift() {
  pose_ = {.track = pose_.track};
  return pose_;
}

bool PoseTracker::find_apart(const HeightMap& map, Found& found, ContactSurface& surface) const {
  constexpr double kWholeFitting = 0.85, kCalm = 1.5, kBetter = 0.7;
  const Registration& whole = found.registration;
  const bool calm = last_residual_mm_ <= 0 || whole.residual_mm < kCalm * last_residual_mm_;
  if (found.loss == PoseLoss::None && whole.fitting > kWholeFitting && calm) return false;
  const std::vector<uint8_t> largest = largest_of_several(map);
  if (largest.empty()) return false;
  HeightMap part = map;
  part.contact = largest;
  ContactSurface alone(part, options_.surface);
  if (alone.count() < kLeastContact) return false;
  Found better = find(alone);
  if (better.loss != PoseLoss::None) return false;
  if (found.loss == PoseLoss::None && better.registration.residual_mm > kBetter * whole.residual_mm)
    return false;
  found = std::move(better);
  surface = std::move(alone);
  return true;
}

PoseTracker::Found PoseTracker::find(const ContactSurface& surface) const {
  RegistrationOptions options = options_.registration;
  options.enough_residual_mm = 1.5 * last_residual_mm_;
  Found found{register_surface(key_.surface, surface, from_key_, options, *sums_)};
  found.loss = loss_of(found.registration);
  if (found.loss == PoseLoss::None) return found;
  // Once more from where it would be, had it gone on.
  const RigidMotion further = last_step_ * from_key_;
  found.registration = register_surface(key_.surface, surface, further, options_.registration, *sums_);
  found.loss = loss_of(found.registration);
  return found;
}

PoseDoubt PoseTracker::doubt_of(const Registration& found) {
  constexpr double kRestless = 2, kForgets = 1.1;
  const bool restless = calm_residual_mm_ > 0 && found.residual_mm > kRestless * calm_residual_mm_;
  const bool again = restless && restless_;
  restless_ = restless;
  calm_residual_mm_ =
      calm_residual_mm_ > 0 ? std::min(kForgets * calm_residual_mm_, found.residual_mm) : found.residual_mm;
  if (again) return PoseDoubt::ShapeChanges;
  return key_.repeats ? PoseDoubt::FitsElsewhere : PoseDoubt::None;
}

bool PoseTracker::still_grows(const ContactSurface& surface, const Registration& found) const {
  const double along_mm = (found.at_mm - key_.surface.centroid_mm()).head<2>().norm();
  return pose_.keys == 1 &&
         static_cast<double>(surface.count()) > options_.grown * static_cast<double>(key_.surface.count()) &&
         along_mm < options_.still * key_.surface.radius_mm();
}

void PoseTracker::begin(ContactSurface surface, uint32_t track) {
  pose_ = {.state = PoseState::Begun, .track = track};
  pose_.at_mm = surface.centroid_mm();
  pose_.freedom.at_mm = pose_.at_mm;
  pose_.freedom.radius_mm = surface.radius_mm();
  pose_.overlap = 1;
  last_step_ = {};
  first_ = surface.error_of_level();
  link_.setZero();
  before_.setZero();
  tilted_.setZero();
  smoothed_.setZero();
  last_residual_mm_ = high_residual_mm_ = calm_residual_mm_ = 0;
  way_mm_ = 0;
  restless_ = false;
  memory_.clear();
  make_key(std::move(surface));
}

PoseLoss PoseTracker::loss_of(const Registration& found) const {
  if (!found.found || found.overlap < options_.least_overlap) return PoseLoss::LittleOverlap;
  if (found.fitting < options_.least_fitting) return PoseLoss::ManyStrangers;
  if (high_residual_mm_ > 0 && found.residual_mm > options_.most_residual * high_residual_mm_)
    return PoseLoss::LargeResidual;
  if (found.disagreement > options_.most_disagreement) return PoseLoss::SlopesDisagree;
  // Only the part of a step that is known counts.
  const double diameter_mm = 2 * key_.surface.radius_mm();
  if ((found.at_mm - last_at_mm_).norm() > options_.most_step * diameter_mm) return PoseLoss::LargeStep;
  return PoseLoss::None;
}

void PoseTracker::take(const TrackKey& key, const Registration& found) {
  pose_.state = PoseState::Tracked;
  pose_.loss = PoseLoss::None;
  pose_.motion = found.motion * key.motion;
  pose_.at_mm = found.at_mm;
  const Matrix6d moved = carried_by(found.motion);
  pose_.since_key = found.covariance;
  link_ = found.covariance - found.of_levels;
  // A key frame's noise enters the motions to it and from it with opposite signs: it cancels in what both
  // share.
  const double shared = std::max(key.overlap + found.overlap - 1, 0.0);
  before_ = moved * (key.before + (1 - shared) * key.link) * moved.transpose();
  tilted_ = moved * key.tilted;
  tilted_.segment<2>(3) += turn_vector(found.motion.turn).head<2>();
  smoothed_ = moved * key.smoothed + found.by_smoothing;
  // A level is wrong wherever the contact is, and cancels: those of the first frame and of this one are left.
  pose_.covariance = found.covariance - key.surface.error_of_level() + first_ + before_ +
                     alike_error(tilted_, options_.gain_sd, smoothed_, options_.skin_smoothing_sd_mm2);
  pose_.freedom = found.freedom.with(key.freedom.after(found.motion));
  pose_.surface = found.freedom.kind;
  pose_.pivot_mm = found.freedom.pivot_mm;
  const Eigen::Vector3d place = found.freedom.has_pivot() ? pose_.pivot_mm : pose_.at_mm;
  way_mm_ = std::max(way_mm_, (place - pose_.motion.inverse() * place).head<2>().norm());
  const double high_mm = found.freedom.has_pivot() ? (place - pose_.at_mm).norm() : key.surface.radius_mm();
  constexpr double kLeast_rad = 1e-3;
  const double rolled_rad =
      std::hypot(way_mm_ / std::max(high_mm, 1e-9), turn_vector(pose_.motion.turn).norm());
  pose_.roll_rad = std::max(pose_.roll_rad, std::clamp(rolled_rad, kLeast_rad, 1.0));
  pose_.residual_mm = found.residual_mm;
  pose_.overlap = found.overlap;
}

void PoseTracker::go_on(const Registration& found) {
  last_step_ = found.motion * from_key_.inverse();
  from_key_ = found.motion;
  last_at_mm_ = found.at_mm;
  last_residual_mm_ = found.residual_mm;
  high_residual_mm_ = std::max(found.residual_mm, 0.9 * high_residual_mm_);
  if (key_.residual_mm <= 0) key_.residual_mm = found.residual_mm;
}

void PoseTracker::look_back(const ContactSurface& surface) {
  if (pose_.freedom.unknown.cols() > 0) return;
  const auto back =
      memory_.recognise(surface, {pose_.motion, pose_.covariance, pose_.at_mm, pose_.residual_mm},
                        options_.registration, *sums_);
  if (!back) return;
  take(*back->key, back->found);
  ++pose_.returns;
}

bool PoseTracker::needs_key(const Registration& found) const {
  constexpr double kDegree = std::numbers::pi / 180;
  return found.overlap < options_.key_overlap ||
         turn_vector(found.motion.turn).norm() > options_.key_turn_deg * kDegree ||
         found.residual_mm > options_.key_residual * key_.residual_mm;
}

void PoseTracker::make_key(ContactSurface surface) {
  const Matrix6d moved = seen_at(pose_.at_mm, surface.centroid_mm());
  key_.motion = pose_.motion;
  key_.link = moved * link_ * moved.transpose();
  key_.before = moved * before_ * moved.transpose();
  key_.tilted = moved * tilted_;
  key_.smoothed = moved * smoothed_;
  key_.overlap = pose_.overlap;
  key_.freedom = pose_.freedom.at(surface.centroid_mm());
  key_.residual_mm = 0;
  last_at_mm_ = surface.centroid_mm();
  key_.repeats = fits_elsewhere(surface, 2 * options_.most_step * surface.radius_mm(),
                                options_.registration.least_slope()) >= kRepeats;
  key_.surface = std::move(surface);
  from_key_ = {};
  ++pose_.keys;
}

}  // namespace palpate
