// The window in use: the program on a display of its own, with real key presses and mouse movements
// (xdotool); judged by what it writes, remembers and shows.

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>
#include <optional>
#include <thread>

#include "engine/base/text.h"
#include "tests/window/desktop.h"
#include "viz/look/theme.h"
#include "viz/render/layout.h"

namespace palpate {
namespace {

using viz::Layout;
using viz::ViewRect;

TEST_F(WindowTest, FromTheListToATouchAndBack) {
  ASSERT_EQ(run({"simulate", "press", "--mode", "gel", "--out", folder_, "--frames", "1"}).exit_code, 0);
  fs::rename(folder_ / "sensor.json", folder_ / "pad.json");
  open({});
  ASSERT_TRUE(titled("^palpate$"));
  Desktop::rest();
  const int typed_y = 638, first_recent_y = 130;
  // A sensor file is taken as such, wherever it is typed, and the list stays.
  desktop_->click(300, typed_y);
  EXPECT_TRUE(desktop_->tool("type --delay 20 " + (folder_ / "pad.json").string()));
  Desktop::rest();
  desktop_->key("Return");
  Desktop::rest();
  EXPECT_TRUE(desktop_->tool("search --name '^palpate$'"));
  desktop_->click(1200, 500);
  desktop_->click(273, 240);  // the second simulated touch
  ASSERT_TRUE(titled("palpate: synthetic:press"));
  const fs::path place = home() / "palpate" / "synthetic-press";
  EXPECT_TRUE(drawn(place));
  desktop_->key("m");
  EXPECT_TRUE(wait_for([&] { return contains(slurp(place / "events.csv"), ",mark,1"); }));
  const cv::Mat picture = cv::imread(place / "palpate-0001.png");
  EXPECT_EQ(picture.cols, 1280);
  EXPECT_EQ(picture.rows, 720);
  EXPECT_EQ(cv::imread(place / "palpate-0001-frame.png", cv::IMREAD_UNCHANGED).cols, 640);
  Table(slurp(place / "palpate-0001.csv")).expect_whole();

  desktop_->key("b");
  ASSERT_TRUE(titled("^palpate$"));
  Desktop::rest();
  // A file that is not there: one line in the window, and the list goes on, now with one card.
  desktop_->click(300, typed_y);
  EXPECT_TRUE(desktop_->tool("type --delay 20 /nowhere/touch.avi"));
  Desktop::rest();
  desktop_->key("Return");
  Desktop::rest();
  EXPECT_TRUE(desktop_->tool("search --name '^palpate$'"));
  EXPECT_TRUE(wait_for([&] {  // while it is looked for, clicks do nothing
    desktop_->click(100, first_recent_y);
    Desktop::rest();
    return desktop_->tool("search --name 'palpate: synthetic:press'");
  }));
  const Ended done = quit("Escape");
  EXPECT_EQ(done.exit_code, 0) << done.err;
  const Json kept = remembered();
  ASSERT_EQ(kept["recent"].size(), 1u);
  EXPECT_TRUE(contains(kept["recent"][0]["input"], "synthetic:press"));
  EXPECT_TRUE(contains(kept["recent"][0]["sensor"], "pad.json"));
  int thumbnails = 0;
  for (const auto& file : fs::directory_iterator(config().parent_path() / "thumbnails")) {
    const cv::Mat picture_of_source = cv::imread(file.path().string());
    EXPECT_EQ(picture_of_source.cols, 192);
    EXPECT_GT(cv::mean(picture_of_source)[1], 10) << "not black";
    ++thumbnails;
  }
  EXPECT_EQ(thumbnails, 1);
}

// The window stays, whoever opened it, and goes on with the same source.
TEST_F(WindowTest, ADeviceThatIsLostIsOpenedAnewBehindTheWindow) {
  open({}, 1280, 800,
       {{"VK_LAYER_PATH", PALPATE_LAYER_DIR},
        {"VK_INSTANCE_LAYERS", "VK_LAYER_PALPATE_failing"},
        {"PALPATE_FAIL_CALL", "vkQueueSubmit2"},
        {"PALPATE_FAIL_AT", "60"}});
  ASSERT_TRUE(titled("^palpate$"));
  Desktop::rest();
  desktop_->key("Return");  // the first simulated touch
  ASSERT_TRUE(drawn(home() / "palpate" / "synthetic-palpation"));
  ASSERT_TRUE(wait_for([&] { return contains(slurp(folder_ / "stderr"), "opened anew"); }));
  EXPECT_TRUE(titled("palpate: synthetic")) << "the source is still shown";
  const auto snapshots = [&] {
    return std::distance(fs::directory_iterator(home() / "palpate" / "synthetic-palpation"), {});
  };
  const auto before = snapshots();
  desktop_->key("s");
  EXPECT_TRUE(wait_for([&] { return snapshots() > before; }));
  const Ended done = quit();
  EXPECT_EQ(done.exit_code, 0) << done.err;
  EXPECT_TRUE(contains(done.err, "opened anew, the run goes on")) << done.err;
}

// What is written is what is shown; Shift + O begins it anew, with frames that came after it.
TEST_F(WindowTest, TheMapOfAnObjectIsWrittenAndBeginsAnew) {
  const fs::path out = folder_ / "out";
  open({"live", "synthetic:object?shape=relief&speed_mm_s=2&reach_mm=6&size=160x120&repeat=0", "--outputs",
        "force,surface,contacts,motion", "--out", out});
  ASSERT_TRUE(drawn(out));
  Json map;
  const auto mapped = [&](size_t keys, uint64_t after) {
    return wait_for([&] {
      desktop_->key("s");
      fs::path newest;
      for (const auto& entry : fs::directory_iterator(out))
        if (entry.path().string().ends_with("-map") && fs::exists(entry.path() / "map.json"))
          newest = std::max(newest, entry.path());
      if (newest.empty()) return false;
      map = parse_json(slurp(newest / "map.json"));
      const Json& found = map.at("pieces")[0].at("key_frames");
      return found.size() >= keys && found[0].at("frame") > after;
    });
  };
  ASSERT_TRUE(mapped(2, 0));
  const uint64_t last = map.at("pieces")[0].at("key_frames").back().at("frame");
  desktop_->key("shift+o");
  EXPECT_TRUE(mapped(1, last));
  EXPECT_EQ(map.at("pieces").size(), 1u) << "nothing of before";
  desktop_->key("shift+t");  // off
  const Ended done = quit();
  EXPECT_EQ(done.exit_code, 0) << done.err;
  EXPECT_EQ(remembered()["object_map"], false);
}

TEST_F(WindowTest, EveryKeyDoesWhatTheHelpSays) {
  open({"live", "synthetic:press?size=320x240&mode=gel&repeat=0", "--out", folder_ / "out"});
  ASSERT_TRUE(drawn(folder_ / "out"));
  desktop_->key("d o x l g y p k j n f bracketright");
  desktop_->key("ctrl+Right ctrl+Down");
  desktop_->key("h Escape i Escape");
  desktop_->key("c u ctrl+plus");
  const Ended done = quit();
  EXPECT_EQ(done.exit_code, 0) << done.err;
  const Json kept = remembered();
  EXPECT_EQ(kept["colours"], "pressure") << "by the gel's layer";
  EXPECT_EQ(kept["colour_map"], "cividis");
  EXPECT_EQ(kept["section"], true);
  for (const char* off : {"light", "grid", "axes", "charts", "contacts", "skin"})
    EXPECT_EQ(kept[off], false) << off;
  for (const char* on : {"rates", "controls", "light_theme"}) EXPECT_EQ(kept[on], true) << on;
  EXPECT_EQ(kept["skin_strain"], "off") << "this skin is not followed";
  EXPECT_EQ(kept["chart_span_s"], 30);
  EXPECT_NEAR(kept["section_line"][0], 0.09, 1e-9);
  EXPECT_NEAR(kept["section_line"][1], 0.51, 1e-9);
  EXPECT_NEAR(kept["text_scale"], 1.15, 1e-3);
}

TEST_F(WindowTest, AnActionIsFoundByItsName) {
  open({"live", "synthetic:press?size=320x240&mode=gel&repeat=0", "--out", folder_ / "out"});
  ASSERT_TRUE(drawn(folder_ / "out"));
  desktop_->key("ctrl+k");
  EXPECT_TRUE(desktop_->tool("type --delay 40 'map: magma'"));  // no key of the view meanwhile
  Desktop::rest();
  desktop_->key("Return");
  desktop_->key("ctrl+k");
  EXPECT_TRUE(desktop_->tool("type --delay 40 'text'"));
  Desktop::rest();
  desktop_->key("Down Down Return");  // a mark with one, larger text, smaller text
  desktop_->key("ctrl+k Escape");
  const Ended done = quit();
  EXPECT_EQ(done.exit_code, 0) << done.err;
  const Json kept = remembered();
  EXPECT_EQ(kept["colour_map"], "magma");
  for (const char* on : {"light", "grid", "axes"}) EXPECT_EQ(kept[on], true) << on;
  EXPECT_NEAR(kept["text_scale"], 1 / 1.15, 1e-3);
}

TEST_F(WindowTest, TheLastButtonIsHelpAndAKeyShowsThePerformance) {
  const fs::path out = folder_ / "out";
  open({"live", "synthetic:still?size=320x240", "--out", out});
  ASSERT_TRUE(drawn(out));
  const Layout layout = viz::make_layout({1280, 720}, 1, {320, 240, 1, 8}, true, {.tools = true});
  const int right = layout.tools.x + static_cast<int>(layout.tools.width);
  /// Until a picture has the ground of the window at a place, or something over it.
  int taken = 0;
  const auto comes = [&](const cv::Point& at, bool ground) {
    return wait_for([&] {
      desktop_->key("s");
      if (!exists(out / text("palpate-%04d.csv", ++taken))) return false;
      const auto pixel = cv::imread(out / text("palpate-%04d.png", taken)).at<cv::Vec3b>(at);
      const viz::Rgb wanted = viz::dark_theme().ground;
      return ground == (pixel == cv::Vec3b(wanted.blue, wanted.green, wanted.red));
    });
  };
  const ViewRect& surface = layout.surface;
  const cv::Point help(640, 360), overlay(surface.x + 16, surface.y + static_cast<int>(surface.height) - 32);
  EXPECT_TRUE(comes(help, true));
  desktop_->click(right - 32, layout.tools.y + 20);
  EXPECT_TRUE(comes(help, false));
  desktop_->key("Escape");
  EXPECT_TRUE(comes(help, true)) << "the help alone is closed";
  EXPECT_TRUE(comes(overlay, true));
  desktop_->key("f");
  EXPECT_TRUE(comes(overlay, false));
  desktop_->key("f");
  EXPECT_TRUE(comes(overlay, true));
  const Ended done = quit();
  EXPECT_EQ(done.exit_code, 0) << done.err;
}

TEST_F(WindowTest, SurfaceAndImageChangePlaces) {
  const fs::path out = folder_ / "out";
  open({"live", "synthetic:press?size=320x240&mode=gel&repeat=0", "--out", out});
  ASSERT_TRUE(drawn(out));
  const Layout swapped =
      viz::make_layout({1280, 720}, 1, {320, 240, 3, 8}, true, {.tools = true, .image_large = true});
  int taken = 0;
  const auto image_is_large = [&](bool wanted) {
    return wait_for([&] {
      desktop_->key("s");
      if (!exists(out / text("palpate-%04d.csv", ++taken))) return false;
      const cv::Point at(swapped.image.x + 4, swapped.image.y + static_cast<int>(swapped.image.height) / 2);
      const auto pixel = cv::imread(out / text("palpate-%04d.png", taken)).at<cv::Vec3b>(at);
      const viz::Rgb ground = viz::dark_theme().ground;
      return wanted == (pixel != cv::Vec3b(ground.blue, ground.green, ground.red));
    });
  };
  EXPECT_TRUE(image_is_large(false));
  desktop_->key("Tab");
  EXPECT_TRUE(image_is_large(true));
  desktop_->key("Tab");
  EXPECT_TRUE(image_is_large(false));
  desktop_->key("Tab shift+Tab shift+Tab Return shift+Tab");
  const Ended done = quit();
  EXPECT_EQ(done.exit_code, 0) << done.err;
  EXPECT_EQ(remembered()["image_large"], true);
  EXPECT_EQ(remembered()["arrangement"], "both equal");
}

TEST_F(WindowTest, TheSectionFollowsTheMouse) {
  fs::create_directories(config().parent_path());
  spill(config(),
        R"({"palpate_window": 1, "section": true, "controls": false, "width": 1000, "height": 640})");
  open({"live", "synthetic:press?size=320x240&mode=gel&repeat=0", "--out", folder_ / "out"});
  ASSERT_TRUE(drawn(folder_ / "out"));
  const Layout layout =
      viz::make_layout({1000, 640}, 1, {320, 240, 3, 8}, true, {.profile = true, .tools = true});
  const ViewRect& image = layout.image;
  const auto x = [&](double fraction) { return image.x + fraction * image.width; };
  const auto y = [&](double fraction) { return image.y + fraction * image.height; };
  desktop_->drag(x(0.08), y(0.5), x(0.3), y(0.2));
  const Ended done = quit();
  EXPECT_EQ(done.exit_code, 0) << done.err;
  const Json line = remembered()["section_line"];
  EXPECT_NEAR(line[0], 0.3, 0.02);
  EXPECT_NEAR(line[1], 0.2, 0.02);
  EXPECT_NEAR(line[2], 0.92, 1e-9) << "the other end stays";
  EXPECT_EQ(remembered()["width"], 1000);
}

TEST_F(WindowTest, ZeroMarkAndRecordAreWrittenWhereTheyBelong) {
  const fs::path out = folder_ / "out";
  open({"live", "synthetic:slide?size=320x240&repeat=0", "--out", out});
  ASSERT_TRUE(titled("palpate: synthetic"));
  // Zeroing takes a touch: until there is one.
  EXPECT_TRUE(wait_for([&] {
    desktop_->key("z");
    return contains(slurp(out / "events.csv"), ",zero,force_N=");
  }));
  desktop_->key("w");
  fs::path session;
  ASSERT_TRUE(wait_for([&] {
    for (const auto& entry : fs::directory_iterator(out))
      if (entry.path().filename().string().rfind("session-", 0) == 0) session = entry.path();
    return !session.empty();
  }));
  ASSERT_TRUE(wait_for([&] {  // two frames at least
    const std::string rows = slurp(session / "frames.csv");
    return std::count(rows.begin(), rows.end(), '\n') > 2;
  }));
  const auto logged = [&](const std::string& event) {
    return wait_for([&] { return contains(slurp(session / "events.csv"), event); });
  };
  desktop_->key("shift+m");
  EXPECT_TRUE(desktop_->tool("type --delay 40 'let go, q'"));  // no key of the view meanwhile
  desktop_->key("Return");
  EXPECT_TRUE(logged(",mark,\"let go, q\"")) << slurp(session / "events.csv");
  desktop_->key("shift+z");
  EXPECT_TRUE(logged(",zero ended,")) << slurp(session / "events.csv");
  desktop_->key("w");
  const Ended done = quit();
  EXPECT_EQ(done.exit_code, 0) << done.err;
  // Written values are as measured: the same digits again.
  const Ended again = run({"process", session, "--out", folder_ / "again", "--as-recorded"});
  EXPECT_EQ(again.exit_code, 0) << again.err;
}

TEST_F(WindowTest, DamagedSettingsAreOneLineAndDefaults) {
  fs::create_directories(config().parent_path());
  spill(config(), "{\"palpate_window\": 1, \"width\": ");
  open({"live", "synthetic:still?size=160x120", "--frames", "20", "--close"});
  const Ended done = ended();
  EXPECT_EQ(done.exit_code, 0) << done.err;
  EXPECT_TRUE(contains(done.err, "window.json")) << done.err;
  EXPECT_EQ(remembered()["width"], 1280);
}

TEST_F(WindowTest, AVideoWithoutASensorIsPlayed) {
  const fs::path film = folder_ / "press.avi";
  {
    cv::VideoWriter out(film, cv::CAP_FFMPEG, cv::VideoWriter::fourcc('M', 'J', 'P', 'G'), 25, {160, 120});
    for (int i = 0; i < 101; ++i) {
      cv::Mat picture(120, 160, CV_8UC3, cv::Scalar::all(40));
      cv::circle(picture, {80, 60}, i / 5, cv::Scalar::all(160), cv::FILLED);
      out.write(picture);
    }
  }
  open({"replay", film, "--speed", "0.02"});  // it does not end before it is held
  ASSERT_TRUE(titled("palpate: "));
  desktop_->key("space");
  const fs::path place = home() / "palpate" / (folder_.filename().string() + "-press.avi");
  const Layout layout =
      viz::make_layout({1280, 720}, 1, {160, 120, 3, 8}, false, {.player = true, .tools = true});
  ASSERT_TRUE(layout.has_charts);
  // The axis of the charts holds the whole film: a click in its middle is frame 50, or next to it.
  const double left = layout.charts.x + 52, right = layout.charts.x + layout.charts.width - 10.0;
  int marks = 0;
  const auto mark = [&] {
    desktop_->key("m");
    ++marks;
    std::string rows;
    EXPECT_TRUE(wait_for([&] {
      rows = slurp(place / "events.csv");
      return std::count(rows.begin(), rows.end(), '\n') == marks + 1;
    }));
    return std::stoi(Table(rows).at(static_cast<size_t>(marks) - 1, "frame"));
  };
  ASSERT_TRUE(drawn(place));
  // The frame is there when it has been sought and measured: marks until then.
  const auto comes_to = [&](int least, int most) {
    int at = mark();
    for (int i = 0; i < 100 && (at < least || at > most); ++i) at = mark();
    EXPECT_GE(at, least);
    EXPECT_LE(at, most);
    return at;
  };
  desktop_->click(static_cast<int>((left + right) / 2), layout.charts.y + 20);
  const int middle = comes_to(49, 51);
  desktop_->key("comma comma");
  comes_to(middle - 2, middle - 2);
  EXPECT_EQ(mark(), middle - 2) << "it stays";
  desktop_->key("Home");
  comes_to(0, 0);
  const Ended done = quit();
  EXPECT_EQ(done.exit_code, 0) << done.err;
}

TEST_F(WindowTest, AReplayedFrameIsShownAsStored) {
  const fs::path rec = folder_ / "rec";
  ASSERT_EQ(
      run({"record", "synthetic:press?size=320x240&mode=gel", "--out", rec, "--frames", "80"}).exit_code, 0);
  fs::create_directories(config().parent_path());
  spill(config(), R"({"palpate_window": 1, "section": true, "colour_map": "magma"})");
  open({"replay", rec, "--from", "2", "--out", folder_ / "out"});
  ASSERT_TRUE(titled("palpate: "));
  // On a slow machine keys wait for the first pictures: until a snapshot shows the last frame, at rest.
  std::string stem, frame;
  for (int attempt = 1; attempt <= 99 && (frame != "79" || attempt <= 2); ++attempt) {
    desktop_->key("End");
    std::this_thread::sleep_for(std::chrono::seconds(1));
    desktop_->key("s");
    stem = (folder_ / "out" / text("palpate-%04d", attempt)).string();
    ASSERT_TRUE(exists(stem + ".csv"));
    frame = Table(slurp(stem + ".csv")).at(0, "frame");
  }
  EXPECT_EQ(frame, "79");
  EXPECT_EQ(quit().exit_code, 0);
  const cv::Mat picture = cv::imread(stem + ".png");
  ASSERT_FALSE(picture.empty());
  // The surface and the raw image; rates, latencies and the charts' past differ from run to run.
  const Layout layout = viz::make_layout({1280, 720}, 1, {320, 240, 3, 8}, true,
                                         {.profile = true, .player = true, .tools = true});
  cv::Mat shown(picture.rows, picture.cols, picture.type(), cv::Scalar::all(0));
  for (const ViewRect& part : {layout.surface, layout.image}) {
    const cv::Rect rect(part.x, part.y, static_cast<int>(part.width), static_cast<int>(part.height));
    picture(rect).copyTo(shown(rect));
  }
  cv::resize(shown, shown, {}, 0.25, 0.25, cv::INTER_AREA);
  const fs::path file = fs::path(PALPATE_SOURCE_DIR) / "tests" / "data" / "window" / "replay.png";
  if (std::getenv("PALPATE_STORE_PICTURES")) {
    cv::imwrite(file, shown);
    GTEST_SKIP() << "stored " << file;
  }
  const cv::Mat stored = cv::imread(file);
  ASSERT_EQ(stored.size(), shown.size());
  cv::Mat difference;
  cv::absdiff(stored, shown, difference);
  cv::blur(difference, difference, {5, 5});
  double largest = 0;
  cv::minMaxLoc(difference.reshape(1), nullptr, &largest);
  const cv::Scalar mean = cv::mean(difference);
  EXPECT_LT((mean[0] + mean[1] + mean[2]) / 3, 2);
  EXPECT_LT(largest, 60);  // the mesh adapts to the machine's speed
}

}  // namespace
}  // namespace palpate
