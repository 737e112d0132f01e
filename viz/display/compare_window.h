// Two recordings compared: in a window, or as a picture.
#pragma once

#include <filesystem>
#include <functional>
#include <vector>

#include "viz/display/compare_view.h"
#include "viz/panels/actions/help.h"
#include "viz/panels/settings.h"
#include "viz/render/render_target.h"

namespace palpate::viz {

/// One picture off-screen, at the larger recording's largest force.
RgbImage compare_picture(gpu::Context& context, const RecordingCurve& a, const RecordingCurve& b,
                         CompareState state, VkExtent2D extent);

/// Keys of the window, for its help.
std::vector<KeyHelp> compare_keys();

/// Shows them until the window is closed, Escape, Q or `interrupted`; `settings`: size, theme and text of the
/// window, and how it was left. `folder`: where S saves picture and table; empty: nowhere. Main thread.
void run_compare_window(gpu::Context& context, const RecordingCurve& a, const RecordingCurve& b,
                        CompareState& state, Settings& settings, const std::filesystem::path& folder,
                        const std::function<bool()>& interrupted);

/// Writes FOLDER/comparison.png and comparison.csv. Throws Error(Failure::Output).
void write_comparison(const std::filesystem::path& folder, const RgbImage& picture, const RecordingCurve& a,
                      const RecordingCurve& b);

}  // namespace palpate::viz
