// One sensor's calibration as plain data: a JSON file, see README.md for a commented example.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "palpate/export.h"
#include "palpate/frame.h"
#include "palpate/outline.h"

namespace palpate {

/// How touch changes a pixel relative to the background (untouched) image.
enum class Signal {
  Brighter,  ///< waveguide: glows where pressed; g = max(0, image - background)
  Darker,    ///< ink or translucent gel: g = max(0, background - image)
  Either,    ///< colour gel: g = |image - background|, the largest of the channels
};

/// Filter that smooths the change before threshold and sums.
enum class Filter {
  Binomial5,  ///< 5 x 5 binomial, weights 1 4 6 4 1
  None,       ///< for frames without noise, or smoothed by the camera; no reading of one gray image
};

/// How an image becomes a surface.
enum class SurfaceReading {
  None,         ///< the sensor measures contact and force only
  Shading,      ///< one gray image, Lambertian, light along the viewing axis (the paper, Eq. 61-63)
  Photometric,  ///< three coloured lights, linear per-pixel calibration from known normals
  Elastic,      ///< one gray image of contact pressure, convolved with the pad's answer to a load
  Lookup,       ///< one gray image whose change is the depth, by a table from presses of a known ball
};

/// Where a calibration came from, for people and records.
struct Origin {
  std::string from;  ///< the recordings and tables that it rests on
  std::string made;  ///< UTC, such as 2017-03-14T15:16:17Z
  std::string note;  ///< one line: how many samples, what was chosen, what was left out

