#include "engine/motion/contact_surface.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <string>

#include "engine/base/simd.h"
#include "palpate/error.h"

namespace palpate {
namespace {

using Level = ContactSurface::Level;

void require(bool good, const std::string& wanted, const std::string& found) {
  if (!good) throw Error(Failure::Input, wanted, found, "handing over maps of one frame");
}

void check(const HeightMap& map) {
  const size_t pixels = size_t{map.width} * map.height;
  require(pixels > 0 && std::isfinite(map.pitch_mm_per_px) && map.pitch_mm_per_px > 0,
          "a height map of at least one pixel and a pitch > 0 mm",
          std::to_string(map.width) + " x " + std::to_string(map.height) + " px of " +
              std::to_string(map.pitch_mm_per_px) + " mm");
  require(map.depth_mm.size() == pixels && map.contact.size() == pixels &&
              (map.sd_mm.empty() || map.sd_mm.size() == pixels),
          std::to_string(pixels) + " depths, errors (or none) and flags of contact",
          std::to_string(map.depth_mm.size()) + ", " + std::to_string(map.sd_mm.size()) + " and " +
              std::to_string(map.contact.size()));
}

/// Rows of five(the five neighbours along x or y), those beyond the border being the border's.
template <typename Five>
std::vector<float> from_five(const std::vector<float>& in, uint32_t width, uint32_t height, bool along_x,
                             Five five) {
  std::vector<float> out(in.size()), padded(width + 4);
  for (uint32_t row = 0; row < height; ++row) {
    std::array<const float*, 5> near{};
    for (uint32_t k = 0; k < 5; ++k)
      near[k] = along_x ? padded.data() + k
                        : in.data() + size_t{std::clamp<uint32_t>(row + k, 2, height + 1) - 2} * width;
    if (along_x) {
      const float* const from = in.data() + size_t{row} * width;
      std::fill_n(std::copy_n(from, width, std::fill_n(padded.begin(), 2, from[0])), 2, from[width - 1]);
    }
    float* const to = out.data() + size_t{row} * width;
    PALPATE_INDEPENDENT
    for (uint32_t x = 0; x < width; ++x)
      to[x] = five(near[0][x], near[1][x], near[2][x], near[3][x], near[4][x]);
  }
  return out;
}

std::vector<float> smoothed(const std::vector<float>& in, uint32_t width, uint32_t height) {
  const auto binomial = [](float a, float b, float c, float d, float e) {
    return (a + e + 4 * (b + d) + 6 * c) / 16;
  };
  return from_five(from_five(in, width, height, true, binomial), width, height, false, binomial);
}

/// What is at least `border` pixels, counted along rows and columns, from what is not in the contact.
std::vector<uint8_t> eroded(std::span<const uint8_t> contact, uint32_t width, uint32_t height,
                            uint32_t border) {
  std::vector<uint8_t> now(contact.size());
  std::transform(contact.begin(), contact.end(), now.begin(), [](uint8_t c) { return c != 0 ? 1 : 0; });
  const auto shrink = [&](bool along_x) {
    const uint32_t length = along_x ? width : height, lines = along_x ? height : width;
    const uint32_t step = along_x ? 1 : width, next = along_x ? width : 1;
    std::vector<uint32_t> left(length);  // pixels in contact up to this one, without a gap
    for (uint32_t line = 0; line < lines; ++line) {
      const uint32_t first = line * next;
      for (uint32_t i = 0; i < length; ++i)
        left[i] = now[first + i * step] == 0 ? 0 : (i > 0 ? left[i - 1] : 0) + 1;
      for (uint32_t i = length, right = 0; i-- > 0;) {
        right = left[i] == 0 ? 0 : right + 1;
        now[first + i * step] = left[i] > border && right > border ? 1 : 0;
      }
    }
  };
  shrink(true);
  shrink(false);
  return now;
}

/// Differences of the fourth order, which texture of a few pixels needs.
void find_slopes(Level& level) {
  const auto part = static_cast<float>(1 / (12 * level.pitch_mm));
  const auto slope = [part](float a, float b, float, float d, float e) {
    return (8 * (d - b) - (e - a)) * part;
  };
  level.slope_x = from_five(level.depth, level.width, level.height, true, slope);
  level.slope_y = from_five(level.depth, level.width, level.height, false, slope);
}

void list_inside(Level& level) {
  level.inside_variance.assign(level.mask.size(), -1);
  for (uint32_t y = 0, pixel = 0; y < level.height; ++y)
    for (uint32_t x = 0; x < level.width; ++x, ++pixel) {
      if (level.mask[pixel] == 0) continue;
      level.inside.push_back(pixel);
      level.column.push_back(static_cast<float>(x));
      level.row.push_back(static_cast<float>(y));
      level.inside_variance[pixel] = level.variance[pixel];
    }
}

Level coarser(const Level& fine) {
  Level out{.width = fine.width / 2, .height = fine.height / 2, .pitch_mm = 2 * fine.pitch_mm};
  out.left_mm = fine.left_mm + fine.pitch_mm / 2;
  out.top_mm = fine.top_mm + fine.pitch_mm / 2;
  const size_t pixels = size_t{out.width} * out.height;
  out.depth.resize(pixels);
  out.variance.resize(pixels);
  out.mask.resize(pixels);
  for (uint32_t row = 0; row < out.height; ++row)
    for (uint32_t column = 0; column < out.width; ++column) {
      const uint32_t to = row * out.width + column, from = 2 * row * fine.width + 2 * column;
      const std::array<uint32_t, 4> four = {from, from + 1, from + fine.width, from + fine.width + 1};
      uint32_t known = 0;
      for (const uint32_t pixel : four) {
        out.depth[to] += fine.depth[pixel] / 4;
        out.variance[to] += fine.variance[pixel] / 4;
        known += fine.mask[pixel];
      }
      out.mask[to] = known >= 3 ? 1 : 0;
    }
  find_slopes(out);
  list_inside(out);
  return out;
}

}  // namespace

ContactSurface::ContactSurface(const HeightMap& map, const SurfaceOptions& options)
    : level_sd_mm_(map.level_sd_mm), tilt_sd_rad_(map.tilt_sd_rad) {
  static std::atomic<uint64_t> made = 0;
  id_ = ++made;
  check(map);
  Level finest{.width = map.width, .height = map.height, .pitch_mm = map.pitch_mm_per_px};
  finest.left_mm = -0.5 * (map.width - 1) * map.pitch_mm_per_px;
  finest.top_mm = -0.5 * (map.height - 1) * map.pitch_mm_per_px;
  finest.depth = smoothed({map.depth_mm.begin(), map.depth_mm.end()}, map.width, map.height);
  finest.variance.assign(map.depth_mm.size(), 1.0f);
  if (!map.sd_mm.empty())
    std::transform(map.sd_mm.begin(), map.sd_mm.end(), finest.variance.begin(),
                   [](float sd) { return sd * sd; });
  finest.mask = eroded(map.contact, map.width, map.height, options.border_px);
  find_slopes(finest);
  list_inside(finest);
  levels_.push_back(std::move(finest));
  constexpr size_t kFewest = 60;  // pixels that a coarse level needs
  while (levels_.size() < options.levels && levels_.back().width >= 16 && levels_.back().height >= 16) {
    Level next = coarser(levels_.back());
    if (next.inside.size() < kFewest) break;
    levels_.push_back(std::move(next));
  }
  find_centroid();
}

Matrix6d ContactSurface::error_of_level() const {
  Matrix6d out = Matrix6d::Zero();
  out(2, 2) = level_sd_mm_ * level_sd_mm_;
  return out;
}

void ContactSurface::find_centroid() {
  const Level& level = levels_.front();
  if (level.inside.empty()) return;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double squares = 0;
  for (const uint32_t pixel : level.inside) {
    const uint32_t row = pixel / level.width, column = pixel % level.width;
    const double x = level.left_mm + column * level.pitch_mm, y = level.top_mm + row * level.pitch_mm;
    sum += Eigen::Vector3d(x, y, double{level.depth[pixel]});
    squares += x * x + y * y;
  }
  const auto count = static_cast<double>(level.inside.size());
  centroid_mm_ = sum / count;
  radius_mm_ = std::sqrt(std::max(2 * (squares / count - centroid_mm_.head<2>().squaredNorm()), 0.0));
}

}  // namespace palpate
