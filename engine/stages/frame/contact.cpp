#include "engine/stages/frame/contact.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "engine/base/divide_up.h"
#include "engine/gpu/commands.h"
#include "engine/gpu/context.h"
#include "shaders/contact.spv.h"
#include "shaders/contact_color.spv.h"
#include "shaders/contact_moments.spv.h"
#include "shaders/contact_parts.spv.h"
#include "shaders/contact_parts_color.spv.h"
#include "shaders/contact_parts_wide.spv.h"
#include "shaders/contact_tile.spv.h"
#include "shaders/contact_tile_color.spv.h"
#include "shaders/contact_tile_parts.spv.h"
#include "shaders/contact_tile_parts_color.spv.h"
#include "shaders/contact_tile_parts_wide.spv.h"
#include "shaders/contact_tile_wide.spv.h"
#include "shaders/contact_unfiltered.spv.h"
#include "shaders/contact_unfiltered_color.spv.h"
#include "shaders/contact_unfiltered_parts.spv.h"
#include "shaders/contact_unfiltered_parts_color.spv.h"
#include "shaders/contact_unfiltered_parts_wide.spv.h"
#include "shaders/contact_unfiltered_wide.spv.h"
#include "shaders/contact_wide.spv.h"

namespace palpate {
namespace {

// Rows that a tile fetches beyond its own; without the filter about what its last sums cost.
constexpr uint32_t kLeadIn = 4;

// Tile of a workgroup of contact_tile.comp: a row of eight words for each of eight rows, an invocation a
// word.
constexpr uint32_t kContactTileRows = 8, kContactTileWorkgroup = 64;
// Workgroups of parts in a row of the dispatch, which devices limit to 65535.
constexpr uint32_t kPartsAcross = 32768;

// The tuning's height of a tile, or the one that fetches the fewest rows in all.
uint32_t rows_for(const Tuning& tuning, uint32_t height, bool keep_filtered) {
  if (tuning.contact_tiles) return kContactTileRows;
  if (keep_filtered) return tuning.contact_rows_keeping;
  if (tuning.contact_rows > 0) return tuning.contact_rows;
  uint32_t best = shared::kMaxTileRows / 2;
  const auto fetched = [height](uint32_t rows) {
    return uint64_t{divide_up(height, rows)} * (rows + kLeadIn);
  };
  for (uint32_t rows = best; rows <= shared::kMaxTileRows; rows += 2)
    if (fetched(rows) < fetched(best)) best = rows;
  return best;
}

gpu::Shader unfiltered_for(const FrameFormat& format) {
  if (format.channels == 3) return {"contact_unfiltered_color", k_contact_unfiltered_color};
  if (format.bit_depth > 8) return {"contact_unfiltered_wide", k_contact_unfiltered_wide};
  return {"contact_unfiltered", k_contact_unfiltered};
}

gpu::Shader filtered_for(const FrameFormat& format) {
  if (format.channels == 3) return {"contact_color", k_contact_color};
  if (format.bit_depth > 8) return {"contact_wide", k_contact_wide};
  return {"contact", k_contact};
}

gpu::Shader parts_for(const FrameFormat& format, Filter filter) {
  if (filter == Filter::None) {
    if (format.channels == 3) return {"contact_unfiltered_parts_color", k_contact_unfiltered_parts_color};
    if (format.bit_depth > 8) return {"contact_unfiltered_parts_wide", k_contact_unfiltered_parts_wide};
    return {"contact_unfiltered_parts", k_contact_unfiltered_parts};
  }
  if (format.channels == 3) return {"contact_parts_color", k_contact_parts_color};
  if (format.bit_depth > 8) return {"contact_parts_wide", k_contact_parts_wide};
  return {"contact_parts", k_contact_parts};
}

gpu::Shader tile_for(const FrameFormat& format) {
  if (format.channels == 3) return {"contact_tile_color", k_contact_tile_color};
  if (format.bit_depth > 8) return {"contact_tile_wide", k_contact_tile_wide};
  return {"contact_tile", k_contact_tile};
}

gpu::Shader tile_parts_for(const FrameFormat& format) {
  if (format.channels == 3) return {"contact_tile_parts_color", k_contact_tile_parts_color};
  if (format.bit_depth > 8) return {"contact_tile_parts_wide", k_contact_tile_parts_wide};
  return {"contact_tile_parts", k_contact_tile_parts};
}

// Fraction bits that a stored value drops so that it fits 16 bits.
uint32_t keep_shift(const FrameFormat& format) {
  return format.bit_depth > 8 ? format.bit_depth - 8 : 0;
}

}  // namespace

Contact::Contact(gpu::Context& context, const Sensor& sensor, const FrameFormat& format, bool keep_filtered,
                 const Tuning& tuning, bool keep_marks)
    : workgroup_(tuning.contact_workgroup) {
  const PaddedLayout layout(format);
  tile_columns_ = 2 * layout.pixels_per_texel;
  tile_rows_ = rows_for(tuning, format.height, keep_filtered);
  push_.width = format.width;
  push_.height = format.height;
  push_.pitch = layout.pitch;
  push_.tiles_x = layout.tiles;
  push_.tiles_y = divide_up(format.height, tile_rows_);
  push_.threshold = static_cast<uint32_t>(std::lround(sensor.threshold_gray * 128));
  push_.saturation = sensor.saturation_gray;
  push_.dead = dead_gray(sensor);
  units_per_gray_ = 256u >> keep_shift(format);
  assert(!keep_filtered || sensor.filter == Filter::Binomial5);
  if (tuning.contact_tiles)
    make_tiles(context, sensor, format, keep_filtered, keep_marks);
  else
    make_strips(context, sensor, format, keep_filtered, keep_marks);
  const uint64_t filtered_bytes =
      keep_filtered ? uint64_t{push_.tiles_x} * tile_columns_ * 2 * format.height : 16;
  filtered_ = gpu::DeviceBuffer(context, "filtered image", filtered_bytes, gpu::Memory::Device);
  marks_ = gpu::DeviceBuffer(context, "contact marks",
                             keep_marks ? uint64_t{tiles()} * tile_rows_ * sizeof(uint32_t) : 16,
                             gpu::Memory::Device);
}

void Contact::make_strips(gpu::Context& context, const Sensor& sensor, const FrameFormat& format,
                          bool keep_filtered, bool keep_marks) {
  const bool subtracts = sensor.background.kind == BackgroundKind::Untouched;
  const auto signal = static_cast<uint32_t>(sensor.signal);
  using enum gpu::Binding;
  gpu::KernelInterface interface;
  interface.push_bytes = sizeof push_;
  interface.local_size = {workgroup_, 1, 1};
  if (sensor.filter == Filter::Binomial5) {
    interface.bindings = {Texels, Texels, Texels, Texels, Storage, Storage, Storage};
    interface.constants = {tile_rows_, signal, keep_filtered, keep_shift(format), subtracts, keep_marks};
    kernel_ = gpu::Kernel(context, filtered_for(format), interface);
  } else if (subtracts || format.channels > 1 || format.bit_depth > 8) {
    form_ = Form::Unfiltered;
    interface.bindings = {Texels, Texels, Storage, Storage};
    interface.constants = {tile_rows_, signal, subtracts, keep_marks};
    kernel_ = gpu::Kernel(context, unfiltered_for(format), interface);
  } else {
    form_ = Form::Moments;
    interface.bindings = {Texels, Storage, Storage};
    const bool bright = push_.threshold > 127 * 128;  // rounded up to whole gray levels, 128 or more
    interface.constants = {tile_rows_, bright, keep_marks};
    kernel_ = gpu::Kernel(context, {"contact_moments", k_contact_moments}, interface);
  }
  if (!keep_marks) return;
  gpu::KernelInterface of_parts{{}, sizeof push_, {workgroup_, 1, 1}, {}};
  if (sensor.filter == Filter::Binomial5) {
    of_parts.bindings = {Texels, Texels, Texels, Texels, Storage, Storage, Texels, Storage};
    of_parts.constants = {tile_rows_, signal, 0, 0, subtracts, 0};
  } else {
    of_parts.bindings = {Texels, Texels, Storage, Storage, Texels, Storage};
    of_parts.constants = {tile_rows_, signal, subtracts, 0};
  }
  parts_kernel_ = gpu::Kernel(context, parts_for(format, sensor.filter), of_parts);
}

void Contact::make_tiles(gpu::Context& context, const Sensor& sensor, const FrameFormat& format,
                         bool keep_filtered, bool keep_marks) {
  form_ = Form::Tiles;
  const auto signal = static_cast<uint32_t>(sensor.signal);
  const bool filters = sensor.filter == Filter::Binomial5;
  const bool subtracts = sensor.background.kind == BackgroundKind::Untouched;
  using enum gpu::Binding;
  kernel_ = gpu::Kernel(context, tile_for(format),
                        {{Texels, Texels, Storage, Storage, Storage},
                         sizeof push_,
                         {kContactTileWorkgroup, 1, 1},
                         {filters, signal, keep_filtered, keep_shift(format), subtracts, keep_marks}});
  if (!keep_marks) return;
  parts_kernel_ = gpu::Kernel(context, tile_parts_for(format),
                              {{Texels, Texels, Storage, Storage, Texels, Storage},
                               sizeof push_,
                               {kContactTileWorkgroup, 1, 1},
                               {filters, signal, 0, 0, subtracts, 0}});
}

void Contact::record(gpu::Commands& commands, const PaddedImage& frame, const PaddedImage& background,
                     const gpu::DeviceBuffer& records) const {
  const auto scope = commands.scope("contact");
  const std::array<uint32_t, 3> groups{divide_up(tiles(), workgroup_), 1, 1};
  if (form_ == Form::Tiles) {
    commands.dispatch(kernel_, {&frame.words(), &background.words(), &records, &filtered_, &marks_}, push_,
                      {push_.tiles_x, push_.tiles_y, 1});
  } else if (form_ == Form::Filtered) {
    commands.dispatch(kernel_,
                      {&frame.texels(), &frame.words(), &background.texels(), &background.words(), &records,
                       &filtered_, &marks_},
                      push_, groups);
  } else if (form_ == Form::Unfiltered) {
    commands.dispatch(kernel_, {&frame.texels(), &background.texels(), &records, &marks_}, push_, groups);
  } else {
    commands.dispatch(kernel_, {&frame.texels(), &records, &marks_}, push_, groups);
  }
  commands.barrier();
}

void Contact::record_parts(gpu::Commands& commands, const PaddedImage& frame, const PaddedImage& background,
                           const Parts& parts, const gpu::DeviceBuffer& records) const {
  shared::ContactPush push = push_;
  push.parts = parts.capacity;
  const std::array<uint32_t, 3> groups{divide_up(parts.capacity, workgroup_), 1, 1};
  if (form_ == Form::Tiles) {
    const uint32_t across = std::min(parts.capacity, kPartsAcross);
    commands.dispatch(
        parts_kernel_,
        {&frame.words(), &background.words(), &records, &parts.list, &parts.marks, &parts.count}, push,
        {across, divide_up(parts.capacity, across), 1});
  } else if (form_ == Form::Filtered) {
    commands.dispatch(parts_kernel_,
                      {&frame.texels(), &frame.words(), &background.texels(), &background.words(), &records,
                       &parts.list, &parts.marks, &parts.count},
                      push, groups);
  } else {
    commands.dispatch(
        parts_kernel_,
        {&frame.texels(), &background.texels(), &records, &parts.list, &parts.marks, &parts.count}, push,
        groups);
  }
  commands.barrier();
}

ContactMoments Contact::sum(std::span<const shared::ContactRecord> records) const {
  ContactMoments m;
  for (uint32_t tile = 0; tile < tiles(); ++tile) {
    const shared::ContactRecord& r = records[tile];
    m.border = m.border || r.border != 0;
    if (r.area > 0)
      add(m, r, tile);
    else
      m.saturated += r.saturated;
  }
  return m;
}

void Contact::add(ContactMoments& m, const shared::ContactRecord& r, uint32_t tile) const {
  const int64_t center_x = push_.width / 2;
  const int64_t center_y = push_.height / 2;
  // x = left + c, y = bottom - k
  const int64_t left = int64_t{tile % push_.tiles_x} * tile_columns_ - center_x;
  const int64_t bottom = (int64_t{tile / push_.tiles_x} + 1) * tile_rows_ - center_y;
  const int64_t n = r.area, c = r.sum_c, cc = r.sum_cc, k = r.sum_k, kk = r.sum_kk, ck = r.sum_ck;
  const auto whole = [](uint32_t low, uint32_t high) {
    return int64_t{low} + int64_t{shared::kGrayBase} * high;
  };
  const int64_t gray = whole(r.gray_low, r.gray_high);
  m.area += r.area;
  m.gray += static_cast<uint64_t>(gray);
  m.gray_x += left * gray + whole(r.gray_c_low, r.gray_c_high);
  m.gray_y += bottom * gray - whole(r.gray_k_low, r.gray_k_high);
  m.x += left * n + c;
  m.y += bottom * n - k;
  m.xx += left * left * n + 2 * left * c + cc;
  m.yy += bottom * bottom * n - 2 * bottom * k + kk;
  m.xy += left * bottom * n + bottom * c - left * k - ck;
  m.peak = std::max(m.peak, r.peak);
  m.saturated += r.saturated;
}

}  // namespace palpate
