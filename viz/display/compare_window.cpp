#include "viz/display/compare_window.h"

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>
#include <imgui.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "capture/files/output_file.h"
#include "engine/gpu/context.h"
#include "palpate/error.h"
#include "viz/display/picture.h"
#include "viz/display/snapshot.h"
#include "viz/panels/actions/actions.h"
#include "viz/panels/actions/help.h"
#include "viz/render/drawing.h"
#include "viz/render/format.h"
#include "viz/render/window.h"

namespace palpate::viz {
namespace {

using Clock = std::chrono::steady_clock;

/// The window's state, as its actions change it.
struct Use {
  const RecordingCurve& a;
  const RecordingCurve& b;
  CompareState& state;
  bool help = false, save = false, close = false;

  double frame_s() const { return 1 / std::max(a.rate_Hz, 1.0); }
  bool can_align(Alignment alignment) const {
    return moment_of(a, alignment, state.mark) && moment_of(b, alignment, state.mark);
  }
  void next_alignment() {
    do {
      state.alignment = static_cast<Alignment>((static_cast<int>(state.alignment) + 1) % kAlignments);
    } while (!can_align(state.alignment));
  }
  void to_largest() {
    if (const auto frame = largest_frame(a); frame)
      state.cursor_s = a.points[*frame].time_s - SharedTime(a, b, state.alignment, state.mark).a_s;
  }
};

/// Each action once: keys, buttons and help take them from here.
struct CompareAction {
  const char* button;  ///< empty: keys alone
  const char* name;
  std::vector<KeyPress> chords;
  void (*run)(Use&);
};

const std::vector<CompareAction>& compare_actions() {
  static const std::vector<CompareAction> kAll = {
      {"Play", "play, or pause", {{GLFW_KEY_SPACE}}, [](Use& u) { u.state.playing = !u.state.playing; }},
      {"",
       "one frame back",
       {{GLFW_KEY_LEFT}, {GLFW_KEY_COMMA}},
       [](Use& u) { u.state.cursor_s -= u.frame_s(); }},
      {"",
       "one frame on",
       {{GLFW_KEY_RIGHT}, {GLFW_KEY_PERIOD}},
       [](Use& u) { u.state.cursor_s += u.frame_s(); }},
      {"", "1 s back", {{GLFW_KEY_LEFT, true}}, [](Use& u) { u.state.cursor_s -= 1; }},
      {"", "1 s on", {{GLFW_KEY_RIGHT, true}}, [](Use& u) { u.state.cursor_s += 1; }},
      {"Largest", "to the largest force of A", {{'F', true}}, [](Use& u) { u.to_largest(); }},
      {"Align",
       "align by: first frame, first touch, largest force, mark",
       {{'A'}},
       [](Use& u) { u.next_alignment(); }},
      {"B earlier",
       "move B one frame earlier",
       {{GLFW_KEY_LEFT_BRACKET}},
       [](Use& u) { u.state.offset_s -= u.frame_s(); }},
      {"B later",
       "move B one frame later",
       {{GLFW_KEY_RIGHT_BRACKET}},
       [](Use& u) { u.state.offset_s += u.frame_s(); }},
      {"",
       "move B ten frames earlier",
       {{GLFW_KEY_LEFT_BRACKET, true}},
       [](Use& u) { u.state.offset_s -= 10 * u.frame_s(); }},
      {"",
       "move B ten frames later",
       {{GLFW_KEY_RIGHT_BRACKET, true}},
       [](Use& u) { u.state.offset_s += 10 * u.frame_s(); }},
      {"", "B not moved", {{GLFW_KEY_BACKSPACE}}, [](Use& u) { u.state.offset_s = 0; }},
      {"",
       "colour map: viridis, cividis, magma",
       {{'O'}},
       [](Use& u) {
         u.state.map = static_cast<ColourMap>((static_cast<int>(u.state.map) + 1) % kColourMaps);
       }},
      {"", "light or dark theme", {{'U'}}, [](Use& u) { u.state.light = !u.state.light; }},
      {"Save", "save picture and table", {{'S'}}, [](Use& u) { u.save = true; }},
      {"Help", "keys and mouse", {{'H'}, {GLFW_KEY_F1}}, [](Use& u) { u.help = !u.help; }},
      {"",
       "close the help, else quit",
       {{GLFW_KEY_ESCAPE}},
       [](Use& u) {
         u.close = !u.help;
         u.help = false;
       }},
      {"", "quit", {{'Q'}}, [](Use& u) { u.close = true; }},
  };
  return kAll;
}

class CompareWindow {
 public:
  CompareWindow(gpu::Context& context, Use& use, Settings& settings, std::filesystem::path folder)
      : use_(use),
        settings_(settings),
        folder_(std::move(folder)),
        window_(context,
                {"palpate: " + use.a.input + ", " + use.b.input, settings.width, settings.height, Vsync::On}),
        view_(context, window_.pass(), Window::kPicturesInFlight, window_.handle(),
              window_.scale() * settings.view.text_scale, use.a, use.b) {}
  ~CompareWindow() {
    while (window_.poll_finished(true)) {
    }
  }
  CompareWindow(const CompareWindow&) = delete;
  CompareWindow& operator=(const CompareWindow&) = delete;

