#include "engine/numeric/transform/lane_fft.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "engine/base/simd.h"

namespace palpate {
namespace {

constexpr uint32_t kLargestRadix = 61;

/// kWidth numbers in one register. It may read and write a LaneRow's.
template <uint32_t kWidth>
struct Register;
template <>
struct Register<2> {
  typedef double Lanes __attribute__((vector_size(16), may_alias));
};
template <>
struct Register<4> {
  typedef double Lanes __attribute__((vector_size(32), may_alias));
};
template <>
struct Register<8> {
  typedef double Lanes __attribute__((vector_size(64), may_alias));
};

template <uint32_t kWidth>
struct Complex {
  typename Register<kWidth>::Lanes re, im;
};

template <uint32_t kWidth>
PALPATE_INLINE void load(const double* re, const double* im, Complex<kWidth>& to) {
  using Lanes = typename Register<kWidth>::Lanes;
  to.re = *reinterpret_cast<const Lanes*>(re);
  to.im = *reinterpret_cast<const Lanes*>(im);
}
template <uint32_t kWidth>
PALPATE_INLINE void store(const Complex<kWidth>& from, double* re, double* im) {
  using Lanes = typename Register<kWidth>::Lanes;
  *reinterpret_cast<Lanes*>(re) = from.re;
  *reinterpret_cast<Lanes*>(im) = from.im;
}
template <uint32_t kWidth>
PALPATE_INLINE void sum_and_difference(Complex<kWidth>& a, Complex<kWidth>& b) {
  const Complex<kWidth> x = a;
  a.re = x.re + b.re;
  a.im = x.im + b.im;
  b.re = x.re - b.re;
  b.im = x.im - b.im;
}
template <uint32_t kWidth>
PALPATE_INLINE void times_minus_i(Complex<kWidth>& a) {
  const auto re = a.re;
  a.re = a.im;
  a.im = -re;
}
/// By cos - i sin.
template <uint32_t kWidth>
PALPATE_INLINE void turn(Complex<kWidth>& a, double cos, double sin) {
  const auto re = a.re;
  a.re = cos * re + sin * a.im;
  a.im = cos * a.im - sin * re;
}

// Butterflies: a[k] becomes the sum over j of a[j] exp(-2 pi i j k / radix).

template <uint32_t kWidth>
PALPATE_INLINE void butterfly2(Complex<kWidth>* a) {
  sum_and_difference(a[0], a[1]);
}

template <uint32_t kWidth>
PALPATE_INLINE void butterfly4(Complex<kWidth>& a, Complex<kWidth>& b, Complex<kWidth>& c,
                               Complex<kWidth>& d) {
  sum_and_difference(a, c);
  sum_and_difference(b, d);
  times_minus_i(d);
  sum_and_difference(a, b);
  sum_and_difference(c, d);
  std::swap(b, c);  // a, c, b, d are in order of k
}

template <uint32_t kWidth>
PALPATE_INLINE void butterfly8(Complex<kWidth>* a) {
  for (uint32_t j = 0; j < 4; ++j) sum_and_difference(a[j], a[j + 4]);
  constexpr double kHalfRoot = std::numbers::sqrt2 / 2;
  turn(a[5], kHalfRoot, kHalfRoot);
  times_minus_i(a[6]);
  turn(a[7], -kHalfRoot, kHalfRoot);
  butterfly4(a[0], a[1], a[2], a[3]);
  butterfly4(a[4], a[5], a[6], a[7]);
  const Complex<kWidth> even1 = a[1], even2 = a[2], even3 = a[3];
  a[1] = a[4];
  a[2] = even1;
  a[4] = even2;
  a[3] = a[5];
  a[5] = a[6];
  a[6] = even3;
}

/// An odd radix, from the sums and differences of opposite elements. kRadix 0: `radix` is one that the
/// compiler does not know.
template <uint32_t kWidth, uint32_t kRadix>
PALPATE_INLINE void butterfly_odd(Complex<kWidth>* a, uint32_t known_radix, const double* roots) {
  const uint32_t radix = kRadix != 0 ? kRadix : known_radix, half = radix / 2;
  Complex<kWidth> result[kRadix != 0 ? kRadix : kLargestRadix];
  for (uint32_t j = 1; j <= half; ++j) sum_and_difference(a[j], a[radix - j]);
  result[0] = a[0];
  for (uint32_t j = 1; j <= half; ++j) {
    result[0].re += a[j].re;
    result[0].im += a[j].im;
  }
  for (uint32_t k = 1; k <= half; ++k) {
    Complex<kWidth> even = a[0], odd{};
    uint32_t root = 0;
    for (uint32_t j = 1; j <= half; ++j) {
      root = root + k < radix ? root + k : root + k - radix;
      const double cos = roots[2 * root], sin = roots[2 * root + 1];
      even.re += cos * a[j].re;
      even.im += cos * a[j].im;
      odd.re += sin * a[radix - j].re;
      odd.im += sin * a[radix - j].im;
    }
    // even - i odd, even + i odd
    result[k].re = even.re + odd.im;
    result[k].im = even.im - odd.re;
    result[radix - k].re = even.re - odd.im;
    result[radix - k].im = even.im + odd.re;
  }
  for (uint32_t k = 0; k < radix; ++k) a[k] = result[k];
}

template <uint32_t kWidth, uint32_t kRadix>
PALPATE_INLINE void butterfly(Complex<kWidth>* a, uint32_t radix, const double* roots) {
  if constexpr (kRadix == 2)
    butterfly2(a);
  else if constexpr (kRadix == 4)
    butterfly4(a[0], a[1], a[2], a[3]);
  else if constexpr (kRadix == 8)
    butterfly8(a);
  else
    butterfly_odd<kWidth, kRadix>(a, radix, roots);
}

std::vector<uint32_t> radices(uint32_t size, uint32_t& rest) {
  std::vector<uint32_t> found;
  rest = size;
  uint32_t twos = 0;
  for (; rest % 2 == 0; rest /= 2) ++twos;
  for (; twos >= 3 && twos != 4; twos -= 3) found.push_back(8);
  for (; twos >= 2; twos -= 2) found.push_back(4);
  if (twos == 1) found.push_back(2);
  for (uint32_t prime = 3; prime <= kLargestRadix; prime += 2)
    for (; rest % prime == 0; rest /= prime) found.push_back(prime);
  return found;
}

}  // namespace

struct LaneStages {
  using Stage = LaneFft::Stage;

