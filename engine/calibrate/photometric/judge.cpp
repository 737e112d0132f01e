#include "engine/calibrate/photometric/judge.h"

#include <algorithm>
#include <cmath>

#include "engine/calibrate/photometric/polynomial.h"

namespace palpate::photometric {
namespace {

constexpr double kSteepest = 0.999;  // largest component along the pad that a normal is taken to have

// One that has a third component, so that slopes stay finite.
std::array<double, 2> bounded_normal(std::array<double, 2> n) {
  const double length = std::hypot(n[0], n[1]);
  return length > kSteepest ? std::array{n[0] * kSteepest / length, n[1] * kSteepest / length} : n;
}

double degrees(double radians) {
  return radians * 180 / 3.14159265358979;
}

// Normals by a model from a press's pixels, and their errors.
struct ReadNormals {
  std::vector<std::array<double, 2>> bounded;
  std::array<double, 2> square{};  // sums over the pixels
  double angle2 = 0;
};

ReadNormals read_normals(const PhotometricPress& p, const PhotometricCalibration& weights) {
  ReadNormals read;
  for (size_t k = 0; k < p.pixels.size(); ++k) {
    const auto raw = polynomial_normal(weights, p.pixels[k].change, p.pixels[k].across, p.pixels[k].down);
    const auto n = read.bounded.emplace_back(bounded_normal(raw));
    const double tx = static_cast<double>(p.normals[k].x()), ty = static_cast<double>(p.normals[k].y());
    read.square[0] += std::pow(raw[0] - tx, 2);
    read.square[1] += std::pow(raw[1] - ty, 2);
    const double dot = n[0] * tx + n[1] * ty +
                       std::sqrt(std::max(0.0, 1 - n[0] * n[0] - n[1] * n[1])) *
                           std::sqrt(std::max(0.0, 1 - tx * tx - ty * ty));
    read.angle2 += std::pow(std::acos(std::clamp(dot, -1.0, 1.0)), 2);
  }
  return read;
}

// Means of an error over the middle of a contact and along its rim, pixels by their true height above it.
struct MiddleOverRim {
  static constexpr double kMiddle = 0.9, kRim = 0.25;  // of the deepest
  double deepest, middle = 0, rim = 0, in_middle = 0, on_rim = 0;

  void add(double height, double error) {
    if (height > kMiddle * deepest) middle += error, ++in_middle;
    if (height < kRim * deepest) rim += error, ++on_rim;
  }
  double relative() const {
    return in_middle > 0 && on_rim > 0 ? (middle / in_middle - rim / on_rim) / deepest : 0;
  }
};

// Parts of a contact by place, each about as long as wide: one of a round contact, several along a cylinder.
class Parts {
 public:
  Parts(const FoundBall& contact, double deepest_mm) : contact_(contact) {
    if (contact.half_length_px > 0) half_px_ = contact.half_length_px - contact.radius_px;
    const double parts = std::max(1.0, std::round(half_px_ / std::max(contact.radius_px, 1.0)));
    errors_.assign(static_cast<size_t>(parts), {.deepest = deepest_mm});
  }
  void add(double x_px, double y_px, double height, double error) {
    const double along = (x_px - contact_.center_x_px) * std::cos(contact_.axis_rad) +
                         (y_px - contact_.center_y_px) * std::sin(contact_.axis_rad);
    const double part = half_px_ > 0 ? (along / half_px_ + 1) / 2 * count() : 0;
    errors_[static_cast<size_t>(std::clamp(part, 0.0, count() - 1))].add(height, error);
  }
  std::vector<HeldOutPress::Place> places() const {
    std::vector<HeldOutPress::Place> places;
    places.reserve(errors_.size());
    for (const MiddleOverRim& error : errors_) {
      const double along = half_px_ * ((2 * static_cast<double>(places.size()) + 1) / count() - 1);
      places.push_back({contact_.center_x_px + along * std::cos(contact_.axis_rad),
                        contact_.center_y_px + along * std::sin(contact_.axis_rad), error.relative()});
    }
    return places;
  }

 private:
  double count() const { return static_cast<double>(errors_.size()); }

