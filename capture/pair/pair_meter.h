// Grip of two fingers from pair to pair: rows of pairs.csv.
#pragma once

#include <cstdint>
#include <optional>

#include "capture/pair/known_grip.h"
#include "capture/pair/pair_run.h"
#include "engine/grip/grip_quantities.h"

namespace palpate {

/// Exposure of both, or of the one alone.
int64_t time_of(const Matched<FingerTouch>& pair);
/// Where times count from that begin with this.
int64_t begin_of(const Matched<FingerTouch>& pair);

class PairMeter {
 public:
  /// Without a grip the forces along the normals are known, and nothing else.
  explicit PairMeter(const std::optional<KnownGrip>& grip);

  /// The next pair, or frame without a partner; times count from the first.
  GripFrame add(const Matched<FingerTouch>& pair);
  /// Forgets the grip so far, not where times count from.
  void restart() { meter_ = GripMeter(geometry_); }

 private:
  bool posed_;
  GripGeometry geometry_;
  GripMeter meter_;
  OpeningSeries opening_;
  std::optional<int64_t> zero_ns_;
};

}  // namespace palpate
