#include "engine/stages/surface/slope.h"

#include <random>

#include "engine/numeric/weighted_poisson.h"
#include "tests/reference/slope.h"
#include "tests/support/gpu_fixture.h"
#include "tests/support/stage_run.h"
#include "tests/support/thorough.h"

namespace palpate {
namespace {

class SlopeTest : public GpuTest {
 protected:
  /// The GPU's right side for one frame: of its pixels, height x width, or of cells of two by two of them.
  static std::vector<float> right_side(const Frame& image, const Frame& rest, const Sensor& sensor,
                                       RightSides which) {
    const FrameFormat& format = image.format;
    const Tuning tuning = default_tuning(context());
    const Contact contact(context(), sensor, format, sensor.reading == SurfaceReading::Shading, tuning);
    const Slope slope(context(), sensor, format, contact, which, tuning);
    FrameOnGpu images(context(), format);
    images.write(image, rest);
    const Surface surface(context(), format.width, format.height, Solve::Live, tuning, true);
    const bool pixels = which == RightSides::Pixels;
    const Grid grid = pixels ? surface.grid() : coarser(surface.grid());
    const gpu::DeviceBuffer records(context(), "records", contact.record_bytes(), gpu::Memory::Readback);
    const gpu::DeviceBuffer host(context(), "readback", grid.bytes(), gpu::Memory::Readback);
    const gpu::DeviceBuffer clipped(context(), "clipped", slope.clipped_bytes(), gpu::Memory::Readback);
    gpu::Commands commands(context());
    commands.begin();
    images.record(commands);
    contact.record(commands, images.frame, images.background, records);
    slope.record(commands, images.frame, images.background, surface, clipped);
    commands.copy((pixels ? surface.right_side() : surface.coarse_right_side()).buffer, host, grid.bytes());
    commands.host_barrier();
    commands.end();
    commands.submit();
    commands.wait();
    clipped_px = slope.clipped_px(clipped.as<const uint32_t>());
    std::vector<float> out;
    for (uint32_t y = 0; y < grid.height; ++y)
      for (uint32_t x = 0; x < grid.width; ++x)
        out.push_back(host.as<const float>()[size_t{y} * grid.pitch * 4 + x]);
    return out;
  }

  static inline uint64_t clipped_px = 0;  ///< of the last frame

  /// Sums over two by two pixels.
  static std::vector<double> cell_sums(const std::vector<double>& pixels, uint32_t width, uint32_t height) {
    const uint32_t across = (width + 1) / 2;
    std::vector<double> cells(size_t{across} * ((height + 1) / 2));
    for (uint32_t y = 0; y < height; ++y)
      for (uint32_t x = 0; x < width; ++x)
        cells[size_t{y / 2} * across + x / 2] += pixels[size_t{y} * width + x];
    return cells;
  }

  static void expect_reference(const Frame& image, const Frame& rest, const Sensor& sensor,
                               const reference::Slopes& slopes, double tolerance) {
    const auto [width, height, channels, bits] = image.format;
    const std::string scene =
        std::to_string(width) + "x" + std::to_string(height) + " bits " + std::to_string(bits);
    const auto wanted = reference::right_side(slopes, width, height, sensor.pitch_mm_per_px);
    expect_near(right_side(image, rest, sensor, RightSides::Pixels), wanted, tolerance, scene, width);
    expect_clipped(slopes, scene);
    expect_near(right_side(image, rest, sensor, RightSides::Cells), cell_sums(wanted, width, height),
                tolerance, scene + " cells", (width + 1) / 2);
    expect_clipped(slopes, scene + " cells");
  }

  static void expect_clipped(const reference::Slopes& slopes, const std::string& scene) {
    EXPECT_GE(clipped_px, slopes.clipped - std::min(slopes.clipped, slopes.on_the_edge)) << scene;
    EXPECT_LE(clipped_px, slopes.clipped + slopes.on_the_edge) << scene;
  }

