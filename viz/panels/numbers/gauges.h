// Figures of the cards: a bar over the calibrated forces, a dial of shear within its friction limit, and a
// level.
#pragma once

#include <imgui.h>

#include <optional>

#include "engine/lump/observation/pad_tilt.h"
#include "palpate/touch.h"
#include "viz/panels/charts/charts.h"

namespace palpate::viz {

/// A force from 0 on, with two standard errors to either side; the ends of the calibrated range are marked,
/// and a tip at the end says that it lies beyond the bar. `force`: none where nothing touches.
void draw_force_bar(ImDrawList* list, ImVec2 low, ImVec2 high, const ForceRange& range,
                    const std::optional<Estimate>& force, float scale);

/// Shear as an arrow, x to the right and y downwards, with a ring of two standard errors around its tip, in
/// a circle that is the friction limit. `limit_N`: 0 where it is not known, and only the direction is.
void draw_shear_dial(ImDrawList* list, ImVec2 low, ImVec2 high, const Estimate& x, const Estimate& y,
                     double limit_N, Slip slip, float scale);

/// A pad's tilt as a level shows it: a bubble that lies where the pad stands highest, x to the right and y
/// downwards, as large as its standard error; rings at 2 and 5 degrees, the dial ends at 7. `tilt`: none
/// where it cannot be told: the dial alone, gray.
void draw_level(ImDrawList* list, ImVec2 low, ImVec2 high, const std::optional<lump::PadTilt>& tilt,
                float scale);

}  // namespace palpate::viz
