// A look through a camera from its card in the list of sources; simulated sensors stand for cameras.
#include "viz/panels/start/camera_look.h"

#include <gtest/gtest.h>
#include <imgui.h>

#include <algorithm>

#include "capture/open_source.h"
#include "capture/run/input.h"
#include "palpate/error.h"
#include "tests/support/eventually.h"
#include "tests/support/gpu_fixture.h"
#include "viz/panels/start/card_grid.h"
#include "viz/panels/start/start_list.h"
#include "viz/panels/start/thumbnails.h"

namespace palpate::viz {
namespace {

/// What a test sees of the camera: how often it was opened and closed.
struct Uses {
  std::atomic<int> opened{0}, closed{0};
};

class Watched : public Source {
 public:
  Watched(std::unique_ptr<Source> inner, Uses& uses) : inner_(std::move(inner)), uses_(uses) {
    ++uses_.opened;
  }
  ~Watched() override { ++uses_.closed; }
  FrameFormat format() const override { return inner_->format(); }
  double rate_Hz() const override { return inner_->rate_Hz(); }
  std::optional<uint64_t> frame_count() const override { return inner_->frame_count(); }
  bool next(Frame& frame) override { return inner_->next(frame); }
  void watch(const std::function<bool()>& cancelled) override { inner_->watch(cancelled); }

 private:
  std::unique_ptr<Source> inner_;
  Uses& uses_;
};

TEST(CameraLook, ShowsWhatTheCameraSeesUntilItEnds) {
  Uses uses;
  CameraLook look([&](const std::string& input) {
    return std::make_unique<Watched>(open_source(input, bare_sensor(input)), uses);
  });
  EXPECT_FALSE(look.update());
  EXPECT_EQ(uses.opened, 0) << "nobody has asked";
  const std::string endless = "synthetic:press?mode=gel&size=160x120&repeat=0";
  look.start(endless);
  EXPECT_EQ(look.input(), endless);
  ASSERT_TRUE(eventually([&] { return look.update(); }));
  ASSERT_TRUE(look.picture()) << look.trouble();
  EXPECT_EQ(look.picture()->width, kThumbnailWidth);
  EXPECT_EQ(look.picture()->height, kThumbnailHeight);
  const std::vector<uint8_t> first = look.picture()->rgb;
  EXPECT_TRUE(eventually([&] { return look.update() && look.picture()->rgb != first; })) << "it goes on";
  look.start("synthetic:still?size=160x120&repeat=0");
  EXPECT_EQ(uses.closed, 1) << "the one before is closed first";
  look.stop();
  EXPECT_EQ(uses.opened, 2);
  EXPECT_EQ(uses.closed, 2);
  EXPECT_TRUE(look.input().empty());
  EXPECT_FALSE(look.picture());
}

TEST(CameraLook, SaysWhyThereIsNoPicture) {
  CameraLook look([](const std::string& input) -> std::unique_ptr<Source> {
    if (input == "in use") throw Error(Failure::Device, "a camera", "it in use by another", "closing that");
    return open_source(input, bare_sensor(input));
  });
  look.start("in use");
  ASSERT_TRUE(eventually([&] { return look.update(); }));
  EXPECT_EQ(look.trouble(), "wanted a camera; found it in use by another; try closing that");
  EXPECT_FALSE(look.picture());
  look.start("synthetic:press?size=160x120&frames=3");
  EXPECT_TRUE(look.trouble().empty());
  ASSERT_TRUE(eventually([&] {
    look.update();
    return !look.trouble().empty();
  }));
}

TEST(StartList, ACameraComesWithWhatItWasOpenedWithLast) {
  using Group = SourceEntry::Group;
  std::vector<SourceEntry> cameras{{Group::Cameras, "camera:/dev/video0", "one", "", ""},
                                   {Group::Cameras, "camera:/dev/video2", "two", "", ""},
                                   {Group::Cameras, "", "no camera found", "", ""}};
  StartList::remember_last_use(cameras, {{"press.avi", "press.json", 0},
                                         {"camera:/dev/video0?fps=60", "pad.json", 0},
                                         {"camera:/dev/video0", "older.json", 0}});
  EXPECT_EQ(cameras[0].sensor, "pad.json");
  EXPECT_EQ(cameras[0].still, "camera:/dev/video0?fps=60");
  EXPECT_TRUE(cameras[1].sensor.empty() && cameras[1].still.empty());
  EXPECT_TRUE(cameras[2].still.empty());
}

class CameraCard : public GpuTest {};

TEST_F(CameraCard, HasALivePictureAndAButtonThatDoesNotOpenIt) {
  RenderPass pass(context(), OffscreenTarget::kFormat, VK_SAMPLE_COUNT_1_BIT,
                  VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL);
  HudFrame frame(context(), pass, 1, nullptr, 1);
  RgbImage live{kThumbnailWidth, kThumbnailHeight, {}};
  for (uint32_t i = 0; i < kThumbnailWidth * kThumbnailHeight; ++i)
    live.rgb.insert(live.rgb.end(), {201, 102, 53});
  CardGrid grid;
  bool coloured = false;
  ImVec2 first, second;
  const auto picture = [&](ImVec2 mouse, bool down) {
    CardClick click = CardClick::Nothing;
    ImGui::GetIO().MousePos = mouse;
    ImGui::GetIO().MouseDown[0] = down;
    frame.begin({800, 600});
    ImGui::SetNextWindowPos({0, 0});
    ImGui::SetNextWindowSize({800, 600});
    ImGui::Begin("page");
    grid.begin(frame, 700);
    first = ImGui::GetCursorScreenPos();
    click = grid.add({"camera", "detail", {}, false, true, &live, "", "Look (L)"}, false, false, "");
    second = ImGui::GetItemRectMax();
    grid.add({"other", "detail", {}}, false, false, "");
    const ImDrawList* list = ImGui::GetWindowDrawList();
    coloured = std::any_of(list->VtxBuffer.begin(), list->VtxBuffer.end(),
                           [](const ImDrawVert& v) { return v.col == IM_COL32(201, 102, 53, 255); });
    ImGui::End();
    frame.abandon();
    return click;
  };
  picture({1, 1}, false);
  picture({1, 1}, false);
  EXPECT_TRUE(coloured);
  const auto click = [&](ImVec2 at) {
    CardClick found = CardClick::Nothing;
    for (const bool down : {false, false, true, true, false, false})
      if (const CardClick one = picture(at, down); one != CardClick::Nothing) found = one;
    return found;
  };
  EXPECT_EQ(click({second.x - 30, first.y + 20}), CardClick::Button);
  EXPECT_EQ(click({first.x + 20, second.y - 20}), CardClick::Card);
  EXPECT_EQ(grid.neighbour(0, 1, 0), 1u);
}

}  // namespace
}  // namespace palpate::viz
