#include "engine/numeric/control_points.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <queue>
#include <random>
#include <string>
#include <utility>

#include "palpate/error.h"

namespace palpate {
namespace {

/// Candidates of each point that is wanted: fewer give a coarser choice, more only time.
constexpr double kCandidatesEach = 8;
/// Share of the box that the contact is expected to fill at least.
constexpr double kLeastFilled = 0.05;
constexpr uint32_t kMostCandidates = 200000;

using Place = std::array<double, 3>;  // mm

double distance(const Place& a, const Place& b) {
  return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
}

void require(bool holds, const char* what, double found) {
  if (!holds) throw Error(Failure::Usage, what, std::to_string(found), "a value in that range");
}

void check(const ControlOptions& o) {
  require(o.count >= 50 && o.count <= 2000, "50 to 2000 control points", o.count);
  require(o.pitch_mm_per_px > 0 && std::isfinite(o.pitch_mm_per_px), "a pitch above 0 mm/px",
          o.pitch_mm_per_px);
  require(o.contact_mm > 0 && std::isfinite(o.contact_mm), "a contact depth above 0 mm", o.contact_mm);
  require(o.neighbours >= 3 && o.neighbours <= 20, "3 to 20 neighbours", o.neighbours);
}

/// Places in squares of the plane, so that those near one are found without looking at all.
class Bins {
 public:
  Bins(const std::vector<Place>& places, double side) : places_(places), side_(side) {
    if (places.empty()) return;
    low_ = high_ = {places[0][0], places[0][1]};
    for (const Place& p : places)
      for (size_t c = 0; c < 2; ++c) low_[c] = std::min(low_[c], p[c]), high_[c] = std::max(high_[c], p[c]);
    columns_ = static_cast<size_t>((high_[0] - low_[0]) / side) + 1;
    bins_.resize(columns_ * (static_cast<size_t>((high_[1] - low_[1]) / side) + 1));
    for (uint32_t i = 0; i < places.size(); ++i) bins_[bin(places[i])].push_back(i);
  }

  /// Calls `with(j, distance)` for the others that are nearer than `reach`, which is at most the side.
  template <typename With>
  void near(uint32_t i, double reach, const With& with) const {
    const size_t at = bin(places_[i]), x = at % columns_, y = at / columns_, rows = bins_.size() / columns_;
    for (size_t v = y == 0 ? 0 : y - 1; v < std::min(rows, y + 2); ++v)
      for (size_t u = x == 0 ? 0 : x - 1; u < std::min(columns_, x + 2); ++u)
        for (const uint32_t j : bins_[v * columns_ + u])
          if (const double d = distance(places_[i], places_[j]); j != i && d < reach) with(j, d);
  }

