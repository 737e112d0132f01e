#include "engine/calibrate/light_stack.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <string>

#include "engine/numeric/dense.h"
#include "engine/numeric/poisson_dct.h"
#include "palpate/error.h"

namespace palpate {
namespace {

constexpr double kWorstCondition = 1e12;

int terms_of(int order) {
  return (order + 1) * (order + 2) / 2;
}

void check(const LightImages& images) {
  if (images.images.size() < 3)
    throw Error(Failure::Input, "three images or more, each under a light of its own",
                std::to_string(images.images.size()), "an image for each light");
  for (const auto& image : images.images)
    if (image.size() != size_t{images.width} * images.height)
      throw Error(Failure::Input, "images of one size", "different ones", "images of one camera");
}

constexpr double kEven = 0.2;  // standard deviation of the smoothing, in widths

/// Running mean over `reach` values either way along a line, mirrored at its ends.
void smooth_line(const std::vector<double>& in, int reach, std::vector<double>& out) {
  const int n = static_cast<int>(in.size());
  const auto mirrored = [&](int i) {
    const int period = 2 * n, m = ((i % period) + period) % period;
    return in[static_cast<size_t>(m < n ? m : period - 1 - m)];
  };
  double sum = 0;
  for (int i = -reach; i <= reach; ++i) sum += mirrored(i);
  for (int i = 0; i < n; ++i) {
    out[static_cast<size_t>(i)] = sum / (2 * reach + 1);
    sum += mirrored(i + reach + 1) - mirrored(i - reach);
  }
}

/// A Gaussian of standard deviation `sigma` px, as three running means.
std::vector<double> smoothed(const std::vector<float>& image, uint32_t width, uint32_t height, double sigma) {
  const int reach = std::max(1, static_cast<int>(std::lround(0.5 * (std::sqrt(4 * sigma * sigma + 1) - 1))));
  std::vector<double> all(image.begin(), image.end());
  for (const bool along : {true, false}) {
    const uint32_t lines = along ? height : width, length = along ? width : height;
    std::vector<double> line(length), out(length);
    for (uint32_t l = 0; l < lines; ++l) {
      const auto at = [&](uint32_t i) { return along ? size_t{l} * width + i : size_t{i} * width + l; };
      for (uint32_t i = 0; i < length; ++i) line[i] = all[at(i)];
      for (int pass = 0; pass < 3; ++pass) {
        smooth_line(line, reach, out);
        line.swap(out);
      }
      for (uint32_t i = 0; i < length; ++i) all[at(i)] = line[i];
    }
  }
  return all;
}

LightImages evened(const LightImages& images) {
  LightImages out = images;
  for (auto& image : out.images) {
    const std::vector<double> light = smoothed(image, images.width, images.height, kEven * images.width);
    for (size_t i = 0; i < image.size(); ++i)
      image[i] = static_cast<float>(light[i] > 0 ? static_cast<double>(image[i]) / light[i] : 1);
  }
  return out;
}

/// Terms that a slope is linear in, at one pixel.
void features(const LightImages& images, int order, uint32_t x, uint32_t y, Eigen::VectorXd& out) {
  const size_t at = size_t{y} * images.width + x;
  double sum = 0;
  for (const auto& image : images.images) sum += static_cast<double>(image[at]);
  const double across = (2.0 * x + 1) / images.width - 1, down = (2.0 * y + 1) / images.height - 1;
  const int terms = terms_of(order);
  const size_t lights = images.images.size();
  int term = 0;
  for (int i = 0; i <= order; ++i)
    for (int j = 0; i + j <= order; ++j, ++term) {
      const double place = std::pow(across, i) * std::pow(down, j);
      for (size_t k = 0; k < lights; ++k) {
        // Fractions about their mean: what is left are their differences.
        const double fraction =
            sum > 0 ? static_cast<double>(images.images[k][at]) / sum : 1.0 / static_cast<double>(lights);
        out[static_cast<Eigen::Index>(k) * terms + term] =
            place * (fraction * static_cast<double>(lights) - 1);
      }
      out[static_cast<Eigen::Index>(lights) * terms + term] = place;
    }
}

}  // namespace

LightStack fit_light_stack(const LightImages& given, std::span<const float> height_mm,
                           std::span<const uint8_t> use, double pitch_mm_per_px, int order) {
  check(given);
  const LightImages images = evened(given);
  const uint32_t w = images.width, h = images.height;
  if (height_mm.size() != size_t{w} * h || use.size() != height_mm.size() || !(pitch_mm_per_px > 0))
    throw Error(Failure::Input, "heights of the images' size and a positive pitch", "other ones",
                "the height map of the same scan");
  const auto n = static_cast<Eigen::Index>((images.images.size() + 1) * static_cast<size_t>(terms_of(order)));
  Eigen::MatrixXd gram = Eigen::MatrixXd::Zero(n, n);
  Eigen::VectorXd to_x = Eigen::VectorXd::Zero(n), to_y = to_x, f(n);
  double xx = 0, yy = 0, mean_x = 0, mean_y = 0, count = 0;
  const auto slope = [&](uint32_t x, uint32_t y, bool along) {
    const size_t at = size_t{y} * w + x, step = along ? 1 : w;
    return (static_cast<double>(height_mm[at + step]) - static_cast<double>(height_mm[at - step])) /
           (2 * pitch_mm_per_px);
  };
  for (uint32_t y = 1; y + 1 < h; ++y)
    for (uint32_t x = 1; x + 1 < w; ++x) {
      if (!use[size_t{y} * w + x]) continue;
      const double p = slope(x, y, true), q = slope(x, y, false);
      if (!std::isfinite(p) || !std::isfinite(q)) continue;
      features(images, order, x, y, f);
      gram.selfadjointView<Eigen::Lower>().rankUpdate(f);
      to_x += p * f;
      to_y += q * f;
      xx += p * p;
      yy += q * q;
      mean_x += p;
      mean_y += q;
      count += 1;
    }
  if (count < 20.0 * static_cast<double>(n))
    throw Error(Failure::Input, std::to_string(20 * n) + " pixels of known height or more",
                std::to_string(static_cast<long long>(count)), "more of the scan");
  const Eigen::MatrixXd full = dense::from_lower(gram);
  const Eigen::VectorXd eigenvalues = dense::symmetric_eigenvalues(full);
  const double largest = eigenvalues[n - 1];
  LightStack stack;
  stack.lights = static_cast<uint32_t>(images.images.size());
  stack.order = order;
  stack.condition = largest / std::max(eigenvalues[0], 1e-300);
  // The shares add up to a constant, so one direction in each term is always empty.
  Eigen::MatrixXd a = full;
  a.diagonal().array() += largest / kWorstCondition;
  const dense::Ldlt solver(a);
  const Eigen::VectorXd x = solver.solve(to_x), y = solver.solve(to_y);
  const auto explained = [&](const Eigen::VectorXd& v, const Eigen::VectorXd& to, double square,
                             double mean) {
    const double left = square - 2 * v.dot(to) + v.dot(full * v), spread = square - mean * mean / count;
    return spread > 0 ? 1 - left / spread : 0;
  };
  stack.explained_x = explained(x, to_x, xx, mean_x);
  stack.explained_y = explained(y, to_y, yy, mean_y);
  stack.wx.assign(x.data(), x.data() + n);
  stack.wy.assign(y.data(), y.data() + n);
  return stack;
}

SlopeField slopes_of(const LightStack& stack, const LightImages& given) {
  check(given);
  const LightImages images = evened(given);
  if (images.images.size() != stack.lights)
    throw Error(Failure::Input, std::to_string(stack.lights) + " images, one for each light",
                std::to_string(images.images.size()), "the images of the calibrated instrument");
  const auto n = static_cast<Eigen::Index>(stack.wx.size());
  const Eigen::Map<const Eigen::VectorXd> wx(stack.wx.data(), n), wy(stack.wy.data(), n);
  Eigen::VectorXd f(n);
  SlopeField field;
  for (uint32_t y = 0; y < images.height; ++y)
    for (uint32_t x = 0; x < images.width; ++x) {
      features(images, stack.order, x, y, f);
      field.across.push_back(static_cast<float>(wx.dot(f)));
      field.down.push_back(static_cast<float>(wy.dot(f)));
    }
  return field;
}

std::vector<float> integrate_slopes(const SlopeField& slopes, uint32_t width, uint32_t height,
                                    double pitch_mm_per_px) {
  std::vector<double> right(size_t{width} * height);
  const auto link = [&](size_t a, size_t b, double step) {
    right[a] -= step;
    right[b] += step;
  };
  for (uint32_t y = 0; y < height; ++y)
    for (uint32_t x = 0; x < width; ++x) {
      const size_t at = size_t{y} * width + x;
      const auto mean = [&](const std::vector<float>& s, size_t other) {
        return 0.5 * (static_cast<double>(s[at]) + static_cast<double>(s[other])) * pitch_mm_per_px;
      };
      if (x + 1 < width) link(at, at + 1, mean(slopes.across, at + 1));
      if (y + 1 < height) link(at, at + width, mean(slopes.down, at + width));
    }
  PoissonDct dct(width, height);
  dct.solve(right.data(), right.data(), width);
  return {right.begin(), right.end()};
}

}  // namespace palpate