  bool empty() const { return from.empty() && made.empty() && note.empty(); }
};

/// Signal that a force is a function of.
enum class ForceSignal {
  GraySum,   ///< G, gray levels
  Area,      ///< of the contact, px
  Volume,    ///< indented, mm^3; needs Output::Surface
  Gradient,  ///< Touch::gradient_sum; needs frames of 8 bits
  Layer,     ///< force by the elastic layer (TractionSummary), N; needs Sensor::layer and a surface
  /// Mean of the layer's force and of ForceCalibration::bending_N_per_mm times TractionSummary::bending_mm,
  /// N.
  LayerAndBending,
};
/// Whether a force is read from the elastic layer's, alone or with another reading.
constexpr bool is_by_layer(ForceSignal signal) {
  return signal == ForceSignal::Layer || signal == ForceSignal::LayerAndBending;
}
/// F of a signal s.
enum class ForceModel {
  Line,    ///< F = c1 s + c0 (Eq. 54)
  Power,   ///< F = c1 s^exponent + c0
  Spline,  ///< monotone cubic (Fritsch and Carlson) through the knots
  Scale,   ///< F = c1 s: of a signal by the layer (is_by_layer), whose modulus it corrects
};

/// One direction of a force calibration; the model is the calibration's.
struct ForceCurve {
  double c1 = 0;  ///< N per unit of the signal (to the exponent)
  double c0_N = 0;
  double exponent = 1;                         ///< ForceModel::Power
  std::vector<std::array<double, 2>> knots{};  ///< ForceModel::Spline: signal, N; both rise
  double residual_sd_N = 0;                    ///< scatter of single readings about the curve
};

/// Signal to normal force, for loading and unloading together and, where they differ, apart. The names of
/// c1, gray_min and gray_max are those of the usual signal; with another they are in its unit.
struct ForceCalibration {
  double c1_N_per_gray = 0;
  double c0_N = 0;
  double residual_sd_N = 0;            ///< scatter of single readings about the curve, both directions
  std::array<double, 3> covariance{};  ///< var(c0), cov(c0, c1), var(c1)
  double gray_min = 0;                 ///< calibrated range of the signal
  double gray_max = 0;
  ForceSignal signal = ForceSignal::GraySum;
  ForceModel model = ForceModel::Line;
  double exponent = 1;                         ///< ForceModel::Power
  std::vector<std::array<double, 2>> knots{};  ///< ForceModel::Spline: signal, N; both rise
  std::optional<ForceCurve> loading{}, unloading{};
  double force_max_N = 0;          ///< full scale: largest force of the gauge; 0: not stated
  double hysteresis = 0;           ///< largest difference between the directions, fraction of full scale
  double drift_N_per_min = 0;      ///< of the residual over the calibration's time
  double r_squared = 0;            ///< 0: not stated
  double residual_fraction = 0;    ///< scatter that grows with the force: its share, added in squares
  double residual_grows_to_N = 0;  ///< up to this force, and stays; 0: without end
  double bending_N_per_mm = 0;     ///< ForceSignal::LayerAndBending: the layer's force over the bending
  bool fit_for_use = true;         ///< false: its error or range were found too poor; forces say so
  /// false: calibrated on a gel with fewer than three objects, whose slopes go with the shape too; forces say
  /// so
  bool shapes_judged = true;
  Origin origin{};
};

/// Displacement that measures the tangential force.
enum class ShearSignal {
  Centroid,  ///< of the contact, since its onset
  Skin,      ///< of the pad itself under the contact, by its markers or texture
};

/// Shift to tangential force, F = K u (Eq. 59-60), limited by friction.
struct ShearCalibration {
  double kx_N_per_mm = 0;
  double ky_N_per_mm = 0;
  double friction = 0;     ///< Coulomb coefficient: slip when |F_t| >= friction * F_z
  double relative_sd = 0;  ///< relative standard error of K
  ShearSignal signal = ShearSignal::Centroid;
  double friction_sd = 0;   ///< standard error of the coefficient; 0: not stated
  double shift_max_mm = 0;  ///< largest shift of the calibration; 0: not stated
  Origin origin{};
};

enum class SkinKind {
  Markers,  ///< printed dots, found in the untouched image
  Texture,  ///< anything random that is fixed to the skin, followed on a grid
};

/// The pattern on the pad's skin that shows how the skin moves along itself (Output::Skin).
struct SkinPattern {
  SkinKind kind = SkinKind::Markers;
  double spacing_px = 24;  ///< between neighbouring markers; of the grid
  double size_px = 8;      ///< diameter of a marker; texture: half the side of the window that is compared
  double shift_sd_px = 0;  ///< of one point's shift, while nothing moves; 0: from the fit itself
};

/// Brightness to slope, for SurfaceReading::Shading: cos(slope angle) = gray / facing_gray.
struct ShadingCalibration {
  double facing_gray = 0;  ///< filtered gray of a facet that faces the light, gray levels
  double depth_gain = 1;   ///< scale on the slopes, from a ball of known radius; 1 is the paper's reading
};

/// Weights of colours, a row each (three or nine), by place, a column each (one, three, six or ten).
using NormalWeights = std::vector<std::vector<double>>;

/// A press of a known ball that made a PhotometricCalibration, judged by the fit to all the others.
struct PressError {
  double across = 0, down = 0;  ///< middle of its contact, X and Y as PhotometricCalibration has them
  double radius = 0;            ///< of its contact, in halves of the frame's width
  double depth_error = 0;       ///< of the middle over the rim: read depth over true depth, less 1
};

/// Colours of the presses that made a PhotometricCalibration: changes of red, green and blue from the
/// background in units of full scale, in a box of kSide bins a colour from `low` to `high`.
struct SeenColours {
  static constexpr uint32_t kSide = 8;
  std::array<double, 3> low{}, high{};
  std::array<uint64_t, kSide> bins{};  ///< of each bin of blue: bit green kSide + red
};

/// Colour change to normal, for SurfaceReading::Photometric. With f_0, f_1, f_2 the changes of red, green and
/// blue from the background in units of full scale, where there are nine rows followed by their products (rr,
/// rg, rb, gg, gb, bb), and X, Y in [-1, 1] across the frame (pixel centres, right and down):
///   n_x = sum_c (wx[c][0] + wx[c][1] X + wx[c][2] Y + wx[c][3] XX + wx[c][4] XY + wx[c][5] YY + ...) f_c,
/// likewise n_y, with as many terms as there are columns (then XXX, XXY, XYY, YYY);
/// n_z = sqrt(1 - n_x^2 - n_y^2), and d(depth)/dx = n_x / n_z, d(depth)/dy = n_y / n_z: n points into the pad
/// where depth grows along +x.
struct PhotometricCalibration {
  NormalWeights wx = NormalWeights(3, std::vector<double>(3)), wy = wx;  ///< of one shape
  double normal_sd = 0;               ///< RMS error of (n_x, n_y) on held-out presses
  double noise_sd = 0;                ///< part of it that is new in each frame; the rest stays with the pad;
                                      ///< 0: not stated, all of it counts as the pad's
  double pad_reach_px = 0;            ///< way over which the pad's part goes along with itself (a Gaussian's
                                      ///< deviation); 0: not stated
  std::vector<PressError> presses{};  ///< what they say of depths, see SurfaceSummary::depth_sd_mm; empty:
                                      ///< not stated
  std::optional<SeenColours> colours{};  ///< none: not stated
  Origin origin{};
};

/// Filtered change to depth, for SurfaceReading::Lookup: straight between the points, 0 at and below the
/// first, the last one's depth (and Validity::AboveRange) beyond it.
struct LookupCalibration {
  std::vector<std::array<double, 2>> points;  ///< gray levels, mm; gray rises, depth does not fall
  double depth_sd_mm = 0;                     ///< RMS error on held-out presses
  Origin origin{};
};

/// A lens with distortion, as OpenCV has it; undone on the cropped image, before the quad.
struct Lens {
  double fx_px = 0, fy_px = 0, cx_px = 0, cy_px = 0;
  std::array<double, 5> distortion{};  ///< k1, k2, p1, p2, k3
  double residual_px = 0;              ///< RMS of the grid's points about the model
  Origin origin{};
};

/// Uneven light, undone after rectification: gray' = gray * gain * image, rounded and clipped; a saturated
/// pixel stays saturated. The background is treated alike.
struct FlatField {
  std::string image;  ///< one plane of 16 bits, of the rectified size; in the file relative to it
  double gain = 0;    ///< per gray level of the image
  Origin origin{};
};

/// Brightness to contact pressure, and the pad that answers it, for SurfaceReading::Elastic: gray =
/// gray_per_MPa * p, or with a limit gray = limit_gray (1 - exp(-gray_per_MPa p / limit_gray)).
struct ElasticCalibration {
  static constexpr double kThinnest_px = 4;
  double gray_per_MPa = 0;  ///< filtered gray per contact pressure, for small pressures
  double limit_gray = 0;    ///< that no pressure exceeds; 0: the response is linear
  double young_MPa = 0;     ///< of the pad
  double poisson = 0.5;     ///< 0 to 0.5
  double thickness_mm = 0;  ///< of a pad bonded to a rigid base, kThinnest_px at least; 0: a half space
  double relative_sd = 0;   ///< relative standard error of gray_per_MPa times young_MPa, hence of depths
};

/// The pad as an elastic layer bonded to a rigid window: what turns the shape of its surface into traction
/// (Output::Traction).
struct LayerCalibration {
  static constexpr double kThinnest_px = 3;
  double young_MPa = 0;
  double poisson = 0.485;     ///< 0 to 0.5
  double thickness_mm = 0;    ///< kThinnest_px at least
  double relative_sd = 0.15;  ///< relative standard error of young_MPa, hence of pressures and forces
  Origin origin{};
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
  double pitch_mm_per_px = 0;     ///< of the rectified frame, square pixels; NaN: not known, see has_scale
  double pitch_sd_mm_per_px = 0;  ///< its standard error; 0: not stated

