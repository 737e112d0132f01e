#include "engine/map/pad_field.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "engine/numeric/dense.h"

namespace palpate {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr double kFewestFrames = 3;  // that tell what they have in common
/// Ratio of a wave's size to that of the next order, of errors that reach as far as the pad or less: chosen
/// on two simulated objects.
constexpr double kOrderRatio = 1.7;

/// Polynomials of a pad's places (half a side is 1) to fourth order, by order.
struct Term {
  int right, down;
  int order() const { return right + down; }
};
constexpr std::array<Term, 15> kTerms = {{{0, 0},
                                          {1, 0},
                                          {0, 1},
                                          {2, 0},
                                          {0, 2},
                                          {1, 1},
                                          {3, 0},
                                          {2, 1},
                                          {1, 2},
                                          {0, 3},
                                          {4, 0},
                                          {3, 1},
                                          {2, 2},
                                          {1, 3},
                                          {0, 4}}};
constexpr Index kCount = kTerms.size();

/// Orthogonal waves over some cells, RMS 1, each of terms up to its own.
struct Waves {
  MatrixXd at;     ///< cells by waves
  MatrixXd terms;  ///< terms by waves
};
Waves waves_over(const std::vector<size_t>& cells) {
  const auto count = static_cast<Index>(cells.size());
  Waves out{MatrixXd(count, kCount), MatrixXd::Identity(kCount, kCount)};
  for (Index row = 0; row < count; ++row) {
    const size_t cell = cells[static_cast<size_t>(row)];
    const auto place = [](size_t step) { return (2 * double(step) + 1) / double(PadField::kCells) - 1; };
    const double x = place(cell % PadField::kCells), y = place(cell / PadField::kCells);
    for (Index k = 0; k < kCount; ++k) {
      const Term& term = kTerms[static_cast<size_t>(k)];
      out.at(row, k) = std::pow(x, term.right) * std::pow(y, term.down);
    }
  }
  for (Index k = 0; k < kCount; ++k) {
    for (Index before = 0; before < k; ++before) {
      const double part = out.at.col(before).dot(out.at.col(k)) / double(count);
      out.at.col(k) -= part * out.at.col(before);
      out.terms.col(k) -= part * out.terms.col(before);
    }
    const double size = std::max(out.at.col(k).norm() / std::sqrt(double(count)), 1e-9);
    out.at.col(k) /= size;
    out.terms.col(k) /= size;
  }
  return out;
}

/// Heights of the three curvatures at a place: that of 1/mm each.
Vector3d bent(const Vector2d& p) {
  return {p[0] * p[0] / 2, p[1] * p[1] / 2, p[0] * p[1]};
}

}  // namespace

bool PadField::Cell::known() const {
  return frames >= kFewestFrames;
}

void PadField::add(const std::vector<Mean>& means) {
  std::vector<float>& frame = frames_.emplace_back(cells_.size(), NAN);
  for (size_t k = 0; k < cells_.size(); ++k) {
    if (means[k].weight <= 0) continue;
    const double mean_mm = means[k].sum_mm / means[k].weight;
    frame[k] = static_cast<float>(mean_mm);
    cells_[k].sum_mm += mean_mm;
    cells_[k].squares_mm2 += mean_mm * mean_mm;
    ++cells_[k].frames;
  }
}

double PadField::error_mm() const {
  double squares_mm2 = 0, known = 0;
  for (const Cell& cell : cells_) {
    if (!cell.known()) continue;
    const double mean_mm = cell.mean_mm(),
                 stray_mm2 = (cell.squares_mm2 / cell.frames - mean_mm * mean_mm) / (cell.frames - 1);
    squares_mm2 += mean_mm * mean_mm - stray_mm2;
    ++known;
  }
  return known > 0 ? std::sqrt(std::max(squares_mm2 / known, 0.0)) : 0;
}

