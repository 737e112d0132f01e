#include "engine/map/fusion.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "engine/numeric/catmull_rom.h"

namespace palpate {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

/// Steps to the nearest pixel that is not in the contact or not in the picture, straight ways 1 and slanting
/// ones sqrt(2).
std::vector<float> distance_px(const KeyFrame::Unpacked& frame) {
  const int w = static_cast<int>(frame.width), h = static_cast<int>(frame.height);
  std::vector<float> out(frame.contact.size());
  const auto index = [w](int x, int y) {
    return static_cast<size_t>(y) * static_cast<size_t>(w) + static_cast<size_t>(x);
  };
  const auto at = [&](int x, int y) { return x < 0 || y < 0 || x >= w || y >= h ? 0 : out[index(x, y)]; };
  const auto pass = [&](int x, int y, int way, float most) {
    constexpr float kSlant = 1.41421356f;
    const size_t i = index(x, y);
    if (frame.contact[i] == 0) return out[i] = 0;
    return out[i] = std::min({most, at(x - way, y) + 1, at(x, y - way) + 1, at(x - way, y - way) + kSlant,
                              at(x + way, y - way) + kSlant});
  };
  for (int y = 0; y < h; ++y)
    for (int x = 0; x < w; ++x) pass(x, y, 1, std::numeric_limits<float>::max());
  for (int y = h; y-- > 0;)
    for (int x = w; x-- > 0;) pass(x, y, -1, out[index(x, y)]);
  return out;
}

/// Depth and slopes by Catmull-Rom; the place in pixels has two neighbours on each side.
struct Surface {
  double depth, by_x, by_y;
};
Surface sample(const KeyFrame::Unpacked& frame, double x, double y) {
  const auto left = static_cast<size_t>(x), top = static_cast<size_t>(y);
  const double u = x - double(left), v = y - double(top);
  const auto cu = catmull_rom(u), cv = catmull_rom(v), ru = catmull_rom_rates(u), rv = catmull_rom_rates(v);
  Surface out{};
  for (size_t k = 0; k < 4; ++k) {
    const float* row = frame.depth.data() + (top + k - 1) * frame.width + left - 1;
    double line = 0, slope = 0;
    for (size_t j = 0; j < 4; ++j) {
      line += cu[j] * double{row[j]};
      slope += ru[j] * double{row[j]};
    }
    out.depth += cv[k] * line;
    out.by_x += cv[k] * slope / frame.pitch_mm;
    out.by_y += rv[k] * line / frame.pitch_mm;
  }
  return out;
}

struct Box {
  double left = INFINITY, right = -INFINITY, top = INFINITY, bottom = -INFINITY;
};
/// Where the frame's picture lies on the map, as far as its depths are within its contact's.
void widen(Box& box, const Fusion::Part& part) {
  const RigidMotion back = part.motion.inverse();
  for (const double x : {part.frame.left_mm(), -part.frame.left_mm()})
    for (const double y : {part.frame.top_mm(), -part.frame.top_mm()}) {
      const Vector3d p = back * Vector3d(x, y, part.frame.middle_mm()[2]);
      box.left = std::min(box.left, p[0]);
      box.right = std::max(box.right, p[0]);
      box.top = std::min(box.top, p[1]);
      box.bottom = std::max(box.bottom, p[1]);
    }
}

}  // namespace

double FusedMap::covered_mm2() const {
  const auto seen = std::count_if(height_mm.begin(), height_mm.end(), [](float z) { return !std::isnan(z); });
  return double(seen) * pitch_mm * pitch_mm;
}

Fusion::Fusion(const std::vector<Part>& parts, const Options& options) : options_(options) {
  Box box;
  for (const Part& part : parts) widen(box, part);
  if (!(box.right >= box.left && box.bottom >= box.top)) return;
  while ((box.right - box.left) / options_.pitch_mm * ((box.bottom - box.top) / options_.pitch_mm) >
         options_.most_px)
    options_.pitch_mm *= 2;
  const double pitch = options_.pitch_mm;
  // On whole multiples of the pitch: cells stay where they are while the map grows.
  left_mm_ = std::floor(box.left / pitch) * pitch;
  top_mm_ = std::floor(box.top / pitch) * pitch;
  width_ = static_cast<uint32_t>((box.right - left_mm_) / pitch) + 2;
  height_ = static_cast<uint32_t>((box.bottom - top_mm_) / pitch) + 2;
  cells_.resize(size_t{width_} * height_);
}