  template <uint32_t kWidth, uint32_t kRadix, bool kTurn>
  PALPATE_INLINE static void part(const Stage& stage, uint32_t p, const double* from, double* to, uint32_t re,
                                  uint32_t im) {
    constexpr size_t kRow = 2 * kLaneCount;
    const uint32_t radix = kRadix != 0 ? kRadix : stage.radix;
    const size_t apart = size_t{stage.parts} * stage.stride * kRow, next = stage.stride * kRow;
    const double* in = from + size_t{p} * stage.stride * kRow;
    double* out = to + size_t{p} * radix * stage.stride * kRow;
    const double* twiddles = stage.twiddles.data() + size_t{p} * (radix - 1) * 2;
    for (uint32_t q = 0; q < stage.stride; ++q, in += kRow, out += kRow)
      for (uint32_t lane = 0; lane < kLaneCount; lane += kWidth) {
        Complex<kWidth> a[kRadix != 0 ? kRadix : kLargestRadix];
        for (uint32_t j = 0; j < radix; ++j)
          load(in + j * apart + re + lane, in + j * apart + im + lane, a[j]);
        butterfly<kWidth, kRadix>(a, radix, stage.roots.data());
        if constexpr (kTurn)
          for (uint32_t k = 1; k < radix; ++k) turn(a[k], twiddles[2 * k - 2], twiddles[2 * k - 1]);
        for (uint32_t k = 0; k < radix; ++k)
          store(a[k], out + k * next + re + lane, out + k * next + im + lane);
      }
  }

  template <uint32_t kWidth, uint32_t kRadix>
  PALPATE_INLINE static void stage_of(const Stage& stage, const double* from, double* to, uint32_t re,
                                      uint32_t im) {
    part<kWidth, kRadix, false>(stage, 0, from, to, re, im);
    for (uint32_t p = 1; p < stage.parts; ++p) part<kWidth, kRadix, true>(stage, p, from, to, re, im);
  }

  template <uint32_t kWidth>
  PALPATE_INLINE static void all(const std::vector<Stage>& stages, double* from, double* to, uint32_t re,
                                 uint32_t im) {
    for (const Stage& stage : stages) {
      switch (stage.radix) {
        case 2:
          stage_of<kWidth, 2>(stage, from, to, re, im);
          break;
        case 3:
          stage_of<kWidth, 3>(stage, from, to, re, im);
          break;
        case 4:
          stage_of<kWidth, 4>(stage, from, to, re, im);
          break;
        case 5:
          stage_of<kWidth, 5>(stage, from, to, re, im);
          break;
        case 7:
          stage_of<kWidth, 7>(stage, from, to, re, im);
          break;
        case 8:
          stage_of<kWidth, 8>(stage, from, to, re, im);
          break;
        default:
          stage_of<kWidth, 0>(stage, from, to, re, im);
          break;
      }
      std::swap(from, to);
    }
  }

#ifdef PALPATE_WIDE
  PALPATE_AVX512_FULL static void widest(const std::vector<Stage>& stages, double* from, double* to,
                                         uint32_t re, uint32_t im) {
    all<8>(stages, from, to, re, im);
  }
  PALPATE_AVX2 static void wide(const std::vector<Stage>& stages, double* from, double* to, uint32_t re,
                                uint32_t im) {
    all<4>(stages, from, to, re, im);
  }
#endif
  static void narrow(const std::vector<Stage>& stages, double* from, double* to, uint32_t re, uint32_t im) {
    all<2>(stages, from, to, re, im);
  }

