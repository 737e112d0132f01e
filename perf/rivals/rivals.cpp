#include "perf/rivals/rivals.h"

#include <fftw3.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>

#include "engine/base/text.h"
#include "engine/numeric/transform/lane_fft.h"
#include "palpate/error.h"

namespace palpate::perf {
namespace {

// OpenCV's thresholds keep what is above, ours what reaches them. Filtered values are multiples of 1/256
// gray.
constexpr double kBelow = 1.0 / 512;

// The plain loops get what the libraries have: the widest vectors of the machine that runs them.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
#define PALPATE_WIDEST __attribute__((target_clones("arch=haswell", "default")))
#else
#define PALPATE_WIDEST
#endif

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

double opencv_moments(const Frame& frame) {
  return cv::moments(plane_of(frame, 0)).m00;
}

double opencv_lookup(const Frame& frame, const Frame& background) {
  cv::Mat change, smooth, depth;
  cv::subtract(plane_of(frame, 0), plane_of(background, 0), change);
  cv::GaussianBlur(change, smooth, {5, 5}, 1.0);
  static const cv::Mat table = [] {
    cv::Mat t(1, 256, CV_32F);
    for (int g = 0; g < 256; ++g) t.at<float>(g) = std::sqrt(static_cast<float>(g)) / 10;
    return t;
  }();
  cv::LUT(smooth, table, depth);
  double deepest = 0;
  cv::minMaxLoc(depth, nullptr, &deepest);
  return deepest + cv::moments(smooth).m00;
}

struct OpenCvContact::Impl {
  Frame background;
  Sensor sensor;
  cv::Mat change8, work8, blurred8, contact8, change32, rest32, blurred32, mask32;
  double area = 0;
  cv::Mat mask8, labels, stats, centers;
};

OpenCvContact::OpenCvContact(const Frame& background, const Sensor& sensor)
    : impl_(new Impl{background, sensor, {}, {}, {}, {}, {}, {}, {}, {}, 0, {}, {}, {}, {}}) {
  plane_of(background, 0).convertTo(impl_->rest32, CV_32F);
}
OpenCvContact::~OpenCvContact() = default;

double OpenCvContact::run_8bit(const Frame& frame) {
  Impl& m = *impl_;
  change(frame, m.background, m.sensor.signal, m.change8, m.work8);
  cv::GaussianBlur(m.change8, m.blurred8, {5, 5}, 0, 0, cv::BORDER_REPLICATE);
  cv::threshold(m.blurred8, m.contact8, m.sensor.threshold_gray - kBelow, 0, cv::THRESH_TOZERO);
  return cv::moments(m.contact8).m00;
}

double OpenCvContact::run_regions(const Frame& frame) {
  Impl& m = *impl_;
  run_8bit(frame);
  cv::threshold(m.contact8, m.mask8, 0, 255, cv::THRESH_BINARY);
  return cv::connectedComponentsWithStats(m.mask8, m.labels, m.stats, m.centers, 8) - 1;
}

double OpenCvContact::run_float(const Frame& frame) {
  Impl& m = *impl_;
  plane_of(frame, 0).convertTo(m.change32, CV_32F);
  cv::subtract(m.change32, m.rest32, m.change32);
  cv::GaussianBlur(m.change32, m.blurred32, {5, 5}, 0, 0, cv::BORDER_REPLICATE);
  cv::threshold(m.blurred32, m.mask32, m.sensor.threshold_gray - kBelow, 1, cv::THRESH_BINARY);
  cv::multiply(m.blurred32, m.mask32, m.blurred32);
  m.area = cv::moments(m.mask32).m00;
  return cv::moments(m.blurred32).m00;
}

double OpenCvContact::area_px() const {
  return impl_->area;
}

Frame OpenCvContact::contact_8bit() const {
  const cv::Mat& image = impl_->contact8;
  Frame frame;
  frame.reshape({static_cast<uint32_t>(image.cols), static_cast<uint32_t>(image.rows), 1, 8});
  for (uint32_t y = 0; y < frame.format.height; ++y)
    std::copy_n(image.ptr<uint8_t>(static_cast<int>(y)), image.cols, frame.row(0, y));
  return frame;
}

double OpenCvContact::moments_8bit() const {
  return cv::moments(impl_->contact8).m00;
}

namespace {
/// The frame in a plan's work space, zeros around it.
template <typename Impl>
void pad(Impl& m, const float* frame) {
  for (uint32_t y = 0; y < m.padded_height; ++y) {
    float* row = m.work + size_t{y} * m.padded_width;
    if (y < m.height) std::copy_n(frame + size_t{y} * m.width, m.width, row);
    std::fill(row + (y < m.height ? m.width : 0), row + m.padded_width, 0.0f);
  }
}
}  // namespace

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
  pad(m, right);
  fftwf_execute(m.forward);
  for (size_t i = 0; i < m.scale.size(); ++i) m.work[i] *= m.scale[i];
  fftwf_execute(m.backward);
  for (uint32_t y = 0; y < m.height; ++y)
    std::copy_n(m.work + size_t{y} * m.padded_width, m.width, z + size_t{y} * m.width);
}

struct FftwElastic::Impl {
  uint32_t width, height, padded_width, padded_height;
  float* work = nullptr;
  fftwf_complex* spectrum = nullptr;
  fftwf_plan forward = nullptr, backward = nullptr;
  std::vector<float> answer;  // of the pad: real, since the answer is even, with the transforms' factor
};

FftwElastic::FftwElastic(const LayerKernel& kernel, uint32_t width, uint32_t height)
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
          static_cast<float>(kernel.depth(dx, dy) / static_cast<double>(pixels));
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
  pad(m, pressure);
  fftwf_execute(m.forward);
  for (size_t i = 0; i < m.answer.size(); ++i) {
    m.spectrum[i][0] *= m.answer[i];
    m.spectrum[i][1] *= m.answer[i];
  }
  fftwf_execute(m.backward);
  for (uint32_t y = 0; y < m.height; ++y)
    std::copy_n(m.work + size_t{y} * m.padded_width, m.width, deflection + size_t{y} * m.width);
}

