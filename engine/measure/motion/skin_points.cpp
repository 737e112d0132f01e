#include "engine/measure/motion/skin_points.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <utility>

#include "engine/base/divide_up.h"
#include "engine/numeric/dense.h"

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
          // The first of equal ones counts.
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

// A peak between the dots is no dot, nor one that is far weaker than the strong ones: strengths differ with
// the light, but not by that much.
size_t dots_among(const std::vector<Peak>& dots, const std::vector<Peak>& others) {
  if (dots.empty()) return 0;
  constexpr double kOverOthers = 1.5, kOfStrong = 0.25;
  const double strong = double{dots[dots.size() / 10].strength},
               other = others.empty() ? 0 : double{others[others.size() / 20].strength};
  const double least = std::max(kOfStrong * strong, kOverOthers * other);
  return static_cast<size_t>(
      std::count_if(dots.begin(), dots.end(), [&](const Peak& p) { return double{p.strength} >= least; }));
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
  const int apart = std::max(2, static_cast<int>(std::lround(0.5 * pattern.spacing_px)));
  std::vector<Peak> sorted = peaks(contrast, w, h, sign, apart);
  sorted.resize(dots_among(sorted, peaks(contrast, w, h, -sign, apart)));
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
  stride = divide_up(reach, kMost);
  side = 2 * std::max(3u, reach / stride) + 1;
}

namespace {

// Builds the templates of one image.
class TemplateMaker {
 public:
  TemplateMaker(const std::vector<float>& image, uint32_t width, uint32_t height, const SkinPattern& pattern)
      : image_(image),
        w_(static_cast<int>(width)),
        h_(static_cast<int>(height)),
        texture_(pattern.kind == SkinKind::Texture) {
    const SkinWindow window(pattern);
    reach_ = static_cast<int>(window.reach_px());
    side_ = static_cast<int>(window.side);
    stride_ = static_cast<int>(window.stride);
    n_ = side_ * side_;
    light_.resize(n_, 3);
    for (int k = 0; k < n_; ++k) light_.row(k) << 1, column(k) * stride_, row(k) * stride_;
    x_px_ = light_.col(1);
    y_px_ = light_.col(2);
    light_basis_ = dense::thin_q(light_);
  }

  // None where the window leaves the image or tells no motion. `least`: contrast in the direction that has
  // the least of it.
  std::optional<SkinTemplate> make(const std::array<float, 2>& centre, double& least) const {
    SkinTemplate t;
    t.centre = centre;
    t.x_px = static_cast<int32_t>(std::lround(centre[0]));
    t.y_px = static_cast<int32_t>(std::lround(centre[1]));
    if (t.x_px - reach_ < 1 || t.y_px - reach_ < 1 || t.x_px + reach_ + stride_ >= w_ ||
        t.y_px + reach_ + stride_ >= h_)
      return std::nullopt;
    Samples s = sample(t.x_px, t.y_px);
    s.rest -= light_basis_ * (light_basis_.transpose() * s.rest);
    const double contrast = s.rest.squaredNorm();
    if (!(contrast > 0)) return std::nullopt;
    const Eigen::MatrixXd basis = motion_basis(s);
    Eigen::MatrixXd normal = dense::product_tn(basis, basis);
    const double variance = contrast / n_;
    for (int k = 6; k < basis.cols(); ++k) normal(k, k) += variance * (k < 10 ? 1 : stride_ * stride_);
    const dense::Ldlt solver(normal);
    if (!solver.positive() || !(solver.rcond() > 1e-14)) return std::nullopt;
    const Eigen::MatrixXd rows = solver.solve(Eigen::MatrixXd(basis.transpose()));
    if (!rows.allFinite()) return std::nullopt;
    t.step_sd = std::sqrt((rows.row(1).squaredNorm() + rows.row(2).squaredNorm()) / 2);
    t.contrast = static_cast<float>(contrast);
    least = 1 / std::max(rows.row(1).squaredNorm(), rows.row(2).squaredNorm());
    if (!(least > 0)) return std::nullopt;
    t.window.reserve(n_);
    for (int k = 0; k < n_; ++k)
      t.window.push_back({static_cast<float>(s.rest[k]), static_cast<float>(rows(0, k)),
                          static_cast<float>(rows(1, k)), static_cast<float>(rows(2, k))});
    return t;
  }

