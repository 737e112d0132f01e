// Reference implementations with other libraries: OpenCV on the CPU, FFTW for the surface.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "engine/pad/layer_kernel.h"
#include "palpate/frame.h"
#include "palpate/sensor.h"

namespace palpate::perf {

/// cv::moments of one plane of pixels, nothing before it. Returns the gray sum.
double opencv_moments(const Frame& frame);
/// Difference, 5 x 5 Gaussian, depth by a table over whole gray levels, deepest point and moments; 8 bits.
double opencv_lookup(const Frame& frame, const Frame& background);

/// Force and centroid with OpenCV, frame by frame.
class OpenCvContact {
 public:
  OpenCvContact(const Frame& background, const Sensor& sensor);
  ~OpenCvContact();
  /// subtract, GaussianBlur 5x5, threshold to zero, moments; 8 bits throughout. Returns the gray sum.
  double run_8bit(const Frame& frame);
  /// As run_8bit, and the connected regions (8 neighbours) of the contact with area, box and centroid each.
  /// Returns how many there are.
  double run_regions(const Frame& frame);
  /// In single precision: convertTo, subtract, GaussianBlur 5x5, threshold to a mask of 0 and 1, multiply by
  /// it, moments of the product and of the mask. Returns the gray sum.
  double run_float(const Frame& frame);
  /// Contact pixels of the last run_float.
  double area_px() const;
  /// Results of run_8bit: the filtered image, 0 without contact, and its moments once more. For timing these
  /// alone.
  double moments_8bit() const;
  Frame contact_8bit() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Poisson with natural boundary by FFTW in single precision, planned by measurement, two threads.
class FftwPoisson {
 public:
  /// `padded_*`: transform size; the frame's size, or a larger one with only small prime factors.
  FftwPoisson(uint32_t width, uint32_t height, uint32_t padded_width, uint32_t padded_height);
  ~FftwPoisson();
  FftwPoisson(const FftwPoisson&) = delete;
  FftwPoisson& operator=(const FftwPoisson&) = delete;
  void solve(const float* right, float* z);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Pressure to deflection by FFTW in single precision: zero-padded to at least twice the frame, planned by
/// measurement, two threads.
class FftwElastic {
 public:
  FftwElastic(const LayerKernel& kernel, uint32_t width, uint32_t height);
  ~FftwElastic();
  FftwElastic(const FftwElastic&) = delete;
  FftwElastic& operator=(const FftwElastic&) = delete;
  void solve(const float* pressure, float* deflection);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// The whole frame: OpenCV for the contact, plain loops for slope and divergence, FFTW for the surface.
class OpenCvFftwFrame {
 public:
  OpenCvFftwFrame(const Frame& background, const Sensor& sensor, uint32_t padded_width,
                  uint32_t padded_height);
  ~OpenCvFftwFrame();
  double run(const Frame& frame);
  /// Heights of the last run, height x width, up to a constant.
  const std::vector<float>& heights_mm() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace palpate::perf
