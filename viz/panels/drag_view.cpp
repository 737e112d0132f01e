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

}  // namespace palpate::viz
