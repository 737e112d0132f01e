#include "engine/stages/frame/confidence.h"

#include <algorithm>
#include <cstring>
#include <limits>

#include "engine/base/divide_up.h"
#include "engine/base/simd.h"
#include "engine/gpu/commands.h"
#include "engine/gpu/context.h"
#include "engine/sensor/outline.h"
#include "engine/stages/frame/markers.h"
#include "engine/stages/workgroups.h"
#include "shaders/confidence.spv.h"
#include "shaders/confidence_color.spv.h"
#include "shaders/confidence_markers.spv.h"
#include "shaders/confidence_weights.spv.h"
#include "shaders/confidence_wide.spv.h"

namespace palpate {
namespace {

constexpr uint32_t kConfidenceRowsOnCpu = 16, kConfidenceRowsOnGpu = 4;
constexpr uint32_t kFilterReach_px = 2;  // of the contact stage's 5 x 5 filter

gpu::Shader shader_for(const FrameFormat& format, bool markers) {
  if (markers) return {"confidence_markers", k_confidence_markers};
  if (format.channels == 3) return {"confidence_color", k_confidence_color};
  if (format.bit_depth > 8) return {"confidence_wide", k_confidence_wide};
  return {"confidence", k_confidence};
}

uint32_t brightest(const Frame& frame, uint32_t x, uint32_t y) {
  uint32_t value = 0;
  for (uint32_t channel = 0; channel < frame.format.channels; ++channel)
    value = std::max(value, frame.at(channel, x, y));
  return value;
}

/// A pixel whose brightest channel lies outside of its limits, if there is one.
template <typename Pixel, uint32_t Channels>
struct OutsideLimits {
  const Frame& frame;
  const Pixel *darkest, *brightest;
  bool& found;

