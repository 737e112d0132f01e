#include "engine/pipeline/object_follower.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "engine/base/numbers.h"
#include "shaders/shared/cell_change.h"

namespace palpate {
namespace {

constexpr double kDeep = 0.5;  // of the deepest point, from which a pixel counts as in contact
/// Part of its way along the pad that an object is held back by, where what markers hide is filled: that
/// stays with the skin. RMS of four simulated objects that slip (0.005 to 0.029).
constexpr double kHeldBack = 0.02;

/// Part of its way into the pad since the track began that a depth is wrong by: 0.002 to 0.02 of it on gentle
/// flanks, and where flanks are steeper than pictures show by the fourth power of their slope, 0.065 (coin)
/// and 0.17 (disc) of it at 1. Of seven simulated objects. And part of that by which one side of the contact
/// differs from the other.
constexpr double kShort = 0.01, kShortOfSteep = 0.15, kUneven = 0.06;
constexpr double kRim_mm = 0.4;  // to each side of the contact's border

/// RegistrationOptions::skin_smoothing_mm2 where the skin is not known: one that smooths by 0 or 0.12 mm is a
/// standard error from it.
constexpr double kSkin_mm2 = 0.0036;

void add_depth_error(double way_mm, double gain_sd, double rim_slope, Pose& pose) {
  const double wrong_mm = std::hypot(kShort, gain_sd, kShortOfSteep * std::pow(rim_slope, 4)) * way_mm,
               tilt = kUneven * wrong_mm / pose.freedom.radius_mm;
  pose.covariance(2, 2) += wrong_mm * wrong_mm;
  for (Eigen::Index k = 3; k < 5; ++k) pose.covariance(k, k) += tilt * tilt;
}

/// Of this frame and of the one in which the track began, as much.
void add_tilt_error(double tilt_sd_rad, Pose& pose) {
  for (Eigen::Index k = 3; k < 5; ++k) pose.covariance(k, k) += 2 * tilt_sd_rad * tilt_sd_rad;
}

void add_marker_error(Pose& pose) {
  const Eigen::Vector3d shift = pose.at_mm - pose.motion.inverse() * pose.at_mm;
  for (Eigen::Index k = 0; k < 2; ++k) pose.covariance(k, k) += std::pow(kHeldBack * shift[k], 2);
  pose.covariance(5, 5) += std::pow(kHeldBack * turn_vector(pose.motion.turn)[2], 2);
}

Validity reason_of(PoseState state) {
  if (state == PoseState::PictureDamaged) return Validity::PictureDamaged;
  return state == PoseState::Lost ? Validity::NotFollowed : Validity::NoContact;
}

ObjectPose summary_of(const Pose& pose) {
  if (pose.state == PoseState::NoContact || pose.state == PoseState::Lost) {
    ObjectPose out = unknown_pose(pose.state, pose.loss);
    out.track = pose.track;
    out.keys = pose.keys;
    return out;
  }
  ObjectPose out;
  out.state = pose.state;
  out.track = pose.track;
  out.keys = pose.keys;
  out.doubt = pose.doubt;
  out.surface = pose.surface;
  // A ball's centre has shifts that its surface has not.
  const Eigen::Vector3d place = pose.freedom.has_pivot() ? pose.pivot_mm : pose.at_mm;
  const PoseComponents seen = pose.components(place);
  const auto told = [](double value, double sd) {
    return Estimate{value, sd, std::isnan(value) ? Validity::Undetermined : Validity::Valid};
  };
  for (size_t k = 0; k < 3; ++k) {
    const auto row = static_cast<Eigen::Index>(k);
    out.at_mm[k] = place[row];
    out.translation_mm[k] = pose.motion.shift_mm[row];
    out.shift_mm[k] = told(seen.shift_mm[k], seen.shift_sd_mm[k]);
    out.turn_rad[k] = told(seen.turn_rad[k], seen.turn_sd_rad[k]);
    for (size_t c = 0; c < 3; ++c)
      out.rotation[3 * k + c] = pose.motion.turn(row, static_cast<Eigen::Index>(c));
  }
  for (size_t i = 0; i < 36; ++i)
    out.covariance[i] = pose.covariance(static_cast<Eigen::Index>(i / 6), static_cast<Eigen::Index>(i % 6));
  out.residual_mm = pose.residual_mm;
  out.overlap = pose.overlap;
  return out;
}

}  // namespace

PoseOptions pose_options(const Sensor& sensor) {
  PoseOptions options;
  // Pixels smaller than this tell a motion no better: the skin smooths over more.
  constexpr double kFine_mm = 0.04;
  for (double pitch_mm = sensor.pitch_mm_per_px; pitch_mm > 0 && pitch_mm < kFine_mm; pitch_mm *= 2)
    ++options.registration.finest_level;
  // Of slopes to 0.25 through a frame's filter, where the calibration states nothing: three simulated rolls.
  double gain = 0.002;
  if (sensor.reading == SurfaceReading::Photometric) {
    const PhotometricCalibration& by = sensor.photometric;
    options.registration.pad_slope_sd =
        std::sqrt(std::max(by.normal_sd * by.normal_sd - by.noise_sd * by.noise_sd, 0.0));
    options.registration.pad_reach_mm = by.pad_reach_px * sensor.pitch_mm_per_px;
    double squares = 0;
    for (const PressError& press : by.presses) squares += press.depth_error * press.depth_error;
    if (!by.presses.empty()) gain = std::max(gain, std::sqrt(squares / double(by.presses.size())));
  }
  options.gain_sd = gain;
  options.registration.skin_smoothing_mm2 = kSkin_mm2;
  options.skin_smoothing_sd_mm2 = kSkin_mm2;
  return options;
}

ObjectPose unknown_pose(PoseState state, PoseLoss loss) {
  ObjectPose out;
  out.state = state;
  out.loss = loss;
  for (auto* of : {&out.shift_mm, &out.turn_rad}) of->fill({kNaN, kNaN, reason_of(state)});
  out.slip_mm.fill({kNaN, kNaN, reason_of(state)});
  out.at_mm.fill(kNaN);
  out.covariance.fill(kNaN);
  out.rotation.fill(kNaN);
  out.translation_mm.fill(kNaN);
  out.residual_mm = out.overlap = kNaN;
  return out;
}

ObjectFollower::ObjectFollower(const Sensor& sensor, const FrameFormat& format,
                               std::unique_ptr<PixelSums> sums, bool marked)
    : width_(format.width),
      height_(format.height),
      pitch_mm_per_px_(sensor.pitch_mm_per_px),
      marked_(marked),
      tracker_(pose_options(sensor), std::move(sums)),
      depth_mm_(size_t{width_} * height_),
      contact_(depth_mm_.size()),
      followed_(size_t{cells_along(width_)} * cells_along(height_)) {}

void ObjectFollower::look_at(const HeightRows& heights) {
  for (uint32_t y = 0; y < height_; ++y)
    std::copy_n(heights.row(y), width_, depth_mm_.begin() + std::ptrdiff_t{y} * width_);
}

ObjectPose ObjectFollower::follow(const PadAtRest& rest, double depth_gain_sd, bool touched,
                                  const GelContacts* contacts, bool by_depth) {
  if (!touched) {
    std::ranges::fill(followed_, 0);
    pose_ = tracker_.lift();
    return summary_of(pose_);
  }
  if (pose_.state == PoseState::NoContact || pose_.state == PoseState::Lost) change_ = {};
  const RestChange::Level level = change_.since(rest);
  for (float& depth : depth_mm_) depth -= static_cast<float>(level.mm);
  mark(contacts, by_depth);
  const HeightMap map{.width = width_,
                      .height = height_,
                      .pitch_mm_per_px = pitch_mm_per_px_,
                      .depth_mm = depth_mm_,
                      .level_sd_mm = level.sd_mm,
                      // What the level is wrong by is not the same from border to border.
                      .tilt_sd_rad = level.sd_mm / (0.5 * width_ * pitch_mm_per_px_),
                      .contact = contact_};
  pose_ = tracker_.update(map);
  if (contacts && pose_.state == PoseState::NoContact) {
    // What was followed has lifted, but something still touches.
    std::ranges::fill(followed_, 0);
    mark(contacts, by_depth);
    pose_ = tracker_.update(map);
  }
  if (pose_.state == PoseState::Begun) {
    begun_mm_ = pose_.at_mm[2];
    change_.begin(rest, level.mm);
  }
  if (pose_.state == PoseState::Tracked) {
    add_tilt_error(level.tilt_sd_per_cell / (shared::kCellSide * pitch_mm_per_px_), pose_);
    add_depth_error(pose_.at_mm[2] - begun_mm_, depth_gain_sd, rim_slope(), pose_);
  }
  if (marked_) add_marker_error(pose_);
  return summary_of(pose_);
}

// The contact that holds most of the cells of the one that was followed, else the largest.
void ObjectFollower::mark_contact(const GelContacts& contacts) {
  shared_.assign(contacts.count() + 1, 0);
  cells_.assign(shared_.size(), 0);
  for (size_t cell = 0; cell < followed_.size(); ++cell) {
    const uint32_t contact = contacts.contact_of(cell);
    if (contact == 0) continue;
    ++cells_[contact];
    shared_[contact] += followed_[cell];
  }
  auto best = static_cast<uint32_t>(std::ranges::max_element(shared_) - shared_.begin());
  if (shared_[best] == 0) best = static_cast<uint32_t>(std::ranges::max_element(cells_) - cells_.begin());
  for (size_t cell = 0; cell < followed_.size(); ++cell)
    followed_[cell] = best > 0 && contacts.contact_of(cell) == best;
  const uint32_t cells_x = cells_along(width_);
  for (uint32_t y = 0; y < height_; ++y)
    for (uint32_t x = 0; x < width_; ++x)
      contact_[size_t{y} * width_ + x] =
          followed_[size_t{y / shared::kCellSide} * cells_x + x / shared::kCellSide];
}

// The slope that nine tenths of what is next to the contact's border are below; 0 where the border is short.
double ObjectFollower::rim_slope() {
  constexpr size_t kLeast_px = 50;
  const uint32_t reach = std::max(2u, static_cast<uint32_t>(std::lround(kRim_mm / pitch_mm_per_px_)));
  const uint32_t side = 2 * reach + 1, stride = width_ + 1;
  if (width_ <= side + 2 || height_ <= side + 2) return 0;
  above_.assign(size_t{stride} * (height_ + 1), 0);  // pixels in contact above and to the left
  for (uint32_t y = 0; y < height_; ++y)
    for (uint32_t x = 0, row = 0; x < width_; ++x) {
      row += contact_[size_t{y} * width_ + x] != 0;
      above_[size_t{y + 1} * stride + x + 1] = above_[size_t{y} * stride + x + 1] + row;
    }
  rim_.clear();
  const auto per_way = static_cast<float>(1 / (2 * pitch_mm_per_px_));
  for (uint32_t y = reach + 1; y + reach + 1 < height_; ++y)
    for (uint32_t x = reach + 1; x + reach + 1 < width_; ++x) {
      const uint32_t* const top = above_.data() + size_t{y - reach} * stride + x - reach;
      const uint32_t* const bottom = top + size_t{side} * stride;
      const uint32_t touching = bottom[side] - bottom[0] - top[side] + top[0];
      if (touching == 0 || touching == side * side) continue;
      const float* const at = depth_mm_.data() + size_t{y} * width_ + x;
      rim_.push_back(std::hypot((at[1] - at[-1]) * per_way, (at[width_] - *(at - width_)) * per_way));
    }
  if (rim_.size() < kLeast_px) return 0;
  const auto most = rim_.begin() + std::ptrdiff_t(rim_.size() * 9 / 10);
  std::nth_element(rim_.begin(), most, rim_.end());
  return double{*most};
}

void ObjectFollower::mark(const GelContacts* contacts, bool by_depth) {
  if (contacts)
    mark_contact(*contacts);
  else
    std::ranges::fill(contact_, 1);
  if (!contacts || !by_depth) keep_deep();
}

void ObjectFollower::keep_deep() {
  float deepest = 0;
  for (size_t i = 0; i < contact_.size(); ++i)
    if (contact_[i] != 0) deepest = std::max(deepest, depth_mm_[i]);
  const auto level = static_cast<float>(kDeep * double{deepest});
  for (size_t i = 0; i < contact_.size(); ++i) contact_[i] = contact_[i] != 0 && depth_mm_[i] > level ? 1 : 0;
}

}  // namespace palpate
