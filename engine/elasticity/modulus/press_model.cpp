#include "engine/elasticity/modulus/press_model.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

#include "engine/base/numbers.h"
#include "engine/numeric/quadrature.h"
#include "palpate/error.h"

namespace palpate {
namespace {

// Ratios of moduli: even in their logarithm.
constexpr int kRatios = 28;
const double kRatioFrom = std::log(PressModel::kLeastRatio);
const double kRatioStep = (std::log(PressModel::kMostRatio) - kRatioFrom) / (kRatios - 1);
// Radii of a ball's contact, even in their logarithm.
constexpr double kNarrowest = 0.004;
constexpr int kRings = 28;
constexpr double kSpread = 1.05;  // of a face, to see how the pad's answer goes with its width

/// Weights of the cubic through the four points around `position` in 0 to count - 1 (Lagrange).
struct Cubic {
  int first;
  std::array<double, 4> weight;
  Cubic(double position, int count) : first(std::clamp(static_cast<int>(position) - 1, 0, count - 4)) {
    const double t = position - first;
    weight = {-(t - 1) * (t - 2) * (t - 3) / 6, t * (t - 2) * (t - 3) / 2, -t * (t - 1) * (t - 3) / 2,
              t * (t - 1) * (t - 2) / 6};
  }
};

/// Deflection of a half space of E* = 1 at distance r under 1 MPa on the disc of radius c.
double disc_deflection(double r, double c) {
  if (c <= 0) return 0;
  if (r <= c) return 4 * c / kPi * std::comp_ellint_2(r / c);
  const double k = c / r;
  return 4 * r / kPi * (std::comp_ellint_2(k) - (1 - k * k) * std::comp_ellint_1(k));
}

/// Reduction of it by the layer's thickness, by quadrature: it is smooth.
double disc_loss(const PointLoadLoss& loss, double thickness, double r, double c) {
  static const Quadrature radial = gauss_legendre(8, 1), angular = gauss_legendre(8, kPi);
  double sum = 0;
  for (size_t i = 0; i < radial.x.size(); ++i)
    for (size_t j = 0; j < angular.x.size(); ++j) {
      const double s = radial.x[i] * c,
                   apart = std::sqrt(std::max(0.0, r * r + s * s - 2 * r * s * std::cos(angular.x[j])));
      sum += radial.w[i] * angular.w[j] * 2 * s * c * loss(apart / thickness);
    }
  return sum / (kPi * thickness);
}

/// Answer of the pad of E = 1 at the nodes to 1 N on the ring that each node stands for.
Eigen::MatrixXd pad_compliance(const Pad& pad, const FaceCompliance& face) {
  const std::vector<double>& r = face.r_mm;
  const auto n = static_cast<Eigen::Index>(r.size());
  const double modulus = effective_modulus_MPa({1, pad.material.poisson});
  const PointLoadLoss loss(pad.material.poisson, pad.base);
  Eigen::MatrixXd discs(n, n + 1);  // of the discs inside of each ring's borders
  std::vector<double> border{0};
  for (const double area : face.area_mm2)
    border.push_back(std::sqrt(border.back() * border.back() + area / kPi));
  for (Eigen::Index j = 0; j <= n; ++j)
    for (Eigen::Index i = 0; i < n; ++i) {
      const double at = r[static_cast<size_t>(i)], c = border[static_cast<size_t>(j)];
      discs(i, j) = disc_deflection(at, c);
      if (std::isfinite(pad.thickness_mm) && c > 0) discs(i, j) -= disc_loss(loss, pad.thickness_mm, at, c);
    }
  Eigen::MatrixXd answer(n, n);
  for (Eigen::Index j = 0; j < n; ++j) {
    const double a = border[static_cast<size_t>(j)], b = border[static_cast<size_t>(j) + 1];
    answer.col(j) = (discs.col(j + 1) - discs.col(j)) / (modulus * kPi * (b * b - a * a));
  }
  return answer;
}

}  // namespace

Sample parse_sample(const std::string& text) {
  const auto refuse = [&] {
    return Error(Failure::Usage, "a sample as SHAPE,SIZE", "'" + text.substr(0, 60) + "'",
                 "cube,10mm or block,10x8mm or cylinder,12x10mm or sphere,16mm");
  };
  Sample s;
  const size_t comma = text.find(',');
  if (comma == std::string::npos) throw refuse();
  const std::string name = text.substr(0, comma);
  double size = 0, height = 0;
  char unit[4] = "", rest = 0;
  const char* numbers = text.c_str() + comma + 1;
  const bool two = std::sscanf(numbers, "%lfx%lf%3[m]%c", &size, &height, unit, &rest) == 3;
  if (!two && std::sscanf(numbers, "%lf%3[m]%c", &size, unit, &rest) != 2) throw refuse();
  if (std::string(unit) != "mm") throw refuse();
  if (name == "cube" && !two)
    s.shape = SampleShape::Cube;
  else if (name == "block" && two)
    s.shape = SampleShape::Cube;
  else if (name == "cylinder" && two)
    s.shape = SampleShape::Cylinder;
  else if (name == "sphere" && !two)
    s.shape = SampleShape::Sphere;
  else if (name == "dome" && !two)
    s.shape = SampleShape::Dome;
  else
    throw refuse();
  s.size_mm = size;
  s.height_mm = two ? height : size;
  return s;
}

const char* to_string(SampleShape shape) {
  constexpr std::array<const char*, 4> kNames = {"sphere", "cylinder", "cube", "dome"};
  return kNames[static_cast<size_t>(shape)];
}

double Sample::radius_mm() const {
  return shape == SampleShape::Cube ? size_mm / std::sqrt(kPi) : size_mm / 2;
}
double Sample::face_mm2() const {
  return kPi * radius_mm() * radius_mm();
}

void check(const Sample& s, const Pad& pad) {
  const auto require = [](bool good, const char* wanted, double found) {
    if (!good) throw Error(Failure::Input, wanted, std::to_string(found), "checking the number and its unit");
  };
  require(s.size_mm > 0 && std::isfinite(s.size_mm), "a sample's size > 0 mm", s.size_mm);
  if (s.flat())
    require(s.height_mm > 0 && std::isfinite(s.height_mm), "a sample's height > 0 mm", s.height_mm);
  if (s.flat())
    require(s.height_mm >= 0.02 * s.size_mm && s.height_mm <= 20 * s.size_mm,
            "a height of 0.02 to 20 times the sample's width, mm", s.height_mm);
  require(s.poisson >= 0 && s.poisson <= 0.5, "a sample's Poisson's ratio of 0 to 0.5", s.poisson);
  require(s.relative_size_sd >= 0 && s.relative_size_sd < 0.5,
          "a standard error of the sample's size of 0 to 0.5 of it", s.relative_size_sd);
  require(pad.thickness_mm > 0, "a pad thickness > 0 mm", pad.thickness_mm);
  require(pad.material.poisson >= 0 && pad.material.poisson <= 0.5, "a pad's Poisson's ratio of 0 to 0.5",
          pad.material.poisson);
  require(pad.material.young_MPa > 0 && std::isfinite(pad.material.young_MPa),
          "a pad's Young's modulus > 0 MPa", pad.material.young_MPa);
  if (s.flat())
    require(s.radius_mm() <= 6 * pad.thickness_mm, "a face no wider than 6 pad thicknesses, mm",
            s.radius_mm());
}

PressModel::PressModel(const Pad& pad, const Sample& sample) : pad_(pad), sample_(sample) {
  check(sample, pad);
  if (sample.flat())
    tabulate_flat();
  else
    tabulate_ball();
}

void PressModel::tabulate_ball() {
  const double radius = sample_.radius_mm();
  log_radius_from_ = std::log(kNarrowest * radius);
  const double widest = std::min(kWidest * radius, 5.99 * pad_.thickness_mm);
  log_radius_step_ = (std::log(widest) - log_radius_from_) / (kRadii - 1);
  // Gauss and Chebyshev's rule of the second kind: exact for an ellipse's pressure times a polynomial.
  constexpr int kAlong = 7;
  for (int x = 0; x < kRatios; ++x) {
    const Material ball{std::exp(kRatioFrom + x * kRatioStep), sample_.poisson};
    const PadIndenter press(
        {{1, pad_.material.poisson}, pad_.thickness_mm, pad_.base},
        {sample_.shape == SampleShape::Dome ? IndenterShape::Paraboloid : IndenterShape::Sphere, radius, 0,
         ball});
    for (size_t i = 0; i < kRadii; ++i) {
      const double a = std::exp(log_radius_from_ + static_cast<double>(i) * log_radius_step_);
      const Indentation c = press.at_radius(a);
      double along = 0;  // int p dr: a half space's middle sinks by 2 / E* of it
      for (int q = 1; q <= (kAlong + 1) / 2; ++q) {
        const double angle = q * kPi / (kAlong + 1);
        const double p =
            q == (kAlong + 1) / 2 ? c.pressure_max_MPa / 2 : press.pressure_MPa(c, a * std::cos(angle));
        along += a * kPi / (kAlong + 1) * std::sin(angle) * p;
      }
      const double own = 2 * along / effective_modulus_MPa(ball);
      table_[kForce].push_back(std::log(c.force_N));
      table_[kDepth].push_back(std::log(c.depth_mm - own));
      table_[kBall].push_back(std::log(own * ball.young_MPa));
    }
  }
  // Half a ball on its equator against the half space: the difference is as a point load's.
  const double nu = std::min(sample_.poisson, kMostPoisson);
  const FaceCompliance half =
      face_compliance(half_sphere_mesh(1, graded(0, 0.4, 36, 1), 0.011), nu, Support::Sliding);
  std::vector<double> gap;
  for (const double r : half.r_mm) gap.push_back(1 - std::sqrt(1 - r * r));
  const double force_N = 0.03;
  const PadIndenter plane({{1, nu}, std::numeric_limits<double>::infinity(), Base::Bonded},
                          {IndenterShape::Sphere, 1, 0, {}});
  ball_lack_ =
      (plane.at_force(force_N).depth_mm - press_faces(half.down, gap, force_N).approach_mm) / force_N;
}

void PressModel::tabulate_flat() {
  const double h = sample_.height_mm;
  for (const double spread : {1.0, kSpread}) {
    const double b = sample_.radius_mm() * spread, finest = 0.01 * b;
    const int layers = std::clamp(static_cast<int>(12 * std::sqrt(h / b)), 10, 40);
    double growth = 1.02;
    for (; growth < 1.6; growth += 0.01)
      if (const auto z = graded(0, h, layers, 1 / growth); h - z[static_cast<size_t>(layers) - 1] < finest)
        break;
    const FaceCompliance face =
        face_compliance(cylinder_mesh(graded(0, b, kRings, 1 / 1.12), graded(0, h, layers, 1 / growth), b),
                        std::min(sample_.poisson, kMostPoisson), sample_.table);
    const auto n = static_cast<Eigen::Index>(face.size());
    const Eigen::MatrixXd pad = pad_compliance(pad_, face);
    using Rows = Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>;
    const Rows own(face.down.data(), n, n), out(face.out.data(), n, n);
    const Eigen::Map<const Eigen::VectorXd> area(face.area_mm2.data(), n);
    for (size_t x = 0; x < kRatios; ++x) {
      const double young = std::exp(kRatioFrom + static_cast<double>(x) * kRatioStep);
      const Eigen::MatrixXd both = pad + own / young;
      const FaceContact c =
          press_faces({both.data(), both.data() + n * n}, std::vector<double>(face.size(), 0), 1);
      const Eigen::Map<const Eigen::VectorXd> force(c.force_N.data(), n);
      const Eigen::VectorXd deep = pad * force;
      const double deepest = deep.maxCoeff(), mean = area.dot(deep) / area.sum();
      if (spread == 1) {
        table_[kDeepest].push_back(deepest);
        table_[kMean].push_back(mean);
        table_[kShort].push_back(area.dot(own * force) / area.sum());
        table_[kEdge].push_back((out * force)[n - 1]);
      } else {
        table_[kDeepestPower].push_back(std::log(deepest / table_[kDeepest][x]) / std::log(spread));
        table_[kMeanPower].push_back(std::log(mean / table_[kMean][x]) / std::log(spread));
      }
    }
  }
}

double PressModel::flat(Flat what, double ratio) const {
  const Cubic c((std::log(ratio) - kRatioFrom) / kRatioStep, kRatios);
  double value = 0;
  for (size_t i = 0; i < 4; ++i) value += c.weight[i] * table_[what][static_cast<size_t>(c.first) + i];
  return value;
}

std::array<double, PressModel::kRadii> PressModel::ball(Column what, double log_ratio) const {
  const Cubic x((log_ratio - kRatioFrom) / kRatioStep, kRatios);
  std::array<double, kRadii> column{};
  for (size_t i = 0; i < 4; ++i) {
    const double* row = table_[what].data() + (static_cast<size_t>(x.first) + i) * kRadii;
    for (size_t a = 0; a < kRadii; ++a) column[a] += x.weight[i] * row[a];
  }
  return column;
}

double PressModel::at(const std::array<double, kRadii>& column, double log_radius) const {
  const Cubic a((log_radius - log_radius_from_) / log_radius_step_, kRadii);
  double value = 0;
  for (size_t j = 0; j < 4; ++j) value += a.weight[j] * column[static_cast<size_t>(a.first) + j];
  return value;
}

double PressModel::stiffening(double ratio) const {
  return sample_.height_mm / sample_.face_mm2() / flat(kShort, ratio);
}
double PressModel::bulging(double ratio) const {
  return flat(kEdge, ratio) / flat(kShort, ratio) * sample_.height_mm /
         (std::min(sample_.poisson, kMostPoisson) * sample_.radius_mm());
}
double PressModel::mean_depth_per_force(double ratio, double spread) const {
  return flat(kMean, ratio) * std::pow(spread, flat(kMeanPower, ratio));
}

double PressModel::mean_over_deepest(double ratio) const {
  return flat(kMean, ratio) / flat(kDeepest, ratio);
}

double PressModel::depth_at_radius_mm(double radius_mm, double young_MPa, double pad_MPa, double size) const {
  const double ratio = young_MPa / pad_MPa, log_a = std::log(radius_mm / size);
  if (sample_.flat() || !(ratio >= kLeastRatio && ratio <= kMostRatio) || !(log_a >= log_radius_from_) ||
      !(log_a <= log_radius_from_ + (kRadii - 1) * log_radius_step_))
    return kNaN;
  return std::exp(at(ball(kDepth, std::log(ratio)), log_a)) * size;
}

PressSight PressModel::at_force(double force_N, double young_MPa, double pad_MPa, double size) const {
  const double ratio = young_MPa / pad_MPa;
  PressSight s{kNaN, kNaN, kNaN, kNaN, kNaN};
  if (!(ratio >= kLeastRatio && ratio <= kMostRatio) || !(force_N >= 0)) return s;
  if (sample_.flat()) {
    const double pad = force_N / pad_MPa, own = force_N / young_MPa / (size * size);
    s.radius_mm = sample_.radius_mm() * size + own * size * flat(kEdge, ratio);
    const double spread = s.radius_mm / sample_.radius_mm();
    s.depth_mm = pad * flat(kDeepest, ratio) * std::pow(spread, flat(kDeepestPower, ratio));
    s.mean_depth_mm = pad * mean_depth_per_force(ratio, spread);
    const double shorter = own * flat(kShort, ratio);
    s.strain = shorter / sample_.height_mm;
    s.approach_mm = s.mean_depth_mm + shorter;
    return s;
  }
  if (force_N == 0) return {0, 0, kNaN, 0, 0};
  // The size scales the whole press: lengths with it, forces with its square.
  const double log_ratio = std::log(ratio), wanted = std::log(force_N / pad_MPa / (size * size));
  const std::array<double, kRadii> forces = ball(kForce, log_ratio);
  double low = log_radius_from_, high = low + (kRadii - 1) * log_radius_step_;
  if (wanted > forces.back()) return s;
  double log_a = 0;
  if (wanted < forces.front()) {
    log_a = low + (wanted - forces.front()) / 3;  // Hertz's power, below the table
  } else {
    // Between the two radii of the table, then by secants.
    const auto above = std::upper_bound(forces.begin() + 1, forces.end() - 1, wanted);
    const auto i = static_cast<double>(above - forces.begin());
    high = low + i * log_radius_step_;
    low = high - log_radius_step_;
    double slope = (*above - *(above - 1)) / log_radius_step_;
    log_a = low + (wanted - *(above - 1)) / slope;
    double before = 0, force_before = 0;
    for (int round = 0; round < 30; ++round) {
      const double force = at(forces, log_a);
      if (std::abs(force - wanted) < 1e-11) break;
      if (round > 0 && log_a != before) slope = std::max(1.0, (force - force_before) / (log_a - before));
      before = log_a;
      force_before = force;
      log_a = std::clamp(log_a + (wanted - force) / slope, low, high);
    }
  }
  const double within = std::max(log_a, log_radius_from_);
  const double scale = size * std::exp(2 * (log_a - within));
  const double ball_mm = std::exp(at(ball(kBall, log_ratio), within)) / ratio * scale;
  s.radius_mm = std::exp(log_a) * size;
  s.depth_mm = std::exp(at(ball(kDepth, log_ratio), within)) * scale;
  const double r = sample_.radius_mm() * size, modulus = effective_modulus_MPa({young_MPa, sample_.poisson});
  const double table_mm = std::cbrt(9 * force_N * force_N / (16 * r * modulus * modulus));
  s.approach_mm = s.depth_mm + ball_mm + table_mm - 2 * ball_lack_ * force_N / (young_MPa * r);
  s.strain = 0.2 * s.radius_mm / r;
  return s;
}

}  // namespace palpate
