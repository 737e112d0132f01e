// The synthetic camera: light over the field, noise, and the lights of the gel. Numbers are stated for 8 bit
// and scale with 2^(bits - 8). They are those of a small machine-vision camera behind an edge-lit pad.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "capture/synthetic/options.h"

namespace palpate::optics {

inline constexpr double kFieldWidth_mm = 27.84;  ///< 1392 px of 20 um
inline constexpr double kGrayPerMPa =
    2500;  ///< response at the centre: 1.5 N of the default ball peak near 183 gray
inline constexpr double kResponseLimit_gray = 180;
inline constexpr double kBlack_gray = 8;      ///< camera offset, free of shot noise
inline constexpr double kStray_gray = 30;     ///< stray light beside each LED, decays with 5 mm
inline constexpr double kPattern_gray = 0.5;  ///< fixed pattern, standard deviation
inline constexpr double kFacing_gray = 180;   ///< Lambert mode: a facet that faces the camera
inline constexpr double kFullWell_e = 10000;  ///< electrons at full scale
inline constexpr double kReadNoise_e = 12;
inline constexpr double kLightElevation_rad = 0.7853981633974483;  ///< of the three gel lights
inline constexpr double kGelBrightness =
    0.7;  ///< of a facet that faces one gel light, fraction of full scale
inline constexpr double kGelGradient =
    0.05;  ///< a gel light falls by this fraction from the centre to its far edge

double scale(uint32_t bit_depth);  ///< 2^(bits - 8)
double pitch_mm(const SyntheticOptions& options);

/// Light over the field, at a place in mm from its centre.
class Field {
 public:
  explicit Field(const SyntheticOptions& options);
  double touch(double x_mm, double y_mm) const;       ///< touch light relative to the centre
  double stray_gray(double x_mm, double y_mm) const;  ///< stray light and the camera's offset

 private:
  struct Led {
    double x_mm, y_mm, power;
  };
  double vignette(double x_mm, double y_mm) const;
  std::array<Led, 4> leds_;  // 2 mm outside the middle of each edge, matched to 1 %
  double falloff_per_mm2_;
  double guided_centre_ = 1;
  double scale_;
};

/// Unit vector towards gel light c (red, green, blue at azimuth 90, 210, 330 degrees), in the frame of the
/// normals: n = (d(depth)/dx, d(depth)/dy, 1) normalised.
std::array<double, 3> gel_light(int c);
/// Brightness of gel light c, fraction of full scale, at X, Y in [-1, 1] across the frame.
double gel_brightness(int c, double x, double y);

/// Standard normal deviates by position: two tables read from different offsets and added, so that a row
/// costs two sequential reads and no pair of rows repeats. Mean 0 and variance 1 hold exactly over the
/// tables.
class NormalNoise {
 public:
  NormalNoise();
  /// `width` deviates that depend on the three numbers alone, up to kMaxSide_px.
  void row(uint64_t seed, uint64_t frame, uint64_t row, uint32_t width, float* out) const;

 private:
  const std::vector<float>& first_;
  const std::vector<float>& second_;
};

}  // namespace palpate::optics
