#include "engine/stages/frame/regions.h"

#include <opencv2/imgproc.hpp>
#include <random>
#include <set>

#include "engine/gpu/commands.h"
#include "tests/reference/regions.h"
#include "tests/support/gpu_fixture.h"
#include "tests/support/stage_run.h"

namespace palpate {
namespace {

struct RegionsAnswer {
  bool complete = false;
  std::vector<Region> regions;
  ContactMoments all;
};

/// One format and sensor: kernels are compiled once for any number of frames.
class RegionsRun {
 public:
  RegionsRun(gpu::Context& context, const FrameFormat& format, const Sensor& sensor, const Tuning& tuning)
      : contact_(context, sensor, format, false, tuning, true),
        regions_(context, contact_, format),
        images_(context, format),
        records_(context, "records", contact_.record_bytes(), gpu::Memory::Readback),
        slot_(regions_.slot(context)),
        commands_(context) {
    commands_.begin();
    images_.record(commands_);
    contact_.record(commands_, images_.frame, images_.background, records_);
    regions_.record(commands_, images_.frame, images_.background, records_, slot_);
    commands_.host_barrier();
    commands_.end();
  }

  RegionsAnswer operator()(const Frame& image, const Frame& rest) {
    images_.write(image, rest);
    Regions::start(slot_);
    commands_.submit();
    commands_.wait();
    records_.invalidate();
    RegionsAnswer answer;
    const auto records = records_.as<const shared::ContactRecord>();
    answer.all = contact_.sum(records);
    answer.complete = regions_.find(slot_, records, answer.regions);
    return answer;
  }
  uint32_t capacity() const { return regions_.capacity(); }

