#include "viz/panels/actions/actions.h"

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdint>
#include <initializer_list>
#include <limits>
#include <optional>
#include <sstream>
#include <tuple>
#include <utility>
#include <variant>

#include "viz/render/format.h"

namespace palpate::viz {
namespace {

using S = ViewState;

std::vector<KeyPress> keys(std::initializer_list<int> codes) {
  std::vector<KeyPress> all;
  for (const int code : codes) all.push_back({code});
  return all;
}

void exaggerate(S& state, double factor) {
  state.automatic_exaggeration = false;
  state.exaggeration = std::clamp(state.exaggeration * factor, 1.0, 200.0);
}

void view_from_the_top(S& state) {
  state.camera = {};
  state.camera.azimuth_rad = 0;
  state.camera.elevation_rad = Camera::kMaxElevation_rad;
}

void close_or_quit(S& state) {
  const bool closed = state.help || state.sensor_panel || state.chart_menu || state.chart_cursor;
  state.help = state.sensor_panel = false;
  state.chart_menu.reset();
  state.chart_cursor.reset();
  state.close_requested = !closed;
}

/// Of a setting that has a key: the next of its values.
void next_value(const ViewSetting& setting, S& state) {
  if (const auto* flag = std::get_if<bool ViewSettings::*>(&setting.member))
    state.** flag = !(state.**flag);
  else if (std::holds_alternative<Quantity ViewSettings::*>(setting.member))
    state.next_quantity();
  else if (std::holds_alternative<ColourMap ViewSettings::*>(setting.member))
    state.map = static_cast<ColourMap>((static_cast<int>(state.map) + 1) % kColourMaps);
  else if (std::holds_alternative<SkinStrain ViewSettings::*>(setting.member))
    state.skin_strain = static_cast<SkinStrain>((static_cast<int>(state.skin_strain) + 1) % kSkinStrains);
}

Needs needs_of(Quantity colours) {
  switch (colours) {
    case Quantity::Pressure:
      return Needs::Pressure;
    case Quantity::Strain:
      return Needs::Strain;
    case Quantity::Friction:
      return Needs::Friction;
    default:
      return Needs::Surface;
  }
}

class Actions {
 public:
  Actions() {
    surface();
    pictures();
    section_and_charts();
    player();
    session();
    window();
    choices();
  }
  std::vector<Action> all;

 private:
  std::string line_;
  void add(std::string name, std::vector<KeyPress> chords, std::function<void(S&)> run,
           Needs needs = Needs::Nothing) {
    all.push_back({std::move(name), std::move(chords), needs, std::move(run), line_});
  }
  /// What `adds` adds has one line of the help.
  template <typename Adds>
  void together(const char* line, const Adds& adds) {
    line_ = line;
    adds();
    line_.clear();
  }
  void setting(int key, Needs needs = Needs::Nothing) {
    const ViewSetting& setting = view_setting(key);
    if (setting.on_surface) needs = Needs::Surface;
    add(
        setting.sentence, {{key}}, [&setting](S& state) { next_value(setting, state); }, needs);
  }

  void surface() {
    constexpr Needs kSurface = Needs::Surface;
    add(
        "all of the surface again", keys({GLFW_KEY_R}), [](S& state) { state.camera = {}; }, kSurface);
    camera();
    add("view from the top", keys({GLFW_KEY_T}), view_from_the_top, kSurface);
    setting('D');
    add(
        "arrows show shear, pressure, nothing", {with_shift('D')},
        [](S& state) {
          state.arrows = static_cast<TractionArrows>((static_cast<int>(state.arrows) + 1) % kTractionArrows);
        },
        Needs::Traction);
    setting('O');
    add(
        "automatic colour range", keys({GLFW_KEY_A}),
        [](S& state) {
          if (bool* follows = state.automatic()) *follows = !*follows;
        },
        kSurface);
    together("wider, narrower colour range", [&] {
      add(
          "wider colour range", keys({GLFW_KEY_PAGE_UP}), [](S& state) { state.widen_range(1.25); },
          kSurface);
      add(
          "narrower colour range", keys({GLFW_KEY_PAGE_DOWN}), [](S& state) { state.widen_range(0.8); },
          kSurface);
    });
    add(
        "automatic vertical exaggeration", keys({GLFW_KEY_E}),
        [](S& state) { state.automatic_exaggeration = !state.automatic_exaggeration; }, kSurface);
    together("exaggerate more, less", [&] {
      add(
          "exaggerate more", keys({GLFW_KEY_EQUAL, GLFW_KEY_KP_ADD}),
          [](S& state) { exaggerate(state, 1.25); }, kSurface);
      add(
          "exaggerate less", keys({GLFW_KEY_MINUS, GLFW_KEY_KP_SUBTRACT}),
          [](S& state) { exaggerate(state, 0.8); }, kSurface);
    });
    for (const char key : {'L', 'G', 'Y', 'X'}) setting(key);
  }

