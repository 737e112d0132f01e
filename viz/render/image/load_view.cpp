#include "viz/render/image/load_view.h"

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "capture/files/images/images.h"
#include "engine/stages/surface/elastic.h"

namespace palpate::viz {

LoadMap::LoadMap(gpu::Context& context, uint32_t frames_in_flight)
    : context_(context), uploads_(frames_in_flight + 1) {}

LoadTexels LoadMap::update(const Frame& frame, const Frame& background, const Sensor& sensor) {
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

  return upload({smooth.ptr<float>(), smooth.total()}, static_cast<uint32_t>(smooth.cols),
                static_cast<uint32_t>(smooth.rows));
}

LoadTexels LoadMap::update(const TractionMaps& maps) {
  std::vector<float> values_MPa(maps.pressure_kPa.begin(), maps.pressure_kPa.end());
  for (float& value : values_MPa) value *= 1e-3f;
  largest_MPa_ = values_MPa.empty() ? 0 : double{*std::ranges::max_element(values_MPa)};
  return upload_cells(values_MPa, maps);
}

LoadTexels LoadMap::update_friction(const TractionMaps& maps) {
  return upload_cells(friction_ratios(maps), maps);
}

// Cells are coarser than pixels: drawn between their middles.
LoadTexels LoadMap::upload_cells(std::span<const float> values, const TractionMaps& maps) {
  constexpr int kFiner = 4;
  const bool touched = !values.empty();
  cv::Mat cells(touched ? static_cast<int>(maps.height) : 1, touched ? static_cast<int>(maps.width) : 1,
                CV_32F, cv::Scalar(0));
  std::ranges::copy(values, cells.ptr<float>());
  cv::Mat fine;
  cv::resize(cells, fine, {}, kFiner, kFiner, cv::INTER_LINEAR);
  return upload({fine.ptr<float>(), fine.total()}, static_cast<uint32_t>(fine.cols),
                static_cast<uint32_t>(fine.rows));
}

LoadTexels LoadMap::upload(std::span<const float> values, uint32_t width, uint32_t height) {
  Upload& to = uploads_[next_++ % uploads_.size()];
  if (to.values.bytes() != values.size_bytes()) {
    to.texels = {};
    to.values = gpu::DeviceBuffer(context_, "map of loads", values.size_bytes(), gpu::Memory::Upload);
    to.texels = gpu::TexelView(context_, to.values, VK_FORMAT_R32_SFLOAT);
  }
  std::ranges::copy(values, to.values.as<float>().begin());
  to.values.flush();
  return {&to.texels, width, height};
}

}  // namespace palpate::viz
