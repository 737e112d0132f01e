// The parts of the window that need no display: colour maps, section, zero, history, events, settings,
// layout, words, and pictures with all of it, on the device and against small stored ones.
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <set>

#include "capture/files/event_log.h"
#include "capture/synthetic/synthetic.h"
#include "capture/synthetic/tissue.h"
#include "engine/base/background_work.h"
#include "engine/gpu/buffer.h"
#include "engine/gpu/commands.h"
#include "engine/measure/force.h"
#include "engine/sensor/fit.h"
#include "palpate/pipeline.h"
#include "tests/support/gpu_fixture.h"
#include "viz/display/picture.h"
#include "viz/live/history.h"
#include "viz/live/tare.h"
#include "viz/panels/calibration_chart.h"
#include "viz/panels/charts.h"
#include "viz/panels/controls.h"
#include "viz/panels/section.h"
#include "viz/panels/sensor.h"
#include "viz/panels/settings.h"
#include "viz/panels/start_list.h"
#include "viz/render/colour_map.h"
#include "viz/render/format.h"
#include "viz/render/layout.h"
#include "viz/render/pressure_view.h"

namespace palpate::viz {
namespace {

namespace fs = std::filesystem;

class WindowParts : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / ("palpate-window-parts-" + std::to_string(getpid()));
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }
  void write(const fs::path& file, const std::string& words) { std::ofstream(file) << words; }
  fs::path folder_;
};

TEST(ColourMaps, AreThoseOfOpenCvAndRiseInLightness) {
  const std::pair<ColourMap, int> maps[] = {{ColourMap::Viridis, cv::COLORMAP_VIRIDIS},
                                            {ColourMap::Cividis, cv::COLORMAP_CIVIDIS},
                                            {ColourMap::Magma, cv::COLORMAP_MAGMA}};
  for (const auto& [map, known] : maps) {
    cv::Mat steps(1, 256, CV_8U), table;
    for (int i = 0; i < 256; ++i) steps.at<uint8_t>(0, i) = static_cast<uint8_t>(i);
    cv::applyColorMap(steps, table, known);
    double last = -1;
    for (int i = 0; i < 256; ++i) {
      const auto colour = colour_of(map, i / 255.0);
      for (int c = 0; c < 3; ++c)
        EXPECT_NEAR(255 * colour[static_cast<size_t>(c)], table.at<cv::Vec3b>(0, i)[2 - c], 6.5)
            << to_string(map) << " at " << i;
      if (i % 16 != 0) continue;
      const auto linear = [](float v) { return std::pow(v, 2.2); };
      const double lightness =
          0.2126 * linear(colour[0]) + 0.7152 * linear(colour[1]) + 0.0722 * linear(colour[2]);
      EXPECT_GT(lightness, last) << to_string(map) << " at " << i;
      last = lightness;
    }
  }
}

TEST(Tare, ShownIsTheDifferenceWithBothErrors) {
  Touch touch;
  touch.contact = true;
  touch.force_N = {0.5, 0.03, Validity::Valid};
  touch.shear_x_N = {0.2, 0.01, Validity::Valid};
  touch.shear_y_N = {0, 0, Validity::NotCalibrated};
  Tare tare;
  ASSERT_TRUE(tare.set(touch));
  touch.force_N = {0.9, 0.04, Validity::AboveRange};
  const Touch shown = tared(touch, tare);
  EXPECT_DOUBLE_EQ(shown.force_N.value, 0.4);
  EXPECT_DOUBLE_EQ(shown.force_N.standard_error, 0.05);
  EXPECT_EQ(shown.force_N.validity, Validity::AboveRange) << "zeroing heals no doubt";
  EXPECT_DOUBLE_EQ(shown.shear_x_N.value, 0);
  EXPECT_EQ(shown.shear_y_N.validity, Validity::NotCalibrated);
  EXPECT_EQ(tare.words(), "force_N=0.5 shear_x_N=0.2");
  Touch uncalibrated, untouched;
  untouched.force_N.validity = Validity::NoContact;
  EXPECT_FALSE(Tare().set(uncalibrated));
  EXPECT_FALSE(Tare().set(untouched));
}