 private:
  Contact contact_;
  Regions regions_;
  FrameOnGpu images_;
  gpu::DeviceBuffer records_;
  Regions::Slot slot_;
  gpu::Commands commands_;
};

std::string described(const Region& r) {
  const ContactMoments& m = r.moments;
  return "box " + std::to_string(r.box.x) + " " + std::to_string(r.box.y) + " " +
         std::to_string(r.box.width) + " " + std::to_string(r.box.height) + " area " +
         std::to_string(m.area) + " gray " + std::to_string(m.gray) + " saturated " +
         std::to_string(m.saturated) + " border " + std::to_string(m.border);
}

// By place, so that the order of tiles does not matter.
void sort(std::vector<Region>& regions) {
  std::ranges::sort(regions, [](const Region& a, const Region& b) {
    return std::tuple(a.box.y, a.box.x, a.moments.x, a.moments.y, a.moments.area, a.box.width) <
           std::tuple(b.box.y, b.box.x, b.moments.x, b.moments.y, b.moments.area, b.box.width);
  });
}

void expect_equal(std::vector<Region> got, std::vector<Region> wanted, const std::string& scene) {
  ASSERT_EQ(got.size(), wanted.size()) << scene;
  sort(got);
  sort(wanted);
  for (size_t i = 0; i < got.size(); ++i) {
    ASSERT_EQ(got[i].moments, wanted[i].moments) << scene << "\n"
                                                 << described(got[i]) << "\n"
                                                 << described(wanted[i]);
    ASSERT_EQ(got[i].box, wanted[i].box) << scene << "\n"
                                         << described(got[i]) << "\n"
                                         << described(wanted[i]);
  }
}

// The sums of all regions are those of the whole contact, to the last bit.
void expect_sum(const RegionsAnswer& answer, const std::string& scene) {
  ContactMoments sum;
  for (const Region& region : answer.regions) {
    const ContactMoments& m = region.moments;
    sum.area += m.area;
    sum.gray += m.gray;
    sum.gray_x += m.gray_x;
    sum.gray_y += m.gray_y;
    sum.x += m.x;
    sum.y += m.y;
    sum.xx += m.xx;
    sum.xy += m.xy;
    sum.yy += m.yy;
    sum.peak = std::max(sum.peak, m.peak);
    sum.border = sum.border || m.border;
  }
  sum.saturated = answer.all.saturated;  // counts what is no contact too
  EXPECT_EQ(sum, answer.all) << scene;
}

Sensor plain_sensor(const FrameFormat& format) {
  Sensor sensor;
  sensor.name = "plain";
  sensor.pitch_mm_per_px = 0.1;
  sensor.channels = format.channels;
  sensor.bit_depth = format.bit_depth;
  sensor.saturation_gray = format.max_gray();
  sensor.threshold_gray = format.max_gray() / 2.0;
  sensor.filter = Filter::None;
  sensor.background.kind = BackgroundKind::None;
  return sensor;
}

class RegionsTest : public GpuTest {
 protected:
  static RegionsAnswer run(const Frame& image, const Frame& rest, const Sensor& sensor) {
    return RegionsRun(context(), image.format, sensor, default_tuning(context()))(image, rest);
  }
};

// Random frames of all sizes, depths, signals, filters: regions and their sums equal the reference's.
TEST_F(RegionsTest, RandomFramesEqualReferenceExactly) {
  std::mt19937 random(11);
  const std::array<uint32_t, 12> sides{1, 2, 3, 5, 15, 16, 17, 31, 33, 64, 67, 129};
  const auto pick = [&](const auto& list) { return list[random() % list.size()]; };
  for (int i = 0; i < 10 && !HasFatalFailure(); ++i) {
    const bool color = i % 5 == 4;
    const FrameFormat format{pick(sides), pick(sides), color ? 3u : 1u,
                             color ? 8 : pick(std::array<uint32_t, 4>{8, 8, 12, 16})};
    Sensor sensor = plain_sensor(format);
    sensor.filter = pick(std::array{Filter::Binomial5, Filter::None});
    sensor.background.kind = pick(std::array{BackgroundKind::Untouched, BackgroundKind::None});
    const bool subtracts = sensor.background.kind == BackgroundKind::Untouched;
    sensor.signal =
        subtracts ? pick(std::array{Signal::Brighter, Signal::Darker, Signal::Either}) : Signal::Brighter;
    const uint32_t top = format.max_gray();
    sensor.saturation_gray = pick(std::array<uint32_t, 4>{top, top, top * 3 / 4, 1});
    // Filtered noise gathers about its mean: thresholds on both sides of it.
    sensor.threshold_gray = top * pick(std::array{0.0, 0.2, 0.3, 0.45, 0.5, 0.55, 0.8, 0.95});
    RegionsRun gpu(context(), format, sensor, default_tuning(context()));
    for (int frame = 0; frame < 30; ++frame) {
      const Frame image = random_frame(format, 0, top, random);
      const Frame rest = random_frame(format, 0, subtracts ? top / 4 : 0, random);
      const std::string scene = std::to_string(format.width) + "x" + std::to_string(format.height) + "x" +
                                std::to_string(format.channels) + " bits " +
                                std::to_string(format.bit_depth) + " filter " + to_string(sensor.filter) +
                                " signal " + to_string(sensor.signal) + " threshold " +
                                std::to_string(sensor.threshold_gray);
      const RegionsAnswer answer = gpu(image, rest);
      ASSERT_TRUE(answer.complete) << scene;
      ASSERT_NO_FATAL_FAILURE(expect_equal(answer.regions, reference::regions(image, rest, sensor), scene));
      expect_sum(answer, scene);
    }
  }
}

// Spirals, combs, checkerboards, diagonals, rings: shapes that a fill has to follow far, within tiles and
// across them, as reference and OpenCV see them.
TEST_F(RegionsTest, ShapesEqualReferenceAndOpenCv) {
  using Shape = bool (*)(int x, int y);
  const std::pair<const char*, Shape> shapes[] = {
      {"checkerboard", [](int x, int y) { return (x + y) % 2 == 0; }},
      {"loose dots", [](int x, int y) { return x % 2 == 0 && y % 2 == 0 && (x / 2 + y / 2) % 3 != 0; }},
      {"comb", [](int x, int y) { return x % 2 == 0 || y == 0; }},
      {"comb upside down", [](int x, int y) { return x % 2 == 0 || y == 99; }},
      {"serpent", [](int x, int y) { return x % 2 == 0 || y == (x / 2 % 2 == 0 ? 0 : 99); }},
      {"lying serpent", [](int x, int y) { return y % 2 == 0 || x == (y / 2 % 2 == 0 ? 0 : 116); }},
      {"diagonals", [](int x, int y) { return (x + y) % 3 == 0; }},
      {"counterdiagonals", [](int x, int y) { return (x - y + 300) % 3 == 0; }},
      {"rings", [](int x, int y) { return std::max(std::abs(x - 58), std::abs(y - 50)) % 2 == 0; }},
      {"spiral",
       [](int x, int y) {
         const int dx = x - 58, dy = y - 50;
         const double turn = std::atan2(dy, dx) / 6.283185307;
         return std::fmod(std::hypot(dx, dy) / 6 + turn + 10, 1.0) < 0.5;
       }},
      {"corners of tiles",
       [](int x, int y) { return (x % 32 == 31 && y % 32 == 31) || (x % 32 == 0 && y % 32 == 0); }},
      {"other corners",
       [](int x, int y) { return (x % 32 == 0 && y % 32 == 31) || (x % 32 == 31 && y % 32 == 0); }},
      {"all", [](int, int) { return true; }},
      {"none", [](int, int) { return false; }}};
  for (const uint32_t bits : {8u, 16u}) {
    const FrameFormat format{117, 100, 1, bits};
    const Sensor sensor = plain_sensor(format);
    for (const uint32_t rows : {8u, 34u, 64u}) {
      Tuning tuning = default_tuning(context());
      tuning.contact_tiles = rows == 8;  // a workgroup's
      tuning.contact_rows = rows;
      RegionsRun gpu(context(), format, sensor, tuning);
      const Frame black = uniform_frame(format, 0);
      for (const auto& [name, shape] : shapes) {
        Frame image = black;
        cv::Mat mask(100, 117, CV_8U, cv::Scalar(0)), labels, stats, centers;
        for (uint32_t y = 0; y < format.height; ++y) {
          for (uint32_t x = 0; x < format.width; ++x) {
            if (!shape(static_cast<int>(x), static_cast<int>(y))) continue;
            image.set(0, x, y, format.max_gray() - (x * 7 + y * 13) % 100);
            mask.at<uint8_t>(static_cast<int>(y), static_cast<int>(x)) = 255;
          }
        }
        const std::string scene =
            std::string(name) + ", " + std::to_string(bits) + " bits, tiles of " + std::to_string(rows);
        const RegionsAnswer answer = gpu(image, black);
        ASSERT_TRUE(answer.complete) << scene;
        ASSERT_NO_FATAL_FAILURE(
            expect_equal(answer.regions, reference::regions(image, black, sensor), scene));
        expect_sum(answer, scene);
        const int count = cv::connectedComponentsWithStats(mask, labels, stats, centers, 8);
        ASSERT_EQ(answer.regions.size(), static_cast<size_t>(count - 1)) << scene;
        std::multiset<std::array<int, 5>> ours, theirs;
        for (const Region& r : answer.regions)
          ours.insert({static_cast<int>(r.box.x), static_cast<int>(r.box.y), static_cast<int>(r.box.width),
                       static_cast<int>(r.box.height), static_cast<int>(r.moments.area)});
        for (int i = 1; i < count; ++i)
          theirs.insert({stats.at<int>(i, 0), stats.at<int>(i, 1), stats.at<int>(i, 2), stats.at<int>(i, 3),
                         stats.at<int>(i, 4)});
        ASSERT_EQ(ours, theirs) << scene;
      }
    }
  }
}

// More loose pixels than the list has room for: reported, not miscounted; the next frame is whole again.
TEST_F(RegionsTest, TooManyPartsAreTold) {
  const FrameFormat format{320, 320, 1, 8};
  const Sensor sensor = plain_sensor(format);
  RegionsRun gpu(context(), format, sensor, default_tuning(context()));
  const Frame black = uniform_frame(format, 0);
  Frame dots = black, one = black;
  for (uint32_t y = 0; y < format.height; y += 2)
    for (uint32_t x = 0; x < format.width; x += 2) dots.set(0, x, y, 200);
  for (uint32_t y = 100; y < 200; ++y)
    for (uint32_t x = 90; x < 220; ++x) one.set(0, x, y, 255);
  ASSERT_GT(160u * 160u, gpu.capacity());
  const RegionsAnswer many = gpu(dots, black);
  EXPECT_FALSE(many.complete);
  EXPECT_TRUE(many.regions.empty());
  EXPECT_EQ(many.all.area, 160u * 160u);
  const RegionsAnswer whole = gpu(one, black);
  EXPECT_TRUE(whole.complete);
  expect_equal(whole.regions, reference::regions(one, black, sensor), "after the overflow");
}

// The largest frame's side and the smallest: sums of a region that fills it.
TEST_F(RegionsTest, OneRegionOverManyTilesIsTheWholeContact) {
  const FrameFormat format{2051, 1030, 1, 16};
  Sensor sensor = plain_sensor(format);
  sensor.filter = Filter::Binomial5;
  const Frame white = uniform_frame(format, format.max_gray()), black = uniform_frame(format, 0);
  const RegionsAnswer answer = run(white, black, sensor);
  ASSERT_TRUE(answer.complete);
  ASSERT_EQ(answer.regions.size(), 1u);
  EXPECT_EQ(answer.regions[0].moments, answer.all);
  EXPECT_EQ(answer.all.area, uint64_t{2051} * 1030);
  EXPECT_EQ(answer.regions[0].box, (PixelRect{0, 0, 2051, 1030}));
}

}  // namespace
}  // namespace palpate
