// The parts of the window that need no display: colour maps, section, zero, history, events, layout
// and text.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <string>

#include "capture/files/event_log.h"
#include "capture/synthetic/synthetic.h"
#include "engine/base/background_work.h"
#include "engine/measure/force.h"
#include "tests/support/test_folder.h"
#include "viz/live/history.h"
#include "viz/live/tare.h"
#include "viz/panels/charts/calibration_chart.h"
#include "viz/panels/charts/chart.h"
#include "viz/panels/charts/charts.h"
#include "viz/panels/section.h"
#include "viz/panels/sensor.h"
#include "viz/panels/setup_view.h"
#include "viz/panels/start/start_view.h"
#include "viz/render/colour_map.h"
#include "viz/render/format.h"
#include "viz/render/layout.h"

namespace palpate::viz {
namespace {

namespace fs = std::filesystem;

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

TEST(History, KeepsAMinuteAndStartsAnewWhenTimeJumpsBack) {
  History history;
  Touch touch;
  for (int i = 0; i < 1000; ++i) {
    touch.time_ns = i * 100'000'000LL;
    history.add(touch);
  }
  EXPECT_NEAR(history.samples().back().time - history.samples().front().time, History::kLongest_s, 0.2);
  EXPECT_FALSE(history.samples().back().gap);
  touch.time_ns += 5'000'000'000;
  history.add(touch);
  EXPECT_TRUE(history.samples().back().gap) << "no line across a silence";
  touch.time_ns = 0;
  history.add(touch);
  EXPECT_EQ(history.samples().size(), 1u);
}

TEST(History, KeepsARecordingWholeWhateverOrderItsFramesCome) {
  History history({true, 2001, 20, 5});
  const auto add = [&](uint64_t frame) {
    Touch touch;
    touch.sequence = frame;
    touch.time_ns = 5'000'000'000 + static_cast<int64_t>(frame) * 50'000'000;
    history.add(touch);
  };
  for (uint64_t frame = 0; frame < 100; ++frame) add(frame);
  for (uint64_t frame = 1900; frame < 2001; ++frame) add(frame);
  for (uint64_t frame = 50; frame < 60; ++frame) add(frame);  // once more
  ASSERT_EQ(history.samples().size(), 201u);
  EXPECT_DOUBLE_EQ(history.now(), 5 + 59 * 0.05);
  for (size_t i = 1; i < history.samples().size(); ++i) {
    EXPECT_LT(history.samples()[i - 1].time, history.samples()[i].time);
    EXPECT_EQ(history.samples()[i].gap, i == 100) << i;
  }
  EXPECT_EQ(history.timeline().frame_at(5 + 1900 * 0.05 + 0.01), 1900u);
  EXPECT_EQ(history.timeline().frame_at(-3), 0u);
  EXPECT_EQ(history.timeline().frame_at(1e9), 2000u);
  EXPECT_DOUBLE_EQ(history.timeline().length(), 100);
}

// Frames that were left out are a gap, however short; a session's frames have numbers of their own, and a
// film's times are as they are.
TEST(History, FramesThatAreNotThereAreAGap) {
  History history({.frames = 8, .rate_Hz = 20, .uneven_s = {0, 0.05, 0.1, 0.15, 0.6, 0.65, 0.7, 0.75}});
  const auto add = [&](uint64_t position, double time_s) {
    Touch touch;
    touch.sequence = 500 + 2 * position;
    touch.time_ns = std::llround(1e9 * time_s);
    history.add(touch, position);
  };
  add(0, 0);
  add(1, 0.05);
  add(3, 0.15);
  add(4, 0.6);
  add(6, 0.7);
  std::vector<bool> gaps;
  for (const Sample& s : history.samples()) gaps.push_back(s.gap);
  EXPECT_EQ(gaps, (std::vector<bool>{true, false, true, false, true}));
  add(2, 0.1);
  add(5, 0.65);
  for (const Sample& s : history.samples()) EXPECT_EQ(s.gap, s.position == 0) << s.position;
  EXPECT_EQ(history.timeline().frame_at(0.6), 4u) << "by the times of the frames, not by the rate";
  EXPECT_EQ(history.timeline().frame_at(0.5), 4u);
  EXPECT_EQ(history.timeline().frame_at(0.3), 3u);
  EXPECT_EQ(history.timeline().frame_at(-1), 0u);
  EXPECT_EQ(history.timeline().frame_at(99), 7u);
}

TEST(History, ASlowRecordingIsNoSilence) {
  History history({true, 4, 0.4, 0});
  Touch touch;
  for (touch.sequence = 0; touch.sequence < 4; ++touch.sequence) {
    history.add(touch);
    touch.time_ns += 2'500'000'000;
  }
  for (const Sample& s : history.samples()) EXPECT_EQ(s.gap, s.position == 0) << s.position;
}

TEST(History, PicturesWithoutTimesAreCounted) {
  History history({false, 20, 0, 0});
  Touch touch;
  for (touch.sequence = 0; touch.sequence < 20; ++touch.sequence) history.add(touch);
  ASSERT_EQ(history.samples().size(), 20u);
  EXPECT_EQ(history.samples()[7].time, 7);
  EXPECT_DOUBLE_EQ(history.timeline().length(), 19);
  history.mark({.frame = 4, .time_s = 0, .kind = "mark", .text = "1"});
  EXPECT_EQ(history.events()[0].time, 4);
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

TEST(WindowParts, EventsComeBackWhateverWasTyped) {
  const fs::path folder = test_folder("window-parts");
  append_event(folder / "new", {3, 0.1, "mark", "1"});
  append_event(folder / "new", {7, 0.25, "mark", "said \"here\", then\nlet go"});
  std::ofstream(folder / "new" / "events.csv", std::ios::app) << "nonsense\n,,,\nx,1,mark,y\n";
  append_event(folder / "new", {9, 0.3, "zero", "force_N=0.5"});
  const std::vector<Event> events = read_events(folder / "new");
  ASSERT_EQ(events.size(), 3u);
  EXPECT_EQ(events[0].frame, 3u);
  EXPECT_DOUBLE_EQ(events[1].time_s, 0.25);
  EXPECT_EQ(events[1].text, "said \"here\", then let go");
  EXPECT_EQ(events[2].kind, "zero");
  EXPECT_TRUE(read_events(folder / "nowhere").empty());
  fs::remove_all(folder);
}

TEST(SetupForm, LengthsAreTypedOrNotKnown) {
  EXPECT_EQ(typed_length(""), 0);
  EXPECT_EQ(typed_length("  "), 0);
  EXPECT_EQ(typed_length("2.92"), 2.92);
  EXPECT_EQ(typed_length(" 0,0593 "), 0.0593) << "a decimal comma";
  for (const char* none : {"0", "-1", "abc", "3 mm", "1.2.3", "nan", "inf"})
    EXPECT_FALSE(typed_length(none)) << none;
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

TEST(Words, StatesAreToldApartWithoutColour) {
  const Slip all[] = {Slip::Stick, Slip::Incipient, Slip::Slip, Slip::NoContact};
  for (const Slip a : all) {
    for (const Slip b : all) {
      if (a != b) {
        EXPECT_STRNE(slip_verdict(a).words, slip_verdict(b).words);
      }
    }
  }
  EXPECT_EQ(time_text(75.25), "1:15.2 min");
}

TEST(Words, SaturationIsShownWhereItMatters) {
  Touch t;
  t.saturated_px = 3;
  EXPECT_TRUE(saturation_matters(t)) << "of a gray sum alone nothing else is known";
  t.surface.emplace().validity = Validity::Valid;
  EXPECT_FALSE(saturation_matters(t));
  ContactTouch c;
  c.saturated_px = 3;
  EXPECT_FALSE(saturation_matters(c, t));
  t.surface->validity = Validity::Saturated;
  EXPECT_TRUE(saturation_matters(t));
  EXPECT_TRUE(saturation_matters(c, t));
  t.surface->validity = Validity::Valid;
  t.force_N.validity = c.force_N.validity = Validity::Valid;  // its interval holds what they hide
  EXPECT_FALSE(saturation_matters(t));
  EXPECT_FALSE(saturation_matters(c, t));
  t.force_N.validity = c.force_N.validity = Validity::Saturated;
  EXPECT_TRUE(saturation_matters(t));
  EXPECT_TRUE(saturation_matters(c, t));
}

TEST(KeyHelp, TheListAndTheFormHaveTheirOwn) {
  for (const auto* lines : {&start_key_help(), &setup_key_help()}) {
    std::string all;
    for (const KeyHelp& line : *lines) all += " " + line.keys + " ";
    for (const char* key : {"drop a file", "F11", "H, F1", "Esc"})
      EXPECT_NE(all.find(key), std::string::npos) << key;
  }
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

// Every signal by every model: range, curve and mark are what the touch itself reads, and the axis says what
// it counts.
TEST(CalibrationChart, EverySignalAndModelIsReadAlike) {
  const std::map<ForceSignal, std::string> names = {{ForceSignal::GraySum, "gray sum ["},
                                                    {ForceSignal::Area, "contact area ["},
                                                    {ForceSignal::Volume, "indented volume ["},
                                                    {ForceSignal::Gradient, "sum of gradients ["}};
  for (const auto& [signal, name] : names) {
    EXPECT_EQ(signal_axis(signal, 100).title.rfind(name, 0), 0u);
    EXPECT_NE(signal_axis(signal, 1e7).title.find("million"), std::string::npos);
    for (const ForceModel model : {ForceModel::Line, ForceModel::Power, ForceModel::Spline}) {
      ForceCalibration c;
      c.signal = signal;
      c.model = model;
      c.c1_N_per_gray = 4e-3;
      c.exponent = model == ForceModel::Power ? 1.5 : 1;
      if (model == ForceModel::Spline) c.knots = {{50, 0.1}, {400, 0.5}, {1000, 2}};
      c.gray_min = 50;
      c.gray_max = 1000;
      c.residual_sd_N = 0.01;
      const std::string of = std::string(to_string(signal)) + ", " + to_string(model);
      const auto touch_of = [&, signal = signal](double reading) {
        Touch touch;
        touch.contact = true;
        touch.gray_sum = signal == ForceSignal::GraySum ? reading : 7;
        touch.area_px = signal == ForceSignal::Area ? static_cast<uint64_t>(reading) : 7;
        touch.surface.emplace().volume_mm3 = signal == ForceSignal::Volume ? reading : 7;
        touch.gradient_sum = signal == ForceSignal::Gradient ? reading : 7;
        touch.force_N = force_of(c, force_features(touch));
        return touch;
      };
      EXPECT_NEAR(calibrated_range(c).least_N, touch_of(50).force_N.value, 1e-9) << of;
      EXPECT_NEAR(calibrated_range(c).most_N, touch_of(1000).force_N.value, 1e-9) << of;
      EXPECT_GT(calibrated_range(c).most_N, 1) << of;
      const std::vector<CurvePoint> curve = force_curve(c, Branch::Loading, 50, 1000, 2);
      EXPECT_NEAR(curve.back().force_N, touch_of(1000).force_N.value, 1e-9) << of;
      Touch touch = touch_of(400);
      std::vector<CalibrationMark> marks = force_marks(c, touch);
      ASSERT_EQ(marks.size(), 1u) << of;
      EXPECT_EQ(marks[0].signal, 400) << of;
      EXPECT_NEAR(marks[0].force_N.value, touch_of(400).force_N.value, 1e-12) << of;
      // Of two contacts neither has a volume or a sum of gradients of its own: the whole touch is marked.
      touch.contacts.resize(2);
      marks = force_marks(c, touch);
      const bool of_whole = signal == ForceSignal::Volume || signal == ForceSignal::Gradient;
      EXPECT_EQ(marks.size(), of_whole ? 1u : 0u) << of;
    }
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
  EXPECT_TRUE(shear_marks(shear, t, true).empty());  // the skin under each is not known
  shear.signal = ShearSignal::Centroid;
  ASSERT_EQ(shear_marks(shear, t, true).size(), 2u);
  EXPECT_EQ(shear_marks(shear, t, true)[0].signal, 0.1 * 3);
  // Of several contacts none has a volume of its own: the whole touch is marked.
  force.signal = ForceSignal::Volume;
  t.surface.emplace().volume_mm3 = 600;
  for (ContactTouch& c : t.contacts) c.force_N = {};
  ASSERT_EQ(force_marks(force, t).size(), 1u);
  EXPECT_EQ(force_marks(force, t)[0].id, 0u);
  EXPECT_EQ(force_marks(force, t)[0].signal, 600);
}

}  // namespace
}  // namespace palpate::viz
