#include "engine/calibrate/photometric_fit.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <optional>

#include "engine/calibrate/photometric_normal_table.h"
#include "engine/numeric/dense.h"
#include "engine/numeric/sparse.h"
#include "palpate/error.h"

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
  const Eigen::VectorXd eigenvalues = dense::symmetric_eigenvalues(full);
  const double largest = std::max(eigenvalues[kCoefficients - 1], 0.0);
  const double smallest = std::max(eigenvalues[0], 0.0);
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

// The equations of one press, its pixels of known normal, and for a ball the depth to be read from them.
struct PhotometricFit::Press {
  std::string label;
  NormalEquations contact;
  NormalEquations rest;
  std::vector<Eigen::Matrix<float, kCoefficients, 1>> features;
  std::vector<Eigen::Vector2f> normals;
  struct Ball {
    uint32_t width = 0;
    std::vector<uint8_t> inside;
    std::vector<double> depth_mm;  // of the inside pixels, row by row as the features; rim at 0
  } ball;

  void add(const Vector9& f, double nx, double ny) {
    contact.add(f, nx, ny);
    features.push_back(f.cast<float>());
    normals.emplace_back(static_cast<float>(nx), static_cast<float>(ny));
  }
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
        press.add(features(frame, background, x, y), normal_x[i], normal_y[i]);
    }
  presses_.push_back(std::move(press));
}

