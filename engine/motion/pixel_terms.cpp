#include "engine/motion/pixel_terms.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>

#include "shaders/shared/object_motion.h"

namespace palpate {

double LeftOver::residual_mm() const {
  return scale / std::sqrt(mean_precision);
}

PixelGuess::PixelGuess(const MotionGuess& guess, const ContactSurface::Level& key,
                       const ContactSurface::Level& now) {
  const Eigen::Vector3d corner(now.left_mm, now.top_mm, 0), key_corner(key.left_mm, key.top_mm, 0);
  const Eigen::Vector3d from = corner - guess.middle - guess.shift, about = guess.middle - key_corner;
  for (size_t row = 0; row < 3; ++row) {
    const auto at = static_cast<Eigen::Index>(row);
    origin[row] = static_cast<float>(from[at]);
    middle[row] = static_cast<float>(about[at]);
    for (size_t column = 0; column < 3; ++column)
      back[3 * row + column] = static_cast<float>(guess.turn(static_cast<Eigen::Index>(column), at));
  }
}

double least_scale_mm(double pitch_mm) {
  constexpr double kLeast_px = 0.005;
  return kLeast_px * pitch_mm;
}

uint32_t size_bin(float residual) {
  const uint32_t bin = std::bit_cast<uint32_t>(std::abs(residual)) >> shared::kSizeShift;
  return std::clamp(bin, shared::kFirstSizeBin, shared::kFirstSizeBin + shared::kSizeBins - 1) -
         shared::kFirstSizeBin;
}

double deviation_of(std::span<const uint32_t> bins) {
  uint64_t all = 0;
  for (const uint32_t count : bins) all += count;
  const uint64_t wanted = all / 2;
  uint64_t before = 0;
  for (uint32_t bin = 0; bin < bins.size(); ++bin) {
    if (before + bins[bin] <= wanted) {
      before += bins[bin];
      continue;
    }
    const auto edge = [](uint32_t of) {
      return double{std::bit_cast<float>((shared::kFirstSizeBin + of) << shared::kSizeShift)};
    };
    const double part = (double(wanted - before) + 0.5) / double(bins[bin]);
    return shared::kDeviationOfMedian * (edge(bin) + part * (edge(bin + 1) - edge(bin)));
  }
  return 0;
}

MotionSums sums_of(std::span<const double> sums, bool judged) {
  MotionSums out;
  for (int a = 0, k = 0; a < 6; ++a) {
    out.gradient[a] = sums[shared::kMotionGradient + static_cast<size_t>(a)];
    for (int b = 0; b <= a; ++b, ++k) {
      out.square(a, b) = out.square(b, a) = sums[static_cast<size_t>(k)];
      if (judged)
        out.difference(a, b) = out.difference(b, a) =
            sums[shared::kMotionDifferences + static_cast<size_t>(k)];
    }
  }
  out.weight = sums[shared::kMotionWeight];
  return out;
}

void add_term(ScoreField& field, uint32_t pixel, const std::array<float, 6>& row, float residual,
              double scale) {
  const double r = double{residual} / (double{shared::kTukeyBound} * scale), rest = 1 - r * r;
  if (rest <= 0) return;
  field.pixel.push_back(pixel);
  field.row.push_back(row);
  field.score.push_back(static_cast<float>(rest * rest * double{residual}));
}

}  // namespace palpate
