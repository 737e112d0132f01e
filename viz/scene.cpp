#include "viz/scene.h"

#include <algorithm>

#include "engine/gpu/context.h"

namespace palpate::viz {

Scene::Scene(gpu::Context& context, const RenderPass& pass, const Sensor& sensor, uint32_t frames_in_flight,
             GLFWwindow* window, float scale)
    : context_(context),
      sensor_(sensor),
      surface_(context, pass, frames_in_flight),
      image_(context, pass, frames_in_flight),
      frame_(context, pass, frames_in_flight, window, scale) {}

void Scene::follow(const Touch& touch) {
  hud_.follow(touch);
  state_.follow(touch, longest_side_mm_);
}

void Scene::record(VkCommandBuffer cmd, VkExtent2D extent, const Shown& shown, uint32_t mesh_columns,
                   const LiveStats* live, const std::function<void()>& begin_pass) {
  const FrameFormat& format = shown.frame.format;
  const bool has_surface = shown.surface.buffer != nullptr;
  longest_side_mm_ = std::max(format.width, format.height) * sensor_.pitch_mm_per_px;
  if (!sized_) state_.follow(shown.touch, longest_side_mm_);  // the first picture already has its scales
  sized_ = true;

  layout_ = make_layout(extent, frame_.scale(), format, has_surface);
  const SurfaceStyle style = state_.style(longest_side_mm_);
  const Vec3 half_mm = surface_half_size_mm(format.width, format.height, sensor_.pitch_mm_per_px, style);
  // Around the pad: the axes' labels, and on the right the colour bar.
  const double labels_px = 2 * kLabelRoom_px * frame_.scale(), bar_px = kColourBarRoom_px * frame_.scale();
  const ViewRect& view = layout_.view;
  eye_ =
      place(state_.camera, half_mm, view.aspect(), std::max(0.3, 1 - (labels_px + 2 * bar_px) / view.width),
            std::max(0.3, 1 - labels_px / view.height));

  HudContent content{sensor_, shown.frame, shown.touch, has_surface, live, context_.report().name, {0, 0}};
  if (has_surface) content.mesh = SurfaceView::mesh_size(shown.surface, mesh_columns);
  frame_.begin(extent);
  hud_.describe(frame_, layout_, content, state_, has_surface ? &eye_ : nullptr, half_mm);

  map_to_picture_barrier(cmd);
  begin_pass();
  if (has_surface) {
    surface_.draw(cmd, shown.surface, shown.touch.depth_datum_mm, sensor_.pitch_mm_per_px, eye_, style,
                  layout_.view, layout_.surface, mesh_columns);
  }
  image_.draw(cmd, shown.frame, shown.surface, layout_.image, extent);
  frame_.draw(cmd);
}

}  // namespace palpate::viz
