// Slope stage: the surface's slope from a frame, as the right side of the surface problem.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "engine/gpu/buffer.h"
#include "engine/gpu/commands.h"
#include "engine/gpu/kernel.h"
#include "engine/gpu/tuning.h"
#include "engine/stages/surface/surface.h"
#include "palpate/sensor.h"
#include "shaders/shared/slope.h"

namespace palpate {
class Contact;
class PaddedImage;

/// Weights of each cell's right and lower face, as WeightedSurface takes them, and partial sums of weight
/// times squared difference over all faces, a word for each of Slope's strips.
struct CellFaceMaps {
  const gpu::DeviceBuffer &across, &down, &field;
};

class Slope {
 public:
  /// For SurfaceReading::Shading `contact` must keep its filtered image; for SurfaceReading::Photometric the
  /// frame has three planes of 8 bits.
  Slope(gpu::Context& context, const Sensor& sensor, const FrameFormat& format, const Contact& contact,
        RightSides right_sides, const Tuning& tuning);
  /// Slopes given by the caller, height units per px.
  Slope(gpu::Context& context, uint32_t width, uint32_t height, RightSides right_sides, const Tuning& tuning);

  /// Fills the right sides that the stage was made for, and `clipped`, of clipped_bytes(), with what
  /// clipped_px() adds up.
  void record(gpu::Commands& commands, const PaddedImage& frame, const PaddedImage& background,
              const Surface& surface, const gpu::DeviceBuffer& clipped) const;
  /// The slopes themselves, d(depth)/dx and d(depth)/dy at pixel centres; only where `prepare_slopes` was
  /// called.
  void record_slopes(gpu::Commands& commands, const PaddedImage& frame, const PaddedImage& background,
                     const FloatMap& p, const FloatMap& q, const gpu::DeviceBuffer& clipped) const;
  void prepare_slopes(gpu::Context& context);
  /// The right side on cells of two by two pixels, `right`, where pixels count by `confidence` (a
  /// ConfidenceMap's pairs); only after `prepare_known`. `faces`, if any, gets the weights of the cells'
  /// faces.
  void record_known(gpu::Commands& commands, const PaddedImage& frame, const PaddedImage& background,
                    const gpu::TexelView& confidence, const FloatMap& right, const gpu::DeviceBuffer& clipped,
                    const CellFaceMaps* faces = nullptr) const;
  void prepare_known(gpu::Context& context);
  void record_given(gpu::Commands& commands, const FloatMap& p, const FloatMap& q,
                    const Surface& surface) const;

  /// Number of strips of eight columns and some rows, one to an invocation.
  uint32_t strips() const;
  /// A word for each strip.
  uint64_t clipped_bytes() const { return uint64_t{strips()} * sizeof(uint32_t); }
  /// Pixels of the frame whose reading is steeper than max_slope: their slope keeps its direction and has
  /// that size. In SurfaceReading::Shading those in contact: elsewhere nothing is read.
  uint64_t clipped_px(std::span<const uint32_t> clipped) const;

 private:
  std::array<uint32_t, 3> groups() const;
  void dispatch(gpu::Commands& commands, std::vector<gpu::Argument> arguments, const Surface& surface) const;
  /// Inputs of the reading's kernels.
  std::vector<gpu::Argument> record_reading(gpu::Commands& commands, const PaddedImage& frame,
                                            const PaddedImage& background) const;
  std::vector<gpu::Binding> readings() const;

  shared::SlopePush push_{};
  uint32_t tile_rows_ = 0;
  uint32_t workgroup_ = 0;
  bool tiled_ = false;  // the right sides; slopes and weights by strips all the same
  bool shading_ = false;
  RightSides right_sides_;
  // Of the kernels: rows. Shading: stored units below which a slope is clipped (0: none is). Photometric:
  // whether products of colours have weights, and the degree in place.
  std::vector<uint32_t> constants_;
  gpu::DeviceBuffer weights_;  // for SurfaceReading::Photometric
  // For SurfaceReading::Shading: the contact stage's filtered image, and its means over 8 x 8 px.
  gpu::TexelView filtered_texels_, filtered_pairs_;
  gpu::DeviceBuffer blocks_;
  gpu::TexelView block_words_;
  uint32_t block_groups_ = 0;
  gpu::Kernel block_kernel_;
  gpu::Kernel kernel_;
  gpu::Kernel store_kernel_;
  gpu::Kernel known_kernel_, faces_kernel_;
};

}  // namespace palpate
