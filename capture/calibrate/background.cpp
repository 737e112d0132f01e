#include "capture/calibrate/background.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <limits>
#include <opencv2/imgproc.hpp>

#include "capture/files/output_file.h"
#include "capture/open_source.h"
#include "engine/base/statistics.h"
#include "engine/base/text.h"
#include "palpate/error.h"

namespace palpate {
namespace {

constexpr size_t kForMedian = 15;
constexpr int kBlock = 8;
constexpr double kUnlike = 8;            // a block's difference over what noise makes of it
constexpr double kLeastUnlike = 0.006;   // of full scale
constexpr double kNoiseThreshold = 1.5;  // over the largest change that noise makes

cv::Mat plane(const Frame& frame, uint32_t channel) {
  const FrameFormat& f = frame.format;
  cv::Mat out;
  cv::Mat(static_cast<int>(f.height), static_cast<int>(f.width), f.bit_depth > 8 ? CV_16UC1 : CV_8UC1,
          const_cast<uint8_t*>(frame.row(channel, 0)))
      .convertTo(out, CV_32F);
  return out;
}

cv::Mat blocks(const cv::Mat& image) {
  cv::Mat small;
  cv::resize(image, small, {(image.cols + kBlock - 1) / kBlock, (image.rows + kBlock - 1) / kBlock}, 0, 0,
             cv::INTER_AREA);
  return small;
}

struct Difference {
  double gray = 0;
  cv::Point at;
};

/// The largest difference between 8 x 8 px means of two images of all planes.
Difference difference(const std::vector<cv::Mat>& a, const std::vector<cv::Mat>& b) {
  Difference largest;
  for (size_t c = 0; c < a.size(); ++c) {
    cv::Mat d;
    cv::absdiff(blocks(a[c]), blocks(b[c]), d);
    double value = 0;
    cv::Point at;
    cv::minMaxLoc(d, nullptr, &value, nullptr, &at);
    if (value > largest.gray) largest = {value, at * kBlock};
  }
  return largest;
}

std::vector<cv::Mat> planes(const Frame& frame) {
  std::vector<cv::Mat> all;
  for (uint32_t c = 0; c < frame.format.channels; ++c) all.push_back(plane(frame, c));
  return all;
}

std::vector<cv::Mat> mean_of(const std::vector<const Frame*>& frames) {
  std::vector<cv::Mat> sum;
  for (const Frame* frame : frames) {
    const std::vector<cv::Mat> next = planes(*frame);
    if (sum.empty())
      sum = next;
    else
      for (size_t c = 0; c < next.size(); ++c) sum[c] += next[c];
  }
  for (cv::Mat& s : sum) s /= static_cast<double>(frames.size());
  return sum;
}

Frame median_of(const std::vector<Frame>& frames) {
  const size_t count = std::min(frames.size(), kForMedian), step = frames.size() / count;
  Frame median;
  median.reshape(frames.front().format);
  const FrameFormat& f = median.format;
  std::vector<uint32_t> values(count);
  for (uint32_t c = 0; c < f.channels; ++c)
    for (uint32_t y = 0; y < f.height; ++y)
      for (uint32_t x = 0; x < f.width; ++x) {
        for (size_t i = 0; i < count; ++i) values[i] = frames[i * step].at(c, x, y);
        const auto middle = values.begin() + static_cast<std::ptrdiff_t>(count / 2);
        std::nth_element(values.begin(), middle, values.end());
        median.set(c, x, y, *middle);
      }
  return median;
}

/// Standard deviation of an 8 x 8 px mean, from one frame to the next: touch that comes and goes does not
/// count, as most blocks of most frames know nothing of it.
double block_noise(const std::vector<Frame>& frames) {
  std::vector<float> steps;
  std::vector<cv::Mat> before;
  for (const Frame& frame : frames) {
    std::vector<cv::Mat> now;
    for (const cv::Mat& p : planes(frame)) now.push_back(blocks(p));
    for (size_t c = 0; c < before.size(); ++c) {
      const cv::Mat step = cv::abs(now[c] - before[c]);
      steps.insert(steps.end(), step.begin<float>(), step.end<float>());
    }
    before = std::move(now);
  }
  const auto middle = steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2);
  std::nth_element(steps.begin(), middle, steps.end());
  return static_cast<double>(*middle) / (0.6745 * std::sqrt(2.0));
}

std::string place_text(const Difference& d) {
  const std::string line = text("by %.1f gray near (%d, %d) px", d.gray, d.at.x, d.at.y);
  return line;
}

// The frames that are like the others, and the worst of those that are not.
struct LikeFrames {
  std::vector<const Frame*> used;
  Difference worst;

