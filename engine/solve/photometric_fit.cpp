#include "engine/solve/photometric_fit.h"

#include <Eigen/Dense>
#include <Eigen/Sparse>
#include <algorithm>
#include <cmath>

#include "engine/error.h"

namespace palpate {
namespace {

constexpr int kCoefficients = 9;
using Matrix9 = Eigen::Matrix<double, kCoefficients, kCoefficients>;
using Vector9 = Eigen::Matrix<double, kCoefficients, 1>;

// Normal equations of n = f . w for both components.
struct NormalEquations {
  Matrix9 gram = Matrix9::Zero();
  Vector9 to_x = Vector9::Zero();
  Vector9 to_y = Vector9::Zero();
  double xx = 0, yy = 0, x = 0, y = 0, weight = 0;

  void add(const Vector9& f, double nx, double ny) {
    gram.selfadjointView<Eigen::Lower>().rankUpdate(f);
    to_x += nx * f;
    to_y += ny * f;
    xx += nx * nx;
    yy += ny * ny;
    x += nx;
    y += ny;
    weight += 1;
  }
  void scale(double s) {
    gram *= s;
    to_x *= s;
    to_y *= s;
    xx *= s;
    yy *= s;
    x *= s;
    y *= s;
    weight *= s;
  }
  NormalEquations& operator+=(const NormalEquations& o) {
    gram += o.gram;
    to_x += o.to_x;
    to_y += o.to_y;
    xx += o.xx;
    yy += o.yy;
    x += o.x;
    y += o.y;
    weight += o.weight;
    return *this;
  }
};

struct Weights {
  Vector9 x, y;
  double condition = 0;
  double ridge = 0;
};

// Coefficients in the order of PhotometricCalibration: channel by channel (1, X, Y).
Weights solve_weights(const NormalEquations& e) {
  const Matrix9 full = e.gram.selfadjointView<Eigen::Lower>();
  const Eigen::SelfAdjointEigenSolver<Matrix9> eigen(full, Eigen::EigenvaluesOnly);
  const double largest = std::max(eigen.eigenvalues()[kCoefficients - 1], 0.0);
  const double smallest = std::max(eigen.eigenvalues()[0], 0.0);
  Weights w;
  // The Gram matrix squares the condition, so what rounding leaves of a singular design is about 1e-8.
  w.condition = smallest > 0 ? std::sqrt(largest / smallest) : INFINITY;
  if (largest <= 0) {
    w.x.setZero();
    w.y.setZero();
    return w;
  }
  Matrix9 a = full;
  if (!(w.condition <= PhotometricFit::kWorstCondition)) {
    w.ridge = 1 / (PhotometricFit::kWorstCondition * PhotometricFit::kWorstCondition);
    a.diagonal().array() += w.ridge * largest;
  }
  const Eigen::LDLT<Matrix9> solver(a);
  w.x = solver.solve(e.to_x);
  w.y = solver.solve(e.to_y);
  // One step of refinement wins back the digits that the squared condition costs.
  w.x += solver.solve(e.to_x - a * w.x);
  w.y += solver.solve(e.to_y - a * w.y);
  return w;
}

// Sum of squared errors of one component.
double squared_error(const Matrix9& gram, const Vector9& to_n, double nn, const Vector9& w) {
  const Matrix9 full = gram.selfadjointView<Eigen::Lower>();
  return std::max(0.0, w.dot(full * w) - 2 * w.dot(to_n) + nn);
}

bool linear_range(const Frame& a, const Frame& b, uint32_t x, uint32_t y, uint32_t full) {
  for (uint32_t c = 0; c < 3; ++c) {
    const uint32_t p = a.at(c, x, y), q = b.at(c, x, y);
    if (p == 0 || q == 0 || p >= full || q >= full) return false;
  }
  return true;
}

Vector9 features(const Frame& frame, const Frame& background, uint32_t x, uint32_t y) {
  const FrameFormat& f = frame.format;
  const double across = (2.0 * x + 1) / f.width - 1, down = (2.0 * y + 1) / f.height - 1;
  Vector9 v;
  for (uint32_t c = 0; c < 3; ++c) {
    const double change =
        (static_cast<double>(frame.at(c, x, y)) - static_cast<double>(background.at(c, x, y))) / f.max_gray();
    v.segment<3>(3 * static_cast<int>(c)) << change, change * across, change * down;
  }
  return v;
}

}  // namespace

// The equations of one press, and for a ball the colour changes inside its contact, for the depth check.
struct PhotometricFit::Press {
  std::string label;
  NormalEquations contact;
  NormalEquations rest;
  struct Ball {
    uint32_t width = 0;
    std::vector<uint8_t> inside;
    std::vector<Vector9> features;  // of the inside pixels, row by row
    std::vector<double> depth_mm;   // of the inside pixels, rim at 0
  } ball;

