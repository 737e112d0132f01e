// One whole picture: surface, raw image and measurements, the same on the window and off-screen.
#pragma once

#include <functional>
#include <string>

#include "engine/frame.h"
#include "engine/pipeline.h"
#include "engine/sensor.h"
#include "viz/hud.h"
#include "viz/image_view.h"
#include "viz/surface_view.h"
#include "viz/view_state.h"

namespace palpate::viz {

/// One measured frame to be shown. All three must outlive the drawing of the picture.
struct Shown {
  const Frame& frame;
  const Touch& touch;
  SurfaceMap surface;  ///< buffer null: only the raw image is shown
};

class Scene {
 public:
  /// `window`: null off-screen. `scale`: of text and panels.
  Scene(gpu::Context& context, const RenderPass& pass, const Sensor& sensor, uint32_t frames_in_flight,
        GLFWwindow* window, float scale);

  /// A new result has come: scales and traces follow it.
  void follow(const Touch& touch);
  /// Records the picture; `begin_pass` is called once, between the barriers and the drawing.
  void record(VkCommandBuffer cmd, VkExtent2D extent, const Shown& shown, uint32_t mesh_columns,
              const LiveStats* live, const std::function<void()>& begin_pass);

  ViewState& state() { return state_; }
  const Layout& layout() const { return layout_; }
  const Eye& eye() const { return eye_; }

 private:
  gpu::Context& context_;
  const Sensor sensor_;
  SurfaceView surface_;
  ImageView image_;
  HudFrame frame_;
  Hud hud_;
  ViewState state_;
  Layout layout_;
  Eye eye_;
  double longest_side_mm_ = 1;
  bool sized_ = false;
};

}  // namespace palpate::viz
