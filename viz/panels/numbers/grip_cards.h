// Numbers of two fingers and of what they hold, in cards.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "engine/grip/grip_quantities.h"
#include "viz/panels/hud_content.h"
#include "viz/panels/numbers/cards.h"
#include "viz/render/view_state.h"

namespace palpate::viz {

/// The grip's numbers in the order of the list, the force in large figures; `zeroed`: less what they were at
/// a moment that the person chose.
Card grip_card(const HudFrame& frame, const GripFrame& grip, bool zeroed);

/// One finger's touch, `shown` less its zero, in few rows.
Card finger_card(const char* title, const Touch& shown, const HudContent& content, const ViewState& state);

}  // namespace palpate::viz
