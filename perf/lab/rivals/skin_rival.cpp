#include "perf/lab/rivals/skin_rival.h"

#include <limits>
#include <opencv2/core.hpp>
#include <opencv2/video/tracking.hpp>

namespace palpate::perf {
namespace {

cv::Mat gray(const Frame& frame) {
  const int w = static_cast<int>(frame.format.width), h = static_cast<int>(frame.format.height);
  const auto plane = [&](uint32_t c) {
    return cv::Mat(h, w, CV_8UC1, const_cast<uint8_t*>(frame.row(c, 0)));
  };
  if (frame.format.channels == 1) return plane(0);
  cv::Mat sum;
  cv::addWeighted(plane(0), 1.0 / 3, plane(1), 1.0 / 3, 0, sum);
  cv::addWeighted(sum, 1, plane(2), 1.0 / 3, 0, sum);
  return sum;
}

}  // namespace

struct OpenCvSkin::Impl {
  cv::Mat rest;
  std::vector<cv::Point2f> from, to;
  std::vector<uint8_t> found;
  std::vector<float> error;
  int side_px = 0;
  std::vector<std::array<float, 2>> places;
};

OpenCvSkin::OpenCvSkin(const Frame& untouched, const std::vector<std::array<float, 2>>& points, int side_px)
    : impl_(std::make_unique<Impl>()) {
  impl_->rest = gray(untouched).clone();
  for (const auto& p : points) impl_->from.emplace_back(p[0], p[1]);
  impl_->to = impl_->from;
  impl_->side_px = side_px;
  impl_->places.resize(points.size());
}
OpenCvSkin::~OpenCvSkin() = default;

const std::vector<std::array<float, 2>>& OpenCvSkin::follow(const Frame& frame) {
  constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
  cv::calcOpticalFlowPyrLK(impl_->rest, gray(frame), impl_->from, impl_->to, impl_->found, impl_->error,
                           cv::Size(impl_->side_px, impl_->side_px), 1,
                           cv::TermCriteria(cv::TermCriteria::COUNT | cv::TermCriteria::EPS, 20, 0.01),
                           cv::OPTFLOW_USE_INITIAL_FLOW);
  for (size_t i = 0; i < impl_->places.size(); ++i)
    impl_->places[i] = impl_->found[i] ? std::array<float, 2>{impl_->to[i].x, impl_->to[i].y}
                                       : std::array<float, 2>{kNaN, kNaN};
  return impl_->places;
}

}  // namespace palpate::perf