  LikeFrames(const std::vector<Frame>& frames, bool all) {
    if (all) {
      for (const Frame& frame : frames) used.push_back(&frame);
      return;
    }
    const std::vector<cv::Mat> middle = planes(median_of(frames));
    std::vector<Difference> unlike;
    unlike.reserve(frames.size());
    for (const Frame& frame : frames) unlike.push_back(difference(planes(frame), middle));
    const double limit =
        std::max(kUnlike * block_noise(frames), kLeastUnlike * frames.front().format.max_gray());
    for (size_t i = 0; i < frames.size(); ++i) {
      if (unlike[i].gray <= limit)
        used.push_back(&frames[i]);
      else if (unlike[i].gray > worst.gray)
        worst = unlike[i];
    }
    const size_t left_out = frames.size() - used.size();
    if (2 * used.size() < frames.size() || used.size() < 2)
      throw Error(Failure::Input, "frames in which nothing touches the pad",
                  std::to_string(left_out) + " of " + std::to_string(frames.size()) + " unlike the others, " +
                      place_text(worst),
                  "fewer --frames from the start, or a recording at rest");
  }
};

// The mean to whole gray levels, and how many of its pixels are saturated.
void fill_mean(const std::vector<cv::Mat>& mean, const FrameFormat& f, const Sensor& sensor,
               UntouchedImage& out) {
  out.mean.reshape(f);
  for (uint32_t c = 0; c < f.channels; ++c) {
    for (uint32_t y = 0; y < f.height; ++y)
      for (uint32_t x = 0; x < f.width; ++x)
        out.mean.set(
            c, x, y,
            static_cast<uint32_t>(std::lround(mean[c].at<float>(static_cast<int>(y), static_cast<int>(x)))));
  }
  for (uint32_t y = 0; y < f.height; ++y)
    for (uint32_t x = 0; x < f.width; ++x) {
      bool saturated = false;
      for (uint32_t c = 0; c < f.channels; ++c)
        saturated = saturated || out.mean.at(c, x, y) >= sensor.saturation_gray;
      out.saturated_px += saturated;
    }
}

// The part of a change that counts as touch by the signal, through the filter.
cv::Mat counted_change(const cv::Mat& change, Signal signal, Filter filter) {
  static const cv::Mat binomial = (cv::Mat_<float>(5, 1) << 1 / 16.f, 4 / 16.f, 6 / 16.f, 4 / 16.f, 1 / 16.f);
  cv::Mat counted;
  if (signal == Signal::Either)
    counted = cv::abs(change);
  else
    counted = cv::max(signal == Signal::Darker ? cv::Mat(-change) : change, 0.0);
  if (filter == Filter::Binomial5)
    cv::sepFilter2D(counted, counted, CV_32F, binomial, binomial, {-1, -1}, 0, cv::BORDER_REPLICATE);
  return counted;
}

double largest_counted(const cv::Mat& change, Signal signal, Filter filter) {
  double largest = 0;
  cv::minMaxLoc(counted_change(change, signal, filter), nullptr, &largest);
  return largest;
}

// Noise of a pixel, and the threshold that no frame's change passes by it.
void fill_noise(const std::vector<const Frame*>& used, const std::vector<cv::Mat>& mean, const FrameFormat& f,
                const Sensor& sensor, UntouchedImage& out) {
  double square = 0;
  for (const Frame* frame : used) {
    const std::vector<cv::Mat> now = planes(*frame);
    for (uint32_t c = 0; c < f.channels; ++c) {
      const cv::Mat change = now[c] - mean[c];
      square += cv::norm(change, cv::NORM_L2SQR);
      out.largest_change_gray =
          std::max(out.largest_change_gray, largest_counted(change, sensor.signal, sensor.filter));
    }
  }
  out.noise_gray = std::sqrt(square / (static_cast<double>(f.width) * f.height * f.channels *
                                       (static_cast<double>(used.size()) - 1)));
  out.threshold_gray = threshold_over(out.largest_change_gray);
}

// A change less what is even over the picture, rises across it, or grows with its brightness: light and
// exposure. A touch is what does not fit, so the largest residuals are left out, round by round.
cv::Mat without_light(const cv::Mat& change, const cv::Mat& brightness) {
  constexpr int kEvery = 3, kRounds = 4;
  const auto basis = [&](int y, int x) {
    return cv::Vec4d(1, 2.0 * x / change.cols - 1, 2.0 * y / change.rows - 1,
                     static_cast<double>(brightness.at<float>(y, x)) / 128);
  };
  cv::Vec4d fitted = cv::Vec4d::all(0);
  double limit = std::numeric_limits<double>::infinity();
  for (int round = 0; round < kRounds; ++round) {
    cv::Matx44d gram = cv::Matx44d::zeros();
    cv::Vec4d right = cv::Vec4d::all(0);
    std::vector<double> sizes;
    for (int y = 0; y < change.rows; y += kEvery)
      for (int x = 0; x < change.cols; x += kEvery) {
        const cv::Vec4d b = basis(y, x);
        const double value = static_cast<double>(change.at<float>(y, x)), left = value - fitted.dot(b);
        sizes.push_back(std::abs(left));
        if (std::abs(left) > limit) continue;
        gram += b * b.t();
        right += value * b;
      }
    gram += cv::Matx44d::eye() * (1e-6 * cv::trace(gram));
    fitted = gram.solve(right, cv::DECOMP_CHOLESKY);
    limit = 2.5 * median(sizes) + 1e-3;
  }
  cv::Mat left(change.size(), CV_32F);
  for (int y = 0; y < change.rows; ++y)
    for (int x = 0; x < change.cols; ++x)
      left.at<float>(y, x) = change.at<float>(y, x) - static_cast<float>(fitted.dot(basis(y, x)));
  return left;
}

// From the first third of the frames to the last.
struct Drift {
  Difference largest;
  size_t third = 0;  // frames

