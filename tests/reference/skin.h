// The skin stage in plain loops and double precision: shaders/frame/skin.comp, point by point.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "engine/measure/motion/skin_points.h"
#include "shaders/shared/skin.h"

namespace palpate::reference {

struct SkinMotionOfPoint {
  double x = 0, y = 0, correlation = 1, noise = 0;
};

class Skin {
 public:
  Skin(const Frame& untouched, const SkinPattern& pattern, double search_px)
      : width_(static_cast<int>(untouched.format.width)),
        height_(static_cast<int>(untouched.format.height)),
        window_(pattern),
        search_px_(search_px),
        spacing_px_(pattern.spacing_px),
        templates_(
            skin_templates(skin_image(untouched), untouched.format.width, untouched.format.height, pattern)),
        motions_(templates_.size()) {}

  const std::vector<SkinTemplate>& templates() const { return templates_; }

  const std::vector<SkinMotionOfPoint>& follow(const Frame& frame) {
    image_ = skin_image(frame);
    std::vector<SkinMotionOfPoint> next;
    for (size_t i = 0; i < templates_.size(); ++i) next.push_back(follow(i));
    return motions_ = next;
  }

 private:
  double pixel(int x, int y) const {
    return double{
        image_[static_cast<size_t>(std::clamp(y, 0, height_ - 1)) * width_ + std::clamp(x, 0, width_ - 1)]};
  }
  double between(double x, double y) const {
    const int i = static_cast<int>(std::floor(x)), j = static_cast<int>(std::floor(y));
    const double u = x - i, v = y - j;
    return (1 - v) * ((1 - u) * pixel(i, j) + u * pixel(i + 1, j)) +
           v * ((1 - u) * pixel(i, j + 1) + u * pixel(i + 1, j + 1));
  }

  /// The sum of the pixels of a sample.
  template <typename At>
  double sample(const At& at) const {
    double sum = 0;
    for (uint32_t y = 0; y < window_.stride; ++y)
      for (uint32_t x = 0; x < window_.stride; ++x) sum += at(static_cast<int>(x), static_cast<int>(y));
    return sum;
  }

  double correlation(const SkinTemplate& t, double x, double y) const {
    const int side = static_cast<int>(window_.side), stride = static_cast<int>(window_.stride);
    std::vector<double> a, b;
    for (int j = 0; j < side; j += 2)
      for (int i = 0; i < side; ++i) {
        a.push_back(double{t.window[static_cast<size_t>(j) * side + i][0]});
        const int left = t.x_px + static_cast<int>(std::nearbyint(x)) + (i - side / 2) * stride,
                  top = t.y_px + static_cast<int>(std::nearbyint(y)) + (j - side / 2) * stride;
        b.push_back(sample([&](int to_x, int to_y) { return pixel(left + to_x, top + to_y); }));
      }
    double ma = 0, mb = 0, aa = 0, bb = 0, ab = 0;
    for (size_t k = 0; k < a.size(); ++k) ma += a[k], mb += b[k];
    ma /= static_cast<double>(a.size());
    mb /= static_cast<double>(a.size());
    for (size_t k = 0; k < a.size(); ++k) {
      aa += (a[k] - ma) * (a[k] - ma);
      bb += (b[k] - mb) * (b[k] - mb);
      ab += (a[k] - ma) * (b[k] - mb);
    }
    return aa * bb > 1e-12 ? ab / std::sqrt(aa * bb) : 0;
  }