  static void run(const std::vector<Stage>& stages, double* from, double* to, uint32_t re, uint32_t im) {
#ifdef PALPATE_WIDE
    if (vector_units::avx512_full()) return widest(stages, from, to, re, im);
    if (vector_units::avx2()) return wide(stages, from, to, re, im);
#endif
    narrow(stages, from, to, re, im);
  }
};

/// The exponent's j k is (j^2 + k^2 - (k - j)^2) / 2: a convolution of a product.
struct LaneFft::Bluestein {
  explicit Bluestein(uint32_t size) : fft(next_good_size(2 * size - 1)) {
    const auto turns = [&](uint64_t j) {
      return std::numbers::pi * static_cast<double>(j * j % (2 * uint64_t{size})) / size;
    };
    std::vector<LaneRow> data(fft.rows()), scratch(fft.rows());
    for (uint32_t j = 0; j < size; ++j) {
      chirp.push_back(std::cos(turns(j)));
      chirp.push_back(std::sin(turns(j)));
      for (const uint32_t row : {j, (fft.size() - j) % fft.size()}) {
        data[row].re()[0] = chirp[2 * j] / fft.size();
        data[row].im()[0] = chirp[2 * j + 1] / fft.size();
      }
    }
    const LaneRow* found = fft.forward(data.data(), scratch.data());
    for (uint32_t k = 0; k < fft.size(); ++k) {
      spectrum.push_back(found[k].re()[0]);
      spectrum.push_back(found[k].im()[0]);
    }
  }

  LaneFft fft;
  std::vector<double> chirp;     ///< cos, sin of pi j^2 / size
  std::vector<double> spectrum;  ///< of the chirp
};

LaneFft::LaneFft(uint32_t size) : size_(size) {
  uint32_t rest = 0;
  const std::vector<uint32_t> factors = radices(size, rest);
  if (rest > 1) {
    bluestein_ = std::make_unique<Bluestein>(size);
    return;
  }
  const auto angle = [](double part, double of) { return 2 * std::numbers::pi * part / of; };
  uint32_t left = size, stride = 1;
  for (const uint32_t radix : factors) {
    Stage stage{.radix = radix, .parts = left / radix, .stride = stride, .twiddles = {}, .roots = {}};
    for (uint32_t p = 0; p < stage.parts; ++p)
      for (uint32_t k = 1; k < radix; ++k) {
        const double turns = angle(static_cast<double>(uint64_t{p} * k), left);
        stage.twiddles.push_back(std::cos(turns));
        stage.twiddles.push_back(std::sin(turns));
      }
    for (uint32_t k = 0; k < radix; ++k) {
      stage.roots.push_back(std::cos(angle(k, radix)));
      stage.roots.push_back(std::sin(angle(k, radix)));
    }
    stages_.push_back(std::move(stage));
    left /= radix;
    stride *= radix;
  }
}
LaneFft::~LaneFft() = default;
LaneFft::LaneFft(LaneFft&&) noexcept = default;

uint32_t LaneFft::rows() const {
  return bluestein_ ? bluestein_->fft.rows() : size_;
}

LaneRow* LaneFft::run(LaneRow* data, LaneRow* scratch, bool swapped) const {
  if (bluestein_) return run_bluestein(data, scratch, swapped);
  // Real and imaginary parts change places: the exponent's other sign.
  LaneStages::run(stages_, data->re(), scratch->re(), swapped ? kLaneCount : 0, swapped ? 0 : kLaneCount);
  return stages_.size() % 2 == 0 ? data : scratch;
}

LaneRow* LaneFft::run_bluestein(LaneRow* data, LaneRow* scratch, bool swapped) const {
  const Bluestein& b = *bluestein_;
  const double side = swapped ? -1 : 1;  // of the chirp's imaginary part
  const auto turn_all = [&](LaneRow* rows, const std::vector<double>& by, uint32_t count, double sign) {
    for (uint32_t j = 0; j < count; ++j) {
      const double cos = by[2 * j], sin = sign * by[2 * j + 1];
      for (uint32_t lane = 0; lane < kLaneCount; ++lane) {
        const double re = rows[j].re()[lane], im = rows[j].im()[lane];
        rows[j].re()[lane] = cos * re - sin * im;
        rows[j].im()[lane] = cos * im + sin * re;
      }
    }
  };
  turn_all(data, b.chirp, size_, -side);
  std::fill(data + size_, data + b.fft.size(), LaneRow{});
  LaneRow* waves = b.fft.forward(data, scratch);
  LaneRow* other = waves == data ? scratch : data;
  // The chirp is even, so that the spectrum of its conjugate is the conjugate.
  turn_all(waves, b.spectrum, b.fft.size(), side);
  LaneRow* result = b.fft.backward(waves, other);
  turn_all(result, b.chirp, size_, -side);
  return result;
}

uint32_t next_good_size(uint32_t n) {
  for (uint32_t size = std::max(n + n % 2, 2u);; size += 2) {
    uint32_t rest = size;
    for (const uint32_t prime : {2u, 3u, 5u, 7u})
      while (rest % prime == 0) rest /= prime;
    if (rest == 1) return size;
  }
}

}  // namespace palpate