  const FoundBall& contact_;
  double half_px_ = 0;  // of what is known along a cylinder
  std::vector<MiddleOverRim> errors_;
};

// Fills the depth's errors: the normals integrated, against the shape's own.
void judge_depth(const PhotometricPress::Truth& truth, const Patch& patch,
                 const std::vector<std::array<double, 2>>& normals, double pitch_mm_per_px,
                 HeldOutPress& held_out) {
  std::vector<double> sx(truth.inside.size()), sy(truth.inside.size());
  double true_mean = 0;
  for (size_t k = 0, n = 0; k < truth.inside.size(); ++k) {
    if (!truth.inside[k]) continue;
    const double nz = std::sqrt(1 - normals[n][0] * normals[n][0] - normals[n][1] * normals[n][1]);
    sx[k] = normals[n][0] / nz;
    sy[k] = normals[n][1] / nz;
    true_mean += truth.depth_mm[n++];
  }
  true_mean /= static_cast<double>(truth.depth_mm.size());
  const std::vector<double> depth = patch.depth(sx, sy, pitch_mm_per_px);
  double depth_square = 0, cap_square = 0, cross = 0, power = 0;
  Parts parts(truth.contact, *std::ranges::max_element(truth.depth_mm));
  for (size_t k = 0, n = 0; k < depth.size(); ++k) {
    if (!truth.inside[k]) continue;
    const size_t x = truth.left_px + k % truth.width, y = truth.top_px + k / truth.width;
    parts.add(static_cast<double>(x), static_cast<double>(y), truth.depth_mm[n],
              depth[k] - (truth.depth_mm[n] - true_mean));
    cap_square += truth.depth_mm[n] * truth.depth_mm[n];
    const double t = truth.depth_mm[n++] - true_mean;
    depth_square += (depth[k] - t) * (depth[k] - t);
    cross += depth[k] * t;
    power += t * t;
  }
  held_out.has_depth = true;
  held_out.depth_rmse_mm = std::sqrt(depth_square / static_cast<double>(truth.depth_mm.size()));
  held_out.cap_rms_mm = std::sqrt(cap_square / static_cast<double>(truth.depth_mm.size()));
  held_out.depth_gain = power > 0 ? cross / power : 0;
  held_out.places = parts.places();
}

}  // namespace

HeldOutErrors ErrorSums::errors() const {
  HeldOutErrors e;
  if (pixels > 0) {
    e.normal_rms = std::sqrt((square[0] + square[1]) / (2 * pixels));
    e.normal_angle_deg = degrees(std::sqrt(angle2 / pixels));
  }
  if (balls > 0) {
    e.depth_rmse_mm = std::sqrt(depth_square / balls);
    e.cap_rms_mm = std::sqrt(cap_square / balls);
    e.depth_gain = gain / balls;
  }
  return e;
}

Patch::Patch(std::span<const uint8_t> inside, uint32_t width, bool bridged) : index_(inside.size(), -1) {
  for (size_t i = 0; i < inside.size(); ++i)
    if (inside[i]) index_[i] = unknowns_++;
  if (unknowns_ == 0) return;
  std::vector<sparse::Entry> entries;
  entries.reserve(static_cast<size_t>(unknowns_) * 9);
  // One equation for each pair of neighbours: the step between them is the mean of their slopes, times their
  // distance, which it is as uncertain as.
  const auto link = [&](size_t a, size_t b, double length, bool across) {
    const int i = index_[a], j = index_[b];
    entries.emplace_back(i, i, 1 / length);
    entries.emplace_back(j, j, 1 / length);
    entries.emplace_back(i, j, -1 / length);
    entries.emplace_back(j, i, -1 / length);
    steps_.push_back({i, j, a, b, across});
  };
  // The next pixel inside, `count` of them `stride` apart.
  const auto link_next = [&](size_t from, size_t stride, size_t count, bool across) {
    for (size_t n = 1; n <= (bridged ? count : std::min<size_t>(count, 1)); ++n)
      if (inside[from + n * stride]) return link(from, from + n * stride, static_cast<double>(n), across);
  };
  for (size_t i = 0; i < inside.size(); ++i) {
    if (!inside[i]) continue;
    link_next(i, 1, width - 1 - i % width, true);
    link_next(i, width, (inside.size() - 1 - i) / width, false);
    // Heights are known up to a constant; this much pulls each part's mean to 0 and changes nothing else.
    entries.emplace_back(index_[i], index_[i], 1e-9);
  }
  factor_.emplace(sparse::Factor::Kind::Ldlt, unknowns_, entries);
}

std::vector<double> Patch::depth(std::span<const double> slope_x, std::span<const double> slope_y,
                                 double pitch_mm_per_px) const {
  std::vector<double> depth(index_.size(), 0.0);
  if (!factor_) return depth;
  Eigen::VectorXd right = Eigen::VectorXd::Zero(unknowns_);
  for (const Step& s : steps_) {
    const std::span<const double>& slope = s.across ? slope_x : slope_y;
    const double step = 0.5 * (slope[s.first] + slope[s.second]);
    right[s.from] -= step;
    right[s.to] += step;
  }
  const Eigen::VectorXd z = factor_->solve(right);
  const double mean = z.mean();
  for (size_t i = 0; i < depth.size(); ++i)
    if (index_[i] >= 0) depth[i] = (z[index_[i]] - mean) * pitch_mm_per_px;
  return depth;
}

HeldOutPress judge(const PhotometricPress& p, const PhotometricCalibration& weights, const Patch* patch,
                   double pitch_mm_per_px, ErrorSums& sums) {
  HeldOutPress h;
  h.label = p.label;
  h.contact_px = static_cast<uint64_t>(p.contact.front().weight);
  const ReadNormals read = read_normals(p, weights);
  const auto pixels = static_cast<double>(std::max<size_t>(p.pixels.size(), 1));
  h.normal_rms = std::sqrt((read.square[0] + read.square[1]) / (2 * pixels));
  h.normal_angle_deg = degrees(std::sqrt(read.angle2 / pixels));
  for (size_t k = 0; k < 2; ++k) sums.square[k] += read.square[k];
  sums.angle2 += read.angle2;
  sums.pixels += static_cast<double>(p.pixels.size());
  if (!patch) return h;
  judge_depth(*p.truth, *patch, read.bounded, pitch_mm_per_px, h);
  sums.depth_square += h.depth_rmse_mm * h.depth_rmse_mm;
  sums.cap_square += h.cap_rms_mm * h.cap_rms_mm;
  sums.gain += h.depth_gain;
  ++sums.balls;
  return h;
}

}  // namespace palpate::photometric
