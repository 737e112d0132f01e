// The engine on recordings of real sensors (tests/support/recordings.h).
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <numeric>
#include <set>

#include "capture/open_source.h"
#include "palpate/pipeline.h"
#include "tests/reference/regions.h"
#include "tests/support/csv_table.h"
#include "tests/support/pipelines.h"
#include "tests/support/recordings.h"
#include "tests/support/text_file.h"

namespace palpate {
namespace {

namespace fs = std::filesystem;

class RealRecordings : public RecordingsTest {
 protected:
  RealRecordings() : RecordingsTest("NOT CHECKED AGAINST REAL SENSORS") {}
};

PipelineOptions options_for(Outputs outputs) {
  PipelineOptions options;
  options.outputs = outputs;
  options.solver = SurfaceSolver::Best;
  return options;
}

struct DepthMap {
  Touch touch;
  uint32_t width = 0, height = 0;
  std::vector<float> mm;
  double at(double x, double y) const { return mm[static_cast<size_t>(y) * width + static_cast<size_t>(x)]; }
};

/// Depth of one image, or of one frame of a video, by the engine.
DepthMap depth_of(gpu::Context& context, const fs::path& file, const Sensor& sensor,
                  uint64_t frame_number = 0) {
  const std::unique_ptr<Source> source = open_source(file.string(), sensor);
  Pipeline pipeline(context, for_rectified_frames(sensor), source->format(),
                    options_for(Output::Force | Output::Surface));
  pipeline.set_background(load_background(file.string(), sensor, *source));
  Frame frame;
  for (uint64_t i = 0; i <= frame_number; ++i)
    if (!source->next(frame)) throw std::runtime_error("too short: " + file.string());
  if (!pipeline.submit(frame)) throw std::runtime_error("no free slot");
  const std::optional<Result> result = pipeline.wait();
  DepthMap map{result->touch, source->format().width, source->format().height, depth_map(*result)};
  return map;
}

/// Ranks from 1, ties share their mean.
std::vector<double> ranks(const std::vector<double>& values) {
  std::vector<size_t> order(values.size());
  std::iota(order.begin(), order.end(), size_t{0});
  std::sort(order.begin(), order.end(), [&](size_t a, size_t b) { return values[a] < values[b]; });
  std::vector<double> rank(values.size());
  for (size_t i = 0; i < order.size();) {
    size_t j = i;
    while (j < order.size() && values[order[j]] == values[order[i]]) ++j;
    for (size_t k = i; k < j; ++k) rank[order[k]] = 0.5 * static_cast<double>(i + 1 + j);
    i = j;
  }
  return rank;
}

double correlation(const std::vector<double>& a, const std::vector<double>& b) {
  const double n = static_cast<double>(a.size());
  const double ma = std::accumulate(a.begin(), a.end(), 0.0) / n,
               mb = std::accumulate(b.begin(), b.end(), 0.0) / n;
  double ab = 0, aa = 0, bb = 0;
  for (size_t i = 0; i < a.size(); ++i) {
    ab += (a[i] - ma) * (b[i] - mb);
    aa += (a[i] - ma) * (a[i] - ma);
    bb += (b[i] - mb) * (b[i] - mb);
  }
  return ab / std::sqrt(aa * bb);
}

/// Column `name` of a CSV file of numbers.
std::vector<double> column(const fs::path& file, const std::string& name) {
  return Table(slurp(file)).numbers(name);
}

TEST_F(RealRecordings, WedgeSignalFollowsTheForceGauge) {
  const Sensor sensor = load_sensor(shipped_sensor("gelsight_wedge"));
  const fs::path folder = recordings_folder() / "gelsight_wedge_press";
  std::vector<fs::path> clips;
  for (const auto& entry : fs::directory_iterator(folder))
    if (entry.path().extension() == ".avi") clips.push_back(entry.path());
  std::sort(clips.begin(), clips.end());
  ASSERT_EQ(clips.size(), 10u);

  std::vector<double> found;
  std::printf(
      "clip                      frames   largest force   Spearman   Pearson   (gray sum against gauge)\n");
  for (const fs::path& clip : clips) {
    const std::unique_ptr<Source> source = open_source(clip.string(), sensor);
    Pipeline pipeline(context(), for_rectified_frames(sensor), source->format(), options_for(Output::Force));
    pipeline.set_background(load_background(clip.string(), sensor, *source));
    std::vector<double> gray;
    for (Frame frame; source->next(frame);) gray.push_back(pipeline.process(frame).touch.gray_sum);
    fs::path table = clip;
    const std::vector<double> force = column(table.replace_extension(".csv"), "force_N");
    ASSERT_EQ(gray.size(), force.size()) << clip;
    found.push_back(correlation(ranks(gray), ranks(force)));
    std::printf("%-25s %6zu %11.1f N %12.3f %9.3f\n", clip.stem().c_str(), gray.size(),
                *std::max_element(force.begin(), force.end()), found.back(), correlation(gray, force));
    EXPECT_GT(found.back(), 0.88) << clip;
  }
  std::sort(found.begin(), found.end());
  EXPECT_GT(0.5 * (found[4] + found[5]), 0.93) << "median";
}

/// Gaussian of `sigma` px inside the map, renormalised at its borders.
std::vector<double> smooth(const DepthMap& map, double sigma) {
  const int reach = static_cast<int>(std::ceil(3 * sigma)), w = static_cast<int>(map.width),
            h = static_cast<int>(map.height);
  std::vector<double> in(map.mm.begin(), map.mm.end()), out(in.size());
  for (const bool across : {true, false}) {
    for (int y = 0; y < h; ++y)
      for (int x = 0; x < w; ++x) {
        double sum = 0, weight = 0;
        for (int k = -reach; k <= reach; ++k) {
          const int u = across ? x + k : x, v = across ? y : y + k;
          if (u < 0 || v < 0 || u >= w || v >= h) continue;
          const double g = std::exp(-0.5 * k * k / (sigma * sigma));
          sum += g * in[static_cast<size_t>(v) * w + u];
          weight += g;
        }
        out[static_cast<size_t>(y) * w + x] = sum / weight;
      }
    in = out;
  }
  return out;
}

TEST_F(RealRecordings, GolfBallShowsItsDimples) {
  const Sensor sensor = load_sensor(shipped_sensor("gelsight_wedge"));
  for (const auto& [clip, x, y] : {std::tuple{"golf_ball_1.avi", 178, 175}, {"golf_ball_2.avi", 178, 173}}) {
    const DepthMap map = depth_of(context(), recordings_folder() / "gelsight_wedge_press" / clip, sensor, 31);
    EXPECT_TRUE(map.touch.contact);
    // Structure smaller than the ball and larger than the noise: dimples of about 4 mm from one to the next.
    const std::vector<double> fine = smooth(map, 0.2 / sensor.pitch_mm_per_px),
                              coarse = smooth(map, 1.3 / sensor.pitch_mm_per_px);
    const auto relief = [&](int u, int v) {
      const size_t i = static_cast<size_t>(v) * map.width + static_cast<size_t>(u);
      return fine[i] - coarse[i];
    };
    // The gel follows the ball less deeply into a dimple: a pit of the relief, lowest within 1.4 mm around
    // it.
    struct Pit {
      int x, y;
      double depth_mm;
    };
    std::vector<Pit> pits;
    const int reach = static_cast<int>(1.4 / sensor.pitch_mm_per_px),
              inside = static_cast<int>(7 / sensor.pitch_mm_per_px);
    for (int v = y - inside; v <= y + inside; ++v)
      for (int u = x - inside; u <= x + inside; ++u) {
        if (std::hypot(u - x, v - y) > inside) continue;
        bool lowest = true;
        double rim = 0;
        int count = 0;
        for (int j = -reach; j <= reach; ++j)
          for (int i = -reach; i <= reach; ++i) {
            const double r = std::hypot(i, j);
            if (r > reach) continue;
            lowest = lowest && relief(u, v) <= relief(u + i, v + j);
            if (r > reach - 1) rim += relief(u + i, v + j), ++count;
          }
        if (lowest && rim / count - relief(u, v) > 0.02) pits.push_back({u, v, rim / count - relief(u, v)});
      }
    std::vector<double> spacing;
    for (const Pit& a : pits) {
      double nearest = 1e9;
      for (const Pit& b : pits)
        if (&a != &b) nearest = std::min(nearest, std::hypot(a.x - b.x, a.y - b.y));
      spacing.push_back(nearest * sensor.pitch_mm_per_px);
      std::printf("%s dimple at (%d, %d) px, %.3f mm below its rim, next one %.2f mm away\n", clip, a.x, a.y,
                  a.depth_mm, spacing.back());
    }
    EXPECT_GE(pits.size(), 6u) << clip;
    EXPECT_LE(pits.size(), 14u) << clip;
    for (const double s : spacing) {
      EXPECT_GT(s, 2.5) << clip;
      EXPECT_LT(s, 6.0) << clip;
    }
  }
}

TEST_F(RealRecordings, WaveguideShowsFiveFingers) {
  const Sensor sensor = load_sensor(shipped_sensor("touchlib_ftir"));
  const std::string clip = (recordings_folder() / "touchlib-ftir/hard-5point.avi").string();
  const std::unique_ptr<Source> source = open_source(clip, sensor);
  const Frame background = load_background(clip, sensor, *source);
  Pipeline pipeline(context(), for_rectified_frames(sensor), source->format(),
                    options_for(Output::Force | Output::Contacts));
  pipeline.set_background(background);
  int frames = 0, five = 0, touched = 0;
  std::set<uint32_t> ids;
  for (Frame frame; source->next(frame); ++frames) {
    const Touch touch = pipeline.process(frame).touch;
    std::vector<uint64_t> sizes;
    for (const Region& part : reference::regions(frame, background, sensor))
      sizes.push_back(part.moments.area);
    EXPECT_EQ(touch.area_px, std::accumulate(sizes.begin(), sizes.end(), uint64_t{0})) << "frame " << frames;
    EXPECT_FALSE(touch.regions->overflow);
    uint64_t own_px = 0;
    for (const ContactTouch& contact : touch.contacts) {
      ids.insert(contact.id);
      own_px += contact.area_px;
    }
    EXPECT_LE(own_px, touch.area_px);
    if (frames <= 7 || frames >= 156) {
      EXPECT_FALSE(touch.contact) << "frame " << frames;
      EXPECT_TRUE(touch.contacts.empty()) << "frame " << frames;
    } else if (frames >= 10 && frames <= 155) {
      ++touched;
      five += touch.contacts.size() == 5;
      // None is cut in two, none is lost: where five are seen they are the largest parts of the image.
      if (touch.contacts.size() == 5) {
        std::ranges::sort(sizes, std::ranges::greater{});
        EXPECT_EQ(own_px, std::accumulate(sizes.begin(), sizes.begin() + 5, uint64_t{0}));
      }
    }
  }
  EXPECT_EQ(frames, 158);
  ASSERT_EQ(touched, 146);
  std::printf("five contacts in %d of %d frames, %zu ids\n", five, touched, ids.size());
  EXPECT_GE(five, 0.98 * touched);
  EXPECT_LE(ids.size(), 6u);
}

}  // namespace
}  // namespace palpate
