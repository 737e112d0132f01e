#include "engine/numeric/transform/convolution.h"

#include <algorithm>

#include "engine/base/divide_up.h"
#include "engine/base/simd.h"

namespace palpate {
namespace {

constexpr uint32_t kSide = 2 * kLaneCount;  // real columns that are transformed at once

/// Eight waves of sixteen columns: real and imaginary parts of the first eight and of the others.
struct Tile {
  using Square = std::array<std::array<double, kLaneCount>, kLaneCount>;
  Square re, im, other_re, other_im;
};

PALPATE_INLINE void transpose(const Tile::Square& from, Tile::Square& to) {
  for (uint32_t i = 0; i < kLaneCount; ++i)
    for (uint32_t j = 0; j < kLaneCount; ++j) to[j][i] = from[i][j];
}

/// Two columns that share a lane as a + i b, taken apart: twice their spectra, from wave `first` on.
struct TakeApart {
  const LaneRow* z;
  uint32_t size, first;
  LaneRow* to;  ///< 16 columns

  PALPATE_INLINE void run() const {
    Tile waves{}, columns;
    const uint32_t count = std::min(kLaneCount, size / 2 + 1 - first);
    for (uint32_t i = 0; i < count; ++i) {
      const LaneRow &low = z[first + i], &high = z[first + i == 0 ? 0 : size - first - i];
      for (uint32_t lane = 0; lane < kLaneCount; ++lane) {
        waves.re[i][lane] = low.re()[lane] + high.re()[lane];
        waves.im[i][lane] = low.im()[lane] - high.im()[lane];
        waves.other_re[i][lane] = low.im()[lane] + high.im()[lane];
        waves.other_im[i][lane] = high.re()[lane] - low.re()[lane];
      }
    }
    transpose(waves.re, columns.re);
    transpose(waves.im, columns.im);
    transpose(waves.other_re, columns.other_re);
    transpose(waves.other_im, columns.other_im);
    for (uint32_t x = 0; x < kLaneCount; ++x)
      for (uint32_t lane = 0; lane < kLaneCount; ++lane) {
        to[x].re()[lane] = columns.re[x][lane];
        to[x].im()[lane] = columns.im[x][lane];
        to[x + kLaneCount].re()[lane] = columns.other_re[x][lane];
        to[x + kLaneCount].im()[lane] = columns.other_im[x][lane];
      }
  }
};

struct PutTogether {
  const LaneRow* from;  ///< 16 columns
  uint32_t size, first;
  LaneRow* z;

  PALPATE_INLINE void run() const {
    Tile waves, columns;
    for (uint32_t x = 0; x < kLaneCount; ++x)
      for (uint32_t lane = 0; lane < kLaneCount; ++lane) {
        columns.re[x][lane] = from[x].re()[lane];
        columns.im[x][lane] = from[x].im()[lane];
        columns.other_re[x][lane] = from[x + kLaneCount].re()[lane];
        columns.other_im[x][lane] = from[x + kLaneCount].im()[lane];
      }
    transpose(columns.re, waves.re);
    transpose(columns.im, waves.im);
    transpose(columns.other_re, waves.other_re);
    transpose(columns.other_im, waves.other_im);
    const uint32_t count = std::min(kLaneCount, size / 2 + 1 - first);
    for (uint32_t i = 0; i < count; ++i) {
      LaneRow &low = z[first + i], &high = z[first + i == 0 ? 0 : size - first - i];
      for (uint32_t lane = 0; lane < kLaneCount; ++lane) {
        high.re()[lane] = waves.re[i][lane] + waves.other_im[i][lane];
        high.im()[lane] = waves.other_re[i][lane] - waves.im[i][lane];
        low.re()[lane] = waves.re[i][lane] - waves.other_im[i][lane];
        low.im()[lane] = waves.other_re[i][lane] + waves.im[i][lane];
      }
    }
  }
};

/// Products with a kernel's spectrum, the first of a sum or more of it.
struct Multiply {
  const LaneRow* in;
  const std::array<double, kLaneCount>* spectrum;
  bool odd, more;
  uint32_t count;
  LaneRow* out;