 private:
  // A window's values and their slopes along x and y.
  struct Samples {
    Eigen::VectorXd rest, along, down;
  };

  int column(int k) const { return k % side_ - side_ / 2; }
  int row(int k) const { return k / side_ - side_ / 2; }

  Samples sample(int x_px, int y_px) const {
    const auto at = [&](int x, int y) { return double{image_[static_cast<size_t>(y) * w_ + x]}; };
    Samples s{Eigen::VectorXd::Zero(n_), Eigen::VectorXd::Zero(n_), Eigen::VectorXd::Zero(n_)};
    for (int k = 0; k < n_; ++k)
      for (int p = 0; p < stride_ * stride_; ++p) {
        const int x = x_px + column(k) * stride_ + p % stride_, y = y_px + row(k) * stride_ + p / stride_;
        s.rest[k] += at(x, y);
        s.along[k] += (2 * (at(x + 1, y) - at(x - 1, y)) + at(x + 1, y - 1) - at(x - 1, y - 1) +
                       at(x + 1, y + 1) - at(x - 1, y + 1)) /
                      8;
        s.down[k] += (2 * (at(x, y + 1) - at(x, y - 1)) + at(x - 1, y + 1) - at(x - 1, y - 1) +
                      at(x + 1, y + 1) - at(x + 1, y - 1)) /
                     8;
      }
    return s;
  }

  // Gain, step, and what else a textured window does: strain of the skin, light that falls unevenly on it.
  // None of that is large. A dot cannot tell it apart, and its centre does not move by it.
  Eigen::MatrixXd motion_basis(const Samples& s) const {
    Eigen::MatrixXd basis(n_, texture_ ? 12 : 6);
    basis.leftCols(6) << s.rest, s.along, s.down, light_;
    if (texture_)
      basis.rightCols(6) << s.along.cwiseProduct(x_px_), s.along.cwiseProduct(y_px_),
          s.down.cwiseProduct(x_px_), s.down.cwiseProduct(y_px_), s.rest.cwiseProduct(x_px_),
          s.rest.cwiseProduct(y_px_);
    return basis;
  }

  const std::vector<float>& image_;
  int w_, h_;
  bool texture_;
  int reach_, side_, stride_, n_;
  Eigen::MatrixXd light_;  // offset and tilt of the light are no part of the pattern
  Eigen::VectorXd x_px_, y_px_;
  Eigen::MatrixXd light_basis_;  // orthonormal
};

// A point with a small fraction of the others' contrast would only follow noise.
void drop_faint(std::vector<SkinTemplate>& templates, const std::vector<double>& contrast) {
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
}

// The four nearest within three spacings.
void link_neighbours(std::vector<SkinTemplate>& templates, float spacing_px) {
  for (size_t i = 0; i < templates.size(); ++i) {
    std::vector<std::pair<float, int32_t>> near;
    for (size_t j = 0; j < templates.size(); ++j) {
      const float dx = templates[j].centre[0] - templates[i].centre[0],
                  dy = templates[j].centre[1] - templates[i].centre[1];
      if (j != i && std::abs(dx) + std::abs(dy) < 3 * spacing_px)
        near.emplace_back(dx * dx + dy * dy, static_cast<int32_t>(j));
    }
    std::sort(near.begin(), near.end());
    for (size_t k = 0; k < 4; ++k) templates[i].neighbours[k] = k < near.size() ? near[k].second : -1;
  }
}

}  // namespace

std::vector<SkinTemplate> skin_templates(const std::vector<float>& image, uint32_t width, uint32_t height,
                                         const SkinPattern& pattern) {
  const TemplateMaker maker(image, width, height, pattern);
  std::vector<SkinTemplate> templates;
  std::vector<double> contrast;
  for (const auto& centre : find_skin_points(image, width, height, pattern)) {
    double least = 0;
    std::optional<SkinTemplate> made = maker.make(centre, least);
    if (!made) continue;
    templates.push_back(std::move(*made));
    contrast.push_back(least);
  }
  if (templates.empty()) return templates;
  drop_faint(templates, contrast);
  link_neighbours(templates, static_cast<float>(pattern.spacing_px));
  return templates;
}

}  // namespace palpate
