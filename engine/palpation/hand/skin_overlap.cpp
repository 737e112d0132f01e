#include "engine/palpation/hand/skin_overlap.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace palpate {
namespace {

constexpr double kTexture_mm = 0.45, kSmooth_mm = 0.35, kSlow_mm = 1.5;
constexpr double kLeastSeen = 0.2;
constexpr double kTurnStep_rad = 0.035;

/// The texture on coarse pixels; 0 where nothing touches.
struct Texture {
  int width = 0, height = 0;
  std::vector<float> value, seen;

  size_t at(int x, int y) const {
    return static_cast<size_t>(y) * static_cast<size_t>(width) + static_cast<size_t>(x);
  }
};

/// In place, weighted by what was seen.
void blur(std::vector<float>& map, int width, int height, double sd_px) {
  using Index = std::ptrdiff_t;
  const auto far = static_cast<Index>(std::ceil(3 * sd_px));
  std::vector<float> kernel, line;
  for (Index k = -far; k <= far; ++k)
    kernel.push_back(static_cast<float>(std::exp(-double(k * k) / (2 * sd_px * sd_px))));
  const auto pass = [&](Index lines, Index length, Index next, Index step) {
    line.resize(static_cast<size_t>(length));
    for (Index l = 0; l < lines; ++l) {
      for (Index i = 0; i < length; ++i)
        line[static_cast<size_t>(i)] = map[static_cast<size_t>(l * next + i * step)];
      for (Index i = 0; i < length; ++i) {
        float sum = 0;
        for (Index k = std::max(-far, -i); k <= std::min(far, length - 1 - i); ++k)
          sum += kernel[static_cast<size_t>(k + far)] * line[static_cast<size_t>(i + k)];
        map[static_cast<size_t>(l * next + i * step)] = sum;
      }
    }
  };
  pass(height, width, width, 1);
  pass(width, height, 1, width);
}

/// Means over what was seen around each pixel.
std::vector<float> smooth(const std::vector<float>& value, const std::vector<float>& seen, int width,
                          int height, double sd_px) {
  std::vector<float> sum(value.size()), weight = seen;
  for (size_t i = 0; i < sum.size(); ++i) sum[i] = value[i] * seen[i];
  blur(sum, width, height, sd_px);
  blur(weight, width, height, sd_px);
  for (size_t i = 0; i < sum.size(); ++i) sum[i] = weight[i] > 1e-6f ? sum[i] / weight[i] : 0;
  return sum;
}

Texture texture_of(const SkinRelief& relief) {
  const int width = static_cast<int>(relief.width), height = static_cast<int>(relief.height);
  std::vector<float> seen(relief.contact.size());
  for (size_t i = 0; i < seen.size(); ++i) seen[i] = relief.contact[i] ? 1 : 0;
  const std::vector<float> fine = smooth(relief.depth_mm, seen, width, height, kSmooth_mm / relief.pitch_mm);
  const std::vector<float> slow = smooth(relief.depth_mm, seen, width, height, kSlow_mm / relief.pitch_mm);
  Texture out;
  out.width = std::max(1, static_cast<int>(width * relief.pitch_mm / kTexture_mm));
  out.height = std::max(1, static_cast<int>(height * relief.pitch_mm / kTexture_mm));
  const double step = kTexture_mm / relief.pitch_mm;
  for (int j = 0; j < out.height; ++j)
    for (int i = 0; i < out.width; ++i) {
      const int x =
          std::clamp(static_cast<int>(std::lround((i - (out.width - 1) / 2.0) * step + (width - 1) / 2.0)), 0,
                     width - 1);
      const int y =
          std::clamp(static_cast<int>(std::lround((j - (out.height - 1) / 2.0) * step + (height - 1) / 2.0)),
                     0, height - 1);
      const size_t n = static_cast<size_t>(y) * relief.width + static_cast<size_t>(x);
      out.value.push_back(seen[n] * (fine[n] - slow[n]));
      out.seen.push_back(seen[n]);
    }
  return out;
}

/// The texture as a pad that is turned by so much against it would see it.
Texture turned(const Texture& from, double turn_rad) {
  Texture out = from;
  const double c = std::cos(turn_rad), s = std::sin(turn_rad);
  for (int j = 0; j < out.height; ++j)
    for (int i = 0; i < out.width; ++i) {
      const double u = i - (out.width - 1) / 2.0, v = j - (out.height - 1) / 2.0;
      const double x = c * u - s * v + (out.width - 1) / 2.0, y = s * u + c * v + (out.height - 1) / 2.0;
      const int x0 = static_cast<int>(std::floor(x)), y0 = static_cast<int>(std::floor(y));
      const size_t n = out.at(i, j);
      out.value[n] = out.seen[n] = 0;
      if (x0 < 0 || y0 < 0 || x0 + 1 >= out.width || y0 + 1 >= out.height) continue;
      const auto fx = static_cast<float>(x - x0), fy = static_cast<float>(y - y0);
      const size_t m = out.at(x0, y0), w = static_cast<size_t>(out.width);
      const auto mix = [&](const std::vector<float>& map) {
        return (1 - fy) * ((1 - fx) * map[m] + fx * map[m + 1]) +
               fy * ((1 - fx) * map[m + w] + fx * map[m + w + 1]);
      };
      if (mix(from.seen) < 0.99f) continue;
      out.value[n] = mix(from.value);
      out.seen[n] = 1;
    }
  return out;
}

/// Sums where both see the skin, the second one's middle so many pixels from the first one's.
struct Sums {
  float product = 0, first = 0, second = 0, count = 0;
};
Sums sums_at(const Texture& a, const Texture& b, int dx, int dy) {
  Sums sums;
  const int x0 = std::max(0, -dx), x1 = std::min(b.width, a.width - dx);
  for (int j = std::max(0, -dy); j < std::min(b.height, a.height - dy); ++j) {
    const size_t at_a = a.at(dx + x0, j + dy), at_b = b.at(x0, j);
    const float *va = a.value.data() + at_a, *sa = a.seen.data() + at_a;
    const float *vb = b.value.data() + at_b, *sb = b.seen.data() + at_b;
    for (int i = 0; i < x1 - x0; ++i) {
      sums.product += va[i] * vb[i];
      sums.first += va[i] * va[i] * sb[i];
      sums.second += vb[i] * vb[i] * sa[i];
      sums.count += sa[i] * sb[i];
    }
  }
  return sums;
}

}  // namespace