  PALPATE_INLINE void run() const {
    for (uint32_t k = 0; k < count; ++k) {
      const double* re = odd ? in[k].im() : in[k].re();
      const double* im = odd ? in[k].re() : in[k].im();
      const double sign = odd ? -1 : 1;
      for (uint32_t lane = 0; lane < kLaneCount; ++lane) {
        const double by = spectrum[k][lane];
        const double product_re = sign * by * re[lane], product_im = by * im[lane];
        out[k].re()[lane] = more ? out[k].re()[lane] + product_re : product_re;
        out[k].im()[lane] = more ? out[k].im()[lane] + product_im : product_im;
      }
    }
  }
};

}  // namespace

Convolution::Convolution(uint32_t width, uint32_t height)
    : width_(width),
      height_(height),
      // Twice the map less one: nothing reaches a cell around the transform's edge.
      along_x_(next_good_size(2 * width - 1)),
      along_y_(next_good_size(2 * height - 1)) {
  const uint32_t rows = std::max(along_x_.rows(), along_y_.rows());
  for (auto& pair : rows_)
    for (Rows& one : pair) one.resize(rows);
  spare_.resize(rows);
}

uint32_t Convolution::wave_blocks() const {
  return divide_up(along_y_.size() / 2 + 1, kLaneCount);
}

uint32_t Convolution::padded_columns(uint32_t columns) const {
  return divide_up(columns, kSide) * kSide;
}

template <typename Real>
void Convolution::transform_columns(Map<const Real> from, uint32_t columns, uint32_t rows, Rows& waves) {
  const uint32_t padded = padded_columns(columns);
  waves.resize(size_t{wave_blocks()} * padded);
  LaneRow* data = rows_[0][0].data();
  for (uint32_t left = 0; left < columns; left += kSide) {
    const uint32_t count = std::min(kSide, columns - left);
    for (uint32_t y = 0; y < rows; ++y) {
      const Real* row = from.values + size_t{y} * from.pitch + left;
      for (uint32_t i = 0; i < count; ++i) data[y].values[i] = static_cast<double>(row[i]);
      for (uint32_t i = count; i < kSide; ++i) data[y].values[i] = 0;
    }
    std::fill(data + rows, data + along_y_.size(), LaneRow{});
    const LaneRow* z = along_y_.forward(data, rows_[0][1].data());
    for (uint32_t block = 0; block < wave_blocks(); ++block)
      run_widest(
          TakeApart{z, along_y_.size(), block * kLaneCount, waves.data() + size_t{block} * padded + left});
  }
}

template <typename Real>
void Convolution::transform_back(const Rows& waves, Map<Real> to, double factor) {
  const uint32_t padded = padded_columns(width_);
  LaneRow* data = rows_[0][0].data();
  for (uint32_t left = 0; left < width_; left += kSide) {
    for (uint32_t block = 0; block < wave_blocks(); ++block)
      run_widest(PutTogether{waves.data() + size_t{block} * padded + left, along_y_.size(),
                             block * kLaneCount, data});
    const LaneRow* columns = along_y_.backward(data, rows_[0][1].data());
    const uint32_t count = std::min(kSide, width_ - left);
    for (uint32_t y = 0; y < height_; ++y) {
      Real* row = to.values + size_t{y} * to.pitch + left;
      for (uint32_t i = 0; i < count; ++i) row[i] = static_cast<Real>(factor * columns[y].values[i]);
    }
  }
}

const LaneRow* Convolution::transform_rows(const Rows& waves, uint32_t block, uint32_t columns,
                                           std::array<Rows, 2>& pair) {
  const LaneRow* from = waves.data() + size_t{block} * padded_columns(columns);
  LaneRow* data = pair[0].data();
  std::copy(from, from + columns, data);
  std::fill(data + columns, data + along_x_.size(), LaneRow{});
  return along_x_.forward(data, pair[1].data());
}

Convolution::Kernel Convolution::kernel(std::span<const double> answer, bool odd_in_x, bool odd_in_y) {
  const uint32_t columns = along_x_.size(), rows = along_y_.size();
  std::vector<double> around(size_t{columns} * rows);
  for (const bool up : {false, true})
    for (const bool left : {false, true})
      for (uint32_t y = up ? 1 : 0; y < height_; ++y)
        for (uint32_t x = left ? 1 : 0; x < width_; ++x)
          around[size_t{up ? rows - y : y} * columns + (left ? columns - x : x)] =
              (odd_in_x && left) != (odd_in_y && up) ? -answer[size_t{y} * width_ + x]
                                                     : answer[size_t{y} * width_ + x];
  Rows waves;
  transform_columns(Map<const double>{around.data(), columns}, columns, rows, waves);
  Kernel kernel;
  kernel.odd_ = odd_in_x != odd_in_y;
  // Two halves that TakeApart left out, and what the transforms multiply by.
  const double norm = 0.25 / (static_cast<double>(columns) * rows);
  for (uint32_t block = 0; block < wave_blocks(); ++block) {
    const LaneRow* spectrum = transform_rows(waves, block, columns, rows_[0]);
    for (uint32_t k = 0; k < columns; ++k) {
      std::array<double, kLaneCount>& to = kernel.spectrum_.emplace_back();
      for (uint32_t lane = 0; lane < kLaneCount; ++lane)
        to[lane] = norm * (kernel.odd_ ? spectrum[k].im() : spectrum[k].re())[lane];
    }
  }
  return kernel;
}

template <typename Real>
void Convolution::apply(std::span<const Map<const Real>> from, std::span<const Sum<Real>> sums) {
  const uint32_t padded = padded_columns(width_);
  for (Rows& waves : waves_)
    if (&waves - waves_.data() < static_cast<std::ptrdiff_t>(std::max(from.size(), sums.size())))
      waves.resize(size_t{wave_blocks()} * padded);
  for (size_t i = 0; i < from.size(); ++i) transform_columns(from[i], width_, height_, waves_[i]);
  for (uint32_t block = 0; block < wave_blocks(); ++block) {
    std::array<const LaneRow*, 2> spectra{};
    for (size_t i = 0; i < from.size(); ++i) spectra[i] = transform_rows(waves_[i], block, width_, rows_[i]);
    LaneRow* product = rows_[0][spectra[0] == rows_[0][0].data() ? 1 : 0].data();
    for (size_t j = 0; j < sums.size(); ++j) {
      bool more = false;
      for (size_t i = 0; i < from.size(); ++i) {
        const Kernel* kernel = sums[j].kernels[i];
        if (kernel == nullptr) continue;
        run_widest(Multiply{spectra[i], kernel->spectrum_.data() + size_t{block} * along_x_.size(),
                            kernel->odd_, more, along_x_.size(), product});
        more = true;
      }
      const LaneRow* answer = along_x_.backward(product, spare_.data());
      std::copy(answer, answer + width_, waves_[j].data() + size_t{block} * padded);
    }
  }
  for (size_t j = 0; j < sums.size(); ++j) transform_back(waves_[j], sums[j].to, sums[j].factor);
}

template void Convolution::apply(std::span<const Map<const float>>, std::span<const Sum<float>>);
template void Convolution::apply(std::span<const Map<const double>>, std::span<const Sum<double>>);

}  // namespace palpate
