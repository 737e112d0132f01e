// What panels say of a touch in rows of numbers, and where they stay silent.
#include <gtest/gtest.h>
#include <imgui.h>
#include <imgui_internal.h>

#include <algorithm>
#include <string>
#include <string_view>

#include "capture/synthetic/synthetic.h"
#include "engine/measure/quantities.h"
#include "tests/window/panel_fixture.h"
#include "viz/panels/charts/charts.h"
#include "viz/panels/hud.h"
#include "viz/panels/numbers/hand_scan.h"
#include "viz/panels/numbers/measurement.h"
#include "viz/panels/numbers/performance.h"
#include "viz/panels/numbers/press.h"
#include "viz/render/annotations.h"
#include "viz/render/format.h"

namespace palpate::viz {
namespace {

TEST_F(PanelTest, APadAtRestSaysSoOnce) {
  const SyntheticOptions options = parse_synthetic("synthetic:slide?size=320x240");
  const Sensor sensor = synthetic_sensor(options);
  Frame image;
  image.reshape({320, 240, 1, 8});
  Touch touch;
  touch.force_N.validity = touch.shear_x_N.validity = touch.shear_y_N.validity = Validity::NoContact;
  touch.slip = Slip::NoContact;
  touch.surface.emplace().depth_max_mm = 0.004;
  touch.surface->validity = Validity::NoContact;
  touch.regions.emplace();
  const Layout layout = make_layout({1280, 720}, 1, image.format, true);
  const HudContent content{sensor, image, touch, true, nullptr, "device", {96, 72}};
  const std::string words =
      words_of([&] { measurement_panel(*frame_, layout, content, touch, ViewState{}); });
  EXPECT_EQ(count(words, "no contact"), 1u) << words;
  EXPECT_EQ(count(words, "nothing touches"), 0u) << words;
  EXPECT_EQ(count(words, "gel"), 0u) << "a waveguide: " << words;
  EXPECT_NE(words.find("uneven by 0.004 mm"), std::string::npos) << words;
  EXPECT_EQ(count(words, "calibrated"), 1u) << "its range: " << words;
  // Nor does a calibration that is not fit for use look like one that is.
  Sensor unfit = sensor;
  unfit.force->fit_for_use = false;
  const HudContent other{unfit, image, touch, true, nullptr, "device", {96, 72}};
  const std::string warned = words_of([&] { measurement_panel(*frame_, layout, other, touch, ViewState{}); });
  EXPECT_NE(warned.find("NOT FIT FOR USE"), std::string::npos) << warned;
}

// Without a force curve there is no calibrated range that a force could be within.
TEST_F(PanelTest, AForceByTheLayerIsNotCalledWithinCalibration) {
  Sensor sensor = synthetic_sensor(parse_synthetic("synthetic:slide?size=320x240"));
  sensor.force.reset();
  Frame image;
  image.reshape({320, 240, 1, 8});
  Touch touch;
  touch.contact = true;
  touch.force_N.validity = Validity::NotCalibrated;
  touch.traction.emplace().fz_N = {2, 0.3, Validity::Valid};
  const Layout layout = make_layout({1280, 720}, 1, image.format, true);
  const HudContent content{sensor, image, touch, true, nullptr, "device", {96, 72}};
  const auto words = [&] {
    return words_of([&] { measurement_panel(*frame_, layout, content, touch, ViewState{}); });
  };
  const std::string valid = words();
  EXPECT_EQ(valid.find("within calibration"), std::string::npos) << valid;
  touch.traction->fz_N.validity = Validity::AtBorder;
  const std::string cut = words();
  EXPECT_NE(cut.find("BORDER"), std::string::npos) << cut;
}

TEST_F(PanelTest, EachQuantityOfTheListHasItsRow) {
  const Sensor sensor = synthetic_sensor(parse_synthetic("synthetic:slide?size=320x240"));
  Frame image;
  image.reshape({320, 240, 1, 8});
  constexpr Estimate kKnown{0.5, 0.1, Validity::TooDeep};
  Touch touch;
  touch.contact = true;
  touch.slip = Slip::Stick;
  touch.shear_x_N = touch.shear_y_N = kKnown;
  SurfaceSummary& surface = touch.surface.emplace();
  surface.volume_mm3 = 1;
  surface.dented_mm2 = 2;
  surface.clipped_px = 3;
  surface.extrapolated_px = 4;
  surface.weighted = {0.1, 0.1, 2, 1};
  touch.confidence.emplace();
  touch.regions = {0, true};
  touch.contacts.resize(1);
  touch.skin = {10, 2, 5, kKnown, kKnown, kKnown, kKnown};
  touch.light = {LightState::Changed, 1.5};
  TractionSummary& traction = touch.traction.emplace();
  traction.fx_N = traction.fy_N = traction.fz_N = kKnown;
  traction.mx_Nmm = traction.my_Nmm = traction.mz_Nmm = kKnown;
  traction.slipping_fraction = 0.25;
  ObjectPose& object = touch.object.emplace();
  object.state = PoseState::Tracked;
  object.doubt = PoseDoubt::OthersMove;
  object.surface = Slippage::Ball;
  object.shift_mm.fill(kKnown);
  object.turn_rad.fill(kKnown);
  object.on_skin = OnSkin::Slips;
  object.slip_mm.fill(kKnown);
  const Layout layout = make_layout({1280, 1600}, 1, image.format, true);
  const HudContent content{sensor, image, touch, true, nullptr, "device", {96, 72}};
  const std::string words =
      words_of([&] { measurement_panel(*frame_, layout, content, touch, ViewState{}); });
  for (const MeasuredQuantity<Touch>& q : touch_quantities())
    EXPECT_NE(words.find(q.row.label), std::string::npos) << q.name << ": " << words;
  for (const char* row : {"0.50, 0.50, 0.50 N", "+28.65 \xc2\xb1 5.73 deg", "25 % of the area"})
    EXPECT_NE(words.find(row), std::string::npos) << row << ": " << words;
  EXPECT_EQ(count(words, "stick or slip"), 1u) << words;
}

TEST_F(PanelTest, NoRowOfATouchIsCutOffAtTheFoot) {
  const Sensor sensor = synthetic_sensor(parse_synthetic("synthetic:slide?size=320x240"));
  Frame image;
  image.reshape({640, 480, 3, 8});
  constexpr Estimate kKnown{0.5, 0.1, Validity::Valid};
  Touch touch;  // of a gel with markers and a layer
  touch.contact = true;
  touch.slip = Slip::Stick;
  touch.force_N = touch.shear_x_N = touch.shear_y_N = kKnown;
  touch.surface.emplace().volume_mm3 = 1;
  touch.surface->dented_mm2 = 2;
  touch.regions = {0, true};
  touch.contacts.resize(1);
  touch.skin = {10, 2, 5, kKnown, kKnown, kKnown, kKnown};
  TractionSummary& traction = touch.traction.emplace();
  traction.fx_N = traction.fy_N = traction.fz_N = kKnown;
  traction.mx_Nmm = traction.my_Nmm = traction.mz_Nmm = kKnown;
  const HudContent content{sensor, image, touch, true, nullptr, "device", {96, 72}};
  const auto fits = [&](VkExtent2D extent) {
    SCOPED_TRACE(text("%u x %u", extent.width, extent.height));
    const Layout layout = make_layout(extent, 1, image.format, true);
    describe(
        1, [&] { measurement_panel(*frame_, layout, content, touch, ViewState{}); }, extent);
    const auto& windows = ImGui::GetCurrentContext()->Windows;
    const auto* const numbers = std::find_if(windows.begin(), windows.end(), [](const ImGuiWindow* w) {
      return std::string_view(w->Name).find("/numbers_") != std::string_view::npos;
    });
    ASSERT_NE(numbers, windows.end());
    EXPECT_GT((*numbers)->ContentSize.y, 320) << "rows of everything";
    EXPECT_EQ((*numbers)->ScrollMax.y, 0);
  };
  fits({1280, 720});
  fits({1920, 1080});
  // What a colour gel by weights adds to them: smaller letters.
  touch.surface->clipped_px = 3;
  touch.surface->extrapolated_px = 4;
  touch.surface->weighted = {0.1, 0.1, 2, 1};
  touch.confidence.emplace();
  touch.light = {LightState::Changed, 1.5};
  fits({1280, 720});
}

TEST_F(PanelTest, RatesAndLatencyAreBehindAKey) {
  const Sensor sensor = synthetic_sensor(parse_synthetic("synthetic:slide?size=320x240"));
  Frame image;
  image.reshape({320, 240, 1, 8});
  const Touch touch;
  LiveStats live;
  live.to_measured = live.to_shown = {1, 2, 3, 10};
  live.dropped_before_engine = 7;
  live.recent = {{10, 20, 5}, {12, 30, 8}};
  const Layout layout = make_layout({1280, 720}, 1, image.format, true);
  const HudContent content{sensor, image, touch, true, &live, "device", {96, 72}};
  ViewState state;
  Hud hud;
  const auto shown = [&] {
    describe(1, [&] { hud.describe(*frame_, layout, {1280, 720}, content, state, nullptr, {}, nullptr); });
    const ImGuiWindow* overlay = ImGui::FindWindowByName("performance");
    return overlay && overlay->Active;
  };
  EXPECT_FALSE(shown());
  state.rates = true;
  EXPECT_TRUE(shown());
  const std::string words = words_of([&] { performance_overlay(layout, content, 1); });
  for (const char* said : {"to measured 1.0 / 2.0 / 3.0 ms", "7 not measured", "mesh 96 x 72"})
    EXPECT_EQ(count(words, said), 1u) << said << " in " << words;
}

TEST(StripCharts, ShearDoesNotShowTheNoiseOfAPadAtRest) {
  Sensor sensor = synthetic_sensor(parse_synthetic("synthetic:slide?size=320x240"));
  const double largest_N = calibrated_range(*sensor.force).most_N;
  std::deque<Sample> samples(1);
  EXPECT_NEAR(least_shear_axis_N(sensor, samples), 0.05 * sensor.shear->friction * largest_N, 1e-12);
  samples[0].contact = true;
  samples[0].shear_x_N = {0.001, 0.2, Validity::Valid};
  EXPECT_NEAR(least_shear_axis_N(sensor, samples), 0.8, 1e-12) << "four standard errors";
  samples[0].shear_x_N.validity = Validity::NotCalibrated;
  EXPECT_LT(least_shear_axis_N(sensor, samples), 0.1);
}

TEST(PressRows, APressInProgressSaysHowManyLoadsItHas) {
  PressStatus status;
  status.pressing = true;
  status.force_N = 0.8;
  status.loads = 2;
  status.wanted = 4;
  const auto says = [&](const char* name, const char* value) {
    return std::ranges::any_of(press_rows(status, 0),
                               [&](const PressRow& row) { return row.name == name && row.value == value; });
  };
  EXPECT_TRUE(says("pressing", "0.80 N, loads 2 of 4"));
  EXPECT_TRUE(says("tilt", "cannot be told"));
  status.tilt = lump::PadTilt{1.23, -2, 0.4, 0.5};
  EXPECT_TRUE(says("tilt", "1.2, -2.0 \xc2\xb1 0.5\xc2\xb0"));
}

TEST(ScanRows, PressesByHandSayWhereTheyLayOrWhyNot) {
  ScanStatus status;
  const auto says = [&](const char* name, const std::string& value) {
    return std::ranges::any_of(scan_rows(status), [&](const PressRow& row) {
      return row.name == name && row.value.find(value) != std::string::npos;
    });
  };
  EXPECT_TRUE(says("", "not put together"));
  EXPECT_FALSE(scan_look(status).map);
  status.on = status.full = true;
  status.presses = 2;
  status.broken = "lost contact";
  EXPECT_TRUE(says("by hand", "2"));
  EXPECT_TRUE(says("", "no room"));
  EXPECT_TRUE(says("the last press", "lost contact"));
  auto seen = std::make_shared<SeenScan>();
  HandAnswer& answer = seen->answer.emplace();
  answer.rows = {{.name = "press 1", .left_out = {}, .at_mm = {-7.5, 2}, .at_sd_mm = {0.08, 0.06}},
                 {.name = "press 2", .left_out = "no texture"}};
  lump::ScanMap& map = answer.scan.map;
  map.seen_fraction = 0.5;
  map.observation.force_N = {1.2};
  map.observation.pressure_Pa = {{3, 2, {1.25, 1.25}, {500, 1000, std::nanf(""), 750, 800, 900}}};
  map.places.resize(1);
  map.places[0].used = true;
  map.places[0].stage_mm = {-7.5, 2};
  lump::Estimate& estimate = answer.scan.estimate.emplace();
  estimate.verdict = lump::Status::NoLump;
  status.seen = seen;
  EXPECT_TRUE(says("by hand", "2, 1 of 2 with a place"));
  EXPECT_TRUE(says("", "no lump seen so far"));
  EXPECT_TRUE(says("press 1", "-7.50, 2.00 \xc2\xb1 0.08 mm"));
  EXPECT_TRUE(says("press 2", "left out: no texture"));
  const MapLook look = scan_look(status);
  ASSERT_TRUE(look.map);
  EXPECT_EQ(look.unit, "kPa");
  EXPECT_FLOAT_EQ(look.map->height_mm[1], 1);
  EXPECT_NEAR(look.map->low_mm, 0.5, 1e-6);
  EXPECT_NEAR(look.map->left_mm, -1.25, 1e-9) << "the block's middle is at 0";
  EXPECT_EQ(look.map->way_mm.size(), 1u);
  EXPECT_TRUE(look.outlines_mm.empty());
  estimate.verdict = lump::Status::Found;
  estimate.size_mm = {12, 11, 13};
  estimate.x_mm = {1, 0, 2};
  EXPECT_TRUE(says("size", "12 mm (11 to 13)"));
  const MapLook found = scan_look(status);
  ASSERT_EQ(found.outlines_mm.size(), 1u);
  for (const auto& [x, y] : found.outlines_mm[0]) EXPECT_NEAR(std::hypot(x - 1, y), 6, 1e-9);
  EXPECT_TRUE(found.next_mm.empty());
  NextPress& proposed = answer.scan.next.emplace();
  proposed.at_mm = {4, -2};
  proposed.window_mm = {20, 10};
  EXPECT_TRUE(says("press next", "4, -2 mm"));
  const MapLook next = scan_look(status);
  ASSERT_EQ(next.next_mm.size(), 4u);
  EXPECT_DOUBLE_EQ(next.next_mm[0][0], -6);
  EXPECT_DOUBLE_EQ(next.next_mm[2][1], 3);
}

TEST(ScanRows, OfTwoLumpsEachHasItsNumbersAndItsCircle) {
  auto seen = std::make_shared<SeenScan>();
  HandAnswer& answer = seen->answer.emplace();
  answer.scan.map.observation.force_N = {1.2};
  answer.scan.map.observation.pressure_Pa = {{2, 1, {1.25, 1.25}, {500, 1000}}};
  lump::Estimate& both = answer.scan.estimate.emplace();
  both.verdict = lump::Status::SeveralLumps;
  for (const double x_mm : {-8.0, 9.0}) {
    lump::Estimate& one = both.lumps.emplace_back();
    one.verdict = x_mm < 0 ? lump::Status::Found : lump::Status::StiffnessOpen;
    one.size_mm = {7, 6.5, 7.5};
    one.stiffness_ratio = {8, 4, 20};
    one.x_mm = {x_mm, x_mm - 0.5, x_mm + 0.5};
    one.y_mm = {2, 1.5, 2.5};
  }
  ScanStatus status;
  status.on = true;
  status.presses = 3;
  status.seen = seen;
  const std::vector<PressRow> rows = scan_rows(status);
  const auto row = [&](const char* name, int nth) {
    for (const PressRow& one : rows)
      if (one.name == name && nth-- == 0) return one.value;
    return std::string("none");
  };
  EXPECT_EQ(row("lump 1", 0), lump::status_text(lump::Status::Found));
  EXPECT_EQ(row("centre x", 0), "-8 mm (-8.5 to -7.5)");
  EXPECT_EQ(row("stiffness", 0), "8 x tissue (4 to 20)");
  EXPECT_EQ(row("lump 2", 0), lump::status_text(lump::Status::StiffnessOpen));
  EXPECT_EQ(row("centre x", 1), "9 mm (8.5 to 9.5)");
  EXPECT_EQ(row("stiffness", 1), "open: 4 to 20 x");
  const MapLook look = scan_look(status);
  ASSERT_EQ(look.outlines_mm.size(), 2u);
  for (const auto& [x, y] : look.outlines_mm[1]) EXPECT_NEAR(std::hypot(x - 9, y - 2), 3.5, 1e-9);
}

}  // namespace
}  // namespace palpate::viz