namespace {

PALPATE_WIDEST void shade_row(const uint8_t* gray, const int16_t* dx, const int16_t* dy, float facing,
                              float threshold, float max_slope, float gain, int width, float* p, float* q) {
  for (int x = 0; x < width; ++x) {
    const float g = gray[x], gx = dx[x], gy = dy[x];
    const float ratio = facing / std::max(g, 1e-6f);
    float tangent = std::min(std::sqrt(std::max(ratio * ratio - 1.0f, 0.0f)), max_slope) * gain;
    tangent = g < threshold ? 0.0f : tangent;
    const float scale = tangent / std::max(std::sqrt(gx * gx + gy * gy), 1e-6f);
    p[x] = scale * gx;
    q[x] = scale * gy;
  }
}

struct Photometric {
  float wx[3][3], wy[3][3];  // [channel][1, X, Y], for a change of one gray level
  float steepest;            // largest squared sine of the slope
};

PALPATE_WIDEST void photometric_row(const uint8_t* const image[3], const uint8_t* const rest[3],
                                    const Photometric& c, float ty, int width, float* p, float* q) {
  const uint8_t *red = image[0], *green = image[1], *blue = image[2];
  const uint8_t *red0 = rest[0], *green0 = rest[1], *blue0 = rest[2];
  const float step = 2.0f / static_cast<float>(width), lowest = 1 - c.steepest;
  // Weights at this row, as constant and slope along it.
  float ax[3], bx[3], ay[3], by[3];
  for (int i = 0; i < 3; ++i) {
    ax[i] = c.wx[i][0] + c.wx[i][2] * ty;
    bx[i] = c.wx[i][1];
    ay[i] = c.wy[i][0] + c.wy[i][2] * ty;
    by[i] = c.wy[i][1];
  }
  for (int x = 0; x < width; ++x) {
    const float tx = (static_cast<float>(x) + 0.5f) * step - 1;
    const auto d0 = static_cast<float>(red[x] - red0[x]), d1 = static_cast<float>(green[x] - green0[x]),
               d2 = static_cast<float>(blue[x] - blue0[x]);
    const float nx = (ax[0] + bx[0] * tx) * d0 + (ax[1] + bx[1] * tx) * d1 + (ax[2] + bx[2] * tx) * d2;
    const float ny = (ay[0] + by[0] * tx) * d0 + (ay[1] + by[1] * tx) * d1 + (ay[2] + by[2] * tx) * d2;
    const float inverse = 1 / std::sqrt(std::max(1 - nx * nx - ny * ny, lowest));
    p[x] = nx * inverse;
    q[x] = ny * inverse;
  }
}

// Divergence of one row with natural boundary, trapezoids across each pair of neighbours.
PALPATE_WIDEST void right_side_row(const float* p, const float* up, const float* q, const float* down,
                                   bool has_up, bool has_down, float scale, int width, float* f) {
  const float above = has_up ? scale : 0, below = has_down ? scale : 0;
  for (int x = 1; x + 1 < width; ++x)
    f[x] = scale * (p[x - 1] - p[x + 1]) + above * (up[x] + q[x]) - below * (q[x] + down[x]);
  const int last = width - 1;
  if (last == 0) {
    f[0] = above * (up[0] + q[0]) - below * (q[0] + down[0]);
    return;
  }
  f[0] = scale * (-p[0] - p[1]) + above * (up[0] + q[0]) - below * (q[0] + down[0]);
  f[last] = scale * (p[last - 1] + p[last]) + above * (up[last] + q[last]) - below * (q[last] + down[last]);
}

}  // namespace

