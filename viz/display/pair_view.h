// Two fingers in one picture: both surfaces as one eye sees them, both images, the grip's numbers and its
// charts.
#pragma once

#include <vulkan/vulkan.h>

#include <array>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "engine/grip/grip_quantities.h"
#include "palpate/frame.h"
#include "palpate/pipeline.h"
#include "palpate/sensor.h"
#include "viz/panels/charts/chart.h"
#include "viz/render/hud_frame.h"
#include "viz/render/image/image_view.h"
#include "viz/render/surface_view.h"
#include "viz/render/view_state.h"

struct GLFWwindow;

namespace palpate::viz {

/// A finger as it is shown; all of it must outlive the drawing of the picture.
struct ShownTouch {
  const Frame* frame = nullptr;  ///< null: nothing was measured yet, or it has ended
  const Touch* touch = nullptr;
  const Result* result = nullptr;
  Touch tared;        ///< less the zero
  std::string state;  ///< why no frames come; empty: they do
  double measured_per_s = 0;
};

struct PairContent {
  std::array<ShownTouch, 2> fingers;  ///< left, right
  std::optional<GripFrame> grip;      ///< the newest, of touches less their zero
  bool zeroed = false;
  bool recording = false;
  std::string failed;  ///< why a recording ended early; empty: none did
  std::string note;    ///< at the foot
};

/// Places in a picture, px.
struct PairLayout {
  std::array<ViewRect, 2> heads, surfaces, images;
  ViewRect panel, charts, foot;
  bool has_charts = false;
};
PairLayout pair_layout(VkExtent2D extent, float scale, const std::array<FrameFormat, 2>& formats,
                       const std::array<bool, 2>& has_surface, bool charts = true);

class PairView {
 public:
  /// `sensors`: left, right. `window`: null off-screen. `scale`: of text.
  PairView(gpu::Context& context, const RenderPass& pass, const std::array<Sensor, 2>& sensors,
           uint32_t frames_in_flight, GLFWwindow* window, float scale);

  /// The charts remember it; once.
  void follow(const GripFrame& grip);
  /// The scale of depth follows both; once a result.
  void follow(const Touch& touch);

  /// Records a picture; `content` describes what else ImGui draws, within HudFrame's begin and end.
  void record(VkCommandBuffer cmd, VkExtent2D extent, const PairContent& shown, uint32_t mesh_columns,
              const std::function<void(const PairLayout&)>& content, const std::function<void()>& begin_pass);

  ViewState& state() { return state_; }
  const PairLayout& layout() const { return layout_; }
  const HudFrame& frame() const { return *frame_; }
  const Eye& eye(size_t which) const { return eyes_[which]; }

 private:
  /// What the charts remember of a row.
  struct GripSample {
    double time = 0;  ///< s
    bool gap = false;
    bool gripped = false;
    Estimate force_N, imbalance_N, thickness_mm;
    std::array<Estimate, 3> load_N;
  };

  struct Curve {
    const char* title;
    Rgb colour;
    LineStyle line;
    bool band;  ///< of two standard errors
    std::function<Estimate(const GripSample&)> value;
  };
  struct Plot {
    std::vector<Curve> curves;
    double least;    ///< of the length of its axis
    bool from_zero;  ///< its axis has zero
  };

  void fit_text();
  void describe_finger(size_t which, const PairContent& shown);
  void describe_numbers(const PairContent& shown);
  void describe_charts() const;
  std::vector<Plot> plots() const;
  void draw_plot(const Plot& plot, Chart chart, int ticks) const;
  SurfaceStyle style() const { return state_.style(longest_side_mm_); }

  gpu::Context& context_;
  const RenderPass& pass_;
  const std::array<Sensor, 2> sensors_;
  const uint32_t frames_in_flight_;
  GLFWwindow* const window_;
  const float scale_;
  std::array<std::unique_ptr<SurfaceView>, 2> surfaces_;
  std::array<std::unique_ptr<ImageView>, 2> images_;
  std::unique_ptr<HudFrame> frame_;
  std::array<Eye, 2> eyes_;
  std::array<Vec3, 2> half_mm_{};
  ViewState state_;
  std::deque<GripSample> samples_;
  PairLayout layout_;
  double longest_side_mm_ = 1;
  double full_shear_N_ = 0.1;  ///< the largest seen: the length of an arrow
};

}  // namespace palpate::viz