  void pictures() {
    setting(GLFW_KEY_TAB);
    add(
        "surface and image: one large, both equal, one alone", {with_shift(GLFW_KEY_TAB)},
        [](S& state) {
          state.arrangement =
              static_cast<Arrangement>((static_cast<int>(state.arrangement) + 1) % kArrangements);
        },
        Needs::Surface);
    add("one picture alone, or with the rest again", keys({GLFW_KEY_ENTER, GLFW_KEY_KP_ENTER}), [](S& state) {
      const bool alone = state.arrangement == Arrangement::OneAlone;
      state.arrangement = alone ? Arrangement::OneLarge : Arrangement::OneAlone;
    });
  }

  void section_and_charts() {
    constexpr double kStep = 0.01, kTurn_rad = 0.05;  // of the frame
    const std::array<std::tuple<const char*, int, double, double>, 4> moves{{
        {"move the section left", GLFW_KEY_LEFT, -kStep, 0.0},
        {"move the section right", GLFW_KEY_RIGHT, kStep, 0.0},
        {"move the section up", GLFW_KEY_UP, 0.0, -kStep},
        {"move the section down", GLFW_KEY_DOWN, 0.0, kStep},
    }};
    together("move the section", [&] {
      for (const auto& [name, key, x, y] : moves)
        add(
            name, {control(key)}, [x = x, y = y](S& state) { state.line.move(x, y); }, Needs::Section);
    });
    together("turn the section", [&] {
      add(
          "turn the section left", {control(GLFW_KEY_LEFT, true)},
          [](S& state) { state.line.turn(-kTurn_rad, state.frame_aspect); }, Needs::Section);
      add(
          "turn the section right", {control(GLFW_KEY_RIGHT, true)},
          [](S& state) { state.line.turn(kTurn_rad, state.frame_aspect); }, Needs::Section);
    });
    setting('P');
    together("shorter, longer time axis", [&] {
      add("shorter time axis", keys({GLFW_KEY_LEFT_BRACKET}), [](S& state) { state.change_chart_span(-1); });
      add("longer time axis", keys({GLFW_KEY_RIGHT_BRACKET}), [](S& state) { state.change_chart_span(1); });
    });
    charts();
    setting('K');
    setting('J');
    setting('N', Needs::Skin);
  }

  void charts() {
    constexpr double kCursor = 0.01, kPan = 0.2, kZoom = 0.8;
    together("charts: cursor back, on", [&] {
      add("charts: cursor back", {with_shift(GLFW_KEY_COMMA)},
          [](S& state) { state.chart_moves.cursor -= kCursor; });
      add("charts: cursor on", {with_shift(GLFW_KEY_PERIOD)},
          [](S& state) { state.chart_moves.cursor += kCursor; });
    });
    together("charts: zoom in, out", [&] {
      add("charts: zoom in", {with_shift(GLFW_KEY_LEFT_BRACKET)},
          [](S& state) { state.chart_moves.zoom *= kZoom; });
      add("charts: zoom out", {with_shift(GLFW_KEY_RIGHT_BRACKET)},
          [](S& state) { state.chart_moves.zoom /= kZoom; });
    });
    together("charts: earlier, later", [&] {
      add("charts: earlier", {control(GLFW_KEY_LEFT_BRACKET)},
          [](S& state) { state.chart_moves.pan -= kPan; });
      add("charts: later", {control(GLFW_KEY_RIGHT_BRACKET)},
          [](S& state) { state.chart_moves.pan += kPan; });
    });
    add("charts: all of the time", {with_shift('P')}, [](S& state) {
      state.chart_view.reset();
      state.whole_recording = true;
    });
    add("charts: copy as CSV", {control('C')}, [](S& state) { state.chart_copy_requested = true; });
  }