  NormalEquations all(double rest_weight) const {
    NormalEquations e = rest;
    e.scale(rest_weight);
    e += contact;
    return e;
  }
};

PhotometricFit::PhotometricFit(const FrameFormat& format, double pitch_mm_per_px)
    : format_(format), pitch_mm_per_px_(pitch_mm_per_px) {
  if (format.channels != 3)
    throw Error(Failure::Input, "three colour channels for a photometric fit",
                std::to_string(format.channels) + " channel", "a sensor file with \"channels\": 3");
  if (!(pitch_mm_per_px > 0) || !std::isfinite(pitch_mm_per_px))
    throw Error(Failure::Input, "a positive pitch in mm per px", std::to_string(pitch_mm_per_px),
                "setting pitch_mm_per_px in the sensor file");
}

PhotometricFit::~PhotometricFit() = default;
PhotometricFit::PhotometricFit(PhotometricFit&&) noexcept = default;
PhotometricFit& PhotometricFit::operator=(PhotometricFit&&) noexcept = default;

namespace {
void check_shapes(const FrameFormat& wanted, const Frame& frame, const Frame& background,
                  const std::string& label) {
  if (!(frame.format == wanted) || !(background.format == wanted))
    throw Error(Failure::Input, "press and background images of one format", "different ones for " + label,
                "images of the same camera and sensor file");
}
}  // namespace

void PhotometricFit::add_normals(const Frame& frame, const Frame& background,
                                 std::span<const double> normal_x, std::span<const double> normal_y,
                                 const std::string& label) {
  check_shapes(format_, frame, background, label);
  const size_t pixels = size_t{format_.width} * format_.height;
  if (normal_x.size() != pixels || normal_y.size() != pixels)
    throw Error(Failure::Input, std::to_string(pixels) + " normals", std::to_string(normal_x.size()),
                "one normal for each pixel of " + label);
  Press press;
  press.label = label;
  for (uint32_t y = 0; y < format_.height; ++y)
    for (uint32_t x = 0; x < format_.width; ++x) {
      const size_t i = size_t{y} * format_.width + x;
      if (std::isnan(normal_x[i]) || std::isnan(normal_y[i])) continue;
      if (linear_range(frame, background, x, y, format_.max_gray()))
        press.contact.add(features(frame, background, x, y), normal_x[i], normal_y[i]);
    }
  presses_.push_back(std::move(press));
}

void PhotometricFit::add_ball(const Frame& frame, const Frame& background, double cx_px, double cy_px,
                              double contact_radius_px, double ball_radius_mm, const std::string& label) {
  check_shapes(format_, frame, background, label);
  const double contact_radius_mm = contact_radius_px * pitch_mm_per_px_;
  if (!(contact_radius_px >= 2) || !(contact_radius_mm < ball_radius_mm) || !std::isfinite(ball_radius_mm))
    throw Error(Failure::Input, "a contact of 2 px or more that is smaller than its ball",
                "contact radius " + std::to_string(contact_radius_mm) + " mm on a ball of radius " +
                    std::to_string(ball_radius_mm) + " mm for " + label,
                "checking the pitch of the sensor file and the radii");
  Press press;
  press.label = label;
  Press::Ball& ball = press.ball;
  const auto bound = [](double v, uint32_t side) {
    return static_cast<uint32_t>(std::clamp(v, 0.0, static_cast<double>(side)));
  };
  const uint32_t x0 = bound(std::floor(cx_px - contact_radius_px), format_.width);
  const uint32_t x1 = bound(std::ceil(cx_px + contact_radius_px) + 1, format_.width);
  const uint32_t y0 = bound(std::floor(cy_px - contact_radius_px), format_.height);
  const uint32_t y1 = bound(std::ceil(cy_px + contact_radius_px) + 1, format_.height);
  ball.width = x1 > x0 ? x1 - x0 : 0;
  ball.inside.assign(size_t{ball.width} * (y1 > y0 ? y1 - y0 : 0), 0);

  const double rim_mm = std::sqrt(ball_radius_mm * ball_radius_mm - contact_radius_mm * contact_radius_mm);
  for (uint32_t y = 0; y < format_.height; ++y)
    for (uint32_t x = 0; x < format_.width; ++x) {
      const double dx = x - cx_px, dy = y - cy_px, r = std::hypot(dx, dy);
      if (r >= contact_radius_px && r < kRestRing * contact_radius_px) continue;
      if (!linear_range(frame, background, x, y, format_.max_gray())) continue;
      const Vector9 f = features(frame, background, x, y);
      if (r >= contact_radius_px) {
        press.rest.add(f, 0, 0);
        continue;
      }
      const double to_normal = -pitch_mm_per_px_ / ball_radius_mm;
      press.contact.add(f, to_normal * dx, to_normal * dy);
      const double r_mm = r * pitch_mm_per_px_;
      ball.inside[size_t{y - y0} * ball.width + (x - x0)] = 1;
      ball.features.push_back(f);
      ball.depth_mm.push_back(std::sqrt(ball_radius_mm * ball_radius_mm - r_mm * r_mm) - rim_mm);
    }
  const double disc_px = 3.14159265358979 * contact_radius_px * contact_radius_px;
  if (press.contact.weight < 0.5 * disc_px)
    throw Error(Failure::Input, "half of the contact or more in the frame, neither black nor saturated",
                std::to_string(static_cast<int>(100 * press.contact.weight / disc_px)) + " % for " + label,
                "checking its centre and radius (px of the rectified frame)");
  if (press.rest.weight > press.contact.weight) press.rest.scale(press.contact.weight / press.rest.weight);
  presses_.push_back(std::move(press));
}

PhotometricFitResult PhotometricFit::solve(double rest_weight) const {
  if (!(rest_weight >= 0 && rest_weight <= 1000))
    throw Error(Failure::Input, "a rest weight from 0 to 1000", std::to_string(rest_weight), "1");
  if (presses_.size() < 2)
    throw Error(Failure::Input, "two presses or more, so that the error is known on one not used",
                std::to_string(presses_.size()), "adding presses at other places of the pad");
  NormalEquations all, contacts;
  for (const Press& p : presses_) {
    all += p.all(rest_weight);
    contacts += p.contact;
  }
  PhotometricFitResult result;
  const Weights w = solve_weights(all);
  for (int c = 0; c < 3; ++c)
    for (int k = 0; k < 3; ++k) {
      result.calibration.wx[c][k] = w.x[3 * c + k];
      result.calibration.wy[c][k] = w.y[3 * c + k];
    }
  result.condition = w.condition;
  result.ridge = w.ridge;
  result.normal_rms_fitted = std::sqrt((squared_error(contacts.gram, contacts.to_x, contacts.xx, w.x) +
                                        squared_error(contacts.gram, contacts.to_y, contacts.yy, w.y)) /
                                       (2 * contacts.weight));

  double error_x = 0, error_y = 0, depth_square = 0, gain = 0;
  int balls = 0;
  for (size_t i = 0; i < presses_.size(); ++i) {
    const Press& p = presses_[i];
    NormalEquations others;
    for (size_t j = 0; j < presses_.size(); ++j)
      if (j != i) others += presses_[j].all(rest_weight);
    const Weights v = solve_weights(others);
    HeldOutPress h;
    h.label = p.label;
    h.contact_px = static_cast<uint64_t>(p.contact.weight);
    const double ex = squared_error(p.contact.gram, p.contact.to_x, p.contact.xx, v.x);
    const double ey = squared_error(p.contact.gram, p.contact.to_y, p.contact.yy, v.y);
    h.normal_rms = p.contact.weight > 0 ? std::sqrt((ex + ey) / (2 * p.contact.weight)) : 0;
    error_x += ex;
    error_y += ey;
    if (!p.ball.depth_mm.empty()) {
      std::vector<double> sx(p.ball.inside.size()), sy(p.ball.inside.size());
      double true_mean = 0;
      for (size_t k = 0, n = 0; k < p.ball.inside.size(); ++k) {
        if (!p.ball.inside[k]) continue;
        double nx = v.x.dot(p.ball.features[n]), ny = v.y.dot(p.ball.features[n]);
        const double length = std::hypot(nx, ny), steepest = 0.999;
        if (length > steepest) nx *= steepest / length, ny *= steepest / length;
        const double nz = std::sqrt(1 - nx * nx - ny * ny);
        sx[k] = nx / nz;
        sy[k] = ny / nz;
        true_mean += p.ball.depth_mm[n++];
      }
      true_mean /= static_cast<double>(p.ball.depth_mm.size());
      const std::vector<double> depth =
          integrate_patch(sx, sy, p.ball.inside, p.ball.width, pitch_mm_per_px_);
      double square = 0, cross = 0, power = 0;
      for (size_t k = 0, n = 0; k < depth.size(); ++k) {
        if (!p.ball.inside[k]) continue;
        const double t = p.ball.depth_mm[n++] - true_mean;
        square += (depth[k] - t) * (depth[k] - t);
        cross += depth[k] * t;
        power += t * t;
      }
      h.has_depth = true;
      h.depth_rmse_mm = std::sqrt(square / static_cast<double>(p.ball.depth_mm.size()));
      h.depth_gain = power > 0 ? cross / power : 0;
      depth_square += h.depth_rmse_mm * h.depth_rmse_mm;
      gain += h.depth_gain;
      ++balls;
    }
    result.contact_px += h.contact_px;
    result.presses.push_back(std::move(h));
  }
  result.normal_rms_held_out = std::sqrt((error_x + error_y) / (2 * contacts.weight));
  result.calibration.normal_sd = result.normal_rms_held_out;
  const double spread_x = contacts.xx - contacts.x * contacts.x / contacts.weight;
  const double spread_y = contacts.yy - contacts.y * contacts.y / contacts.weight;
  result.explained_x = spread_x > 0 ? 1 - error_x / spread_x : 0;
  result.explained_y = spread_y > 0 ? 1 - error_y / spread_y : 0;
  if (balls > 0) {
    result.depth_rmse_mm = std::sqrt(depth_square / balls);
    result.depth_gain = gain / balls;
  }
  const double least = std::min(result.explained_x, result.explained_y);
  if (!(least >= kLeastExplained))
    throw Error(Failure::Input, "colour changes that tell both slopes on presses not used for the fit",
                "at best " + std::to_string(static_cast<int>(100 * std::max(least, 0.0))) +
                    " % of the normals explained",
                "images lit by three colours from different sides, and checked centres and radii");
  return result;
}

std::vector<double> integrate_patch(std::span<const double> slope_x, std::span<const double> slope_y,
                                    std::span<const uint8_t> inside, uint32_t width, double pitch_mm_per_px) {
  const size_t pixels = inside.size();
  std::vector<int> index(pixels, -1);
  int unknowns = 0;
  for (size_t i = 0; i < pixels; ++i)
    if (inside[i]) index[i] = unknowns++;
  std::vector<double> depth(pixels, 0.0);
  if (unknowns == 0) return depth;

  // One equation for each pair of neighbours: the step between them is the mean of their slopes.
  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(static_cast<size_t>(unknowns) * 9);
  Eigen::VectorXd right = Eigen::VectorXd::Zero(unknowns);
  const auto link = [&](size_t a, size_t b, double step) {
    const int i = index[a], j = index[b];
    entries.emplace_back(i, i, 1.0);
    entries.emplace_back(j, j, 1.0);
    entries.emplace_back(i, j, -1.0);
    entries.emplace_back(j, i, -1.0);
    right[i] -= step;
    right[j] += step;
  };
  for (size_t i = 0; i < pixels; ++i) {
    if (!inside[i]) continue;
    if ((i + 1) % width != 0 && inside[i + 1]) link(i, i + 1, 0.5 * (slope_x[i] + slope_x[i + 1]));
    if (i + width < pixels && inside[i + width]) link(i, i + width, 0.5 * (slope_y[i] + slope_y[i + width]));
    // Heights are known up to a constant; this much pulls each part's mean to 0 and changes nothing else.
    entries.emplace_back(index[i], index[i], 1e-9);
  }
  Eigen::SparseMatrix<double> a(unknowns, unknowns);
  a.setFromTriplets(entries.begin(), entries.end());
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver(a);
  const Eigen::VectorXd z = solver.solve(right);
  const double mean = z.mean();
  for (size_t i = 0; i < pixels; ++i)
    if (inside[i]) depth[i] = (z[index[i]] - mean) * pitch_mm_per_px;
  return depth;
}

}  // namespace palpate
