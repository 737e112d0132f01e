// Rows of the panel, made from the list of quantities.
#pragma once

#include <cstdint>

#include "viz/panels/hud_content.h"
#include "viz/panels/numbers/cards.h"
#include "viz/render/view_state.h"

namespace palpate::viz {

/// Rows of what this sensor and its outputs measure of `groups` (MeasuredColumns), in the order of the list.
CardRows quantity_rows(const Touch& touch, const HudContent& content, const ViewState& state,
                       uint32_t groups);

}  // namespace palpate::viz