  void camera() {
    constexpr double kTurn_rad = 0.08, kShift = 0.05, kZoom = 1.12;  // of the pad
    const std::array<std::tuple<const char*, int, double, double>, 4> ways{{{"left", GLFW_KEY_LEFT, -1, 0},
                                                                            {"right", GLFW_KEY_RIGHT, 1, 0},
                                                                            {"up", GLFW_KEY_UP, 0, 1},
                                                                            {"down", GLFW_KEY_DOWN, 0, -1}}};
    together("turn the surface", [&] {
      for (const auto& [way, key, right, up] : ways)
        add(
            std::string("turn the surface ") + way, {with_alt(key)},
            [x = right * kTurn_rad, y = up * kTurn_rad](S& state) { state.camera.orbit(-x, -y); },
            Needs::Surface);
    });
    together("move the surface", [&] {
      for (const auto& [way, key, right, up] : ways)
        add(
            std::string("move the surface ") + way, {with_alt(key, true)},
            [x = right * kShift, y = up * kShift](S& state) {
              Camera& camera = state.camera;
              camera.target =
                  camera.target - (camera.right() * x + camera.up() * y) * (state.pad_mm / camera.zoom);
            },
            Needs::Surface);
    });
    together("nearer to the surface, farther from it", [&] {
      add(
          "nearer to the surface", {with_alt(GLFW_KEY_PAGE_UP)},
          [](S& state) { state.camera.magnify(kZoom); }, Needs::Surface);
      add(
          "farther from the surface", {with_alt(GLFW_KEY_PAGE_DOWN)},
          [](S& state) { state.camera.magnify(1 / kZoom); }, Needs::Surface);
    });
  }

  void player() {
    add("pause, or go on", keys({GLFW_KEY_SPACE}), [](S& state) { state.paused = !state.paused; });
    const std::array<std::tuple<const char*, KeyPress, double>, 4> jumps{{
        {"1 s back", {GLFW_KEY_LEFT}, -1.0},
        {"1 s on", {GLFW_KEY_RIGHT}, 1.0},
        {"10 s back", with_shift(GLFW_KEY_LEFT), -10.0},
        {"10 s on", with_shift(GLFW_KEY_RIGHT), 10.0},
    }};
    together("1 s back, on; 10 s back, on", [&] {
      for (const auto& [name, chord, seconds] : jumps)
        add(
            name, {chord}, [s = seconds](S& state) { state.play.seconds += s; }, Needs::Player);
    });
    const auto step = [](int frames) {
      return [frames](S& state) {
        state.paused = true;
        state.play.frames += frames;
      };
    };
    together("pause, and one frame back, on", [&] {
      add("pause, and one frame back", keys({GLFW_KEY_COMMA}), step(-1), Needs::Player);
      add("pause, and one frame on", keys({GLFW_KEY_PERIOD}), step(1), Needs::Player);
    });
    together("twice, half the speed", [&] {
      add(
          "twice the speed", keys({GLFW_KEY_UP}), [](S& state) { state.play.speed *= 2; }, Needs::Player);
      add(
          "half the speed", keys({GLFW_KEY_DOWN}), [](S& state) { state.play.speed /= 2; }, Needs::Player);
    });
    together("to the mark before, after", [&] {
      add(
          "to the mark before", {kMarkBefore}, [](S& state) { state.play.marks = -1; }, Needs::Player);
      add(
          "to the mark after", {kMarkAfter}, [](S& state) { state.play.marks = 1; }, Needs::Player);
    });
    add(
        "to the largest force", {with_shift('F')}, [](S& state) { state.play.largest = true; },
        Needs::Player);
    const std::array<std::tuple<const char*, KeyPress, PartEnd>, 3> ends{{
        {"loop from this frame on", kLoopFrom, PartEnd::First},
        {"loop up to this frame", kLoopTo, PartEnd::Last},
        {"no loop", {GLFW_KEY_BACKSPACE}, PartEnd::None},
    }};
    for (const auto& [name, chord, end] : ends)
      add(
          name, {chord}, [end = end](S& state) { state.play.part = end; }, Needs::Player);
    together("first, last frame", [&] {
      add(
          "first frame", keys({GLFW_KEY_HOME}), [](S& state) { state.seek_to = 0; }, Needs::Player);
      add(
          "last frame", keys({GLFW_KEY_END}),
          [](S& state) { state.seek_to = std::numeric_limits<uint64_t>::max(); }, Needs::Player);
    });
  }

