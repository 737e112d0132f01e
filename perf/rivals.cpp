#include "perf/rivals.h"

#include <fftw3.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>

#include "engine/solve/elastic_convolution.h"

namespace palpate::perf {
namespace {

cv::Mat plane_of(const Frame& frame, uint32_t channel) {
  return {static_cast<int>(frame.format.height), static_cast<int>(frame.format.width),
          frame.format.bit_depth > 8 ? CV_16UC1 : CV_8UC1, const_cast<uint8_t*>(frame.row(channel, 0))};
}

/// g as the sensor defines it: brighter for one plane, the largest change for three.
void change(const Frame& frame, const Frame& background, Signal signal, cv::Mat& out, cv::Mat& work) {
  for (uint32_t channel = 0; channel < frame.format.channels; ++channel) {
    cv::Mat& target = channel == 0 ? out : work;
    const cv::Mat image = plane_of(frame, channel), rest = plane_of(background, channel);
    if (signal == Signal::Brighter) cv::subtract(image, rest, target);
    if (signal == Signal::Darker) cv::subtract(rest, image, target);
    if (signal == Signal::Either) cv::absdiff(image, rest, target);
    if (channel > 0) cv::max(out, work, out);
  }
}

}  // namespace

struct OpenCvContact::Impl {
  Frame background;
  Sensor sensor;
  cv::Mat change8, work8, blurred8, contact8, change32, rest32, blurred32, contact32;
};

OpenCvContact::OpenCvContact(const Frame& background, const Sensor& sensor)
    : impl_(new Impl{background, sensor, {}, {}, {}, {}, {}, {}, {}, {}}) {
  plane_of(background, 0).convertTo(impl_->rest32, CV_32F);
}
OpenCvContact::~OpenCvContact() = default;

double OpenCvContact::run_8bit(const Frame& frame) {
  Impl& m = *impl_;
  change(frame, m.background, m.sensor.signal, m.change8, m.work8);
  cv::GaussianBlur(m.change8, m.blurred8, {5, 5}, 0, 0, cv::BORDER_REPLICATE);
  cv::threshold(m.blurred8, m.contact8, m.sensor.threshold_gray, 0, cv::THRESH_TOZERO);
  return cv::moments(m.contact8).m00;
}

double OpenCvContact::run_float(const Frame& frame) {
  Impl& m = *impl_;
  plane_of(frame, 0).convertTo(m.change32, CV_32F);
  cv::subtract(m.change32, m.rest32, m.change32);
  cv::GaussianBlur(m.change32, m.blurred32, {5, 5}, 0, 0, cv::BORDER_REPLICATE);
  cv::threshold(m.blurred32, m.contact32, m.sensor.threshold_gray, 0, cv::THRESH_TOZERO);
  return cv::moments(m.contact32).m00;
}

struct FftwPoisson::Impl {
  uint32_t width, height, padded_width, padded_height;
  float* work = nullptr;
  fftwf_plan forward = nullptr, backward = nullptr;
  std::vector<float> scale;  // inverse eigenvalues with the transforms' factor
};

FftwPoisson::FftwPoisson(uint32_t width, uint32_t height, uint32_t padded_width, uint32_t padded_height)
    : impl_(new Impl{width, height, padded_width, padded_height, nullptr, nullptr, nullptr, {}}) {
  static const int ready = fftwf_init_threads();
  static_cast<void>(ready);
  fftwf_plan_with_nthreads(2);
  Impl& m = *impl_;
  m.work = fftwf_alloc_real(size_t{padded_width} * padded_height);
  const int rows = static_cast<int>(padded_height), cols = static_cast<int>(padded_width);
  m.forward = fftwf_plan_r2r_2d(rows, cols, m.work, m.work, FFTW_REDFT10, FFTW_REDFT10, FFTW_MEASURE);
  m.backward = fftwf_plan_r2r_2d(rows, cols, m.work, m.work, FFTW_REDFT01, FFTW_REDFT01, FFTW_MEASURE);
  for (uint32_t y = 0; y < padded_height; ++y) {
    for (uint32_t x = 0; x < padded_width; ++x) {
      const double eigenvalue = 4 - 2 * std::cos(std::numbers::pi * x / padded_width) -
                                2 * std::cos(std::numbers::pi * y / padded_height);
      m.scale.push_back(x + y ? static_cast<float>(1 / (eigenvalue * 4.0 * padded_width * padded_height))
                              : 0.0f);
    }
  }
}

FftwPoisson::~FftwPoisson() {
  fftwf_destroy_plan(impl_->forward);
  fftwf_destroy_plan(impl_->backward);
  fftwf_free(impl_->work);
}

void FftwPoisson::solve(const float* right, float* z) {
  Impl& m = *impl_;
  for (uint32_t y = 0; y < m.padded_height; ++y) {
    float* row = m.work + size_t{y} * m.padded_width;
    if (y < m.height) std::copy_n(right + size_t{y} * m.width, m.width, row);
    std::fill(row + (y < m.height ? m.width : 0), row + m.padded_width, 0.0f);
  }
  fftwf_execute(m.forward);
  for (size_t i = 0; i < m.scale.size(); ++i) m.work[i] *= m.scale[i];
  fftwf_execute(m.backward);
  for (uint32_t y = 0; y < m.height; ++y)
    std::copy_n(m.work + size_t{y} * m.padded_width, m.width, z + size_t{y} * m.width);
}

void line_integral(const float* gradients, uint32_t width, uint32_t height, float* z) {
  const auto p = [&](size_t i) { return gradients[2 * i]; };
  const auto q = [&](size_t i) { return gradients[2 * i + 1]; };
  z[0] = 0;
  for (size_t x = 1; x < width; ++x) z[x] = z[x - 1] + (p(x - 1) + p(x)) / 2;
  for (size_t i = width; i < size_t{width} * height; ++i) z[i] = z[i - width] + (q(i - width) + q(i)) / 2;
}

struct FftwElastic::Impl {
  uint32_t width, height, padded_width, padded_height;
  float* work = nullptr;
  fftwf_complex* spectrum = nullptr;
  fftwf_plan forward = nullptr, backward = nullptr;
  std::vector<float> answer;  // of the pad: real, since the answer is even, with the transforms' factor
};

FftwElastic::FftwElastic(const ElasticKernel& kernel, uint32_t width, uint32_t height)
    : impl_(new Impl{width,
                     height,
                     next_good_size(2 * width - 1),
                     next_good_size(2 * height - 1),
                     nullptr,
                     nullptr,
                     nullptr,
                     nullptr,
                     {}}) {
  static const int ready = fftwf_init_threads();
  static_cast<void>(ready);
  fftwf_plan_with_nthreads(2);
  Impl& m = *impl_;
  const size_t pixels = size_t{m.padded_width} * m.padded_height;
  const size_t waves = size_t{m.padded_width / 2 + 1} * m.padded_height;
  m.work = fftwf_alloc_real(pixels);
  m.spectrum = fftwf_alloc_complex(waves);
  const int rows = static_cast<int>(m.padded_height), cols = static_cast<int>(m.padded_width);
  m.forward = fftwf_plan_dft_r2c_2d(rows, cols, m.work, m.spectrum, FFTW_MEASURE);
  m.backward = fftwf_plan_dft_c2r_2d(rows, cols, m.spectrum, m.work, FFTW_MEASURE);
  for (uint32_t y = 0; y < m.padded_height; ++y) {
    for (uint32_t x = 0; x < m.padded_width; ++x) {
      const uint32_t dx = std::min(x, m.padded_width - x), dy = std::min(y, m.padded_height - y);
      m.work[size_t{y} * m.padded_width + x] =
          static_cast<float>(kernel.at(dx, dy) / static_cast<double>(pixels));
    }
  }
  fftwf_execute(m.forward);
  for (size_t i = 0; i < waves; ++i) m.answer.push_back(m.spectrum[i][0]);
}

FftwElastic::~FftwElastic() {
  fftwf_destroy_plan(impl_->forward);
  fftwf_destroy_plan(impl_->backward);
  fftwf_free(impl_->work);
  fftwf_free(impl_->spectrum);
}

void FftwElastic::solve(const float* pressure, float* deflection) {
  Impl& m = *impl_;
  for (uint32_t y = 0; y < m.padded_height; ++y) {
    float* row = m.work + size_t{y} * m.padded_width;
    if (y < m.height) std::copy_n(pressure + size_t{y} * m.width, m.width, row);
    std::fill(row + (y < m.height ? m.width : 0), row + m.padded_width, 0.0f);
  }
  fftwf_execute(m.forward);
  for (size_t i = 0; i < m.answer.size(); ++i) {
    m.spectrum[i][0] *= m.answer[i];
    m.spectrum[i][1] *= m.answer[i];
  }
  fftwf_execute(m.backward);
  for (uint32_t y = 0; y < m.height; ++y)
    std::copy_n(m.work + size_t{y} * m.padded_width, m.width, deflection + size_t{y} * m.width);
}

struct OpenCvFftwFrame::Impl {
  Impl(const Frame& rest, const Sensor& with, uint32_t padded_width, uint32_t padded_height)
      : background(rest),
        sensor(with),
        poisson(rest.format.width, rest.format.height, padded_width, padded_height) {}
  Frame background;
  Sensor sensor;
  FftwPoisson poisson;
  cv::Mat change8, work8, blurred8, contact8, gray, dx, dy, p, q;
  std::vector<float> right, z;
};

OpenCvFftwFrame::OpenCvFftwFrame(const Frame& background, const Sensor& sensor, uint32_t padded_width,
                                 uint32_t padded_height)
    : impl_(std::make_unique<Impl>(background, sensor, padded_width, padded_height)) {}
OpenCvFftwFrame::~OpenCvFftwFrame() = default;

double OpenCvFftwFrame::run(const Frame& frame) {
  Impl& m = *impl_;
  const int width = static_cast<int>(frame.format.width), height = static_cast<int>(frame.format.height);
  change(frame, m.background, m.sensor.signal, m.change8, m.work8);
  cv::GaussianBlur(m.change8, m.blurred8, {5, 5}, 0, 0, cv::BORDER_REPLICATE);
  cv::threshold(m.blurred8, m.contact8, m.sensor.threshold_gray, 0, cv::THRESH_TOZERO);
  const double sum = cv::moments(m.contact8).m00;

  m.p.create(height, width, CV_32F);
  m.q.create(height, width, CV_32F);
  const auto max_slope = static_cast<float>(m.sensor.max_slope);
  if (m.sensor.reading == Reading::Shading) {
    m.blurred8.convertTo(m.gray, CV_32F);
    cv::Sobel(m.gray, m.dx, CV_32F, 1, 0, 3, 1, 0, cv::BORDER_REPLICATE);
    cv::Sobel(m.gray, m.dy, CV_32F, 0, 1, 3, 1, 0, cv::BORDER_REPLICATE);
    const auto facing = static_cast<float>(m.sensor.shading.facing_gray),
               gain = static_cast<float>(m.sensor.shading.depth_gain);
    const auto threshold = static_cast<float>(m.sensor.threshold_gray);
    for (int y = 0; y < height; ++y) {
      const float *g = m.gray.ptr<float>(y), *dx = m.dx.ptr<float>(y), *dy = m.dy.ptr<float>(y);
      float *p = m.p.ptr<float>(y), *q = m.q.ptr<float>(y);
      for (int x = 0; x < width; ++x) {
        const float ratio = facing / std::max(g[x], 1e-6f);
        float tangent = std::min(std::sqrt(std::max(ratio * ratio - 1.0f, 0.0f)), max_slope) * gain;
        tangent = g[x] < threshold ? 0.0f : tangent;
        const float scale = tangent / std::max(std::sqrt(dx[x] * dx[x] + dy[x] * dy[x]), 1e-6f);
        p[x] = scale * dx[x];
        q[x] = scale * dy[x];
      }
    }
  } else {
    float wx[3][3], wy[3][3];
    for (size_t c = 0; c < 3; ++c) {
      for (size_t t = 0; t < 3; ++t) {
        wx[c][t] = static_cast<float>(m.sensor.photometric.wx[c][t]) / 255.0f;
        wy[c][t] = static_cast<float>(m.sensor.photometric.wy[c][t]) / 255.0f;
      }
    }
    const float steepest = max_slope * max_slope / (1 + max_slope * max_slope);
    for (int y = 0; y < height; ++y) {
      const auto row = static_cast<uint32_t>(y);
      const uint8_t* image[3] = {frame.row(0, row), frame.row(1, row), frame.row(2, row)};
      const uint8_t* rest[3] = {m.background.row(0, row), m.background.row(1, row), m.background.row(2, row)};
      const float ty = (2.0f * static_cast<float>(y) + 1) / static_cast<float>(height) - 1;
      float *p = m.p.ptr<float>(y), *q = m.q.ptr<float>(y);
      for (int x = 0; x < width; ++x) {
        const float tx = (2.0f * static_cast<float>(x) + 1) / static_cast<float>(width) - 1;
        float nx = 0, ny = 0;
        for (int c = 0; c < 3; ++c) {
          const auto d = static_cast<float>(image[c][x] - rest[c][x]);
          nx += (wx[c][0] + wx[c][1] * tx + wx[c][2] * ty) * d;
          ny += (wy[c][0] + wy[c][1] * tx + wy[c][2] * ty) * d;
        }
        const float inverse = 1 / std::sqrt(std::max(1 - nx * nx - ny * ny, 1 - steepest));
        p[x] = nx * inverse;
        q[x] = ny * inverse;
      }
    }
  }

  // Trapezoid across each pair of neighbours, divergence with natural boundary.
  const auto scale = static_cast<float>(m.sensor.pitch_mm_per_px) / 2;
  m.right.resize(size_t(width) * size_t(height));
  m.z.resize(m.right.size());
  for (int y = 0; y < height; ++y) {
    const float *p = m.p.ptr<float>(y), *q = m.q.ptr<float>(y);
    const float *up = m.q.ptr<float>(std::max(y - 1, 0)), *down = m.q.ptr<float>(std::min(y + 1, height - 1));
    const float has_up = y > 0, has_down = y + 1 < height;
    float* f = m.right.data() + size_t(y) * size_t(width);
    for (int x = 1; x + 1 < width; ++x)
      f[x] = scale * (p[x - 1] - p[x + 1] + has_up * (up[x] + q[x]) - has_down * (q[x] + down[x]));
    const int last = width - 1;
    f[0] = scale * (-p[0] - p[std::min(1, last)] + has_up * (up[0] + q[0]) - has_down * (q[0] + down[0]));
    f[last] = scale * (p[std::max(last - 1, 0)] + p[last] + has_up * (up[last] + q[last]) -
                       has_down * (q[last] + down[last]));
  }
  m.poisson.solve(m.right.data(), m.z.data());
  return sum + static_cast<double>(m.z[0]);
}

}  // namespace palpate::perf
