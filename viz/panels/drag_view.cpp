#include "viz/panels/drag_view.h"

#include <imgui.h>

#include <algorithm>
#include <cmath>

#include "viz/render/drawing.h"

namespace palpate::viz {

void drag_view(const Eye& eye, const ViewRect& view, Camera& camera) {
  const ImGuiIO& io = ImGui::GetIO();
  if (io.WantCaptureMouse) return;
  // In the picture of the click itself the mouse may have come from anywhere.
  const auto held = [&](int button) {
    return io.MouseDownDuration[button] > 0 && inside(view, io.MouseClickedPos[button]);
  };
  const bool left = held(0), right = held(1) || held(2);
  if (left && !io.KeyShift) {
    camera.orbit(-0.008 * io.MouseDelta.x, 0.008 * io.MouseDelta.y);
  } else if (left || right) {
    const double mm_per_px = eye.mm_per_px(std::max(1.0, static_cast<double>(view.height)));
    camera.target =
        camera.target - eye.right * (io.MouseDelta.x * mm_per_px) + eye.up * (io.MouseDelta.y * mm_per_px);
  }
  if (io.MouseWheel != 0 && inside(view, io.MousePos)) camera.magnify(std::pow(1.12, io.MouseWheel));
}

void drag_map(const MapFit& fit, MapEye& eye) {
  const ImGuiIO& io = ImGui::GetIO();
  if (io.WantCaptureMouse) return;
  const ViewRect& view = fit.picture;
  double right_px = 0, down_px = 0, factor = 1;
  for (int button = 0; button < 3; ++button)
    if (io.MouseDownDuration[button] > 0 && inside(view, io.MouseClickedPos[button])) {
      right_px = double{io.MouseDelta.x};
      down_px = double{io.MouseDelta.y};
    }
  if (inside(view, io.MousePos)) factor = std::pow(1.12, double{io.MouseWheel});
  if (right_px == 0 && down_px == 0 && factor == 1) return;
  const double px_per_mm =
      std::clamp(fit.px_per_mm * factor, MapEye::kLeast_px_per_mm, MapEye::kMost_px_per_mm);
  // What is under the mouse stays there.
  const double kept = 1 / fit.px_per_mm - 1 / px_per_mm;
  eye = {.all = false,
         .x_mm = fit.x_mm - right_px / fit.px_per_mm + double{io.MousePos.x - middle(view).x} * kept,
         .y_mm = fit.y_mm - down_px / fit.px_per_mm + double{io.MousePos.y - middle(view).y} * kept,
         .px_per_mm = px_per_mm};
}

}  // namespace palpate::viz
