#include "capture/calibrate/frame/flat.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "engine/base/statistics.h"
#include "palpate/error.h"

namespace palpate {
namespace {

constexpr double kSmooth = 0.02;  // of the width: what is finer than that is no light's doing
constexpr double kLimit = 4;      // of the factor, and its inverse
constexpr double kDark = 0.1;     // of the median light: nothing is known there
constexpr double kMostDark = 0.2;

// Brightness and what is known of it, summed over frames.
struct Light {
  cv::Mat sum, known;

  void add(const Frame& frame, const Frame* dark, const std::vector<uint8_t>& mask, const Sensor& sensor) {
    const FrameFormat& f = frame.format;
    const cv::Size size(static_cast<int>(f.width), static_cast<int>(f.height));
    if (sum.empty()) {
      sum = cv::Mat(size, CV_32F, cv::Scalar(0));
      known = cv::Mat(size, CV_32F, cv::Scalar(0));
    }
    for (uint32_t y = 0; y < f.height; ++y)
      for (uint32_t x = 0; x < f.width; ++x) {
        if (!mask.empty() && mask[size_t{y} * f.width + x]) continue;
        double gray = 0;
        bool saturated = false;
        for (uint32_t c = 0; c < f.channels; ++c) {
          const uint32_t value = frame.at(c, x, y);
          saturated = saturated || value >= sensor.saturation_gray;
          gray += static_cast<double>(value) - (dark ? static_cast<double>(dark->at(c, x, y)) : 0);
        }
        if (saturated) continue;
        const int v = static_cast<int>(y), u = static_cast<int>(x);
        sum.at<float>(v, u) += static_cast<float>(gray / f.channels);
        known.at<float>(v, u) += 1;
      }
  }

  // The mean light, smoothed over what is known.
  cv::Mat smooth(double sigma) const {
    cv::Mat a, b;
    cv::GaussianBlur(sum, a, {}, sigma, sigma, cv::BORDER_REFLECT);
    cv::GaussianBlur(known, b, {}, sigma, sigma, cv::BORDER_REFLECT);
    return a / cv::max(b, 1e-3f);
  }
};

double median_light(const cv::Mat& light) {
  return double{median(std::vector<float>(light.begin<float>(), light.end<float>()))};
}

cv::Mat factors(const cv::Mat& light, double median) {
  cv::Mat f = median / cv::max(light, 1e-3f);
  return cv::min(cv::max(f, 1 / kLimit), kLimit);
}

double unevenness(const cv::Mat& light) {
  cv::Scalar mean, sd;
  cv::meanStdDev(light, mean, sd);
  return mean[0] > 0 ? sd[0] / mean[0] : 0;
}

}  // namespace

FlatFit fit_flat(const std::vector<Frame>& frames, const Frame* dark, const std::vector<uint8_t>& mask,
                 const Sensor& sensor) {
  if (frames.size() < 2)
    throw Error(Failure::Input, "two frames or more, so that the field is checked on one that was not used",
                std::to_string(frames.size()), "a longer recording, or more --frames");
  Light all, even, odd;
  for (size_t i = 0; i < frames.size(); ++i) {
    all.add(frames[i], dark, mask, sensor);
    (i % 2 ? odd : even).add(frames[i], dark, mask, sensor);
  }
  const double sigma = std::max(1.0, kSmooth * frames.front().format.width);
  const cv::Mat light = all.smooth(sigma);
  const double usual = median_light(light);
  const double unlit = cv::countNonZero(light < kDark * usual) / static_cast<double>(light.total());
  if (!(usual > 0.5) || unlit > kMostDark)
    throw Error(
        Failure::Input, "light over the whole frame",
        usual > 0.5 ? std::to_string(static_cast<int>(100 * unlit)) + " % of it dark" : std::string("none"),
        dark ? "a flat even target that covers the frame, pressed" : "frames lit as in use, or a crop");
  FlatFit fit;
  const cv::Mat tried = odd.smooth(sigma / 2);
  fit.uneven_before = unevenness(tried);
  fit.uneven_after = unevenness(tried.mul(factors(even.smooth(sigma), usual)));
  const cv::Mat by = factors(light, usual);
  cv::minMaxLoc(by, &fit.least, &fit.most);
  fit.limited = cv::countNonZero((by >= kLimit) | (by <= 1 / kLimit)) / static_cast<double>(by.total());
  fit.gain = fit.most / 65535;
  fit.image.reshape({frames.front().format.width, frames.front().format.height, 1, 16});
  for (int y = 0; y < by.rows; ++y)
    for (int x = 0; x < by.cols; ++x)
      fit.image.set(0, static_cast<uint32_t>(x), static_cast<uint32_t>(y),
                    static_cast<uint32_t>(std::lround(static_cast<double>(by.at<float>(y, x)) / fit.gain)));
  return fit;
}

}  // namespace palpate
