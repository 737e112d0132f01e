#include "engine/lump/network/model.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "engine/numeric/dense.h"

namespace palpate::lump {
namespace {

constexpr double kLeastMisfit = 1.2;

struct Taps {
  std::array<Eigen::Index, 4> node;
  std::array<double, 4> weight;
};

/// The weights of four neighbours of a place between the middle two, `t` in [0, 1] from the second on
/// (Catmull and Rom): exact for squares, and without the blur of straight lines between nodes.
std::array<double, 4> cubic_weights(double t) {
  return {0.5 * t * (-1 + t * (2 - t)), 0.5 * (2 + t * t * (-5 + 3 * t)), 0.5 * t * (1 + t * (4 - 3 * t)),
          0.5 * t * t * (t - 1)};
}

/// Interpolation weights at a place in nodes from the first; `mirrored`: the first node is a plane of
/// symmetry.
Taps taps_at(double place, uint32_t nodes, bool mirrored) {
  const double i = std::clamp(place, 0.0, nodes - 1.0);
  const auto cell = std::min<Eigen::Index>(static_cast<Eigen::Index>(i), nodes - 2);
  Taps taps;
  for (Eigen::Index k = 0; k < 4; ++k) {
    const Eigen::Index n = cell + k - 1;
    taps.node[static_cast<size_t>(k)] = n < 0 ? (mirrored ? -n : 0) : std::min<Eigen::Index>(n, nodes - 1);
  }
  taps.weight = cubic_weights(i - static_cast<double>(cell));
  return taps;
}

}  // namespace

Eigen::Matrix<float, Base::kTerms, 1> Base::terms(double thickness_mm, double load) {
  const double t = (thickness_mm - 20) / 4, s = load / 0.3;
  return Eigen::Matrix<double, kTerms, 1>{1, t, t * t, s, s * s, t * s, t * t * s, t * s * s, s * s * s}
      .cast<float>();
}

Eigen::VectorXf Base::quarter(double thickness_mm, double load) const {
  return static_cast<float>(load) * (factors * terms(thickness_mm, load));
}

double Base::at(const Eigen::VectorXf& quarter, double x_mm, double y_mm) const {
  const Taps x = taps_at(std::abs(x_mm) / pitch_mm, side, true),
             y = taps_at(std::abs(y_mm) / pitch_mm, side, true);
  double sum = 0;
  for (size_t j = 0; j < 4; ++j) {
    double row = 0;
    for (size_t i = 0; i < 4; ++i)
      row += x.weight[i] * static_cast<double>(quarter(y.node[j] * side + x.node[i]));
    sum += y.weight[j] * row;
  }
  return sum;
}

void Patch::at(double u_mm, double v_mm, float* values) const {
  const double middle = (side - 1) / 2.0;
  const Taps x = taps_at(u_mm / pitch_mm + middle, side, false),
             y = taps_at(v_mm / pitch_mm + middle, side, false);
  Eigen::Map<Eigen::VectorXf> sum(values, count());
  sum.setZero();
  for (size_t j = 0; j < 4; ++j)
    for (size_t i = 0; i < 4; ++i) {
      const auto weight = static_cast<float>(x.weight[i] * y.weight[j]);
      if (weight != 0) sum += weight * fields.col(y.node[j] * side + x.node[i]);
    }
}

void Patch::prepare() {
  Eigen::MatrixXf x = Eigen::MatrixXf::Zero(fields.rows(), fields.cols()), y = x;
  const auto n = static_cast<Eigen::Index>(side);
  for (Eigen::Index j = 0; j < n; ++j)
    for (Eigen::Index i = 0; i < n; ++i) {
      const Eigen::Index left = std::max<Eigen::Index>(i - 1, 0), right = std::min(i + 1, n - 1);
      const Eigen::Index up = std::max<Eigen::Index>(j - 1, 0), down = std::min(j + 1, n - 1);
      x.col(j * n + i) = (fields.col(j * n + right) - fields.col(j * n + left)) /
                         static_cast<float>(pitch_mm * static_cast<double>(right - left));
      y.col(j * n + i) = (fields.col(down * n + i) - fields.col(up * n + i)) /
                         static_cast<float>(pitch_mm * static_cast<double>(down - up));
    }
  // A bump of factors a has the slope x^T a = fields^T (fields x^T a): column of factors to column of
  // factors.
  along_x = dense::product_nt(fields, x).cast<double>();
  along_y = dense::product_nt(fields, y).cast<double>();
  smooth_pattern = Eigen::MatrixXd::Zero(count(), count());
  for (const double length : kPatternLengths_mm) {
    Eigen::MatrixXf kernel(n, n);
    for (Eigen::Index i = 0; i < n; ++i)
      for (Eigen::Index j = 0; j < n; ++j) {
        const double off = pitch_mm * static_cast<double>(i - j) / length;
        kernel(i, j) = static_cast<float>(std::exp(-0.5 * off * off));
      }
    Eigen::MatrixXf spread(fields.rows(), fields.cols());
    for (Eigen::Index f = 0; f < fields.rows(); ++f) {
      const Eigen::VectorXf field = fields.row(f);
      const Eigen::MatrixXf image = dense::product(
          kernel, dense::product(Eigen::Map<const Eigen::MatrixXf>(field.data(), n, n), kernel));
      spread.row(f) = Eigen::Map<const Eigen::RowVectorXf>(image.data(), image.size());
    }
    smooth_pattern += dense::product_nt(fields, spread).cast<double>();
  }
}

Eigen::Matrix<double, kFeatures, 1> lump_features(const Guess& guess, const Setting& setting, double load,
                                                  Eigen::Matrix<double, kFeatures, 3>* changes) {
  const double size = std::exp(guess.log_size), depth = std::exp(guess.log_depth),
               ratio = std::exp(guess.log_ratio);
  const double contrast = (ratio - 1) / (ratio + 2), below = setting.thickness_mm - depth - size;
  Eigen::Matrix<double, kFeatures, 1> in;
  in << guess.log_size, guess.log_depth, guess.log_ratio, contrast, size, depth, setting.thickness_mm, below,
      size * size / ((size + depth) * (size + depth)), std::abs(setting.x_mm), std::abs(setting.y_mm), load,
      setting.cell_mm, guess.shape == InclusionShape::Ellipsoid ? 1 : 0,
      guess.shape == InclusionShape::Cylinder ? 1 : 0, guess.shape == InclusionShape::LyingCylinder ? 1 : 0;
  if (changes != nullptr) {
    changes->setZero();
    (*changes)(0, 0) = (*changes)(1, 1) = (*changes)(2, 2) = 1;
    (*changes)(3, 2) = 3 * ratio / ((ratio + 2) * (ratio + 2));
    (*changes)(4, 0) = size;
    (*changes)(5, 1) = depth;
    (*changes)(7, 0) = -size;
    (*changes)(7, 1) = -depth;
    const double sum = size + depth, slope = 2 * size * size * depth / (sum * sum * sum);
    (*changes)(8, 0) = slope;
    (*changes)(8, 1) = -slope;
  }
  return in;
}

double lump_amplitude(const Guess& guess, std::array<double, 3>* changes) {
  const double size = std::exp(guess.log_size), depth = std::exp(guess.log_depth),
               ratio = std::exp(guess.log_ratio);
  const double wide = size / (size + depth);
  // Nothing is divided by nothing: a lump as soft as the tissue still has a little.
  const double contrast = std::abs(ratio - 1) / (ratio + 2) + 0.02;
  if (changes != nullptr) {
    const double slope = (ratio < 1 ? -3 : 3) * ratio / ((ratio + 2) * (ratio + 2));
    *changes = {2 * (1 - wide), -2 * (1 - wide), slope / contrast};
  }
  return contrast * wide * wide;
}

Eigen::MatrixXd bump_factors(const Model& model, const Guess& guess, const Setting& setting,
                             const std::vector<double>& loads, int member,
                             std::array<Eigen::MatrixXd, 3>* changes) {
  const auto count = static_cast<Eigen::Index>(loads.size());
  Eigen::MatrixXf in(kFeatures, count);
  std::vector<Eigen::MatrixXf> along(changes != nullptr ? 3 : 0, Eigen::MatrixXf(kFeatures, count));
  for (Eigen::Index k = 0; k < count; ++k) {
    Eigen::Matrix<double, kFeatures, 3> slopes;
    const auto features =
        lump_features(guess, setting, loads[static_cast<size_t>(k)], changes != nullptr ? &slopes : nullptr);
    in.col(k) = (features.cast<float>() - model.in_mean).array() * model.in_scale.array();
    for (size_t t = 0; t < along.size(); ++t)
      along[t].col(k) =
          slopes.col(static_cast<Eigen::Index>(t)).cast<float>().array() * model.in_scale.array();
  }
  const size_t first = member < 0 ? 0 : static_cast<size_t>(member);
  const size_t last = member < 0 ? model.ensemble.size() : first + 1;
  Eigen::MatrixXf sum;
  std::vector<Eigen::MatrixXf> change_sum, change;
  for (size_t m = first; m < last; ++m) {
    const Eigen::MatrixXf out = model.ensemble[m].apply(in, along, change);
    if (m == first) {
      sum = out;
      change_sum = change;
    } else {
      sum += out;
      for (size_t t = 0; t < change.size(); ++t) change_sum[t] += change[t];
    }
  }
  const auto fraction = 1 / static_cast<float>(last - first);
  const Eigen::VectorXf scale = fraction * model.out_scale;
  Eigen::MatrixXd factors = ((scale.asDiagonal() * sum).colwise() + model.out_mean).cast<double>();
  std::array<double, 3> slopes{};
  const double amplitude = lump_amplitude(guess, &slopes);
  const Eigen::VectorXd size = amplitude * Eigen::Map<const Eigen::VectorXd>(loads.data(), count);
  factors *= size.asDiagonal();
  if (changes != nullptr)
    for (size_t t = 0; t < 3; ++t)
      (*changes)[t] =
          (scale.asDiagonal() * change_sum[t]).cast<double>() * size.asDiagonal() + slopes[t] * factors;
  return factors;
}

double SplitNormal::cdf(double value) const {
  const double left = below / (below + above);
  const double off = value - middle;
  const double half = off < 0 ? below : above;
  const double beyond = std::erfc(std::abs(off) / (half * std::numbers::sqrt2));
  return off < 0 ? left * beyond : 1 - (1 - left) * beyond;
}

Eigen::Matrix<double, kLocal, 1> local_terms(const Model& model,
                                             const std::array<double, kParameters>& logs) {
  const std::array<const std::array<double, 2>*, kParameters> ranges = {&model.size_mm, &model.depth_mm,
                                                                        &model.ratio};
  std::array<double, kParameters> at{};  // -1 to 1
  for (size_t p = 0; p < kParameters; ++p) {
    const double low = std::log((*ranges[p])[0]), high = std::log((*ranges[p])[1]);
    at[p] = std::clamp((2 * logs[p] - low - high) / std::max(high - low, 1e-9), -1.0, 1.0);
  }
  return {at[kSize], at[kDepth], at[kRatio], at[kRatio] * at[kRatio] - 1. / 3, at[kSize] * at[kRatio]};
}

double local_inflation(const Model& model, Method method, Parameter what,
                       const std::array<double, kParameters>& logs) {
  const auto& factors = model.local[static_cast<size_t>(method)][what];
  return std::exp(
      local_terms(model, logs).dot(Eigen::Map<const Eigen::Matrix<double, kLocal, 1>>(factors.data())));
}

Calibration calibration_at(const Model& model, Method method, size_t loads, double noise_fraction) {
  const auto place = [](const auto& knots, double value, size_t& below, double& fraction) {
    below = 0;
    while (below + 2 < knots.size() && value > static_cast<double>(knots[below + 1])) ++below;
    const double low = std::log(static_cast<double>(knots[below])),
                 high = std::log(static_cast<double>(knots[below + 1]));
    fraction = std::clamp((std::log(std::max(value, 1e-9)) - low) / (high - low), 0.0, 1.0);
  };
  const Model::CalibrationTable& table = model.calibration[static_cast<size_t>(method)];
  size_t l = 0, n = 0;
  double a = 0, b = 0;
  place(kCalibrationLoads, static_cast<double>(loads), l, a);
  place(kCalibrationNoise, noise_fraction, n, b);
  const auto mix = [&](auto member) {
    const auto log_at = [&](size_t i, size_t j) { return std::log(member(table[i][j])); };
    return std::exp((1 - a) * ((1 - b) * log_at(l, n) + b * log_at(l, n + 1)) +
                    a * ((1 - b) * log_at(l + 1, n) + b * log_at(l + 1, n + 1)));
  };
  Calibration calibration;
  for (size_t p = 0; p < kParameters; ++p)
    calibration.inflation[p] = mix([p](const Calibration& t) { return t.inflation[p]; });
  calibration.place_inflation = mix([](const Calibration& t) { return t.place_inflation; });
  calibration.log_likelihood_ratio = mix([](const Calibration& t) { return t.log_likelihood_ratio; });
  // A misfit that calibration alone may leave does not make an observation unlike the training data.
  calibration.misfit = std::max(kLeastMisfit, mix([](const Calibration& t) { return t.misfit; }));
  calibration.rest = mix([](const Calibration& t) { return t.rest; });
  calibration.plain_pattern = mix([](const Calibration& t) { return t.plain_pattern; });
  calibration.temperature = mix([](const Calibration& t) { return t.temperature; });
  return calibration;
}

}  // namespace palpate::lump
