// Frame parts: what each stage finds in one finished frame, by itself; assemble() makes a Touch of them.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "engine/pipeline/surface_map.h"
#include "palpate/pipeline.h"
#include "palpate/touch.h"

namespace palpate {

/// Faults of a depth map; several may hold.
struct DepthFaults {
  bool light_unknown = false;
  bool apart = false;         ///< the contact lies on an island of its own
  bool saturated = false;     ///< so many of the contact's pixels that its depth cannot be right
  bool at_border = false;     ///< pressure reaches the frame's border: what presses beyond it is missing
  bool above_range = false;   ///< of the table of depths
  bool clipped = false;       ///< so many of the contact's slopes that its depth cannot be right
  bool too_deep = false;      ///< deeper than the pad is thick
  bool covered = false;       ///< markers hide too much of the skin
  bool extrapolated = false;  ///< too much of the contact is unlike anything that calibration saw
  bool untouched = false;     ///< nothing touches: the map is at rest
};

/// Faults of a wrench that is known; several may hold.
struct WrenchFaults {
  bool light_unknown = false;
  bool not_converged = false;
  Validity depth = Validity::Valid;  ///< of the depth map that the wrench is read from
  bool at_border = false;
  bool too_deep = false;  ///< for the layer's force
  bool covered = false;   ///< cells of the contact whose depth is not known
};

struct SurfacePart {
  SurfaceSummary summary;  ///< all but its validity
  DepthFaults faults;
};

struct TractionPart {
  TractionSummary summary;  ///< components are Valid, NotCalibrated or NoContact
  bool not_converged = false, too_deep = false, covered = false;  ///< as in WrenchFaults
};

/// Of the wrench.
inline std::array<Estimate*, 6> components(TractionSummary& t) {
  return {&t.fx_N, &t.fy_N, &t.fz_N, &t.mx_Nmm, &t.my_Nmm, &t.mz_Nmm};
}

struct FrameParts {
  /// The contact as a whole: its shape, with the saturated pixels of the whole frame.
  ContactTouch whole;
  std::optional<RegionSummary> regions;
  std::vector<ContactTouch> contacts;  ///< the shapes of regions, small ones too; without ids
  std::optional<ConfidenceSummary> confidence;
  std::optional<double> gradient_sum;
  bool follows_skin = false;
  std::vector<SkinPoint> skin_points;
  std::span<const float> skin_sd_px;  ///< standard error of each of skin_points
  std::optional<SurfacePart> surface;
  std::optional<MarkerSummary> markers;
  std::optional<TractionPart> traction;
  std::optional<ObjectPose> object;
  bool light_unknown = false;  ///< too little of a gel with markers is as in the untouched image
  SurfaceMap map;
  TractionMaps traction_maps;
  ExtrapolatedCells extrapolated;
  uint32_t copies = 0;  ///< as Result::copies

  bool touched() const { return whole.area_px > 0; }
  /// As at first, but for the memory of lists.
  void clear() {
    std::vector<ContactTouch> regions_before = std::move(contacts);
    std::vector<SkinPoint> points_before = std::move(skin_points);
    *this = FrameParts{};
    contacts = std::move(regions_before);
    skin_points = std::move(points_before);
    contacts.clear();
    skin_points.clear();
  }
};

}  // namespace palpate
