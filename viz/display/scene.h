// One whole picture: surface, raw image and measurements, the same on the window and off-screen.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "palpate/frame.h"
#include "palpate/pipeline.h"
#include "palpate/sensor.h"
#include "viz/display/depth_strip.h"
#include "viz/panels/hud.h"
#include "viz/render/image/image_view.h"
#include "viz/render/image/load_view.h"
#include "viz/render/image/map_view.h"
#include "viz/render/surface_view.h"
#include "viz/render/view_state.h"

namespace palpate::viz {

/// One measured frame to be shown; all of it must outlive the drawing of the picture.
struct Shown {
  const Frame& frame;
  const Touch& touch;
  const Result& result;  ///< its maps; without a surface only the raw image is shown
  bool still = false;    ///< no other picture follows soon: the mesh may take its time
};

class Scene {
 public:
  /// `window`: null off-screen. `scale`: of text and panels, times ViewState::text_scale. `background`: the
  /// untouched image, for the colours of pressure; null: they cannot be shown.
  Scene(gpu::Context& context, const RenderPass& pass, const Sensor& sensor, const Frame* background,
        uint32_t frames_in_flight, GLFWwindow* window, float scale);

  /// A new result has come: scales and traces follow it. `position`: of its frame in the recording, from 0;
  /// none: the frame's own number.
  void follow(const Touch& touch, std::optional<uint64_t> position = {});
  void mark(const Event& event) { hud_.mark(event); }
  void set_timeline(const Timeline& timeline) { hud_.set_timeline(timeline); }
  const History& history() const { return hud_.history(); }
  /// Thumbnails of the recording that is played, which outlive this.
  void show_strip(const DepthStrip& strip);
  /// The map of what the pad moves over, shown where ViewState::object_map asks for it.
  void show_map(MapLook look) { map_ = std::move(look); }
  const MapLook& map() const { return map_; }
  MapFit map_fit() const { return fit_map(map_.map.get(), layout_.map, state_.map_eye, frame_->scale()); }
  std::string chart_table() const { return hud_.chart_table(sensor_, state_); }
  /// Records the picture; `begin_pass` is called once, between the barriers and the drawing.
  void record(VkCommandBuffer cmd, VkExtent2D extent, const Shown& shown, uint32_t mesh_columns,
              const LiveStats* live, const std::function<void()>& begin_pass);

  ViewState& state() { return state_; }
  const Layout& layout() const { return layout_; }
  const Eye& eye() const { return eye_; }

 private:
  void fit_text();
  void draw_strip(VkCommandBuffer cmd, VkExtent2D extent);

  gpu::Context& context_;
  const RenderPass& pass_;
  const Sensor sensor_;
  const uint32_t frames_in_flight_;
  GLFWwindow* const window_;
  const float scale_;
  Frame background_;
  SurfaceView surface_;
  ImageView image_;
  LoadMap loads_;
  StrainMap strain_;
  SkinStrain strain_shown_ = SkinStrain::Off;
  bool strain_due_ = true;
  UnknownCells unknown_;
  bool unknown_due_ = true;
  std::unique_ptr<HudFrame> frame_;
  Hud hud_;
  ViewState state_;
  Layout layout_;
  Eye eye_;
  MapLook map_;
  std::optional<MapView> map_view_;
  const DepthStrip* strip_ = nullptr;
  std::optional<ImageView> strip_view_;
  Frame strip_picture_;
  uint32_t strip_drawn_ = 0;  ///< thumbnails that the picture has
  ColourMap strip_map_ = ColourMap::Viridis;
  double longest_side_mm_ = 1;
  bool sized_ = false;
};

}  // namespace palpate::viz
