// Touch: the measurements of one frame in physical units, with their standard errors and validity.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "palpate/estimate.h"
#include "palpate/export.h"
#include "palpate/frame.h"
#include "palpate/object_pose.h"

namespace palpate {

/// Fault of a picture that was spoilt between the camera and here.
enum class PictureFault : uint8_t {
  None,
  OneColour,    ///< a part is exactly one colour
  ColourOrder,  ///< its colours are exchanged
  Moved,        ///< rows or columns are rolled around
  Torn,         ///< along a row its parts do not fit each other
};
PALPATE_API const char* to_string(PictureFault fault);

/// Stick and slip, by the friction limit and what moves at it, or by the skin's own movement.
enum class Slip : uint8_t {
  NoContact,
  Stick,
  Slip,
  NotCalibrated,
  Incipient,  ///< the contact's rim slides, its core still sticks: by the load on the limit, or by the skin
  PictureDamaged,  ///< not known: see Touch::picture
};
PALPATE_API const char* to_string(Slip slip);

/// Ellipse with the same second moments as the contact area.
struct Ellipse {
  double major_mm = 0;   ///< full major axis
  double minor_mm = 0;   ///< full minor axis
  double angle_rad = 0;  ///< of the major axis from +x towards +y (downwards in the image), (-pi/2, pi/2]
  double major_px = 0;   ///< the same axes in pixels, for sensors without a scale
  double minor_px = 0;
};

/// One of several contacts: a connected region of contact pixels (8 neighbours), followed from frame to
/// frame. Fields mean what those of Touch mean, of this region alone.
struct ContactTouch {
  uint32_t id = 0;      ///< from 1, in order of appearance; never used again
  uint64_t frames = 0;  ///< since its onset, this one included
  double gray_sum = 0;
  double centroid_x_px = 0;
  double centroid_y_px = 0;
  uint64_t area_px = 0;
  double area_mm2 = 0;
  Ellipse ellipse;
  double peak_gray = 0;
  uint64_t saturated_px = 0;  ///< of its own pixels
  bool at_border = false;     ///< reaches the frame's border
  PixelRect box;              ///< around its pixels; of a colour gel's contact around its outline
  Estimate force_N;
  Estimate shear_x_N;
  Estimate shear_y_N;
  double shift_x_mm = 0;
  double shift_y_mm = 0;
  double shift_x_px = 0;
  double shift_y_px = 0;
  Slip slip = Slip::NotCalibrated;
};

/// One followed place of the pad's skin.
struct SkinPoint {
  float rest_x_px = 0;  ///< where it is in the untouched image
  float rest_y_px = 0;
  float shift_x_px = 0;  ///< from there to this frame
  float shift_y_px = 0;
  float correlation =
      0;  ///< 0: lost, its shift is not known; to 1: the picture is the untouched one, shifted
};

/// How the skin moves along itself, from the points that lie in the contact (Output::Skin).
struct SkinMotion {
  uint32_t points = 0;  ///< followed in this frame, whole pad
  uint32_t lost = 0;
  uint32_t touching = 0;  ///< followed ones under the contact; less than 3: nothing below is known
  Estimate shift_x_mm;    ///< of the contact's core since the contact's onset
  Estimate shift_y_mm;
  Estimate torsion_rad;  ///< turn about the normal since onset, from +x towards +y
  Estimate stick_share;  ///< radius of the part that still sticks over the contact's, 0 to 1
};

/// Regions that were told apart in a frame (Output::Contacts); those large enough are Touch::contacts.
struct RegionSummary {
  uint64_t small = 0;     ///< regions too small to count as contacts
  bool overflow = false;  ///< more regions than there was room for: contacts are incomplete
};

/// A surface of the known pixels. Of frames that need weights, because other pixels are unknown than those
/// that no frame shows, or are known in part, the solve says more.
struct WeightedSummary {
  std::optional<double> residual;     ///< relative RMS that the solve leaves of its normal equations
  std::optional<double> unexplained;  ///< fraction of the weighted slopes that no surface explains, 0 to 1
  uint32_t islands = 0;               ///< parts of the frame that nothing known joins
  uint32_t touched_islands = 0;       ///< of those, with contact
};

/// The height map of a frame in numbers (Output::Surface); the map itself is Result::depth_mm().
struct SurfaceSummary {
  Validity validity = Validity::NotCalibrated;  ///< of the whole depth map
  double depth_max_mm = 0;  ///< deepest point below the rest level, of touched tiles and the frame's border
  /// Standard error of depth_max_mm, and over a contact of each of its depths, by calibration; 0: not stated
  /// there.
  double depth_sd_mm = 0;
  double depth_offset_mm = 0;  ///< add to a value of the height map to get depth: rest level is depth 0
  bool rest_from_untouched =
      false;              ///< false: no untouched tile, rest level is the mean over the whole frame
  double volume_mm3 = 0;  ///< indented volume below rest level, of touched tiles
  /// Area dented: the pad that lies below its rest level, clear of the noise of its heights there. Wider than
  /// the area in contact (Touch::area_mm2) by what the object draws down around it. Of colour gels
  /// (has_gel_contacts()) with Output::Contacts; none where too little of the pad is at rest.
  std::optional<double> dented_mm2;
  /// Pixels steeper than the sensor's max_slope, whose slope was clipped to it.
  uint64_t clipped_px = 0;
  /// Dented pixels whose place or colour calibration never saw (Result::extrapolated). Of colour gels whose
  /// sensor file says what it saw, as dented_mm2.
  std::optional<uint64_t> extrapolated_px{};
  std::optional<WeightedSummary> weighted;
};

/// Pressure and shear on the pad in numbers (Output::Traction); the maps are Result::traction. x right, y
/// down, z into the pad; moments r x F about the frame's middle: (y p, -x p, x t_y - y t_x). Standard errors
/// are those of slopes, skin and the layer's modulus together.
struct TractionSummary {
  Estimate fx_N, fy_N, fz_N;  ///< x and y where the skin is followed (Output::Skin)
  Estimate mx_Nmm, my_Nmm, mz_Nmm;
  double pressure_max_kPa = 0;
  double shear_max_kPa = 0;
  double area_mm2 = 0;  ///< that carries pressure
  /// Share of the cells with a ratio of shear to pressure (friction_ratios) that reach the friction
  /// limit (kSlippingShare of ShearCalibration::friction); none where shear or the coefficient is not known.
  std::optional<double> slipping_fraction;
  double unexplained_slope = 0;  ///< RMS of the surface's slopes that no traction explains; 0: not solved for
  double residual = 0;           ///< of the solve, relative
  uint32_t iterations = 0;
  uint64_t unknown_cells = 0;  ///< in the contact, whose depth is not known
  /// Steepness of the change over lengths at which the pad carries a load, integrated over the frame
  /// (engine/measure/bending.h); of colour gels (has_gel_contacts()) in frames that something touches.
  std::optional<double> bending_mm;
};

/// Pixels by how much is known of their slope; a pixel may count more than once.
struct ConfidenceSummary {
  uint64_t unknown_px = 0;   ///< of confidence 0
  uint64_t shadowed_px = 0;  ///< too dark to carry a slope, wholly or in part
  uint64_t outside_px = 0;   ///< beyond the pad's outline
};

/// Whether a colour gel's light is that of its untouched image.
enum class LightState : uint8_t {
  Steady,   ///< it is
  Changed,  ///< what the camera (exposure, gain, white balance) or the lamps changed was taken out
  Unknown,  ///< too little of the frame agrees on one light: that of the frame before was taken, or none
};
PALPATE_API const char* to_string(LightState state);

struct LightSummary {
  LightState state = LightState::Steady;
  double change_gray = 0;  ///< RMS over the frame of what was taken out, of the colour that changed most
};

/// Pixels of a colour gel under printed markers (SkinKind::Markers), with a rim around them.
struct MarkerSummary {
  uint64_t filled_px = 0;   ///< continued from what is seen around them
  uint64_t unknown_px = 0;  ///< with nothing around them to continue from: as untouched, of confidence 0
};

/// Measurements of one frame; parts that were not measured are empty. Pixel coordinates are of pixel centres:
/// (0, 0) is the centre of the top left pixel.
struct Touch {
  uint64_t sequence = 0;
  int64_t time_ns = 0;

