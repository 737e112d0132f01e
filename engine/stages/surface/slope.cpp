#include "engine/stages/surface/slope.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "engine/base/divide_up.h"
#include "engine/gpu/commands.h"
#include "engine/gpu/context.h"
#include "engine/stages/frame/contact.h"
#include "shaders/block_means.spv.h"
#include "shaders/known_slope_photometric.spv.h"
#include "shaders/known_slope_shading.spv.h"
#include "shaders/shared/tile.h"
#include "shaders/slope_cell_tile_given.spv.h"
#include "shaders/slope_cell_tile_photometric.spv.h"
#include "shaders/slope_cell_tile_shading.spv.h"
#include "shaders/slope_coarse_given.spv.h"
#include "shaders/slope_coarse_photometric.spv.h"
#include "shaders/slope_coarse_shading.spv.h"
#include "shaders/slope_given.spv.h"
#include "shaders/slope_photometric.spv.h"
#include "shaders/slope_shading.spv.h"
#include "shaders/slope_store_photometric.spv.h"
#include "shaders/slope_store_shading.spv.h"
#include "shaders/slope_tile_given.spv.h"
#include "shaders/slope_tile_photometric.spv.h"
#include "shaders/slope_tile_shading.spv.h"
#include "shaders/weighted_slope_photometric.spv.h"
#include "shaders/weighted_slope_shading.spv.h"