  static void expect_near(const std::vector<float>& got, const std::vector<double>& wanted, double tolerance,
                          const std::string& scene, uint32_t width) {
    double scale = 0;
    for (const double w : wanted) scale = std::max(scale, std::abs(w));
    for (size_t i = 0; i < wanted.size(); ++i)
      ASSERT_NEAR(double{got[i]}, wanted[i], tolerance * std::max(scale, 1e-6))
          << scene << " at " << i % width << ", " << i / width;
  }
};

const std::vector<std::pair<uint32_t, uint32_t>> kSizes{{1, 1}, {2, 1},   {1, 5},   {3, 3},   {4, 4},
                                                        {5, 9}, {16, 16}, {17, 40}, {67, 33}, {130, 71}};

// Shapes of weights: colours, the last four with their products, by terms of place.
const std::vector<std::pair<size_t, size_t>> kShapes{{3, 1}, {3, 3}, {3, 6}, {3, 10},
                                                     {9, 1}, {9, 3}, {9, 6}, {9, 10}};

// A gel whose weights are random, of a size that clips some pixels whatever their shape.
Sensor random_gel(std::mt19937& random, size_t shape) {
  Sensor sensor;
  sensor.pitch_mm_per_px = 0.05;
  sensor.channels = 3;
  sensor.reading = SurfaceReading::Photometric;
  const auto [colours, terms] = kShapes[shape % kShapes.size()];
  const double most = 0.9 / std::sqrt(static_cast<double>(colours * terms));
  std::uniform_real_distribution<double> weight(-most, most);
  for (auto* weights : {&sensor.photometric.wx, &sensor.photometric.wy}) {
    weights->assign(colours, std::vector<double>(terms));
    for (auto& row : *weights)
      for (double& w : row) w = weight(random);
  }
  return sensor;
}

// Pixels of any value, or of none but black and saturated ones.
Frame random_frame(std::mt19937& random, const FrameFormat& format, bool extremes = false) {
  Frame frame;
  frame.reshape(format);
  for (uint8_t& byte : frame.bytes) byte = static_cast<uint8_t>(extremes ? random() % 2 * 255 : random());
  return frame;
}

TEST_F(SlopeTest, PhotometricEqualsReference) {
  std::mt19937 random(11);
  uint64_t clipped = 0, on_the_edge = 0;
  for (size_t i = 0; i < static_cast<size_t>(of_sweep(80, 20)); ++i) {  // each shape compiles two kernels
    const auto& [width, height] = kSizes[i % kSizes.size()];
    const FrameFormat format{width, height, 3, 8};
    const Frame image = random_frame(random, format, i % 3 == 0), rest = random_frame(random, format);
    Sensor sensor = random_gel(random, i + i / kSizes.size());
    sensor.max_slope = i % 2 ? 10 : 0.5;  // the low limit clips most pixels
    const reference::Slopes slopes = reference::photometric_slopes(image, rest, sensor);
    expect_reference(image, rest, sensor, slopes, 1e-4);
    clipped += slopes.clipped;
    on_the_edge += slopes.on_the_edge;
  }
  EXPECT_GT(clipped, of_sweep(400u, 100u));
  EXPECT_LT(on_the_edge, 5u);
}

TEST_F(SlopeTest, ShadingEqualsReference) {
  std::mt19937 random(12);
  uint64_t clipped = 0;
  for (int i = 0; i < of_sweep(60, 20); ++i) {  // each compiles four kernels
    const auto& [width, height] = kSizes[static_cast<size_t>(i) % kSizes.size()];
    const uint32_t bits = std::array{8u, 12u, 16u}[static_cast<size_t>(i) % 3];
    const FrameFormat format{width, height, 1, bits};
    Frame image, rest;
    image.reshape(format);
    rest.reshape(format);
    const double top = format.max_gray();
    // A smooth blob: on white noise the direction of the slope hangs on the last bit of a vanishing gradient.
    for (uint32_t y = 0; y < height; ++y) {
      for (uint32_t x = 0; x < width; ++x) {
        const double r2 = std::pow(x - 0.4 * width, 2) + std::pow(y - 0.6 * height, 2);
        image.set(0, x, y,
                  static_cast<uint32_t>(0.1 * top + 0.8 * top * std::exp(-r2 / (0.1 * width * height + 1))));
        rest.set(0, x, y, static_cast<uint32_t>(0.1 * top));
      }
    }
    Sensor sensor;
    sensor.pitch_mm_per_px = 0.05;
    sensor.bit_depth = bits;
    sensor.saturation_gray = format.max_gray();
    sensor.reading = SurfaceReading::Shading;
    sensor.threshold_gray = 0.05 * top;
    sensor.shading = {0.8 * top, 0.5};
    sensor.max_slope = i % 4 ? 5 : 1;
    const reference::Slopes slopes = reference::shading_slopes(image, rest, sensor);
    expect_reference(image, rest, sensor, slopes, 1e-3);
    clipped += slopes.clipped;
  }
  EXPECT_GT(clipped, 1000u);
}

/// The kernel's outputs for cells: right side, right and lower faces, the field.
struct Cells {
  std::vector<double> right, across, down;
  double field = 0;
};

/// The same from faces of pixels, in plain loops.
Cells cells_of(const WeightedFaces& f) {
  const uint32_t width = (f.width + 1) / 2, height = (f.height + 1) / 2;
  const std::vector<double> right = right_side(f);
  Cells c;
  for (auto* values : {&c.right, &c.across, &c.down}) values->assign(size_t{width} * height, 0);
  std::vector<double> across_flow(c.right.size()), down_flow(c.right.size());
  const auto per_distance = [](uint32_t next, uint32_t size) { return next + 1 == size ? 2.0 / 3 : 0.5; };
  for (uint32_t y = 0; y < f.height; ++y)
    for (uint32_t x = 0; x < f.width; ++x) {
      const size_t i = size_t{y} * f.width + x, cell = size_t{y / 2} * width + x / 2;
      c.right[cell] += right[i];
      if (x % 2 == 1 && x + 1 < f.width) {
        c.across[cell] += f.across_weight[i] * per_distance(x + 1, f.width);
        across_flow[cell] += f.across_weight[i] * f.across[i];
      }
      if (y % 2 == 1 && y + 1 < f.height) {
        c.down[cell] += f.down_weight[i] * per_distance(y + 1, f.height);
        down_flow[cell] += f.down_weight[i] * f.down[i];
      }
    }
  for (size_t i = 0; i < c.right.size(); ++i) {
    if (c.across[i] > 0) c.field += across_flow[i] * across_flow[i] / c.across[i];
    if (c.down[i] > 0) c.field += down_flow[i] * down_flow[i] / c.down[i];
  }
  return c;
}

// Pixels that count by their confidence: the kernel on cells equals sums over the faces of pixels, of the
// slopes that the store kernel leaves; those of a gel are the reference's.
TEST_F(SlopeTest, WeightedCellsEqualSumsOverPixels) {
  std::mt19937 random(23);
  size_t shape = 0;
  for (const bool shading : {false, true})
    for (const auto& [width, height] : kSizes) {
      Sensor sensor = random_gel(random, shape++);
      if (shading) {
        sensor.channels = 1;
        sensor.reading = SurfaceReading::Shading;
      }
      sensor.threshold_gray = 4;
      sensor.shading.facing_gray = 220;
      const FrameFormat format{width, height, sensor.channels, 8};
      const Frame image = random_frame(random, format);
      Frame rest = random_frame(random, format);
      if (shading) std::ranges::fill(rest.bytes, uint8_t{0});
      const Tuning tuning = default_tuning(context());
      const Contact contact(context(), sensor, format, shading, tuning);
      Slope slope(context(), sensor, format, contact, RightSides::Cells, tuning);
      slope.prepare_slopes(context());
      slope.prepare_known(context());
      FrameOnGpu images(context(), format);
      images.write(image, rest);
      const Grid pixels = grid_for(width, height), grid = coarser(pixels);
      const auto read = [&](const char* name, uint64_t bytes) {
        return gpu::DeviceBuffer(context(), name, bytes, gpu::Memory::Readback);
      };
      const uint32_t row = (width + 15) / 16 * 16;
      gpu::DeviceBuffer confidence(context(), "confidence", uint64_t{row} * height * 2, gpu::Memory::Upload);
      std::vector<float> weights;
      for (uint16_t& pixel : confidence.as<uint16_t>()) pixel = static_cast<uint16_t>(random() | 255u);
      for (uint32_t y = 0; y < height; ++y)
        for (uint32_t x = 0; x < width; ++x) {
          const uint32_t kind = random() % 4, value = kind == 0 ? 0 : kind == 1 ? random() % 256 : 255;
          confidence.as<uint16_t>()[size_t{y} * row + x] = static_cast<uint16_t>(value | (random() % 8 << 8));
          weights.push_back(static_cast<float>(value) / 255);
        }
      confidence.flush();
      const gpu::TexelView pairs(context(), confidence, VK_FORMAT_R32G32_UINT);
      const FloatMap p(context(), "d/dx", pixels), q(context(), "d/dy", pixels);
      const FloatMap right(context(), "right side", grid), across(context(), "right faces", grid),
          down(context(), "lower faces", grid), plain(context(), "right side alone", grid);
      const gpu::DeviceBuffer field = read("field", slope.clipped_bytes()),
                              clipped = read("clipped", slope.clipped_bytes()),
                              records = read("records", contact.record_bytes());
      const gpu::DeviceBuffer host_p = read("p", pixels.bytes()), host_q = read("q", pixels.bytes());
      const gpu::DeviceBuffer host[] = {read("right", grid.bytes()), read("across", grid.bytes()),
                                        read("down", grid.bytes()), read("alone", grid.bytes())};
      gpu::Commands commands(context());
      commands.begin();
      images.record(commands);
      contact.record(commands, images.frame, images.background, records);
      slope.record_slopes(commands, images.frame, images.background, p, q, clipped);
      const CellFaceMaps faces{across.buffer, down.buffer, field};
      slope.record_known(commands, images.frame, images.background, pairs, right, clipped, &faces);
      slope.record_known(commands, images.frame, images.background, pairs, plain, clipped);
      commands.copy(p.buffer, host_p, pixels.bytes());
      commands.copy(q.buffer, host_q, pixels.bytes());
      const FloatMap* maps[] = {&right, &across, &down, &plain};
      for (size_t i = 0; i < 4; ++i) commands.copy(maps[i]->buffer, host[i], grid.bytes());
      commands.host_barrier();
      commands.end();
      commands.submit();
      commands.wait();
      std::vector<float> gradients;
      for (uint32_t y = 0; y < height; ++y)
        for (uint32_t x = 0; x < width; ++x) {
          const size_t at = size_t{y} * pixels.pitch * 4 + x;
          for (const gpu::DeviceBuffer* from : {&host_p, &host_q})
            gradients.push_back(from->as<const float>()[at] * static_cast<float>(sensor.pitch_mm_per_px));
        }
      const Cells wanted = cells_of(weighted_faces(gradients, weights, width, height));
      const std::string scene = std::to_string(width) + "x" + std::to_string(height);
      if (!shading) {
        const reference::Slopes slopes = reference::photometric_slopes(image, rest, sensor);
        std::vector<double> expected;
        for (size_t i = 0; i < slopes.p.size(); ++i)
          for (const double value : {slopes.p[i], slopes.q[i]})
            expected.push_back(value * sensor.pitch_mm_per_px);
        expect_near(gradients, expected, 1e-4, scene + " slopes", 2 * width);
      }
      const auto near = [&](const gpu::DeviceBuffer& from, const std::vector<double>& values, bool faces_of) {
        std::vector<float> got;
        for (uint32_t y = 0; y < grid.height; ++y)
          for (uint32_t x = 0; x < grid.width; ++x) {
            const float value = from.as<const float>()[size_t{y} * grid.pitch * 4 + x];
            got.push_back(faces_of ? std::max(value, 0.0f) : value);  // faces that say nothing are negative
          }
        expect_near(got, values, 2e-5, scene, grid.width);
      };
      near(host[0], wanted.right, false);
      near(host[1], wanted.across, true);
      near(host[2], wanted.down, true);
      near(host[3], wanted.right, false);
      double sum = 0;
      for (uint32_t i = 0; i < slope.strips(); ++i) sum += double{field.as<const float>()[i]};
      EXPECT_NEAR(sum, wanted.field, 1e-4 * wanted.field + 1e-12) << scene;
    }
}

}  // namespace
}  // namespace palpate
