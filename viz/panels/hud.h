// Head-up display around and over the surface: measurements, marks on the raw image, strip charts, section,
// settings, help.
#pragma once

#include <string>

#include "viz/live/history.h"
#include "viz/live/stats.h"
#include "viz/live/trail.h"
#include "viz/panels/charts/charts.h"
#include "viz/panels/headline.h"
#include "viz/panels/numbers/measurement.h"
#include "viz/panels/section.h"
#include "viz/render/format.h"
#include "viz/render/hud_frame.h"
#include "viz/render/layout.h"
#include "viz/render/surface_view.h"
#include "viz/render/view_state.h"

namespace palpate::viz {

/// A double click on the surface or on the map shows all of it again; on the image both change places.
void follow_double_click(const Layout& layout, ViewState& state);

class Hud {
 public:
  /// Remembers this frame, number `position` of its source, for the charts; once a result, however often it
  /// is drawn.
  void follow(const Touch& touch, uint64_t position);
  void mark(const Event& event) { history_.mark(event); }
  /// The axis of the charts; what was remembered is forgotten.
  void set_timeline(const Timeline& timeline) { history_ = History(timeline); }
  const Timeline& timeline() const { return history_.timeline(); }
  const History& history() const { return history_; }
  /// The part of the measurements that the charts show, as CSV.
  std::string chart_table(const Sensor& sensor, const ViewState& state) const;
  /// Describes everything to ImGui between HudFrame::begin and draw; may change `state` (the user moved a
  /// slider). `eye`: null without a surface; `profile`: null without a section.
  void describe(HudFrame& frame, const Layout& layout, VkExtent2D extent, const HudContent& content,
                ViewState& state, const Eye* eye, const Vec3& half_mm, const Profile* profile);

 private:
  History history_;
  Trail trail_;
  Headline headline_;
  ChartMouse chart_mouse_;
  SectionMouse section_mouse_;
  double full_shear_N_ = 0.1;  ///< largest tangential force seen: the length of the arrow
};

}  // namespace palpate::viz
