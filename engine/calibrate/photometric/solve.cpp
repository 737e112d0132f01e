// The fit itself: weights and table from the presses, and how far off they are on presses left out.
#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "engine/calibrate/photometric/fit.h"
#include "engine/calibrate/photometric/normal_table.h"
#include "engine/calibrate/photometric/press.h"
#include "engine/numeric/dense.h"
#include "engine/numeric/sparse.h"
#include "palpate/error.h"

namespace palpate {
namespace {

using photometric::Features, photometric::kCoefficients, photometric::Matrix9, photometric::NormalEquations,
    photometric::Vector9;

constexpr size_t kNone = std::numeric_limits<size_t>::max();  // no press is left out

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

constexpr uint32_t kTableSide = 17;
constexpr double kSteepest = 0.999;      // largest component along the pad that a normal is taken to have
constexpr double kClearlyBetter = 0.98;  // the table's error over the linear one's, for it to be chosen

// A fitted model: the linear weights and, if there is one, the table over them.
struct Model {
  Weights weights;
  std::optional<NormalTable> table;

  std::array<double, 2> normal(const Features& features) const {
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
  double square = 0, angle2 = 0, pixels = 0, depth_square = 0, cap_square = 0, gain = 0;
  int balls = 0;

  HeldOutErrors errors() const {
    HeldOutErrors e;
    if (pixels > 0) {
      e.normal_rms = std::sqrt(square / (2 * pixels));
      e.normal_angle_deg = degrees(std::sqrt(angle2 / pixels));
    }
    if (balls > 0) {
      e.depth_rmse_mm = std::sqrt(depth_square / balls);
      e.cap_rms_mm = std::sqrt(cap_square / balls);
      e.depth_gain = gain / balls;
    }
    return e;
  }
};

// The table over the linear model, from all presses but one.
NormalTable fit_table(std::span<const PhotometricPress> presses, size_t without, const Weights& weights) {
  const auto each_pixel = [&](const auto& visit) {
    for (size_t j = 0; j < presses.size(); ++j) {
      if (j == without) continue;
      const PhotometricPress& p = presses[j];
      for (size_t k = 0; k < p.features.size(); ++k) {
        const Vector9 f = p.features[k].cast<double>();
        visit(weights.x.dot(f), weights.y.dot(f), p.normals[k]);
      }
    }
  };
  double reach = 0.1;
  each_pixel([&](double nx, double ny, const Eigen::Vector2f&) {
    reach = std::max({reach, std::abs(nx), std::abs(ny)});
  });
  NormalTableFit table(kTableSide, std::min(1.0, reach));
  each_pixel([&](double nx, double ny, const Eigen::Vector2f& wanted) {
    table.add(nx, ny, static_cast<double>(wanted.x()), static_cast<double>(wanted.y()));
  });
  return table.solve();
}

// The model that all presses but one give.
Model fit_model(std::span<const PhotometricPress> presses, size_t without, double rest_weight,
                bool with_table) {
  NormalEquations others;
  for (size_t j = 0; j < presses.size(); ++j)
    if (j != without) others += presses[j].all(rest_weight);
  Model model{solve_weights(others), std::nullopt};
  if (with_table) model.table = fit_table(presses, without, model.weights);
  return model;
}

// Normals by a model from a press's pixels, and their errors.
struct ReadNormals {
  std::vector<std::array<double, 2>> bounded;
  double square = 0, angle2 = 0;  // sums over the pixels
};

ReadNormals read_normals(const PhotometricPress& p, const Model& model) {
  ReadNormals read;
  for (size_t k = 0; k < p.features.size(); ++k) {
    const auto raw = model.normal(p.features[k]);
    const auto n = read.bounded.emplace_back(bounded_normal(raw));
    const double tx = static_cast<double>(p.normals[k].x()), ty = static_cast<double>(p.normals[k].y());
    read.square += std::pow(raw[0] - tx, 2) + std::pow(raw[1] - ty, 2);
    const double dot = n[0] * tx + n[1] * ty +
                       std::sqrt(std::max(0.0, 1 - n[0] * n[0] - n[1] * n[1])) *
                           std::sqrt(std::max(0.0, 1 - tx * tx - ty * ty));
    read.angle2 += std::pow(std::acos(std::clamp(dot, -1.0, 1.0)), 2);
  }
  return read;
}

// Fills the depth's errors: the normals integrated, beside the ball's own shape.
void judge_depth(const PhotometricPress::Ball& ball, const std::vector<std::array<double, 2>>& normals,
                 double pitch_mm_per_px, HeldOutPress& held_out) {
  std::vector<double> sx(ball.inside.size()), sy(ball.inside.size());
  double true_mean = 0;
  for (size_t k = 0, n = 0; k < ball.inside.size(); ++k) {
    if (!ball.inside[k]) continue;
    const double nz = std::sqrt(1 - normals[n][0] * normals[n][0] - normals[n][1] * normals[n][1]);
    sx[k] = normals[n][0] / nz;
    sy[k] = normals[n][1] / nz;
    true_mean += ball.depth_mm[n++];
  }
  true_mean /= static_cast<double>(ball.depth_mm.size());
  const std::vector<double> depth = integrate_patch(sx, sy, ball.inside, ball.width, pitch_mm_per_px);
  double depth_square = 0, cap_square = 0, cross = 0, power = 0;
  for (size_t k = 0, n = 0; k < depth.size(); ++k) {
    if (!ball.inside[k]) continue;
    cap_square += ball.depth_mm[n] * ball.depth_mm[n];
    const double t = ball.depth_mm[n++] - true_mean;
    depth_square += (depth[k] - t) * (depth[k] - t);
    cross += depth[k] * t;
    power += t * t;
  }
  held_out.has_depth = true;
  held_out.depth_rmse_mm = std::sqrt(depth_square / static_cast<double>(ball.depth_mm.size()));
  held_out.cap_rms_mm = std::sqrt(cap_square / static_cast<double>(ball.depth_mm.size()));
  held_out.depth_gain = power > 0 ? cross / power : 0;
}

// Judges a model on one press; adds to the sums.
HeldOutPress judge(const PhotometricPress& p, const Model& model, double pitch_mm_per_px, ErrorSums& sums) {
  HeldOutPress h;
  h.label = p.label;
  h.contact_px = static_cast<uint64_t>(p.contact.weight);
  const ReadNormals read = read_normals(p, model);
  const auto pixels = static_cast<double>(std::max<size_t>(p.features.size(), 1));
  h.normal_rms = std::sqrt(read.square / (2 * pixels));
  h.normal_angle_deg = degrees(std::sqrt(read.angle2 / pixels));
  sums.square += read.square;
  sums.angle2 += read.angle2;
  sums.pixels += static_cast<double>(p.features.size());
  if (p.ball.depth_mm.empty()) return h;
  judge_depth(p.ball, read.bounded, pitch_mm_per_px, h);
  sums.depth_square += h.depth_rmse_mm * h.depth_rmse_mm;
  sums.cap_square += h.cap_rms_mm * h.cap_rms_mm;
  sums.gain += h.depth_gain;
  ++sums.balls;
  return h;
}

// How well either model does on presses left out one at a time.
struct CrossValidation {
  ErrorSums linear, table;
  std::vector<HeldOutPress> linear_presses, table_presses;
  double error_x = 0, error_y = 0;  // squares of the linear one's
};

CrossValidation cross_validate(std::span<const PhotometricPress> presses, double rest_weight, bool with_table,
                               double pitch_mm_per_px) {
  CrossValidation v;
  for (size_t i = 0; i < presses.size(); ++i) {
    const PhotometricPress& p = presses[i];
    Model model = fit_model(presses, i, rest_weight, with_table);
    if (model.table) v.table_presses.push_back(judge(p, model, pitch_mm_per_px, v.table));
    model.table.reset();
    v.linear_presses.push_back(judge(p, model, pitch_mm_per_px, v.linear));
    v.error_x += squared_error(p.contact.gram, p.contact.to_x, p.contact.xx, model.weights.x);
    v.error_y += squared_error(p.contact.gram, p.contact.to_y, p.contact.yy, model.weights.y);
  }
  return v;
}

// By depth where a ball determines it.
bool table_is_better(const HeldOutErrors& table, const HeldOutErrors& linear, bool with_depth) {
  return table.normal_rms <= linear.normal_rms &&
         (with_depth ? table.depth_rmse_mm < kClearlyBetter * linear.depth_rmse_mm
                     : table.normal_rms < kClearlyBetter * linear.normal_rms);
}

// Fills the shares explained; throws where the colours do not determine both slopes.
void explain(const NormalEquations& contacts, const CrossValidation& v, PhotometricFitResult& result) {
  const double spread_x = contacts.xx - contacts.x * contacts.x / contacts.weight;
  const double spread_y = contacts.yy - contacts.y * contacts.y / contacts.weight;
  result.explained_x = spread_x > 0 ? 1 - v.error_x / spread_x : 0;
  result.explained_y = spread_y > 0 ? 1 - v.error_y / spread_y : 0;
  const double least = std::min(result.explained_x, result.explained_y);
  if (!(least >= PhotometricFit::kLeastExplained))
    throw Error(Failure::Input, "colour changes that predict both slopes on presses not used for the fit",
                "at best " + std::to_string(static_cast<int>(100 * std::max(least, 0.0))) +
                    " % of the normals explained",
                "images lit by three colours from different sides, and checked centres and radii");
}

}  // namespace

PhotometricFitResult PhotometricFit::solve(double rest_weight, NormalModel wanted) const {
  if (!(rest_weight >= 0 && rest_weight <= 1000))
    throw Error(Failure::Input, "a rest weight from 0 to 1000", std::to_string(rest_weight), "1");
  if (presses_.size() < 2)
    throw Error(Failure::Input, "two presses or more, so that the error is measured on one that was not used",
                std::to_string(presses_.size()), "adding presses at other places of the pad");
  const CrossValidation validation =
      cross_validate(presses_, rest_weight, wanted != NormalModel::Linear, pitch_mm_per_px_);
  PhotometricFitResult result;
  result.linear = validation.linear.errors();
  result.table = validation.table.errors();
  const bool with_table = wanted == NormalModel::Table ||
                          (wanted == NormalModel::Best &&
                           table_is_better(result.table, result.linear, validation.linear.balls > 0));
  const Model model = fit_model(presses_, kNone, rest_weight, with_table);
  const HeldOutErrors& errors = with_table ? result.table : result.linear;
  result.model = with_table ? NormalModel::Table : NormalModel::Linear;
  result.presses = with_table ? validation.table_presses : validation.linear_presses;
  for (int c = 0; c < 3; ++c)
    for (int k = 0; k < 3; ++k) {
      result.calibration.wx[c][k] = model.weights.x[3 * c + k];
      result.calibration.wy[c][k] = model.weights.y[3 * c + k];
    }
  result.calibration.table = model.table;
  result.calibration.normal_sd = errors.normal_rms;
  result.condition = model.weights.condition;
  result.ridge = model.weights.ridge;
  ErrorSums own;
  for (const PhotometricPress& p : presses_) judge(p, model, pitch_mm_per_px_, own);
  result.normal_rms_fitted = own.errors().normal_rms;
  result.normal_rms_held_out = errors.normal_rms;
  result.normal_angle_deg = errors.normal_angle_deg;
  result.depth_rmse_mm = errors.depth_rmse_mm;
  result.cap_rms_mm = errors.cap_rms_mm;
  result.depth_gain = errors.depth_gain;
  NormalEquations contacts;
  for (const PhotometricPress& p : presses_) contacts += p.contact;
  result.contact_px = static_cast<uint64_t>(contacts.weight);
  explain(contacts, validation, result);
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
