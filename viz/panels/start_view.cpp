#include "viz/panels/start_view.h"

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>
#include <imgui.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <utility>

#include "viz/panels/run_panel.h"
#include "viz/panels/thumbnails.h"
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
  float name_width = 100, height = 0;  ///< px; 0: of one row of text
  float indent = 0;                    ///< room in front of the name, px
  bool tips = true;                    ///< what has no room is shown where the mouse is
};

/// One line of a list, its name in front and the rest faint, below the name in a high one; true where it was
/// clicked.
bool list_line(const char* id, const std::string& name, const std::string& detail, const LineLook& look) {
  ImGui::PushID(id);
  const float from = ImGui::GetCursorPosX() + look.indent, top = ImGui::GetCursorPosY();
  const bool clicked = ImGui::Selectable("##line", look.selected, 0, {0, look.height});
  const bool pointed_at = ImGui::IsItemHovered();
  const ImVec2 low = ImGui::GetItemRectMin(), high = ImGui::GetItemRectMax();
  if (look.selected) ImGui::GetWindowDrawList()->AddRectFilled(low, {low.x + 3, high.y}, ink(theme().chosen));
  const float bottom = ImGui::GetCursorPosY();
  const bool high_row = look.height > 1.9f * ImGui::GetTextLineHeight();
  const float y = high_row ? top + look.height / 2 - ImGui::GetTextLineHeight() : top;
  ImGui::SetCursorPos({from, y});
  const float room = ImGui::GetContentRegionAvail().x;
  const std::string shown = shortened(name, high_row ? room : look.name_width - 8);
  if (look.usable)
    ImGui::TextUnformatted(shown.c_str());
  else
    ImGui::TextDisabled("%s", shown.c_str());
  ImGui::SetCursorPos(high_row ? ImVec2{from, y + ImGui::GetTextLineHeight()}
                               : ImVec2{from + look.name_width, y});
  const std::string rest = shortened(detail, ImGui::GetContentRegionAvail().x);
  ImGui::TextDisabled("%s", rest.c_str());
  ImGui::SetCursorPosY(bottom);
  if (look.tips && pointed_at && (shown != name || rest != detail)) {  // what had no room
    ImGui::BeginTooltip();
    ImGui::PushTextWrapPos(0.9f * ImGui::GetIO().DisplaySize.x);
    ImGui::Text("%s   %s", name.c_str(), detail.c_str());
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
      thumbnail_of_[recent.input] = pictures.size();
      pictures.push_back(std::move(*picture));
    }
  page_.set_pictures(std::move(pictures));
}

std::optional<Choice> StartView::choose(const std::function<bool()>& interrupted) {
  page_.run(
      [this] {
        take_drops();
        handle_keys();
        describe();
      },
      [this] { return chosen_.has_value(); }, [this] { return list_.update() || list_.looking(); },
      interrupted);
  return std::exchange(chosen_, {});
}

bool StartView::wait(const std::string& what, const std::function<bool()>& done) {
  return page_.wait("opening " + what, done);
}