  void session() {
    together("zero force and shear, end that zero", [&] {
      add("zero force and shear", keys({GLFW_KEY_Z}), [](S& state) { state.zero_requested = true; });
      add("end that zero", {with_shift(GLFW_KEY_Z)}, [](S& state) { state.zero_cleared_requested = true; });
    });
    add(
        "follow the object and map it, or pressed tissue, anew", {with_shift('O')},
        [](S& state) { state.track_requested = true; }, Needs::Object);
    add(
        "map of what the pad moves over, on, off", {with_shift('T')},
        [](S& state) { state.object_map = !state.object_map; }, Needs::Object);
    add(
        "record a session, or end it", keys({GLFW_KEY_W}),
        [](S& state) { state.recording_switched_requested = true; }, Needs::NoPlayer);
    add("snapshot: picture, frame, depth and numbers of this moment", keys({GLFW_KEY_S}),
        [](S& state) { state.snapshot_requested = true; });
    add("save the charts as CSV and PNG", {with_shift(GLFW_KEY_S)},
        [](S& state) { state.chart_table_requested = state.chart_picture_requested = true; });
    add("mark an event", keys({GLFW_KEY_M}), [](S& state) { state.mark_requested = true; });
    add("mark an event with a text", {with_shift(GLFW_KEY_M)}, [](S& state) { state.labelling = true; });
  }

  void window() {
    add("sensor and its calibrations", keys({GLFW_KEY_I}),
        [](S& state) { state.sensor_panel = !state.sensor_panel; });
    setting('F');
    add("vsync: on, mailbox, off", keys({GLFW_KEY_V}), [](S& state) { state.next_vsync_requested = true; });
    together("larger, smaller text", [&] {
      add("larger text", {control(GLFW_KEY_EQUAL), control(GLFW_KEY_KP_ADD)},
          [](S& state) { state.enlarge_text(true); });
      add("smaller text", {control(GLFW_KEY_MINUS), control(GLFW_KEY_KP_SUBTRACT)},
          [](S& state) { state.enlarge_text(false); });
    });
    add("full screen", keys({GLFW_KEY_F11}), [](S& state) { state.full_screen_requested = true; });
    setting('U');
    setting('C');
    add(
        "back to the list of sources", keys({GLFW_KEY_B}), [](S& state) { state.sources_requested = true; },
        Needs::List);
    add("find an action or a setting by its name", {control(GLFW_KEY_K)}, [](S& state) {
      state.palette = true;
      state.help = false;
    });
    add("keys and mouse", keys({GLFW_KEY_H, GLFW_KEY_F1}), [](S& state) { state.help = !state.help; });
    add("close what is open, else quit", keys({GLFW_KEY_ESCAPE}), close_or_quit);
    add("quit", keys({GLFW_KEY_Q}), [](S& state) { state.close_requested = true; });
  }

