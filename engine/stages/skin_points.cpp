#include "engine/stages/skin_points.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numeric>

namespace palpate {
namespace {

/// Means over squares, by sums over everything above and to the left.
class Means {
 public:
  Means(const std::vector<float>& image, uint32_t width, uint32_t height)
      : width_(static_cast<int>(width)),
        height_(static_cast<int>(height)),
        sums_(size_t{width + 1} * (height + 1), 0.0) {
    for (int y = 0; y < height_; ++y) {
      double row = 0;
      for (int x = 0; x < width_; ++x) {
        row += double{image[static_cast<size_t>(y) * width + x]};
        sums_[at(x + 1, y + 1)] = sums_[at(x + 1, y)] + row;
      }
    }
  }
  double of(int x, int y, int half) const {
    const int x0 = std::max(x - half, 0), x1 = std::min(x + half + 1, width_), y0 = std::max(y - half, 0),
              y1 = std::min(y + half + 1, height_);
    return (sums_[at(x1, y1)] - sums_[at(x0, y1)] - sums_[at(x1, y0)] + sums_[at(x0, y0)]) /
           ((x1 - x0) * (y1 - y0));
  }

 private:
  size_t at(int x, int y) const { return static_cast<size_t>(y) * (width_ + 1) + x; }
  int width_, height_;
  std::vector<double> sums_;
};

struct Peak {
  float strength;
  int x, y;
};

// Local maxima of `sign` times the contrast, no two closer than `apart`.
std::vector<Peak> peaks(const std::vector<float>& contrast, int width, int height, float sign, int apart) {
  std::vector<Peak> found;
  for (int y = 1; y + 1 < height; ++y)
    for (int x = 1; x + 1 < width; ++x) {
      const float* c = contrast.data() + static_cast<size_t>(y) * width + x;
      const float here = sign * *c;
      if (here <= 0) continue;
      bool largest = true;
      for (int j = -1; j <= 1 && largest; ++j)
        for (int i = -1; i <= 1; ++i) {
          const float other = sign * c[j * width + i];
          // Of equal ones the first counts.
          if (other > here || (other == here && (j < 0 || (j == 0 && i < 0)))) largest = false;
        }
      if (largest) found.push_back({here, x, y});
    }
  std::sort(found.begin(), found.end(), [](const Peak& a, const Peak& b) {
    return a.strength != b.strength ? a.strength > b.strength : a.y != b.y ? a.y < b.y : a.x < b.x;
  });
  std::vector<Peak> kept;
  for (const Peak& p : found) {
    const bool beside = std::any_of(kept.begin(), kept.end(), [&](const Peak& k) {
      return (k.x - p.x) * (k.x - p.x) + (k.y - p.y) * (k.y - p.y) < apart * apart;
    });
    if (!beside) kept.push_back(p);
    if (kept.size() == 8192) break;
  }
  return kept;
}

// Dots and noise part where the squared deviation of two groups from their means is least.
size_t dots_among(const std::vector<Peak>& sorted) {
  double all = 0;
  for (const Peak& p : sorted) all += p.strength;
  double sum = 0, best = -1;
  size_t count = sorted.size();
  for (size_t i = 1; i < sorted.size(); ++i) {
    sum += sorted[i - 1].strength;
    const double n = static_cast<double>(i), m = static_cast<double>(sorted.size() - i);
    const double apart = sum / n - (all - sum) / m, between = n * m * apart * apart;
    if (between > best) {
      best = between;
      count = i;
    }
  }
  // One group only: all are dots.
  if (count > 0 && count < sorted.size() && sorted[count].strength > 0.5f * sorted[count - 1].strength &&
      sorted.back().strength > 0.4f * sorted.front().strength)
    count = sorted.size();
  return count;
}

std::vector<std::array<float, 2>> find_markers(const std::vector<float>& image, uint32_t width,
                                               uint32_t height, const SkinPattern& pattern) {
  const int w = static_cast<int>(width), h = static_cast<int>(height);
  const int inner = std::max(1, static_cast<int>(std::lround(pattern.size_px * 0.3))),
            outer = std::max(inner + 2, static_cast<int>(std::lround(pattern.spacing_px / 2)));
  const Means means(image, width, height);
  const double floor = 0.05 * means.of(w / 2, h / 2, std::max(w, h)) + 1e-6;
  std::vector<float> contrast(image.size());
  double cubes = 0;
  for (int y = 0; y < h; ++y)
    for (int x = 0; x < w; ++x) {
      const double around = means.of(x, y, outer);
      const double c = (means.of(x, y, inner) - around) / (around + floor);
      contrast[static_cast<size_t>(y) * width + x] = static_cast<float>(c);
      cubes += c * c * c;
    }
  const float sign = cubes > 0 ? 1.0f : -1.0f;  // dots are few: they make the contrast lopsided
  std::vector<Peak> sorted =
      peaks(contrast, w, h, sign, std::max(2, static_cast<int>(std::lround(0.5 * pattern.spacing_px))));
  sorted.resize(dots_among(sorted));
  std::vector<std::array<float, 2>> centres;
  const int reach = std::max(2, static_cast<int>(std::ceil(pattern.size_px * 0.75)));
  for (const Peak& p : sorted) {
    if (p.x < reach || p.y < reach || p.x + reach >= w || p.y + reach >= h) continue;
    // Centre of mass of what differs from the surroundings by half as much as the dot.
    double sum = 0, sx = 0, sy = 0;
    const double around = means.of(p.x, p.y, outer), half = sign * (means.of(p.x, p.y, 1) - around) / 3;
    for (int j = -reach; j <= reach; ++j)
      for (int i = -reach; i <= reach; ++i) {
        if (i * i + j * j > reach * reach) continue;
        const double d = std::max(
            0.0, sign * (double{image[static_cast<size_t>(p.y + j) * width + p.x + i]} - around) - half);
        sum += d;
        sx += d * i;
        sy += d * j;
      }
    if (sum <= 0) continue;
    centres.push_back({static_cast<float>(p.x + sx / sum), static_cast<float>(p.y + sy / sum)});
  }
  std::sort(centres.begin(), centres.end(),
            [](const auto& a, const auto& b) { return a[1] != b[1] ? a[1] < b[1] : a[0] < b[0]; });
  return centres;
}

}  // namespace

std::vector<float> skin_image(const Frame& frame) {
  const FrameFormat& f = frame.format;
  std::vector<float> image(size_t{f.width} * f.height, 0.0f);
  for (uint32_t c = 0; c < f.channels; ++c)
    for (uint32_t y = 0; y < f.height; ++y)
      for (uint32_t x = 0; x < f.width; ++x)
        image[size_t{y} * f.width + x] += static_cast<float>(frame.at(c, x, y));
  return image;
}

std::vector<std::array<float, 2>> find_skin_points(const std::vector<float>& image, uint32_t width,
                                                   uint32_t height, const SkinPattern& pattern) {
  if (pattern.kind == SkinKind::Markers) return find_markers(image, width, height, pattern);
  std::vector<std::array<float, 2>> grid;
  const auto spacing = static_cast<uint32_t>(std::max(2L, std::lround(pattern.spacing_px)));
  const uint32_t x0 = (width % spacing) / 2, y0 = (height % spacing) / 2;
  for (uint32_t y = y0; y < height; y += spacing)
    for (uint32_t x = x0; x < width; x += spacing)
      grid.push_back({static_cast<float>(x), static_cast<float>(y)});
  return grid;
}

SkinWindow::SkinWindow(const SkinPattern& pattern) {
  // A dot with its edges, or what the pattern says.
  const double half = pattern.kind == SkinKind::Markers ? 0.75 * pattern.size_px + 2 : pattern.size_px;
  const auto reach = static_cast<uint32_t>(std::max(3.0, std::round(half)));
  constexpr uint32_t kMost = 10;
  stride = (reach + kMost - 1) / kMost;
  side = 2 * std::max(3u, reach / stride) + 1;
}

std::vector<SkinTemplate> skin_templates(const std::vector<float>& image, uint32_t width, uint32_t height,
                                         const SkinPattern& pattern) {
  const SkinWindow window(pattern);
  const int w = static_cast<int>(width), h = static_cast<int>(height),
            reach = static_cast<int>(window.reach_px()), side = static_cast<int>(window.side),
            stride = static_cast<int>(window.stride), n = side * side;
  // Offset and tilt of the light are no part of the pattern.
  Eigen::MatrixXd light(n, 3);
  for (int k = 0; k < n; ++k) light.row(k) << 1, k % side - side / 2, k / side - side / 2;
  const Eigen::HouseholderQR<Eigen::MatrixXd> qr(light);
  const Eigen::MatrixXd q = qr.householderQ() * Eigen::MatrixXd::Identity(n, 3);

  std::vector<SkinTemplate> templates;
  std::vector<double> contrast;
  for (const auto& centre : find_skin_points(image, width, height, pattern)) {
    SkinTemplate t;
    t.centre = centre;
    t.x_px = static_cast<int32_t>(std::lround(centre[0]));
    t.y_px = static_cast<int32_t>(std::lround(centre[1]));
    if (t.x_px - reach < 1 || t.y_px - reach < 1 || t.x_px + reach + 1 >= w || t.y_px + reach + 1 >= h)
      continue;
    const auto at = [&](int x, int y) { return double{image[static_cast<size_t>(y) * width + x]}; };
    Eigen::MatrixXd basis(n, 3);
    for (int k = 0; k < n; ++k) {
      const int x = t.x_px + (k % side - side / 2) * stride, y = t.y_px + (k / side - side / 2) * stride;
      const double gx = (2 * (at(x + 1, y) - at(x - 1, y)) + at(x + 1, y - 1) - at(x - 1, y - 1) +
                         at(x + 1, y + 1) - at(x - 1, y + 1)) /
                        8;
      const double gy = (2 * (at(x, y + 1) - at(x, y - 1)) + at(x - 1, y + 1) - at(x - 1, y - 1) +
                         at(x + 1, y + 1) - at(x + 1, y - 1)) /
                        8;
      basis.row(k) << at(x, y), gx, gy;
    }
    basis -= q * (q.transpose() * basis);
    const Eigen::Matrix3d normal = basis.transpose() * basis;
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> gradient(
        Eigen::Matrix2d(normal.bottomRightCorner<2, 2>()));
    const double least = gradient.eigenvalues()[0];
    if (!(least > 0) || !(normal(0, 0) > 0)) continue;
    const Eigen::Matrix3d inverse = normal.inverse();
    if (!inverse.allFinite()) continue;
    t.inverse = {inverse(0, 0), inverse(0, 1), inverse(0, 2), inverse(1, 1), inverse(1, 2), inverse(2, 2)};
    t.window.reserve(n);
    for (int k = 0; k < n; ++k)
      t.window.push_back({static_cast<float>(basis(k, 0)), static_cast<float>(basis(k, 1)),
                          static_cast<float>(basis(k, 2))});
    templates.push_back(std::move(t));
    contrast.push_back(least);
  }
  if (templates.empty()) return templates;
  // What has a small share of the others' contrast would only follow noise.
  std::vector<double> sorted = contrast;
  std::nth_element(sorted.begin(), sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2),
                   sorted.end());
  const double enough = 0.02 * sorted[sorted.size() / 2];
  size_t kept = 0;
  for (size_t i = 0; i < templates.size(); ++i)
    if (contrast[i] >= enough) {
      if (kept != i) templates[kept] = std::move(templates[i]);
      ++kept;
    }
  templates.resize(kept);

  for (size_t i = 0; i < templates.size(); ++i) {
    std::vector<std::pair<float, int32_t>> near;
    for (size_t j = 0; j < templates.size(); ++j) {
      const float dx = templates[j].centre[0] - templates[i].centre[0],
                  dy = templates[j].centre[1] - templates[i].centre[1];
      if (j != i && std::abs(dx) + std::abs(dy) < 3 * static_cast<float>(pattern.spacing_px))
        near.emplace_back(dx * dx + dy * dy, static_cast<int32_t>(j));
    }
    std::sort(near.begin(), near.end());
    for (size_t k = 0; k < 4; ++k) templates[i].neighbours[k] = k < near.size() ? near[k].second : -1;
  }
  return templates;
}

}  // namespace palpate
