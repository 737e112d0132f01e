#include "engine/numeric/capacitance.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>

#include "engine/numeric/dense.h"
#include "engine/numeric/transform/lane_map.h"

namespace palpate {
namespace {

/// Sums x_0 + (-1)^k x_n + 2 sum over 0 < i < n of x_i cos(pi i k / n) of sixteen lines of n + 1 elements: as
/// a line that goes on as its mirror image, whose spectrum is real.
class EndToEndCosine {
 public:
  explicit EndToEndCosine(uint32_t n) : n_(n), fft_(2 * n), data_(fft_.rows()), scratch_(fft_.rows()) {}

  /// The lines' elements, to be written before transform().
  LaneRow* line() { return data_.data(); }
  const LaneRow* transform() {
    for (uint32_t i = 1; i < n_; ++i) data_[2 * n_ - i] = data_[i];
    return fft_.forward(data_.data(), scratch_.data());
  }

 private:
  uint32_t n_;
  LaneFft fft_;
  std::vector<LaneRow> data_, scratch_;
};

/// Heights of a unit source on a grid with natural boundary, mean 0: a lattice without boundary, of twice the
/// size, and the source's mirror images.
class Green {
 public:
  Green(uint32_t width, uint32_t height)
      : width_(width), height_(height), lattice_(size_t{width + 1} * (height + 1)) {
    const auto eigenvalue = [](uint32_t k, uint32_t n) { return 2 - 2 * std::cos(std::numbers::pi * k / n); };
    LaneMap map(width + 1, height + 1);
    EndToEndCosine along_x(width), along_y(height);
    for (uint32_t block = 0; block < map.column_blocks(); ++block) {
      for (uint32_t y = 0; y <= height; ++y)
        for (uint32_t lane = 0; lane < LaneMap::kSide; ++lane) {
          const uint32_t x = std::min(block * LaneMap::kSide + lane, width);
          along_y.line()[y].values[lane] =
              x + y == 0 ? 0 : 1 / (eigenvalue(x, width) + eigenvalue(y, height)) / (4.0 * width * height);
        }
      std::copy_n(along_y.transform(), height + 1, map.columns(block));
    }
    for (uint32_t block = 0; block < map.row_blocks(); ++block) {
      map.read_rows(block, along_x.line(), std::identity{});
      const LaneRow* rows = along_x.transform();
      const uint32_t top = block * LaneMap::kSide, count = std::min(LaneMap::kSide, height + 1 - top);
      for (uint32_t x = 0; x <= width; ++x)
        for (uint32_t i = 0; i < count; ++i) at(x, top + i) = rows[x].values[i];
    }
  }

  double operator()(const EdgeCell& source, uint32_t x, uint32_t y) const {
    const uint32_t near_x = apart(source.x, x), near_y = apart(source.y, y);
    const uint32_t far_x = mirrored(source.x, x, width_), far_y = mirrored(source.y, y, height_);
    return at(near_x, near_y) + at(far_x, near_y) + at(near_x, far_y) + at(far_x, far_y);
  }

 private:
  double& at(uint32_t x, uint32_t y) { return lattice_[size_t{y} * (width_ + 1) + x]; }
  double at(uint32_t x, uint32_t y) const { return lattice_[size_t{y} * (width_ + 1) + x]; }
  static uint32_t apart(uint32_t a, uint32_t b) { return a > b ? a - b : b - a; }
  // The lattice repeats after 2 n and is even.
  static uint32_t mirrored(uint32_t a, uint32_t b, uint32_t n) {
    const uint32_t sum = a + b + 1;
    return sum > n ? 2 * n - sum : sum;
  }