 private:
  size_t bin(const Place& p) const {
    return static_cast<size_t>((p[1] - low_[1]) / side_) * columns_ +
           static_cast<size_t>((p[0] - low_[0]) / side_);
  }
  const std::vector<Place>& places_;
  double side_;
  std::array<double, 2> low_{}, high_{};
  size_t columns_ = 1;
  std::vector<std::vector<uint32_t>> bins_;
};

/// Which of `places` stay when the most crowded goes until `keep` are left. The first `held` always stay.
/// `spacing`: the widest that so many points could have.
std::vector<uint32_t> thin_out(const std::vector<Place>& places, size_t held, size_t keep, double spacing) {
  std::vector<uint32_t> left(places.size());
  std::iota(left.begin(), left.end(), 0u);
  if (places.size() <= keep || !(spacing > 0)) return left;
  const double reach = 2 * spacing;
  const Bins bins(places, reach);
  const auto crowd = [&](double d) { return std::pow(1 - d / reach, 8); };
  std::vector<double> weight(places.size());
  std::priority_queue<std::pair<double, uint32_t>> crowded;
  for (uint32_t i = 0; i < places.size(); ++i) {
    bins.near(i, reach, [&](uint32_t, double d) { weight[i] += crowd(d); });
    if (i >= held) crowded.emplace(weight[i], i);
  }
  std::vector<bool> gone(places.size());
  for (size_t count = places.size(); count > keep && !crowded.empty();) {
    const auto [w, i] = crowded.top();
    crowded.pop();
    if (gone[i] || w != weight[i]) continue;  // an entry from before a neighbour went
    gone[i] = true;
    --count;
    bins.near(i, reach, [&](uint32_t j, double d) {
      if (gone[j]) return;
      weight[j] -= crowd(d);
      if (j >= held) crowded.emplace(weight[j], j);
    });
  }
  std::erase_if(left, [&](uint32_t i) { return gone[i]; });
  return left;
}

/// At most `most` of them, drawn, in their order.
std::vector<ControlPoint> drawn(const std::vector<ControlPoint>& points, size_t most, uint64_t seed) {
  if (points.size() <= most) return points;
  std::vector<ControlPoint> kept;
  std::mt19937_64 random(seed);
  size_t wanted = most;
  for (size_t i = 0; i < points.size(); ++i)
    if (random() % (points.size() - i) < wanted) {
      kept.push_back(points[i]);
      --wanted;
    }
  return kept;
}

void find_neighbours(const std::vector<Place>& places, uint32_t wanted, ControlPoints& found) {
  const size_t count = places.size();
  found.neighbours.assign(count, {});
  if (count < 2) return;
  const size_t each = std::min<size_t>(wanted, count - 1);
  found.least_spacing_mm = HUGE_VAL;
  std::vector<uint32_t> order(count);
  for (uint32_t i = 0; i < count; ++i) {
    std::iota(order.begin(), order.end(), 0u);
    std::swap(order[i], order.back());
    const auto nearer = [&](uint32_t a, uint32_t b) {
      const double da = distance(places[i], places[a]), db = distance(places[i], places[b]);
      return da != db ? da < db : a < b;
    };
    std::partial_sort(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(each), order.end() - 1,
                      nearer);
    found.neighbours[i].assign(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(each));
    const double nearest = distance(places[i], places[order[0]]);
    found.spacing_mm += nearest / static_cast<double>(count);
    found.least_spacing_mm = std::min(found.least_spacing_mm, nearest);
  }
  // Both ways.
  for (uint32_t i = 0; i < count; ++i)
    for (size_t k = 0; k < each; ++k) {
      std::vector<uint32_t>& back = found.neighbours[found.neighbours[i][k]];
      if (std::ranges::find(back, i) == back.end()) back.push_back(i);
    }
}

}  // namespace

CandidateGrid control_candidates(const PixelRect& box, const ControlOptions& options) {
  check(options);
  CandidateGrid grid;
  if (box.width == 0 || box.height == 0) return grid;
  const double area = static_cast<double>(box.width) * box.height;
  const double wanted = std::min<double>(kMostCandidates, kCandidatesEach / kLeastFilled * options.count);
  const double step = std::max(1.0, std::sqrt(area / wanted));
  grid.columns = std::max(1u, static_cast<uint32_t>(box.width / step));
  grid.rows = std::max(1u, static_cast<uint32_t>(box.height / step));
  grid.step_x_px = static_cast<double>(box.width) / grid.columns;
  grid.step_y_px = static_cast<double>(box.height) / grid.rows;
  std::mt19937_64 random(options.seed);
  // Not std::uniform_real_distribution: its numbers differ from library to library.
  const auto uniform = [&] { return static_cast<double>(random() >> 11) * 0x1p-53; };
  for (uint32_t row = 0; row < grid.rows; ++row)
    for (uint32_t column = 0; column < grid.columns; ++column) {
      const double u = uniform(), v = uniform();
      grid.places.push_back(
          {box.x - 0.5 + (column + u) * grid.step_x_px, box.y - 0.5 + (row + v) * grid.step_y_px});
    }
  return grid;
}

ControlPoints choose_control_points(const CandidateGrid& candidates, std::span<const float> depths,
                                    std::span<const ControlPoint> features, const ControlOptions& options) {
  check(options);
  if (depths.size() != candidates.places.size())
    throw Error(Failure::Usage,
                "a depth for each of " + std::to_string(candidates.places.size()) + " candidates",
                std::to_string(depths.size()), "the depths at their places");
  const double pitch = options.pitch_mm_per_px, limit = options.contact_mm;
  const auto place = [&](const ControlPoint& p) { return Place{p.x_px * pitch, p.y_px * pitch, p.depth_mm}; };
  const auto touched = [&](double depth) { return depth > limit; };  // NaN: no

  ControlPoints found;
  std::vector<ControlPoint> inside, rim;
  double steep = 0, edges_mm = 0;  // area in the shape; length of all lines between candidates
  const double cell_mm2 = candidates.step_x_px * candidates.step_y_px * pitch * pitch;
  for (uint32_t row = 0; row < candidates.rows; ++row)
    for (uint32_t column = 0; column < candidates.columns; ++column) {
      const size_t at = size_t{row} * candidates.columns + column;
      const double depth = double{depths[at]};
      if (!std::isfinite(depth)) continue;
      if (touched(depth)) {
        inside.push_back({candidates.places[at][0], candidates.places[at][1], depth, ControlKind::Contact});
        found.contact_mm2 += cell_mm2;
      }
      double slope2 = 0;
      for (const bool below : {false, true}) {
        if (below ? row + 1 == candidates.rows : column + 1 == candidates.columns) continue;
        const size_t next = at + (below ? candidates.columns : 1);
        const double other = double{depths[next]};
        if (!std::isfinite(other)) continue;
        const auto& [x0, y0] = candidates.places[at];
        const auto& [x1, y1] = candidates.places[next];
        const double apart = std::hypot(x1 - x0, y1 - y0) * pitch;
        edges_mm += apart;
        if (apart > 0) slope2 += (other - depth) * (other - depth) / (apart * apart);
        if (touched(depth) == touched(other)) continue;
        const double fraction = (limit - depth) / (other - depth);
        rim.push_back({x0 + fraction * (x1 - x0), y0 + fraction * (y1 - y0), limit, ControlKind::Rim});
      }
      if (touched(depth)) steep += cell_mm2 * std::sqrt(1 + slope2);
    }
  // Crofton: a line's length by how often lines in all directions cross it.
  if (edges_mm > 0)
    found.rim_mm = std::numbers::pi / 2 * static_cast<double>(rim.size() * candidates.places.size()) *
                   cell_mm2 / edges_mm;
  if (inside.empty()) return found;

  for (const ControlPoint& feature : features)
    if (touched(feature.depth_mm) && found.points.size() < options.count) {
      found.points.push_back(feature);
      found.points.back().kind = ControlKind::Feature;
    }
  const auto add = [&](const std::vector<ControlPoint>& more, size_t keep, double spacing) {
    std::vector<Place> all;
    for (const ControlPoint& p : found.points) all.push_back(place(p));
    for (const ControlPoint& p : more) all.push_back(place(p));
    const size_t held = found.points.size();
    for (const uint32_t i : thin_out(all, held, keep, spacing))
      if (i >= held) found.points.push_back(more[i - held]);
  };
  // As far apart on the rim as within: hexagons of the area that is left to each.
  const double spacing = std::sqrt(2 / std::numbers::sqrt3 * steep / options.count);
  const auto on_rim = static_cast<size_t>(std::lround(found.rim_mm / spacing));
  const size_t most = static_cast<size_t>(kCandidatesEach) * options.count;
  add(drawn(rim, most, options.seed),
      std::min<size_t>(options.count, found.points.size() + std::min<size_t>(on_rim, options.count / 2)),
      found.rim_mm / static_cast<double>(std::max<size_t>(1, on_rim)));
  add(drawn(inside, most, options.seed), options.count, spacing);

  std::vector<Place> places;
  for (const ControlPoint& p : found.points) places.push_back(place(p));
  find_neighbours(places, options.neighbours, found);
  return found;
}

}  // namespace palpate
