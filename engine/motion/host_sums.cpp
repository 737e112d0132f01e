#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <vector>

#include "engine/base/simd.h"
#include "engine/motion/pixel_terms.h"
#include "engine/numeric/catmull_rom.h"
#include "shaders/shared/object_motion.h"

namespace palpate {
namespace {

using Level = ContactSurface::Level;

constexpr size_t kLanes = 8;  // that sums are split into, whatever the processor's are

/// Each pixel by itself: its depth at the key frame's place (Catmull-Rom), slopes there (bilinear). Those
/// that cannot be compared get an inverse variance of 0.
template <bool Judged>
struct Compare {
  const float *key_depth, *key_slope_x, *key_slope_y, *key_variance;
  const float *depth, *slope_x, *slope_y, *variance, *column, *line;
  const uint32_t* inside;
  std::array<float*, 6> row, difference;
  float *residual, *inverse_variance;
  size_t count;
  int key_width, key_height;
  float pitch, per_pitch;
  std::array<float, 9> back;  ///< PixelGuess
  std::array<float, 3> origin, middle;

  PALPATE_INLINE void run() const {
    PALPATE_INDEPENDENT
    for (size_t i = 0; i < count; ++i) one(i);
  }

 private:
  PALPATE_INLINE void one(size_t i) const {
    const auto at = static_cast<int>(inside[i]);
    const float qx = origin[0] + column[i] * pitch, qy = origin[1] + line[i] * pitch,
                qz = origin[2] + depth[at];
    const float x = back[0] * qx + back[1] * qy + back[2] * qz,
                y = back[3] * qx + back[4] * qy + back[5] * qz,
                z = back[6] * qx + back[7] * qy + back[8] * qz;
    const float px = (x + middle[0]) * per_pitch, py = (y + middle[1]) * per_pitch;
    // Places beyond the map are read within it, and left out.
    const auto most_x = static_cast<float>(key_width - 3), most_y = static_cast<float>(key_height - 3);
    const float held_x = std::min(std::max(px, 1.0f), most_x), held_y = std::min(std::max(py, 1.0f), most_y);
    const auto left = static_cast<int>(held_x), top = static_cast<int>(held_y);
    const float u = held_x - static_cast<float>(left), v = held_y - static_cast<float>(top);
    const int here = top * key_width + left;
    const float there_variance = key_variance[here + (u >= 0.5f ? 1 : 0) + (v >= 0.5f ? key_width : 0)];
    const std::array<float, 4> across = catmull_rom(u), down = catmull_rom(v);
    float there = 0;
    for (int k = 0; k < 4; ++k) {
      const float* d = key_depth + (here + (k - 1) * key_width - 1);
      there += down[static_cast<size_t>(k)] *
               (across[0] * d[0] + across[1] * d[1] + across[2] * d[2] + across[3] * d[3]);
    }
    const auto linear = [&](const float* of) {
      return (1 - v) * ((1 - u) * of[here] + u * of[here + 1]) +
             v * ((1 - u) * of[here + key_width] + u * of[here + key_width + 1]);
    };
    const float sx = slope_x[at], sy = slope_y[at];
    const float tz = back[6] * sx + back[7] * sy - back[8];
    const float steep = -1 / std::min(tz, -0.05f);  // what is seen from the side is left out
    const float tx = (back[0] * sx + back[1] * sy - back[2]) * steep,
                ty = (back[3] * sx + back[4] * sy - back[5]) * steep;
    const float lx = linear(key_slope_x), ly = linear(key_slope_y);
    const bool good =
        (px >= 1) & (py >= 1) & (px < most_x) & (py < most_y) & (there_variance > 0) & (tz <= -0.05f);
    const float precision = good ? 1 / (std::max(there_variance, 0.0f) + variance[at]) : 0;
    const float scaled = std::sqrt(precision);
    residual[i] = (there - middle[2] - z) * scaled;
    inverse_variance[i] = precision;
    // Both normals have -1 as their third component.
    const auto store = [&](const std::array<float*, 6>& to, float nx, float ny, float nz) {
      to[0][i] = -nx * scaled;
      to[1][i] = -ny * scaled;
      to[2][i] = -nz * scaled;
      to[3][i] = -(y * nz - z * ny) * scaled;
      to[4][i] = -(z * nx - x * nz) * scaled;
      to[5][i] = -(x * ny - y * nx) * scaled;
    };
    store(row, (lx + tx) / 2, (ly + ty) / 2, -1);
    if constexpr (Judged) store(difference, lx - tx, ly - ty, 0);
  }
};

/// Weighted products of rows, by lanes and in parts, so that their order is the same on every processor.
template <bool Judged>
struct AddUp {
  std::array<const float*, 6> row, difference;
  const float *residual, *inverse_variance;
  size_t first, end;  ///< multiples of kLanes
  float per_bound;    ///< 1 / Tukey's
  float* sums;        ///< kLanes each, in the order of shaders/shared/object_motion.h; no loss