TEST(Tare, EachContactHasItsOwnZero) {
  const auto contact = [](uint32_t id, double force_N) {
    ContactTouch c;
    c.id = id;
    c.force_N = {force_N, 0.003, Validity::Valid};
    c.shear_x_N = {0.1 * force_N, 0.003, Validity::Valid};
    return c;
  };
  Touch touch;
  touch.contact = true;
  touch.regions.emplace();
  touch.force_N = {0.5, 0.03, Validity::Valid};
  touch.contacts = {contact(2, 0.2), contact(4, 0.3)};
  Tare tare;
  ASSERT_TRUE(tare.set(touch));
  EXPECT_EQ(
      tare.words(),
      "force_N=0.5 contact_2_force_N=0.2 contact_2_shear_x_N=0.020000000000000004 contact_4_force_N=0.3 "
      "contact_4_shear_x_N=0.03");
  // The second has left, another has come: it is shown whole.
  touch.force_N = {0.75, 0.04, Validity::Valid};
  touch.contacts = {contact(4, 0.35), contact(7, 0.4)};
  const Touch shown = tared(touch, tare);
  EXPECT_DOUBLE_EQ(shown.force_N.value, 0.25);
  ASSERT_EQ(shown.contacts.size(), 2u);
  EXPECT_NEAR(shown.contacts[0].force_N.value, 0.05, 1e-12);
  EXPECT_NEAR(shown.contacts[0].force_N.standard_error, std::hypot(0.003, 0.003), 1e-12);
  EXPECT_NEAR(shown.contacts[0].shear_x_N.value, 0.005, 1e-12);
  EXPECT_DOUBLE_EQ(shown.contacts[1].force_N.value, 0.4);
  EXPECT_EQ(touch.contacts[0].force_N.value, 0.35) << "as measured";
}

TEST(StartList, OffersEverySceneAndOpensEachEntry) {
  const StartList list{Settings{}};
  std::set<std::string> scenes;
  for (const SourceEntry& e : list.sources()) {
    if (e.group != SourceEntry::Group::Synthetic || e.input.empty()) continue;
    if (is_tissue(e.input)) {
      EXPECT_EQ(parse_tissue(e.input).repeat, 0u);
      EXPECT_EQ(e.name.rfind("tissue, ", 0), 0u);
      scenes.insert("tissue");
      continue;
    }
    const SyntheticOptions options = parse_synthetic(e.input);
    scenes.insert(options.scene);
    EXPECT_EQ(options.repeat, 0u) << e.input << " goes on until it is closed";
    EXPECT_EQ(e.name.rfind(options.scene + ", ", 0), 0u) << e.name;
    EXPECT_EQ(options.mode == SyntheticMode::Gel, e.name.find("gel") != std::string::npos) << e.name;
    EXPECT_EQ(options.skin == SyntheticSkin::Markers, e.name.find("markers") != std::string::npos) << e.name;
    EXPECT_EQ(options.skin == SyntheticSkin::Texture, e.name.find("textured") != std::string::npos) << e.name;
    EXPECT_FALSE(e.detail.empty());
  }
  for (const auto& [scene, what] : synthetic_scenes()) EXPECT_TRUE(scenes.contains(scene)) << scene;
  EXPECT_TRUE(scenes.contains("tissue"));
}

TEST(History, KeepsAMinuteAndStartsAnewWhenTimeJumpsBack) {
  History history;
  Touch touch;
  for (int i = 0; i < 1000; ++i) {
    touch.time_ns = i * 100'000'000LL;
    history.add(touch);
  }
  EXPECT_NEAR(history.samples().back().time_s - history.samples().front().time_s, History::kLongest_s, 0.2);
  EXPECT_FALSE(history.samples().back().gap);
  touch.time_ns += 5'000'000'000;
  history.add(touch);
  EXPECT_TRUE(history.samples().back().gap) << "no line across a silence";
  touch.time_ns = 0;
  history.add(touch);
  EXPECT_EQ(history.samples().size(), 1u);
}

