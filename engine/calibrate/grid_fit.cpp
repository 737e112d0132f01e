#include "engine/calibrate/grid_fit.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "engine/numeric/dense.h"
#include "palpate/error.h"

namespace palpate {
namespace {

constexpr size_t kLeastPoints = 12;
constexpr double kWorthIt = 0.95;        // held-out error with a further term over without it
constexpr double kLeastError_px = 0.05;  // of a point, whatever the residuals
constexpr double kMostDrawnOut_px = 2;   // standard error of the distortion at the image's corners
constexpr std::array<int, 4> kTermChoices = {0, 1, 2, 4};

struct Camera {
  double focal, cx, cy;
};

Camera camera_for(uint32_t width, uint32_t height) {
  return {static_cast<double>(std::max(width, height)), 0.5 * (width - 1.0), 0.5 * (height - 1.0)};
}

// Distorts a place in units of the focal length, k = (k1, k2, p1, p2).
Eigen::Vector2d distorted(const Eigen::Vector2d& p, const Eigen::Vector4d& k) {
  const double r2 = p.squaredNorm(), radial = 1 + r2 * (k[0] + r2 * k[1]);
  return {p.x() * radial + 2 * k[2] * p.x() * p.y() + k[3] * (r2 + 2 * p.x() * p.x()),
          p.y() * radial + k[2] * (r2 + 2 * p.y() * p.y()) + 2 * k[3] * p.x() * p.y()};
}

// A view in units in which all numbers are about 1.
struct Scaled {
  std::vector<Eigen::Vector2d> seen, grid;
  Eigen::Vector2d middle;
  double extent = 1;
};

Scaled scaled(const GridView& view, const Camera& camera) {
  Scaled s;
  Eigen::Vector2d low(1e300, 1e300), high(-1e300, -1e300);
  for (const auto& g : view.grid_mm) {
    low = low.cwiseMin(Eigen::Vector2d(g[0], g[1]));
    high = high.cwiseMax(Eigen::Vector2d(g[0], g[1]));
  }
  s.middle = 0.5 * (low + high);
  s.extent = std::max((high - low).maxCoeff() / 2, 1e-9);
  for (size_t i = 0; i < view.seen_px.size(); ++i) {
    s.seen.emplace_back((view.seen_px[i][0] - camera.cx) / camera.focal,
                        (view.seen_px[i][1] - camera.cy) / camera.focal);
    s.grid.push_back((Eigen::Vector2d(view.grid_mm[i][0], view.grid_mm[i][1]) - s.middle) / s.extent);
  }
  return s;
}

Eigen::Vector2d project(const Eigen::Matrix<double, 8, 1>& h, const Eigen::Vector2d& g) {
  const double w = h[6] * g.x() + h[7] * g.y() + 1;
  return {(h[0] * g.x() + h[1] * g.y() + h[2]) / w, (h[3] * g.x() + h[4] * g.y() + h[5]) / w};
}

// The homography without distortion, by linear least squares.
Eigen::Matrix<double, 8, 1> first_homography(const Scaled& view) {
  const auto n = static_cast<Eigen::Index>(view.seen.size());
  Eigen::MatrixXd a = Eigen::MatrixXd::Zero(2 * n, 8);
  Eigen::VectorXd b(2 * n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const auto &g = view.grid[static_cast<size_t>(i)], &s = view.seen[static_cast<size_t>(i)];
    a.row(2 * i) << g.x(), g.y(), 1, 0, 0, 0, -s.x() * g.x(), -s.x() * g.y();
    a.row(2 * i + 1) << 0, 0, 0, g.x(), g.y(), 1, -s.y() * g.x(), -s.y() * g.y();
    b[2 * i] = s.x();
    b[2 * i + 1] = s.y();
  }
  return dense::least_squares(a, b);
}

struct GridModel {
  std::vector<Eigen::Matrix<double, 8, 1>> views;
  Eigen::Vector4d lens = Eigen::Vector4d::Zero();
};

// Which points a fit uses: all, or those whose number is even.
enum class Part { All, Even, Odd };
bool in(Part part, size_t i) {
  return part == Part::All || (i % 2 == 0) == (part == Part::Even);
}

// Squared distances of a part's points, and how many there are.
double squared(const std::vector<Scaled>& views, const GridModel& model, Part part, size_t& count) {
  double sum = 0;
  for (size_t v = 0; v < views.size(); ++v)
    for (size_t i = 0; i < views[v].seen.size(); ++i)
      if (in(part, i)) {
        sum += (distorted(project(model.views[v], views[v].grid[i]), model.lens) - views[v].seen[i])
                   .squaredNorm();
        ++count;
      }
  return sum;
}

/// `information`: of the lens alone, where it is asked for: the homographies are free.
GridModel fitted(const std::vector<Scaled>& views, int terms, Part part,
                 Eigen::MatrixXd* information = nullptr) {
  GridModel model;
  for (const Scaled& view : views) model.views.push_back(first_homography(view));
  const auto unknowns = static_cast<Eigen::Index>(8 * views.size()) + terms;
  double damping = 1e-4;
  size_t count = 0;
  double cost = squared(views, model, part, count);
  for (int iteration = 0; iteration < 60; ++iteration) {
    Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(unknowns, unknowns);
    Eigen::VectorXd gradient = Eigen::VectorXd::Zero(unknowns);
    const auto lens_at = static_cast<Eigen::Index>(8 * views.size());
    for (size_t v = 0; v < views.size(); ++v)
      for (size_t i = 0; i < views[v].seen.size(); ++i) {
        if (!in(part, i)) continue;
        const auto place = [&](const Eigen::Matrix<double, 8, 1>& h, const Eigen::Vector4d& k) {
          return distorted(project(h, views[v].grid[i]), k);
        };
        const Eigen::Vector2d here = place(model.views[v], model.lens);
        Eigen::Matrix<double, 2, 12> j = Eigen::Matrix<double, 2, 12>::Zero();
        constexpr double kStep = 1e-6;
        for (int p = 0; p < 8 + terms; ++p) {
          auto h = model.views[v];
          auto k = model.lens;
          (p < 8 ? h[p] : k[p - 8]) += kStep;
          j.col(p) = (place(h, k) - here) / kStep;
        }
        const Eigen::Vector2d error = here - views[v].seen[i];
        const auto at = static_cast<Eigen::Index>(8 * v);
        const auto jh = j.leftCols<8>();
        const auto jk = j.middleCols(8, terms);
        normal.block<8, 8>(at, at) += jh.transpose() * jh;
        normal.block(at, lens_at, 8, terms) += jh.transpose() * jk;
        normal.block(lens_at, at, terms, 8) += jk.transpose() * jh;
        normal.block(lens_at, lens_at, terms, terms) += jk.transpose() * jk;
        gradient.segment<8>(at) += jh.transpose() * error;
        gradient.segment(lens_at, terms) += jk.transpose() * error;
      }
    if (information)
      *information = normal.bottomRightCorner(terms, terms) -
                     normal.bottomLeftCorner(terms, lens_at) *
                         dense::Ldlt(Eigen::MatrixXd(normal.topLeftCorner(lens_at, lens_at)))
                             .solve(Eigen::MatrixXd(normal.topRightCorner(lens_at, terms)));
    bool better = false, settled = false;
    for (int attempt = 0; attempt < 8 && !better; ++attempt, damping *= 6) {
      Eigen::MatrixXd damped = normal;
      damped.diagonal() *= 1 + damping;
      const Eigen::VectorXd step = dense::Ldlt(damped).solve(gradient);
      GridModel next = model;
      for (size_t v = 0; v < views.size(); ++v)
        next.views[v] -= step.segment<8>(static_cast<Eigen::Index>(8 * v));
      for (int t = 0; t < terms; ++t) next.lens[t] -= step[lens_at + t];
      size_t ignored = 0;
      const double tried = squared(views, next, part, ignored);
      if (tried < cost) {
        settled = cost - tried < 1e-10 * cost;
        cost = tried;
        model = std::move(next);
        better = true;
        damping = std::max(damping / 40, 1e-12);
      }
    }
    if (!better || settled) break;
  }
  return model;
}

/// Largest standard error of the distortion's shift at the image's corners, units of the focal length.
double corner_sd(const std::vector<Scaled>& views, int terms, const Camera& camera, double point_sd) {
  if (terms == 0) return 0;
  Eigen::MatrixXd information;
  fitted(views, terms, Part::All, &information);
  const Eigen::MatrixXd covariance =
      dense::Ldlt(information).solve(Eigen::MatrixXd(Eigen::MatrixXd::Identity(terms, terms))) * point_sd *
      point_sd;
  double most = 0;
  for (const double across : {-1.0, 1.0})
    for (const double down : {-1.0, 1.0}) {
      const Eigen::Vector2d corner(across * camera.cx / camera.focal, down * camera.cy / camera.focal);
      Eigen::MatrixXd shift(2, terms);
      for (int t = 0; t < terms; ++t) {
        Eigen::Vector4d one = Eigen::Vector4d::Zero();
        one[t] = 1;
        shift.col(t) = distorted(corner, one) - corner;
      }
      most = std::max(most, (shift * covariance * shift.transpose()).trace());
    }
  return std::isfinite(most) ? std::sqrt(most) : std::numeric_limits<double>::infinity();
}

Eigen::Matrix3d matrix(const std::array<double, 9>& h) {
  return Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(h.data());
}

/// The turn, mirrored where the matrix is, that is nearest to it.
Eigen::Matrix2d nearest_turn(const Eigen::Matrix2d& m) {
  const bool mirrored = m.determinant() < 0;
  Eigen::Matrix2d a = m;
  if (mirrored) a.row(1) *= -1;
  const double angle = std::atan2(a(1, 0) - a(0, 1), a(0, 0) + a(1, 1));
  Eigen::Matrix2d turn;
  turn << std::cos(angle), -std::sin(angle), std::sin(angle), std::cos(angle);
  if (mirrored) turn.row(1) *= -1;
  return turn;
}

Eigen::Vector2d apply(const Eigen::Matrix3d& h, double x, double y) {
  const Eigen::Vector3d p = h * Eigen::Vector3d(x, y, 1);
  return p.head<2>() / p[2];
}

}  // namespace

GridFit fit_grid(const std::vector<GridView>& views, uint32_t width, uint32_t height) {
  const Camera camera = camera_for(width, height);
  std::vector<Scaled> scaled_views;
  for (const GridView& view : views) {
    if (view.seen_px.size() < kLeastPoints || view.seen_px.size() != view.grid_mm.size())
      throw Error(Failure::Input, std::to_string(kLeastPoints) + " points of a grid or more in each picture",
                  std::to_string(view.seen_px.size()), "a grid with more points");
    scaled_views.push_back(scaled(view, camera));
  }
  if (views.empty())
    throw Error(Failure::Input, "a picture of a grid", "none", "pictures in which every point is visible");
  GridFit fit;
  for (const Scaled& view : scaled_views)
    for (const Eigen::Vector2d& p : view.seen)
      fit.reach = std::max(fit.reach, p.norm() * camera.focal / std::hypot(camera.cx, camera.cy));
  fit.reach = std::min(fit.reach, 1.0);
  double best = std::numeric_limits<double>::infinity();
  for (const int terms : kTermChoices) {
    size_t count = 0;
    double sum = 0;
    for (const auto& [fit_on, judge_on] : {std::pair{Part::Even, Part::Odd}, {Part::Odd, Part::Even}})
      sum += squared(scaled_views, fitted(scaled_views, terms, fit_on), judge_on, count);
    const double held_out = std::sqrt(sum / static_cast<double>(count)) * camera.focal;
    if (terms == 0) fit.plain_px = held_out;
    // Beyond the points the model would extrapolate.
    const double point_sd = std::max(held_out, kLeastError_px) / camera.focal;
    if (terms > 0 && corner_sd(scaled_views, terms, camera, point_sd) * camera.focal > kMostDrawnOut_px)
      continue;
    if (held_out < kWorthIt * best) {
      best = held_out;
      fit.terms = terms;
      fit.held_out_px = held_out;
    }
  }
  const GridModel model = fitted(scaled_views, fit.terms, Part::All);
  size_t count = 0;
  const double rms = std::sqrt(squared(scaled_views, model, Part::All, count) / static_cast<double>(count));
  if (!std::isfinite(rms))
    throw Error(Failure::Input, "grid points that fit a lens and a plane", "none",
                "checking --grid and its order of columns and rows");
  fit.lens.fx_px = fit.lens.fy_px = camera.focal;
  fit.lens.cx_px = camera.cx;
  fit.lens.cy_px = camera.cy;
  fit.lens.distortion = {model.lens[0], model.lens[1], model.lens[2], model.lens[3], 0};
  fit.lens.residual_px = rms * camera.focal;
  for (size_t v = 0; v < views.size(); ++v) {
    Eigen::Matrix3d to_unit, h, to_px;
    const auto& p = model.views[v];
    h << p[0], p[1], p[2], p[3], p[4], p[5], p[6], p[7], 1;
    to_unit << 1 / scaled_views[v].extent, 0, -scaled_views[v].middle.x() / scaled_views[v].extent, 0,
        1 / scaled_views[v].extent, -scaled_views[v].middle.y() / scaled_views[v].extent, 0, 0, 1;
    to_px << camera.focal, 0, camera.cx, 0, camera.focal, camera.cy, 0, 0, 1;
    const Eigen::Matrix3d all = to_px * h * to_unit;
    std::array<double, 9> rows{};
    for (int i = 0; i < 9; ++i) rows[static_cast<size_t>(i)] = all(i / 3, i % 3);
    fit.to_px.push_back(rows);
  }
  return fit;
}

PadFrame pad_frame(const GridFit& fit, const GridView& first, uint32_t width, uint32_t height,
                   double spacing_relative_sd) {
  const Camera camera = camera_for(width, height);
  const Eigen::Vector4d k(fit.lens.distortion[0], fit.lens.distortion[1], fit.lens.distortion[2],
                          fit.lens.distortion[3]);
  Eigen::Matrix3d to_mm = matrix(fit.to_px.front()).inverse();
  // Where a place of the image as taken lies on the grid.
  const auto on_grid = [&](double x, double y) {
    const Eigen::Vector2d seen((x - camera.cx) / camera.focal, (y - camera.cy) / camera.focal);
    Eigen::Vector2d p = seen;
    for (int i = 0; i < 50; ++i) p += seen - distorted(p, k);
    return apply(to_mm, camera.focal * p.x() + camera.cx, camera.focal * p.y() + camera.cy);
  };
  // The grid may lie at any turn, or be mirrored: the rectified frame has the image's sides.
  const Eigen::Vector2d middle = on_grid(camera.cx, camera.cy);
  Eigen::Matrix2d to_grid;
  to_grid.col(0) = on_grid(camera.cx + 0.5, camera.cy) - on_grid(camera.cx - 0.5, camera.cy);
  to_grid.col(1) = on_grid(camera.cx, camera.cy + 0.5) - on_grid(camera.cx, camera.cy - 0.5);
  const Eigen::Matrix2d turn = nearest_turn(to_grid).transpose();
  PadFrame pad;
  pad.pitch_mm_per_px = std::sqrt(std::abs(to_grid.determinant()));
  // The whole of each side of the image limits the rectangle.
  double left = -1e300, right = 1e300, top = -1e300, bottom = 1e300;
  const auto upright = [&](double x, double y) -> Eigen::Vector2d { return turn * (on_grid(x, y) - middle); };
  constexpr int kSteps = 200;
  for (int i = 0; i <= kSteps; ++i) {
    const double x = (width - 1.0) * i / kSteps, y = (height - 1.0) * i / kSteps;
    left = std::max(left, upright(0, y).x());
    right = std::min(right, upright(width - 1.0, y).x());
    top = std::max(top, upright(x, 0).y());
    bottom = std::min(bottom, upright(x, height - 1.0).y());
  }
  const double across = std::floor((right - left) / pad.pitch_mm_per_px) + 1,
               down = std::floor((bottom - top) / pad.pitch_mm_per_px) + 1;
  if (!(across >= 16 && down >= 16 && across <= kMaxSide_px && down <= kMaxSide_px))
    throw Error(Failure::Input, "a grid whose plane the image shows whole",
                "a grid that is seen at a steep angle, or points that are not those of the grid",
                "looking at it from straight above, and --grid as printed");
  pad.size_px = {static_cast<uint32_t>(across), static_cast<uint32_t>(down)};
  right = left + (across - 1) * pad.pitch_mm_per_px;
  bottom = top + (down - 1) * pad.pitch_mm_per_px;
  const std::array<Eigen::Vector2d, 4> corners = {Eigen::Vector2d(left, top), Eigen::Vector2d(right, top),
                                                  Eigen::Vector2d(right, bottom),
                                                  Eigen::Vector2d(left, bottom)};
  const Eigen::Matrix3d to_px = matrix(fit.to_px.front());
  for (size_t i = 0; i < 4; ++i) {
    const Eigen::Vector2d mm = middle + turn.transpose() * corners[i], px = apply(to_px, mm.x(), mm.y());
    pad.quad_px[i] = {px.x(), px.y()};
  }
  // A scale is the slope of px over mm: its error is that of the points over their spread.
  double mean_x = 0, mean_y = 0, spread = 0;
  const auto n = static_cast<double>(first.seen_px.size());
  for (const auto& p : first.seen_px) mean_x += p[0] / n, mean_y += p[1] / n;
  for (const auto& p : first.seen_px) spread += std::pow(p[0] - mean_x, 2) + std::pow(p[1] - mean_y, 2);
  pad.pitch_sd_mm_per_px =
      pad.pitch_mm_per_px *
      std::hypot(fit.held_out_px / std::sqrt(std::max(spread, 1.0)), spacing_relative_sd);
  return pad;
}

}  // namespace palpate
