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
  /// Once a result. `separate`: of a press of its own, with which the largest begins anew.
  void follow(const Touch& touch, bool separate);
  /// Over the surface, in layout.headline. `separate`: the picture stands by itself, without a time.
  void draw(const HudFrame& frame, const Layout& layout, bool separate) const;
  /// The answer, and the line that explains it.
  std::string answer(bool separate) const;
  std::string rest(bool separate) const;

 private:
  struct Moment {
    Estimate value;
    double time_s = 0;
  };
  /// The largest value of all, which is often a doubtful one, and the largest valid one.
  struct Peak {
    std::optional<Moment> any, valid;
    void take(const Estimate& value, double time_s);
  };
  static std::string doubt(const Peak& peak, const char* unit, bool separate);

  Peak force_N_, depth_mm_, area_px_;
};

}  // namespace palpate::viz
