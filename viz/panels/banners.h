// Banners at the foot and the head of the window: state of the session, replay bar, warnings.
#pragma once

#include <cstdint>

#include "viz/live/stats.h"
#include "viz/panels/hud_content.h"
#include "viz/render/layout.h"
#include "viz/render/view_state.h"

namespace palpate::viz {

/// One line at the foot: the last note, what a camera lost, frame and time.
void status_line(const Layout& layout, const HudContent& content, float scale);
/// Time, place and speed of a replay, in a strip of its own.
void player_bar(const Layout& layout, float scale, const PlayerStats& player, int64_t time_ns,
                ViewState& state);
/// Urgent messages: that it records, that recording failed, that no frames come.
void banner(const Layout& layout, const LiveStats& live, float scale);

}  // namespace palpate::viz
