#include "engine/palpation/hand/skin_overlap.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <vector>

#include "engine/numeric/transform/lane_fft.h"
#include "engine/palpation/hand/skin_texture.h"

namespace palpate {
namespace {

constexpr double kBandFine_mm = 0.12, kBandSlow_mm = 0.4;
constexpr double kLeastSeen = 0.2;
constexpr double kTurnStep_rad = 0.03;
constexpr double kSamePlace_mm = 1.2;

/// The texture as a pad that is turned by so much against it would see it.
TextureMap turned(const TextureMap& from, double turn_rad) {
  TextureMap out = from;
  const double c = std::cos(turn_rad), s = std::sin(turn_rad);
  for (int j = 0; j < out.height; ++j)
    for (int i = 0; i < out.width; ++i) {
      const double u = i - (out.width - 1) / 2.0, v = j - (out.height - 1) / 2.0;
      const size_t n = out.at(i, j);
      out.value[n] = 0;
      out.seen[n] = texture_between(from, c * u - s * v + (out.width - 1) / 2.0,
                                    s * u + c * v + (out.height - 1) / 2.0, out.value[n]);
    }
  return out;
}

using Wave = std::complex<double>;

/// Sums of products over all shifts, by transforms of twice the maps' size.
class Correlation {
 public:
  explicit Correlation(const TextureMap& first);
  /// At each shift the sum of products, and as imaginary part the pixels that both see; shifts below 0 from
  /// the end.
  const std::vector<Wave>& with(const TextureMap& second);
  size_t at(int dx, int dy) const {
    const auto w = static_cast<int>(x_.size()), h = static_cast<int>(y_.size());
    return static_cast<size_t>((dy + h) % h) * x_.size() + static_cast<size_t>((dx + w) % w);
  }

 private:
  void load(const TextureMap& texture);
  void transform(bool back);
  /// Spectra of the value and of what is seen.
  std::array<Wave, 2> apart(size_t x, size_t y) const;

  LaneFft x_, y_;
  std::vector<LaneRow> rows_, scratch_;
  std::vector<Wave> map_;
  std::vector<std::array<Wave, 2>> first_;
};

Correlation::Correlation(const TextureMap& first)
    : x_(next_good_size(static_cast<uint32_t>(2 * first.width))),
      y_(next_good_size(static_cast<uint32_t>(2 * first.height))),
      rows_(std::max(x_.rows(), y_.rows())),
      scratch_(rows_.size()) {
  load(first);
  for (size_t y = 0; y < y_.size(); ++y)
    for (size_t x = 0; x < x_.size(); ++x) first_.push_back(apart(x, y));
}

void Correlation::load(const TextureMap& texture) {
  map_.assign(size_t{x_.size()} * y_.size(), 0);
  for (int j = 0; j < texture.height; ++j)
    for (int i = 0; i < texture.width; ++i) {
      const size_t n = texture.at(i, j);
      map_[at(i, j)] = {double{texture.value[n]}, double(texture.seen[n])};
    }
  transform(false);
}

void Correlation::transform(bool back) {
  const auto along = [&](const LaneFft& fft, size_t lines, size_t next, size_t step) {
    for (size_t from = 0; from < lines; from += kLaneCount) {
      const size_t lanes = std::min(size_t{kLaneCount}, lines - from);
      for (size_t k = 0; k < fft.size(); ++k)
        for (size_t l = 0; l < lanes; ++l) {
          const Wave value = map_[(from + l) * next + k * step];
          rows_[k].re()[l] = value.real();
          rows_[k].im()[l] = value.imag();
        }
      const LaneRow* out =
          back ? fft.backward(rows_.data(), scratch_.data()) : fft.forward(rows_.data(), scratch_.data());
      for (size_t k = 0; k < fft.size(); ++k)
        for (size_t l = 0; l < lanes; ++l)
          map_[(from + l) * next + k * step] = {out[k].re()[l], out[k].im()[l]};
    }
  };
  along(x_, y_.size(), x_.size(), 1);
  along(y_, x_.size(), 1, x_.size());
}

std::array<Wave, 2> Correlation::apart(size_t x, size_t y) const {
  const Wave here = map_[y * x_.size() + x];
  const Wave there = std::conj(map_[(y_.size() - y) % y_.size() * x_.size() + (x_.size() - x) % x_.size()]);
  return {(here + there) * 0.5, (here - there) * Wave(0, -0.5)};
}

const std::vector<Wave>& Correlation::with(const TextureMap& second) {
  load(second);
  std::vector<Wave> product(map_.size());
  const double norm = 1 / static_cast<double>(map_.size());
  for (size_t y = 0; y < y_.size(); ++y)
    for (size_t x = 0; x < x_.size(); ++x) {
      const size_t n = y * x_.size() + x;
      const std::array<Wave, 2> b = apart(x, y);
      product[n] = norm * (first_[n][0] * std::conj(b[0]) + Wave(0, 1) * first_[n][1] * std::conj(b[1]));
    }
  map_.swap(product);
  transform(true);
  return map_;
}

}  // namespace

SkinOverlap find_skin_overlap(const SkinRelief& first, const SkinRelief& second, double most_turn_rad) {
  const TextureMap a = skin_texture(first, kBandFine_mm, kBandSlow_mm),
                   plain = skin_texture(second, kBandFine_mm, kBandSlow_mm);
  SkinOverlap best;
  const double power = std::sqrt(a.power() * plain.power());
  if (!(power > 0)) return best;
  const auto seen = [](const TextureMap& of) { return std::ranges::count(of.seen, uint8_t{1}); };
  const double least = kLeastSeen * static_cast<double>(std::min(seen(a), seen(plain)));
  Correlation correlation(a);
  const int far_x = a.width * 4 / 5, far_y = a.height * 4 / 5, across = 2 * far_x + 1;
  std::vector<double> highest(static_cast<size_t>(across) * static_cast<size_t>(2 * far_y + 1), 0);
  const auto place = [&](int dx, int dy) {
    return static_cast<size_t>(dy + far_y) * static_cast<size_t>(across) + static_cast<size_t>(dx + far_x);
  };
  const int turns = static_cast<int>(std::ceil(most_turn_rad / kTurnStep_rad));
  for (int t = -turns; t <= turns; ++t) {
    // Seen by a pad that is turned back, the second relief lies as the first.
    const std::vector<Wave>& sums = correlation.with(turned(plain, -t * kTurnStep_rad));
    for (int dy = -far_y; dy <= far_y; ++dy)
      for (int dx = -far_x; dx <= far_x; ++dx) {
        const Wave sum = sums[correlation.at(dx, dy)];
        if (sum.imag() < std::max(least, 1.0)) continue;
        const double significance = sum.real() / (power * std::sqrt(sum.imag()));
        highest[place(dx, dy)] = std::max(highest[place(dx, dy)], significance);
        if (significance > best.significance)
          best = {{dx * a.pitch_mm, dy * a.pitch_mm},
                  t * kTurnStep_rad,
                  significance / std::sqrt(sum.imag()),
                  significance,
                  0};
      }
  }
  for (int dy = -far_y; dy <= far_y; ++dy)
    for (int dx = -far_x; dx <= far_x; ++dx)
      if (std::hypot(dx * a.pitch_mm - best.shift_mm[0], dy * a.pitch_mm - best.shift_mm[1]) > kSamePlace_mm)
        best.elsewhere = std::max(best.elsewhere, highest[place(dx, dy)]);
  return best;
}

}  // namespace palpate
