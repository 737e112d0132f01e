#include "viz/panels/setup_view.h"

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>
#include <imgui.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <iterator>
#include <utility>
#include <vector>

#include "viz/panels/start/thumbnails.h"
#include "viz/render/drawing.h"
#include "viz/render/format.h"

namespace palpate::viz {
namespace {

constexpr ImU32 kCorner = IM_COL32(255, 190, 70, 255), kOutline = IM_COL32(255, 190, 70, 200);
constexpr uint32_t kPicture_px = 1000;
// Steps in their order, and what each is for.
enum Step : size_t { kFrame, kUntouched, kTouch, kScale, kSurface, kForce };
constexpr std::array<std::array<const char*, 2>, SetupView::kSteps> kStepWords{
    {{"pad in the picture", "Which part of the camera's picture is the pad."},
     {"untouched image", "How the pad looks at rest, and how much each pixel changes by noise."},
     {"touch", "What a touch changes, and from which change on it is one."},
     {"scale", "Millimetres of a pixel; without it lengths are in px."},
     {"surface", "Depth, from presses of a ball of known size."},
     {"force", "Newtons, from presses on a force gauge."}}};

/// Names the missing inputs as this form does, instead of by the options of the command.
std::string by_field(std::string words) {
  static const std::vector<std::pair<std::string, std::string>> kFields{
      {": --background FILE", ", in 'picture at rest'"},
      {"--pitch MM_PER_PX, or a picture of a grid: --grid-pictures FILE --grid 9x7 --spacing-mm 2.5",
       "'mm per px', or pictures of a grid"},
      {": --ball-radius-mm RADIUS [--balls FOLDER]", ", and 'ball radius'"},
      {": --gauge FILE", ", in 'gauge table'"},
      {"; if that is the pad: --corners ", "; if that is the pad, 'Propose' corners: "},
      {" (or auto)", ""},
      {"look at the image, --like N chooses", "look at the image, or give another in 'picture at rest'"},
      {": palpate record, then palpate setup with it",
       ": record one from the list of sources, then open it here"},
  };
  for (const auto& [option, field] : kFields)
    if (const size_t at = words.find(option); at != std::string::npos)
      words.replace(at, option.size(), field);
  return words;
}

}  // namespace

SetupView::SetupView(gpu::Context& context, Window& window, Settings& settings, SetupForm& form)
    : window_(window), form_(form), page_(context, window, settings.view) {
  window_.set_title("palpate: a sensor of your own");
}

void SetupView::set_pictures() {
  std::vector<RgbImage> pictures{picture_};
  if (untouched_) pictures.push_back(*untouched_);
  page_.set_pictures(std::move(pictures));
}

void SetupView::show_untouched(const std::optional<Frame>& frame) {
  const bool had = std::exchange(untouched_, std::nullopt).has_value();
  if (frame) untouched_ = scaled_down(*frame, kPicture_px, kPicture_px);
  if (camera_px_[0] > 0 && (frame || had)) set_pictures();
}

void SetupView::show(const Frame& frame) {
  camera_px_ = {frame.format.width, frame.format.height};
  picture_ = scaled_down(frame, kPicture_px, kPicture_px);
  set_pictures();
  const double w = camera_px_[0], h = camera_px_[1];
  const bool outside = std::any_of(form_.corners.begin(), form_.corners.end(), [&](const auto& corner) {
    return corner[0] < 0 || corner[1] < 0 || corner[0] > w || corner[1] > h;
  });
  const bool none = form_.corners == decltype(form_.corners){};
  if (outside || none)
    form_.corners = {{{0.1 * w, 0.1 * h}, {0.9 * w, 0.1 * h}, {0.9 * w, 0.9 * h}, {0.1 * w, 0.9 * h}}};
}

void SetupView::set_message(const std::string& message, bool trouble) {
  message_ = message;
  trouble_ = trouble;
}

std::optional<SetupWish> SetupView::next(const std::function<bool()>& interrupted) {
  page_.run(
      [this] {
        take_drops();
        handle_keys();
        describe();
      },
      [this] { return wish_.has_value(); }, [] { return false; }, interrupted);
  return std::exchange(wish_, {});
}

void SetupView::wait(const std::string& words, const std::function<bool()>& done) {
  page_.wait(words, done, false);
}

void SetupView::handle_keys() {
  const bool typing = ImGui::GetIO().WantTextInput;
  for (const KeyPress& press : window_.take_keys()) {
    if (press.key == GLFW_KEY_F11) window_.switch_full_screen();
    if (press.key == GLFW_KEY_F1 || (press.key == GLFW_KEY_H && !typing)) help_ = !help_;
    if (press.key == GLFW_KEY_TAB && fields_ > 0)
      wanted_field_ = (typed_in_.value_or(fields_ - 1) + (press.shift ? fields_ - 1 : 1)) % fields_;
    if (press.key == GLFW_KEY_PAGE_UP && at_ > 0) --at_;
    if (press.key == GLFW_KEY_PAGE_DOWN && at_ + 1 < kSteps) ++at_;
    const bool made = !lines_[0].name.empty();
    if (press.control && (press.key == GLFW_KEY_ENTER || press.key == GLFW_KEY_KP_ENTER))
      wish(SetupWish::What::MakeAll);
    if (press.key == GLFW_KEY_F5 && made && at_ > 0) wish(SetupWish::What::Again, at_);
    if (press.control && press.key == GLFW_KEY_L && made) wish(SetupWish::What::Look);
    if (at_ == kFrame && camera_px_[0] > 0 && !typing) corner_key(press);
    if (press.key != GLFW_KEY_ESCAPE || typing) continue;
    if (!std::exchange(help_, false)) wish(SetupWish::What::Leave);
  }
}

/// Of the step of the pad: cutting, its proposal, and the corners one by one.
void SetupView::corner_key(const KeyPress& press) {
  if (press.key == GLFW_KEY_C) form_.cut = !form_.cut;
  if (press.key == GLFW_KEY_P) wish(SetupWish::What::Propose);
  if (!form_.cut) return;
  if (press.key >= GLFW_KEY_1 && press.key <= GLFW_KEY_4)
    corner_ = static_cast<size_t>(press.key - GLFW_KEY_1);
  const double step = press.shift ? 10 : 1;
  const auto move = [&](size_t axis, double by) {
    double& place = form_.corners[corner_][axis];
    place = std::clamp(place + by, 0.0, camera_px_[axis] - 1.0);
  };
  if (press.key == GLFW_KEY_LEFT) move(0, -step);
  if (press.key == GLFW_KEY_RIGHT) move(0, step);
  if (press.key == GLFW_KEY_UP) move(1, -step);
  if (press.key == GLFW_KEY_DOWN) move(1, step);
}

const std::vector<KeyHelp>& setup_key_help() {
  static const std::vector<KeyHelp> lines{
      {"drop a file", "a recording; then .csv: gauge table, picture: pad at rest"},
      {"drag a corner", "to that of the pad, where the pad is cut out"},
      {"C; P", "cut the pad out, or not; propose its corners"},
      {"1 to 4, arrows, Shift + arrows", "choose a corner; move it by 1 px, 10 px"},
      {"Tab, Shift + Tab", "from field to field"},
      {"Enter in the first field", "open the recording"},
      {"click on a step, Page up, down", "its fields"},
      {"Ctrl + Enter", "make the sensor file"},
      {"F5, or 'Do this step again'", "it alone, with what is filled in now"},
      {"Ctrl + L", "look at the recording with it"},
      {"F11", "full screen"},
      {"H, F1", "this help"},
      {"Esc", "close the help; back to the list of sources"},
  };
  return lines;
}

std::optional<double> typed_length(const std::string& text) {
  std::string number = text;
  std::replace(number.begin(), number.end(), ',', '.');
  const size_t first = number.find_first_not_of(" \t");
  if (first == std::string::npos) return 0.0;
  char* end = nullptr;
  const double value = std::strtod(number.c_str() + first, &end);
  const bool whole =
      number.find_first_not_of(" \t", static_cast<size_t>(end - number.c_str())) == std::string::npos;
  if (end == number.c_str() + first || !whole || !std::isfinite(value) || value <= 0) return std::nullopt;
  return value;
}

/// A table of forces, a picture of the pad at rest once a recording is open, or the recording.
void SetupView::take_drops() {
  for (const std::string& dropped : window_.take_drops()) {
    const auto put = [&](SetupForm::Path& field) {
      std::snprintf(field.data(), field.size(), "%s", dropped.c_str());
    };
    std::string end = std::filesystem::path(dropped).extension();
    std::transform(end.begin(), end.end(), end.begin(), [](unsigned char c) { return std::tolower(c); });
    if (end == ".csv") {
      put(form_.gauge);
    } else if (camera_px_[0] > 0 && (end == ".png" || end == ".jpg" || end == ".bmp" || end == ".tif")) {
      put(form_.background);
    } else {
      put(form_.recording);
      wish(SetupWish::What::Open);
    }
  }
}

/// Around each field of text: Tab goes from one to the next.
void SetupView::begin_field() {
  if (wanted_field_ != fields_) return;
  ImGui::SetKeyboardFocusHere();
  wanted_field_.reset();
}
void SetupView::end_field() {
  if (ImGui::IsItemActive()) typed_in_ = fields_;
  ++fields_;
}

bool SetupView::path(const char* label, const char* hint, SetupForm::Path& value) {
  ImGui::SetNextItemWidth(-0.36f * ImGui::GetContentRegionAvail().x);
  begin_field();
  const bool entered =
      ImGui::InputTextWithHint(label, hint, value.data(), value.size(), ImGuiInputTextFlags_EnterReturnsTrue);
  end_field();
  return entered;
}

void SetupView::number(const char* label, const char* hint, double& value) {
  const auto [found, is_new] = typed_.try_emplace(label);
  Typed& typed = found->second;
  if (is_new || typed.value != value) {  // set by something else than these keys
    typed.value = value;
    typed.text = {};
    if (value > 0) std::snprintf(typed.text.data(), typed.text.size(), "%.6g", value);
  }
  ImGui::SetNextItemWidth(0.3f * ImGui::GetContentRegionAvail().x);
  begin_field();
  ImGui::InputTextWithHint(label, hint, typed.text.data(), typed.text.size());
  end_field();
  const std::optional<double> length = typed_length(typed.text.data());
  typed.value = value = length.value_or(0);
  if (length) return;
  ImGui::SameLine();
  ImGui::TextColored(tint(theme().wrong), "no length");
}

/// The steps in a column, each with its state; a click goes to its fields.
void SetupView::describe_path(float scale) {
  const bool begun = !lines_[0].name.empty();
  const float row = 1.5f * ImGui::GetTextLineHeight();
  for (size_t step = 0; step < kSteps; ++step) {
    ImGui::PushID(static_cast<int>(step));
    const ImVec2 low = ImGui::GetCursorScreenPos();
    const float right = low.x + ImGui::GetContentRegionAvail().x;
    if (ImGui::Selectable("##step", step == at_, 0, {0, row})) at_ = step;
    ImDrawList& list = *ImGui::GetWindowDrawList();
    const bool done = begun && lines_[step].done;
    const float y = low.y + (row - ImGui::GetTextLineHeight()) / 2;
    const ImVec2 middle{low.x + row / 2, low.y + row / 2};
    const Rgb colour = done ? theme().valid : begun ? theme().doubtful : theme().faint;
    list.AddCircle(middle, 0.42f * row, ink(colour), 0, 1.5f * scale);
    const std::string number = std::to_string(step + 1);
    list.AddText({middle.x - ImGui::CalcTextSize(number.c_str()).x / 2, y}, ink(colour), number.c_str());
    list.AddText({low.x + 1.4f * row, y}, ink(theme().text), kStepWords[step][0]);
    const char* state = done ? "known" : begun ? "missing" : "";
    list.AddText({right - ImGui::CalcTextSize(state).x, y}, ink(colour), state);
    ImGui::PopID();
  }
}

/// Fields of the step that is shown.
void SetupView::describe_fields() {
  switch (at_) {
    case kFrame:
      ImGui::Checkbox("cut the pad out by its corners", &form_.cut);
      ImGui::SameLine();
      if (ImGui::Button("Propose")) wish(SetupWish::What::Propose);
      break;
    case kUntouched:
      path("picture at rest", "found in the recording", form_.background);
      break;
    case kScale:
      number("mm per px", "not known", form_.pitch_mm_per_px);
      path("grid pictures", "instead: of a grid that is known", form_.grid_pictures);
      if (form_.grid_pictures[0] == '\0') break;
      ImGui::SetNextItemWidth(0.3f * ImGui::GetContentRegionAvail().x);
      begin_field();
      ImGui::InputTextWithHint("columns x rows", "9x7", form_.grid.data(), form_.grid.size());
      end_field();
      number("mm between points", "not known", form_.spacing_mm);
      break;
    case kSurface:
      number("ball radius, mm", "no ball", form_.ball_radius_mm);
      path("its presses", "those of the recording", form_.balls);
      break;
    case kForce:
      path("gauge table", "CSV: frame or time_s, force_N", form_.gauge);
      break;
    default:
      break;
  }
}

void SetupView::describe_steps(float scale) {
  fields_ = 0;
  typed_in_.reset();
  ImGui::TextColored(tint(theme().chosen), "recording of touches");
  if (path("##recording", "a video, a folder, a session, camera:/dev/video0", form_.recording))
    wish(SetupWish::What::Open);
  ImGui::SameLine();
  if (ImGui::Button("Open")) wish(SetupWish::What::Open);
  path("sensor file", "is written here", form_.sensor_file);
  ImGui::Dummy({1, 4 * scale});
  describe_path(scale);
  ImGui::Separator();
  ImGui::TextColored(tint(theme().chosen), "%zu  %s", at_ + 1, kStepWords[at_][0]);
  ImGui::PushTextWrapPos(0);
  ImGui::TextDisabled("%s", kStepWords[at_][1]);
  ImGui::PopTextWrapPos();
  describe_fields();
  const SetupLine& line = lines_[at_];
  if (!line.known.empty()) wrapped_text(line.known, tint(theme().text));
  if (!line.missing.empty()) wrapped_text(by_field(line.missing), tint(theme().doubtful));
  if (at_ == kSurface && next_)
    wrapped_text("three more presses where the picture is framed: " + next_->reason, tint(theme().doubtful));
  if (at_ == kSurface) describe_refused();
  if (at_ > 0 && !lines_[0].name.empty() && ImGui::Button("Do this step again (F5)"))
    wish(SetupWish::What::Again, at_);
}

/// Presses that are not used, each with the reason, for whoever has no mouse.
void SetupView::describe_refused() {
  constexpr std::ptrdiff_t kMost = 6;
  std::ptrdiff_t said = 0;
  for (const SetupBall& ball : balls_) {
    if (ball.used || said++ >= kMost) continue;
    std::string words = ball.words;
    std::ranges::replace(words, '\n', ' ');
    wrapped_text(words, tint(theme().wrong));
  }
  if (said > kMost) wrapped_text(text("and %td more", said - kMost), tint(theme().wrong));
}

/// Corners over the picture, whose `low` is its top left corner on the screen; `px_per_px`: screen px in one
/// of the camera's.
void SetupView::drag_corners(std::array<float, 2> low, double px_per_px, float scale) {
  const ImGuiIO& io = ImGui::GetIO();
  const auto on_screen = [&](const std::array<double, 2>& p) {
    return ImVec2{low[0] + static_cast<float>(p[0] * px_per_px),
                  low[1] + static_cast<float>(p[1] * px_per_px)};
  };
  if (ImGui::IsItemActivated()) {
    double nearest = 24 * scale;
    for (size_t i = 0; i < 4; ++i) {
      const ImVec2 at = on_screen(form_.corners[i]);
      const double away = std::hypot(at.x - io.MousePos.x, at.y - io.MousePos.y);
      if (away >= nearest) continue;
      nearest = away;
      dragged_ = corner_ = i;
    }
  }
  if (!ImGui::IsItemActive()) dragged_.reset();
  if (dragged_)
    form_.corners[*dragged_] = {
        std::clamp((static_cast<double>(io.MousePos.x) - low[0]) / px_per_px, 0.0, camera_px_[0] - 1.0),
        std::clamp((static_cast<double>(io.MousePos.y) - low[1]) / px_per_px, 0.0, camera_px_[1] - 1.0)};
  ImDrawList* list = ImGui::GetWindowDrawList();
  constexpr std::array<const char*, 4> kNames{"top left", "top right", "bottom right", "bottom left"};
  for (size_t i = 0; i < 4; ++i)
    list->AddLine(on_screen(form_.corners[i]), on_screen(form_.corners[(i + 1) % 4]), kOutline, 2 * scale);
  for (size_t i = 0; i < 4; ++i) {
    const ImVec2 at = on_screen(form_.corners[i]);
    list->AddCircle(at, (dragged_.value_or(corner_) == i ? 9.0f : 7.0f) * scale, kCorner, 0, 2 * scale);
    const ImVec2 words = ImGui::CalcTextSize(kNames[i]);
    const ImVec2 place{i == 0 || i == 3 ? at.x + 11 * scale : at.x - words.x - 11 * scale,
                       i < 2 ? at.y + 4 * scale : at.y - words.y - 4 * scale};
    list->AddRectFilled({place.x - 3, place.y - 1}, {place.x + words.x + 3, place.y + words.y + 1},
                        ink(theme().panel, 200));
    list->AddText(place, kCorner, kNames[i]);
  }
}

void SetupView::describe_picture(float scale) {
  if (camera_px_[0] == 0) {
    ImGui::PushTextWrapPos(0);
    ImGui::TextDisabled(
        "A recording in which something touches the pad, best with a second at rest: type its path on the "
        "right, or drop it here.");
    ImGui::PopTextWrapPos();
    return;
  }
  const ImVec2 room = ImGui::GetContentRegionAvail();
  const float foot = 2.2f * ImGui::GetTextLineHeightWithSpacing();
  const bool rest = at_ == kUntouched && untouched_;
  const RgbImage& shown = rest ? *untouched_ : picture_;
  const float factor =
      std::min(room.x / static_cast<float>(shown.width), (room.y - foot) / static_cast<float>(shown.height));
  const ImVec2 size{factor * static_cast<float>(shown.width), factor * static_cast<float>(shown.height)};
  ImGui::SetCursorPosX(ImGui::GetCursorPosX() + std::floor((room.x - size.x) / 2));
  const ImVec2 low = ImGui::GetCursorScreenPos();
  const double px_per_px = static_cast<double>(size.x) / camera_px_[0];
  page_.frame().draw_picture(rest ? 1 : 0, {low.x, low.y}, {low.x + size.x, low.y + size.y});
  ImGui::InvisibleButton("picture", size);
  const bool corners = form_.cut && at_ == kFrame;
  if (at_ == kSurface) {
    draw_place({low.x, low.y}, px_per_px, scale);
    draw_balls({low.x, low.y}, px_per_px, scale);
  }
  if (corners) drag_corners({low.x, low.y}, px_per_px, scale);
  const auto line = [&room](const std::string& words) {
    ImGui::TextDisabled("%s", shortened(words, room.x).c_str());
  };
  std::string words = text("%u x %u px", camera_px_[0], camera_px_[1]);
  const auto used = std::ranges::count_if(balls_, &SetupBall::used);
  if (rest) words = "the untouched image: " + lines_[kUntouched].known;
  if (at_ == kSurface && !balls_.empty()) {
    words += text("; %td presses of the ball used", used);
    if (used < std::ssize(balls_)) words += text(", %td crossed out", std::ssize(balls_) - used);
  }
  if (corners) {
    words += "; corners";
    for (const auto& corner : form_.corners) words += text("  %.0f, %.0f", corner[0], corner[1]);
  }
  line(words);
  if (corners) line("drag each corner to that of the pad; what lies outside is not used");
  if (at_ == kSurface && !balls_.empty())
    line(
        "numbers: RMS error of the depth by the other presses, \xc2\xb5m; the mouse over a circle says more");
}

void SetupView::describe() {
  const float scale = page_.frame().scale();
  const ImVec2 size = ImGui::GetIO().DisplaySize;
  page_.begin_page("setup", "a sensor of your own", message_, trouble_);
  const float height =
      std::max(ImGui::GetContentRegionAvail().y - 1.5f * ImGui::GetFrameHeightWithSpacing(), 60 * scale);
  const bool side_by_side = size.x > 760 * scale;
  const float form_width = std::max(0.36f * size.x, 380 * scale);
  ImGui::BeginChild(
      "picture side",
      {side_by_side ? size.x - form_width - 32 * scale : 0, side_by_side ? height : 0.45f * height}, true,
      ImGuiWindowFlags_NoNav);
  describe_picture(scale);
  ImGui::EndChild();
  if (side_by_side) ImGui::SameLine();
  ImGui::BeginChild("steps", {0, side_by_side ? height : 0.54f * height}, true, ImGuiWindowFlags_NoNav);
  describe_steps(scale);
  ImGui::EndChild();
  ImGui::PushStyleColor(ImGuiCol_Button, tint(theme().picked));
  if (ImGui::Button("Make the sensor file (Ctrl + Enter)")) wish(SetupWish::What::MakeAll);
  ImGui::PopStyleColor();
  ImGui::SameLine();
  if (!lines_[0].name.empty()) {
    if (ImGui::Button("Look at the recording with it")) wish(SetupWish::What::Look);
    ImGui::SameLine();
  }
  if (ImGui::Button("Back (Esc)")) wish(SetupWish::What::Leave);
  ImGui::SameLine();
  if (ImGui::Button("Help (F1)")) help_ = !help_;
  ImGui::End();
  page_.help(setup_key_help(), help_);
}

}  // namespace palpate::viz