TEST(SectionLine, StaysInTheFrameWhateverIsDone) {
  SectionLine line{0.1, 0.5, 0.9, 0.5};
  const double length = line.x1 - line.x0;
  line.move(5, 0);
  EXPECT_DOUBLE_EQ(line.x1, 1);
  EXPECT_NEAR(line.x1 - line.x0, length, 1e-12) << "it moves as a whole";
  for (int i = 0; i < 200; ++i) {
    line.turn(0.1, 4.0 / 3);
    line.move(0.03 * std::sin(i), 0.05 * std::cos(i));
    for (const double v : {line.x0, line.y0, line.x1, line.y1}) {
      EXPECT_GE(v, -1e-12);
      EXPECT_LE(v, 1 + 1e-12);
    }
  }
}

TEST_F(WindowParts, EventsComeBackWhateverWasTyped) {
  append_event(folder_ / "new", {3, 0.1, "mark", "1"});
  append_event(folder_ / "new", {7, 0.25, "mark", "said \"here\", then\nlet go"});
  std::ofstream(folder_ / "new" / "events.csv", std::ios::app) << "nonsense\n,,,\nx,1,mark,y\n";
  append_event(folder_ / "new", {9, 0.3, "zero", "force_N=0.5"});
  const std::vector<Event> events = read_events(folder_ / "new");
  ASSERT_EQ(events.size(), 3u);
  EXPECT_EQ(events[0].frame, 3u);
  EXPECT_DOUBLE_EQ(events[1].time_s, 0.25);
  EXPECT_EQ(events[1].text, "said \"here\", then let go");
  EXPECT_EQ(events[2].kind, "zero");
  EXPECT_TRUE(read_events(folder_ / "nowhere").empty());
}