struct OpenCvFftwFrame::Impl {
  Impl(const Frame& rest, const Sensor& with, uint32_t padded_width, uint32_t padded_height)
      : background(rest),
        sensor(with),
        poisson(rest.format.width, rest.format.height, padded_width, padded_height) {}
  Frame background;
  Sensor sensor;
  FftwPoisson poisson;
  cv::Mat change8, work8, blurred8, contact8, dx, dy, p, q;
  std::vector<float> right, z;
};

OpenCvFftwFrame::OpenCvFftwFrame(const Frame& background, const Sensor& sensor, uint32_t padded_width,
                                 uint32_t padded_height)
    : impl_(std::make_unique<Impl>(background, sensor, padded_width, padded_height)) {
  const NormalWeights& weights = sensor.photometric.wx;
  if (sensor.reading == SurfaceReading::Photometric && (weights.size() != 3 || weights.front().size() != 3))
    throw Error(Failure::Sensor, "3 rows of 3 weights for OpenCV + FFTW",
                text("%zu rows of %zu", weights.size(), weights.front().size()),
                "a sensor with weights linear in place");
}
OpenCvFftwFrame::~OpenCvFftwFrame() = default;

double OpenCvFftwFrame::run(const Frame& frame) {
  Impl& m = *impl_;
  const int width = static_cast<int>(frame.format.width), height = static_cast<int>(frame.format.height);
  change(frame, m.background, m.sensor.signal, m.change8, m.work8);
  cv::GaussianBlur(m.change8, m.blurred8, {5, 5}, 0, 0, cv::BORDER_REPLICATE);
  cv::threshold(m.blurred8, m.contact8, m.sensor.threshold_gray - kBelow, 0, cv::THRESH_TOZERO);
  const double sum = cv::moments(m.contact8).m00;

  m.p.create(height, width, CV_32F);
  m.q.create(height, width, CV_32F);
  const auto max_slope = static_cast<float>(m.sensor.max_slope);
  if (m.sensor.reading == SurfaceReading::Shading) {
    cv::Sobel(m.blurred8, m.dx, CV_16S, 1, 0, 3, 1, 0, cv::BORDER_REPLICATE);
    cv::Sobel(m.blurred8, m.dy, CV_16S, 0, 1, 3, 1, 0, cv::BORDER_REPLICATE);
    const auto facing = static_cast<float>(m.sensor.shading.facing_gray),
               gain = static_cast<float>(m.sensor.shading.depth_gain);
    const auto threshold = static_cast<float>(m.sensor.threshold_gray);
    for (int y = 0; y < height; ++y)
      shade_row(m.blurred8.ptr<uint8_t>(y), m.dx.ptr<int16_t>(y), m.dy.ptr<int16_t>(y), facing, threshold,
                max_slope, gain, width, m.p.ptr<float>(y), m.q.ptr<float>(y));
  } else {
    Photometric c{};
    for (size_t i = 0; i < 3; ++i) {
      for (size_t t = 0; t < 3; ++t) {
        c.wx[i][t] = static_cast<float>(m.sensor.photometric.wx[i][t]) / 255.0f;
        c.wy[i][t] = static_cast<float>(m.sensor.photometric.wy[i][t]) / 255.0f;
      }
    }
    c.steepest = max_slope * max_slope / (1 + max_slope * max_slope);
    for (int y = 0; y < height; ++y) {
      const auto row = static_cast<uint32_t>(y);
      const uint8_t* image[3] = {frame.row(0, row), frame.row(1, row), frame.row(2, row)};
      const uint8_t* rest[3] = {m.background.row(0, row), m.background.row(1, row), m.background.row(2, row)};
      const float ty = (2.0f * static_cast<float>(y) + 1) / static_cast<float>(height) - 1;
      photometric_row(image, rest, c, ty, width, m.p.ptr<float>(y), m.q.ptr<float>(y));
    }
  }

  const auto scale = static_cast<float>(m.sensor.pitch_mm_per_px) / 2;
  m.right.resize(size_t(width) * size_t(height));
  m.z.resize(m.right.size());
  for (int y = 0; y < height; ++y) {
    right_side_row(m.p.ptr<float>(y), m.q.ptr<float>(std::max(y - 1, 0)), m.q.ptr<float>(y),
                   m.q.ptr<float>(std::min(y + 1, height - 1)), y > 0, y + 1 < height, scale, width,
                   m.right.data() + size_t(y) * size_t(width));
  }
  m.poisson.solve(m.right.data(), m.z.data());
  return sum + static_cast<double>(m.z[0]);
}

const std::vector<float>& OpenCvFftwFrame::heights_mm() const {
  return impl_->z;
}

}  // namespace palpate::perf
