// Fourier and cosine transforms, convolutions and the exact solve, against the sums that define them.
#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <numbers>
#include <random>
#include <tuple>
#include <vector>

#include "engine/numeric/poisson_dct.h"
#include "engine/numeric/transform/convolution.h"
#include "engine/numeric/transform/cosine_transform.h"
#include "engine/numeric/transform/lane_fft.h"
#include "engine/numeric/transform/lane_map.h"

namespace palpate {
namespace {

// Relative RMS error.
constexpr double kFftError = 2e-15, kCosineError = 3e-15, kConvolutionError = 2e-15;

std::vector<LaneRow> random_rows(uint32_t count, uint32_t size) {
  std::mt19937 random(size);
  std::normal_distribution<double> normal(0, 1);
  std::vector<LaneRow> rows(count);
  for (uint32_t i = 0; i < size; ++i)
    for (double& value : rows[i].values) value = normal(random);
  return rows;
}

std::vector<double> random_map(size_t size, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal(0, 1);
  std::vector<double> map(size);
  for (double& value : map) value = normal(random);
  return map;
}

/// cos and sin of 2 pi i / n, of whole numbers so that large products lose no digits.
std::complex<double> root(uint64_t i, uint64_t n) {
  return std::polar(1.0, -2 * std::numbers::pi * static_cast<double>(i % n) / static_cast<double>(n));
}

/// Every size up to 64, and larger ones: those of frames and their paddings, powers of each radix, primes
/// that take part and primes that do not.
std::vector<uint32_t> sizes() {
  std::vector<uint32_t> all;
  for (uint32_t size = 1; size <= 64; ++size) all.push_back(size);
  for (const uint32_t size : {67u,  81u,  120u, 122u, 125u, 134u, 160u, 210u, 240u,  256u, 320u,
                              341u, 343u, 480u, 512u, 521u, 640u, 720u, 960u, 1042u, 1280u})
    all.push_back(size);
  return all;
}

TEST(LaneFft, IsItsSumInEveryLane) {
  for (const uint32_t n : sizes()) {
    const LaneFft fft(n);
    ASSERT_GE(fft.rows(), n);
    std::vector<LaneRow> data = random_rows(fft.rows(), n), scratch(fft.rows());
    const std::vector<LaneRow> before = data;
    const LaneRow* found = fft.forward(data.data(), scratch.data());
    double wrong = 0, whole = 0;
    for (uint32_t k = 0; k<n; k += n> 64 ? 7 : 1)
      for (uint32_t lane = 0; lane<kLaneCount; lane += n> 64 ? 7 : 1) {
        std::complex<double> sum = 0;
        for (uint32_t j = 0; j < n; ++j)
          sum += std::complex(before[j].re()[lane], before[j].im()[lane]) * root(uint64_t{j} * k, n);
        wrong += std::norm(sum - std::complex(found[k].re()[lane], found[k].im()[lane]));
        whole += std::norm(sum);
      }
    EXPECT_LE(std::sqrt(wrong / whole), kFftError) << n;
  }
}

TEST(LaneFft, ComesBack) {
  for (const uint32_t n : sizes()) {
    const LaneFft fft(n);
    std::vector<LaneRow> data = random_rows(fft.rows(), n), scratch(fft.rows());
    const std::vector<LaneRow> before = data;
    LaneRow* waves = fft.forward(data.data(), scratch.data());
    const LaneRow* back = fft.backward(waves, waves == data.data() ? scratch.data() : data.data());
    double wrong = 0, whole = 0;
    for (uint32_t i = 0; i < n; ++i)
      for (uint32_t lane = 0; lane < 2 * kLaneCount; ++lane) {
        wrong += std::pow(back[i].values[lane] / n - before[i].values[lane], 2);
        whole += std::pow(before[i].values[lane], 2);
      }
    EXPECT_LE(std::sqrt(wrong / whole), kFftError) << n;
  }
}

TEST(CosineTransform, IsItsSumInEveryLine) {
  for (const uint32_t n : sizes()) {
    const CosineTransform cosine(n);
    const std::vector<LaneRow> lines = random_rows(n, n);
    std::vector<LaneRow> data(cosine.rows()), scratch(cosine.rows());
    for (uint32_t i = 0; i < n; ++i) data[cosine.place(i)] = lines[i];
    LaneRow* waves = cosine.forward(data.data(), scratch.data());
    double wrong = 0, whole = 0;
    for (uint32_t k = 0; k<n; k += n> 64 ? 7 : 1)
      for (uint32_t lane = 0; lane<2 * kLaneCount; lane += n> 64 ? 5 : 1) {
        double sum = 0;
        for (uint32_t i = 0; i < n; ++i)
          sum += 2 * lines[i].values[lane] * root(uint64_t{k} * (2 * i + 1), uint64_t{4} * n).real();
        wrong += std::pow(sum - waves[k].values[lane], 2);
        whole += sum * sum;
      }
    EXPECT_LE(std::sqrt(wrong / whole), kCosineError) << n;
    const LaneRow* back = cosine.backward(waves, waves == data.data() ? scratch.data() : data.data());
    wrong = whole = 0;
    for (uint32_t i = 0; i < n; ++i)
      for (uint32_t lane = 0; lane < 2 * kLaneCount; ++lane) {
        wrong += std::pow(back[cosine.place(i)].values[lane] / (2 * n) - lines[i].values[lane], 2);
        whole += std::pow(lines[i].values[lane], 2);
      }
    EXPECT_LE(std::sqrt(wrong / whole), kCosineError) << n << ", and back";
  }
}

TEST(LaneMap, HasTheSameMapAlongBothAxes) {
  constexpr uint32_t kWidth = 37, kHeight = 21;
  LaneMap map(kWidth, kHeight);
  ASSERT_EQ(map.column_blocks(), 3u);
  ASSERT_EQ(map.row_blocks(), 2u);
  const auto value = [](uint32_t x, uint32_t y) { return x + 1000.0 * y; };
  for (uint32_t x = 0; x < kWidth; ++x)
    for (uint32_t y = 0; y < kHeight; ++y)
      map.columns(x / LaneMap::kSide)[y].values[x % LaneMap::kSide] = value(x, y);
  const auto backwards = [](uint32_t x) { return kWidth - 1 - x; };
  std::vector<LaneRow> rows(kWidth);
  for (uint32_t block = 0; block < 2; ++block) {
    map.read_rows(block, rows.data(), backwards);
    for (uint32_t x = 0; x < kWidth; ++x)
      for (uint32_t i = 0; i < LaneMap::kSide && block * LaneMap::kSide + i < kHeight; ++i) {
        ASSERT_EQ(rows[backwards(x)].values[i], value(x, block * LaneMap::kSide + i)) << x << " " << i;
        rows[backwards(x)].values[i] *= -1;
      }
    map.write_rows(block, rows.data(), backwards);
  }
  for (uint32_t x = 0; x < kWidth; ++x)
    for (uint32_t y = 0; y < kHeight; ++y)
      ASSERT_EQ(map.columns(x / LaneMap::kSide)[y].values[x % LaneMap::kSide], -value(x, y));
}

/// What `answer`, odd or even along each axis, makes of `from`.
std::vector<double> convolved(const std::vector<double>& from, const std::vector<double>& answer,
                              bool odd_in_x, bool odd_in_y, int width, int height) {
  std::vector<double> to(from.size());
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      for (int row = 0; row < height; ++row)
        for (int column = 0; column < width; ++column) {
          const bool turned = (odd_in_x && x < column) != (odd_in_y && y < row);
          const double at = answer[static_cast<size_t>(std::abs(y - row) * width + std::abs(x - column))];
          to[static_cast<size_t>(y * width + x)] +=
              (turned ? -at : at) * from[static_cast<size_t>(row * width + column)];
        }
  return to;
}

double difference(const std::vector<double>& a, const std::vector<double>& b) {
  double wrong = 0, whole = 0;
  for (size_t i = 0; i < a.size(); ++i) {
    wrong += std::pow(a[i] - b[i], 2);
    whole += b[i] * b[i];
  }
  return std::sqrt(wrong / whole);
}

TEST(Convolution, IsTheSumOverTheMapAlone) {
  for (const auto& [w, h] : {std::pair{1u, 1u}, {1u, 9u}, {5u, 2u}, {16u, 16u}, {17u, 31u}, {40u, 23u}}) {
    Convolution convolution(w, h);
    const std::vector<double> a = random_map(w * h, 1), b = random_map(w * h, 2);
    std::array<std::vector<double>, 4> answers, of_a, of_b;
    std::array<Convolution::Kernel, 4> kernels;
    for (const bool odd_in_x : {false, true})
      for (const bool odd_in_y : {false, true}) {
        const size_t i = 2 * odd_in_x + odd_in_y;
        answers[i] = random_map(w * h, 3 + static_cast<unsigned>(i));
        // An odd answer is 0 on its axis.
        for (uint32_t y = 0; y < h; ++y)
          for (uint32_t x = 0; x < w; ++x)
            if ((odd_in_x && x == 0) || (odd_in_y && y == 0)) answers[i][y * w + x] = 0;
        kernels[i] = convolution.kernel(answers[i], odd_in_x, odd_in_y);
        of_a[i] = convolved(a, answers[i], odd_in_x, odd_in_y, static_cast<int>(w), static_cast<int>(h));
        of_b[i] = convolved(b, answers[i], odd_in_x, odd_in_y, static_cast<int>(w), static_cast<int>(h));
      }
    std::vector<double> c(a.size()), d(a.size()), wanted_c(a.size()), wanted_d(a.size());
    for (size_t i = 0; i < a.size(); ++i) {
      wanted_c[i] = of_a[1][i] + of_b[0][i];
      wanted_d[i] = -2 * (of_a[3][i] + of_b[2][i]);
    }
    const Convolution::Map<const double> from[] = {{a.data(), w}, {b.data(), w}};
    const Convolution::Sum<double> sums[] = {{{c.data(), w}, {&kernels[1], &kernels[0]}},
                                             {{d.data(), w}, {&kernels[3], &kernels[2]}, -2}};
    convolution.apply<double>(from, sums);
    EXPECT_LE(difference(c, wanted_c), kConvolutionError) << w << " x " << h;
    if (w > 1) {
      EXPECT_LE(difference(d, wanted_d), kConvolutionError) << w << " x " << h;
    }
    // One in, two out, over the input itself and in rows that are farther apart than they are long.
    std::vector<double> wide(size_t{w + 3} * h, 7), in_place(wide);
    for (uint32_t y = 0; y < h; ++y) std::copy_n(a.begin() + y * w, w, in_place.begin() + y * (w + 3));
    const Convolution::Map<const double> one[] = {{in_place.data(), w + 3}};
    const Convolution::Sum<double> two[] = {{{in_place.data(), w + 3}, {&kernels[0]}},
                                            {{wide.data(), w + 3}, {&kernels[1]}}};
    convolution.apply<double>(one, two);
    for (uint32_t y = 0; y < h; ++y) {
      for (uint32_t x = 0; x < w; ++x) {
        EXPECT_NEAR(in_place[y * (w + 3) + x], of_a[0][y * w + x], 1e-12);
        EXPECT_NEAR(wide[y * (w + 3) + x], of_a[1][y * w + x], 1e-12);
      }
      EXPECT_EQ(wide[y * (w + 3) + w], 7) << "what lies between rows stays";
    }
  }
}

// Heights to right sides in plain sums, and back.
TEST(PoissonDct, InvertsTheDifferencesOfNeighbours) {
  for (const auto& [w, h] : {std::pair{1u, 1u}, {1u, 5u}, {7u, 1u}, {16u, 16u}, {33u, 20u}, {67u, 45u}}) {
    std::vector<double> z = random_map(w * h, 9), right(z.size());
    double mean = 0;
    for (const double value : z) mean += value / static_cast<double>(z.size());
    for (double& value : z) value -= mean;
    const auto link = [&](size_t a, size_t b) {
      right[a] += z[a] - z[b];
      right[b] += z[b] - z[a];
    };
    for (uint32_t y = 0; y < h; ++y)
      for (uint32_t x = 0; x < w; ++x) {
        if (x + 1 < w) link(y * w + x, y * w + x + 1);
        if (y + 1 < h) link(y * w + x, (y + 1) * w + x);
      }
    std::vector<double> found(z.size(), 1);
    for (double& value : right) value += 3;  // no solution has a mean
    PoissonDct(w, h).solve(right.data(), found.data(), w);
    for (size_t i = 0; i < z.size(); ++i) ASSERT_NEAR(found[i], z[i], 1e-12) << w << " x " << h;
  }
}

}  // namespace
}  // namespace palpate