  PALPATE_INLINE void run() const {
    for (size_t at = first; at < end; at += kLanes) PALPATE_INDEPENDENT
    for (size_t lane = 0; lane < kLanes; ++lane) one(at + lane, lane);
  }

 private:
  PALPATE_INLINE void one(size_t i, size_t lane) const {
    const float r = residual[i] * per_bound, rest = std::max(1 - r * r, 0.0f);
    const float weight = rest * rest;
    // Judged: the slope of the score.
    const float used = Judged ? rest * (1 - 5 * r * r) : weight;
    for (size_t a = 0, k = 0; a < 6; ++a) {
      const float mine = row[a][i], scaled = used * mine;
      [[maybe_unused]] const float other = Judged ? used * difference[a][i] : 0;
      for (size_t b = 0; b <= a; ++b, ++k) {
        sums[k * kLanes + lane] += scaled * row[b][i];
        if constexpr (Judged)
          sums[(shared::kMotionDifferences + k) * kLanes + lane] += other * difference[b][i];
      }
      sums[(shared::kMotionGradient + a) * kLanes + lane] += weight * mine * residual[i];
    }
    sums[shared::kMotionWeight * kLanes + lane] += used * inverse_variance[i];
  }
};

class HostSums : public PixelSums {
 public:
  void set(const ContactSurface& key, const ContactSurface& now) override {
    key_ = &key;
    now_ = &now;
  }
  LeftOver compare(size_t level, const MotionGuess& guess, Spread by) override;
  MotionSums step() override { return add_up<false>(); }
  MotionSums judged() override;
  ScoreField field() override;
  double loss(double scale) override;

 private:
  template <bool Judged>
  void compare_pixels();
  template <bool Judged>
  MotionSums add_up() const;

