// The live 3D tactile surface, drawn into any render pass: window or off-screen.
#pragma once

#include <vulkan/vulkan.h>

#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <tuple>
#include <utility>
#include <vector>

#include "engine/gpu/buffer.h"
#include "engine/gpu/context.h"
#include "engine/gpu/descriptor_sets.h"
#include "engine/pipeline/surface_map.h"
#include "palpate/frame.h"
#include "viz/render/colour_map.h"
#include "viz/render/orbit.h"
#include "viz/render/render_target.h"

namespace palpate::viz {

/// Appearance of the surface, apart from the camera.
struct SurfaceStyle {
  double exaggeration = 8;  ///< of depth against x and y
  double range_mm = 1;      ///< depth at the foot of the drawn box, > 0; with Quantity::Depth its last colour
  Quantity quantity = Quantity::Depth;
  ColourMap map = ColourMap::Viridis;
  double colour_range = 1;  ///< of another quantity (MPa, strain, ratio) with the last colour, > 0
  double grid_mm = 0;       ///< spacing of the lines on the surface; 0: none
  bool lit = true;          ///< false: plain colours of the colour bar
};

/// Value with the last colour, in the quantity's unit: mm, MPa, strain or shear over pressure as a fraction.
inline double last_colour(const SurfaceStyle& style) {
  return style.quantity == Quantity::Depth ? style.range_mm : style.colour_range;
}

/// A rectangle of the picture, px from the top left.
struct ViewRect {
  int32_t x = 0, y = 0;
  uint32_t width = 1, height = 1;
  double aspect() const { return static_cast<double>(width) / height; }
};

/// Half sizes of the box that holds a surface: what the camera fits, mm.
Vec3 surface_half_size_mm(uint32_t width, uint32_t height, double pitch_mm_per_px, const SurfaceStyle& style);

/// One graphics pipeline with texel buffers at bindings 0, 1, ... and push constants for both stages.
class TexelPipeline {
 public:
  struct Shaders {
    const char* name;
    gpu::Spirv vertex, fragment;
  };
  /// `blended`: over what is there, by alpha. `buffers`: bound texel buffers. `constants`: of the fragment
  /// shader, by their constant_id from 0.
  TexelPipeline(gpu::Context& context, const RenderPass& pass, const Shaders& shaders, uint32_t push_bytes,
                VkPrimitiveTopology topology, bool depth_test, bool blended, uint32_t buffers = 1,
                const std::vector<int32_t>& constants = {});
  ~TexelPipeline();
  TexelPipeline(const TexelPipeline&) = delete;
  TexelPipeline& operator=(const TexelPipeline&) = delete;
  /// As many texel buffers as the pipeline was made for. `sets` are used until the picture is finished.
  void bind(VkCommandBuffer cmd, gpu::DescriptorSets& sets, std::span<const gpu::TexelView* const> texels,
            const void* push) const;

 private:
  gpu::Context& context_;
  uint32_t push_bytes_;
  VkDescriptorSetLayout set_layout_ = VK_NULL_HANDLE;
  VkPipelineLayout layout_ = VK_NULL_HANDLE;
  VkPipeline pipeline_ = VK_NULL_HANDLE;
};

/// Contact pressure over the frame, MPa, or shear over pressure, in rows of `width` texels; of any size.
struct LoadTexels {
  const gpu::TexelView* texels = nullptr;
  uint32_t width = 0;
  uint32_t height = 0;
};

class SurfaceView {
 public:
  /// `frames_in_flight`: how many pictures may be drawing at once; what a draw uses lives that long.
  SurfaceView(gpu::Context& context, const RenderPass& pass, uint32_t frames_in_flight);

  /// Draws the map as the eye sees it in `view`. `mesh_columns`: vertices across (rows follow
  /// from the map's shape); 0: every texel, up to kMaxMeshColumns. `dense`: the part of the map, texels, in
  /// which they stand closest. The map must stay untouched until the picture is finished, and so must `load`,
  /// which Quantity::Pressure and Quantity::Friction need.
  void draw(VkCommandBuffer cmd, const SurfaceMap& map, double offset_mm, double pitch_mm_per_px,
            const Eye& eye, const SurfaceStyle& style, const ViewRect& view, uint32_t mesh_columns,
            const LoadTexels& load = {}, const std::optional<PixelRect>& dense = std::nullopt);

  static constexpr uint32_t kMaxMeshColumns = 1536;
  /// Vertices across and down that `draw` uses for this map.
  static std::pair<uint32_t, uint32_t> mesh_size(const SurfaceMap& map, uint32_t mesh_columns);

 private:
  struct Mesh {
    gpu::DeviceBuffer indices;
    uint32_t count = 0;
  };
  struct Bound {
    gpu::TexelView heights;
    gpu::DescriptorSets sets;
    gpu::DeviceBuffer places;  ///< of the mesh's columns, then of its rows, texels
    gpu::TexelView place_texels;
  };
  Bound& bind(const SurfaceMap& map);
  const Mesh& mesh(uint32_t columns, uint32_t rows);
  const TexelPipeline& pipeline(const SurfaceStyle& style, bool fine);

  gpu::Context& context_;
  const RenderPass& pass_;
  uint32_t frames_in_flight_;
  std::map<std::tuple<ColourMap, Quantity, bool>, std::unique_ptr<TexelPipeline>>
      pipelines_;  // made when first shown
  std::map<std::pair<uint32_t, uint32_t>, Mesh> meshes_;
  std::deque<Bound> bound_;  // of the last pictures: the map's buffer may be another each time
};

/// Chooses the mesh so that drawing keeps within a budget of host time, with hysteresis: coarser at once when
/// it is slow, finer only when it has been fast for a while.
class MeshGovernor {
 public:
  static constexpr uint32_t kFinest = 512;  ///< vertices across, where it chooses
  /// `fixed`: a device that draws in hardware shows every texel.
  MeshGovernor(bool fixed, double budget_ms);
  /// Vertices across for the next picture; 0: every texel.
  uint32_t columns() const;
  /// Host time that the last picture took to draw.
  void record(double draw_ms);
  double typical_ms() const { return typical_ms_; }

 private:
  bool fixed_;
  double budget_ms_;
  size_t level_;
  std::vector<double> recent_ms_;
  double typical_ms_ = 0;
  int wait_ = 0;  ///< pictures before the mesh may become finer again
};

}  // namespace palpate::viz
