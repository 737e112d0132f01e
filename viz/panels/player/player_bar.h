// The player of a recording below the surface: marks, a strip of thumbnails to scrub in, buttons.
#pragma once

#include <cstdint>

#include "viz/live/history.h"
#include "viz/live/stats.h"
#include "viz/render/layout.h"
#include "viz/render/view_state.h"

namespace palpate::viz {

/// Between ImGui's begin and end; the thumbnails themselves are drawn below it. A click or a drag in the
/// strip goes there; events stand over it as flags with their text, and under the mouse with their time; what
/// lies outside a looped part is dimmed. `time_ns`: of the shown frame.
void player_bar(const Layout& layout, float scale, const PlayerStats& player, int64_t time_ns,
                const History& history, ViewState& state);

}  // namespace palpate::viz