  // From the camera's image to the rectified frame.
  std::array<uint32_t, 2> camera_px{};             ///< width, height of the camera's image; 0: not stated
  std::optional<std::array<uint32_t, 4>> crop_px;  ///< x, y, width, height, applied first
  std::optional<std::array<std::array<double, 2>, 4>>
      quad_px;                        ///< corners top left, top right, bottom right, bottom left (after crop)
  std::optional<Lens> lens;           ///< undone between crop and quad
  std::array<uint32_t, 2> size_px{};  ///< width, height of the rectified frame; needed with quad_px
  std::optional<FlatField> flat;
  uint32_t channels = 1;   ///< what the engine gets: 1 (colour input is turned gray) or 3
  uint32_t bit_depth = 8;  ///< of the pixel values, 8 to 16

  BackgroundSource background;

  Signal signal = Signal::Brighter;
  Filter filter = Filter::Binomial5;
  double threshold_gray = 4;  ///< filtered gray from which a pixel belongs to the contact, in steps of 1/128
  double gradient_gray_per_px = 1;   ///< steeper change counts for Touch::gradient_sum, in steps of 1/128
  uint32_t saturation_gray = 255;    ///< raw pixels from here on are saturated
  uint32_t smallest_contact_px = 0;  ///< connected regions with fewer pixels are no contact of their own; 0:
                                     ///< as smallest_contact_px() says

