#include "engine/palpation/hand/skin_texture.h"

#include <algorithm>
#include <cmath>

#include "engine/base/statistics.h"

namespace palpate {
namespace {

constexpr double kPixel_mm = 0.15;
constexpr float kMost = 3;  // of the texture's spread

/// In place.
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
std::vector<float> smooth(const SkinRelief& relief, double sd_mm) {
  const int width = static_cast<int>(relief.width), height = static_cast<int>(relief.height);
  std::vector<float> sum(relief.depth_mm.size()), weight(sum.size());
  for (size_t i = 0; i < sum.size(); ++i) {
    weight[i] = relief.contact[i] ? 1 : 0;
    sum[i] = relief.depth_mm[i] * weight[i];
  }
  blur(sum, width, height, sd_mm / relief.pitch_mm);
  blur(weight, width, height, sd_mm / relief.pitch_mm);
  for (size_t i = 0; i < sum.size(); ++i) sum[i] = weight[i] > 1e-6f ? sum[i] / weight[i] : 0;
  return sum;
}

}  // namespace

double TextureMap::power() const {
  double square = 0, count = 0;
  for (size_t i = 0; i < value.size(); ++i) {
    square += double{value[i]} * double{value[i]};
    count += seen[i];
  }
  return count > 0 ? square / count : 0;
}

TextureMap skin_texture(const SkinRelief& relief, double fine_mm, double slow_mm) {
  const std::vector<float> fine = smooth(relief, fine_mm), slow = smooth(relief, slow_mm);
  const auto step = std::max(1u, static_cast<uint32_t>(kPixel_mm / relief.pitch_mm + 1e-9));
  TextureMap out;
  // As many pixels are left over before the first as behind the last, or one more: the middle stays to half
  // a pixel of the relief.
  out.width = static_cast<int>((relief.width - 1) / step + 1);
  out.height = static_cast<int>((relief.height - 1) / step + 1);
  out.pitch_mm = step * relief.pitch_mm;
  const uint32_t left = (relief.width - 1) % step / 2, top = (relief.height - 1) % step / 2;
  std::vector<double> size;
  for (int j = 0; j < out.height; ++j)
    for (int i = 0; i < out.width; ++i) {
      const size_t n = size_t{top + step * static_cast<uint32_t>(j)} * relief.width + left +
                       step * static_cast<uint32_t>(i);
      out.seen.push_back(relief.contact[n] ? 1 : 0);
      out.value.push_back(relief.contact[n] ? fine[n] - slow[n] : 0);
      if (relief.contact[n]) size.push_back(std::abs(double{out.value.back()}));
    }
  const double spread = size.empty() ? 0 : 1.4826 * median(size);
  for (float& value : out.value)
    value = spread > 0 ? std::clamp(value / static_cast<float>(spread), -kMost, kMost) : 0;
  return out;
}

bool texture_between(const TextureMap& texture, double x, double y, float& value) {
  const int x0 = static_cast<int>(std::floor(x)), y0 = static_cast<int>(std::floor(y));
  if (x0 < 0 || y0 < 0 || x0 + 1 >= texture.width || y0 + 1 >= texture.height) return false;
  const size_t n = texture.at(x0, y0), below = n + static_cast<size_t>(texture.width);
  if (!(texture.seen[n] && texture.seen[n + 1] && texture.seen[below] && texture.seen[below + 1]))
    return false;
  const auto fx = static_cast<float>(x - x0), fy = static_cast<float>(y - y0);
  value = (1 - fy) * ((1 - fx) * texture.value[n] + fx * texture.value[n + 1]) +
          fy * ((1 - fx) * texture.value[below] + fx * texture.value[below + 1]);
  return true;
}

}  // namespace palpate
