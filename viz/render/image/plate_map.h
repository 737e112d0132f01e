// A spline of the displacement in the plane, as a dense map of its strain over the frame, made on the GPU.
#pragma once

#include <cstdint>
#include <vector>

#include "engine/gpu/buffer.h"
#include "engine/gpu/kernel.h"
#include "engine/numeric/thin_plate/thin_plate.h"
#include "shaders/shared/thin_plate.h"

namespace palpate {
namespace gpu {
class Commands;
class Context;
}  // namespace gpu

/// Quantities of the map; strains as PlaneStrain defines them.
enum class PlateShown : uint32_t {
  Xx = shared::kPlateXx,
  Yy = shared::kPlateYy,
  Xy = shared::kPlateXy,
  First = shared::kPlateFirst,
  Second = shared::kPlateSecond,
  Shear = shared::kPlateShear,
  Area = shared::kPlateArea,
  U = shared::kPlateU,
  V = shared::kPlateV,
};

/// The sum over the points is made at the nodes of a lattice of shared::kPlateStep px, in single precision,
/// and Hermite pieces of degree 3 by 3 join them: 64 times fewer kernels than pixel by pixel. `error_bound`
/// says what the pieces may be off by.
class PlateMap {
 public:
  static constexpr uint32_t kMostPoints = 4096;

  PlateMap(gpu::Context& context, uint32_t width, uint32_t height, PlateShown shown);

  /// Sets the map of the next `record`: two fields, u and v in px, over places in px (x right, y down, pixel
  /// centres at whole numbers), with kernel Log. Farther than `reach_px` from every point the map is NaN. No
  /// submission that reads the map's inputs may be running. Throws Error(Failure::Input) where the spline is
  /// another one, where its points do not determine a plane's strain (rank below 2) or are more than
  /// kMostPoints.
  void set(const ThinPlateSpline<2>& spline, double reach_px);
  /// Fills the map.
  void record(gpu::Commands& commands) const;

  /// height rows of `pitch` floats; width of each count.
  const gpu::DeviceBuffer& map() const { return map_; }
  uint32_t pitch() const { return 4 * push_.pitch; }
  uint64_t memory_bytes() const { return points_.bytes() + nodes_.bytes() + map_.bytes(); }

 private:
  shared::PlatePush push_{};
  gpu::DeviceBuffer points_, nodes_, map_;
  gpu::TexelView point_texels_, node_texels_;
  gpu::Kernel lattice_, fill_;
};

/// The most by which either field's gradient may be off anywhere in a frame because of the pieces between the
/// nodes (length of the difference; rounding, about 1e-6 of the largest sums, is not in it). Each point's
/// kernel scales: interpolating r^2 log r^2 at a step h errs by h times what it does at step 1, but for a
/// quadratic that the pieces reproduce. The error at step 1 is tabulated over the distance from point to
/// cell, a maximum over all places in the cell, and falls with the square of the distance.
double plate_map_error_bound(const ThinPlateSpline<2>& spline, uint32_t width, uint32_t height);

}  // namespace palpate
