// Frames of a virtual camera, in every format and size, through the driver's own buffers.
#include <map>
#include <thread>

#include "capture/open_source.h"
#include "palpate/error.h"
#include "tests/v4l2/guest.h"

namespace palpate {
namespace {

constexpr const char* kBars = "100% Colorbar";  // eight bars of full colours

struct Size {
  const char* text;
  const char* rate;
  int frames;
};
constexpr Size kSizes[] = {
    {"320x180", "60", 8}, {"640x480", "25", 6}, {"1280x720", "12.5", 4}, {"1920x1080", "5", 3}};
const char* const kGray[] = {"GREY", "Y10", "Y12", "Y16", "NV12"};
const char* const kColour[] = {"YUYV", "UYVY", "RGGB8", "GRBG8", "GBRG8", "BGGR8", "RGB8", "BGR8"};

/// The colour in the middle of bar `i` of eight, red, green, blue (or gray thrice), as a fraction of full
/// scale.
std::array<double, 3> bar(const Frame& frame, uint32_t i) {
  const uint32_t x = frame.format.width * (2 * i + 1) / 16, y = frame.format.height / 2;
  std::array<double, 3> rgb{};
  for (uint32_t c = 0; c < 3; ++c)
    rgb[c] = double(frame.at(frame.format.channels == 3 ? c : 0, x, y)) / frame.format.max_gray();
  return rgb;
}

/// Frames of one format and size: in order, the bars where they belong, none lost unless told (a busy machine
/// may lose some).
void watch_bars(const char* format, const Size& size, const Sensor& sensor, Row& row,
                const std::function<void(const Frame&)>& check) {
  Camera camera(
      parse_camera(std::string("camera:0?format=") + format + "&size=" + size.text + "&fps=" + size.rate),
      sensor);
  Frame frame;
  for (int i = 0; i < size.frames; ++i) {
    ASSERT_TRUE(camera.next(frame));
    EXPECT_EQ(frame.sequence, uint64_t(i) + camera.counts().lost) << format << size.text;
    EXPECT_TRUE(frame.exposed_ns > 0 && frame.exposed_ns <= frame.delivered_ns) << format << size.text;
    // The driver's thread may wake late.
    EXPECT_NEAR(double(frame.time_ns), double(frame.sequence) * 1e9 / std::stod(size.rate), 200e6)
        << format << size.text;
    check(frame);
    ++row.frames;
  }
  fill_row(row, camera);
  EXPECT_EQ(row.size, std::string(size.text) + " px");
  EXPECT_LE(row.counts.lost, uint64_t(size.frames) / 5 + 2) << format << size.text;
  EXPECT_EQ(row.counts.damaged + row.counts.gaps, 0u) << format << size.text;
}

TEST_F(Guest, GrayOfEveryFormatAndSize) {
  Knobs(kFirst).choose("test_pattern", kBars);
  std::vector<const char*> formats(std::begin(kGray), std::end(kGray));
  formats.insert(formats.end(), std::begin(kColour), std::end(kColour));
  for (const char* format : formats) {
    const PixelFormat& known = *find_pixel_format(std::string_view(format));
    for (const Size& size : kSizes) {
      Row& r = row();
      r.camera = "webcam to gray";
      r.found = "bars white to black in order";
      // Video range or full range: drivers do as they like with gray.
      watch_bars(format, size, gray_sensor(known.bit_depth), r, [&](const Frame& frame) {
        EXPECT_GT(bar(frame, 0)[0], 0.9) << format << size.text;
        EXPECT_LT(bar(frame, 7)[0], 0.07) << format << size.text;
        for (uint32_t i = 1; i < 8; ++i)
          EXPECT_LT(bar(frame, i)[0], bar(frame, i - 1)[0]) << format << size.text << " bar " << i;
      });
      const bool leased = known.layout == PixelLayout::Gray8 || known.layout == PixelLayout::Gray16;
      EXPECT_EQ(r.copies.substr(0, 1), leased ? "0" : "1") << format;
    }
  }
}

TEST_F(Guest, ColourOfEveryFormatAndSize) {
  Knobs(kFirst).choose("test_pattern", kBars);
  constexpr double kColours[8][3] = {{1, 1, 1}, {1, 1, 0}, {0, 1, 1}, {0, 1, 0},
                                     {1, 0, 1}, {1, 0, 0}, {0, 0, 1}, {0, 0, 0}};
  for (const char* format : kColour) {
    for (const Size& size : kSizes) {
      Row& r = row();
      r.camera = "webcam to colour";
      r.found = "eight bars within 4 % of full scale";
      watch_bars(format, size, colour_sensor(), r, [&](const Frame& frame) {
        for (uint32_t i = 0; i < 8; ++i)
          for (int c = 0; c < 3; ++c)
            EXPECT_NEAR(bar(frame, i)[c], kColours[i][c], 0.04)
                << format << size.text << " bar " << i << " channel " << c;
      });
    }
  }
}

TEST_F(Guest, TheFormatIsChosenForTheSensor) {
  const std::pair<Sensor, const char*> cases[] = {{gray_sensor(8), "GREY"}, {gray_sensor(10), "Y10"},
                                                  {gray_sensor(12), "Y12"}, {gray_sensor(14), "Y16"},
                                                  {gray_sensor(16), "Y16"}, {colour_sensor(), "BGGR8"}};
  for (const auto& [sensor, format] : cases) {
    Camera camera(parse_camera("camera:0?size=320x180"), sensor);
    EXPECT_EQ(detail(camera, "format"), format);
    EXPECT_EQ(detail(camera, "rate"), "60 Hz");
  }
  const FrameFormat colour{640, 480, 3, 8};
  EXPECT_EQ(camera_format("camera:0"), colour);  // the largest size at 25 frames/s
  const FrameFormat deep{320, 180, 1, 12};
  EXPECT_EQ(camera_format("camera:/dev/video0?format=Y12&size=320x180"), deep);
}

TEST_F(Guest, AFractionalRateIsAskedForAndKept) {
  Camera camera(parse_camera("camera:0?format=GREY&size=320x180&fps=25/2"), gray_sensor());
  EXPECT_EQ(detail(camera, "rate"), "12.5 Hz");
  Frame frame;
  for (int i = 0; i < 20; ++i) ASSERT_TRUE(camera.next(frame));
  EXPECT_NEAR(double(frame.time_ns), double(frame.sequence) * 1e9 / 12.5, 200e6);
  EXPECT_EQ(camera.warning(), "");
}

TEST_F(Guest, CropsAreCutOutAndCostCopies) {
  Row& r = row();
  r.fault = "crop of the sensor";
  Knobs(kFirst).choose("test_pattern", kBars);
  Sensor sensor = gray_sensor();
  sensor.crop_px = {80, 10, 40, 20};  // within the third bar
  Camera camera(parse_camera("camera:0?format=GREY&size=320x180"), sensor);
  Frame frame;
  ASSERT_TRUE(camera.next(frame));
  EXPECT_EQ(frame.format.width, 40u);
  EXPECT_EQ(frame.leased, nullptr);
  for (uint32_t x = 1; x < 39; ++x) EXPECT_EQ(frame.at(0, x, 10), frame.at(0, 0, 0));
  r.frames = 1;
  fill_row(r, camera);
  EXPECT_EQ(r.copies[0], '2');
}

TEST_F(Guest, LeasesComeBackFromAnyThreadAndTwoBuffersStay) {
  Row& r = row();
  r.fault = "six frames held while more come";
  Camera camera(parse_camera("camera:0?format=GREY&size=320x180&fps=60"), gray_sensor());
  Knobs knobs(kFirst);
  knobs.turn("osd_text_mode", 0);  // a running clock in the picture: no two frames are alike
  std::vector<Frame> held;
  std::vector<std::vector<uint8_t>> copies;
  int leased = 0;
  for (int i = 0; i < 12; ++i) {
    Frame frame;
    ASSERT_TRUE(camera.next(frame));
    EXPECT_EQ(frame.sequence, uint64_t(i) + camera.counts().lost);
    leased += frame.leased != nullptr;
    EXPECT_EQ(frame.leased != nullptr, frame.pages != nullptr);
    copies.emplace_back(frame.pixels(), frame.pixels() + frame.format.frame_bytes());
    held.push_back(std::move(frame));
  }
  EXPECT_EQ(leased, 6);
  for (size_t i = 0; i < held.size(); ++i)
    EXPECT_TRUE(std::equal(copies[i].begin(), copies[i].end(), held[i].pixels())) << i;
  EXPECT_NE(copies[0], copies[11]);
  std::thread([&] { held.clear(); }).join();
  Frame frame;
  for (int i = 12; i < 40; ++i) {
    ASSERT_TRUE(camera.next(frame));
    EXPECT_EQ(frame.sequence, uint64_t(i) + camera.counts().lost);
    EXPECT_NE(frame.leased, nullptr) << i;
  }
  r.frames = 40;
  fill_row(r, camera);
  r.found = "6 leased; 6 copied; then all leased again";
  EXPECT_EQ(detail(camera, "copied frames").substr(0, 7), "6 of 40");
}

TEST_F(Guest, LeasesOutliveTheCamera) {
  row().fault = "camera closed while a frame is held";
  Frame held;
  std::vector<uint8_t> copy;
  {
    Camera camera(parse_camera("camera:0?format=GREY&size=320x180&fps=60"), gray_sensor());
    ASSERT_TRUE(camera.next(held));
    ASSERT_NE(held.leased, nullptr);
    copy.assign(held.pixels(), held.pixels() + held.format.frame_bytes());
  }
  Knobs(kFirst).choose("test_pattern", "100% White");
  {
    // The node is free at once, and what it does now is not seen in the old frame.
    Camera again(parse_camera("camera:0?format=GREY&size=320x180&fps=60"), gray_sensor());
    Frame frame;
    for (int i = 0; i < 20; ++i) ASSERT_TRUE(again.next(frame));
    EXPECT_NE(frame.at(0, 300, 90), held.at(0, 300, 90));
    rows_.back().frames = 20;
    fill_row(rows_.back(), again);
  }
  EXPECT_TRUE(std::equal(copy.begin(), copy.end(), held.pixels()));
}

TEST_F(Guest, ControlsAreSetReadBackAndLocked) {
  Row& r = row();
  r.fault = "gain was automatic";
  Knobs(kFirst).turn("gain_automatic", 1);
  {
    Camera camera(parse_camera("camera:0?size=320x180&gain=100&control.brightness=77"), gray_sensor());
    EXPECT_EQ(detail(camera, "control.gain_automatic"), "0");
    EXPECT_EQ(detail(camera, "control.gain"), "100");
    EXPECT_EQ(detail(camera, "control.brightness"), "77");
    EXPECT_EQ(Knobs(kFirst).read("gain"), 100);
    fill_row(r, camera);
    r.found = "gain 100 read back and locked";
  }
  Camera camera(parse_camera("camera:0?size=320x180&gain=auto"), gray_sensor());
  EXPECT_EQ(Knobs(kFirst).read("gain_automatic"), 1);
}

TEST_F(Guest, SignalsDoNotDisturb) {
  Row& r = row();
  r.fault = "a signal every 3 ms";
  struct sigaction quiet {};
  quiet.sa_handler = [](int) {};
  sigaction(SIGALRM, &quiet, nullptr);
  const itimerval often{{0, 3000}, {0, 3000}}, never{};
  setitimer(ITIMER_REAL, &often, nullptr);
  {
    Camera camera(parse_camera("camera:0?format=GREY&size=320x180&fps=60"), gray_sensor());
    Frame frame;
    for (int i = 0; i < 60; ++i) {
      ASSERT_TRUE(camera.next(frame));
      EXPECT_EQ(frame.sequence, uint64_t(i) + camera.counts().lost);
    }
    r.frames = 60;
    fill_row(r, camera);
  }
  setitimer(ITIMER_REAL, &never, nullptr);
}

TEST_F(Guest, TwoCamerasAtOnce) {
  reset(kSecond);
  Knobs(kFirst).choose("test_pattern", "100% Black");   // black
  Knobs(kSecond).choose("test_pattern", "100% White");  // white
  Row a, b;
  const auto stream = [](const char* input, uint32_t least, uint32_t most, Row& r) {
    Camera camera(parse_camera(input), gray_sensor());
    Frame frame;
    for (int i = 0; i < 60; ++i) {
      ASSERT_TRUE(camera.next(frame));
      EXPECT_EQ(frame.sequence, uint64_t(i) + camera.counts().lost);
      EXPECT_GE(frame.at(0, 100, 100), least);
      EXPECT_LE(frame.at(0, 100, 100), most);
    }
    r.frames = 60;
    fill_row(r, camera);
    r.fault = "two cameras at once";
  };
  std::thread second([&] { stream("camera:1?format=GREY&size=640x360&fps=40", 230, 255, b); });
  stream("camera:0?format=GREY&size=320x180&fps=60", 0, 16, a);
  second.join();
  row() = a;
  row() = b;
}

}  // namespace
}  // namespace palpate
