// Pixels that belong to the pad.
#pragma once

#include "palpate/outline.h"

namespace palpate {

bool contains(const PadOutline& outline, double x_px, double y_px);

}  // namespace palpate