  /// Values that can be gone to at once; by their names alone.
  void choices() {
    for (int i = 0; i < kQuantities; ++i) {
      const auto quantity = static_cast<Quantity>(i);
      add(
          std::string("colours: ") + to_string(quantity), {},
          [quantity](S& state) { state.quantity = quantity; }, needs_of(quantity));
    }
    for (int i = 0; i < kColourMaps; ++i)
      add(
          std::string("colour map: ") + to_string(static_cast<ColourMap>(i)), {},
          [map = static_cast<ColourMap>(i)](S& state) { state.map = map; }, Needs::Surface);
    for (int i = 0; i < kArrangements; ++i)
      add(
          std::string("surface and image: ") + to_string(static_cast<Arrangement>(i)), {},
          [arrangement = static_cast<Arrangement>(i)](S& state) { state.arrangement = arrangement; },
          Needs::Surface);
    for (const double span_s : kChartSpans_s)
      add(text("time axis: %g s", span_s), {}, [span_s](S& state) {
        state.chart_span_s = span_s;
        state.whole_recording = false;
        state.chart_view.reset();
      });
    add(
        "time axis: whole recording", {},
        [](S& state) {
          state.whole_recording = true;
          state.chart_view.reset();
        },
        Needs::Player);
    for (const ViewSetting& setting : view_settings())  // those without a key
      if (std::holds_alternative<bool ViewSettings::*>(setting.member) && setting.key == 0)
        add(setting.sentence, {}, [&setting](S& state) { next_value(setting, state); });
  }
};

std::string in_small_letters(std::string_view words) {
  std::string small(words);
  std::ranges::transform(small, small.begin(), [](unsigned char c) { return std::tolower(c); });
  return small;
}

/// How far a name is from the typed words: 0 where it has them one after the other, else more by each that
/// begins no word of it; none where one is missing.
std::optional<int> distance(const std::string& name, const std::string& typed) {
  if (name.find(typed) != std::string::npos) return 0;
  int far = 1;
  std::istringstream words(typed);
  for (std::string word; words >> word;) {
    const size_t anywhere = name.find(word);
    if (anywhere == std::string::npos) return std::nullopt;
    far += anywhere != 0 && name.find(" " + word) == std::string::npos;
  }
  return far;
}

}  // namespace

Circumstances circumstances(const LiveStats* live, bool has_surface, const ViewState& state) {
  return {.player = live && live->player,
          .has_surface = has_surface,
          .section = has_surface && state.section,
          .pressure = has_surface && state.can_show(Quantity::Pressure),
          .strain = has_surface && state.can_show(Quantity::Strain),
          .friction = has_surface && state.can_show(Quantity::Friction),
          .traction = has_surface && state.can_show_traction,
          .skin = state.can_show_skin,
          .object = state.has_object_map,
          .from_list = live && live->from_list};
}

bool Action::possible(const Circumstances& now) const {
  switch (needs) {
    case Needs::NoPlayer:
      return !now.player;
    case Needs::Player:
      return now.player;
    case Needs::Surface:
      return now.has_surface;
    case Needs::Section:
      return now.section;
    case Needs::Pressure:
      return now.pressure;
    case Needs::Traction:
      return now.traction;
    case Needs::Strain:
      return now.strain;
    case Needs::Friction:
      return now.friction;
    case Needs::Skin:
      return now.skin;
    case Needs::Object:
      return now.object;
    case Needs::List:
      return now.from_list;
    default:
      return true;
  }
}

const char* reason_against(Needs needs) {
  switch (needs) {
    case Needs::NoPlayer:
      return "a replay cannot be recorded";
    case Needs::Player:
      return "only a recording goes back and on";
    case Needs::Surface:
      return "this sensor has no surface to look at";
    case Needs::Section:
      return "no section line is shown (X)";
    case Needs::Traction:
      return "no arrows: this sensor has no elastic layer";
    case Needs::Pressure:
    case Needs::Strain:
    case Needs::Friction:
      return "this sensor does not have these colours";
    case Needs::Skin:
      return "no strain of the skin: this sensor does not follow its skin";
    case Needs::Object:
      return "no map: the object's motion is not measured (--outputs motion), no tissue is pressed by hand";
    case Needs::List:
      return "the list of sources is that of palpate without a command";
    default:
      return "";
  }
}

std::span<const Action> actions() {
  static const Actions list;
  return list.all;
}

const Action* action_of(const KeyPress& press, const Circumstances& now) {
  std::array<KeyPress, 4> tried{{{press.key, press.shift, press.control},
                                 {press.key, false, press.control},
                                 {press.key, press.shift, false},
                                 {press.key, false, false}}};
  if (press.alt) tried.fill(press);  // a window manager's own chords do nothing here
  const Action* impossible = nullptr;
  for (const KeyPress& chord : tried)
    for (const Action& action : actions())
      if (std::ranges::find(action.chords, chord) != action.chords.end()) {
        if (action.possible(now)) return &action;
        if (!impossible) impossible = &action;
      }
  return impossible;
}

std::vector<const Action*> actions_named(std::string_view typed, const Circumstances& now) {
  const std::string words = in_small_letters(typed);
  std::vector<std::pair<int, const Action*>> found;
  for (const Action& action : actions())
    if (const auto far = distance(in_small_letters(action.name), words); far && action.possible(now))
      found.emplace_back(*far, &action);
  std::ranges::stable_sort(found, {}, &std::pair<int, const Action*>::first);
  std::vector<const Action*> named;
  named.reserve(found.size());
  for (const auto& [far, action] : found) named.push_back(action);
  return named;
}

}  // namespace palpate::viz
