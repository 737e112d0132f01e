#include "engine/map/place_search.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "engine/numeric/dense.h"

namespace palpate {
namespace {

using Eigen::Vector3d;

constexpr double kCellsOfRadius = 20, kDiscOfRadius = 0.8;
constexpr double kFine_cells = 1,
                 kCoarse_cells = 5;    // what is finer than the one and coarser than the other goes
constexpr size_t kMostCells = 60'000;  // of the mosaic

/// A Gaussian along rows and columns.
void blur(std::vector<float>& values, int width, int height, double sd) {
  const auto far = static_cast<std::ptrdiff_t>(std::ceil(3 * sd));
  std::vector<float> kernel, line;
  for (std::ptrdiff_t k = -far; k <= far; ++k)
    kernel.push_back(static_cast<float>(std::exp(-0.5 * static_cast<double>(k * k) / (sd * sd))));
  const auto pass = [&](std::ptrdiff_t lines, std::ptrdiff_t length, std::ptrdiff_t next,
                        std::ptrdiff_t step) {
    line.resize(static_cast<size_t>(length));
    for (std::ptrdiff_t l = 0; l < lines; ++l) {
      float* const first = values.data() + l * next;
      for (std::ptrdiff_t i = 0; i < length; ++i) line[static_cast<size_t>(i)] = first[i * step];
      for (std::ptrdiff_t i = 0; i < length; ++i) {
        float sum = 0;
        for (std::ptrdiff_t k = std::max(-far, -i); k <= far && i + k < length; ++k)
          sum += kernel[static_cast<size_t>(k + far)] * line[static_cast<size_t>(i + k)];
        first[i * step] = sum;
      }
    }
  };
  pass(height, width, width, 1);
  pass(width, height, 1, width);
}

}  // namespace

PlaceSearch::PlaceSearch(const std::vector<Part>& map, const KeyFrame& frame)
    : cell_mm_(frame.radius_mm() / kCellsOfRadius), middle_mm_(frame.middle_mm()) {
  const RigidMotion here;
  if (map.empty() || !(cell_mm_ > 0)) {
    turn_ = kTurns;
    return;
  }
  map_ = cells_of(map);
  find_relief(map_);
  for (const float relief : map_.relief) squares_.push_back(relief * relief);
  Cells own = cells_of({{frame, here}});
  find_relief(own);
  const double disc_mm = kDiscOfRadius * frame.radius_mm();
  for (int y = 0; y < own.height; ++y)
    for (int x = 0; x < own.width; ++x) {
      const double right = own.left_mm + x * cell_mm_ - middle_mm_[0],
                   down = own.top_mm + y * cell_mm_ - middle_mm_[1];
      if (own.known[own.at(x, y)] > 0 && std::hypot(right, down) <= disc_mm)
        points_.push_back({right, down, double{own.depth[own.at(x, y)]}, own.relief[own.at(x, y)]});
    }
}

PlaceSearch::Cells PlaceSearch::cells_of(const std::vector<Part>& parts) const {
  double left = INFINITY, right = -INFINITY, top = INFINITY, bottom = -INFINITY;
  for (const Part& part : parts) {
    const Vector3d middle = part.motion.inverse() * part.frame.middle_mm();
    const double reach = std::hypot(part.frame.left_mm(), part.frame.top_mm());
    left = std::min(left, middle[0] - reach);
    right = std::max(right, middle[0] + reach);
    top = std::min(top, middle[1] - reach);
    bottom = std::max(bottom, middle[1] + reach);
  }
  Cells out;
  out.left_mm = left;
  out.top_mm = top;
  const double columns = (right - left) / cell_mm_ + 1, rows = (bottom - top) / cell_mm_ + 1;
  if (!(columns * rows < kMostCells)) return out;  // larger maps are not searched
  out.width = static_cast<int>(columns);
  out.height = static_cast<int>(rows);
  out.depth.assign(static_cast<size_t>(out.width) * static_cast<size_t>(out.height), 0);
  out.known = out.depth;
  for (const Part& part : parts) {
    const KeyFrame::Unpacked frame = part.frame.unpacked();
    const RigidMotion back = part.motion.inverse();
    const auto step = std::max(1u, static_cast<uint32_t>(cell_mm_ / (2 * frame.pitch_mm)));
    for (uint32_t v = 0; v < frame.height; v += step)
      for (uint32_t u = 0; u < frame.width; u += step) {
        const size_t pixel = size_t{v} * frame.width + u;
        if (frame.contact[pixel] == 0) continue;
        const Vector3d p =
            back * Vector3d(part.frame.left_mm() + u * frame.pitch_mm,
                            part.frame.top_mm() + v * frame.pitch_mm, double{frame.depth[pixel]});
        const auto x = static_cast<int>(std::lround((p[0] - left) / cell_mm_)),
                   y = static_cast<int>(std::lround((p[1] - top) / cell_mm_));
        if (x < 0 || y < 0 || x >= out.width || y >= out.height) continue;
        out.depth[out.at(x, y)] += static_cast<float>(p[2]);
        out.known[out.at(x, y)] += 1;
      }
  }
  for (size_t i = 0; i < out.known.size(); ++i) {
    if (out.known[i] <= 0) continue;
    out.depth[i] /= out.known[i];
    out.known[i] = 1;
  }
  return out;
}

/// What lies between two reaches of a Gaussian, by the known cells alone.
void PlaceSearch::find_relief(Cells& cells) const {
  const auto smoothed = [&](double sd) {
    std::vector<float> sum = cells.depth, weight = cells.known;
    blur(sum, cells.width, cells.height, sd);
    blur(weight, cells.width, cells.height, sd);
    for (size_t i = 0; i < sum.size(); ++i) sum[i] = cells.known[i] > 0 ? sum[i] / weight[i] : 0;
    return sum;
  };
  cells.relief = smoothed(kFine_cells);
  const std::vector<float> coarse = smoothed(kCoarse_cells);
  for (size_t i = 0; i < coarse.size(); ++i) cells.relief[i] -= coarse[i];
}

double PlaceSearch::correlate(const std::vector<Point>& points, double turn_rad) {
  const double cosine = std::cos(turn_rad), sine = std::sin(turn_rad);
  const size_t cells = map_.known.size();
  product_.assign(cells, 0);
  map_squares_.assign(cells, 0);
  frame_squares_.assign(cells, 0);
  double whole = 0;
  for (const Point& p : points) {
    const auto right = static_cast<int>(std::lround((cosine * p.x_mm - sine * p.y_mm) / cell_mm_)),
               down = static_cast<int>(std::lround((sine * p.x_mm + cosine * p.y_mm) / cell_mm_));
    const float relief = p.relief, square = relief * relief;
    whole += double{square};
    const int x0 = std::max(0, -right), x1 = std::min(map_.width, map_.width - right);
    for (int y = std::max(0, -down); y < std::min(map_.height, map_.height - down); ++y) {
      const size_t to = map_.at(0, y), from = map_.at(0, y + down) + static_cast<size_t>(right);
      for (int x = x0; x < x1; ++x) {
        const size_t i = to + static_cast<size_t>(x), j = from + static_cast<size_t>(x);
        product_[i] += relief * map_.relief[j];
        map_squares_[i] += squares_[j];
        frame_squares_[i] += square * map_.known[j];
      }
    }
  }
  return whole;
}

bool PlaceSearch::step() {
  if (turn_ >= kTurns || points_.empty() || map_.known.empty()) return false;
  const double turn = 2 * std::numbers::pi * turn_++ / kTurns;
  const double whole = correlate(points_, turn);
  Peak best{.turn_rad = turn, .x_mm = 0, .y_mm = 0, .likeness = 0};
  for (int y = 1; y + 1 < map_.height; ++y)
    for (int x = 1; x + 1 < map_.width; ++x) {
      const size_t i = map_.at(x, y);
      if (double{frame_squares_[i]} < kLeastShared * whole) continue;
      const double likeness =
          double{product_[i]} / std::sqrt(double{map_squares_[i]} * double{frame_squares_[i]} + 1e-30);
      if (likeness < kLeastLikeness) continue;
      bool peak = true;
      for (int dy = -1; dy <= 1; ++dy)
        for (int dx = -1; dx <= 1; ++dx) peak = peak && product_[map_.at(x + dx, y + dy)] <= product_[i];
      if (!peak) continue;
      best.x_mm = map_.left_mm + x * cell_mm_;
      best.y_mm = map_.top_mm + y * cell_mm_;
      best.likeness = likeness;
      keep(best);
    }
  return turn_ < kTurns;
}

bool PlaceSearch::map_repeats() {
  constexpr double kAlike = 0.75, kElsewhere_cells = 7;
  constexpr size_t kMostPoints = 3000;
  // Shifts along the longer side, and to both sides of it by half of the shorter.
  const bool wide = map_.width >= map_.height;
  const int middle_x = wide ? 0 : map_.width / 2, middle_y = wide ? map_.height / 2 : 0;
  std::vector<Point> points;
  const auto known = static_cast<size_t>(std::ranges::count(map_.known, 1.0f));
  const size_t stride = known / kMostPoints + 1;
  size_t number = 0;
  for (int y = 0; y < map_.height; ++y)
    for (int x = 0; x < map_.width; ++x)
      if (map_.known[map_.at(x, y)] > 0 && number++ % stride == 0)
        points.push_back(
            {(x - middle_x) * cell_mm_, (y - middle_y) * cell_mm_, 0, map_.relief[map_.at(x, y)]});
  if (points.empty() || points_.empty()) return false;
  const double whole = correlate(points, 0),
               least = kLeastShared * double(points_.size()) / double(known) * whole;
  for (int y = 0; y < map_.height; ++y)
    for (int x = 0; x < map_.width; ++x) {
      const size_t i = map_.at(x, y);
      if (std::hypot(x - middle_x, y - middle_y) < kElsewhere_cells || double{frame_squares_[i]} < least)
        continue;
      if (double{product_[i]} > kAlike * std::sqrt(double{map_squares_[i]} * double{frame_squares_[i]}))
        return true;
    }
  return false;
}

/// In place of what is less like it and nearly the same place.
void PlaceSearch::keep(const Peak& peak) {
  constexpr double kSameTurn = 3.5 * 2 * std::numbers::pi / kTurns, kSame_cells = 4;
  const auto same = [&](const Peak& other) {
    const double turned = std::remainder(other.turn_rad - peak.turn_rad, 2 * std::numbers::pi);
    return std::abs(turned) < kSameTurn &&
           std::hypot(other.x_mm - peak.x_mm, other.y_mm - peak.y_mm) < kSame_cells * cell_mm_;
  };
  for (const Peak& other : peaks_)
    if (same(other) && other.likeness >= peak.likeness) return;
  std::erase_if(peaks_, same);
  peaks_.push_back(peak);
  std::ranges::sort(peaks_, std::greater<>(), &Peak::likeness);
  // Some more than are told: a better one may yet take the place of two.
  if (peaks_.size() > 2 * kMost) peaks_.pop_back();
}

/// With the level and the tilt that bring both depths together.
RigidMotion PlaceSearch::motion_of(const Peak& peak) const {
  const double cosine = std::cos(peak.turn_rad), sine = std::sin(peak.turn_rad);
  Eigen::Matrix3d square = Eigen::Matrix3d::Zero();
  Vector3d right = Vector3d::Zero();
  for (const Point& p : points_) {
    const Vector3d place(cosine * p.x_mm - sine * p.y_mm, sine * p.x_mm + cosine * p.y_mm, 1);
    const auto x = static_cast<int>(std::lround((peak.x_mm + place[0] - map_.left_mm) / cell_mm_)),
               y = static_cast<int>(std::lround((peak.y_mm + place[1] - map_.top_mm) / cell_mm_));
    if (x < 0 || y < 0 || x >= map_.width || y >= map_.height || map_.known[map_.at(x, y)] <= 0) continue;
    square += place * place.transpose();
    right += place * (double{map_.depth[map_.at(x, y)]} - p.depth);
  }
  const Eigen::VectorXd plane = dense::solve_lu(Eigen::MatrixXd(square), Eigen::VectorXd(right));
  Eigen::Matrix3d turned = Eigen::Matrix3d::Identity();
  turned.topLeftCorner<2, 2>() << cosine, -sine, sine, cosine;
  const Vector3d tilt(plane[1], -plane[0], 0);
  // From the pad to the map: about the frame's middle, to the peak.
  RigidMotion back{turn_of(tilt) * turned, Vector3d::Zero()};
  back.shift_mm = Vector3d(peak.x_mm, peak.y_mm, middle_mm_[2] + plane[2]) - back.turn * middle_mm_;
  return back.inverse();
}

std::vector<PlaceGuess> PlaceSearch::guesses() const {
  std::vector<PlaceGuess> out;
  for (const Peak& peak : peaks_) {
    if (out.size() == kMost) break;
    out.push_back({motion_of(peak), peak.likeness});
  }
  return out;
}

}  // namespace palpate
