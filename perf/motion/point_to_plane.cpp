#include "perf/motion/point_to_plane.h"

#include <algorithm>
#include <cmath>

#include "engine/numeric/dense.h"

namespace palpate::perf {
namespace {

using Eigen::Vector3d;
using Level = ContactSurface::Level;

Vector3d point(const Level& level, uint32_t column, uint32_t row) {
  return {level.left_mm + column * level.pitch_mm, level.top_mm + row * level.pitch_mm,
          double{level.depth[size_t{row} * level.width + column]}};
}

/// The pixel in contact whose point is nearest to p; the map's size where there is none.
size_t nearest(const Level& level, const Vector3d& p) {
  constexpr int kReach = 3;
  const int column = static_cast<int>(std::lround((p[0] - level.left_mm) / level.pitch_mm));
  const int row = static_cast<int>(std::lround((p[1] - level.top_mm) / level.pitch_mm));
  double least = std::pow(kReach * level.pitch_mm, 2);
  size_t best = level.depth.size();
  for (int y = std::max(row - kReach, 0); y <= std::min(row + kReach, int(level.height) - 1); ++y)
    for (int x = std::max(column - kReach, 0); x <= std::min(column + kReach, int(level.width) - 1); ++x) {
      const size_t pixel = static_cast<size_t>(y) * level.width + static_cast<size_t>(x);
      if (level.mask[pixel] == 0) continue;
      const double square =
          (point(level, static_cast<uint32_t>(x), static_cast<uint32_t>(y)) - p).squaredNorm();
      if (square < least) best = pixel;
      least = std::min(square, least);
    }
  return best;
}

}  // namespace

PointToPlane point_to_plane(const ContactSurface& key, const ContactSurface& now, const RigidMotion& start) {
  const Level &there = key.levels().front(), &here = now.levels().front();
  PointToPlane out{.motion = start};
  for (int step = 0; step < 30; ++step) {
    Matrix6d square = Matrix6d::Zero();
    Vector6d right = Vector6d::Zero();
    size_t partners = 0;
    const RigidMotion back = out.motion.inverse();
    for (const uint32_t pixel : here.inside) {
      const Vector3d p = back * point(here, pixel % here.width, pixel / here.width);
      const size_t other = nearest(there, p);
      if (other == there.depth.size()) continue;
      const auto row = static_cast<uint32_t>(other / there.width);
      const auto column = static_cast<uint32_t>(other % there.width);
      const Vector3d normal =
          Vector3d(double{there.slope_x[other]}, double{there.slope_y[other]}, -1).normalized();
      Vector6d line;
      line << normal, cross(p) * normal;
      const double miss = normal.dot(p - point(there, column, row));
      square += line * line.transpose();
      right += line * miss;
      ++partners;
    }
    out.overlap = double(partners) / double(std::max<size_t>(here.inside.size(), 1));
    if (partners < 60) return out;
    const Vector6d move = dense::solve_lu(Eigen::MatrixXd(square), Eigen::VectorXd(right));
    // p moves by -move; the motion is the inverse of what moves p.
    out.motion = (motion_about(Vector3d::Zero(), -move) * back).inverse();
    if (move.head<3>().norm() < 1e-5 && move.tail<3>().norm() < 1e-6) break;
  }
  return out;
}

}  // namespace palpate::perf
