// Discrete Fourier transforms of any length, eight side by side: each lane of the vector unit carries one.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

namespace palpate {

inline constexpr uint32_t kLaneCount = 8;

/// One element of eight complex sequences, their real parts first, or of sixteen real ones.
struct alignas(64) LaneRow {
  std::array<double, 2 * kLaneCount> values;

  double* re() { return values.data(); }
  double* im() { return values.data() + kLaneCount; }
  const double* re() const { return values.data(); }
  const double* im() const { return values.data() + kLaneCount; }
};

/// A plan; its calls may run in parallel. Relative RMS errors are below 2e-15 at sizes up to 4096.
class LaneFft {
 public:
  /// `size` > 0. Prime factors up to 61 are transformed as they are; with a larger one the whole is a
  /// convolution (L. I. Bluestein, IEEE Trans. Audio Electroacoust. 18 (1970) 451), some five times as slow.
  explicit LaneFft(uint32_t size);
  ~LaneFft();
  LaneFft(LaneFft&&) noexcept;

  uint32_t size() const { return size_; }
  /// Rows that `data` and `scratch` must hold each, `size` at least.
  uint32_t rows() const;

  /// X_k = sum over j of x_j exp(-2 pi i j k / size), from the first `size` rows of `data` to those of the
  /// memory that is returned: `data` or `scratch`. The other one's contents are lost.
  LaneRow* forward(LaneRow* data, LaneRow* scratch) const { return run(data, scratch, false); }
  /// With the other sign of the exponent; both together multiply by `size`.
  LaneRow* backward(LaneRow* data, LaneRow* scratch) const { return run(data, scratch, true); }

 private:
  /// Stockham's: `radix` sequences, `stride` elements apart, become one.
  struct Stage {
    uint32_t radix = 0;
    uint32_t parts = 0;            ///< remaining length over radix
    uint32_t stride = 0;           ///< product of the radices before
    std::vector<double> twiddles;  ///< parts x (radix - 1) x (cos, sin)
    std::vector<double> roots;     ///< of unity, radix x (cos, sin)
  };
  struct Bluestein;
  friend struct LaneStages;

  LaneRow* run(LaneRow* data, LaneRow* scratch, bool swapped) const;
  LaneRow* run_bluestein(LaneRow* data, LaneRow* scratch, bool swapped) const;

  uint32_t size_;
  std::vector<Stage> stages_;
  std::unique_ptr<Bluestein> bluestein_;
};

/// The least number from n on whose only prime factors are 2, 3, 5 and 7, and which is even.
uint32_t next_good_size(uint32_t n);

}  // namespace palpate
