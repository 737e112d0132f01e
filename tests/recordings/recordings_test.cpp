// The engine on recordings of real sensors. They are not part of the repository (their licences differ): the
// tests look for them beside it, in ../shared/data, and say loudly when they are skipped.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <numeric>
#include <set>
#include <sstream>

#include "capture/open_source.h"
#include "engine/calibrate/photometric/fit.h"
#include "palpate/error.h"
#include "palpate/pipeline.h"
#include "tests/support/csv_table.h"
#include "tests/support/gpu_fixture.h"
#include "tests/support/text_file.h"

namespace palpate {
namespace {

namespace fs = std::filesystem;

const fs::path kRoot = PALPATE_SOURCE_DIR;
const fs::path kSensors = kRoot / "capture/sensors";
const fs::path kData = kRoot / "../shared/data";

class RealRecordings : public GpuTest {
 protected:
  void SetUp() override {
    if (!fs::is_directory(kData)) {
      std::fprintf(stderr, "\n*** NOT CHECKED AGAINST REAL SENSORS: no folder %s ***\n\n",
                   fs::weakly_canonical(kData).c_str());
      GTEST_SKIP() << "no recordings of real sensors at " << kData;
    }
    GpuTest::SetUp();
  }
  void TearDown() override {
    if (!IsSkipped()) GpuTest::TearDown();
  }
};

PipelineOptions options_for(uint32_t outputs) {
  PipelineOptions options;
  options.outputs = outputs;
  options.solver = SurfaceSolver::Converged;
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
  DepthMap map{result->touch, source->format().width, source->format().height,
               pipeline.read_depth_mm(*result)};
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

struct Press {
  std::string image;
  double x_px, y_px, radius_px, ball_mm;
};

std::vector<Press> presses(const char* file) {
  std::ifstream in(kSensors / file);
  std::string line, name;
  std::getline(in, line);
  std::vector<Press> list;
  while (std::getline(in, line)) {
    std::istringstream row(line);
    Press p;
    char comma;
    std::getline(row, p.image, ',');
    row >> p.x_px >> comma >> p.y_px >> comma >> p.radius_px >> comma >> p.ball_mm;
    list.push_back(p);
  }
  return list;
}

TEST_F(RealRecordings, WedgeSignalFollowsTheForceGauge) {
  const Sensor sensor = load_sensor(kSensors / "gelsight_wedge.json");
  const fs::path folder = kData / "gelsight_wedge_press";
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
    Pipeline pipeline(context(), for_rectified_frames(sensor), source->format(),
                      options_for(static_cast<uint32_t>(Output::Force)));
    pipeline.set_background(load_background(clip.string(), sensor, *source));
    std::vector<double> gray;
    for (Frame frame; source->next(frame);) gray.push_back(pipeline.process(frame).gray_sum);
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
  const Sensor sensor = load_sensor(kSensors / "gelsight_wedge.json");
  for (const auto& [clip, x, y] : {std::tuple{"golf_ball_1.avi", 178, 175}, {"golf_ball_2.avi", 178, 173}}) {
    const DepthMap map = depth_of(context(), kData / "gelsight_wedge_press" / clip, sensor, 31);
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

/// Sizes of the 8-connected parts of the contact, from the same filtered difference as the engine's.
std::vector<int> parts(const Frame& frame, const Frame& background, const Sensor& sensor) {
  const int w = static_cast<int>(frame.format.width), h = static_cast<int>(frame.format.height);
  const std::array<int, 5> binomial = {1, 4, 6, 4, 1};
  const auto difference = [&](int x, int y) {
    const uint32_t u = static_cast<uint32_t>(std::clamp(x, 0, w - 1)),
                   v = static_cast<uint32_t>(std::clamp(y, 0, h - 1));
    return std::max(0, static_cast<int>(frame.at(0, u, v)) - static_cast<int>(background.at(0, u, v)));
  };
  std::vector<uint8_t> mask(static_cast<size_t>(w) * h);
  for (int y = 0; y < h; ++y)
    for (int x = 0; x < w; ++x) {
      int sum = 0;
      for (int j = 0; j < 5; ++j)
        for (int i = 0; i < 5; ++i) sum += binomial[j] * binomial[i] * difference(x + i - 2, y + j - 2);
      mask[static_cast<size_t>(y) * w + x] = sum >= sensor.threshold_gray * 256;
    }
  std::vector<int> sizes;
  for (int start = 0; start < w * h; ++start) {
    if (!mask[start]) continue;
    std::vector<int> stack{start};
    mask[start] = 0;
    int size = 0;
    while (!stack.empty()) {
      const int at = stack.back();
      stack.pop_back();
      ++size;
      for (int dy = -1; dy <= 1; ++dy)
        for (int dx = -1; dx <= 1; ++dx) {
          const int x = at % w + dx, y = at / w + dy;
          if (x < 0 || y < 0 || x >= w || y >= h || !mask[y * w + x]) continue;
          mask[y * w + x] = 0;
          stack.push_back(y * w + x);
        }
    }
    sizes.push_back(size);
  }
  return sizes;
}

TEST_F(RealRecordings, WaveguideShowsFiveFingers) {
  const Sensor sensor = load_sensor(kSensors / "touchlib_ftir.json");
  const std::string clip = (kData / "touchlib-ftir/hard-5point.avi").string();
  const std::unique_ptr<Source> source = open_source(clip, sensor);
  const Frame background = load_background(clip, sensor, *source);
  Pipeline pipeline(context(), for_rectified_frames(sensor), source->format(),
                    options_for(Output::Force | Output::Contacts));
  pipeline.set_background(background);
  int frames = 0, five = 0, touched = 0;
  std::set<uint32_t> ids;
  for (Frame frame; source->next(frame); ++frames) {
    const Touch touch = pipeline.process(frame);
    const std::vector<int> sizes = parts(frame, background, sensor);
    EXPECT_EQ(touch.area_px, static_cast<uint64_t>(std::accumulate(sizes.begin(), sizes.end(), 0)))
        << "frame " << frames;
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
        std::vector<int> largest = sizes;
        std::ranges::sort(largest, std::ranges::greater{});
        EXPECT_EQ(own_px, static_cast<uint64_t>(std::accumulate(largest.begin(), largest.begin() + 5, 0)));
      }
    }
  }
  EXPECT_EQ(frames, 158);
  ASSERT_EQ(touched, 146);
  std::printf("five contacts in %d of %d frames, %zu ids\n", five, touched, ids.size());
  EXPECT_GE(five, 0.98 * touched);
  EXPECT_LE(ids.size(), 6u);
}

TEST_F(RealRecordings, GelShapesHaveTheirDepth) {
  const fs::path folder = kData / "gelsight-sim2real";
  Sensor sensor = load_sensor(kSensors / "gelsight_sim2real.json");
  sensor.background.image = (folder / "background_real.png").string();
  const double pitch = sensor.pitch_mm_per_px;
  double sum = 0;
  std::printf("shape            commanded depth   RMSE over the face (mm)   mean error (mm)\n");
  for (const std::string shape : {"sphere", "large_sphere", "prism", "triangle"}) {
    std::vector<double> mean_error_mm;
    for (const char* depth : {"0.25", "0.5", "0.75", "1.0"}) {
      const double d = std::stod(depth);
      const DepthMap map = depth_of(context(), folder / (shape + "_" + depth + "_real.png"), sensor);
      double square = 0, mean = 0;
      int n = 0;
      for (int y = 0; y < static_cast<int>(map.height); ++y)
        for (int x = 0; x < static_cast<int>(map.width); ++x) {
          double truth = d;
          if (shape == "prism") {
            if (x < 172 || x > 242 || y < 114 || y > 220) continue;
          } else if (shape == "triangle") {
            const auto left_of = [&](int ax, int ay, int bx, int by) {
              return (bx - ax) * (y - ay) - (by - ay) * (x - ax) >= 0;
            };
            if (!left_of(161, 137, 212, 132) || !left_of(212, 132, 250, 193) || !left_of(250, 193, 161, 137))
              continue;
          } else {
            const double ball = shape == "sphere" ? 2.92 : 4.925, cx = shape == "sphere" ? 208 : 203,
                         cy = shape == "sphere" ? 166 : 167;
            const double r = std::hypot(x - cx, y - cy) * pitch;
            if (r > 0.85 * std::sqrt(ball * ball - (ball - d) * (ball - d))) continue;
            truth = std::sqrt(ball * ball - r * r) - (ball - d);
          }
          const double error = map.at(x, y) - truth;
          square += error * error;
          mean += error;
          ++n;
        }
      const double rmse = std::sqrt(square / n);
      std::printf("%-16s %12s mm %19.3f %22.3f\n", shape.c_str(), depth, rmse, mean / n);
      EXPECT_LT(rmse, 0.12) << shape << " " << depth;
      sum += rmse;
      mean_error_mm.push_back(mean / n);
    }
    // Whatever the zero of the commanded depth: 0.75 mm more of it must be read as 0.75 mm more.
    const double gain = 1 + (mean_error_mm.back() - mean_error_mm.front()) / 0.75;
    std::printf("%-16s read depth over commanded depth, 0.25 to 1.0 mm: %.3f\n", shape.c_str(), gain);
    EXPECT_GT(gain, 0.9) << shape;
    EXPECT_LT(gain, 1.2) << shape;
  }
  std::printf("mean RMSE %.4f mm\n", sum / 16);
  EXPECT_LT(sum / 16, 0.047);
}

/// Radius of the sphere that fits best, tilt and offset free, over a disc of the depth map.
double sphere_radius_mm(const DepthMap& map, double cx, double cy, double disc_px, double pitch) {
  const int x0 = static_cast<int>(std::round(cx)), y0 = static_cast<int>(std::round(cy)),
            reach = static_cast<int>(disc_px);
  double best = 0, least = 1e300;
  for (double radius = (disc_px + 2) * pitch; radius < 40; radius *= 1.005) {
    // Least squares of depth - cap(radius) on 1, x, y, which are orthogonal over a disc that is symmetric in
    // pixels.
    double n = 0, s0 = 0, sx = 0, sy = 0, xx = 0, ss = 0;
    for (int y = -reach; y <= reach; ++y)
      for (int x = -reach; x <= reach; ++x) {
        if (std::hypot(x, y) > disc_px) continue;
        const double r_mm = std::hypot(x0 + x - cx, y0 + y - cy) * pitch;
        const double e = map.at(x0 + x, y0 + y) - (std::sqrt(radius * radius - r_mm * r_mm) - radius);
        n += 1, s0 += e, sx += e * x, sy += e * y, xx += x * x, ss += e * e;
      }
    const double residual = ss - s0 * s0 / n - (sx * sx + sy * sy) / xx;
    if (residual < least) least = residual, best = radius;
  }
  return best;
}

TEST_F(RealRecordings, MarkedGelShowsRoundDimplesOfTheBall) {
  const fs::path folder = kData / "gelslim-balls";
  Sensor sensor = load_sensor(kSensors / "gelslim_balls.json");
  sensor.background.image = (folder / "ref.jpg").string();
  const std::vector<Press> list = presses("gelslim_balls_presses.csv");
  ASSERT_EQ(list.size(), 10u);

  // Each ball is measured with the calibration of the nine others, made as the sensor file was.
  constexpr double kRestWeight = 10;
  std::vector<double> radii;
  std::printf("press            contact (px)     sphere radius (mm), true 3.8\n");
  for (const Press& judged : list) {
    std::optional<PhotometricFit> fit;
    for (const Press& p : list) {
      if (p.image == judged.image) continue;
      const std::string file = (folder / p.image).string();
      const std::unique_ptr<Source> source = open_source(file, sensor);
      if (!fit) fit.emplace(source->format(), sensor.pitch_mm_per_px);
      Frame frame;
      ASSERT_TRUE(source->next(frame));
      fit->add_ball(frame, load_background(file, sensor, *source), p.x_px, p.y_px, p.radius_px, p.ball_mm,
                    p.image);
    }
    Sensor held_out = sensor;
    held_out.photometric = fit->solve(kRestWeight).calibration;
    const DepthMap map = depth_of(context(), folder / judged.image, held_out);
    radii.push_back(
        sphere_radius_mm(map, judged.x_px, judged.y_px, 0.9 * judged.radius_px, sensor.pitch_mm_per_px));
    std::printf("%-16s %8.1f %20.2f\n", judged.image.c_str(), judged.radius_px, radii.back());
    EXPECT_GT(radii.back(), 2.4) << judged.image;
    EXPECT_LT(radii.back(), 5.2) << judged.image;

    // Round: the depth half way out is the same on every side, compared with the depth of the dimple.
    double least = 1e9, most = -1e9;
    for (int k = 0; k < 16; ++k) {
      const double a = 2 * 3.14159265 * k / 16, r = 0.6 * judged.radius_px;
      const double z =
          map.at(std::round(judged.x_px + r * std::cos(a)), std::round(judged.y_px + r * std::sin(a)));
      least = std::min(least, z);
      most = std::max(most, z);
    }
    const double peak = map.at(std::round(judged.x_px), std::round(judged.y_px));
    EXPECT_GT(peak, 0.3) << judged.image;
    EXPECT_LT(most - least, 0.35 * peak) << judged.image;
  }
  const double mean = std::accumulate(radii.begin(), radii.end(), 0.0) / 10;
  std::printf("mean sphere radius %.2f mm\n", mean);
  EXPECT_NEAR(mean, 3.8, 0.5);
}

}  // namespace
}  // namespace palpate