  explicit Drift(const std::vector<const Frame*>& used) : third(std::max<size_t>(1, used.size() / 3)) {
    largest = difference(mean_of({used.begin(), used.begin() + static_cast<std::ptrdiff_t>(third)}),
                         mean_of({used.end() - static_cast<std::ptrdiff_t>(third), used.end()}));
  }
  // Largest of many differences of such means that noise alone produces.
  double by_noise(double noise_gray) const {
    return 6 * noise_gray / kBlock * std::sqrt(2.0 / static_cast<double>(third));
  }
};

}  // namespace

UntouchedImage untouched_image(const std::vector<Frame>& frames, const Sensor& sensor, bool chosen) {
  if (frames.size() < 2)
    throw Error(Failure::Input, "two untouched frames or more, to measure the noise",
                std::to_string(frames.size()), "a longer recording, or more --frames");
  const FrameFormat& f = frames.front().format;
  const LikeFrames like(frames, chosen);
  UntouchedImage out;
  out.used = like.used.size();
  out.left_out = frames.size() - like.used.size();
  const std::vector<cv::Mat> mean = mean_of(like.used);
  fill_mean(mean, f, sensor, out);
  fill_noise(like.used, mean, f, sensor, out);
  const Drift drift(like.used);
  out.drift_gray = drift.largest.gray;
  if (out.left_out > 0)
    out.warning = std::to_string(out.left_out) + " of " + std::to_string(frames.size()) +
                  " frames were left out: something touches or moves, " + place_text(like.worst);
  else if (drift.largest.gray > std::max(kLeastUnlike * f.max_gray(), drift.by_noise(out.noise_gray)))
    out.warning = "the image changes from the first to the last frames, " + place_text(drift.largest) +
                  ": light that drifts, or a touch that stays";
  else if (out.saturated_px > 0)
    out.warning = std::to_string(out.saturated_px) + " pixels are saturated without touch";
  return out;
}

double threshold_over(double noise_change_gray) {
  return std::ceil(kNoiseThreshold * std::max(noise_change_gray, 1.0) * 128) / 128;
}

UntouchedImage untouched_picture(const Frame& frame, const Sensor& sensor) {
  UntouchedImage out;
  out.used = 1;
  fill_mean(planes(frame), frame.format, sensor, out);
  return out;
}

double largest_change(const Frame& frame, const Frame& untouched, const Sensor& sensor) {
  const std::vector<cv::Mat> now = planes(frame), rest = planes(untouched);
  double largest = 0;
  for (size_t c = 0; c < now.size(); ++c)
    largest = std::max(largest, largest_counted(now[c] - rest[c], sensor.signal, sensor.filter));
  return largest;
}