  const ContactSurface *key_ = nullptr, *now_ = nullptr;
  size_t level_ = 0, count_ = 0;  // pixels inside
  std::optional<PixelGuess> guess_;
  double scale_ = 0;
  std::array<std::vector<float>, 6> row_;         // of a step, by the mean of both slopes
  std::array<std::vector<float>, 6> difference_;  // of the two slopes' rows
  std::vector<float> residual_, inverse_variance_;
};

template <bool Judged>
void HostSums::compare_pixels() {
  const Level &key = key_->levels()[level_], &now = now_->levels()[level_];
  count_ = now.inside.size();
  // Sums take whole lanes.
  const auto end_lanes = [this](std::vector<float>& values) {
    values.resize((count_ + kLanes - 1) / kLanes * kLanes);
    std::fill(values.begin() + static_cast<std::ptrdiff_t>(count_), values.end(), 0.0f);
  };
  for (std::vector<float>& values : row_) end_lanes(values);
  if constexpr (Judged)
    for (std::vector<float>& values : difference_) end_lanes(values);
  end_lanes(residual_);
  end_lanes(inverse_variance_);
  Compare<Judged> work{.key_depth = key.depth.data(),
                       .key_slope_x = key.slope_x.data(),
                       .key_slope_y = key.slope_y.data(),
                       .key_variance = key.inside_variance.data(),
                       .depth = now.depth.data(),
                       .slope_x = now.slope_x.data(),
                       .slope_y = now.slope_y.data(),
                       .variance = now.variance.data(),
                       .column = now.column.data(),
                       .line = now.row.data(),
                       .inside = now.inside.data(),
                       .row = {},
                       .difference = {},
                       .residual = residual_.data(),
                       .inverse_variance = inverse_variance_.data(),
                       .count = count_,
                       .key_width = static_cast<int>(key.width),
                       .key_height = static_cast<int>(key.height),
                       .pitch = static_cast<float>(now.pitch_mm),
                       .per_pitch = static_cast<float>(1 / key.pitch_mm),
                       .back = guess_->back,
                       .origin = guess_->origin,
                       .middle = guess_->middle};
  for (size_t k = 0; k < 6; ++k) {
    work.row[k] = row_[k].data();
    work.difference[k] = difference_[k].data();
  }
  run_widest(work);
}

LeftOver HostSums::compare(size_t level, const MotionGuess& guess, Spread by) {
  level_ = level;
  guess_.emplace(guess, key_->levels()[level], now_->levels()[level]);
  compare_pixels<false>();
  LeftOver out;
  std::array<uint32_t, shared::kSizeBins> sizes{};
  double squares = 0, precisions = 0;
  for (size_t i = 0; i < count_; ++i) {
    if (inverse_variance_[i] <= 0) continue;
    ++out.compared;
    ++sizes[size_bin(residual_[i])];
    squares += double{residual_[i]} * double{residual_[i]};
    precisions += double{inverse_variance_[i]};
  }
  scale_ = 0;
  if (out.compared == 0) return out;
  const auto pixels = static_cast<double>(out.compared);
  out.mean_precision = precisions / pixels;
  const double least = least_scale_mm(now_->levels()[level].pitch_mm) * std::sqrt(out.mean_precision);
  scale_ = out.scale =
      std::max(by == Spread::Median ? deviation_of(sizes) : std::sqrt(squares / pixels), least);
  return out;
}

/// By lanes and in parts, so that the order is the same on every processor.
template <bool Judged>
MotionSums HostSums::add_up() const {
  constexpr size_t kPart = 256 * kLanes;  // of single precision, before it goes into double
  std::array<double, Judged ? shared::kJudgedSums : shared::kStepSums> whole{};
  std::array<float, whole.size() * kLanes> part;
  for (size_t first = 0; first < residual_.size(); first += kPart) {
    part.fill(0);
    AddUp<Judged> work{.row = {},
                       .difference = {},
                       .residual = residual_.data(),
                       .inverse_variance = inverse_variance_.data(),
                       .first = first,
                       .end = std::min(first + kPart, residual_.size()),
                       .per_bound = static_cast<float>(1 / (double{shared::kTukeyBound} * scale_)),
                       .sums = part.data()};
    for (size_t k = 0; k < 6; ++k) {
      work.row[k] = row_[k].data();
      work.difference[k] = difference_[k].data();
    }
    run_widest(work);
    for (size_t k = 0; k < part.size(); ++k) whole[k / kLanes] += double{part[k]};
  }
  return sums_of(whole, Judged);
}

MotionSums HostSums::judged() {
  compare_pixels<true>();
  return add_up<true>();
}

ScoreField HostSums::field() {
  const Level& now = now_->levels()[level_];
  ScoreField out{.width = now.width, .height = now.height, .pixel = {}, .row = {}, .score = {}};
  std::array<float, 6> row{};
  for (size_t i = 0; i < count_; ++i) {
    if (inverse_variance_[i] <= 0) continue;
    for (size_t k = 0; k < 6; ++k) row[k] = row_[k][i];
    add_term(out, now.inside[i], row, residual_[i], scale_);
  }
  return out;
}

double HostSums::loss(double scale) {
  const double most = std::pow(double{shared::kTukeyBound} * scale, 2);
  double sum = 0, pixels = 0;
  for (size_t i = 0; i < count_; ++i) {
    if (inverse_variance_[i] <= 0) continue;
    sum += std::min(double{residual_[i]} * double{residual_[i]}, most);
    pixels += 1;
  }
  return sum / pixels;
}

}  // namespace

std::unique_ptr<PixelSums> host_sums() {
  return std::make_unique<HostSums>();
}

}  // namespace palpate
