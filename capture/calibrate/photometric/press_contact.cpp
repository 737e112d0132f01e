#include "capture/calibrate/photometric/press_contact.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "engine/base/statistics.h"
#include "engine/base/text.h"

namespace palpate {
namespace {

constexpr double kOneWay = 0.9;     // fraction of the change: the other way is noise
constexpr double kFar = 3;          // half widths of a contact from its middle
constexpr double kRest = 0.999;     // of the pixels that are not touched
constexpr double kThreshold = 1.5;  // over what these reach, as for an untouched recording
constexpr double kSteps = 128;      // a gray level

/// Image planes of the change, gray levels.
std::vector<cv::Mat> change_of(const Frame& frame, const Frame& background) {
  const FrameFormat& f = frame.format;
  std::vector<cv::Mat> change;
  for (uint32_t c = 0; c < f.channels; ++c) {
    cv::Mat plane(static_cast<int>(f.height), static_cast<int>(f.width), CV_32F);
    for (uint32_t y = 0; y < f.height; ++y)
      for (uint32_t x = 0; x < f.width; ++x)
        plane.at<float>(static_cast<int>(y), static_cast<int>(x)) =
            static_cast<float>(frame.at(c, x, y)) - static_cast<float>(background.at(c, x, y));
    change.push_back(plane);
  }
  return change;
}

/// Change that counts as touch: that of the brightest or most changed channel, through the filter.
cv::Mat counted(const std::vector<cv::Mat>& change, Signal signal, Filter filter) {
  static const cv::Mat binomial = (cv::Mat_<float>(5, 1) << 1 / 16.f, 4 / 16.f, 6 / 16.f, 4 / 16.f, 1 / 16.f);
  cv::Mat most = cv::Mat::zeros(change.front().size(), CV_32F);
  for (const cv::Mat& plane : change) {
    const cv::Mat signed_change = signal == Signal::Darker   ? cv::Mat(-plane)
                                  : signal == Signal::Either ? cv::Mat(cv::abs(plane))
                                                             : plane;
    most = cv::max(most, signed_change);
  }
  if (filter == Filter::Binomial5)
    cv::sepFilter2D(most, most, CV_32F, binomial, binomial, {-1, -1}, 0, cv::BORDER_REPLICATE);
  return most;
}

/// Steepness over 5 x 5 px, root of the sum of squares of all channels, gray levels per px.
cv::Mat steepness(const std::vector<cv::Mat>& change) {
  static const cv::Mat derivative = (cv::Mat_<float>(5, 1) << -1 / 8.f, -2 / 8.f, 0, 2 / 8.f, 1 / 8.f);
  static const cv::Mat binomial = (cv::Mat_<float>(5, 1) << 1 / 16.f, 4 / 16.f, 6 / 16.f, 4 / 16.f, 1 / 16.f);
  cv::Mat squares = cv::Mat::zeros(change.front().size(), CV_32F), along;
  for (const cv::Mat& plane : change) {
    cv::sepFilter2D(plane, along, CV_32F, derivative, binomial, {-1, -1}, 0, cv::BORDER_REPLICATE);
    squares += along.mul(along);
    cv::sepFilter2D(plane, along, CV_32F, binomial, derivative, {-1, -1}, 0, cv::BORDER_REPLICATE);
    squares += along.mul(along);
  }
  cv::sqrt(squares, squares);
  return squares;
}

double percentile(std::vector<float> values, double fraction) {
  if (values.empty()) return 0;
  const auto at =
      values.begin() + static_cast<std::ptrdiff_t>(std::min(fraction * static_cast<double>(values.size()),
                                                            static_cast<double>(values.size() - 1)));
  std::nth_element(values.begin(), at, values.end());
  return static_cast<double>(*at);
}

/// Values of `image` within a press's contact, and of those far from it.
struct Places {
  std::vector<float> within, far;

  Places(const cv::Mat& image, const BallPress& press) {
    const double radius_px = press.ball.radius_px;
    for (int y = 0; y < image.rows; ++y)
      for (int x = 0; x < image.cols; ++x) {
        const size_t i = static_cast<size_t>(y) * static_cast<size_t>(image.cols) + static_cast<size_t>(x);
        if (!press.mask.empty() && press.mask[i] != 0) continue;
        const MiddleOffset offset = offset_from(press.ball, x, y);
        if (offset.px <= radius_px && !offset.at_end) within.push_back(image.at<float>(y, x));
        if (offset.px >= kFar * radius_px) far.push_back(image.at<float>(y, x));
      }
  }
};

double in_steps(double gray) {
  return std::ceil(gray * kSteps) / kSteps;
}

}  // namespace

PressContact contact_of_presses(const BallPresses& found, Filter filter) {
  PressContact contact;
  std::vector<std::vector<cv::Mat>> changes;
  double up = 0, all = 0;
  for (size_t i = 0; i < found.presses.size(); ++i) {
    changes.push_back(change_of(found.presses[i].frame, found.backgrounds[i]));
    for (const cv::Mat& plane : changes.back())
      for (const float value : Places(plane, found.presses[i]).within) {
        up += std::max(double{value}, 0.0);
        all += std::abs(double{value});
      }
  }
  contact.brighter = all > 0 ? up / all : 0;
  contact.signal = contact.brighter >= kOneWay       ? Signal::Brighter
                   : contact.brighter <= 1 - kOneWay ? Signal::Darker
                                                     : Signal::Either;
  std::vector<double> within, far, steep_within, steep_far;
  for (size_t i = 0; i < changes.size(); ++i) {
    const Places gray(counted(changes[i], contact.signal, filter), found.presses[i]);
    const Places steep(steepness(changes[i]), found.presses[i]);
    within.push_back(percentile(gray.within, 0.5));
    steep_within.push_back(percentile(steep.within, 0.5));
    if (gray.far.empty()) continue;  // a ball as large as the frame
    far.push_back(percentile(gray.far, kRest));
    steep_far.push_back(percentile(steep.far, kRest));
  }
  const auto usual = [](const std::vector<double>& v) { return v.empty() ? 0.0 : median(v); };
  contact.contact_gray = usual(within);
  contact.contact_gray_per_px = usual(steep_within);
  contact.rest_gray = usual(far);
  contact.threshold_gray = in_steps(kThreshold * std::max(contact.rest_gray, 1.0));
  contact.gradient_gray_per_px = in_steps(std::max(usual(steep_far), 1 / kSteps));
  contact.clear = contact.contact_gray > contact.threshold_gray;
  return contact;
}

void apply(const PressContact& contact, Sensor& sensor) {
  sensor.signal = contact.signal;
  sensor.threshold_gray = contact.threshold_gray;
  sensor.gradient_gray_per_px = contact.gradient_gray_per_px;
}

std::string describe(const PressContact& c) {
  std::string line = text(
      "contact: %s (%.0f %% of the change upwards), median change %.3g gray; untouched 99.9 %% below "
      "%.3g gray: threshold %.3g gray\nsteepness: median %.3g gray/px; untouched 99.9 %% below %.3g "
      "gray/px, what is steeper counts",
      to_string(c.signal), 100 * c.brighter, c.contact_gray, c.rest_gray, c.threshold_gray,
      c.contact_gray_per_px, c.gradient_gray_per_px);
  if (!c.clear) line += "\nWARNING: a contact changes by less than the threshold: more light, or less glow";
  return line;
}

}  // namespace palpate
