// Actions of the live window, each described once: its keys, the help, the tips of the bar and the list that
// is searched by name take them from here.
#pragma once

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>

#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "viz/live/stats.h"
#include "viz/render/view_state.h"
#include "viz/render/window.h"

namespace palpate::viz {

/// Conditions that actions depend on.
struct Circumstances {
  bool player = false;                                      ///< a recording is played
  bool has_surface = false;                                 ///< drawn in 3D
  bool section = false;                                     ///< a section line is shown
  bool pressure = false, strain = false, friction = false;  ///< the surface can have their colours
  bool traction = false;                                    ///< and arrows of it
  bool skin = false;                                        ///< the sensor follows its skin
  bool object = false;                                      ///< the motion of the object is measured
  bool from_list = false;                                   ///< the person came from the list of sources
};
Circumstances circumstances(const LiveStats* live, bool has_surface, const ViewState& state);

/// What an action needs in order to do something.
enum class Needs {
  Nothing,
  NoPlayer,
  Player,
  Surface,
  Section,
  Pressure,
  Traction,
  Strain,
  Friction,
  Skin,
  Object,
  List
};

struct Action {
  std::string name;              ///< as a sentence without a subject, in small letters; no two alike
  std::vector<KeyPress> chords;  ///< keys that are held together; the first is the one that is shown
  Needs needs = Needs::Nothing;
  std::function<void(ViewState&)> run;
  std::string line = {};  ///< of the help, that it shares with its neighbours of the same; empty: its name

  bool possible(const Circumstances& now) const;
};

/// A key that is pressed with others held.
constexpr KeyPress control(int key, bool shift = false) {
  return {key, shift, true};
}
constexpr KeyPress with_shift(int key) {
  return {key, true, false};
}
constexpr KeyPress with_alt(int key, bool shift = false) {
  return {key, shift, false, true};
}

/// Keys of a player's actions that have buttons, too.
inline constexpr KeyPress kMarkBefore{GLFW_KEY_COMMA, false, true}, kMarkAfter{GLFW_KEY_PERIOD, false, true};
inline constexpr KeyPress kLoopFrom{GLFW_KEY_LEFT_BRACKET, false, false, true},
    kLoopTo{GLFW_KEY_RIGHT_BRACKET, false, false, true};

/// All of them, in the order of the help; those without keys come last.
std::span<const Action> actions();
/// That of a key as it was pressed; null: none. One with exactly the held keys goes before one without Shift,
/// that before one without Ctrl, and a possible one before all.
const Action* action_of(const KeyPress& press, const Circumstances& now);
/// Those that are possible and have all typed words in their name; first those that have them in a row, then
/// those whose words begin with them.
std::vector<const Action*> actions_named(std::string_view typed, const Circumstances& now);
/// Why it is not possible.
const char* reason_against(Needs needs);

}  // namespace palpate::viz
