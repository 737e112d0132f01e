#include "perf/profile/truths.h"

#include <algorithm>
#include <cmath>
#include <random>

#include "capture/synthetic/heights.h"

namespace palpate::perf {
namespace {

constexpr double kSlopeNoise = 0.02;  // of the steepest slope

Truth make_truth(const std::string& name, const scenes::HeightField& field, const FrameSize& size) {
  Truth truth;
  truth.name = name;
  truth.gradients = scenes::gradients(field, size.height_px, size.width_px);
  for (uint32_t y = 0; y < size.height_px; ++y)
    for (uint32_t x = 0; x < size.width_px; ++x) truth.height.push_back(field.height(x, y));
  return truth;
}

void add_noise(std::vector<float>& gradients) {
  float steepest = 0;
  for (const float g : gradients) steepest = std::max(steepest, std::abs(g));
  std::mt19937 random(1);
  std::normal_distribution<float> noise(0, static_cast<float>(kSlopeNoise) * steepest);
  for (float& g : gradients) g += noise(random);
}

struct Statistics {
  double mean = 0;
  double low = INFINITY;
  double high = -INFINITY;
  void add(double value, double weight) {
    mean += value * weight;
    low = std::min(low, value);
    high = std::max(high, value);
  }
};

}  // namespace

std::vector<Truth> make_truths(const FrameSize& size) {
  const double w = size.width_px, h = size.height_px, side = std::min(w, h);
  const auto bump = scenes::gaussian(w / 2, h / 2, side / 10, side / 20);
  std::vector<Truth> truths;
  truths.push_back(make_truth("smooth", bump, size));
  truths.push_back(make_truth("wide", scenes::broad_press(w, h, side / 20), size));
  truths.push_back(make_truth("tilted", scenes::tilt(), size));
  truths.push_back(make_truth("capped", scenes::cap(w / 2 + 0.3, h / 2 - 0.2, side / 3, side / 6), size));
  truths.push_back(make_truth("noisy", bump, size));
  add_noise(truths.back().gradients);
  return truths;
}

SurfaceErrors errors_of(const Truth& truth, const FrameSize& size,
                        const std::function<double(uint32_t, uint32_t)>& at) {
  const double weight = 1 / static_cast<double>(truth.height.size());
  std::vector<double> found;
  found.reserve(truth.height.size());
  for (uint32_t y = 0; y < size.height_px; ++y)
    for (uint32_t x = 0; x < size.width_px; ++x) found.push_back(at(x, y));
  Statistics true_heights, found_heights;
  for (size_t i = 0; i < found.size(); ++i) {
    true_heights.add(truth.height[i], weight);
    found_heights.add(found[i], weight);
  }
  double error = 0, whole = 0;
  for (size_t i = 0; i < found.size(); ++i) {
    const double t = truth.height[i] - true_heights.mean, f = found[i] - found_heights.mean;
    error += (f - t) * (f - t);
    whole += t * t;
  }
  return {std::sqrt(error / whole),
          std::abs((found_heights.high - found_heights.low) / (true_heights.high - true_heights.low) - 1)};
}

void line_integral(const float* gradients, uint32_t width, uint32_t height, float* z) {
  const auto p = [&](size_t i) { return gradients[2 * i]; };
  const auto q = [&](size_t i) { return gradients[2 * i + 1]; };
  z[0] = 0;
  for (size_t x = 1; x < width; ++x) z[x] = z[x - 1] + (p(x - 1) + p(x)) / 2;
  for (size_t i = width; i < size_t{width} * height; ++i) z[i] = z[i - width] + (q(i - width) + q(i)) / 2;
}

}  // namespace palpate::perf
