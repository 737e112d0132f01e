// Requested settings of a camera, as text and as a plan: options, controls, formats; numbers and times of
// frames.
#include <gtest/gtest.h>
#include <linux/videodev2.h>

#include <cmath>
#include <tuple>

#include "capture/camera/camera_clock.h"
#include "capture/camera/camera_options.h"
#include "capture/camera/frame_rate.h"
#include "capture/v4l2/camera_setup.h"
#include "palpate/error.h"

namespace palpate {
namespace {

using v4l2::Control;
using v4l2::ControlType;

TEST(CameraOptions, EveryKeyIsReadAndWritten) {
  const CameraOptions o = parse_camera(
      "camera:/dev/"
      "video3?format=Y16&size=1392x1042&fps=30000/"
      "1001&exposure=8ms&gain=12&white_balance=4500K&trigger=Line0&"
      "timeout=3s&"
      "buffers=5&control.brightness=-7");
  EXPECT_EQ(o.node, "/dev/video3");
  EXPECT_EQ(o.format, "Y16");
  EXPECT_EQ(o.width, 1392u);
  EXPECT_EQ(o.height, 1042u);
  EXPECT_EQ(o.rate_Hz, 30000.0 / 1001);
  EXPECT_EQ(o.exposure.value, 0.008);
  EXPECT_EQ(o.gain.value, 12);
  EXPECT_EQ(o.white_balance.value, 4500);
  EXPECT_EQ(o.trigger, "Line0");
  EXPECT_EQ(o.timeout_s, 3);
  EXPECT_EQ(o.buffers, 5u);
  ASSERT_EQ(o.controls.size(), 1u);
  EXPECT_EQ(o.controls[0], std::pair(std::string("brightness"), int64_t{-7}));
  const std::string text = to_string(o);
  EXPECT_EQ(to_string(parse_camera(text)), text);
  EXPECT_EQ(text,
            "camera:/dev/video3?format=Y16&size=1392x1042&fps=30000/"
            "1001&exposure=0.008s&gain=12&white_balance=4500&"
            "trigger=Line0&timeout=3s&buffers=5&control.brightness=-7");
  EXPECT_EQ(to_string(parse_camera("camera:")), "camera:");
  EXPECT_TRUE(is_camera("camera:0"));
  EXPECT_FALSE(is_camera("film.avi"));
}

TEST(CameraRates, AreTheFractionsThatAreMeant) {
  const std::tuple<double, uint32_t, uint32_t, const char*> cases[] = {
      {30, 30, 1, "30"},
      {7.5, 15, 2, "7.5"},
      {29.97, 30000, 1001, "29.97 (30000/1001)"},
      {29.9, 299, 10, "29.9"},
      {30000.0 / 1001, 30000, 1001, "29.97 (30000/1001)"},
      {24000.0 / 1001, 24000, 1001, "23.98 (24000/1001)"},
      {1e7 / 333667, 30000, 1001, "29.97 (30000/1001)"},  // as USB cameras say it, in steps of 100 ns
      {1e7 / 166833, 60000, 1001, "59.94 (60000/1001)"},
      {1e7 / 1333333, 15, 2, "7.5"},
      {1e7 / 333333, 30, 1, "30"},
      {0.1, 1, 10, "0.1"},
      {1000, 1000, 1, "1000"}};
  for (const auto& [rate_Hz, frames, seconds, text] : cases) {
    EXPECT_EQ(rate_fraction(rate_Hz), (RateFraction{frames, seconds})) << text;
    EXPECT_EQ(rate_text(rate_Hz), text);
  }
  EXPECT_EQ(parse_rate("15/2"), 7.5);
  EXPECT_EQ(parse_rate("7.5"), 7.5);
  for (const char* text : {"", "/", "30/", "/2", "1/0", "1/-2", "30000/1001x", "nan", "inf/2"})
    EXPECT_FALSE(parse_rate(text)) << text;
  EXPECT_EQ(to_string(parse_camera("camera:0?fps=7.5")), "camera:0?fps=7.5");
}

TEST(CameraRates, AnExposureLongerThanAFrameSaysWhatItAllows) {
  EXPECT_EQ(exposure_warning(0.05, 30), "an exposure of 50 ms allows at most 20 frames/s, not 30");
  EXPECT_EQ(exposure_warning(1001.0 / 30000, 30000.0 / 1001), "");
  EXPECT_EQ(exposure_warning(0.008, 30) + exposure_warning(0, 30) + exposure_warning(0.05, 0), "");
}

TEST(CameraRates, ARateThatIsNotKeptIsSaidOnceWithTheMeasuredOne) {
  const auto words = [](double promised_Hz, double rate_Hz, uint64_t step = 1) {
    RateWatch watch;
    watch.restart(promised_Hz);
    std::string said;
    for (uint64_t k = 0; k < 300; k += step)
      said += watch.add(k, std::llround(static_cast<double>(k) / rate_Hz * 1e9));
    return said;
  };
  EXPECT_EQ(words(30, 15), "the camera promises 30 frames/s and takes 15");
  EXPECT_EQ(words(30000.0 / 1001, 20), "the camera promises 29.97 (30000/1001) frames/s and takes 20");
  EXPECT_EQ(words(7.5, 10), "the camera promises 7.5 frames/s and takes 10");
  EXPECT_EQ(words(30, 30) + words(30, 29.5) + words(0, 15), "");
  EXPECT_EQ(words(30, 30, 2), "") << "what is lost on the way was taken";
  EXPECT_EQ(words(30, 0.5), "the camera promises 30 frames/s and takes 0.5") << "five frames at least";
}

TEST(CameraOptions, TimesHaveUnitsAndModesHaveNames) {
  EXPECT_EQ(parse_camera("camera:0?exposure=500us").exposure.value, 500e-6);
  EXPECT_EQ(parse_camera("camera:0?exposure=0.01s").exposure.value, 0.01);
  EXPECT_TRUE(parse_camera("camera:0?exposure=auto").exposure.automatic);
  EXPECT_TRUE(parse_camera("camera:0?gain=auto&white_balance=auto").white_balance.automatic);
  const CameraOptions locked = parse_camera("camera:0?exposure=locked&gain=locked");
  EXPECT_FALSE(locked.exposure.automatic || locked.exposure.value || locked.gain.value);
}

TEST(CameraOptions, NonsenseIsRefusedByName) {
  for (const char* text : {"exposure=8",     "exposure=-8ms",
                           "exposure=8m",    "exposure=ms",
                           "exposure=",      "exposure=nan s",
                           "size=640",       "size=0x480",
                           "size=640x480x3", "size=99999x1",
                           "fps=0",          "fps=fast",
                           "fps=30000/0",    "fps=1/x",
                           "fps=inf",        "gain=1.5",
                           "gain=high",      "white_balance=50",
                           "timeout=2",      "trigger=",
                           "buffers=2",      "buffers=99",
                           "control.=3",     "control.gain=x",
                           "colour=3",       "="}) {
    try {
      parse_camera(std::string("camera:0?") + text);
      ADD_FAILURE() << text;
    } catch (const Error& error) {
      EXPECT_EQ(error.failure(), Failure::Usage) << text;
      const std::string key = std::string(text).substr(0, std::string(text).find('='));
      EXPECT_NE(std::string(error.what()).find("'" + key + "'"), std::string::npos) << error.what();
      EXPECT_NE(std::string(error.what()).find("white_balance=4500"), std::string::npos) << error.what();
    }
  }
}

Control integer(uint32_t id, const char* name, int64_t least, int64_t most, int64_t step, int64_t value) {
  Control c;
  c.id = id;
  c.name = name;
  c.type = ControlType::Integer;
  c.least = least;
  c.most = most;
  c.step = step;
  c.value = value;
  return c;
}

/// Controls of webcams of the USB video class.
std::vector<Control> webcam() {
  std::vector<Control> list = {
      integer(V4L2_CID_BRIGHTNESS, "brightness", -64, 64, 1, 0),
      integer(V4L2_CID_AUTO_WHITE_BALANCE, "white_balance_automatic", 0, 1, 1, 1),
      integer(V4L2_CID_GAIN, "gain", 0, 100, 1, 20),
      integer(V4L2_CID_WHITE_BALANCE_TEMPERATURE, "white_balance_temperature", 2800, 6500, 10, 4600),
      integer(V4L2_CID_EXPOSURE_AUTO, "auto_exposure", 0, 3, 1, 3),
      integer(V4L2_CID_EXPOSURE_ABSOLUTE, "exposure_time_absolute", 3, 2047, 1, 250),
      integer(V4L2_CID_EXPOSURE_AUTO_PRIORITY, "exposure_dynamic_framerate", 0, 1, 1, 1),
      integer(V4L2_CID_FOCUS_AUTO, "focus_automatic_continuous", 0, 1, 1, 1)};
  list[4].type = ControlType::Menu;
  list[4].items = {{1, "Manual Mode"}, {3, "Aperture Priority Mode"}};
  for (const size_t i : {1u, 6u, 7u}) list[i].type = ControlType::Boolean;
  return list;
}

std::string plan(const std::string& options, const std::vector<Control>& there = webcam()) {
  std::string text;
  for (const ControlStep& step : plan_controls(there, parse_camera("camera:0?" + options)))
    text += step.name + "=" + std::to_string(step.value) + " ";
  return text;
}

TEST(CameraControls, NothingMovesUnlessItIsAskedTo) {
  const std::string locked =
      "auto_exposure=1 exposure_dynamic_framerate=0 white_balance_automatic=0 focus_automatic_continuous=0 ";
  EXPECT_EQ(plan(""), locked);
  EXPECT_EQ(plan("exposure=8ms&gain=7&white_balance=4504"),
            locked + "exposure_time_absolute=80 gain=7 white_balance_temperature=4500 ");
  EXPECT_EQ(plan("exposure=auto&white_balance=auto&control.brightness=-3"),
            "auto_exposure=3 white_balance_automatic=1 focus_automatic_continuous=0 brightness=-3 ");
  EXPECT_EQ(plan("exposure=350us"), locked + "exposure_time_absolute=4 ");
  EXPECT_EQ(plan("", {}), "");
}

TEST(CameraControls, TheExposureIsKnownWhereTheCameraDoesNotRuleIt) {
  std::vector<Control> there = webcam();
  EXPECT_EQ(exposure_s(there), 0) << "automatic";
  there[4].value = V4L2_EXPOSURE_MANUAL;
  EXPECT_EQ(exposure_s(there), 0.025);
  there.erase(there.begin() + 5);
  EXPECT_EQ(exposure_s(there), 0);
}

TEST(CameraControls, WhatIsNotThereIsNamed) {
  const auto refused = [](const std::string& options, const std::vector<Control>& there,
                          const std::string& words) {
    try {
      plan(options, there);
      ADD_FAILURE() << options;
    } catch (const Error& error) {
      EXPECT_EQ(error.failure(), Failure::Device);
      EXPECT_NE(std::string(error.what()).find(words), std::string::npos) << error.what();
    }
  };
  refused("exposure=1s", webcam(), "exposure_time_absolute at 10000; found a range from 3 to 2047 x 100 us");
  refused("exposure=100us", webcam(), "at 1; found a range from 3");
  refused("gain=101", webcam(), "gain at 101; found a range from 0 to 100");
  refused("white_balance=9000", webcam(), "from 2800 to 6500 x K");
  refused("gain=auto", webcam(), "gain by itself");
  refused("control.zoom=1", webcam(), "'zoom'");
  refused("exposure=8ms", {}, "no controls");
  refused("exposure=8ms", {integer(V4L2_CID_EXPOSURE, "exposure", 0, 1000, 1, 3)}, "control.exposure=N");
  refused("control.auto_exposure=2", webcam(), "auto_exposure at 2");
  std::vector<Control> fixed = webcam();
  fixed[2].read_only = true;
  refused("gain=3", fixed, "cannot be set");
}

std::vector<OfferedFormat> offer(const std::vector<const char*>& names) {
  std::vector<OfferedFormat> list;
  for (const char* name : names) {
    OfferedFormat format;
    format.known = find_pixel_format(std::string_view(name));
    list.push_back(format);
  }
  return list;
}

std::string best(const std::vector<const char*>& names, uint32_t channels, uint32_t bits) {
  const auto fitting = fitting_formats(offer(names), {channels, bits, {}});
  return fitting.empty() ? "none" : fitting.front()->name;
}

TEST(CameraFormats, TheBestForTheSensorIsChosen) {
  const std::vector<const char*> webcam = {"MJPEG", "YUYV"}, deep = {"GREY", "Y16", "Y10", "Y12"},
                                 every = {"MJPEG", "RGGB8", "NV12", "YUYV", "GREY", "Y16", "nobody's"};
  EXPECT_EQ(best(webcam, 1, 8), "YUYV");
  EXPECT_EQ(best(webcam, 3, 8), "YUYV");
  EXPECT_EQ(best({"MJPEG"}, 1, 8), "MJPEG");
  EXPECT_EQ(best(webcam, 1, 12), "none");
  EXPECT_EQ(best(deep, 1, 8), "GREY");
  EXPECT_EQ(best(deep, 1, 10), "Y10");
  EXPECT_EQ(best(deep, 1, 11), "Y12");
  EXPECT_EQ(best(deep, 1, 16), "Y16");
  EXPECT_EQ(best({"Y10", "GREY"}, 1, 12), "Y10");
  EXPECT_EQ(best(deep, 3, 8), "none");
  EXPECT_EQ(best(every, 1, 8), "GREY");
  EXPECT_EQ(best(every, 3, 8), "RGGB8");
  EXPECT_EQ(best({"NV12", "YUYV", "RGGB8"}, 1, 8), "NV12");
  // Nothing is known of the sensor: as much as the camera has.
  EXPECT_EQ(best(webcam, 0, 0), "YUYV");
  EXPECT_EQ(best(deep, 0, 0), "Y16");
}

TEST(CameraClock, SequenceGoesOnOverWrapAndRestart) {
  SequenceCounter counter;
  EXPECT_EQ(counter.next(UINT32_MAX - 1).sequence, 0u);
  EXPECT_EQ(counter.next(UINT32_MAX).sequence, 1u);
  const auto wrapped = counter.next(2);  // 0 and 1 are lost
  EXPECT_EQ(wrapped.sequence, 4u);
  EXPECT_EQ(wrapped.lost, 2u);
  EXPECT_EQ(counter.next(2).sequence, 5u);  // a driver that does not count
  EXPECT_EQ(counter.next(0).sequence, 6u);
  counter.restart(2, 30);
  const auto after = counter.next(7);
  EXPECT_EQ(after.sequence, 66u);
  EXPECT_EQ(after.lost, 0u);
  EXPECT_EQ(counter.next(8).sequence, 67u);
  counter.restart(0.001, 30);
  EXPECT_EQ(counter.next(0).sequence, 68u);  // never the same again
}

TEST(CameraClock, StampsAreBelievedOnlyWhereTheyCanBeTrue) {
  constexpr int64_t s = 1'000'000'000, ms = 1'000'000;
  FrameClock clock;
  const auto first = clock.next(100 * s, true, 100 * s + 5 * ms);
  EXPECT_EQ(first.time_ns, 0);
  EXPECT_EQ(first.exposed_ns, 100 * s);
  EXPECT_EQ(clock.next(100 * s + 20 * ms, true, 100 * s + 27 * ms).time_ns, 20 * ms);
  // Ahead of its delivery: the time of delivery less the usual way there.
  const auto future = clock.next(140 * s, true, 100 * s + 47 * ms);
  EXPECT_EQ(future.exposed_ns, 0);
  EXPECT_EQ(future.time_ns, 40 * ms);
  EXPECT_EQ(clock.next(80 * s, true, 100 * s + 67 * ms).exposed_ns, 0);
  EXPECT_EQ(clock.next(100 * s + 80 * ms, false, 100 * s + 87 * ms).exposed_ns, 0);
  EXPECT_EQ(clock.believed(), 2u);
  EXPECT_EQ(clock.refused(), 3u);
  // Never back.
  EXPECT_EQ(clock.next(100 * s + 10 * ms, true, 100 * s + 90 * ms).time_ns, 80 * ms + 1);
}

}  // namespace
}  // namespace palpate