ChangeAbove change_above(const Frame& frame, const Frame& untouched, const Sensor& sensor,
                         double threshold_gray) {
  ChangeAbove above;
  const std::vector<cv::Mat> now = planes(frame), rest = planes(untouched);
  std::vector<cv::Mat> changes;
  cv::Mat any, sum;
  for (size_t c = 0; c < now.size(); ++c) {
    changes.push_back(now[c] - rest[c]);
    const cv::Mat over = counted_change(changes[c], sensor.signal, sensor.filter) > threshold_gray;
    any = c == 0 ? over : cv::Mat(any | over);
    sum = c == 0 ? changes[c].clone() : cv::Mat(sum + changes[c]);
  }
  above.pixels = static_cast<uint64_t>(cv::countNonZero(any));
  if (above.pixels == 0) return above;
  const cv::Mat common = sum / static_cast<double>(changes.size());
  const auto total = [&](const cv::Mat& image) {
    return cv::mean(image, any)[0] * static_cast<double>(above.pixels);
  };
  for (const cv::Mat& change : changes) {
    above.upwards += total(cv::max(change, 0.0));
    above.downwards += total(cv::max(cv::Mat(-change), 0.0));
    above.colour += total(cv::abs(change - common));
    above.brightest = std::max(above.brightest, largest_counted(change, Signal::Brighter, sensor.filter));
    above.darkest = std::max(above.darkest, largest_counted(change, Signal::Darker, sensor.filter));
  }
  return above;
}

uint64_t evident_touch_px(const Frame& frame, const Frame& untouched, double threshold_gray) {
  constexpr double kSmooth_px = 1.5, kSurely = 8;
  constexpr float kQuarter = 0.3186f;  // of a normal value's standard deviation, below which a quarter lies
  const std::vector<cv::Mat> now = planes(frame), rest = planes(untouched);
  cv::Mat touched;
  for (size_t c = 0; c < now.size(); ++c) {
    cv::Mat smooth, light;
    cv::GaussianBlur(now[c] - rest[c], smooth, {}, kSmooth_px);
    cv::GaussianBlur(rest[c], light, {}, kSmooth_px);
    const cv::Mat apart = cv::abs(without_light(smooth, light));
    std::vector<float> sizes(apart.begin<float>(), apart.end<float>());
    const auto quarter = sizes.begin() + static_cast<std::ptrdiff_t>(sizes.size() / 4);
    std::nth_element(sizes.begin(), quarter, sizes.end());
    const cv::Mat over = apart > std::max(threshold_gray, kSurely * static_cast<double>(*quarter / kQuarter));
    touched = c == 0 ? over : cv::Mat(touched | over);
  }
  return static_cast<uint64_t>(cv::countNonZero(touched));
}

std::vector<Frame> take_frames(const std::string& input, const Sensor& sensor, uint32_t wanted,
                               uint32_t every, const std::function<bool(uint64_t)>& more) {
  const std::unique_ptr<Source> source = open_source(input, sensor);
  std::vector<Frame> frames;
  Frame frame;
  for (uint64_t n = 0; frames.size() < wanted && source->next(frame); ++n) {
    if (n % std::max(1u, every) != 0) continue;
    Frame own;
    own.reshape(frame.format);
    std::copy_n(frame.pixels(), frame.format.frame_bytes(), own.bytes.data());
    frames.push_back(std::move(own));
    if (!more(frames.size())) break;
  }
  return frames;
}

std::filesystem::path keep_background(const std::filesystem::path& given, const std::filesystem::path& out,
                                      Sensor& sensor) {
  if (given.empty()) return {};
  const std::filesystem::path kept = std::filesystem::absolute(out).parent_path() /
                                     (out.stem().string() + "_background" + given.extension().string());
  std::error_code code;
  if (!std::filesystem::equivalent(given, kept, code)) {
    std::ifstream in(given, std::ios::binary);
    const std::string bytes((std::istreambuf_iterator<char>(in)), {});
    if (!in || bytes.empty())
      throw Error(Failure::Input, "an untouched image in " + given.string(), "nothing that can be read",
                  "another --background");
    write_whole(kept, std::string_view(bytes));
  }
  sensor.background.image = kept.string();
  return kept;
}

Sensor unrectified(Sensor sensor) {
  sensor = for_rectified_frames(std::move(sensor));
  sensor.size_px = {};
  return sensor;
}

}  // namespace palpate
