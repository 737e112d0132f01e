// Actions of the live window: their names, their keys, and how they are found.
#include <gtest/gtest.h>

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <set>
#include <string>

#include "viz/panels/actions/actions.h"
#include "viz/panels/actions/help.h"
#include "viz/panels/actions/palette.h"

namespace palpate::viz {
namespace {

const Circumstances kEverything{.player = true,
                                .has_surface = true,
                                .section = true,
                                .pressure = true,
                                .strain = true,
                                .friction = true,
                                .traction = true,
                                .skin = true,
                                .object = true,
                                .from_list = true};

TEST(Actions, EachHasANameAndKeysOfItsOwn) {
  std::set<std::string> names, chords;
  for (const Action& action : actions()) {
    EXPECT_TRUE(names.insert(action.name).second) << action.name;
    std::set<std::string> own;  // the number pad's signs are called like the others
    for (const KeyPress& chord : action.chords) own.insert(words_of(chord));
    for (const std::string& chord : own) EXPECT_TRUE(chords.insert(chord).second) << chord;
    EXPECT_TRUE(action.run) << action.name;
  }
  for (const ViewSetting& setting : view_settings())
    EXPECT_TRUE(setting.key == 0 || chords.contains(words_of({setting.key}))) << setting.name;
}

TEST(Actions, EveryKeyOfTheHelpDoesWhatTheHelpSays) {
  size_t with_keys = 0;
  std::string line;
  for (const Action& action : actions()) {
    for (const KeyPress& chord : action.chords) {
      const bool in_replay = action.needs != Needs::NoPlayer;
      Circumstances now = kEverything;
      now.player = in_replay;
      EXPECT_EQ(action_of(chord, now), &action) << action.name;
    }
    with_keys += !action.chords.empty() && (action.line.empty() || action.line != line);
    line = action.line;
  }
  // Some share a line; recording a session is not offered in a replay; mouse movements have eight lines.
  EXPECT_EQ(key_help(kEverything).size(), with_keys - 1 + 8);
  const auto keys_of = [](const std::string& what) {
    for (const KeyHelp& one : key_help(kEverything))
      if (one.what == what) return one.keys;
    return std::string();
  };
  EXPECT_EQ(keys_of("turn the surface"), "Alt + Left / Right / Up / Down");
  EXPECT_EQ(keys_of("1 s back, on; 10 s back, on"), "Left / Right / Shift + Left / Right");
  EXPECT_EQ(keys_of("exaggerate more, less"), "+ / -");
  EXPECT_EQ(keys_of("larger, smaller text"), "Ctrl + + / -");
  EXPECT_EQ(keys_of("zero force and shear, end that zero"), "Z / Shift + Z");
  EXPECT_EQ(keys_of("keys and mouse"), "H / F1");
  std::string all;
  for (const KeyHelp& one : key_help(Circumstances{})) all += one.what + "; ";
  for (const char* absent : {"section", "frame back", "colour", "orbit", "list of sources", "skin, "})
    EXPECT_EQ(all.find(absent), std::string::npos) << absent << " in " << all;
}

TEST(Actions, AKeyHeldWithAnotherIsItselfWhereNothingElseIsMeant) {
  ViewState state;
  action_of({'Z', true}, kEverything)->run(state);
  EXPECT_TRUE(state.zero_cleared_requested);
  EXPECT_FALSE(state.zero_requested);
  EXPECT_EQ(action_of({'L', true, true}, kEverything), action_of({'L'}, kEverything));
  const KeyPress left{GLFW_KEY_LEFT, false, true};  // with Ctrl
  EXPECT_EQ(action_of(left, kEverything)->needs, Needs::Section);
  EXPECT_EQ(action_of(left, {.player = true})->needs, Needs::Player);
  const Action* refused = action_of(left, {});
  ASSERT_NE(refused, nullptr);
  EXPECT_FALSE(refused->possible({}));
  EXPECT_STRNE(reason_against(refused->needs), "");
}

TEST(Actions, KeysTurnMoveAndZoomAsTheMouseDoes) {
  ViewState state;
  state.pad_mm = 20;
  const Circumstances now{.has_surface = true};
  const auto press = [&](int key, bool shift = false) {
    action_of({key, shift, false, true}, now)->run(state);
    return state.camera;
  };
  const Camera first;
  EXPECT_LT(press(GLFW_KEY_RIGHT).azimuth_rad, first.azimuth_rad) << "as a drag to the right";
  EXPECT_GT(press(GLFW_KEY_DOWN).elevation_rad, first.elevation_rad);
  press(GLFW_KEY_LEFT);
  EXPECT_NEAR(press(GLFW_KEY_UP).elevation_rad, first.elevation_rad, 1e-12);
  EXPECT_NEAR(press(GLFW_KEY_RIGHT, true).target.x, -std::cos(first.azimuth_rad), 1e-9)
      << "a twentieth of it";
  EXPECT_NEAR(press(GLFW_KEY_LEFT, true).target.x, 0, 1e-9);
  EXPECT_GT(press(GLFW_KEY_PAGE_UP).zoom, 1);
  EXPECT_NEAR(press(GLFW_KEY_PAGE_DOWN).zoom, 1, 1e-12);
  EXPECT_EQ(action_of({GLFW_KEY_TAB, false, false, true}, now), nullptr) << "the desktop's";
}

TEST(Actions, AreFoundByWordsOfTheirNames) {
  for (const Action& action : actions()) {
    Circumstances now = kEverything;
    now.player = action.needs != Needs::NoPlayer;
    const std::vector<const Action*> named = actions_named(action.name, now);
    EXPECT_NE(std::ranges::find(named, &action), named.end()) << action.name;
  }
  const auto first = [](const char* typed) {
    const auto named = actions_named(typed, kEverything);
    return named.empty() ? std::string() : named.front()->name;
  };
  EXPECT_EQ(first("CIVIDIS map"), "colour map: viridis, cividis, magma");
  EXPECT_EQ(first("map: cividis"), "colour map: cividis");
  EXPECT_EQ(first("last"), "last frame");
  EXPECT_EQ(first("no such thing"), "");
  EXPECT_EQ(actions_named("", {}).size(), static_cast<size_t>(std::ranges::count_if(
                                              actions(), [](const Action& a) { return a.possible({}); })));
}

TEST(Palette, ArrowsChooseEnterRunsAndEscapeCloses) {
  ViewState state;
  const auto search = [&](const char* typed) {
    state.palette = true;
    std::snprintf(state.searched.text.data(), state.searched.text.size(), "%s", typed);
  };
  search("colour map:");
  const auto named = actions_named("colour map:", kEverything);
  ASSERT_GE(named.size(), 4u);  // the key's own and each map
  for (const int key : {GLFW_KEY_DOWN, GLFW_KEY_DOWN, GLFW_KEY_DOWN, GLFW_KEY_UP})
    palette_key({key}, kEverything, state);
  palette_key({GLFW_KEY_ENTER}, kEverything, state);
  EXPECT_FALSE(state.palette);
  EXPECT_EQ(named[2]->name, std::string("colour map: ") + to_string(state.map));
  EXPECT_EQ(state.searched.text[0], 0);

  const ViewState before = state;
  search("no such thing");
  palette_key({GLFW_KEY_ENTER}, kEverything, state);
  EXPECT_FALSE(state.palette);
  EXPECT_EQ(state.map, before.map);
  search("quit");
  palette_key({GLFW_KEY_ESCAPE}, kEverything, state);
  EXPECT_FALSE(state.palette || state.close_requested);
}

}  // namespace
}  // namespace palpate::viz