  PALPATE_INLINE void run() const {
    typedef Pixel Lanes __attribute__((vector_size(32)));
    constexpr size_t kLanes = sizeof(Lanes) / sizeof(Pixel), kBlock = 64 * kLanes;
    const size_t plane = size_t{frame.format.width} * frame.format.height;
    const auto* value = reinterpret_cast<const Pixel*>(frame.pixels());
    size_t i = 0;
    while (i + kBlock <= plane && !found) {
      Lanes beyond{};
      for (const size_t end = i + kBlock; i < end; i += kLanes) {
        Lanes v, other;
        std::memcpy(&v, value + i, sizeof v);
        for (uint32_t c = 1; c < Channels; ++c) {
          std::memcpy(&other, value + c * plane + i, sizeof other);
          v = other > v ? other : v;
        }
        std::memcpy(&other, darkest + i, sizeof other);
        beyond |= (v < other) ? ~Lanes{} : Lanes{};
        std::memcpy(&other, brightest + i, sizeof other);
        beyond |= (v > other) ? ~Lanes{} : Lanes{};
      }
      for (size_t lane = 0; lane < kLanes; ++lane) found |= beyond[lane] != 0;
    }
    for (; i < plane && !found; ++i) {
      Pixel v = value[i];
      for (uint32_t c = 1; c < Channels; ++c) v = std::max(v, value[c * plane + i]);
      found = v < darkest[i] || v > brightest[i];
    }
  }
};

}  // namespace

ConfidenceMap::ConfidenceMap(gpu::Context& context, uint64_t bytes)
    : buffer(context, "confidence", bytes, gpu::Memory::Readback),
      pairs(context, buffer, VK_FORMAT_R32G32_UINT) {}

Confidence::Confidence(gpu::Context& context, const Sensor& sensor, const FrameFormat& format,
                       const Markers* markers)
    : sensor_(sensor),
      format_(format),
      markers_(markers),
      rows_(context.is_software() ? kConfidenceRowsOnCpu : kConfidenceRowsOnGpu),
      reach_(sensor.reading == SurfaceReading::Shading || sensor.reading == SurfaceReading::Elastic ||
                     sensor.reading == SurfaceReading::Lookup
                 ? kFilterReach_px
                 : 0) {
  push_.width = format.width;
  push_.height = format.height;
  push_.pitch = PaddedLayout(format).pitch;
  push_.groups = (format.width + 15) / 16;
  push_.saturation = sensor.saturation_gray;
  push_.shadow = shadow_gray(sensor);
  still_ = gpu::DeviceBuffer(context, "confidence of background", map_bytes(), gpu::Memory::Constant);
  still_texels_ = gpu::TexelView(context, still_, VK_FORMAT_R32G32B32A32_UINT);
  still_pairs_ = gpu::TexelView(context, still_, VK_FORMAT_R32G32_UINT);
  using enum gpu::Binding;
  std::vector<gpu::Binding> bindings{Texels, Texels, Texels, Storage, Storage};
  std::vector<uint32_t> constants{rows_, reach_};
  if (markers) {
    bindings.push_back(Texels);
    constants.push_back(markers->push().cell);
  }
  kernel_ = gpu::Kernel(context, shader_for(format, markers != nullptr),
                        {std::move(bindings), sizeof push_, {kWorkgroup, 1, 1}, std::move(constants)});
  weights_kernel_ = gpu::Kernel(context, {"confidence_weights", k_confidence_weights},
                                {{Texels, Storage}, sizeof push_, {kWorkgroup, 1, 1}, {}});
}

uint32_t Confidence::invocations() const {
  return push_.groups * divide_up(push_.height, rows_);
}

uint64_t Confidence::record_bytes() const {
  return uint64_t{invocations()} * sizeof(shared::ConfidenceRecord);
}

void Confidence::set_background(const Frame& background) {
  const uint32_t width = format_.width, height = format_.height, pitch = push_.groups * 16;
  const std::span<uint16_t> map = still_.as<uint16_t>();
  std::fill(map.begin(), map.end(), uint16_t{0});
  std::vector<uint8_t> saturated(size_t{width} * height);
  for (uint32_t y = 0; y < height; ++y)
    for (uint32_t x = 0; x < width; ++x)
      saturated[size_t{y} * width + x] = brightest(background, x, y) >= push_.saturation ? 1 : 0;
  const auto near_saturated = [&](uint32_t x, uint32_t y) {
    for (uint32_t v = y - std::min(y, reach_); v <= std::min(y + reach_, height - 1); ++v)
      for (uint32_t u = x - std::min(x, reach_); u <= std::min(x + reach_, width - 1); ++u)
        if (saturated[size_t{v} * width + u]) return true;
    return false;
  };
  still_unknown_px_ = still_partial_px_ = 0;
  for (uint32_t y = 0; y < height; ++y) {
    for (uint32_t x = 0; x < width; ++x) {
      uint32_t reasons = 0, confidence = shared::kFullConfidence;
      if (push_.shadow > 0) {
        const uint32_t value = brightest(background, x, y);
        confidence =
            std::min((value - std::min(value, push_.shadow)) * shared::kFullConfidence / push_.shadow,
                     shared::kFullConfidence);
        if (confidence < shared::kFullConfidence) reasons |= shared::kShadowed;
      }
      if (near_saturated(x, y)) reasons |= shared::kSaturated;
      if (sensor_.pad && !contains(*sensor_.pad, x, y)) reasons |= shared::kOutside;
      if (reasons & (shared::kSaturated | shared::kOutside)) confidence = 0;
      still_unknown_px_ += confidence == 0;
      still_partial_px_ += confidence > 0 && confidence < shared::kFullConfidence;
      map[size_t{y} * pitch + x] = static_cast<uint16_t>(confidence | (reasons << shared::kReasonShift));
    }
  }
  still_.flush();
  format_.bit_depth > 8 ? find_limits<uint16_t>() : find_limits<uint8_t>();
}

template <typename Pixel>
void Confidence::find_limits() {
  const std::vector<uint8_t> known = still_known();
  const uint32_t width = format_.width, height = format_.height;
  constexpr Pixel kMost = std::numeric_limits<Pixel>::max();
  darkest_.assign(known.size() * sizeof(Pixel), 0);
  brightest_.assign(known.size() * sizeof(Pixel), 0xff);
  auto* const darkest = reinterpret_cast<Pixel*>(darkest_.data());
  auto* const brightest = reinterpret_cast<Pixel*>(brightest_.data());
  const auto full_from = static_cast<Pixel>(std::min<uint32_t>(2 * push_.shadow, kMost));
  const auto not_full = static_cast<Pixel>(std::min<uint32_t>(push_.saturation - 1, kMost));
  for (uint32_t y = 0; y < height; ++y)
    for (uint32_t x = 0; x < width; ++x) {
      if (!known[size_t{y} * width + x]) continue;
      darkest[size_t{y} * width + x] = full_from;
      for (uint32_t v = y - std::min(y, reach_); v <= std::min(y + reach_, height - 1); ++v)
        for (uint32_t u = x - std::min(x, reach_); u <= std::min(x + reach_, width - 1); ++u)
          brightest[size_t{v} * width + u] = not_full;
    }
}

std::optional<bool> Confidence::lowered_by(const Frame& frame) const {
  if (markers_) return std::nullopt;
  bool found = still_partial_px_ > 0;
  const auto look = [&]<typename Pixel>(Pixel) {
    const auto* const darkest = reinterpret_cast<const Pixel*>(darkest_.data());
    const auto* const brightest = reinterpret_cast<const Pixel*>(brightest_.data());
    if (format_.channels == 3)
      run_widest(OutsideLimits<Pixel, 3>{frame, darkest, brightest, found});
    else
      run_widest(OutsideLimits<Pixel, 1>{frame, darkest, brightest, found});
  };
  format_.bit_depth > 8 ? look(uint16_t{}) : look(uint8_t{});
  return found;
}

void Confidence::record(gpu::Commands& commands, const PaddedImage& frame, const ConfidenceMap& map,
                        const gpu::DeviceBuffer& records) const {
  const auto scope = commands.scope("confidence");
  std::vector<gpu::Argument> arguments{&frame.texels(), &frame.words(), &still_texels_, &map.buffer,
                                       &records};
  if (markers_) arguments.emplace_back(&markers_->unknown_words());
  commands.dispatch(kernel_, arguments, &push_, workgroups(invocations()));
  commands.barrier();
}

std::vector<uint8_t> Confidence::still_known() const {
  const std::span<const uint16_t> map = still_.as<const uint16_t>();
  std::vector<uint8_t> known;
  known.reserve(size_t{format_.width} * format_.height);
  for (uint32_t y = 0; y < format_.height; ++y)
    for (const uint16_t pixel : map.subspan(size_t{y} * push_.groups * 16, format_.width))
      known.push_back((pixel & 255u) != 0);
  return known;
}

bool Confidence::only_still(const ConfidenceCounts& counts) const {
  return counts.unknown == still_unknown_px_ && counts.partial == 0;
}

void Confidence::record_weights(gpu::Commands& commands, const gpu::TexelView& map,
                                const FloatMap& weights) const {
  const uint32_t texels = (push_.width + 3) / 4 * push_.height;
  commands.dispatch(weights_kernel_, {&map, &weights.buffer}, push_, workgroups(texels));
  commands.barrier();
}

ConfidenceCounts Confidence::sum(std::span<const shared::ConfidenceRecord> records) const {
  ConfidenceCounts counts;
  for (uint32_t i = 0; i < invocations(); ++i) {
    counts.unknown += records[i].unknown;
    counts.partial += records[i].partial;
    counts.saturated += records[i].saturated;
    counts.shadowed += records[i].shadowed;
    counts.outside += records[i].outside;
  }
  return counts;
}

std::vector<uint16_t> Confidence::unpack(const ConfidenceMap& map) const {
  map.buffer.invalidate();
  const std::span<const uint16_t> from = map.buffer.as<const uint16_t>();
  std::vector<uint16_t> pixels;
  pixels.reserve(size_t{push_.width} * push_.height);
  for (uint32_t y = 0; y < push_.height; ++y) {
    const auto row = from.subspan(size_t{y} * push_.groups * 16, push_.width);
    pixels.insert(pixels.end(), row.begin(), row.end());
  }
  return pixels;
}

}  // namespace palpate
