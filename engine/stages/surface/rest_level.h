// Rest level stage: where the untouched surface lies in a height map that is known up to a constant.
#pragma once

#include <cstdint>
#include <span>

#include "engine/gpu/kernel.h"
#include "engine/measure/height_rows.h"
#include "engine/stages/surface/surface.h"
#include "shaders/shared/contact.h"
#include "shaders/shared/grid.h"

namespace palpate {
class Contact;

struct RestHeight {
  double level_mm = 0;          ///< raw height of the untouched surface
  double highest_mm = 0;        ///< raw height of the deepest point
  bool from_untouched = false;  ///< false: no tile is free of contact, the level is the whole frame's mean
};

class RestLevel {
 public:
  RestLevel(gpu::Context& context, const Contact& contact, const Grid& grid, const Tuning& tuning);

  uint64_t record_bytes() const;
  void record(gpu::Commands& commands, const FloatMap& depth, const gpu::DeviceBuffer& contact,
              const gpu::DeviceBuffer& records) const;
  /// The kernel's records of heights that the host has changed.
  void measure(const HeightRows& heights, std::span<const shared::ContactRecord> contact,
               std::span<shared::RestLevelRecord> records) const;
  /// The mean over untouched tiles along the frame's border, where the pad is least drawn in by the contact;
  /// without any, over all untouched tiles; without those, over the frame.
  RestHeight find(std::span<const shared::ContactRecord> contact,
                  std::span<const shared::RestLevelRecord> records) const;
  /// Indented volume, px^2 mm: over tiles with contact, their mean depth below `level_mm` times their pixels.
  /// A touched tile counts whole, with what lies around the contact in it.
  double volume_px_mm(std::span<const shared::ContactRecord> contact,
                      std::span<const shared::RestLevelRecord> records, double level_mm) const;

 private:
  shared::RestLevelPush push_{};
  uint32_t workgroup_ = 0;
  gpu::Kernel kernel_;
};

}  // namespace palpate