  SurfaceReading reading = SurfaceReading::None;
  ShadingCalibration shading;
  PhotometricCalibration photometric;
  ElasticCalibration elastic;
  LookupCalibration lookup;
  std::optional<LayerCalibration> layer;  ///< none: traction is not known, but see layer_of
  double max_slope = 10;                  ///< slopes steeper than this are clipped
  /// Brightest channel, gray levels, up to which a pixel is too dark to carry a slope; from there to twice
  /// that it counts in part.
  std::optional<uint32_t> shadow_gray;
  std::optional<PadOutline> pad;  ///< what lies beyond is not known; none: the whole frame is pad

  std::optional<SkinPattern> skin;  ///< none: the skin shows no pattern
  std::optional<ForceCalibration> force;
  std::optional<ShearCalibration> shear;
};

/// False for a camera of which nothing is known yet: areas and places are in px only, lengths are NaN.
PALPATE_API bool has_scale(const Sensor& sensor);
/// A camera of which nothing is known but its format: contact is what changes against the first frames by
/// more than 2 % of full scale; no scale, no calibration, no surface.
PALPATE_API Sensor uncalibrated_sensor(const FrameFormat& format);

/// The sensor for frames that Rectifier has made, as a source delivers them: without camera_px, crop_px,
/// quad_px, lens and flat, which the frames have behind them. A Pipeline refuses a sensor that still has
/// some.
PALPATE_API Sensor for_rectified_frames(Sensor sensor);

/// The sensor's own layer, or that of its surface.elastic where it has a thickness.
PALPATE_API std::optional<LayerCalibration> layer_of(const Sensor& sensor);

/// The sensor's own, or the default of its reading: 2 % of full scale for SurfaceReading::Photometric,
/// whose slopes come from brightness; otherwise 0, nothing, since a dark pixel of a waveguide is an untouched
/// one.
PALPATE_API uint32_t shadow_gray(const Sensor& sensor);

/// Untouched gray level from which a pixel is as good as saturated at rest, 1/64 of full scale below
/// saturation_gray: such pixels never count as saturated by touch.
PALPATE_API uint32_t dead_gray(const Sensor& sensor);

/// Whether contacts (Output::Contacts) are told by the change over its own noise, and the surface is at rest
/// around them: colour gels, and with printed markers those in colour that nobody has calibrated as well.
/// Both then depend on the frames before.
PALPATE_API bool has_gel_contacts(const Sensor& sensor);

/// The sensor's own, or 1/4000 of the frame, 9 px, and what one marker or patch of its skin changes at most.
PALPATE_API uint32_t smallest_contact_px(const Sensor& sensor, const FrameFormat& format);

/// Section of a sensor file that a calibration makes.
enum class ToMake { Nothing, Scale, Reading };

/// Reads and validates. Throws Error(Failure::Sensor) that names file, key, wanted, found; unknown keys are
/// errors.
/// `to_make`: what is about to be calibrated, which the file may lack, as it may the scale: that is then not
/// known, and of ToMake::Reading the reading of the surface none.
PALPATE_API Sensor load_sensor(const std::filesystem::path& file, ToMake to_make = ToMake::Nothing);
/// Validates a sensor made in code; `where` names it in messages.
PALPATE_API void validate(const Sensor& sensor, const std::string& where);
/// Writes atomically (temporary file, then rename), into a folder that is made where it is missing. Throws
/// Error(Failure::Output).
PALPATE_API void save_sensor(const Sensor& sensor, const std::filesystem::path& file);
/// The text of a sensor file, and a sensor from such a text; `where` names it in messages. Paths stay as they
/// are. Throw Error(Failure::Sensor).
PALPATE_API std::string sensor_text(const Sensor& sensor);
PALPATE_API Sensor sensor_from_text(const std::string& text, const std::string& where);

PALPATE_API const char* to_string(Signal signal);
PALPATE_API const char* to_string(Filter filter);
PALPATE_API const char* to_string(BackgroundKind kind);
PALPATE_API const char* to_string(SurfaceReading reading);
PALPATE_API const char* to_string(ForceSignal signal);
PALPATE_API const char* to_string(ForceModel model);
PALPATE_API const char* to_string(ShearSignal signal);
PALPATE_API const char* to_string(SkinKind kind);

}  // namespace palpate
