#include "engine/lump/network/second_bump.h"

#include "engine/base/text.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <utility>
#include <vector>

#include "engine/lump/network/view.h"

namespace palpate::lump {
namespace {

constexpr double kSmooth_mm = 1.2;    // Gaussian: less than any lump's bump is wide
constexpr double kLeastWeight = 0.6;  // of a whole neighbourhood: less, and a node lies at the edge
constexpr double kLeastHeight = 0.1;  // of the higher top: ground around a steep bump sinks and swells less
constexpr double kLeastFall = 0.1;    // of it: the two ends of one stiff long lump make less
constexpr double kLeastNoises = 6;

/// Pressure above the block's own, all loads in one, on the observation's own lattice.
struct Relief {
  int width = 0, height = 0;
  double pitch_mm = 1, x_mm = 0, y_mm = 0;  // of the first node
  std::vector<double> value, weight;        // weight 0: not seen
  double noise = 0;

  size_t at(int i, int j) const {
    return static_cast<size_t>(j) * static_cast<size_t>(width) + static_cast<size_t>(i);
  }
  bool seen(int i, int j) const {
    return i >= 0 && j >= 0 && i < width && j < height && weight[at(i, j)] > 0;
  }
};

double spacing(const std::vector<double>& places) {
  double least = std::numeric_limits<double>::infinity();
  for (size_t n = 1; n < places.size(); ++n) {
    const double step = std::abs(places[n] - places[n - 1]);
    if (step > 1e-6) least = std::min(least, step);
  }
  return least;
}

Relief relief_of(const PressedNodes& nodes) {
  Relief r;
  r.pitch_mm = spacing(nodes.x_mm);
  const auto [left, right] = std::minmax_element(nodes.x_mm.begin(), nodes.x_mm.end());
  const auto [low, high] = std::minmax_element(nodes.y_mm.begin(), nodes.y_mm.end());
  r.x_mm = *left;
  r.y_mm = *low;
  r.width = static_cast<int>(std::lround((*right - *left) / r.pitch_mm)) + 1;
  r.height = static_cast<int>(std::lround((*high - *low) / r.pitch_mm)) + 1;
  r.value.assign(static_cast<size_t>(r.width) * static_cast<size_t>(r.height), 0);
  r.weight = r.value;
  double squares = 0;
  for (const double load : nodes.loads) squares += load * load;
  for (size_t n = 0; n < nodes.x_mm.size(); ++n) {
    const size_t at = r.at(static_cast<int>(std::lround((nodes.x_mm[n] - r.x_mm) / r.pitch_mm)),
                           static_cast<int>(std::lround((nodes.y_mm[n] - r.y_mm) / r.pitch_mm)));
    for (size_t k = 0; k < nodes.loads.size(); ++k)
      r.value[at] += nodes.loads[k] * nodes.rest(static_cast<Eigen::Index>(n), static_cast<Eigen::Index>(k));
    r.weight[at] = 1;
  }
  r.noise = nodes.noise * std::sqrt(squares);
  return r;
}

/// Means over the seen neighbours, also of nodes that were missed alone; nodes with few are not seen.
Relief smoothed(const Relief& from) {
  const int taps = static_cast<int>(std::ceil(2.5 * kSmooth_mm / from.pitch_mm));
  std::vector<double> gauss;
  double all = 0, all_squares = 0;
  for (int t = -taps; t <= taps; ++t) {
    gauss.push_back(std::exp(-0.5 * std::pow(t * from.pitch_mm / kSmooth_mm, 2)));
    all += gauss.back();
    all_squares += gauss.back() * gauss.back();
  }
  const double* const middle = gauss.data() + taps;
  Relief to = from;
  for (int j = 0; j < from.height; ++j)
    for (int i = 0; i < from.width; ++i) {
      double sum = 0, weights = 0;
      for (int b = -taps; b <= taps; ++b)
        for (int a = -taps; a <= taps; ++a) {
          if (!from.seen(i + a, j + b)) continue;
          const double w = middle[a] * middle[b];
          sum += w * from.value[from.at(i + a, j + b)];
          weights += w;
        }
      const bool inside = weights > kLeastWeight * all * all;
      to.value[to.at(i, j)] = inside ? sum / weights : 0;
      to.weight[to.at(i, j)] = inside ? 1 : 0;
    }
  to.noise = from.noise * all_squares / (all * all);
  return to;
}

bool at_edge(const Relief& r, int i, int j) {
  for (int b = -1; b <= 1; ++b)
    for (int a = -1; a <= 1; ++a)
      if (!r.seen(i + a, j + b)) return true;
  return false;
}

/// Water falls from the highest place on: where two islands meet, the lower one's top is as high above the
/// meeting as the way between the two falls.
class Islands {
 public:
  explicit Islands(const Relief& r) : r_(r), root_(r.value.size(), kSea), top_(r.value.size(), kSea) {
    std::vector<size_t> order;
    for (size_t n = 0; n < r.value.size(); ++n)
      if (r.weight[n] > 0) order.push_back(n);
    std::stable_sort(order.begin(), order.end(),
                     [&r](size_t a, size_t b) { return r.value[a] > r.value[b]; });
    for (const size_t n : order) rise(n);
  }
  size_t higher = kSea, lower = kSea;
  std::vector<std::pair<size_t, double>> tops;  ///< all but the highest one, each with its fall
  double fall = 0;
  static constexpr size_t kSea = std::numeric_limits<size_t>::max();

