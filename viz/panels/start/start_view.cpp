#include "viz/panels/start/start_view.h"

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>
#include <imgui.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <utility>

#include "capture/open_source.h"
#include "capture/run/input.h"
#include "capture/synthetic/tissue.h"
#include "viz/panels/run_panel.h"
#include "viz/panels/start/thumbnails.h"
#include "viz/render/drawing.h"
#include "viz/render/format.h"

namespace palpate::viz {
namespace {

const char* title_of(SourceEntry::Group group) {
  switch (group) {
    case SourceEntry::Group::Cameras:
      return "Cameras";
    case SourceEntry::Group::Recent:
      return "Recent";
    default:
      return "Simulated touches";
  }
}

/// Appearance of one line of a list.
struct LineLook {
  bool selected = false;  ///< the one that Enter takes
  bool usable = true;
  float indent = 0;  ///< room in front of the name, px
  bool tips = true;  ///< the rest is shown where the mouse is
};

/// One line of a list; true where it was clicked.
bool list_line(const char* id, const std::string& name, const std::string& detail, const LineLook& look) {
  ImGui::PushID(id);
  const float from = ImGui::GetCursorPosX() + look.indent, top = ImGui::GetCursorPosY();
  const bool clicked = ImGui::Selectable("##line", look.selected);
  const bool pointed_at = ImGui::IsItemHovered();
  const ImVec2 low = ImGui::GetItemRectMin(), high = ImGui::GetItemRectMax();
  if (look.selected) ImGui::GetWindowDrawList()->AddRectFilled(low, {low.x + 3, high.y}, ink(theme().chosen));
  const float bottom = ImGui::GetCursorPosY();
  ImGui::SetCursorPos({from, top});
  const std::string shown = shortened(name, ImGui::GetContentRegionAvail().x);
  ImGui::TextColored(tint(look.usable ? theme().text : theme().faint), "%s", shown.c_str());
  ImGui::SetCursorPosY(bottom);
  if (look.tips && pointed_at) {
    ImGui::BeginTooltip();
    ImGui::PushTextWrapPos(0.9f * ImGui::GetIO().DisplaySize.x);
    ImGui::Text("%s\n%s", name.c_str(), detail.c_str());
    ImGui::PopTextWrapPos();
    ImGui::EndTooltip();
  }
  ImGui::PopID();
  return clicked;
}

}  // namespace

StartView::StartView(gpu::Context& context, Window& window, Settings& settings, const StartTrouble& trouble,
                     std::string folder)
    : window_(window),
      settings_(settings),
      page_(context, window, settings.view),
      list_(settings),
      look_([](const std::string& input) { return open_source(input, bare_sensor(input)); }),
      message_(in_the_window(trouble.message)),
      trouble_(!trouble.message.empty()),
      folder_(std::move(folder)) {
  window_.set_title("palpate");
  std::snprintf(typed_.data(), typed_.size(), "%s", trouble.choice.typed.c_str());
  if (!trouble.choice.sensor.empty()) sensor_ = list_.add_sensor(trouble.choice.sensor);
  load_thumbnails();
}

void StartView::load_thumbnails() {
  std::vector<RgbImage> pictures;
  for (const Settings::Recent& recent : settings_.recent)
    if (auto picture = load_thumbnail(recent.input)) {
      thumbnail_of_[{SourceEntry::Group::Recent, recent.input}] = pictures.size();
      pictures.push_back(std::move(*picture));
    }
  for (const auto& [input, picture] : list_.simulated()) {
    thumbnail_of_[{SourceEntry::Group::Synthetic, input}] = pictures.size();
    pictures.push_back(picture);
  }
  page_.set_pictures(std::move(pictures));
}

std::optional<Choice> StartView::choose(const std::function<bool()>& interrupted) {
  page_.run(
      [this] {
        take_drops();
        handle_keys();
        follow_look();
        describe();
      },
      [this] { return chosen_.has_value(); },
      [this] {
        const size_t pictures = list_.simulated().size();
        const bool seen = look_.update(), changed = list_.update() || seen;
        if (list_.simulated().size() != pictures) load_thumbnails();
        return changed || list_.looking();
      },

      interrupted);
  return std::exchange(chosen_, {});
}

bool StartView::wait(const std::string& what, const std::function<bool()>& done) {
  return page_.wait("opening " + what, done);
}

void StartView::step(int right, int down) {
  settled_ = scroll_ = true;
  if (in_sensors_) {
    const auto last = static_cast<int>(list_.sensors().size()) - 1;
    sensor_ = static_cast<size_t>(std::clamp(static_cast<int>(sensor_) + down, 0, std::max(last, 0)));
    return;
  }
  const auto at = std::ranges::find(cards_, source_);
  if (at == cards_.end()) return;
  const size_t card = grid_.neighbour(static_cast<size_t>(at - cards_.begin()), right, down);
  source_ = cards_[std::min(card, cards_.size() - 1)];
}

void StartView::handle_keys() {
  const bool typing = ImGui::GetIO().WantTextInput;
  for (const KeyPress& press : window_.take_keys()) {
    if (press.control && (press.key == GLFW_KEY_EQUAL || press.key == GLFW_KEY_MINUS ||
                          press.key == GLFW_KEY_KP_ADD || press.key == GLFW_KEY_KP_SUBTRACT)) {
      const bool larger = press.key == GLFW_KEY_EQUAL || press.key == GLFW_KEY_KP_ADD;
      settings_.view.enlarge_text(larger);
      continue;
    }
    if (typing) continue;
    switch (press.key) {
      case GLFW_KEY_UP:
        step(0, -1);
        break;
      case GLFW_KEY_DOWN:
        step(0, 1);
        break;
      case GLFW_KEY_LEFT:
        step(-1, 0);
        break;
      case GLFW_KEY_RIGHT:
        step(1, 0);
        break;
      case GLFW_KEY_PAGE_UP:
        step(0, in_sensors_ ? -8 : -3);
        break;
      case GLFW_KEY_PAGE_DOWN:
        step(0, in_sensors_ ? 8 : 3);
        break;
      case GLFW_KEY_TAB:
        in_sensors_ = !in_sensors_;
        scroll_ = true;
        break;
      case GLFW_KEY_ENTER:
      case GLFW_KEY_KP_ENTER:
        open_selected();
        break;
      case GLFW_KEY_L:
        switch_look();
        break;
      case GLFW_KEY_O:
        wants_text_ = true;
        break;
      case GLFW_KEY_N:
        chosen_ = Choice{{}, {}, typed_.data(), true};
        break;
      case GLFW_KEY_F5:
        list_.refresh(settings_);
        break;
      case GLFW_KEY_F11:
        window_.switch_full_screen();
        break;
      case GLFW_KEY_H:
      case GLFW_KEY_F1:
        help_ = !help_;
        break;
      case GLFW_KEY_DELETE:
        if (source_ < list_.sources().size() &&
            list_.sources()[source_].group == SourceEntry::Group::Recent) {
          settings_.forget({list_.sources()[source_].input, {}});
          list_.refresh(settings_);
        }
        break;
      case GLFW_KEY_ESCAPE:
        if (std::exchange(help_, false)) break;
        [[fallthrough]];
      case GLFW_KEY_Q:
        glfwSetWindowShouldClose(window_.handle(), GLFW_TRUE);
        break;
      default:
        break;
    }
  }
}

const std::vector<KeyHelp>& start_key_help() {
  static const std::vector<KeyHelp> lines{
      {"click", "open a source, choose a sensor file"},
      {"arrows, Page up, down", "move the selection"},
      {"Enter", "open the selected source"},
      {"L", "look through the selected camera, or no longer"},
      {"Tab", "from the sources to the sensor files and back"},
      {"O", "type the path of a recording, or another source"},
      {"N", "set up a new sensor"},
      {"drop a file", "open it; a sensor file is chosen"},
      {"F5", "search again for cameras and sensor files"},
      {"Del", "forget a recent source"},
      {"Ctrl + plus, minus", "larger, smaller text"},
      {"F11", "full screen"},
      {"H, F1", "this help; a source that is open has its own"},
      {"Esc, Q", "close what is open; quit"},
  };
  return lines;
}

/// Through the selected camera, or no longer.
void StartView::switch_look() {
  if (source_ >= list_.sources().size() || list_.sources()[source_].group != SourceEntry::Group::Cameras)
    return;
  const std::string input = list_.sources()[source_].input, before = look_.input();
  look_.stop();
  if (!input.empty() && input != before) look_.start(input);
}

/// Ends with the selection; where it fails, the message says why.
void StartView::follow_look() {
  if (look_.input().empty()) return;
  if (source_ >= list_.sources().size() || list_.sources()[source_].input != look_.input()) look_.stop();
  if (look_.trouble().empty()) return;
  message_ = in_the_window(look_.trouble());
  trouble_ = true;
  look_.stop();
}

void StartView::open_selected() {
  if (source_ >= list_.sources().size()) return;
  if (list_.sources()[source_].input.empty()) return;
  look_.stop();  // a camera has one user
  const SourceEntry& source = list_.sources()[source_];
  const SensorEntry& sensor = list_.sensors()[std::min(sensor_, list_.sensors().size() - 1)];
  if (!sensor.usable) {
    message_ = sensor.detail;
    trouble_ = true;
    return;
  }
  chosen_ = Choice{source.input, sensor.file.empty() ? source.sensor : sensor.file, {}};
}

void StartView::choose_sensor(const std::string& file) {
  sensor_ = list_.add_sensor(file);
  const SensorEntry& sensor = list_.sensors()[sensor_];
  trouble_ = !sensor.usable;
  message_ = sensor.usable ? "sensor '" + sensor.name + "'; now what it looks at" : sensor.detail;
}

void StartView::open_text() {
  const std::string input = typed_.data();
  if (input.empty()) return;
  look_.stop();
  if (StartList::is_sensor_file(input)) {
    choose_sensor(input);
    if (!trouble_) typed_ = {};
    return;
  }
  const SensorEntry& sensor = list_.sensors()[std::min(sensor_, list_.sensors().size() - 1)];
  chosen_ = Choice{input, sensor.file, input};
}

/// A sensor file becomes the chosen one, anything else is opened.
void StartView::take_drops() {
  for (const std::string& path : window_.take_drops()) {
    std::snprintf(typed_.data(), typed_.size(), "%s", path.c_str());
    open_text();
  }
}

void StartView::describe_sources(float scale) {
  const auto& sources = list_.sources();
  // The first card that can be opened, until the person chooses.
  if (!settled_ || source_ >= sources.size())
    for (source_ = 0; source_ + 1 < sources.size() && sources[source_].input.empty();) ++source_;
  grid_.begin(page_.frame(), ImGui::GetContentRegionAvail().x);
  cards_.clear();
  for (size_t i = 0; i < sources.size(); ++i) {
    const SourceEntry& e = sources[i];
    if (i == 0 || sources[i - 1].group != e.group) grid_.heading(title_of(e.group));
    if (!e.can_be_chosen()) {
      grid_.remark(e.name + (e.detail.empty() ? "" : ": " + e.detail));
      continue;
    }
    PictureCard card{e.name, e.detail, {}, is_tissue(e.input), !e.missing};
    const bool camera = e.group == SourceEntry::Group::Cameras, looks = camera && e.input == look_.input();
    const auto at = thumbnail_of_.find(e.still.empty() ? std::pair{e.group, e.input}
                                                       : std::pair{SourceEntry::Group::Recent, e.still});
    if (at != thumbnail_of_.end()) card.picture = at->second;
    if (looks && look_.picture()) card.live = &*look_.picture();
    card.instead = looks ? "opening it" : camera ? "no picture yet" : "";
    if (camera) card.button = looks ? "End look (L)" : "Look (L)";
    cards_.push_back(i);
    const CardClick clicked =
        grid_.add(card, i == source_ && !in_sensors_, i == source_ && scroll_ && !in_sensors_,
                  help_ ? "" : e.name + "\n" + e.whole);
    if (clicked == CardClick::Nothing) continue;
    source_ = i;
    settled_ = true;
    in_sensors_ = false;
    // One click is enough.
    if (clicked == CardClick::Button)
      switch_look();
    else
      open_selected();
  }
  ImGui::Dummy({1, 2 * scale});
}

void StartView::describe_sensors(float scale) {
  const auto& sensors = list_.sensors();
  for (size_t i = 0; i < sensors.size(); ++i) {
    const ImVec2 at = ImGui::GetCursorScreenPos();
    if (list_line(std::to_string(i).c_str(), sensors[i].name, sensors[i].detail,
                  {.selected = i == sensor_ && in_sensors_,
                   .usable = sensors[i].usable,
                   .indent = 22 * scale,
                   .tips = !help_})) {
      sensor_ = i;
      in_sensors_ = true;
    }
    // One of them is used whatever is opened.
    ImDrawList* list = ImGui::GetWindowDrawList();
    const ImVec2 middle{at.x + 11 * scale, at.y + ImGui::GetTextLineHeight() / 2};
    list->AddCircle(middle, 5 * scale, ImGui::GetColorU32(ImGuiCol_TextDisabled), 0, 1.2f * scale);
    if (i == sensor_) list->AddCircleFilled(middle, 3 * scale, ink(theme().chosen));
    if (i == sensor_ && scroll_ && in_sensors_) ImGui::SetScrollHereY();
  }
}

/// Where anything can be typed, and where things go.
void StartView::describe_foot(float scale) {
  ImGui::SetNextItemWidth(std::max(ImGui::GetContentRegionAvail().x - 200 * scale, 80 * scale));
  if (std::exchange(wants_text_, false)) ImGui::SetKeyboardFocusHere();
  // Letters may come some pictures late: the field itself knows which were typed before Enter.
  if (ImGui::InputTextWithHint(
          "##typed", "a recording, a session, a sensor file, camera:/dev/video0?fps=60, synthetic:slide ...",
          typed_.data(), typed_.size(), ImGuiInputTextFlags_EnterReturnsTrue))
    open_text();
  ImGui::SameLine();
  if (ImGui::Button("Open")) open_text();
  ImGui::SameLine();
  if (ImGui::Button("Search again")) list_.refresh(settings_);
  const auto line = [](const std::string& words) {
    ImGui::TextDisabled("%s", shortened(words, ImGui::GetContentRegionAvail().x).c_str());
  };
  line("Click, or arrows and Enter; Tab: sensor files; H: all keys; Esc: quit");
  if (source_ < list_.sources().size()) line(list_.opened_with(source_, sensor_));
  line(folder_.empty() ? "recordings and snapshots: nowhere to write"
                       : "recordings and snapshots go to " + folder_);
}

void StartView::describe() {
  const float scale = page_.frame().scale();
  const ImVec2 size = ImGui::GetIO().DisplaySize;
  page_.begin_page("start", "what is to be touched?", message_, trouble_);
  const float foot = ImGui::GetFrameHeightWithSpacing() + 3.4f * ImGui::GetTextLineHeightWithSpacing();
  const float height = std::max(ImGui::GetContentRegionAvail().y - foot, 60 * scale);
  const bool side_by_side = size.x > 760 * scale;
  const float list_width = side_by_side ? 0.7f * ImGui::GetContentRegionAvail().x : 0;
  const ImVec4 border = ImGui::GetStyleColorVec4(ImGuiCol_Border);
  ImGui::PushStyleColor(ImGuiCol_Border, in_sensors_ ? border : tint(theme().chosen));
  ImGui::BeginChild("sources", {list_width, side_by_side ? height : 0.62f * height}, true,
                    ImGuiWindowFlags_NoNav | ImGuiWindowFlags_AlwaysVerticalScrollbar);
  describe_sources(scale);
  ImGui::EndChild();
  ImGui::PopStyleColor();
  if (side_by_side) ImGui::SameLine();
  ImGui::BeginGroup();
  const float top = ImGui::GetCursorPosY();
  if (ImGui::Button("Set up a new sensor (N)", {-1, 2 * ImGui::GetFrameHeight()}))
    chosen_ = Choice{{}, {}, typed_.data(), true};
  const float taken = ImGui::GetCursorPosY() - top;
  ImGui::PushStyleColor(ImGuiCol_Border, in_sensors_ ? tint(theme().chosen) : border);
  ImGui::BeginChild("sensors", {0, (side_by_side ? height : 0.36f * height) - taken}, true,
                    ImGuiWindowFlags_NoNav);
  ImGui::TextColored(tint(theme().chosen), "Sensor file");
  describe_sensors(scale);
  run_panel(settings_.run, scale);
  ImGui::EndChild();
  ImGui::PopStyleColor();
  ImGui::EndGroup();
  scroll_ = false;
  describe_foot(scale);
  ImGui::End();
  page_.help(start_key_help(), help_);
}

}  // namespace palpate::viz
