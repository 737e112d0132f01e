// Two recordings side by side on one time: pictures of depth, a table of differences, charts of both.
#pragma once

#include <vulkan/vulkan.h>

#include <array>
#include <deque>
#include <functional>
#include <memory>
#include <string>

#include "capture/run/compare/compare_recordings.h"
#include "viz/live/history.h"
#include "viz/render/colour_map.h"
#include "viz/render/hud_frame.h"
#include "viz/render/image/image_view.h"

struct GLFWwindow;

namespace palpate::viz {

/// What the person chose.
struct CompareState {
  Alignment alignment = Alignment::Start;
  std::string mark = {};  ///< of Alignment::Mark; empty: the first
  double offset_s = 0;    ///< of B, to later times
  double cursor_s = 0;    ///< moment that is shown, from that of the alignment
  bool light = false;     ///< theme
  bool playing = false;
  ColourMap map = ColourMap::Viridis;
  std::string note = {};  ///< at the foot
};

/// Places in a picture, px.
struct CompareLayout {
  ViewRect heading, a, b, table, charts, foot;
};
CompareLayout compare_layout(VkExtent2D extent, float scale);

class CompareView {
 public:
  /// `window`: null off-screen. Recordings outlive it. `scale`: of text.
  CompareView(gpu::Context& context, const RenderPass& pass, uint32_t frames_in_flight, GLFWwindow* window,
              float scale, const RecordingCurve& a, const RecordingCurve& b);

  /// Records a picture; `content` describes what else ImGui draws, within HudFrame's begin and end. The
  /// cursor stays where there are frames.
  void record(VkCommandBuffer cmd, VkExtent2D extent, CompareState& state,
              const std::function<void(const CompareLayout&)>& content,
              const std::function<void()>& begin_pass);

  /// Begin and end of the axis that has both, s.
  std::pair<double, double> ends() const { return {from_s_, to_s_}; }
  /// The moment under a place of the charts in the last picture; none: beside them.
  std::optional<double> moment_at(float x, float y) const;
  const HudFrame& frame() const { return *frame_; }

 private:
  void align(const CompareState& state);
  void words(const CompareState& state);
  void table(const std::vector<ComparedValue>& rows, const char* heading, float& y);
  void charts(const CompareState& state);
  void picture(size_t which, const CompareState& state);
  double clock_s(size_t which) const { return which == 0 ? time_->a_s : time_->b_s; }

  const std::array<const RecordingCurve*, 2> curves_;
  std::array<ImageView, 2> images_;
  std::unique_ptr<HudFrame> frame_;
  std::array<Frame, 2> pictures_;
  std::array<std::deque<Sample>, 2> samples_;
  const std::vector<ComparedValue> largest_;
  std::optional<SharedTime> time_;
  CompareState aligned_;
  double from_s_ = 0, to_s_ = 1, range_mm_ = 0;
  CompareLayout layout_;
};

}  // namespace palpate::viz
