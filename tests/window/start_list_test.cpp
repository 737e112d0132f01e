// The list of sources: what it offers, what may be typed or dropped, its thumbnails.
#include "viz/panels/start/start_list.h"

#include <gtest/gtest.h>
#include <stdlib.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <set>

#include "capture/sensors/shipped_sensors.h"
#include "capture/synthetic/object_options.h"
#include "capture/synthetic/synthetic.h"
#include "capture/synthetic/tissue.h"
#include "tests/support/eventually.h"
#include "viz/panels/start/thumbnails.h"

namespace palpate::viz {
namespace {

namespace fs = std::filesystem;

TEST(StartList, OffersEverySceneAndOpensEachEntry) {
  const Settings settings;
  const StartList list{settings};
  std::set<std::string> scenes;
  for (const SourceEntry& e : list.sources()) {
    if (e.group != SourceEntry::Group::Synthetic || e.input.empty()) continue;
    if (is_tissue(e.input)) {
      EXPECT_EQ(parse_tissue(e.input).repeat, 0u);
      EXPECT_EQ(e.name.rfind("lump ", 0), 0u);
      scenes.insert("tissue");
      continue;
    }
    if (is_object(e.input)) {
      EXPECT_EQ(parse_object(e.input).camera.repeat, 0u);
      scenes.insert("object");
      continue;
    }
    const SyntheticOptions options = parse_synthetic(e.input);
    scenes.insert(options.scene);
    EXPECT_EQ(options.repeat, 0u) << e.input << " goes on until it is closed";
    EXPECT_EQ(e.name, options.scene);
    const auto says = [&](const char* word) { return e.detail.find(word) != std::string::npos; };
    EXPECT_EQ(options.mode == SyntheticMode::Gel, says("gel")) << e.input;
    EXPECT_EQ(options.skin == SyntheticSkin::Markers, says("markers")) << e.input;
    EXPECT_EQ(options.skin == SyntheticSkin::Texture, says("textured")) << e.input;
    EXPECT_FALSE(e.whole.empty());
  }
  for (const auto& [scene, what] : synthetic_scenes()) EXPECT_TRUE(scenes.contains(scene)) << scene;
  EXPECT_TRUE(scenes.contains("tissue"));
  EXPECT_TRUE(scenes.contains("object"));
}

TEST(StartList, OffersTheSensorsThatComeWithTheProgram) {
  const Settings settings;
  StartList list{settings};
  ASSERT_TRUE(eventually([&] {
    list.update();
    return !list.looking();
  }));
  ASSERT_FALSE(shipped_sensors().empty());
  for (const fs::path& file : shipped_sensors())
    EXPECT_TRUE(std::any_of(list.sensors().begin(), list.sensors().end(), [&](const SensorEntry& e) {
      return e.usable && fs::equivalent(e.file.empty() ? "." : e.file, file);
    })) << file;
}

TEST(StartList, RecentSourcesComeFirst) {
  Settings settings;
  settings.recent = {{"/nowhere/press.avi", ""}, {"synthetic:slide", "pad.json", 4.9}};
  const StartList list{settings};
  ASSERT_GE(list.sources().size(), 4u);
  EXPECT_TRUE(list.sources()[0].missing);
  EXPECT_EQ(list.sources()[1].name, "synthetic:slide");
  EXPECT_NE(list.sources()[1].whole.find("pad.json"), std::string::npos);
  EXPECT_EQ(list.sources()[1].detail, "up to 4.9 N");
  EXPECT_NE(list.opened_with(1, 0).find("pad.json: as it was opened last"), std::string::npos);
  EXPECT_EQ(list.sources()[2].group, SourceEntry::Group::Cameras);
}

TEST(StartList, SimulatedTouchesShowTheirLargestForce) {
  StartList list{Settings{}};
  ASSERT_TRUE(eventually([&] {
    list.update();
    return !list.looking();
  }));
  size_t simulated = 0;
  for (const SourceEntry& e : list.sources()) simulated += e.group == SourceEntry::Group::Synthetic;
  EXPECT_EQ(list.simulated().size(), simulated - 3) << "tissue takes too long";
  std::map<std::string, const RgbImage*> pictures;
  for (const auto& [input, picture] : list.simulated()) {
    EXPECT_EQ(picture.width, kThumbnailWidth);
    EXPECT_EQ(picture.height, kThumbnailHeight);
    pictures[input] = &picture;
  }
  const auto brightest = [&](const char* input) {
    EXPECT_TRUE(pictures.contains(input)) << input;
    return pictures.contains(input) ? int{std::ranges::max(pictures[input]->rgb)} : 0;
  };
  const int touched = brightest("synthetic:press?repeat=0"),
            untouched = brightest("synthetic:still?repeat=0");
  EXPECT_GT(touched, 1.5 * untouched);
}

TEST(StartList, MessagesNameWhatIsSeenInTheWindow) {
  for (const char* message :
       {"the sensor of this session, which needs no --sensor; expected",
        "give an image without touch (--background), else", "no --fps; a fixed --exposure"})
    EXPECT_EQ(in_the_window(message).find("--"), std::string::npos) << in_the_window(message);
  EXPECT_EQ(in_the_window("nothing at 'a--b.avi'"), "nothing at 'a--b.avi'");
}

class Thumbnails : public ::testing::Test {
 protected:
  Thumbnails() : folder_(fs::temp_directory_path() / ("palpate-thumbnails-" + std::to_string(::getpid()))) {
    fs::create_directories(folder_);
    if (const char* before = std::getenv("PALPATE_CONFIG")) before_ = before;
    ::setenv("PALPATE_CONFIG", (folder_ / "window.json").c_str(), 1);
  }
  ~Thumbnails() override {
    fs::remove_all(folder_);
    before_.empty() ? ::unsetenv("PALPATE_CONFIG") : ::setenv("PALPATE_CONFIG", before_.c_str(), 1);
  }
  fs::path folder_;
  std::string before_;
};

TEST_F(Thumbnails, ComeBackAndGoWithTheirSources) {
  Frame frame;
  frame.reshape({320, 120, 3, 8});
  for (uint32_t y = 0; y < 120; ++y)
    for (uint32_t x = 0; x < 320; ++x) frame.set(0, x, y, x < 160 ? 200 : 10);
  Settings settings;
  settings.recent = {{"a.avi", ""}};
  keep_thumbnail("a.avi", thumbnail_of(frame), settings);
  const auto a = load_thumbnail("a.avi");
  ASSERT_TRUE(a);
  EXPECT_EQ(a->at(40, 72)[0], 200);
  EXPECT_EQ(a->at(160, 72)[0], 10);
  EXPECT_EQ(a->at(40, 72)[1], 0);
  EXPECT_EQ(a->at(40, 4)[1], 24) << "beside a wide frame";
  settings.recent = {{"b.avi", ""}};
  keep_thumbnail("b.avi", thumbnail_of(frame), settings);
  EXPECT_TRUE(load_thumbnail("b.avi"));
  EXPECT_FALSE(load_thumbnail("a.avi")) << "no longer remembered";
  std::ofstream(thumbnail_file("b.avi")) << "nonsense";
  EXPECT_FALSE(load_thumbnail("b.avi"));
}

TEST_F(Thumbnails, DeepGrayFramesKeepTheirBrightness) {
  Frame frame;
  frame.reshape({40, 30, 1, 12});
  for (uint32_t y = 0; y < 30; ++y)
    for (uint32_t x = 0; x < 40; ++x) frame.set(0, x, y, 100 * 16);
  const RgbImage picture = thumbnail_of(frame);
  for (int c = 0; c < 3; ++c) EXPECT_EQ(picture.at(96, 72)[c], 100);
}

}  // namespace
}  // namespace palpate::viz