TEST_F(WindowParts, SettingsComeBackAndDamagedOnesAreOneLine) {
  Settings settings;
  settings.width = 1000;
  settings.map = ColourMap::Cividis;
  settings.quantity = Quantity::Strain;
  settings.section = true;
  settings.line = {0.1, 0.2, 0.3, 0.4};
  settings.chart_span_s = 30;
  settings.skin_strain = SkinStrain::Shear;
  settings.remember("synthetic:slide", "");
  settings.remember(folder_ / "press", folder_ / "pad.json");
  settings.remember("synthetic:slide", "");
  const fs::path file = folder_ / "deep" / "window.json";
  save_settings(settings, file);
  const LoadedSettings loaded = load_settings(file);
  EXPECT_EQ(loaded.warning, "");
  EXPECT_EQ(loaded.settings.width, 1000u);
  EXPECT_EQ(loaded.settings.map, ColourMap::Cividis);
  EXPECT_EQ(loaded.settings.quantity, Quantity::Strain);
  EXPECT_TRUE(loaded.settings.section);
  EXPECT_DOUBLE_EQ(loaded.settings.line.y1, 0.4);
  EXPECT_EQ(loaded.settings.chart_span_s, 30);
  EXPECT_EQ(loaded.settings.skin_strain, SkinStrain::Shear);
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

TEST_F(WindowParts, SettingsHaveTheirPlaceByTheEnvironment) {
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

TEST(BackgroundWork, DoesItInOrderAndReportsWhatFails) {
  std::vector<int> done;
  BackgroundWork work;
  for (int i = 0; i < 20; ++i)
    work.add([&done, i] {
      done.push_back(i);
      return i == 19 ? std::string("last") : std::string();
    });
  work.finish();
  ASSERT_EQ(done.size(), 20u);
  for (int i = 0; i < 20; ++i) EXPECT_EQ(done[static_cast<size_t>(i)], i);
  EXPECT_EQ(work.take_note().value_or(""), "last");
  EXPECT_FALSE(work.take_note());
  work.add([]() -> std::string { throw std::runtime_error("disk full"); });
  work.finish();
  EXPECT_EQ(work.take_note().value_or(""), "disk full");
}

TEST(Layout, PanelsNeverOverlapFrom480x320To4k) {
  const auto right = [](const ViewRect& r) { return r.x + static_cast<int64_t>(r.width); };
  const auto foot = [](const ViewRect& r) { return r.y + static_cast<int64_t>(r.height); };
  for (const auto& [width, height, scale] : {std::tuple{480u, 320u, 1.0f},
                                             {800u, 600u, 1.0f},
                                             {1280u, 720u, 1.0f},
                                             {1280u, 800u, 1.5f},
                                             {2560u, 1440u, 2.0f},
                                             {3840u, 2160u, 2.5f}}) {
    for (const bool surface : {false, true}) {
      for (const Panels& panels :
           {Panels{true, true}, Panels{true, false}, Panels{false, true}, Panels{false, false}}) {
        SCOPED_TRACE(text("%u x %u at %g, surface %d, charts %d, profile %d", width, height, scale, surface,
                          panels.charts, panels.profile));
        const Layout l = make_layout({width, height}, scale, {640, 480, 1, 8}, surface, panels);
        EXPECT_LE(right(l.surface), l.panel.x);
        EXPECT_LE(right(l.panel), width);
        EXPECT_LE(foot(l.panel), l.status.y);
        EXPECT_LE(foot(l.status), height);
        if (l.has_charts) {
          EXPECT_LE(foot(l.surface), l.charts.y);
          EXPECT_LE(foot(l.charts), l.status.y);
          EXPECT_LE(right(l.charts), l.has_profile ? l.profile.x : l.panel.x);
        }
        if (l.has_profile) {
          EXPECT_LE(foot(l.profile), l.status.y);
          EXPECT_LE(right(l.profile), l.panel.x);
        }
        const ViewRect& holder = surface ? l.panel : l.surface;
        EXPECT_GE(l.image.x, holder.x);
        EXPECT_LE(right(l.image), right(holder));
        EXPECT_LE(foot(l.image), foot(holder));
        EXPECT_GE(l.surface.height, 100u * height / 720);
      }
    }
  }
}

TEST(Words, StatesAreToldApartWithoutColour) {
  const Slip all[] = {Slip::Stick, Slip::Incipient, Slip::Slip, Slip::NoContact};
  for (const Slip a : all) {
    for (const Slip b : all) {
      if (a != b) {
        EXPECT_STRNE(slip_verdict(a).words, slip_verdict(b).words);
      }
    }
  }
  EXPECT_EQ(newtons_text({0.5, 0.01, Validity::Valid}), "+0.500 \xc2\xb1 0.010 N");
  EXPECT_EQ(newtons_text({0.5, 0.01, Validity::NoContact}), "-");
  EXPECT_EQ(time_text(75.25), "1:15.2 min");
}

TEST(KeyHelp, EveryKeyIsThereOnce) {
  std::string all;
  for (const KeyHelp& line : key_help()) all += std::string(" ") + line.keys + " ";
  for (const char* key :
       {" R,", "T ",  " D ", " O ", " A ", " E ", "L, G, Y", " X ", " P ", "[  ]", "K, J", "Space",
        " Z,", " W ", " S ", " M,", " N ", " I ", " V ",     "F11", " C ", " B ",  " H,",  "Esc"})
    EXPECT_NE(all.find(key), std::string::npos) << key;
}

TEST(SensorPanel, SaysWhatIsMissingAndWhatWouldDo) {
  const Sensor bare = uncalibrated_sensor({64, 48, 1, 8});
  size_t missing = 0;
  for (const CalibrationLine& line : calibrations(bare)) missing += !line.present;
  EXPECT_GE(missing, 4u);
  const Sensor pad = synthetic_sensor(parse_synthetic("synthetic:press"));
  for (const CalibrationLine& line : calibrations(pad)) {
    if (std::string(line.name) != "force") continue;
    EXPECT_TRUE(line.present);
    EXPECT_NE(line.what.find("N"), std::string::npos);
  }
}

/// A calibration with two branches, of a signal that is not the gray sum.
ForceCalibration power_of_area() {
  ForceCalibration c;
  c.signal = ForceSignal::Area;
  c.model = ForceModel::Power;
  c.c1_N_per_gray = 4e-5;
  c.exponent = 1.5;
  c.gray_min = 50;
  c.gray_max = 1000;
  c.residual_sd_N = 0.01;
  c.loading = ForceCurve{5e-5, 0, 1.5, {}, 0.01};
  c.unloading = ForceCurve{3e-5, 0, 1.5, {}, 0.02};
  return c;
}

TEST(CalibrationChart, CurvesAreWhatTheContactWouldRead) {
  const ForceCalibration c = power_of_area();
  for (const Branch branch : {Branch::Loading, Branch::Unloading}) {
    const std::vector<CurvePoint> points = force_curve(c, branch, c.gray_min, c.gray_max, 20);
    ASSERT_EQ(points.size(), 20u);
    EXPECT_EQ(points.front().signal, 50);
    EXPECT_EQ(points.back().signal, 1000);
    for (const CurvePoint& p : points) {
      ContactTouch contact;
      contact.area_px = static_cast<uint64_t>(std::llround(p.signal));
      contact.gray_sum = 1e9;  // not what this calibration reads
      const Estimate e = force_of(c, force_features(contact), branch == Branch::Unloading ? 1 : 0);
      EXPECT_NEAR(p.force_N, e.value, 2e-3 * e.value + 1e-4) << p.signal;
      EXPECT_NEAR(p.standard_error_N, branch == Branch::Unloading ? 0.02 : 0.01, 1e-12);
    }
  }
}

TEST(StripCharts, EveryAxisHasATickBesideZeroAndRoomForAll) {
  for (double most = 1e-5; most < 1e7; most *= 1.07)
    for (const int ticks : {0, 1, 2, 3, 5, 9})
      for (const double below : {0.0, 0.05, 1.0, 20.0}) {
        const double least = -below * most, step = tick_step(least, most, ticks);
        EXPECT_GT(step, 0);
        EXPECT_LE(step, std::max(most, -least));
        // One more than there is room for at most, where zero would stand alone.
        EXPECT_LE((most - least) / step, std::max(ticks, 5) + 1e-6);
      }
}

TEST(CalibrationChart, RangeIsInNewtonsWhateverTheSignal) {
  ForceCalibration c = power_of_area();
  const double middle = (5e-5 + 3e-5) / 2;
  for (const ForceSignal signal : {ForceSignal::GraySum, ForceSignal::Area, ForceSignal::Volume}) {
    c.signal = signal;
    EXPECT_NEAR(calibrated_range(c).least_N, middle * std::pow(50, 1.5), 1e-9) << to_string(signal);
    EXPECT_NEAR(calibrated_range(c).most_N, middle * std::pow(1000, 1.5), 1e-9) << to_string(signal);
  }
}

TEST(CalibrationChart, MarksAreTheContactsOfTheFrame) {
  ForceCalibration force = power_of_area();
  ShearCalibration shear;
  Touch t;
  EXPECT_TRUE(force_marks(force, t).empty());
  EXPECT_TRUE(shear_marks(shear, t, true).empty());
  t.contact = true;
  t.area_px = 400;
  t.gray_sum = 12345;
  t.force_N = {0.4, 0.01, Validity::Valid};
  t.shear_x_N = {0.1, 0.01, Validity::Valid};
  t.shear_y_N = {-0.2, 0.01, Validity::Valid};
  t.shift_x_mm = 0.3;
  t.shift_y_mm = -0.5;
  ASSERT_EQ(force_marks(force, t).size(), 1u);
  EXPECT_EQ(force_marks(force, t)[0].id, 0u);
  EXPECT_EQ(force_marks(force, t)[0].signal, 400);
  EXPECT_EQ(shear_marks(shear, t, true)[0].signal, 0.3);
  EXPECT_EQ(shear_marks(shear, t, false)[0].signal, -0.5);
  EXPECT_EQ(shear_marks(shear, t, false)[0].force_N.value, -0.2);
  // By the skin, the shift is the skin's where enough of it is followed.
  shear.signal = ShearSignal::Skin;
  t.skin.emplace();
  t.skin->shift_x_mm = {0.07, 0.01, Validity::Valid};
  EXPECT_EQ(shear_marks(shear, t, true)[0].signal, 0.3);
  t.skin->touching = 12;
  EXPECT_EQ(shear_marks(shear, t, true)[0].signal, 0.07);
  // Of two contacts each has its own signal, the sum of both has none.
  t.regions.emplace();
  for (const uint32_t id : {3u, 5u}) {
    ContactTouch c;
    c.id = id;
    c.area_px = 100 * id;
    c.shift_x_mm = 0.1 * id;
    c.force_N = c.shear_x_N = {0.01 * id, 0.001, Validity::Valid};
    t.contacts.push_back(c);
  }
  ASSERT_EQ(force_marks(force, t).size(), 2u);
  EXPECT_EQ(force_marks(force, t)[1].id, 5u);
  EXPECT_EQ(force_marks(force, t)[1].signal, 500);
  EXPECT_TRUE(shear_marks(shear, t, true).empty());  // the skin under each is not told
  shear.signal = ShearSignal::Centroid;
  ASSERT_EQ(shear_marks(shear, t, true).size(), 2u);
  EXPECT_EQ(shear_marks(shear, t, true)[0].signal, 0.1 * 3);
  // A single contact's volume is the touch's; of several none is known.
  force.signal = ForceSignal::Volume;
  for (ContactTouch& c : t.contacts) c.force_N = {};
  EXPECT_TRUE(force_marks(force, t).empty());
}

/// Pictures of measured frames, with every panel.
class WindowPicture : public GpuTest {
 protected:
  struct Run {
    RgbImage image;
    Touch touch;
  };
  /// Frame `last` of the scene, with the frames before it in the charts.
  Run draw(const std::string& scene, uint64_t last, const PictureOptions& look,
           const std::function<void(Touch&)>& change = {},
           const std::function<void(Sensor&)>& calibrate = {}) {
    const SyntheticOptions options = parse_synthetic(scene);
    SyntheticSensor source(options);
    Sensor sensor = synthetic_sensor(options);
    if (calibrate) calibrate(sensor);
    const Frame background = *source.own_background();
    Pipeline pipeline(context(), sensor, source.format(), {});
    pipeline.set_background(background);
    PictureRenderer renderer(context(), sensor, look, &background);
    Run run;
    Frame frame;
    for (uint64_t k = 0; k <= last && source.next(frame); ++k) {
      EXPECT_TRUE(pipeline.submit(frame));
      Result result = *pipeline.wait();
      if (change) change(result.touch);
      if (k < last)
        renderer.follow(result.touch);
      else
        run = {renderer.render(frame, result.touch, result.surface), result.touch};
    }
    return run;
  }
  /// Compares with a stored picture at a quarter of the size: mean and largest difference of blurred pixels.
  static void expect_as_stored(const RgbImage& image, const std::string& name) {
    const cv::Mat rgb(static_cast<int>(image.height), static_cast<int>(image.width), CV_8UC3,
                      const_cast<uint8_t*>(image.rgb.data()));
    cv::Mat bgr, small;
    cv::cvtColor(rgb, bgr, cv::COLOR_RGB2BGR);
    cv::resize(bgr, small, {}, 0.25, 0.25, cv::INTER_AREA);
    const fs::path file = fs::path(PALPATE_SOURCE_DIR) / "tests" / "data" / "window" / (name + ".png");
    if (std::getenv("PALPATE_STORE_PICTURES")) {
      fs::create_directories(file.parent_path());
      cv::imwrite(file.string(), small);
      GTEST_SKIP() << "stored " << file;
    }
    const cv::Mat stored = cv::imread(file.string());
    ASSERT_EQ(stored.size(), small.size()) << file;
    cv::Mat difference;
    cv::absdiff(stored, small, difference);
    cv::blur(difference, difference, {5, 5});
    double largest = 0;
    cv::minMaxLoc(difference.reshape(1), nullptr, &largest);
    const cv::Scalar mean = cv::mean(difference);
    EXPECT_LT((mean[0] + mean[1] + mean[2]) / 3, 1.5) << name;
    EXPECT_LT(largest, 40) << name;
    if (HasFailure()) cv::imwrite((fs::temp_directory_path() / ("palpate-" + name + ".png")).string(), small);
  }
  static PictureOptions look() {
    PictureOptions options;
    options.smooth = false;
    options.mesh_columns = 128;
    return options;
  }
};

TEST_F(WindowPicture, ASlideWithChartsAndSectionIsAsStored) {
  PictureOptions options = look();
  options.section = SectionLine{};
  const Run run = draw("synthetic:slide?size=320x240", 100, options);
  EXPECT_EQ(run.touch.slip, Slip::Slip);
  expect_as_stored(run.image, "slide");
}

TEST_F(WindowPicture, SeveralContactsAndSkinAreAsStored) {
  PictureOptions options = look();
  options.map = ColourMap::Cividis;
  const Run run = draw("synthetic:press?size=320x240&mode=gel", 60, options, [](Touch& t) {
    t.regions.emplace();
    t.at_border = true;
    for (uint32_t i = 0; i < 3; ++i) {
      ContactTouch c;
      c.id = i + 1;
      c.centroid_x_px = 70.0 + 90 * i;
      c.centroid_y_px = 80.0 + 40 * i;
      c.area_px = 900;
      c.area_mm2 = 6.5;
      c.ellipse = {4.0 + i, 3.0, 0.4};
      c.force_N = {0.2 + 0.1 * i, 0.01, Validity::Valid};
      c.shear_x_N = {0.1, 0.01, Validity::Valid};
      c.shear_y_N = {-0.05, 0.01, Validity::Valid};
      c.slip = i == 0 ? Slip::Stick : i == 1 ? Slip::Incipient : Slip::Slip;
      c.at_border = i == 2;
      t.contacts.push_back(c);
    }
    t.skin.emplace();
    for (int y = 20; y < 240; y += 24)
      for (int x = 20; x < 320; x += 24)
        t.skin_points.push_back(
            {static_cast<float>(x), static_cast<float>(y), 0.6f, -0.3f, x == 20 ? 0.0f : 1.0f});
    t.skin.emplace();
    t.skin->points = 100;
    t.skin->lost = 10;
  });
  expect_as_stored(run.image, "contacts");
}

TEST_F(WindowPicture, PressureAndStrainHaveTheirColours) {
  PictureOptions options = look();
  options.quantity = Quantity::Pressure;
  options.map = ColourMap::Magma;
  expect_as_stored(draw("synthetic:press?size=320x240", 60, options).image, "pressure");
  options.quantity = Quantity::Strain;
  options.map = ColourMap::Viridis;
  options.colour_range = 0.1;
  expect_as_stored(draw("synthetic:press?size=320x240&mode=gel", 60, options).image, "strain");
}

TEST_F(WindowPicture, CalibrationsAreCurvesWithTheTouchOnThem) {
  PictureOptions options = look();
  options.calibrations = true;
  const Run run = draw("synthetic:slide?size=320x240", 50, options, {}, [](Sensor& s) {
    s.force->loading = ForceCurve{s.force->c1_N_per_gray, s.force->c0_N, 1, {}, 0.02};
    s.force->unloading = ForceCurve{0.9 * s.force->c1_N_per_gray, s.force->c0_N, 1, {}, 0.03};
    s.force->origin.from = "a press beside a gauge";
    s.shear->ky_N_per_mm *= 0.7;
    s.shear->relative_sd = 0.05;
    s.shear->shift_max_mm = 0.5;
  });
  EXPECT_EQ(run.touch.force_N.validity, Validity::Valid);
  expect_as_stored(run.image, "calibrations");
}

TEST_F(WindowPicture, PressureMapIsThePressureOfTheScene) {
  const SyntheticOptions options = parse_synthetic("synthetic:press?size=640x480&noise=off&falloff=0");
  SyntheticSensor source(options);
  const Sensor sensor = synthetic_sensor(options);
  ASSERT_TRUE(reads_pressure(sensor));
  const Frame background = *source.own_background();
  Frame frame;
  ASSERT_TRUE(source.render(60, frame));
  PressureMap map(context(), 1);
  const PressureTexels texels = map.update(frame, background, sensor);
  EXPECT_EQ(texels.width, 640u);
  EXPECT_EQ(texels.height, 480u);
  // The pressure of gray levels is force over area: summed up it is the force.
  const Truth truth = *source.truth(60);
  double sum = 0;
  for (uint32_t y = 0; y < 480; ++y)
    for (uint32_t x = 0; x < 640; ++x)
      sum += std::max(0.0, double(frame.at(0, x, y)) - background.at(0, x, y));
  const double force_N = sum / sensor.elastic.gray_per_MPa * sensor.pitch_mm_per_px * sensor.pitch_mm_per_px;
  EXPECT_NEAR(force_N, truth.force_N, 0.05 * truth.force_N);
  uint32_t peak = 0;
  for (uint32_t y = 0; y < 480; ++y)
    for (uint32_t x = 0; x < 640; ++x)
      if (frame.at(0, x, y) > background.at(0, x, y))
        peak = std::max(peak, frame.at(0, x, y) - background.at(0, x, y));
  EXPECT_NEAR(map.largest_MPa(), peak / sensor.elastic.gray_per_MPa, 0.03 * map.largest_MPa());
}

/// Depth along a line through a map of known depths.
TEST_F(WindowPicture, SectionReadsTheDepthsUnderTheLine) {
  constexpr uint32_t kWidth = 200, kHeight = 150, kPitch = 207;
  gpu::DeviceBuffer buffer(context(), "known depths", uint64_t{4} * kPitch * kHeight, gpu::Memory::Upload);
  const auto depth = [](double x, double y) { return 0.01 * x + 0.003 * y; };
  const auto out = buffer.as<float>();
  for (uint32_t y = 0; y < kHeight; ++y)
    for (uint32_t x = 0; x < kWidth; ++x) out[y * kPitch + x] = static_cast<float>(depth(x, y));
  buffer.flush();
  const SurfaceMap map{&buffer, kWidth, kHeight, kPitch};
  const double w = kWidth - 1, h = kHeight - 1;
  for (const SectionLine& line :
       {SectionLine{0, 0, 1, 1}, SectionLine{1, 0.3, 0, 0.9}, SectionLine{0.25, 1, 0.25, 0}}) {
    const Profile profile = probe(context(), map, 0.5, 0.05, line);
    EXPECT_NEAR(profile.length_mm, 0.05 * std::hypot((line.x1 - line.x0) * w, (line.y1 - line.y0) * h), 1e-9);
    for (size_t i = 0; i < profile.depth_mm.size(); ++i) {
      const double t = static_cast<double>(i) / static_cast<double>(profile.depth_mm.size() - 1);
      EXPECT_NEAR(
          profile.depth_mm[i],
          0.5 + depth((line.x0 + t * (line.x1 - line.x0)) * w, (line.y0 + t * (line.y1 - line.y0)) * h),
          1e-5);
    }
    EXPECT_DOUBLE_EQ(profile.most().depth_mm,
                     *std::max_element(profile.depth_mm.begin(), profile.depth_mm.end()));
  }
  const Profile point = probe(context(), map, 0, 0.05, {0.5, 0.5, 0.5, 0.5});
  EXPECT_EQ(point.length_mm, 0);
  EXPECT_EQ(point.depth_mm.size(), 2u);
}

/// A card with memory of its own, as a layer shows the processor's driver: the section is copied from there.
TEST(SectionOnACard, EqualsThatOfMappedMemory) {
  gpu::ContextOptions options;
  options.validation = true;
  setenv("VK_ADD_LAYER_PATH", PALPATE_LAYER_DIR, 1);
  setenv("VK_INSTANCE_LAYERS", "VK_LAYER_PALPATE_discrete", 1);
  gpu::Context card(options);
  unsetenv("VK_INSTANCE_LAYERS");
  constexpr uint32_t kWidth = 61, kHeight = 40, kPitch = 64;
  gpu::DeviceBuffer host(card, "known depths", uint64_t{4} * kPitch * kHeight, gpu::Memory::Upload);
  gpu::DeviceBuffer own(card, "depths on the card", host.bytes(), gpu::Memory::Device);
  if (own.mapped()) GTEST_SKIP() << "the loader did not take the layer";
  for (uint32_t i = 0; i < kPitch * kHeight; ++i)
    host.as<float>()[i] = 0.001f * static_cast<float>(i * 37 % 1000);
  host.flush();
  gpu::Commands commands(card);
  commands.begin();
  commands.copy(host, own, host.bytes());
  commands.end();
  commands.submit();
  commands.wait();
  const SurfaceMap mapped{&host, kWidth, kHeight, kPitch}, unmapped{&own, kWidth, kHeight, kPitch};
  SurfaceMap part = unmapped;
  part.window = PixelRect{10, 5, 40, 30};
  SurfaceMap same_part = mapped;
  same_part.window = part.window;
  for (const SectionLine& line : {SectionLine{0, 0, 1, 1}, SectionLine{0.9, 0.1, 0.1, 0.7}}) {
    EXPECT_EQ(probe(card, unmapped, 0.1, 0.05, line).depth_mm, probe(card, mapped, 0.1, 0.05, line).depth_mm);
    EXPECT_EQ(probe(card, part, 0.1, 0.05, line).depth_mm, probe(card, same_part, 0.1, 0.05, line).depth_mm);
  }
  for (const std::string& message : card.validation_messages()) ADD_FAILURE() << message;
}

}  // namespace
}  // namespace palpate::viz
