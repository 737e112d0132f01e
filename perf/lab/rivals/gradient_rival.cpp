#include "perf/lab/rivals/gradient_rival.h"

#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

namespace palpate::perf {

double OpenCvGradient::run(const Frame& frame, double limit_gray_per_px) const {
  constexpr double kUnits = 128;  // of Sobel's 5 x 5, to one gray level per px
  const auto rows = static_cast<int>(frame.format.height), columns = static_cast<int>(frame.format.width);
  const auto plane = [&](const Frame& of, uint32_t channel) {
    return cv::Mat(rows, columns, CV_8U,
                   const_cast<uint8_t*>(of.pixels()) + channel * of.format.plane_bytes());
  };
  cv::Mat change, across, down, wide, squares = cv::Mat::zeros(rows, columns, CV_32F);
  for (uint32_t channel = 0; channel < frame.format.channels; ++channel) {
    cv::subtract(plane(frame, channel), plane(rest_, channel), change, cv::noArray(), CV_16S);
    cv::Sobel(change, across, CV_16S, 1, 0, 5, 1, 0, cv::BORDER_REPLICATE);
    cv::Sobel(change, down, CV_16S, 0, 1, 5, 1, 0, cv::BORDER_REPLICATE);
    for (const cv::Mat* slope : {&across, &down}) {
      slope->convertTo(wide, CV_32F);
      cv::accumulateSquare(wide, squares);
    }
  }
  cv::sqrt(squares, squares);
  cv::subtract(squares, cv::Scalar(limit_gray_per_px * kUnits), squares);
  cv::max(squares, 0, squares);
  return cv::sum(squares)[0] / kUnits;
}

}  // namespace palpate::perf