Vector2d Fusion::place_of(size_t cell) const {
  const size_t row = cell / width_, column = cell % width_;
  return {left_mm_ + double(column) * options_.pitch_mm, top_mm_ + double(row) * options_.pitch_mm};
}

template <typename See>
void Fusion::look(const Part& part, const See& see) const {
  if (cells_.empty()) return;
  const KeyFrame::Unpacked frame = part.frame.unpacked();
  const std::vector<float> far = distance_px(frame);
  const RigidMotion& motion = part.motion;
  const double pitch = options_.pitch_mm, ramp_px = std::max(options_.ramp_mm / frame.pitch_mm, 1.0);
  const double left = part.frame.left_mm(), top = part.frame.top_mm(), flat = part.frame.middle_mm()[2];
  const double border = std::max(options_.border_px, 2u);
  Box box;
  widen(box, part);
  const auto range = [&](double low, double high, double first, uint32_t count) {
    const auto most = static_cast<double>(count);
    return std::pair{static_cast<uint32_t>(std::clamp((low - first) / pitch - 1, 0.0, most)),
                     static_cast<uint32_t>(std::clamp((high - first) / pitch + 2, 0.0, most))};
  };
  const auto [x0, x1] = range(box.left, box.right, left_mm_, width_);
  const auto [y0, y1] = range(box.top, box.bottom, top_mm_, height_);
  const double map_flat = (motion.inverse() * Vector3d(0, 0, flat))[2];
  for (uint32_t row = y0; row < y1; ++row)
    for (uint32_t column = x0; column < x1; ++column) {
      const double x = left_mm_ + column * pitch, y = top_mm_ + row * pitch;
      // The map's height there, so that it lies on the frame's surface.
      double z = map_flat, u = 0, v = 0;
      Vector3d q;
      Surface surface{};
      bool inside = false;
      for (int step = 0; step < 4; ++step) {
        q = motion * Vector3d(x, y, z);
        u = (q[0] - left) / frame.pitch_mm;
        v = (q[1] - top) / frame.pitch_mm;
        inside = u >= 1 && v >= 1 && u + 3 <= frame.width && v + 3 <= frame.height;
        if (!inside) break;
        surface = sample(frame, u, v);
        const double miss = surface.depth - q[2];
        z += miss / motion.turn(2, 2);
        if (std::abs(miss) < 1e-5) break;
      }
      if (!inside) continue;
      const size_t pixel =
          static_cast<size_t>(std::lround(v)) * frame.width + static_cast<size_t>(std::lround(u));
      const double part_of = (double{far[pixel]} - border) / ramp_px;
      if (part_of <= 0) continue;
      Seen seen{.height_mm = z, .right = u / frame.width, .down = v / frame.height};
      seen.share = part_of >= 1 ? 1 : part_of * part_of * (3 - 2 * part_of);
      seen.weight = frame.sd.empty() ? seen.share : seen.share / std::pow(double{frame.sd[pixel]}, 2);
      const Vector3d normal(-surface.by_x, -surface.by_y, 1);
      seen.by << normal, cross(q - part.frame.middle_mm()) * normal;
      see(size_t{row} * width_ + column, seen);
    }
}

void Fusion::add(const Part& part) {
  look(part, [&](size_t at, const Seen& seen) {
    Cell& cell = cells_[at];
    const double weight = seen.weight, sum = double{cell.weight} + weight,
                 off = seen.height_mm - double{cell.mean_mm};
    cell.mean_mm = static_cast<float>(double{cell.mean_mm} + off * weight / sum);
    cell.spread += static_cast<float>(weight * off * (seen.height_mm - double{cell.mean_mm}));
    cell.weight = static_cast<float>(sum);
    cell.squares += static_cast<float>(weight * seen.share);
    cell.place_mm2 += static_cast<float>(weight * seen.by.dot(part.covariance * seen.by));
    cell.coverage += static_cast<float>(seen.share);
  });
}

