// The mouse on a surface.
#pragma once

#include "viz/render/orbit.h"
#include "viz/render/surface_view.h"

namespace palpate::viz {

/// A drag that began in `view` turns the camera, with Shift or another button it moves it; the wheel over it
/// magnifies. `eye`: as the view is seen. Between ImGui's begin and end.
void drag_view(const Eye& eye, const ViewRect& view, Camera& camera);

}  // namespace palpate::viz