namespace palpate {
namespace {

constexpr uint32_t kSlopeTileWorkgroup = 256;  // as shaders/surface/slope_tile.comp has it
constexpr uint32_t kBlock = 8;  // px; the side of the blocks whose means tell the direction of a gray slope

// Contact pixels darker than this many stored units are steeper than max_slope; 0 where the threshold leaves
// none.
uint32_t least_gray(const Sensor& sensor, uint32_t units_per_gray) {
  const double least =
      std::ceil(sensor.shading.facing_gray * units_per_gray / std::hypot(1, sensor.max_slope));
  return least > sensor.threshold_gray * units_per_gray ? static_cast<uint32_t>(least) : 0;
}

/// The kernel of a reading in its forms: strips and tiles, for pixels and for cells.
struct Forms {
  gpu::Shader strips, strips_of_cells, tiles, tiles_of_cells;
};

// A kernel that reads what `bindings` say and writes the right sides, and counts before them where it
// `clips`.
gpu::Kernel kernel_for(gpu::Context& context, RightSides right_sides, const Forms& forms,
                       std::vector<gpu::Binding> bindings, bool clips, const std::vector<uint32_t>& constants,
                       const Tuning& tuning) {
  const bool both = right_sides == RightSides::Pixels;
  bindings.resize(bindings.size() + (both ? 2 : 1) + (clips ? 1 : 0), gpu::Binding::Storage);
  const gpu::Shader& shader = tuning.slope_tiles ? (both ? forms.tiles : forms.tiles_of_cells)
                                                 : (both ? forms.strips : forms.strips_of_cells);
  const uint32_t workgroup = tuning.slope_tiles ? kSlopeTileWorkgroup : tuning.slope_workgroup;
  return {context, shader, {std::move(bindings), sizeof(shared::SlopePush), {workgroup, 1, 1}, constants}};
}

// Tiles count their clipped pixels in the words of strips, of which there must be enough.
uint32_t rows_for(const Tuning& tuning) {
  return tuning.slope_tiles ? std::min<uint32_t>(tuning.slope_rows, shared::kTileHeight) : tuning.slope_rows;
}

uint32_t place_degree(const PhotometricCalibration& calibration) {
  switch (calibration.wx.front().size()) {
    case 1:
      return 0;
    case 3:
      return 1;
    case 6:
      return 2;
    default:
      return 3;
  }
}

// Pairs of weights for x and y in the places of shaders/shared/slope.h, each padded to 16 bytes.
gpu::DeviceBuffer weights_of(gpu::Context& context, const PhotometricCalibration& calibration,
                             double max_gray) {
  constexpr size_t kPair = 4;
  gpu::DeviceBuffer buffer(context, "weights of colours",
                           kPair * shared::kColours * shared::kPlaceTerms * sizeof(float),
                           gpu::Memory::Constant);
  const std::span<float> pairs = buffer.as<float>();
  std::ranges::fill(pairs, 0.0f);
  for (size_t colour = 0; colour < calibration.wx.size(); ++colour) {
    const double unit = colour < 3 ? max_gray : max_gray * max_gray;
    for (size_t term = 0; term < calibration.wx[colour].size(); ++term) {
      const size_t at = kPair * (colour * shared::kPlaceTerms + term);
      pairs[at] = static_cast<float>(calibration.wx[colour][term] / unit);
      pairs[at + 1] = static_cast<float>(calibration.wy[colour][term] / unit);
    }
  }
  buffer.flush();
  return buffer;
}

}  // namespace

Slope::Slope(gpu::Context& context, const Sensor& sensor, const FrameFormat& format, const Contact& contact,
             RightSides right_sides, const Tuning& tuning)
    : tile_rows_(rows_for(tuning)),
      workgroup_(tuning.slope_workgroup),
      tiled_(tuning.slope_tiles != 0),
      shading_(sensor.reading == SurfaceReading::Shading),
      right_sides_(right_sides) {
  using enum gpu::Binding;
  push_.width = format.width;
  push_.height = format.height;
  push_.pitch = grid_for(format.width, format.height).pitch;
  push_.coarse_pitch = coarser(grid_for(format.width, format.height)).pitch;
  push_.scale = static_cast<float>(sensor.pitch_mm_per_px);
  push_.max_slope = static_cast<float>(sensor.max_slope);
  if (shading_) {
    const double units = contact.filtered_units_per_gray();
    constants_ = {tile_rows_, least_gray(sensor, contact.filtered_units_per_gray())};
    push_.in_pitch = contact.tiles_x() * contact.tile_columns() / 8;
    push_.threshold = static_cast<float>(sensor.threshold_gray * units);
    push_.facing = static_cast<float>(sensor.shading.facing_gray * units);
    push_.gain = static_cast<float>(sensor.shading.depth_gain);
    filtered_texels_ = gpu::TexelView(context, contact.filtered(), VK_FORMAT_R32G32B32A32_UINT);
    filtered_pairs_ = gpu::TexelView(context, contact.filtered(), VK_FORMAT_R32G32_UINT);
    kernel_ = kernel_for(context, right_sides,
                         {{"slope_shading", k_slope_shading},
                          {"slope_coarse_shading", k_slope_coarse_shading},
                          {"slope_tile_shading", k_slope_tile_shading},
                          {"slope_cell_tile_shading", k_slope_cell_tile_shading}},
                         readings(), true, constants_, tuning);
    const uint64_t blocks = uint64_t{divide_up(format.width, kBlock)} * (divide_up(format.height, kBlock));
    blocks_ = gpu::DeviceBuffer(context, "block means", blocks * sizeof(float), gpu::Memory::Device);
    block_words_ = gpu::TexelView(context, blocks_, VK_FORMAT_R32_SFLOAT);
    block_groups_ = static_cast<uint32_t>(divide_up(blocks, workgroup_));
    block_kernel_ = gpu::Kernel(context, {"block_means", k_block_means},
                                {{Texels, Storage}, sizeof push_, {workgroup_, 1, 1}, {}});
  } else {
    push_.in_pitch = PaddedLayout(format).pitch;
    weights_ = weights_of(context, sensor.photometric, format.max_gray());
    constants_ = {tile_rows_, sensor.photometric.wx.size() > 3, place_degree(sensor.photometric)};
    kernel_ = kernel_for(context, right_sides,
                         {{"slope_photometric", k_slope_photometric},
                          {"slope_coarse_photometric", k_slope_coarse_photometric},
                          {"slope_tile_photometric", k_slope_tile_photometric},
                          {"slope_cell_tile_photometric", k_slope_cell_tile_photometric}},
                         readings(), true, constants_, tuning);
  }
}

Slope::Slope(gpu::Context& context, uint32_t width, uint32_t height, RightSides right_sides,
             const Tuning& tuning)
    : tile_rows_(rows_for(tuning)),
      workgroup_(tuning.slope_workgroup),
      tiled_(tuning.slope_tiles != 0),
      right_sides_(right_sides) {
  push_.width = width;
  push_.height = height;
  push_.pitch = push_.in_pitch = grid_for(width, height).pitch;
  push_.coarse_pitch = coarser(grid_for(width, height)).pitch;
  push_.scale = 1;
  kernel_ = kernel_for(context, right_sides,
                       {{"slope_given", k_slope_given},
                        {"slope_coarse_given", k_slope_coarse_given},
                        {"slope_tile_given", k_slope_tile_given},
                        {"slope_cell_tile_given", k_slope_cell_tile_given}},
                       {gpu::Binding::Texels, gpu::Binding::Texels}, false, {tile_rows_}, tuning);
}

std::vector<gpu::Binding> Slope::readings() const {
  using enum gpu::Binding;
  if (shading_) return {Texels, Texels, Texels};
  return {Texels, Texels, Texels, Texels, Uniform};
}

uint32_t Slope::strips() const {
  const uint32_t columns = (push_.pitch + 1) / 2;  // two texels to an invocation
  return columns * divide_up(push_.height, tile_rows_);
}

std::array<uint32_t, 3> Slope::groups() const {
  return {divide_up(strips(), workgroup_), 1, 1};
}

uint64_t Slope::clipped_px(std::span<const uint32_t> clipped) const {
  return std::accumulate(clipped.begin(), clipped.begin() + strips(), uint64_t{0});
}

void Slope::dispatch(gpu::Commands& commands, std::vector<gpu::Argument> arguments,
                     const Surface& surface) const {
  if (right_sides_ == RightSides::Pixels) arguments.emplace_back(&surface.right_side().buffer);
  arguments.emplace_back(&surface.coarse_right_side().buffer);
  const std::array<uint32_t, 3> tiles{divide_up(push_.width, shared::kTileWidth),
                                      divide_up(push_.height, shared::kTileHeight), 1};
  commands.dispatch(kernel_, arguments, &push_, tiled_ ? tiles : groups());
  commands.barrier();
}

// Shading reads the contact stage's image, and its gray's gradient from means of blocks.
std::vector<gpu::Argument> Slope::record_reading(gpu::Commands& commands, const PaddedImage& frame,
                                                 const PaddedImage& background) const {
  if (shading_) {
    commands.dispatch(block_kernel_, {&filtered_texels_, &blocks_}, push_, {block_groups_, 1, 1});
    commands.barrier();
    return {&filtered_texels_, &filtered_pairs_, &block_words_};
  }
  return {&frame.pairs(), &frame.words(), &background.pairs(), &background.words(), &weights_};
}

void Slope::record(gpu::Commands& commands, const PaddedImage& frame, const PaddedImage& background,
                   const Surface& surface, const gpu::DeviceBuffer& clipped) const {
  const auto scope = commands.scope("slope");
  std::vector<gpu::Argument> arguments = record_reading(commands, frame, background);
  arguments.emplace_back(&clipped);
  dispatch(commands, std::move(arguments), surface);
}

void Slope::prepare_slopes(gpu::Context& context) {
  const gpu::Shader shader = shading_ ? gpu::Shader{"slope_store_shading", k_slope_store_shading}
                                      : gpu::Shader{"slope_store_photometric", k_slope_store_photometric};
  std::vector<gpu::Binding> bindings = readings();
  bindings.resize(bindings.size() + 3, gpu::Binding::Storage);
  store_kernel_ =
      gpu::Kernel(context, shader, {std::move(bindings), sizeof push_, {workgroup_, 1, 1}, constants_});
}

void Slope::record_slopes(gpu::Commands& commands, const PaddedImage& frame, const PaddedImage& background,
                          const FloatMap& p, const FloatMap& q, const gpu::DeviceBuffer& clipped) const {
  const auto scope = commands.scope("slopes");
  std::vector<gpu::Argument> arguments = record_reading(commands, frame, background);
  for (const gpu::DeviceBuffer* to : {&clipped, &p.buffer, &q.buffer}) arguments.emplace_back(to);
  commands.dispatch(store_kernel_, arguments, &push_, groups());
  commands.barrier();
}

void Slope::prepare_known(gpu::Context& context) {
  const auto make = [&](const gpu::Shader& shader, size_t outputs) {
    std::vector<gpu::Binding> bindings = readings();
    bindings.insert(bindings.end(), {gpu::Binding::Storage, gpu::Binding::Texels});
    bindings.resize(bindings.size() + outputs, gpu::Binding::Storage);
    return gpu::Kernel(context, shader, {std::move(bindings), sizeof push_, {workgroup_, 1, 1}, constants_});
  };
  if (shading_) {
    known_kernel_ = make({"known_slope_shading", k_known_slope_shading}, 1);
    faces_kernel_ = make({"weighted_slope_shading", k_weighted_slope_shading}, 4);
  } else {
    known_kernel_ = make({"known_slope_photometric", k_known_slope_photometric}, 1);
    faces_kernel_ = make({"weighted_slope_photometric", k_weighted_slope_photometric}, 4);
  }
}

void Slope::record_known(gpu::Commands& commands, const PaddedImage& frame, const PaddedImage& background,
                         const gpu::TexelView& confidence, const FloatMap& right,
                         const gpu::DeviceBuffer& clipped, const CellFaceMaps* faces) const {
  const auto scope = commands.scope("slope");
  std::vector<gpu::Argument> arguments = record_reading(commands, frame, background);
  arguments.insert(arguments.end(), {&clipped, &confidence, &right.buffer});
  if (faces) arguments.insert(arguments.end(), {&faces->across, &faces->down, &faces->field});
  commands.dispatch(faces ? faces_kernel_ : known_kernel_, arguments, &push_, groups());
  commands.barrier();
}

void Slope::record_given(gpu::Commands& commands, const FloatMap& p, const FloatMap& q,
                         const Surface& surface) const {
  const auto scope = commands.scope("slope");
  dispatch(commands, {&p.texels, &q.texels}, surface);
}

}  // namespace palpate