  bool contact = false;  ///< some pixel of the filtered, background-subtracted image reached the threshold
  /// A damaged picture is not measured: no contact, and every state says so.
  PictureFault picture = PictureFault::None;
  bool repeated = false;  ///< equal to the frame before in every pixel
  double gray_sum = 0;    ///< G: sum of filtered gray over the contact, gray levels (exact multiple of 1/256)
  double centroid_x_px = 0;  ///< gray-weighted; NaN without contact
  double centroid_y_px = 0;
  /// In contact: of a colour gel (has_gel_contacts()) with Output::Contacts and a surface what lies deeper
  /// than where the sides of the dent are steepest, without a surface its outline; else pixels that reached
  /// the threshold.
  uint64_t area_px = 0;
  double area_mm2 = 0;
  Ellipse ellipse;
  double peak_gray = 0;  ///< largest filtered gray, gray levels
  /// Raw pixels that touch has brought to the sensor's saturation level, whole frame. Those that are there
  /// untouched (dead_gray()) do not count: their saturation means nothing.
  uint64_t saturated_px = 0;

  bool at_border = false;  ///< contact pixels in the frame's outermost rows or columns: what presses beyond
                           ///< them is missing
  /// Sum over the frame of how much steeper the change from the background varies from pixel to pixel than
  /// Sensor::gradient_gray_per_px (5 x 5 derivative of all channels, root of the sum of squares): gray levels
  /// times px, an exact multiple of 1/128. Light that changes evenly leaves it alone.
  std::optional<double> gradient_sum;

  Estimate force_N;    ///< normal force; with several contacts (Output::Contacts) the sum of theirs
  Estimate shear_x_N;  ///< tangential force; bounded by the friction limit
  Estimate shear_y_N;
  double shift_x_mm = 0;  ///< centroid since the onset of this contact
  double shift_y_mm = 0;
  double shift_x_px = 0;  ///< the same in pixels
  double shift_y_px = 0;
  Slip slip = Slip::NotCalibrated;

  std::optional<RegionSummary> regions;  ///< contacts were told apart
  std::vector<ContactTouch> contacts;    ///< of those regions; rising id

  std::optional<SkinMotion> skin;  ///< the skin's pattern was followed
  std::vector<SkinPoint> skin_points;

  std::optional<LightSummary>
      light;  ///< of colour gels (has_gel_contacts()), see PipelineOptions::fixed_light
  std::optional<SurfaceSummary> surface;
  std::optional<TractionSummary> traction;
  std::optional<MarkerSummary> markers;         ///< they are printed on a gel whose colours show slopes
  std::optional<ConfidenceSummary> confidence;  ///< it was asked for, or the surface needs it
  std::optional<ObjectPose> object;             ///< Output::Motion; of frames that follow each other
};

}  // namespace palpate