void PhotometricFit::add_ball(const Frame& frame, const Frame& background, double cx_px, double cy_px,
                              double contact_radius_px, double ball_radius_mm, const std::string& label,
                              std::span<const uint8_t> mask) {
  check_shapes(format_, frame, background, label);
  if (!mask.empty() && mask.size() != size_t{format_.width} * format_.height)
    throw Error(Failure::Input, "a mask of the frame's size", std::to_string(mask.size()) + " values",
                "one value for each pixel of " + label);
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
      if (!mask.empty() && mask[size_t{y} * format_.width + x]) continue;
      if (!linear_range(frame, background, x, y, format_.max_gray())) continue;
      const Vector9 f = features(frame, background, x, y);
      if (r >= contact_radius_px) {
        press.rest.add(f, 0, 0);
        continue;
      }
      const double to_normal = -pitch_mm_per_px_ / ball_radius_mm;
      press.add(f, to_normal * dx, to_normal * dy);
      const double r_mm = r * pitch_mm_per_px_;
      ball.inside[size_t{y - y0} * ball.width + (x - x0)] = 1;
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

namespace {

constexpr uint32_t kTableSide = 17;
constexpr double kSteepest = 0.999;      // largest component along the pad that a normal is taken to have
constexpr double kClearlyBetter = 0.98;  // the table's error over the linear one's, for it to be chosen

// A fitted model: the linear weights and, if there is one, the table over them.
struct Model {
  Weights weights;
  std::optional<NormalTable> table;

  std::array<double, 2> normal(const Eigen::Matrix<float, kCoefficients, 1>& features) const {
    const Vector9 f = features.cast<double>();
    double nx = weights.x.dot(f), ny = weights.y.dot(f);
    if (table) {
      const auto corrected = corrected_normal(*table, nx, ny);
      nx = corrected[0], ny = corrected[1];
    }
    return {nx, ny};
  }
};

// One that has a third component, so that slopes stay finite.
std::array<double, 2> bounded_normal(std::array<double, 2> n) {
  const double length = std::hypot(n[0], n[1]);
  return length > kSteepest ? std::array{n[0] * kSteepest / length, n[1] * kSteepest / length} : n;
}

double degrees(double radians) {
  return radians * 180 / 3.14159265358979;
}

// Sums of one model's errors over presses.
struct ErrorSums {
  double square = 0, angle2 = 0, pixels = 0, depth_square = 0, gain = 0;
  int balls = 0;

  HeldOutErrors errors() const {
    HeldOutErrors e;
    if (pixels > 0) {
      e.normal_rms = std::sqrt(square / (2 * pixels));
      e.normal_angle_deg = degrees(std::sqrt(angle2 / pixels));
    }
    if (balls > 0) {
      e.depth_rmse_mm = std::sqrt(depth_square / balls);
      e.depth_gain = gain / balls;
    }
    return e;
  }
};

}  // namespace

PhotometricFitResult PhotometricFit::solve(double rest_weight, NormalModel wanted) const {
  if (!(rest_weight >= 0 && rest_weight <= 1000))
    throw Error(Failure::Input, "a rest weight from 0 to 1000", std::to_string(rest_weight), "1");
  if (presses_.size() < 2)
    throw Error(Failure::Input, "two presses or more, so that the error is known on one not used",
                std::to_string(presses_.size()), "adding presses at other places of the pad");
  // The model that all presses but one give; none is left out where `without` is past the last.
  const auto fitted = [&](size_t without, bool with_table) {
    NormalEquations others;
    for (size_t j = 0; j < presses_.size(); ++j)
      if (j != without) others += presses_[j].all(rest_weight);
    Model model{solve_weights(others), std::nullopt};
    if (!with_table) return model;
    double reach = 0.1;
    for (const int pass : {0, 1}) {
      NormalTableFit table(kTableSide, std::min(1.0, reach));
      for (size_t j = 0; j < presses_.size(); ++j) {
        if (j == without) continue;
        const Press& p = presses_[j];
        for (size_t k = 0; k < p.features.size(); ++k) {
          const Vector9 f = p.features[k].cast<double>();
          const double nx = model.weights.x.dot(f), ny = model.weights.y.dot(f);
          if (pass == 0)
            reach = std::max({reach, std::abs(nx), std::abs(ny)});
          else
            table.add(nx, ny, static_cast<double>(p.normals[k].x()), static_cast<double>(p.normals[k].y()));
        }
      }
      if (pass == 1) model.table = table.solve();
    }
    return model;
  };
  // What a model says of a press.
  const auto judge = [&](const Press& p, const Model& model, ErrorSums& sums) {
    HeldOutPress h;
    h.label = p.label;
    h.contact_px = static_cast<uint64_t>(p.contact.weight);
    double square = 0, angle2 = 0;
    std::vector<std::array<double, 2>> read;
    for (size_t k = 0; k < p.features.size(); ++k) {
      const auto raw = model.normal(p.features[k]);
      const auto n = read.emplace_back(bounded_normal(raw));
      const double tx = static_cast<double>(p.normals[k].x()), ty = static_cast<double>(p.normals[k].y());
      square += std::pow(raw[0] - tx, 2) + std::pow(raw[1] - ty, 2);
      const double dot = n[0] * tx + n[1] * ty +
                         std::sqrt(std::max(0.0, 1 - n[0] * n[0] - n[1] * n[1])) *
                             std::sqrt(std::max(0.0, 1 - tx * tx - ty * ty));
      angle2 += std::pow(std::acos(std::clamp(dot, -1.0, 1.0)), 2);
    }
    const auto pixels = static_cast<double>(std::max<size_t>(p.features.size(), 1));
    h.normal_rms = std::sqrt(square / (2 * pixels));
    h.normal_angle_deg = degrees(std::sqrt(angle2 / pixels));
    sums.square += square;
    sums.angle2 += angle2;
    sums.pixels += static_cast<double>(p.features.size());
    if (p.ball.depth_mm.empty()) return h;
    std::vector<double> sx(p.ball.inside.size()), sy(p.ball.inside.size());
    double true_mean = 0;
    for (size_t k = 0, n = 0; k < p.ball.inside.size(); ++k) {
      if (!p.ball.inside[k]) continue;
      const double nz = std::sqrt(1 - read[n][0] * read[n][0] - read[n][1] * read[n][1]);
      sx[k] = read[n][0] / nz;
      sy[k] = read[n][1] / nz;
      true_mean += p.ball.depth_mm[n++];
    }
    true_mean /= static_cast<double>(p.ball.depth_mm.size());
    const std::vector<double> depth = integrate_patch(sx, sy, p.ball.inside, p.ball.width, pitch_mm_per_px_);
    double depth_square = 0, cross = 0, power = 0;
    for (size_t k = 0, n = 0; k < depth.size(); ++k) {
      if (!p.ball.inside[k]) continue;
      const double t = p.ball.depth_mm[n++] - true_mean;
      depth_square += (depth[k] - t) * (depth[k] - t);
      cross += depth[k] * t;
      power += t * t;
    }
    h.has_depth = true;
    h.depth_rmse_mm = std::sqrt(depth_square / static_cast<double>(p.ball.depth_mm.size()));
    h.depth_gain = power > 0 ? cross / power : 0;
    sums.depth_square += h.depth_rmse_mm * h.depth_rmse_mm;
    sums.gain += h.depth_gain;
    ++sums.balls;
    return h;
  };

  // How well either model does on presses left out one at a time.
  NormalEquations contacts;
  for (const Press& p : presses_) contacts += p.contact;
  ErrorSums linear_sums, table_sums;
  std::vector<HeldOutPress> linear_presses, table_presses;
  double error_x = 0, error_y = 0;
  for (size_t i = 0; i < presses_.size(); ++i) {
    const Press& p = presses_[i];
    Model model = fitted(i, wanted != NormalModel::Linear);
    if (model.table) table_presses.push_back(judge(p, model, table_sums));
    model.table.reset();
    linear_presses.push_back(judge(p, model, linear_sums));
    error_x += squared_error(p.contact.gram, p.contact.to_x, p.contact.xx, model.weights.x);
    error_y += squared_error(p.contact.gram, p.contact.to_y, p.contact.yy, model.weights.y);
  }
  PhotometricFitResult result;
  result.linear = linear_sums.errors();
  result.table = table_sums.errors();
  const bool better =
      result.table.normal_rms <= result.linear.normal_rms &&
      (linear_sums.balls > 0 ? result.table.depth_rmse_mm < kClearlyBetter * result.linear.depth_rmse_mm
                             : result.table.normal_rms < kClearlyBetter * result.linear.normal_rms);
  const bool with_table = wanted == NormalModel::Table || (wanted == NormalModel::Best && better);
  const Model model = fitted(presses_.size(), with_table);
  const HeldOutErrors& errors = with_table ? result.table : result.linear;
  result.model = with_table ? NormalModel::Table : NormalModel::Linear;
  result.presses = with_table ? table_presses : linear_presses;
  for (int c = 0; c < 3; ++c)
    for (int k = 0; k < 3; ++k) {
      result.calibration.wx[c][k] = model.weights.x[3 * c + k];
      result.calibration.wy[c][k] = model.weights.y[3 * c + k];
    }
  result.calibration.table = model.table;
  result.calibration.normal_sd = errors.normal_rms;
  result.condition = model.weights.condition;
  result.ridge = model.weights.ridge;
  result.contact_px = static_cast<uint64_t>(contacts.weight);
  ErrorSums own;
  for (const Press& p : presses_) judge(p, model, own);
  result.normal_rms_fitted = own.errors().normal_rms;
  result.normal_rms_held_out = errors.normal_rms;
  result.normal_angle_deg = errors.normal_angle_deg;
  result.depth_rmse_mm = errors.depth_rmse_mm;
  result.depth_gain = errors.depth_gain;
  const double spread_x = contacts.xx - contacts.x * contacts.x / contacts.weight;
  const double spread_y = contacts.yy - contacts.y * contacts.y / contacts.weight;
  result.explained_x = spread_x > 0 ? 1 - error_x / spread_x : 0;
  result.explained_y = spread_y > 0 ? 1 - error_y / spread_y : 0;
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
  std::vector<sparse::Entry> entries;
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
  const Eigen::VectorXd z = sparse::Factor(sparse::Factor::Kind::Ldlt, unknowns, entries).solve(right);
  const double mean = z.mean();
  for (size_t i = 0; i < pixels; ++i)
    if (inside[i]) depth[i] = (z[index[i]] - mean) * pitch_mm_per_px;
  return depth;
}

}  // namespace palpate