  uint32_t width_, height_;
  std::vector<double> lattice_;
};

struct Edge {
  std::vector<EdgeCell> cells;
  std::vector<uint32_t> island;  // of each, from 1
  uint32_t islands = 0;
};

EdgeCell missing_at(const CellFaces& f, size_t i) {
  EdgeCell cell{static_cast<uint32_t>(i % f.width), static_cast<uint32_t>(i / f.width)};
  if (cell.x > 0) cell.left = f.whole_across[i - 1] - f.across[i - 1];
  cell.right = f.whole_across[i] - f.across[i];
  if (cell.y > 0) cell.up = f.whole_down[i - f.width] - f.down[i - f.width];
  cell.down = f.whole_down[i] - f.down[i];
  return cell;
}

// Which island each cell belongs to, from 1: cells joined by known faces; 0 without any.
std::vector<uint32_t> islands_of(const CellFaces& f, uint32_t& count) {
  std::vector<uint32_t> island(f.across.size());
  std::vector<size_t> reached;
  const auto join = [&](size_t cell, float weight) {
    if (weight <= 0 || island[cell] != 0) return;
    island[cell] = count;
    reached.push_back(cell);
  };
  count = 0;
  for (size_t first = 0; first < island.size(); ++first) {
    if (island[first] != 0 || (f.across[first] <= 0 && f.down[first] <= 0)) continue;
    ++count;
    join(first, 1);
    while (!reached.empty()) {
      const size_t i = reached.back();
      reached.pop_back();
      join(i + 1 < island.size() ? i + 1 : i, f.across[i]);
      join(i + f.width < island.size() ? i + f.width : i, f.down[i]);
      if (i % f.width > 0) join(i - 1, f.across[i - 1]);
      if (i >= f.width) join(i - f.width, f.down[i - f.width]);
    }
  }
  return island;
}

Edge edge_of(const CellFaces& f) {
  Edge edge;
  const std::vector<uint32_t> island = islands_of(f, edge.islands);
  for (size_t i = 0; i < island.size(); ++i) {
    const EdgeCell cell = missing_at(f, i);
    if (island[i] == 0 || cell.left + cell.right + cell.up + cell.down <= 0) continue;
    edge.cells.push_back(cell);
    edge.island.push_back(island[i]);
  }
  return edge;
}

}  // namespace

CellFaces faces_of_known(std::span<const uint8_t> known, uint32_t width, uint32_t height, uint32_t side) {
  CellFaces f;
  f.width = (width + side - 1) / side;
  f.height = (height + side - 1) / side;
  for (auto* values : {&f.across, &f.down, &f.whole_across, &f.whole_down})
    values->assign(size_t{f.width} * f.height, 0);
  const auto in = [&](uint32_t x, uint32_t y) { return known[size_t{y} * width + x] != 0; };
  // Middles of neighbouring cells are a side apart; of the last, narrower one less.
  const auto weight = [side](uint32_t end, uint32_t size) {
    const uint32_t next = std::min(side, size - end);
    return 2.0f / static_cast<float>(side + next);
  };
  for (uint32_t y = 0; y < height; ++y)
    for (uint32_t x = side; x < width; x += side) {
      const size_t cell = size_t{y / side} * f.width + x / side - 1;
      f.whole_across[cell] += weight(x, width);
      if (in(x - 1, y) && in(x, y)) f.across[cell] += weight(x, width);
    }
  for (uint32_t y = side; y < height; y += side)
    for (uint32_t x = 0; x < width; ++x) {
      const size_t cell = size_t{y / side - 1} * f.width + x / side;
      f.whole_down[cell] += weight(y, height);
      if (in(x, y - 1) && in(x, y)) f.down[cell] += weight(y, height);
    }
  return f;
}

std::optional<Capacitance> capacitance(const CellFaces& faces) {
  Edge edge = edge_of(faces);
  const size_t count = edge.cells.size();
  if (count > kMostEdgeCells) return std::nullopt;
  Capacitance result;
  result.islands = edge.islands;
  if (count == 0) return result;
  const Green green(faces.width, faces.height);
  const auto n = static_cast<Eigen::Index>(count);
  // Change of m - s of row i by a unit source at column j. A source is balanced by all cells together.
  Eigen::MatrixXd takes(n, n);
  const double balance = 1.0 / faces.width / faces.height;
  for (Eigen::Index j = 0; j < n; ++j) {
    const EdgeCell& source = edge.cells[static_cast<size_t>(j)];
    for (Eigen::Index i = 0; i < n; ++i) {
      const EdgeCell& c = edge.cells[static_cast<size_t>(i)];
      const double here = green(source, c.x, c.y);
      double flow = 0;
      if (c.left > 0) flow += double{c.left} * (here - green(source, c.x - 1, c.y));
      if (c.right > 0) flow += double{c.right} * (here - green(source, c.x + 1, c.y));
      if (c.up > 0) flow += double{c.up} * (here - green(source, c.x, c.y - 1));
      if (c.down > 0) flow += double{c.down} * (here - green(source, c.x, c.y + 1));
      takes(i, j) = (i == j ? 1 : 0) - balance - flow;
    }
  }
  // Heights of islands against each other are free: no island's sources may have a sum.
  std::vector<double> size(edge.islands + 1);
  for (const uint32_t island : edge.island) size[island] += 1;
  for (Eigen::Index j = 0; j < n; ++j)
    for (Eigen::Index i = 0; i < n; ++i) {
      const uint32_t island = edge.island[static_cast<size_t>(i)];
      if (island == edge.island[static_cast<size_t>(j)]) takes(i, j) += 1 / size[island];
    }
  const Eigen::MatrixXd sources = dense::inverse(takes);
  result.sources.reserve(count * count);
  for (Eigen::Index i = 0; i < n; ++i)
    for (Eigen::Index j = 0; j < n; ++j) result.sources.push_back(static_cast<float>(sources(i, j)));
  result.cells = std::move(edge.cells);
  return result;
}

}  // namespace palpate
