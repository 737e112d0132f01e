// Options of a direct inversion: start, errors, effort.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "engine/base/stop.h"
#include "engine/lump/fem_inverse/response.h"
#include "engine/lump/observation/observation.h"

namespace palpate::lump {

struct Model;

struct DirectInversionOptions {
  ResponseOptions model;
  /// Where a search starts; its shape and axis stay as given.
  struct Start {
    Case::Lump lump;
    double odds = 1;  ///< how likely this shape is before it is fitted, relative to the others
  };
  /// Each is searched from: shapes that fit as well widen the best one's intervals. Empty: a sphere at the
  /// place of the bump.
  std::vector<Start> starts;
  /// Leads the search among lumps that it reaches: elements are asked where it arrives, and what they differ
  /// from it is added. Null: elements alone.
  std::shared_ptr<const Model> emulator;
  uint32_t most_rounds = 16;
  /// Limit of what the elements do about lumps, see Effort; 0: none. Tissue alone is pressed in any case.
  double most_work = 0;
  /// Another method's answer, which stands where that limit ends the search before it has a lump, and whose
  /// intervals are added where it ends after it.
  std::optional<Estimate> otherwise;
  StopAsked stop;                  ///< asked many times a second
  double gauge_fraction = 0.001;   ///< standard deviation of a force of the observation
  double young_fraction = 0.01;    ///< of the tissue's modulus
  double model_fraction = 0.0015;  ///< of the observation's peak, what the elements' own values are off
  /// Error of the elements, share of a bump's height at each place: once for the whole bump, and once in
  /// common with neighbours within some 3 mm. The same at all loads, and what of it changes from the first
  /// load to the last. As 64 and 40 cells that do not follow a lump differ from those that do.
  double bump_fraction = 0.008, bump_change_fraction = 0.003;
};

}  // namespace palpate::lump
