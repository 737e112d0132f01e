// One sensor's calibration as plain data: a JSON file, see README.md for a commented example.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "engine/frame.h"
#include "engine/pad_outline.h"

namespace palpate {

/// How touch changes a pixel relative to the background (untouched) image.
enum class Signal {
  Brighter,  ///< waveguide: glows where pressed; g = max(0, image - background)
  Darker,    ///< ink or translucent gel: g = max(0, background - image)
  Either,    ///< colour gel: g = |image - background|, the largest of the channels
};

/// What smooths the change before threshold and sums.
enum class Filter {
  Binomial5,  ///< 5 x 5 binomial, weights 1 4 6 4 1
  None,       ///< for frames without noise, or smoothed by the camera; no reading of one gray image
};

/// How an image becomes a surface (theory S7).
enum class Reading {
  None,         ///< the sensor measures contact and force only
  Shading,      ///< one gray image, Lambertian, light along the viewing axis (the paper, Eq. 61-63)
  Photometric,  ///< three coloured lights, linear per-pixel calibration from known normals
  Elastic,      ///< one gray image of contact pressure, convolved with the pad's answer to a load
};

/// Gray sum to normal force, F = c1 G + c0 (Eq. 54), with the covariance of the fit.
struct ForceCalibration {
  double c1_N_per_gray = 0;
  double c0_N = 0;
  double residual_sd_N = 0;            ///< scatter of single readings about the line
  std::array<double, 3> covariance{};  ///< var(c0), cov(c0, c1), var(c1)
  double gray_min = 0;                 ///< calibrated range of G
  double gray_max = 0;
};

/// Centroid shift to tangential force, F = K u (Eq. 59-60), limited by friction.
struct ShearCalibration {
  double kx_N_per_mm = 0;
  double ky_N_per_mm = 0;
  double friction = 0;     ///< Coulomb coefficient: slip when |F_t| >= friction * F_z
  double relative_sd = 0;  ///< relative standard error of K
};

/// Brightness to slope, for Reading::Shading: cos(slope angle) = gray / facing_gray.
struct ShadingCalibration {
  double facing_gray = 0;  ///< filtered gray of a facet that faces the light, gray levels
  double depth_gain = 1;   ///< scale on the slopes, from a ball of known radius; 1 is the paper's reading
};

/// Colour change to normal, for Reading::Photometric. With c over red, green, blue, dI_c the change of
/// channel c from the background in units of full scale, and X, Y in [-1, 1] across the frame (pixel centres,
/// right and down):
///   n_x = sum_c (wx[c][0] + wx[c][1] X + wx[c][2] Y) dI_c,  likewise n_y,  n_z = sqrt(1 - n_x^2 - n_y^2),
/// and d(depth)/dx = n_x / n_z, d(depth)/dy = n_y / n_z: n points into the pad where depth grows along +x.
struct PhotometricCalibration {
  std::array<std::array<double, 3>, 3> wx{};
  std::array<std::array<double, 3>, 3> wy{};
  double normal_sd = 0;  ///< RMS error of (n_x, n_y) on held-out presses
};

/// Brightness to contact pressure, and the pad that answers it, for Reading::Elastic: gray = gray_per_MPa *
/// p, or with a limit gray = limit_gray (1 - exp(-gray_per_MPa p / limit_gray)).
struct ElasticCalibration {
  double gray_per_MPa = 0;  ///< filtered gray per contact pressure, for small pressures
  double limit_gray = 0;    ///< that no pressure exceeds; 0: the response is linear
  double young_MPa = 0;     ///< of the pad
  double poisson = 0.5;     ///< 0 to 0.5
  double thickness_mm = 0;  ///< of a pad bonded to a rigid base; 0: a half space
  double relative_sd = 0;   ///< relative standard error of gray_per_MPa times young_MPa, hence of depths
};

/// Whether there is an untouched image to subtract.
enum class BackgroundKind {
  Untouched,  ///< subtracted from every frame
  None,       ///< frames hold the change already: nothing is subtracted, and no image is kept for it
};

/// Where the untouched image comes from.
struct BackgroundSource {
  BackgroundKind kind = BackgroundKind::Untouched;
  std::string image;  ///< in the file relative to it, absolute once loaded; empty: from the recording itself
  uint32_t first_frames = 1;  ///< without an image: mean of that many first frames
};

struct Sensor {
  std::string name;
  double pitch_mm_per_px = 0;  ///< of the rectified frame, square pixels; NaN: not known, see has_scale

  // From the camera's image to the rectified frame.
  std::optional<std::array<uint32_t, 4>> crop_px;  ///< x, y, width, height, applied first
  std::optional<std::array<std::array<double, 2>, 4>>
      quad_px;                        ///< corners top left, top right, bottom right, bottom left (after crop)
  std::array<uint32_t, 2> size_px{};  ///< width, height of the rectified frame; needed with quad_px
  uint32_t channels = 1;              ///< what the engine gets: 1 (colour input is turned gray) or 3
  uint32_t bit_depth = 8;             ///< of the pixel values, 8 to 16

  BackgroundSource background;

  Signal signal = Signal::Brighter;
  Filter filter = Filter::Binomial5;
  double threshold_gray = 4;  ///< filtered gray from which a pixel belongs to the contact, in steps of 1/128
  uint32_t saturation_gray = 255;  ///< raw pixels from here on are saturated

  Reading reading = Reading::None;
  ShadingCalibration shading;
  PhotometricCalibration photometric;
  ElasticCalibration elastic;
  double max_slope = 10;  ///< slopes steeper than this are clipped
  /// Brightest channel, gray levels, up to which a pixel is too dark to carry a slope; from there to twice
  /// that it counts in part.
  std::optional<uint32_t> shadow_gray;
  std::optional<PadOutline> pad;  ///< what lies beyond is not known; none: the whole frame is pad

  std::optional<ForceCalibration> force;
  std::optional<ShearCalibration> shear;
};

/// False for a camera of which nothing is known yet: areas and places are in px only, lengths are NaN.
bool has_scale(const Sensor& sensor);
/// A camera of which nothing is known but its format: contact is what changes against the first frames by
/// more than 2 % of full scale; no scale, no calibration, no surface.
Sensor uncalibrated_sensor(const FrameFormat& format);

/// The sensor's own, or what is sensible for its reading: 2 % of full scale for Reading::Photometric, whose
/// slopes come from brightness; otherwise 0, nothing, since a dark pixel of a waveguide is an untouched one.
uint32_t shadow_gray(const Sensor& sensor);

/// Reads and validates. Throws Error(Failure::Sensor) that names file, key, wanted, found; unknown keys are
/// errors.
Sensor load_sensor(const std::filesystem::path& file);
/// Validates a sensor made in code; `where` names it in messages.
void validate(const Sensor& sensor, const std::string& where);
/// Writes atomically (temporary file, then rename). Throws Error(Failure::Output).
void save_sensor(const Sensor& sensor, const std::filesystem::path& file);
/// The text of a sensor file, and a sensor from such a text; `where` names it in messages. Paths stay as they
/// are. Throw Error(Failure::Sensor).
std::string sensor_text(const Sensor& sensor);
Sensor sensor_from_text(const std::string& text, const std::string& where);

const char* to_string(Signal signal);
const char* to_string(Filter filter);
const char* to_string(BackgroundKind kind);
const char* to_string(Reading reading);

}  // namespace palpate
