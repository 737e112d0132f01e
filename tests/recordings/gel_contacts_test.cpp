// Contacts on recordings of a real gel with a gauge, of two days: one object is one contact. They are not
// part of the repository; the test says loudly when it is skipped.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <numbers>
#include <optional>
#include <set>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "capture/files/tables/gauge.h"
#include "capture/open_source.h"
#include "engine/gpu/context.h"
#include "palpate/pipeline.h"
#include "tests/recordings/wedge_clips.h"
#include "tests/support/pipelines.h"

namespace palpate {
namespace {

namespace fs = std::filesystem;

class GelContactRecordings : public WedgeClips {
 protected:
  GelContactRecordings() : WedgeClips("CONTACTS NOT CHECKED ON A REAL GEL") {}

  struct Counts {
    size_t pressed = 0, one = 0, untouched = 0, wrong = 0, ids = 0, saturated = 0;
  };
  static Counts follow(const fs::path& clip) {
    const Sensor sensor = load_sensor(shipped_sensor("gelsight_wedge"));
    const std::unique_ptr<Source> source = open_source(clip.string(), sensor);
    Pipeline pipeline(context(), for_rectified_frames(sensor), source->format(),
                      {.outputs = Output::Force | Output::Contacts});
    pipeline.set_background(load_background(clip.string(), sensor, *source));
    fs::path table = clip;
    const Gauge gauge = read_gauge(table.replace_extension(".csv"), GaugeColumns::Normal);
    // The gauge reads up to three frames late.
    const auto risen = std::ranges::find_if(gauge.force_N, [](double force_N) { return force_N > 0.3; });
    const auto onset = static_cast<size_t>(risen - gauge.force_N.begin());
    Counts counts;
    std::set<uint32_t> ids;
    Frame frame;
    for (size_t i = 0; source->next(frame) && i < gauge.force_N.size(); ++i) {
      const Touch touch = pipeline.process(frame).touch;
      for (const ContactTouch& contact : touch.contacts) ids.insert(contact.id);
      counts.saturated += touch.saturated_px > 0;
      if (gauge.force_N[i] > 1) {
        ++counts.pressed;
        counts.one += touch.contacts.size() == 1;
      } else if (i + 3 < onset) {
        ++counts.untouched;
        counts.wrong += !touch.contacts.empty();
      }
    }
    counts.ids = ids.size();
    return counts;
  }
};

TEST_F(GelContactRecordings, OneObjectIsOneContact) {
  Counts all;
  size_t followed = 0, few_ids = 0;
  for (const fs::path& file : both_days(3)) {
    const Counts c = follow(file);
    std::printf(
        "%-32s one contact in %3zu of %3zu frames above 1 N, %zu ids, wrong in %zu of %zu untouched\n",
        file.stem().c_str(), c.one, c.pressed, c.ids, c.wrong, c.untouched);
    all.pressed += c.pressed, all.one += c.one, all.untouched += c.untouched, all.wrong += c.wrong;
    ++followed;
    few_ids += c.ids <= 3;
  }
  const double one = static_cast<double>(all.one) / static_cast<double>(all.pressed);
  std::printf("%zu clips: %.1f %%, wrong in %zu of %zu untouched frames, at most 3 ids in %zu\n", followed,
              100 * one, all.wrong, all.untouched, few_ids);
  EXPECT_GE(one, 0.95);
  // The frames before the gauge moves already show the gripper's first touch.
  EXPECT_LE(static_cast<double>(all.wrong), 0.02 * static_cast<double>(all.untouched));
  EXPECT_EQ(few_ids, followed);
}

// The change of a press three halves as large, as harder presses and brighter lamps make it: bulges and rings
// around an object, and light at the pad's sides, are no contacts.
TEST_F(GelContactRecordings, OneObjectIsOneContactHoweverClear) {
  constexpr double kClearer = 1.5;
  const Sensor sensor = load_sensor(shipped_sensor("gelsight_wedge"));
  size_t pressed = 0, several = 0;
  for (const char* name : part_of<const char*>(
           {"gelsight_wedge_day2/rigid_strawberry", "gelsight_wedge_press/foam_brick_1",
            "gelsight_wedge_press/green_ball_softer_2", "gelsight_wedge_press/orange_ball_softest_1",
            "gelsight_wedge_press/purple_ball_hardest_1"},
           2)) {
    fs::path file = folder() / ".." / (std::string(name) + ".avi");
    if (!fs::exists(file)) continue;
    const std::unique_ptr<Source> source = open_source(file.string(), sensor);
    const Frame background = load_background(file.string(), sensor, *source);
    Pipeline pipeline(context(), for_rectified_frames(sensor), source->format(),
                      {.outputs = Output::Force | Output::Contacts});
    pipeline.set_background(background);
    const Gauge gauge = read_gauge(file.replace_extension(".csv"), GaugeColumns::Normal);
    Frame frame;
    size_t of_clip = 0, several_of_clip = 0;
    for (size_t i = 0; source->next(frame) && i < gauge.force_N.size(); ++i) {
      Frame clearer = background;
      for (size_t k = 0; k < clearer.bytes.size(); ++k) {
        const double rest = background.bytes[k];
        const double gray = rest + kClearer * (frame.pixels()[k] - rest);
        clearer.bytes[k] = static_cast<uint8_t>(std::clamp(std::lround(gray), 0l, 255l));
      }
      const Touch touch = pipeline.process(clearer).touch;
      if (gauge.force_N[i] <= 1) continue;
      ++of_clip;
      several_of_clip += touch.contacts.size() > 1;
    }
    std::printf("%-44s several contacts in %zu of %zu frames above 1 N\n", name, several_of_clip, of_clip);
    pressed += of_clip, several += several_of_clip;
  }
  ASSERT_GT(pressed, 0u);
  EXPECT_LE(static_cast<double>(several), 0.02 * static_cast<double>(pressed));
}

// A ball pressed all over a gel, each picture by itself, and the circles that its makers drew: the area in
// contact is theirs wherever it is, the area dented is larger.
TEST_F(GelContactRecordings, TheAreaInContactIsThatOfTheCircle) {
  const fs::path presses = folder() / "../gelsight-sim2real";
  std::ifstream circles(presses / "calib_res.txt");
  if (!circles) GTEST_SKIP() << "no presses at " << presses;
  Sensor sensor = load_sensor(shipped_sensor("gelsight_sim2real"));
  sensor.background.image = (presses / "background_real.png").string();
  std::vector<double> shares;
  std::optional<Pipeline> pipeline;
  for (std::string line; std::getline(circles, line);) {
    std::replace_if(
        line.begin(), line.end(), [](char c) { return c == '(' || c == ')' || c == ','; }, ' ');
    std::istringstream words(line);
    std::string name;
    double x = 0, y = 0, radius_px = 0;
    if (!(words >> name >> x >> y >> radius_px)) continue;
    const std::string file = (presses / name).string();
    const std::unique_ptr<Source> source = open_source(file, sensor);
    if (!pipeline) {
      pipeline.emplace(
          context(), sensor, source->format(),
          PipelineOptions{.outputs = Output::Force | Output::Contacts | Output::Surface, .separate = true});
      pipeline->set_background(load_background(file, sensor, *source));
    }
    Frame frame;
    ASSERT_TRUE(source->next(frame));
    const Touch touch = pipeline->process(frame).touch;
    ASSERT_EQ(touch.contacts.size(), 1u) << name;
    const double circle_mm2 = std::numbers::pi * std::pow(radius_px * sensor.pitch_mm_per_px, 2);
    shares.push_back(touch.area_mm2 / circle_mm2);
    EXPECT_GT(shares.back(), 0.65) << name;
    EXPECT_LT(shares.back(), 1.25) << name;
    EXPECT_GT(touch.surface->dented_mm2.value_or(0), 1.5 * touch.area_mm2) << name;
    EXPECT_NEAR(touch.centroid_x_px, x, 8) << name;
    EXPECT_NEAR(touch.centroid_y_px, y, 8) << name;
  }
  ASSERT_GT(shares.size(), 15u);
  double sum = 0, squares = 0;
  for (const double share : shares) sum += share, squares += share * share;
  const double mean = sum / static_cast<double>(shares.size());
  const double sd = std::sqrt(squares / static_cast<double>(shares.size()) - mean * mean);
  std::printf("area in contact over the drawn circle's, %zu presses: %.2f +- %.2f\n", shares.size(), mean,
              sd);
  EXPECT_NEAR(mean, 0.95, 0.12);
  EXPECT_LT(sd, 0.12);
}

// Two presses of two clips in one picture twice as wide. The aim is 95 %: what is missed are mainly a
// strawberry and a smooth ball, whose outline is that of the strawberry alone, and light presses beside
// strong ones.
TEST_F(GelContactRecordings, TwoObjectsSideBySideAreTwo) {
  const Sensor sensor = load_sensor(shipped_sensor("gelsight_wedge"));
  struct Clip {
    std::unique_ptr<Source> source;
    Frame background;
    Gauge gauge;
  };
  const auto open = [&](const std::string& name) {
    fs::path file = folder() / ".." / (name + ".avi");
    Clip clip{open_source(file.string(), sensor), {}, {}};
    clip.background = load_background(file.string(), sensor, *clip.source);
    clip.gauge = read_gauge(file.replace_extension(".csv"), GaugeColumns::Normal);
    return clip;
  };
  const auto side_by_side = [](const Frame& left, const Frame& right) {
    const uint32_t width = left.format.width;
    Frame both;
    both.reshape({2 * width, left.format.height, 3, 8});
    for (uint32_t c = 0; c < 3; ++c)
      for (uint32_t y = 0; y < left.format.height; ++y) {
        std::copy_n(left.row(c, y), width, both.row(c, y));
        std::copy_n(right.row(c, y), width, both.row(c, y) + width);
      }
    return both;
  };
  size_t pressed = 0, two = 0;
  using Pair = std::pair<const char*, const char*>;
  for (const auto& [a, b] : part_of(
           std::vector<Pair>{
               {"gelsight_wedge_press/golf_ball_1", "gelsight_wedge_press/purple_ball_hardest_1"},
               {"gelsight_wedge_press/green_ball_softer_2", "gelsight_wedge_press/golf_ball_2"},
               {"gelsight_wedge_day2/rigid_strawberry", "gelsight_wedge_day2/green_ball_softer"},
               {"gelsight_wedge_day2/golf_ball", "gelsight_wedge_day2/purple_ball_hardest"},
               {"gelsight_wedge_press/golf_ball_1", "gelsight_wedge_press/golf_ball_2"},
               {"gelsight_wedge_press/purple_ball_hardest_2", "gelsight_wedge_press/golf_ball_2"},
               {"gelsight_wedge_press/foam_brick_2", "gelsight_wedge_press/purple_ball_hardest_1"},
               {"gelsight_wedge_press/orange_ball_softest_1", "gelsight_wedge_press/golf_ball_1"},
               {"gelsight_wedge_day2/rigid_strawberry", "gelsight_wedge_day2/golf_ball"}},
           4)) {
    if (!fs::exists(folder() / ".." / (std::string(b) + ".avi"))) continue;
    Clip left = open(a), right = open(b);
    const Frame background = side_by_side(left.background, right.background);
    Sensor wide = for_rectified_frames(sensor);
    wide.size_px = {background.format.width, background.format.height};
    Pipeline pipeline(context(), wide, background.format,
                      {.outputs = Output::Force | Output::Contacts | Output::Surface});
    pipeline.set_background(background);
    Frame from_left, from_right;
    size_t of_pair = 0, two_of_pair = 0;
    for (size_t i = 0; left.source->next(from_left) && right.source->next(from_right); ++i) {
      const Touch touch = pipeline.process(side_by_side(from_left, from_right)).touch;
      if (i >= left.gauge.force_N.size() || i >= right.gauge.force_N.size()) break;
      if (left.gauge.force_N[i] <= 1 || right.gauge.force_N[i] <= 1) continue;
      ++of_pair;
      two_of_pair += touch.contacts.size() == 2;
    }
    std::printf("%-40s %-42s two contacts in %zu of %zu frames\n", a, b, two_of_pair, of_pair);
    pressed += of_pair, two += two_of_pair;
  }
  std::printf("two contacts in %zu of %zu frames with both above 1 N\n", two, pressed);
  ASSERT_GT(pressed, 0u);
  EXPECT_GE(static_cast<double>(two), 0.7 * static_cast<double>(pressed));
}

// Where nothing touches the surface is at rest: no tilt or bowl beside a press.
TEST_F(GelContactRecordings, TheSurfaceIsAtRestBesideAPress) {
  const Sensor sensor = load_sensor(shipped_sensor("gelsight_wedge"));
  const double margin_px = 3 / sensor.pitch_mm_per_px;
  constexpr double kNoise_mm = 0.01;  // of a press that is hardly seen
  size_t judged = 0;
  for (const fs::path& clip : both_days(4)) {
    const std::string name = clip.stem();
    const std::unique_ptr<Source> source = open_source(clip.string(), sensor);
    Pipeline pipeline(context(), for_rectified_frames(sensor), source->format(),
                      {.outputs = Output::Force | Output::Contacts | Output::Surface});
    // Without a surface a contact is its whole outline, not the part in contact.
    Pipeline outlines(context(), for_rectified_frames(sensor), source->format(),
                      {.outputs = Output::Force | Output::Contacts});
    for (Pipeline* each : {&pipeline, &outlines})
      each->set_background(load_background(clip.string(), sensor, *source));
    Frame frame;
    double deepest_mm = 0;
    std::vector<float> depth_mm;
    std::vector<ContactTouch> contacts;
    while (source->next(frame)) {
      ASSERT_TRUE(pipeline.submit(frame));
      const std::optional<Result> result = pipeline.wait();
      const Touch outline = outlines.process(frame).touch;
      if (result->touch.surface->depth_max_mm <= deepest_mm || result->touch.contacts.empty()) continue;
      deepest_mm = result->touch.surface->depth_max_mm;
      depth_mm = depth_map(*result);
      contacts = outline.contacts;
    }
    // Beyond a circle of each outline's area.
    std::vector<float> far_mm;
    for (uint32_t y = 0; y < frame.format.height; ++y)
      for (uint32_t x = 0; x < frame.format.width; ++x) {
        const bool near = std::ranges::any_of(contacts, [&](const ContactTouch& c) {
          const double radius_px = c.ellipse.major_mm / 2 / sensor.pitch_mm_per_px;
          return std::hypot(x - c.centroid_x_px, y - c.centroid_y_px) < radius_px + margin_px;
        });
        if (!near) far_mm.push_back(std::abs(depth_mm[size_t{y} * frame.format.width + x]));
      }
    // What is left of a gel that is covered belongs to the contact, whose circle it is beyond.
    if (10 * far_mm.size() < depth_mm.size()) {
      std::printf("%-40s covers the gel\n", name.c_str());
      continue;
    }
    std::ranges::nth_element(far_mm, far_mm.begin() + static_cast<std::ptrdiff_t>(far_mm.size() / 2));
    const double median_mm = double{far_mm[far_mm.size() / 2]};
    std::printf("%-40s deepest %.2f mm, median beside it %.3f mm (%.1f %%)\n", name.c_str(), deepest_mm,
                median_mm, 100 * median_mm / deepest_mm);
    EXPECT_LE(median_mm, std::max(0.03 * deepest_mm, kNoise_mm)) << name;
    ++judged;
  }
  EXPECT_GT(judged, 0u);
}

}  // namespace
}  // namespace palpate
