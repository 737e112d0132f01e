#include "viz/render/pressure_view.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "capture/files/images/images.h"
#include "engine/stages/elastic.h"

namespace palpate::viz {

PressureMap::PressureMap(gpu::Context& context, uint32_t frames_in_flight)
    : context_(context), uploads_(frames_in_flight + 1) {}

PressureTexels PressureMap::update(const Frame& frame, const Frame& background, const Sensor& sensor) {
  cv::Mat change, smooth;
  const cv::Mat image = to_image(frame);
  // Saturating at zero where touch takes light away.
  if (background.bytes.empty() || sensor.background.kind == BackgroundKind::None) {
    image.convertTo(change, CV_32F);
  } else if (sensor.signal == Signal::Either) {
    cv::absdiff(image, to_image(background), change);
    change.convertTo(change, CV_32F);
  } else {
    const bool brighter = sensor.signal == Signal::Brighter;
    const cv::Mat untouched = to_image(background);
    cv::subtract(brighter ? image : untouched, brighter ? untouched : image, change);
    change.convertTo(change, CV_32F);
  }
  if (frame.format.width > kMostColumns) {
    const double down = static_cast<double>(kMostColumns) / frame.format.width;
    cv::resize(change, change, {}, down, down, cv::INTER_AREA);
  }
  const cv::Mat binomial = (cv::Mat_<float>(1, 5) << 1, 4, 6, 4, 1) / 16.0f;
  cv::sepFilter2D(change, smooth, CV_32F, binomial, binomial, {-1, -1}, 0, cv::BORDER_REPLICATE);

  const ElasticCalibration& pad = sensor.elastic;
  const double limit = pad.limit_gray;
  if (limit > 0) {
    // gray = L (1 - exp(-s p / L)), inverted up to where it still determines the pressure.
    cv::min(smooth, Elastic::largest_readable_gray(pad), smooth);
    smooth = 1 - smooth / limit;
    cv::log(smooth, smooth);
    smooth *= -limit / pad.gray_per_MPa;
  } else {
    smooth *= 1 / pad.gray_per_MPa;
  }
  cv::minMaxLoc(smooth, nullptr, &largest_MPa_);

  Upload& upload = uploads_[next_++ % uploads_.size()];
  const uint64_t bytes = smooth.total() * sizeof(float);
  if (upload.values.bytes() != bytes) {
    upload.texels = {};
    upload.values = gpu::DeviceBuffer(context_, "pressure map", bytes, gpu::Memory::Upload);
    upload.texels = gpu::TexelView(context_, upload.values, VK_FORMAT_R32_SFLOAT);
  }
  std::memcpy(upload.values.as<float>().data(), smooth.ptr<float>(), bytes);
  upload.values.flush();
  return {&upload.texels, static_cast<uint32_t>(smooth.cols), static_cast<uint32_t>(smooth.rows)};
}

}  // namespace palpate::viz