void Fusion::compare(const Part& part) {
  std::vector<PadField::Mean> means(PadField::kCells * PadField::kCells);
  look(part, [&](size_t at, const Seen& seen) {
    // Of the map of all others: what this frame brought is not in it.
    const Cell& cell = cells_[at];
    const double rest = double{cell.weight} - seen.weight;
    if (rest < 0.5 * seen.weight) return;
    const double off = (seen.height_mm - double{cell.mean_mm}) * double{cell.weight} / rest;
    PadField::Mean& mean = means[static_cast<size_t>(seen.down * PadField::kCells) * PadField::kCells +
                                 static_cast<size_t>(seen.right * PadField::kCells)];
    mean.sum_mm += seen.share * off;
    mean.weight += seen.share;
  });
  pad_.add(means);
  pad_width_mm_ = -2 * part.frame.left_mm();
  pad_height_mm_ = -2 * part.frame.top_mm();
  turned_ += curvatures_in_map(part.motion);
  ++compared_;
}

MapBend Fusion::bend_of_map() const {
  if (compared_ == 0) return {};
  std::vector<Vector2d> places;
  for (size_t at = 0; at < cells_.size(); ++at)
    if (cells_[at].weight > 0) places.push_back(place_of(at));
  const Eigen::Matrix3d turned = turned_ / compared_;
  return {turned * pad_.curvature_covariance(pad_width_mm_, pad_height_mm_) * turned.transpose(), places};
}

FusedMap Fusion::finish() const {
  FusedMap out{.width = width_,
               .height = height_,
               .pitch_mm = options_.pitch_mm,
               .left_mm = left_mm_,
               .top_mm = top_mm_,
               .height_mm = {},
               .error_mm = {},
               .coverage = {}};
  // E[spread] = noise^2 (coverage - squares / weight).
  double spread = 0, freedom = 0;
  const auto free_part = [](const Cell& cell) {
    return std::max(double{cell.coverage} - double{cell.squares} / double{cell.weight}, 0.0);
  };
  for (const Cell& cell : cells_) {
    if (cell.weight <= 0) continue;
    spread += double{cell.spread};
    freedom += free_part(cell);
  }
  // What rounding leaves where no two key frames overlap is none.
  constexpr double kLeastFreedom = 10;
  const double noise2 = freedom > kLeastFreedom ? std::max(spread, 0.0) / freedom : NAN;
  out.noise_mm = std::sqrt(noise2);
  out.pad_mm = pad_.error_mm();
  out.bend = bend_of_map();
  constexpr double kShared = 4;  // key frames that the noise of the whole map counts as, in each cell
  double bent_mm2 = 0, seen_cells = 0;
  for (size_t at = 0; at < cells_.size(); ++at) {
    const Cell& cell = cells_[at];
    out.coverage.push_back(cell.coverage);
    if (cell.weight <= 0) {
      out.height_mm.push_back(NAN);
      out.error_mm.push_back(NAN);
      continue;
    }
    const double w = double{cell.weight}, bend_mm2 = out.bend.variance_mm2(place_of(at));
    const double local = (double{cell.spread} + kShared * noise2) / (free_part(cell) + kShared);
    out.height_mm.push_back(cell.mean_mm);
    out.error_mm.push_back(
        static_cast<float>(std::sqrt(local * double{cell.squares} / (w * w) + double{cell.place_mm2} / w +
                                     out.pad_mm * out.pad_mm + bend_mm2)));
    bent_mm2 += bend_mm2;
    ++seen_cells;
  }
  if (seen_cells > 0) out.bend_mm = std::sqrt(bent_mm2 / seen_cells);
  return out;
}

}  // namespace palpate
