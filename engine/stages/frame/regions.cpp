#include "engine/stages/frame/regions.h"

#include <algorithm>
#include <bit>
#include <limits>
#include <numeric>

#include "engine/gpu/commands.h"
#include "engine/gpu/context.h"
#include "engine/stages/workgroups.h"
#include "shaders/regions.spv.h"

namespace palpate {
namespace {

constexpr uint32_t kSpareParts = 4096;  // beyond one of each tile

uint64_t whole(uint32_t low, uint32_t high) {
  return low | (uint64_t{high} << 32);
}

// A row or column of pixels with both neighbours of each.
uint64_t spread(uint64_t bits) {
  return bits | (bits << 1) | (bits >> 1);
}

}  // namespace

Regions::Regions(gpu::Context& context, const Contact& contact, const FrameFormat& format)
    : contact_(contact), width_(format.width), height_(format.height) {
  push_.tiles = contact.tiles();
  push_.capacity = kSpareParts + contact.tiles();
  using enum gpu::Binding;
  kernel_ = gpu::Kernel(context, {"regions", k_regions},
                        {{Texels, Storage, Storage, Storage, Storage, Storage},
                         sizeof push_,
                         {kWorkgroup, 1, 1},
                         {contact.tile_rows(), contact.tile_columns()}});
  marks_ = gpu::TexelView(context, contact.marks(), VK_FORMAT_R32_UINT);
  part_marks_ = gpu::DeviceBuffer(context, "part marks",
                                  uint64_t{push_.capacity} * shared::kMaxTileRows * sizeof(uint32_t),
                                  gpu::Memory::Device);
  part_mark_texels_ = gpu::TexelView(context, part_marks_, VK_FORMAT_R32_UINT);
}

Regions::Slot Regions::slot(gpu::Context& context) const {
  const auto buffer = [&](const char* name, uint64_t bytes) {
    return gpu::DeviceBuffer(context, name, bytes, gpu::Memory::Readback);
  };
  return {buffer("region heads", uint64_t{push_.tiles} * sizeof(shared::RegionPart)),
          buffer("region parts", uint64_t{push_.capacity} * sizeof(shared::RegionPart)),
          buffer("region part records", uint64_t{push_.capacity} * sizeof(shared::ContactRecord)),
          buffer("region part count", sizeof(uint32_t))};
}

void Regions::start(const Slot& slot) {
  slot.count.as<uint32_t>()[0] = 0;
  slot.count.flush();
}

void Regions::record(gpu::Commands& commands, const PaddedImage& frame, const PaddedImage& background,
                     const gpu::DeviceBuffer& records, const Slot& slot) const {
  const auto scope = commands.scope("regions");
  commands.dispatch(kernel_, {&marks_, &records, &slot.heads, &slot.list, &part_marks_, &slot.count}, push_,
                    workgroups(push_.tiles));
  commands.barrier();
  contact_.record_parts(commands, frame, background,
                        {slot.list, part_mark_texels_, slot.count, push_.capacity}, slot.records);
}

bool Regions::find(const Slot& slot, std::span<const shared::ContactRecord> records,
                   std::vector<Region>& regions) {
  regions.clear();
  if (!collect(slot, records)) return false;
  parent_.resize(parts_.size());
  std::iota(parent_.begin(), parent_.end(), 0u);
  for (uint32_t part = 0; part < parts_.size(); ++part) join_neighbours(part);

  constexpr uint32_t kNone = std::numeric_limits<uint32_t>::max();
  slot_of_.assign(parts_.size(), kNone);
  for (uint32_t part = 0; part < parts_.size(); ++part) {
    uint32_t& at = slot_of_[root(part)];
    const shared::RegionPart& p = *parts_[part].shape;
    const uint32_t left = p.tile % contact_.tiles_x() * contact_.tile_columns();
    const uint32_t top = p.tile / contact_.tiles_x() * contact_.tile_rows();
    const uint32_t x0 = left + static_cast<uint32_t>(std::countr_zero(p.columns));
    const uint32_t x1 = left + 32 - static_cast<uint32_t>(std::countl_zero(p.columns));
    const uint32_t y0 = top + p.first_row, y1 = top + p.last_row + 1;
    if (at == kNone) {
      at = static_cast<uint32_t>(regions.size());
      regions.push_back({{}, {x0, y0, x1 - x0, y1 - y0}});
    }
    Region& region = regions[at];
    contact_.add(region.moments, *parts_[part].sums, p.tile);
    PixelRect& box = region.box;
    const uint32_t end_x = std::max(box.x + box.width, x1), end_y = std::max(box.y + box.height, y1);
    box.x = std::min(box.x, x0);
    box.y = std::min(box.y, y0);
    box.width = end_x - box.x;
    box.height = end_y - box.y;
    region.moments.border = region.moments.border || x0 == 0 || y0 == 0 || x1 == width_ || y1 == height_;
  }
  return true;
}

// Parts in order of tiles; false where the list overflowed, or does not hold all of a tile's contact.
bool Regions::collect(const Slot& slot, std::span<const shared::ContactRecord> records) {
  slot.count.invalidate();
  slot.heads.invalidate();
  slot.list.invalidate();
  slot.records.invalidate();
  const uint32_t count = slot.count.as<const uint32_t>()[0];
  if (count > push_.capacity) return false;
  const auto heads = slot.heads.as<const shared::RegionPart>();
  const auto list = slot.list.as<const shared::RegionPart>();
  const auto sums = slot.records.as<const shared::ContactRecord>();
  listed_.resize(count);
  std::iota(listed_.begin(), listed_.end(), 0u);
  // The device lists them as they come.
  std::ranges::sort(listed_, [&](uint32_t a, uint32_t b) {
    return list[a].tile != list[b].tile ? list[a].tile < list[b].tile : list[a].order < list[b].order;
  });
  parts_.clear();
  first_.assign(size_t{push_.tiles} + 1, 0);
  auto next = listed_.begin();
  for (uint32_t tile = 0; tile < push_.tiles; ++tile) {
    first_[tile] = static_cast<uint32_t>(parts_.size());
    if (records[tile].area == 0) continue;
    uint32_t area = 0;
    if (heads[tile].alone) {
      parts_.push_back({&heads[tile], &records[tile]});
      area = heads[tile].area;
    }
    for (; next != listed_.end() && list[*next].tile == tile; ++next) {
      parts_.push_back({&list[*next], &sums[*next]});
      area += sums[*next].area;
    }
    if (area != records[tile].area) return false;
  }
  first_[push_.tiles] = static_cast<uint32_t>(parts_.size());
  return next == listed_.end();
}

uint32_t Regions::root(uint32_t part) {
  while (parent_[part] != part) part = parent_[part] = parent_[parent_[part]];
  return part;
}

void Regions::join(uint32_t a, uint32_t b) {
  a = root(a);
  b = root(b);
  parent_[std::max(a, b)] = std::min(a, b);
}

// With the tiles to the right and below; those to the left and above look at this one.
void Regions::join_neighbours(uint32_t part) {
  const shared::RegionPart& p = *parts_[part].shape;
  const uint32_t across = contact_.tiles_x(), last_column = contact_.tile_columns() - 1;
  const uint32_t x = p.tile % across, below = p.tile + across;
  const auto each = [&](uint32_t tile, auto touches) {
    for (uint32_t other = first_[tile]; other < first_[tile + 1]; ++other)
      if (touches(*parts_[other].shape)) join(part, other);
  };
  if (x + 1 < across) {
    const uint64_t right = spread(whole(p.right_low, p.right_high));
    if (right)
      each(p.tile + 1,
           [&](const shared::RegionPart& q) { return (right & whole(q.left_low, q.left_high)) != 0; });
  }
  if (below >= push_.tiles || p.bottom == 0) return;
  const uint64_t bottom = spread(p.bottom);
  each(below, [&](const shared::RegionPart& q) { return (bottom & q.top) != 0; });
  if (x + 1 < across && (p.bottom >> last_column & 1u))
    each(below + 1, [](const shared::RegionPart& q) { return (q.top & 1u) != 0; });
  if (x > 0 && (p.bottom & 1u))
    each(below - 1, [&](const shared::RegionPart& q) { return (q.top >> last_column & 1u) != 0; });
}

}  // namespace palpate