  SkinMotionOfPoint follow(size_t index) const {
    const SkinTemplate& t = templates_[index];
    const SkinMotionOfPoint& was = motions_[index];
    double count = 0, around_x = 0, around_y = 0;
    for (const int32_t n : t.neighbours) {
      if (n < 0 || motions_[n].correlation <= 0) continue;
      count += 1;
      around_x += motions_[n].x;
      around_y += motions_[n].y;
    }
    around_x = count > 0 ? around_x / count : was.x;
    around_y = count > 0 ? around_y / count : was.y;
    const bool astray = was.correlation <= 0 ||
                        (count > 1 && std::hypot(was.x - around_x, was.y - around_y) > 0.45 * spacing_px_);
    const double start_x = astray ? around_x : was.x, start_y = astray ? around_y : was.y;
    SkinMotionOfPoint fit = fit_from(t, start_x, start_y);
    if (astray || fit.correlation < double{shared::kSkinSure}) {
      const auto [x, y] = search(t, start_x, start_y);
      fit = fit_from(t, x, y);
    }
    const double at_x = t.x_px + fit.x, at_y = t.y_px + fit.y;
    const bool inside = at_x >= 0 && at_y >= 0 && at_x <= width_ - 1 && at_y <= height_ - 1;
    if (!inside || fit.correlation < double{shared::kSkinLeastCorrelation}) return {start_x, start_y, 0, 0};
    return fit;
  }

  std::array<double, 2> search(const SkinTemplate& t, double start_x, double start_y) const {
    std::array<double, 2> found{start_x, start_y};
    double best = correlation(t, start_x, start_y) + double{shared::kSkinPrefer};
    const auto consider = [&](double x, double y) {
      if (const double score = correlation(t, x, y); score > best) best = score, found = {x, y};
    };
    const int reach = static_cast<int>(shared::kSkinReach);
    for (int j = -reach; j <= reach; ++j)
      for (int i = -reach; i <= reach; ++i) consider(start_x + search_px_ * i, start_y + search_px_ * j);
    consider(0, 0);
    return found;
  }

  SkinMotionOfPoint fit_from(const SkinTemplate& t, double x, double y) const {
    const int side = static_cast<int>(window_.side), stride = static_cast<int>(window_.stride),
              n = side * side;
    double correlation = 0, noise = 0;
    for (uint32_t iteration = 0; iteration < shared::kSkinIterations; ++iteration) {
      std::array<double, 4> fit{};
      std::vector<double> v(n);
      double s0 = 0, sx = 0, sy = 0, ss = 0, spread = 0;
      for (int k = 0; k < n; ++k) {
        const int i = k % side - side / 2, j = k / side - side / 2;
        v[k] = sample([&](int to_x, int to_y) {
          return between(t.x_px + x + i * stride + to_x, t.y_px + y + j * stride + to_y);
        });
        for (int c = 0; c < 4; ++c) fit[c] += v[k] * double{t.window[k][c]};
        s0 += v[k];
        sx += v[k] * i;
        sy += v[k] * j;
        spread += i * i;
      }
      for (int k = 0; k < n; ++k) {
        const int i = k % side - side / 2, j = k / side - side / 2;
        const double d = v[k] - s0 / n - sx / spread * i - sy / spread * j;
        ss += d * d;
      }
      const double gain = fit[1];
      const bool seen = gain > 1e-3 && fit[0] > 0 && ss > 1e-3;
      const double dx = seen ? fit[2] / gain : 0, dy = seen ? fit[3] / gain : 0, size = std::hypot(dx, dy);
      const double part = std::min(double{shared::kSkinStepPart},
                                   double{shared::kSkinLargestStep} * stride / std::max(size, 1e-9));
      x -= dx * part;
      y -= dy * part;
      const double correlated = std::min(fit[0] * fit[0] / (double{t.contrast} * ss), 1.0);
      correlation = seen && size < double{shared::kSkinSettled} * stride ? std::sqrt(correlated) : 0;
      noise = seen ? std::sqrt(ss * (1 - correlated) / n) / gain : 0;
      if (size < double{shared::kSkinSmallStep} * stride) break;
    }
    return {x, y, correlation, noise};
  }

  int width_, height_;
  SkinWindow window_;
  double search_px_, spacing_px_;
  std::vector<SkinTemplate> templates_;
  std::vector<SkinMotionOfPoint> motions_;
  std::vector<float> image_;
};

}  // namespace palpate::reference
