// Stiff and extreme images: the sums are exact to the last bit whatever the frame holds, and the table of
// perf/results/stiff_and_extreme.md lists the result of each case. Cases of the surface are in
// extreme_surface_test.cpp.
#include <array>
#include <cmath>
#include <numeric>

#include "engine/gpu/commands.h"
#include "tests/reference/contact.h"
#include "tests/support/gpu_fixture.h"
#include "tests/support/memory_left.h"
#include "tests/support/stage_run.h"
#include "tests/support/thorough.h"

namespace palpate {
namespace {

Sensor sensor_for(const FrameFormat& format, double threshold_gray) {
  Sensor sensor;
  sensor.name = "extreme";
  sensor.pitch_mm_per_px = 0.1;
  sensor.channels = format.channels;
  sensor.bit_depth = format.bit_depth;
  sensor.threshold_gray = threshold_gray;
  sensor.saturation_gray = format.max_gray();
  return sensor;
}

std::string described(const ContactMoments& m) {
  std::string out;
  for (const int64_t value : {static_cast<int64_t>(m.area), static_cast<int64_t>(m.gray), m.gray_x, m.gray_y,
                              m.x, m.y, m.xx, m.xy, m.yy, int64_t{m.peak}, static_cast<int64_t>(m.saturated)})
    out += (out.empty() ? "" : " ") + std::to_string(value);
  return out;
}

std::string described(const FrameFormat& f) {
  return std::to_string(f.width) + "x" + std::to_string(f.height) + "x" + std::to_string(f.channels) +
         " of " + std::to_string(f.bit_depth) + " bits";
}

class ExtremeContact : public GpuTest {
 protected:
  static ContactMoments run(const Frame& image, const Frame& rest, const Sensor& sensor) {
    return ContactRun(context(), image.format, sensor, false, default_tuning(context()))(image, rest).moments;
  }
  /// Equal to the plain loops, to the last bit.
  static ContactMoments expect_exact(const Frame& image, const Frame& rest, const Sensor& sensor,
                                     const std::string& what) {
    const ContactMoments got = run(image, rest, sensor), wanted = reference::moments(image, rest, sensor);
    EXPECT_EQ(got, wanted) << what << ", " << described(image.format) << "\n got    " << described(got)
                           << "\n wanted " << described(wanted);
    return got;
  }
};

const std::array kFormats = {FrameFormat{97, 83, 1, 8}, FrameFormat{97, 83, 1, 10},
                             FrameFormat{97, 83, 1, 12}, FrameFormat{97, 83, 1, 16},
                             FrameFormat{97, 83, 3, 8}};

TEST_F(ExtremeContact, AllBlack) {
  for (const FrameFormat& format : kFormats) {
    const Frame black = uniform_frame(format, 0), white = uniform_frame(format, format.max_gray());
    const ContactMoments untouched = expect_exact(black, black, sensor_for(format, 1), "black on black");
    EXPECT_EQ(untouched, ContactMoments{});
    EXPECT_EQ(expect_exact(black, white, sensor_for(format, 1), "black on white").area, 0u)
        << "darker is no touch";
    Sensor ink = sensor_for(format, 1);
    ink.signal = Signal::Darker;
    EXPECT_EQ(expect_exact(black, white, ink, "black on white, ink").area, uint64_t{97} * 83);
    // A threshold of 0 makes every pixel contact, though none has any gray.
    const ContactMoments all = expect_exact(black, black, sensor_for(format, 0), "black, threshold 0");
    EXPECT_EQ(all.area, uint64_t{97} * 83);
    EXPECT_EQ(all.gray, 0u);
  }
}

TEST_F(ExtremeContact, AllWhite) {
  for (const FrameFormat& format : kFormats) {
    const Frame black = uniform_frame(format, 0), white = uniform_frame(format, format.max_gray());
    const ContactMoments m =
        expect_exact(white, black, sensor_for(format, format.max_gray()), "white on black");
    EXPECT_EQ(m.area, uint64_t{97} * 83);
    EXPECT_EQ(m.gray, m.area * format.max_gray() * 256);
    EXPECT_EQ(m.saturated, m.area);
    EXPECT_EQ(expect_exact(white, white, sensor_for(format, 1), "white on white").area, 0u);
  }
}

// One pixel of full brightness is 25 pixels after the filter, whose sum is the pixel's (less what the mirror
// adds at an edge).
TEST_F(ExtremeContact, OneBrightPixel) {
  for (const FrameFormat& format : kFormats) {
    const Frame black = uniform_frame(format, 0);
    for (const auto& [x, y] :
         {std::pair{0u, 0u}, {96u, 0u}, {0u, 82u}, {96u, 82u}, {48u, 41u}, {31u, 63u}, {32u, 64u}}) {
      Frame image = black;
      for (uint32_t c = 0; c < format.channels; ++c) image.set(c, x, y, format.max_gray());
      const ContactMoments m = expect_exact(image, black, sensor_for(format, 1.0 / 128), "one bright pixel");
      EXPECT_EQ(m.saturated, 1u);
      if (x >= 2 && y >= 2 && x < 95 && y < 81) {
        EXPECT_EQ(m.area, 25u);
        EXPECT_EQ(m.gray, uint64_t{format.max_gray()} * 256);
        EXPECT_EQ(m.gray_x, (int64_t{x} - 48) * static_cast<int64_t>(m.gray));
        EXPECT_EQ(m.gray_y, (int64_t{y} - 41) * static_cast<int64_t>(m.gray));
      }
    }
  }
}

TEST_F(ExtremeContact, EachBorderAndTheWholeFrame) {
  for (const FrameFormat& format : kFormats) {
    const Frame black = uniform_frame(format, 0);
    const auto ball = [&](double cx, double cy, double radius) {
      Frame image = black;
      for (uint32_t c = 0; c < format.channels; ++c)
        for (uint32_t y = 0; y < format.height; ++y)
          for (uint32_t x = 0; x < format.width; ++x)
            if (std::hypot(x - cx, y - cy) < radius) image.set(c, x, y, format.max_gray() / 2);
      return image;
    };
    for (const auto& [cx, cy] :
         {std::pair{0.0, 41.0}, {96.0, 41.0}, {48.0, 0.0}, {48.0, 82.0}, {0.0, 0.0}, {96.0, 82.0}})
      EXPECT_GT(expect_exact(ball(cx, cy, 20), black, sensor_for(format, 4), "at a border").area, 300u);
    EXPECT_EQ(expect_exact(ball(48, 41, 200), black, sensor_for(format, 4), "the whole frame").area,
              uint64_t{97} * 83);
  }
}

TEST_F(ExtremeContact, Checkerboard) {
  for (const FrameFormat& format : kFormats) {
    const Frame black = uniform_frame(format, 0);
    for (const uint32_t side : {1u, 2u, 3u, 16u}) {
      Frame image = black;
      for (uint32_t c = 0; c < format.channels; ++c)
        for (uint32_t y = 0; y < format.height; ++y)
          for (uint32_t x = 0; x < format.width; ++x)
            if ((x / side + y / side) % 2) image.set(c, x, y, format.max_gray());
      for (const double threshold : {0.0, 0.45 * format.max_gray(), 0.55 * format.max_gray()})
        expect_exact(image, black, sensor_for(format, threshold), "checkerboard of " + std::to_string(side));
    }
  }
}

TEST_F(ExtremeContact, FramesOfOneToThreePixelsASide) {
  std::mt19937 random(5);
  for (uint32_t height = 1; height <= 3; ++height) {
    for (uint32_t width = 1; width <= 3; ++width) {
      for (FrameFormat format : kFormats) {
        format.width = width;
        format.height = height;
        const Frame image = random_frame(format, 0, format.max_gray(), random),
                    rest = random_frame(format, 0, 9, random);
        expect_exact(image, rest, sensor_for(format, 0), "tiny");
        expect_exact(image, rest, sensor_for(format, 0.5 * format.max_gray()), "tiny");
      }
    }
  }
}

TEST_F(ExtremeContact, Strips) {
  std::mt19937 random(6);
  for (const auto& [width, height] : {std::pair{16384u, 16u}, {16u, 16384u}, {16384u, 1u}, {1u, 16384u}}) {
    for (FrameFormat format : {FrameFormat{width, height, 1, 8}, FrameFormat{width, height, 1, 16},
                               FrameFormat{width, height, 3, 8}}) {
      const Frame image = random_frame(format, 0, format.max_gray(), random), rest = uniform_frame(format, 0);
      expect_exact(image, rest, sensor_for(format, 0.5 * format.max_gray()), "strip");
      expect_exact(uniform_frame(format, format.max_gray()), rest, sensor_for(format, 0), "white strip");
    }
  }
}

// Tile heights and workgroups are choices of speed only: the same bits for each, and for each run.
TEST_F(ExtremeContact, TilesAndRunsDoNotMatter) {
  std::mt19937 random(7);
  for (FrameFormat format : kFormats) {
    format.width = 211;
    format.height = 190;
    const Frame image = random_frame(format, 0, format.max_gray(), random),
                rest = random_frame(format, 0, 20, random);
    const Sensor sensor = sensor_for(format, 0.4 * format.max_gray());
    const ContactMoments wanted = reference::moments(image, rest, sensor);
    for (const auto& [rows, workgroup] :
         {std::pair{0u, 64u}, {2u, 8u}, {8u, 64u}, {18u, 32u}, {32u, 128u}, {64u, 16u}}) {
      Tuning tuning = default_tuning(context());
      tuning.contact_tiles = rows == 0;
      tuning.contact_rows = rows;
      tuning.contact_rows_keeping = rows;
      tuning.contact_workgroup = workgroup;
      ContactRun run(context(), format, sensor, workgroup > 32, tuning);
      for (int again = 0; again < 2; ++again)
        ASSERT_EQ(run(image, rest).moments, wanted)
            << described(format) << " rows " << rows << " workgroup " << workgroup << " run " << again;
    }
  }
}

/// Sums of an all-white frame, term by term in 128 bits, so that an overflow here would show too.
ContactMoments all_white(const FrameFormat& format) {
  __extension__ using Wide = __int128;
  Wide x = 0, y = 0, xx = 0, yy = 0;
  for (uint32_t i = 0; i < format.width; ++i) {
    const Wide at = Wide{i} - format.width / 2;
    x += at;
    xx += at * at;
  }
  for (uint32_t i = 0; i < format.height; ++i) {
    const Wide at = Wide{i} - format.height / 2;
    y += at;
    yy += at * at;
  }
  const Wide w = format.width, h = format.height, g = Wide{format.max_gray()} * 256;
  const auto narrow = [](Wide value) {
    EXPECT_LT(value, Wide{1} << 63);
    EXPECT_GT(value, -(Wide{1} << 63));
    return static_cast<int64_t>(value);
  };
  ContactMoments m;
  m.area = m.saturated = static_cast<uint64_t>(narrow(w * h));
  m.gray = static_cast<uint64_t>(narrow(w * h * g));
  m.gray_x = narrow(x * h * g);
  m.gray_y = narrow(y * w * g);
  m.x = narrow(x * h);
  m.y = narrow(y * w);
  m.xx = narrow(xx * h);
  m.yy = narrow(yy * w);
  m.xy = narrow(x * y);
  m.peak = static_cast<uint32_t>(g);
  m.border = true;
  return m;
}

// The largest sums there are: 2^26 pixels at full scale, square and as a bar, for every depth; by default for
// the least and the greatest.
TEST_F(ExtremeContact, AllWhiteUpToTheLargestFrame) {
  constexpr double kNeeded_GiB = 2;
  if (memory_left_GiB() < kNeeded_GiB)
    GTEST_SKIP() << "NOT CHECKED at 8192 x 8192: " << memory_left_GiB() << " GiB of memory left, needs "
                 << kNeeded_GiB;
  for (const uint32_t bits : part_of<uint32_t>({8, 10, 12, 14, 16}, 4)) {
    for (const auto& [width, height] : {std::pair{8192u, 8192u}, {16384u, 4096u}, {4096u, 16384u}}) {
      if (width != 8192 && bits != 16) continue;
      const FrameFormat format{width, height, 1, bits};
      const Frame black = uniform_frame(format, 0), white = uniform_frame(format, format.max_gray());
      ContactRun run(context(), format, sensor_for(format, 0), false, default_tuning(context()));
      const ContactMoments got = run(white, black).moments, wanted = all_white(format);
      EXPECT_EQ(got, wanted) << described(format) << "\n got    " << described(got) << "\n wanted "
                             << described(wanted);
    }
  }
  const FrameFormat color{8192, 8192, 3, 8};
  const ContactMoments got = run(uniform_frame(color, 255), uniform_frame(color, 0), sensor_for(color, 0));
  EXPECT_EQ(got, all_white(color)) << described(got);
}

// The same without the filter, and without anything to subtract; by default of 16 bits and in colour.
TEST_F(ExtremeContact, AllWhiteUpToTheLargestFrameWithoutTheFilter) {
  constexpr double kNeeded_GiB = 2;
  if (memory_left_GiB() < kNeeded_GiB)
    GTEST_SKIP() << "NOT CHECKED at 8192 x 8192: " << memory_left_GiB() << " GiB of memory left, needs "
                 << kNeeded_GiB;
  for (const FrameFormat& format : part_of<FrameFormat>({{8192, 8192, 1, 16},
                                                         {16384, 4096, 1, 8},
                                                         {8192, 8192, 1, 8},
                                                         {8192, 8192, 3, 8},
                                                         {4096, 16384, 1, 8}},
                                                        3)) {
    Sensor sensor = sensor_for(format, format.max_gray());
    sensor.filter = Filter::None;
    sensor.background.kind = BackgroundKind::None;
    const ContactMoments got =
                             run(uniform_frame(format, format.max_gray()), uniform_frame(format, 0), sensor),
                         wanted = all_white(format);
    EXPECT_EQ(got, wanted) << described(format) << "\n got    " << described(got) << "\n wanted "
                           << described(wanted);
  }
}

// Noise on the largest frame against a plain separable filter.
TEST_F(ExtremeContact, NoiseOnTheLargestFrame) {
  constexpr double kNeeded_GiB = 3;
  if (memory_left_GiB() < kNeeded_GiB)
    GTEST_SKIP() << "NOT CHECKED at 8192 x 8192: " << memory_left_GiB() << " GiB of memory left, needs "
                 << kNeeded_GiB;
  const FrameFormat format{8192, 8192, 1, 16};
  Frame image = uniform_frame(format, 0);
  const Frame black = image;
  uint64_t state = 88172645463325252ull;  // xorshift: the standard generators take seconds for so many
  for (size_t at = 0; at < image.bytes.size(); at += 8) {
    state ^= state << 13;
    state ^= state >> 7;
    state ^= state << 17;
    std::memcpy(image.bytes.data() + at, &state, 8);
  }
  const Sensor sensor = sensor_for(format, 30000);
  const ContactMoments got = run(image, black, sensor);

  constexpr int kSide = 8192;
  constexpr std::array<uint32_t, 5> kWeights{1, 4, 6, 4, 1};
  const uint32_t threshold = 30000 * 256;
  std::array<std::vector<uint32_t>, 5> across;  // the last five rows, filtered across
  const auto filter_row = [&](int y) {
    std::vector<uint32_t>& row = across[static_cast<size_t>(y % 5)];
    row.assign(kSide, 0);
    std::vector<uint16_t> raw(kSide + 4);
    std::memcpy(raw.data() + 2, image.row(0, static_cast<uint32_t>(y)), kSide * 2);
    raw[0] = raw[1] = raw[2];
    raw[kSide + 2] = raw[kSide + 3] = raw[kSide + 1];
    for (size_t x = 0; x < kSide; ++x)
      for (size_t i = 0; i < 5; ++i) row[x] += kWeights[i] * raw[x + i];
  };
  ContactMoments wanted;
  for (int y = 0; y < 3; ++y) filter_row(y);
  for (int y = 0; y < kSide; ++y) {
    if (y > 0 && y + 2 < kSide) filter_row(y + 2);
    std::array<const uint32_t*, 5> rows{};
    for (int j = 0; j < 5; ++j)
      rows[static_cast<size_t>(j)] =
          across[static_cast<size_t>(std::clamp(y + j - 2, 0, kSide - 1) % 5)].data();
    const auto* raw = reinterpret_cast<const uint16_t*>(image.row(0, static_cast<uint32_t>(y)));
    for (int x = 0; x < kSide; ++x) {
      wanted.saturated += raw[x] == 65535;
      const uint32_t g = rows[0][x] + rows[4][x] + 4 * (rows[1][x] + rows[3][x]) + 6 * rows[2][x];
      if (g < threshold) continue;
      const int64_t cx = x - kSide / 2, cy = y - kSide / 2;
      wanted.area += 1;
      wanted.gray += g;
      wanted.gray_x += cx * g;
      wanted.gray_y += cy * g;
      wanted.x += cx;
      wanted.y += cy;
      wanted.xx += cx * cx;
      wanted.xy += cx * cy;
      wanted.yy += cy * cy;
      wanted.peak = std::max(wanted.peak, g);
      wanted.border |= x == 0 || y == 0 || x == kSide - 1 || y == kSide - 1;
    }
  }
  EXPECT_EQ(got, wanted) << "\n got    " << described(got) << "\n wanted " << described(wanted);
  EXPECT_GT(got.area, uint64_t{1} << 24);
}

}  // namespace
}  // namespace palpate
