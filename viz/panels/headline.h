// The headline of a picture that is sent on: the largest force and depth so far, with errors and times.
#pragma once

#include <optional>
#include <string>

#include "palpate/touch.h"
#include "viz/render/hud_frame.h"
#include "viz/render/layout.h"

namespace palpate::viz {

class Headline {
 public:
  /// Once a result.
  void follow(const Touch& touch);
  /// Over the surface, in layout.headline. `separate`: the picture stands by itself, without a time.
  void draw(const HudFrame& frame, const Layout& layout, bool separate) const;
  /// The answer, and the line that explains it.
  std::string answer(bool separate) const;
  std::string rest(bool separate) const;

 private:
  /// A value and when it was; valid ones go before others.
  struct Peak {
    Estimate value;
    double time_s = 0;
  };
  static void take(std::optional<Peak>& peak, const Estimate& value, double time_s);

  std::optional<Peak> force_N_, depth_mm_, area_px_;
};

}  // namespace palpate::viz
