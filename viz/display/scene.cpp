#include "viz/display/scene.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "engine/gpu/context.h"
#include "engine/pipeline/surface_map.h"
#include "viz/render/mesh_places.h"

namespace palpate::viz {

Scene::Scene(gpu::Context& context, const RenderPass& pass, const Sensor& sensor, const Frame* background,
             uint32_t frames_in_flight, GLFWwindow* window, float scale)
    : context_(context),
      pass_(pass),
      sensor_(sensor),
      frames_in_flight_(frames_in_flight),
      window_(window),
      scale_(scale),
      background_(background ? *background : Frame{}),
      surface_(context, pass, frames_in_flight),
      image_(context, pass, frames_in_flight),
      loads_(context, frames_in_flight),
      strain_(context, frames_in_flight),
      frame_(std::make_unique<HudFrame>(context, pass, frames_in_flight, window, scale)) {
  state_.fit_to(sensor);
  if (!background && !sensor.layer) state_.can_show_pressure = false;
}

/// Calibrations take the place of the settings while they are shown, in a picture that of the surface.
static double dock_width(const ViewState& state, bool window) {
  constexpr double kSettings = 264, kCalibrations = 432;
  if (!window) return 0;
  return state.sensor_panel ? kCalibrations : state.controls ? kSettings : 0;
}

/// Fonts of another size are made anew, between two pictures.
void Scene::fit_text() {
  const float wanted = scale_ * state_.text_scale;
  if (std::abs(frame_->scale() / wanted - 1) < 1e-3f) return;
  frame_.reset();  // there is one at a time: it owns the window's callbacks
  frame_ = std::make_unique<HudFrame>(context_, pass_, frames_in_flight_, window_, wanted);
}

void Scene::follow(const Touch& touch, std::optional<uint64_t> position) {
  hud_.follow(touch, position.value_or(touch.sequence));
  strain_due_ = unknown_due_ = true;
  state_.follow(touch, longest_side_mm_);
}

void Scene::show_strip(const DepthStrip& strip) {
  strip_ = &strip;
  strip_view_.emplace(context_, pass_, frames_in_flight_);
}

/// The picture is made anew where it has changed.
void Scene::draw_strip(VkCommandBuffer cmd, VkExtent2D extent) {
  if (!layout_.has_player || !strip_ || strip_->measured() == 0) return;
  const FrameFormat wanted{layout_.strip.width, layout_.strip.height, 3, 8};
  const uint32_t measured = strip_->measured();
  if (measured != strip_drawn_ || state_.map != strip_map_ || strip_picture_.format != wanted)
    strip_->draw(strip_picture_, wanted.width, wanted.height, state_.map);
  strip_drawn_ = measured;
  strip_map_ = state_.map;
  strip_view_->draw(cmd, strip_picture_, {}, layout_.strip, extent);
}

/// Vertices across that show a pad so wide: a triangle of a few pixels is shaded many times over on a CPU.
static uint32_t columns_seen(double width_px, bool still) {
  const double cell_px = still ? 1.5 : 4;
  constexpr uint32_t kStep = 16;  // so that few meshes are made while the camera moves
  return kStep * std::max(3u, static_cast<uint32_t>(std::min(width_px / cell_px, 4096.0)) / kStep);
}

void Scene::record(VkCommandBuffer cmd, VkExtent2D extent, const Shown& shown, uint32_t mesh_columns,
                   const LiveStats* live, const std::function<void()>& begin_pass) {
  const FrameFormat& format = shown.frame.format;
  const SurfaceMap& surface = surface_of(shown.result);
  const bool has_surface = surface.buffer != nullptr;
  longest_side_mm_ = std::max(format.width, format.height) * sensor_.pitch_mm_per_px;
  state_.pad_mm = longest_side_mm_;
  state_.frame_aspect = static_cast<double>(format.width) / format.height;
  const bool first = !std::exchange(sized_, true);
  if (first) state_.follow(shown.touch, longest_side_mm_);  // the first picture already has its scales

  use_theme(state_.light_theme);
  fit_text();
  const float scale = frame_->scale();
  // In a picture the calibrations have the charts' room.
  const bool window = frame_->has_window();
  const bool charts = state_.charts && !hud_.timeline().separate && (window || !state_.sensor_panel);
  layout_ = make_layout(extent, scale, format, has_surface,
                        {.charts = charts,
                         .profile = state_.section,
                         .dock = dock_width(state_, window),
                         .player = live && live->player,
                         .tools = window,
                         .headline = !window,
                         .chart_rows = 1u + (sensor_.force && sensor_.shear ? 1 : 0) + (has_surface ? 1 : 0),
                         .arrangement = state_.arrangement,
                         .image_large = state_.image_large,
                         .map = window && state_.has_object_map && state_.object_map});
  LoadTexels load;
  if (has_surface && state_.quantity == Quantity::Pressure) {
    load = sensor_.layer ? loads_.update(shown.result.traction)
                         : loads_.update(shown.frame, background_, sensor_);
    state_.follow_pressure(loads_.largest_MPa());
  } else if (has_surface && state_.quantity == Quantity::Friction) {
    load = loads_.update_friction(shown.result.traction);
  }
  ImageStrain strain;
  if (state_.skin_strain != SkinStrain::Off) {
    if (std::exchange(strain_due_, false) || strain_shown_ != state_.skin_strain)
      strain_.update(shown.touch, format, state_.skin_strain);
    if (strain_.last().texels) {
      state_.follow_skin_strain(strain_.last().largest);
      strain = {strain_.last().texels, strain_.last().pitch, state_.skin_strain_range, state_.map};
    }
  }
  strain_shown_ = state_.skin_strain;
  const SurfaceStyle style = state_.style(longest_side_mm_);
  const Vec3 half_mm = surface_half_size_mm(format.width, format.height, sensor_.pitch_mm_per_px, style);
  const ViewRect& view = layout_.surface;
  eye_ = place(state_.camera, half_mm, view.aspect(), margins_of(view, scale));
  if (mesh_columns > 0)
    mesh_columns =
        std::min(mesh_columns, columns_seen(2 * half_mm.x / eye_.mm_per_px(view.height), shown.still));
  Profile profile;
  const bool section = has_surface && state_.section;
  if (section)
    profile =
        probe(context_, surface, shown.touch.surface->depth_offset_mm, sensor_.pitch_mm_per_px, state_.line);

  HudContent content{sensor_, shown.frame, shown.touch, has_surface, live, context_.report().name, {0, 0}};
  content.traction = shown.result.traction;
  if (std::exchange(unknown_due_, false))
    unknown_ = unknown_cells(shown.frame, background_, shown.touch, shown.result, sensor_);
  content.unknown = &unknown_;
  content.separate = hud_.timeline().separate;
  if (state_.skin_strain != SkinStrain::Off) content.strain = &strain_.last();
  if (layout_.has_map) content.map = &map_;
  if (has_surface) content.mesh = SurfaceView::mesh_size(surface, mesh_columns);
  const bool in_sight =
      layout_.has_surface && (window || !state_.sensor_panel);  // not under the calibrations
  const auto describe = [&] {
    frame_->begin(extent);
    hud_.describe(*frame_, layout_, extent, content, state_, in_sight ? &eye_ : nullptr, half_mm,
                  section ? &profile : nullptr);
  };
  describe();
  if (first && !window_) {  // a panel that takes the size of its words shows itself the second time
    frame_->abandon();
    describe();
  }

  map_to_picture_barrier(context_, cmd);
  begin_pass();
  if (in_sight) {
    surface_.draw(cmd, surface, shown.touch.surface->depth_offset_mm, sensor_.pitch_mm_per_px, eye_, style,
                  layout_.surface, mesh_columns, load, dented_part(shown.touch, format.width, format.height));
  }
  if (layout_.has_image) image_.draw(cmd, shown.frame, surface, layout_.image, extent, strain);
  draw_strip(cmd, extent);
  if (layout_.has_map) {
    if (!map_view_) map_view_.emplace(context_, pass_, frames_in_flight_);
    map_view_->draw(cmd, extent, map_, map_fit(), state_.map, state_.light_theme);
  }
  frame_->draw(cmd);
}

}  // namespace palpate::viz