  void run(const std::function<bool()>& interrupted) {
    int restless = 3;
    Clock::time_point last = Clock::now();
    while (!window_.close_requested() && !use_.close && !(interrupted && interrupted())) {
      glfwWaitEventsTimeout(use_.state.playing || restless > 0 ? 0.01 : 0.1);
      const Clock::time_point now = Clock::now();
      if (use_.state.playing) play(std::chrono::duration<double>(now - last).count());
      last = now;
      if (moved() || use_.state.playing) restless = 3;
      if (restless-- <= 0 || window_.minimised()) {
        restless = 0;
        continue;
      }
      draw();
    }
    std::tie(settings_.width, settings_.height) = window_.size();
    settings_.view.light_theme = use_.state.light;
    settings_.view.map = use_.state.map;
  }

 private:
  /// Something that changes the picture has happened.
  bool moved() {
    double x = 0, y = 0;
    glfwGetCursorPos(window_.handle(), &x, &y);
    const std::array<double, 4> now{x, y, double(window_.extent().width),
                                    double(glfwGetMouseButton(window_.handle(), GLFW_MOUSE_BUTTON_LEFT))};
    return std::exchange(mouse_, now) != now || now[3] > 0 || window_.has_keys();
  }
  void play(double seconds) {
    const auto [from, to] = view_.ends();
    use_.state.cursor_s += seconds;
    if (use_.state.cursor_s > to) use_.state.cursor_s = from;
  }
  void buttons(const CompareLayout& layout);
  void draw();

  Use& use_;
  Settings& settings_;
  const std::filesystem::path folder_;
  Window window_;
  CompareView view_;
  std::array<double, 4> mouse_{};
};

void CompareWindow::buttons(const CompareLayout& layout) {
  const float scale = view_.frame().scale();
  for (const KeyPress& press : window_.take_keys())
    for (const CompareAction& action : compare_actions())
      if (std::ranges::find(action.chords, press) != action.chords.end()) action.run(use_);
  ImGui::SetNextWindowPos(corner(layout.foot));
  ImGui::SetNextWindowSize(size_of(layout.foot));
  ImGui::Begin("buttons", nullptr,
               ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoSavedSettings |
                   ImGuiWindowFlags_NoBackground | ImGuiWindowFlags_NoNav);
  for (const CompareAction& action : compare_actions()) {
    if (*action.button == 0) continue;
    const bool playing = use_.state.playing && std::string_view(action.button) == "Play";
    const std::string face = std::string(playing ? "Pause" : action.button) + " (" +
                             words_of(action.chords.front()) + ")##" + action.name;
    if (ImGui::Button(face.c_str())) action.run(use_);
    if (ImGui::IsItemHovered()) ImGui::SetTooltip("%s", action.name);
    ImGui::SameLine();
  }
  ImGui::TextDisabled("%s",
                      shortened(use_.state.note, std::max(1.0f, ImGui::GetContentRegionAvail().x)).c_str());
  ImGui::End();
  const ImGuiIO& io = ImGui::GetIO();
  if (use_.help) {
    help_window(window_.extent(), scale, compare_keys(), use_.help);
  } else if (io.MouseDown[0] && !io.WantCaptureMouse) {
    if (const auto at = view_.moment_at(io.MousePos.x, io.MousePos.y)) {
      use_.state.cursor_s = *at;
      use_.state.playing = false;
    }
  }
}

void CompareWindow::draw() {
  while (window_.in_flight() >= Window::kPicturesInFlight) window_.poll_finished(true);
  if (!window_.begin_picture()) return;
  view_.record(
      window_.cmd(), window_.extent(), use_.state, [this](const CompareLayout& layout) { buttons(layout); },
      [this] { window_.begin_pass(); });
  const bool save = std::exchange(use_.save, false);
  window_.end_picture(save);
  if (!save) return;
  const auto image = window_.captured();
  if (!image || folder_.empty()) {
    use_.state.note = folder_.empty() ? kNoFolder : "pictures are not possible on this display";
    return;
  }
  try {
    write_comparison(folder_, *image, use_.a, use_.b);
    use_.state.note = "wrote " + (folder_ / "comparison.png").string() + " and comparison.csv";
  } catch (const Error& error) {
    use_.state.note = error.what();
  }
}

}  // namespace

std::vector<KeyHelp> compare_keys() {
  std::vector<KeyHelp> lines{{"click, drag in the charts", "to that moment"}};
  for (const CompareAction& action : compare_actions()) {
    KeyHelp line{words_of(action.chords.front()), action.name};
    for (size_t i = 1; i < action.chords.size(); ++i) line.keys += ", " + words_of(action.chords[i]);
    lines.push_back(std::move(line));
  }
  return lines;
}

RgbImage compare_picture(gpu::Context& context, const RecordingCurve& a, const RecordingCurve& b,
                         CompareState state, VkExtent2D extent) {
  Use use{a, b, state};
  use.to_largest();
  const RenderPass pass(context, OffscreenTarget::kFormat, choose_samples(context),
                        VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL);
  OffscreenTarget target(context, pass, extent);
  CompareView view(context, pass, 1, nullptr, static_cast<float>(extent.height) / 720, a, b);
  target.begin();
  view.record(target.cmd(), extent, state, {}, [&] { target.begin_pass(); });
  return target.finish();
}

void run_compare_window(gpu::Context& context, const RecordingCurve& a, const RecordingCurve& b,
                        CompareState& state, Settings& settings, const std::filesystem::path& folder,
                        const std::function<bool()>& interrupted) {
  Use use{a, b, state};
  use.to_largest();
  CompareWindow(context, use, settings, folder).run(interrupted);
}

void write_comparison(const std::filesystem::path& folder, const RgbImage& picture, const RecordingCurve& a,
                      const RecordingCurve& b) {
  make_output_folder(folder);
  write_png(picture, folder / "comparison.png");
  write_whole(folder / "comparison.csv", comparison_csv(compare_largest(a, b)));
}

}  // namespace palpate::viz
