// Settings of the window that are kept from one run to the next.
#include "viz/panels/settings.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <type_traits>
#include <variant>

#include "capture/synthetic/synthetic.h"
#include "tests/support/json.h"
#include "tests/support/test_folder.h"
#include "tests/support/text_file.h"
#include "viz/render/view_state.h"

namespace palpate::viz {
namespace {

namespace fs = std::filesystem;

class WindowSettings : public ::testing::Test {
 protected:
  void TearDown() override { fs::remove_all(folder_); }
  void write(const fs::path& file, const std::string& words) { std::ofstream(file) << words; }
  const fs::path folder_ = test_folder("window-settings");
};

TEST_F(WindowSettings, ComeBackAndDamagedOnesAreOneLine) {
  Settings settings;
  settings.width = 1000;
  settings.view.map = ColourMap::Cividis;
  settings.view.line = {0.1, 0.2, 0.3, 0.4};
  settings.remember("synthetic:slide", "");
  settings.remember(folder_ / "press", folder_ / "pad.json");
  settings.remember("synthetic:slide", "");
  const fs::path file = folder_ / "deep" / "window.json";
  save_settings(settings, file);
  const LoadedSettings loaded = load_settings(file);
  EXPECT_EQ(loaded.warning, "");
  EXPECT_EQ(loaded.settings.width, 1000u);
  EXPECT_EQ(loaded.settings.view.map, ColourMap::Cividis);
  EXPECT_DOUBLE_EQ(loaded.settings.view.line.y1, 0.4);
  ASSERT_EQ(loaded.settings.recent.size(), 2u) << "once each";
  EXPECT_EQ(loaded.settings.recent[0].input, "synthetic:slide");
  EXPECT_EQ(loaded.settings.recent[1].sensor, (folder_ / "pad.json").string());
  ASSERT_EQ(loaded.settings.sensors.size(), 1u);

  EXPECT_EQ(load_settings(folder_ / "none.json").warning, "") << "the first run";
  for (const char* damaged :
       {"", "{", "[1, 2]", "null", "{\"palpate_window\": 99}", "{\"palpate_window\": 1, \"width\": \"wide\"}",
        "{\"palpate_window\": 1, \"width\": -5}", "{\"palpate_window\": 1, \"recent\": [1, {}]}",
        "{\"palpate_window\": 1, \"section_line\": [0, 1]}", "{\"palpate_window\": 1, \"colours\": 7}"}) {
    write(file, damaged);
    const LoadedSettings bad = load_settings(file);
    EXPECT_NE(bad.warning, "") << damaged;
    EXPECT_EQ(bad.warning.find('\n'), std::string::npos);
    EXPECT_EQ(bad.settings.width, Settings().width) << damaged;
  }
}

// A setting that is added to the list is kept, and a value that makes no sense is named and left out.
TEST_F(WindowSettings, EverySettingOfTheViewIsKept) {
  Settings changed;
  for (const ViewSetting& setting : view_settings())
    std::visit(
        [&](auto member) {
          auto& value = changed.view.*member;
          using Value = std::decay_t<decltype(value)>;
          if constexpr (std::is_same_v<Value, SectionLine>)
            value = {0.1, 0.2, 0.3, 0.4};
          else if constexpr (std::is_floating_point_v<Value>)
            value = static_cast<Value>(setting.least + setting.most) / 2;
          else
            value = static_cast<Value>(!static_cast<int>(value));
        },
        setting.member);
  const fs::path file = folder_ / "window.json";
  save_settings(changed, file);
  const LoadedSettings loaded = load_settings(file);
  EXPECT_EQ(loaded.warning, "");
  save_settings(loaded.settings, folder_ / "again.json");
  EXPECT_EQ(slurp(file), slurp(folder_ / "again.json"));
  save_settings({}, folder_ / "first.json");
  const Json kept = parse_json(slurp(file)), first = parse_json(slurp(folder_ / "first.json"));
  for (const ViewSetting& setting : view_settings()) {
    EXPECT_NE(kept[setting.name], first[setting.name]) << setting.name;
    write(file, std::string("{\"palpate_window\": 1, \"") + setting.name + "\": -7}");
    const LoadedSettings bad = load_settings(file);
    EXPECT_NE(bad.warning.find(setting.name), std::string::npos) << bad.warning;
    save_settings(bad.settings, file);
    EXPECT_EQ(slurp(file), slurp(folder_ / "first.json")) << setting.name;
  }
}

// What was chosen with one sensor comes back with those that have it, and with no other.
TEST_F(WindowSettings, ColoursAreThoseThatTheSensorHas) {
  const Sensor gel = synthetic_sensor(parse_synthetic("synthetic:drag?size=320x240&mode=gel&skin=texture"));
  const Sensor waveguide = synthetic_sensor(parse_synthetic("synthetic:slide?size=320x240"));
  ASSERT_TRUE(gel.skin && !waveguide.skin);
  Settings settings;
  ViewState with_gel;
  with_gel.fit_to(gel);
  with_gel.choose(settings.view);
  with_gel.quantity = Quantity::Strain;
  with_gel.skin_strain = SkinStrain::Stretch;
  settings.view = with_gel.chosen(settings.view);
  ViewState without;
  without.fit_to(waveguide);
  without.choose(settings.view);
  EXPECT_EQ(without.quantity, Quantity::Depth);
  EXPECT_EQ(without.skin_strain, SkinStrain::Off);
  EXPECT_FALSE(without.can_show(Quantity::Strain));
  settings.view = without.chosen(settings.view);
  ViewState again;
  again.fit_to(gel);
  again.choose(settings.view);
  EXPECT_EQ(again.quantity, Quantity::Strain) << "the choice is kept for a sensor that has it";
  EXPECT_EQ(again.skin_strain, SkinStrain::Stretch);
}

TEST_F(WindowSettings, HaveTheirPlaceByTheEnvironment) {
  const char* before = std::getenv("PALPATE_CONFIG");
  const std::string kept = before ? before : "";
  setenv("PALPATE_CONFIG", "none", 1);
  EXPECT_TRUE(settings_file().empty());
  setenv("PALPATE_CONFIG", "/tmp/x.json", 1);
  EXPECT_EQ(settings_file(), fs::path("/tmp/x.json"));
  unsetenv("PALPATE_CONFIG");
  setenv("XDG_CONFIG_HOME", folder_.c_str(), 1);
  EXPECT_EQ(settings_file(), folder_ / "palpate" / "window.json");
  unsetenv("XDG_CONFIG_HOME");
  if (!kept.empty()) setenv("PALPATE_CONFIG", kept.c_str(), 1);
}

}  // namespace
}  // namespace palpate::viz
