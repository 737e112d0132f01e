// Load law: what a place of the block shows at one load, as it would be at another.
#pragma once

#include <array>
#include <optional>

#include "engine/lump/observation/observation.h"

namespace palpate {

/// Where a slide's pad lies, seen from where it began.
struct SlideWay {
  std::array<double, 2> at_mm = {0, 0};
  double turn_rad = 0;

  SlideWay then(const SlideWay& next) const;
};

/// A slide shows each place at one load. Pressure at other loads goes as the block's mean does, as that of a
/// column which widens, times by how much the place where the slide began showed it otherwise as its force
/// rose. Beside that place a plane through it holds.
class LoadLaw {
 public:
  /// `began`: the press before the slide, at rising loads up to that of the slide; none: nobody saw it.
  LoadLaw(std::optional<lump::Observation> began, const std::array<double, 3>& block_mm, double young_Pa);

  /// A map seen at `from_N`, as it would be at `to_N`. `error_Pa`: standard error by the law, of a value.
  PressureMap change(const PressureMap& seen, double from_N, double to_N, const SlideWay& way,
                     double& error_Pa) const;
  /// By how much the block is wider at one force than at another.
  double wider(double force_N, double than_N) const;

 private:
  double compression(double force_N) const;

  std::optional<lump::Observation> began_;
  std::array<double, 3> block_mm_;
  double young_Pa_;
};

}  // namespace palpate
