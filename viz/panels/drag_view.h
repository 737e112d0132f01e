// The mouse on a surface, and on the map of what the pad moves over.
#pragma once

#include "viz/render/image/map_view.h"
#include "viz/render/orbit.h"
#include "viz/render/surface_view.h"

namespace palpate::viz {

/// A drag that began in `view` turns the camera, with Shift or another button it moves it; the wheel over it
/// magnifies. `eye`: as the view is seen. Between ImGui's begin and end.
void drag_view(const Eye& eye, const ViewRect& view, Camera& camera);
/// A drag that began in the map's picture moves it, the wheel over it magnifies. `fit`: as it is seen.
void drag_map(const MapFit& fit, MapEye& eye);

}  // namespace palpate::viz