void StartView::step(int by) {
  settled_ = scroll_ = true;
  if (in_sensors_) {
    const auto last = static_cast<int>(list_.sensors().size()) - 1;
    sensor_ = static_cast<size_t>(std::clamp(static_cast<int>(sensor_) + by, 0, std::max(last, 0)));
    return;
  }
  // Remarks are passed over.
  const auto& sources = list_.sources();
  const int direction = by < 0 ? -1 : 1;
  auto at = static_cast<int>(source_);
  for (int left = std::abs(by); left > 0;) {
    int next = at + direction;
    while (next >= 0 && next < static_cast<int>(sources.size()) &&
           !sources[static_cast<size_t>(next)].can_be_chosen())
      next += direction;
    if (next < 0 || next >= static_cast<int>(sources.size())) break;
    at = next;
    --left;
  }
  source_ = static_cast<size_t>(at);
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
    if (typing) {
      entered_ |= press.key == GLFW_KEY_ENTER || press.key == GLFW_KEY_KP_ENTER;
      continue;
    }
    switch (press.key) {
      case GLFW_KEY_UP:
        step(-1);
        break;
      case GLFW_KEY_DOWN:
        step(1);
        break;
      case GLFW_KEY_PAGE_UP:
        step(-8);
        break;
      case GLFW_KEY_PAGE_DOWN:
        step(8);
        break;
      case GLFW_KEY_TAB:
      case GLFW_KEY_LEFT:
      case GLFW_KEY_RIGHT:
        in_sensors_ = !in_sensors_;
        scroll_ = true;
        break;
      case GLFW_KEY_ENTER:
      case GLFW_KEY_KP_ENTER:
        open_selected();
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
      {"Up, Down, Page up, down", "move the selection"},
      {"Enter", "open the selected source"},
      {"Tab, Left, Right", "from the sources to the sensor files and back"},
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

void StartView::open_selected() {
  if (source_ >= list_.sources().size()) return;
  if (list_.sources()[source_].input.empty()) return;
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
  // The first line that can be opened, until the person chooses.
  if (!settled_ || source_ >= sources.size())
    for (source_ = 0; source_ + 1 < sources.size() && sources[source_].input.empty();) ++source_;
  const float name_width = std::min(0.45f * ImGui::GetContentRegionAvail().x, 260 * scale);
  for (size_t i = 0; i < sources.size(); ++i) {
    const SourceEntry& e = sources[i];
    if (i == 0 || sources[i - 1].group != e.group) {
      if (i > 0) ImGui::Dummy({1, 4 * scale});
      ImGui::TextColored(tint(theme().chosen), "%s", title_of(e.group));
    }
    LineLook look{.selected = i == source_ && e.can_be_chosen() && !in_sensors_,
                  .usable = !e.input.empty() && !e.missing,
                  .name_width = name_width,
                  .tips = !help_};
    const auto picture =
        e.group == SourceEntry::Group::Recent ? thumbnail_of_.find(e.input) : thumbnail_of_.end();
    const ImVec2 at = ImGui::GetCursorScreenPos();
    if (e.group == SourceEntry::Group::Recent && !e.input.empty()) {
      look.height = 40 * scale;
      look.indent = 60 * scale;
    }
    const bool clicked = list_line(std::to_string(i).c_str(), e.name, e.detail, look);
    if (picture != thumbnail_of_.end())
      page_.frame().draw_picture(picture->second, {at.x + 5 * scale, at.y + scale},
                                 {at.x + 5 * scale + 50.7f * scale, at.y + 39 * scale});
    if (i == source_ && scroll_ && !in_sensors_) ImGui::SetScrollHereY();
    if (!clicked || !e.can_be_chosen()) continue;
    source_ = i;
    settled_ = true;
    in_sensors_ = false;
    open_selected();  // one click is enough
  }
}

void StartView::describe_sensors(float scale) {
  const auto& sensors = list_.sensors();
  const float name_width = std::min(0.62f * ImGui::GetContentRegionAvail().x, 300 * scale);
  for (size_t i = 0; i < sensors.size(); ++i) {
    const ImVec2 at = ImGui::GetCursorScreenPos();
    if (list_line(std::to_string(i).c_str(), sensors[i].name, sensors[i].detail,
                  {.selected = i == sensor_ && in_sensors_,
                   .usable = sensors[i].usable,
                   .name_width = name_width,
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

void StartView::describe() {
  const float scale = page_.frame().scale();
  const ImVec2 size = ImGui::GetIO().DisplaySize;
  page_.begin_page("start", "what is to be touched?", message_, trouble_);
  const float foot = 3.2f * ImGui::GetFrameHeightWithSpacing();
  const float height = std::max(ImGui::GetContentRegionAvail().y - foot, 60 * scale);
  const bool side_by_side = size.x > 760 * scale;
  const float list_width = side_by_side ? 0.62f * ImGui::GetContentRegionAvail().x : 0;
  const ImVec4 border = ImGui::GetStyleColorVec4(ImGuiCol_Border);
  ImGui::PushStyleColor(ImGuiCol_Border, in_sensors_ ? border : tint(theme().chosen));
  ImGui::BeginChild("sources", {list_width, side_by_side ? height : 0.62f * height}, true,
                    ImGuiWindowFlags_NoNav);
  describe_sources(scale);
  ImGui::EndChild();
  ImGui::PopStyleColor();
  if (side_by_side) ImGui::SameLine();
  ImGui::PushStyleColor(ImGuiCol_Border, in_sensors_ ? tint(theme().chosen) : border);
  ImGui::BeginChild("sensors", {0, side_by_side ? height : 0.36f * height}, true, ImGuiWindowFlags_NoNav);
  ImGui::TextColored(tint(theme().chosen), "Sensor file");
  describe_sensors(scale);
  run_panel(settings_.run, scale);
  ImGui::EndChild();
  ImGui::PopStyleColor();
  scroll_ = false;

  ImGui::SetNextItemWidth(ImGui::GetContentRegionAvail().x - 300 * scale);
  ImGui::InputTextWithHint(
      "##typed", "a recording, a session, a sensor file, camera:/dev/video0?fps=60, synthetic:slide ...",
      typed_.data(), typed_.size());
  if (std::exchange(entered_, false)) open_text();
  ImGui::SameLine();
  if (ImGui::Button("Open")) open_text();
  ImGui::SameLine();
  if (ImGui::Button("Search again")) list_.refresh(settings_);
  ImGui::SameLine();
  if (ImGui::Button("New sensor")) chosen_ = Choice{{}, {}, typed_.data(), true};
  ImGui::TextDisabled("%s", shortened("Click, or arrows and Enter; Tab: sensor files; H: all keys; Esc: quit",
                                      ImGui::GetContentRegionAvail().x)
                                .c_str());
  ImGui::TextDisabled("%s", shortened(folder_.empty() ? "recordings and snapshots: nowhere to write"
                                                      : "recordings and snapshots go to " + folder_,
                                      ImGui::GetContentRegionAvail().x)
                                .c_str());
  ImGui::End();
  page_.help(start_key_help(), help_);
}

}  // namespace palpate::viz