SkinOverlap find_skin_overlap(const SkinRelief& first, const SkinRelief& second, double most_turn_rad) {
  const Texture a = texture_of(first), plain = texture_of(second);
  float seen_a = 0, seen_b = 0;
  for (const float s : a.seen) seen_a += s;
  for (const float s : plain.seen) seen_b += s;
  const float least = static_cast<float>(kLeastSeen) * std::min(seen_a, seen_b);
  SkinOverlap best;
  const int turns = static_cast<int>(std::ceil(most_turn_rad / kTurnStep_rad));
  for (int t = -turns; t <= turns; ++t) {
    const double turn = t * kTurnStep_rad;
    // Seen by a pad that is turned back, the second relief lies as the first.
    const Texture b = turned(plain, -turn);
    const int far_x = a.width * 4 / 5, far_y = a.height * 4 / 5;
    for (int dy = -far_y; dy <= far_y; ++dy)
      for (int dx = -far_x; dx <= far_x; ++dx) {
        if ((a.width - std::abs(dx)) * (a.height - std::abs(dy)) < static_cast<int>(least)) continue;
        const Sums sums = sums_at(a, b, dx, dy);
        if (sums.count < least || !(sums.first > 0 && sums.second > 0)) continue;
        const double correlation =
            static_cast<double>(sums.product) / std::sqrt(static_cast<double>(sums.first) * sums.second);
        const double significance = correlation * std::sqrt(static_cast<double>(sums.count));
        if (significance > best.significance)
          best = {{dx * kTexture_mm, dy * kTexture_mm}, turn, correlation, significance};
      }
  }
  return best;
}

}  // namespace palpate
