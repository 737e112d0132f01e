#include "engine/stages/frame/markers.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>

#include "engine/base/divide_up.h"
#include "engine/gpu/commands.h"
#include "engine/gpu/context.h"
#include "engine/measure/motion/skin_points.h"
#include "engine/stages/workgroups.h"
#include "shaders/marker_cells.spv.h"
#include "shaders/marker_dark.spv.h"
#include "shaders/marker_fill.spv.h"
#include "shaders/marker_frame.spv.h"
#include "shaders/marker_light.spv.h"
#include "shaders/marker_mask.spv.h"

namespace palpate {
namespace {

constexpr double kOfDarkness = 0.4;     // of the typical dot: fainter ones belong, and half of its edge
constexpr double kLeastDarkness = 0.1;  // of a dot: less is dirt
constexpr double kBlack_gray = 10;      // as kMarkerBlack
constexpr double kSmall_px = 6;         // dots below are found, and filled, pixel by pixel
constexpr double kMostSizes = 2;        // that a dot and the place it has left cover together
constexpr uint32_t kNothing = 2 * shared::kMarkerDark;  // no cell is as dark

// The padded image as a frame.
Frame read_back(gpu::Context& context, const PaddedImage& image, const FrameFormat& format) {
  const PaddedLayout layout(format);
  const gpu::DeviceBuffer staging(context, "untouched readback", layout.bytes, gpu::Memory::Readback);
  gpu::run_once(context, [&](gpu::Commands& commands) {
    commands.copy(image.buffer(), staging, layout.bytes);
    commands.host_barrier();
  });
  staging.invalidate();
  constexpr uint32_t kApron = 16;
  const uint32_t row_bytes = layout.pitch * kApron;
  const std::span<const uint8_t> bytes = staging.as<const uint8_t>();
  Frame frame;
  frame.reshape(format);
  for (uint32_t channel = 0; channel < format.channels; ++channel)
    for (uint32_t y = 0; y < format.height; ++y)
      std::copy_n(bytes.data() + size_t{channel * format.height + y} * row_bytes + kApron, format.width,
                  frame.row(channel, y));
  return frame;
}

}  // namespace

double marker_darkness(const Frame& untouched, const SkinPattern& pattern) {
  const uint32_t width = untouched.format.width, height = untouched.format.height;
  const std::vector<float> image = skin_image(untouched);
  const auto at = [&](double x, double y) {
    const auto i = static_cast<size_t>(std::clamp(std::lround(x), 0L, long{width} - 1));
    const auto j = static_cast<size_t>(std::clamp(std::lround(y), 0L, long{height} - 1));
    return double{image[j * width + i]};
  };
  std::vector<double> darkness;
  for (const auto& centre : find_skin_points(image, width, height, pattern)) {
    const double x = centre[0], y = centre[1];
    constexpr int kAround = 16;
    double dot = 0, around = 0;
    for (int k = 0; k < 9; ++k) dot += at(x + k % 3 - 1, y + k / 3 - 1) / 9;
    for (int k = 0; k < kAround; ++k) {
      const double angle = 2 * std::numbers::pi * k / kAround, radius = pattern.spacing_px / 2;
      around += at(x + radius * std::cos(angle), y + radius * std::sin(angle)) / kAround;
    }
    darkness.push_back((around - dot) / (around + untouched.format.channels * kBlack_gray));
  }
  constexpr size_t kLeast = 3;
  if (darkness.size() < kLeast) return 0;
  const auto middle = darkness.begin() + static_cast<std::ptrdiff_t>(darkness.size() / 2);
  std::nth_element(darkness.begin(), middle, darkness.end());
  return *middle < kLeastDarkness ? 0 : *middle;
}

Markers::Slot::Slot(gpu::Context& context, const FrameFormat& format, uint64_t record_bytes)
    : frame(context, "frame without markers", format),
      records(context, "marker records", record_bytes, gpu::Memory::Readback) {}

Markers::Markers(gpu::Context& context, const Sensor& sensor, const FrameFormat& format)
    : context_(context), format_(format), pattern_(sensor.skin.value()) {
  assert(format.channels == 3 && format.bit_depth == 8 && pattern_.kind == SkinKind::Markers);
  const auto parts = [](uint32_t length, uint32_t part) { return divide_up(length, part); };
  push_.width = format.width;
  push_.height = format.height;
  push_.pitch = PaddedLayout(format).pitch;
  push_.cell = pattern_.size_px < kSmall_px ? 1 : 2;
  push_.cells_x = parts(format.width, push_.cell);
  push_.cells_y = parts(format.height, push_.cell);
  push_.words = parts(push_.cells_x, 32);
  push_.blocks_x = parts(format.width, shared::kMarkerBlock);
  push_.blocks_y = parts(format.height, shared::kMarkerBlock);
  constexpr double kBlock_px = shared::kMarkerBlock, kRims_px = 12, kFurthest_px = 256;
  push_.closing = static_cast<uint32_t>(
      std::clamp(std::ceil(pattern_.size_px / (2 * kBlock_px)), 1.0, kFurthest_px / kBlock_px));
  push_.reach = static_cast<uint32_t>(
      std::min(std::ceil((kMostSizes * pattern_.size_px + kRims_px) / push_.cell), kFurthest_px));
  push_.threshold = kNothing;

  const auto map = [&](const char* name, uint32_t words) {
    Map made{{context, name, uint64_t{words} * sizeof(uint32_t), gpu::Memory::Device}, {}};
    made.texels = gpu::TexelView(context, made.buffer, VK_FORMAT_R32_UINT);
    return made;
  };
  const uint32_t words = push_.words * push_.cells_y, blocks = push_.blocks_x * push_.blocks_y;
  cells_ = map("marker cells", 32 * words);
  rest_cells_ = map("untouched cells", 32 * words);
  light_ = map("marker light", blocks);
  closed_ = map("marker light closed", blocks);
  dark_ = map("dark cells", words);
  marked_ = map("marked cells", words);
  rest_marked_ = map("marked untouched cells", words);
  unknown_ =
      gpu::DeviceBuffer(context, "unknown cells", uint64_t{words} * sizeof(uint32_t), gpu::Memory::Device);
  unknown_words_ = gpu::TexelView(context, unknown_, VK_FORMAT_R32_UINT);

  using enum gpu::Binding;
  const auto kernel = [&](const gpu::Shader& shader, std::vector<gpu::Binding> bindings,
                          std::vector<uint32_t> constants = {}) {
    return gpu::Kernel(context, shader,
                       {std::move(bindings), sizeof push_, {kWorkgroup, 1, 1}, std::move(constants)});
  };
  cells_kernel_ = kernel({"marker_cells", k_marker_cells}, {Texels, Storage, Storage}, {push_.cell});
  largest_ = kernel({"marker_light", k_marker_light}, {Texels, Storage}, {1});
  smallest_ = kernel({"marker_light", k_marker_light}, {Texels, Storage}, {0});
  dark_kernel_ = kernel({"marker_dark", k_marker_dark}, {Texels, Texels, Storage}, {push_.cell});
  for (const uint32_t subtract : {0u, 1u}) {
    Kernels& of = subtract ? change_ : untouched_;
    of.mask = kernel({"marker_mask", k_marker_mask}, {Texels, Texels, Storage}, {subtract});
    of.fill = kernel({"marker_fill", k_marker_fill}, {Texels, Texels, Texels, Storage, Storage, Storage},
                     {subtract});
    of.frame = kernel({"marker_frame", k_marker_frame},
                      {Texels, Texels, Texels, Texels, Texels, Texels, Storage}, {subtract, push_.cell});
  }
}

void Markers::record_cells(gpu::Commands& commands, const PaddedImage& image, const Map& cells) const {
  const uint32_t texels = (push_.width + 15) / 16;
  commands.dispatch(cells_kernel_, {&image.texels(), &cells.buffer, &light_.buffer}, push_,
                    workgroups(texels * push_.blocks_y));
  commands.barrier();
}

// Cells and marks of an image; of a frame with those of the untouched image.
void Markers::record_marked(gpu::Commands& commands, const PaddedImage& image, const Map& cells,
                            const Kernels& kernels, const gpu::DeviceBuffer& marked) const {
  const uint32_t words = push_.words * push_.cells_y, blocks = push_.blocks_x * push_.blocks_y;
  record_cells(commands, image, cells);
  commands.dispatch(largest_, {&light_.texels, &closed_.buffer}, push_, workgroups(blocks));
  commands.barrier();
  commands.dispatch(smallest_, {&closed_.texels, &light_.buffer}, push_, workgroups(blocks));
  commands.barrier();
  commands.dispatch(dark_kernel_, {&cells.texels, &light_.texels, &dark_.buffer}, push_, workgroups(words));
  commands.barrier();
  const Map& rest = &kernels == &change_ ? rest_marked_ : dark_;
  commands.dispatch(kernels.mask, {&dark_.texels, &rest.texels, &marked}, push_, workgroups(words));
  commands.barrier();
}

Frame Markers::set_background(const Frame& untouched, const PaddedImage& background) {
  const double darkness = kOfDarkness * marker_darkness(untouched, pattern_);
  push_.threshold =
      darkness > 0 ? static_cast<uint32_t>(std::lround(darkness * shared::kMarkerDark)) : kNothing;
  const uint32_t words = push_.words * push_.cells_y;
  const gpu::DeviceBuffer records(context_, "marker records", record_bytes(), gpu::Memory::Device);
  gpu::run_once(context_, [&](gpu::Commands& commands) {
    record_marked(commands, background, rest_cells_, untouched_, rest_marked_.buffer);
    commands.dispatch(untouched_.fill,
                      {&rest_cells_.texels, &rest_cells_.texels, &rest_marked_.texels, &rest_cells_.buffer,
                       &unknown_, &records},
                      push_, workgroups(words));
    commands.barrier();
    commands.dispatch(untouched_.frame,
                      {&background.words(), &background.words(), &rest_cells_.texels, &rest_cells_.texels,
                       &rest_marked_.texels, &unknown_words_, &background.buffer()},
                      push_, workgroups(4 * push_.pitch * push_.cells_y));
    commands.barrier();
    record_cells(commands, background, rest_cells_);
  });
  return read_back(context_, background, format_);
}

void Markers::record(gpu::Commands& commands, const PaddedImage& frame, const PaddedImage& background,
                     const Slot& slot) const {
  const auto scope = commands.scope("markers");
  record_marked(commands, frame, cells_, change_, marked_.buffer);
  commands.dispatch(
      change_.fill,
      {&cells_.texels, &rest_cells_.texels, &marked_.texels, &cells_.buffer, &unknown_, &slot.records}, push_,
      workgroups(push_.words * push_.cells_y));
  commands.barrier();
  commands.dispatch(change_.frame,
                    {&frame.words(), &background.words(), &cells_.texels, &rest_cells_.texels,
                     &marked_.texels, &unknown_words_, &slot.frame.buffer()},
                    push_, workgroups(4 * push_.pitch * push_.cells_y));
  commands.barrier();
}

MarkerCounts Markers::sum(std::span<const uint32_t> records) const {
  const uint64_t cell_px = uint64_t{push_.cell} * push_.cell;
  MarkerCounts counts;
  for (const uint32_t record : records.first(size_t{push_.words} * push_.cells_y)) {
    counts.marked += cell_px * (record & ((1u << shared::kMarkerCountBits) - 1));
    counts.unknown += cell_px * (record >> shared::kMarkerCountBits);
  }
  return counts;
}

uint64_t Markers::memory_bytes() const {
  uint64_t bytes = unknown_.bytes();
  for (const Map* map : {&cells_, &rest_cells_, &light_, &closed_, &dark_, &marked_, &rest_marked_})
    bytes += map->buffer.bytes();
  return bytes;
}

}  // namespace palpate