Matrix3d PadField::curvature_covariance(double width_mm, double height_mm) const {
  std::vector<size_t> cells;
  for (size_t k = 0; k < cells_.size(); ++k)
    if (cells_[k].known()) cells.push_back(k);
  const auto frames = static_cast<double>(frames_.size());
  if (cells.size() < 2 * kTerms.size() || frames < kFewestFrames) return Matrix3d::Zero();
  const Waves waves = waves_over(cells);
  // A frame's own waves; where it tells nothing, what all have in common.
  VectorXd sum = VectorXd::Zero(kCount), squares = VectorXd::Zero(kCount);
  VectorXd field(waves.at.rows());
  for (const std::vector<float>& frame : frames_) {
    for (size_t k = 0; k < cells.size(); ++k) {
      const double own = double{frame[cells[k]]};
      field[static_cast<Index>(k)] = std::isnan(own) ? cells_[cells[k]].mean_mm() : own;
    }
    const VectorXd size = waves.at.transpose() * field / double(cells.size());
    sum += size;
    squares += size.cwiseAbs2();
  }
  double variance = 0, counted = 0;
  for (Index k = 0; k < kCount; ++k) {
    const int order = kTerms[static_cast<size_t>(k)].order();
    if (order < 3) continue;
    const double mean = sum[k] / frames, stray = (squares[k] / frames - mean * mean) / (frames - 1);
    variance += (mean * mean - stray) * std::pow(kOrderRatio, 2 * (order - 2));
    ++counted;
  }
  variance = std::max(variance / counted, 0.0);
  // Terms 3 to 5 are x^2, y^2 and x y.
  const Vector3d scale(8 / (width_mm * width_mm), 8 / (height_mm * height_mm), 4 / (width_mm * height_mm));
  const Matrix3d curvatures = scale.asDiagonal() * waves.terms.block<3, 3>(3, 3);
  return variance * curvatures * curvatures.transpose();
}

Matrix3d curvatures_in_map(const RigidMotion& motion) {
  const double turn =
      std::atan2(motion.turn(1, 0) - motion.turn(0, 1), motion.turn(0, 0) + motion.turn(1, 1));
  const double c = std::cos(turn), s = std::sin(turn);
  Matrix3d out;
  out << c * c, s * s, 2 * s * c, s * s, c * c, -2 * s * c, -s * c, s * c, c * c - s * s;
  return out;
}

MapBend::MapBend(const Matrix3d& curvature, const std::vector<Vector2d>& places) : curvature_(curvature) {
  if (places.empty()) return;
  for (const Vector2d& place : places) middle_mm_ += place / double(places.size());
  Matrix3d square = Matrix3d::Identity() * 1e-9, right = Matrix3d::Zero();
  for (const Vector2d& place : places) {
    const Vector2d p = place - middle_mm_;
    const Vector3d row(1, p[0], p[1]);
    square += row * row.transpose();
    right += row * bent(p).transpose();
  }
  plane_ = dense::inverse(square) * right;
}

double MapBend::variance_mm2(const Vector2d& place) const {
  const Vector2d p = place - middle_mm_;
  const Vector3d by = bent(p) - plane_.transpose() * Vector3d(1, p[0], p[1]);
  return by.dot(curvature_ * by);
}

Matrix6d MapBend::of_motion(const RigidMotion& motion, const Vector3d& middle_mm) const {
  const Vector3d place = motion.inverse() * middle_mm;
  const Vector2d p = place.head<2>() - middle_mm_;
  Eigen::Matrix<double, 6, 3> by = Eigen::Matrix<double, 6, 3>::Zero();
  by.row(2) = (bent(p) - plane_.transpose() * Vector3d(1, p[0], p[1])).transpose();
  by.row(3) = Vector3d(0, p[1], p[0]).transpose() - plane_.row(2);
  by.row(4) = -(Vector3d(p[0], 0, p[1]).transpose() - plane_.row(1));
  by.topRows<3>() = (motion.turn * by.topRows<3>()).eval();
  by.bottomRows<3>() = (motion.turn * by.bottomRows<3>()).eval();
  return by * curvature_ * by.transpose();
}

}  // namespace palpate