 private:
  size_t find(size_t n) {
    while (root_[n] != n) n = root_[n] = root_[root_[n]];
    return n;
  }
  void rise(size_t n) {
    const int i = static_cast<int>(n % static_cast<size_t>(r_.width)),
              j = static_cast<int>(n / static_cast<size_t>(r_.width));
    root_[n] = n;
    bool alone = true;
    for (int b = -1; b <= 1; ++b)
      for (int a = -1; a <= 1; ++a)
        if (r_.seen(i + a, j + b) && root_[r_.at(i + a, j + b)] != kSea && r_.at(i + a, j + b) != n) {
          alone = false;
          meet(find(r_.at(i + a, j + b)), find(n), r_.value[n]);
        }
    // Tops at the edge are land, but no tops.
    if (alone && !at_edge(r_, i, j)) top_[n] = n;
  }
  void meet(size_t a, size_t b, double level) {
    if (a == b) return;
    size_t keep = top_[a], drop = top_[b];
    if (keep == kSea || (drop != kSea && r_.value[drop] > r_.value[keep])) std::swap(keep, drop);
    if (drop != kSea) tops.emplace_back(drop, r_.value[drop] - level);
    if (drop != kSea && r_.value[drop] - level > fall) {
      fall = r_.value[drop] - level;
      higher = keep;
      lower = drop;
    }
    root_[b] = a;
    top_[a] = keep;
  }

  const Relief& r_;
  std::vector<size_t> root_, top_;
};

std::array<double, 2> place(const Relief& r, size_t n) {
  const size_t width = static_cast<size_t>(r.width), column = n % width, row = n / width;
  return {r.x_mm + static_cast<double>(column) * r.pitch_mm, r.y_mm + static_cast<double>(row) * r.pitch_mm};
}

}  // namespace

std::optional<SecondBump> find_second_bump(const PressedNodes& nodes) {
  const Relief relief = smoothed(relief_of(nodes));
  const Islands islands(relief);
  if (islands.lower == Islands::kSea || !(relief.value[islands.higher] > 0)) return std::nullopt;
  SecondBump bump;
  bump.place_mm = {place(relief, islands.higher), place(relief, islands.lower)};
  bump.distance_mm =
      std::hypot(bump.place_mm[0][0] - bump.place_mm[1][0], bump.place_mm[0][1] - bump.place_mm[1][1]);
  bump.height = relief.value[islands.lower] / relief.value[islands.higher];
  bump.fall = islands.fall / relief.value[islands.higher];
  bump.noises = islands.fall / relief.noise;
  for (const auto& [top, fall] : islands.tops) {
    SecondBump other;
    other.height = relief.value[top] / relief.value[islands.higher];
    other.fall = fall / relief.value[islands.higher];
    other.noises = fall / relief.noise;
    if (top != islands.lower && reports_two(other)) bump.others_mm.push_back(place(relief, top));
  }
  return bump;
}

bool reports_two(const SecondBump& bump) {
  return bump.height > kLeastHeight && bump.fall > kLeastFall && bump.noises > kLeastNoises;
}

std::optional<SecondBump> second_bump_reported(const Model& model, const Observation& observation) {
  Estimate ignored;
  const auto nodes = pressed_nodes(model, observation, ignored);
  auto bump = nodes ? find_second_bump(*nodes) : std::nullopt;
  if (bump && !reports_two(*bump)) bump.reset();
  return bump;
}

void report_second_bump(const PressedNodes& nodes, Estimate& estimate) {
  if (estimate.verdict == Status::NoLump || estimate.verdict == Status::Unusable) return;
  const auto bump = find_second_bump(nodes);
  if (!bump || !reports_two(*bump)) return;
  const std::string line =
      text(bump->others_mm.empty()
               ? "two bumps, %.3g mm apart, at %.3g, %.3g mm and %.3g, %.3g mm"
               : "three bumps or more: two are %.3g mm apart, at %.3g, %.3g mm and %.3g, %.3g mm",
           bump->distance_mm, bump->place_mm[0][0], bump->place_mm[0][1], bump->place_mm[1][0],
           bump->place_mm[1][1]);
  estimate.verdict = Status::SeveralLumps;
  estimate.bumps_mm.assign(bump->place_mm.begin(), bump->place_mm.end());
  estimate.bumps_mm.insert(estimate.bumps_mm.end(), bump->others_mm.begin(), bump->others_mm.end());
  estimate.reasons.insert(estimate.reasons.begin(), line);
}

}  // namespace palpate::lump
