#include "engine/elasticity/modulus/fit.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "engine/base/numbers.h"

namespace palpate {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();
constexpr double kFirstError = 0.01;  // of the largest reading, until the scatter is known

constexpr double kThinPad = 0.3;  // a / H up to which (a) takes the pad as a half space
constexpr int kErrorRounds = 3;   // of finding standard errors and the answer in turn

/// Inputs with an error that all frames share: fitted along, held by their standard errors.
enum Shared : uint8_t { kPad, kForce, kLength, kSize, kEdge, kZero, kShared };

struct Observation {
  uint32_t frame;
  Seen seen;
  double sd;  // stated; 0: not
  double weight = 0;
  std::array<double, kShared> slope{};  // of measured less predicted, by what is shared
};

constexpr std::array<const char*, kSeen> kNames = {"contact radius, mm",    "depth, mm", "mean depth, mm",
                                                   "approach, mm",          "strain",    "shortening, mm",
                                                   "effective modulus, MPa"};

double root(double a, double b) {
  return std::sqrt(a * a + b * b);
}

/// Both errors are needed, else it is the scatter's.
double both(const PressValue& a, const PressValue& b, double scale) {
  return a.sd > 0 && b.sd > 0 ? root(a.sd, b.sd) * scale : 0;
}

/// The linear strain that carries as much as a rubber shortened to `length` of its height does.
double rubber_strain(double length) {
  return (1 / (length * length) - length) / 3;
}
/// The inverse: length over height at rest.
double rubber_length(double strain) {
  double length = 1 / (1 + strain);
  for (int i = 0; i < 30; ++i) {
    const double step = (rubber_strain(length) - strain) / ((2 / (length * length * length) + 1) / 3);
    length += step;
    if (std::abs(step) < 1e-15) break;
  }
  return length;
}

class Fit {
 public:
  Fit(ModulusMethod way, const std::vector<PressFrame>& frames, const ModulusSetup& setup,
      const PressModel& model, const ModulusGiven& given)
      : way_(way), frames_(frames), setup_(setup), model_(model), given_(given), sample_(setup.sample) {
    nu_ = std::min(sample_.poisson, 0.4999);
    shared_ = {given.pad, 1, 1, given.size, given.edge, given.zero_mm};
    shared_sd_ = {setup.pad_relative_sd,    setup.force_relative_sd, setup.length_relative_sd,
                  sample_.relative_size_sd, edge_sd(sample_),        setup.zero_sd_mm};
  }

  /// Says why not, or returns true with the observations taken.
  bool take(ModulusFit& f);
  ModulusFit run(ModulusFit f, ScatterErrors& errors, bool with_points);

 private:
  bool take_flat(ModulusFit& f);
  bool take_ball(ModulusFit& f);
  void observe(uint32_t frame, Seen seen, double sd) { observations_.push_back({frame, seen, sd}); }
  static bool refuse(ModulusFit& f, ModulusState state, const std::string& reason) {
    f.state = state;
    f.reason = reason;
    return false;
  }
  double pad_MPa() const { return setup_.pad.material.young_MPa * shared_[kPad]; }
  double size() const { return shared_[kSize]; }
  double force_N(const PressFrame& p) const { return p.force_N * shared_[kForce]; }
  double radius_mm(const PressFrame& p) const {
    return p.radius_mm.value * shared_[kLength] * (sample_.flat() ? 1 : 1 - shared_[kEdge]);
  }
  /// Depths that were computed with the pad's modulus go with it.
  double depth_mm(const PressValue& r) const {
    return setup_.depth_by_pressure ? r.value / shared_[kPad] : r.value;
  }
  double approach_mm(const PressFrame& p) const { return p.approach_mm.value - shared_[kZero]; }
  double pad_mean(const PressFrame& p, double ratio) const {
    return p.mean_depth_mm.known() ? depth_mm(p.mean_depth_mm)
                                   : depth_mm(p.depth_mm) * model_.mean_over_deepest(ratio);
  }
  /// The contact's radius over the face's nominal one.
  double spread(const PressFrame& p) const {
    return p.radius_mm.known() ? radius_mm(p) / sample_.radius_mm() - shared_[kEdge] : size();
  }
  /// How much shorter the sample is by the readings, as a share.
  double seen_strain(const PressFrame& p, double ratio) const {
    if (by_stage_) return (approach_mm(p) - pad_mean(p, ratio)) / sample_.height_mm;
    const double widened = radius_mm(p) / (sample_.radius_mm() * size()) - 1 - shared_[kEdge];
    return widened / (nu_ * model_.bulging(ratio));
  }
  const PressSight& sight(double force_N, double young) const;
  double measured(const Observation& o, double log_young) const;
  double predicted(const Observation& o, double log_young, double force_N) const;
  double difference(const Observation& o, double log_young) const {
    return measured(o, log_young) - predicted(o, log_young, force_N(frames_[o.frame]));
  }
  void find_slopes(double log_young);
  double chi2(double log_young, std::vector<double>* left = nullptr);
  void weigh(double log_young, const ScatterErrors& errors);
  double search();

  ModulusMethod way_;
  const std::vector<PressFrame>& frames_;
  const ModulusSetup& setup_;
  const PressModel& model_;
  ModulusGiven given_;
  const Sample& sample_;
  double nu_;
  mutable std::array<double, 4> asked_{kNaN, kNaN, kNaN, kNaN};
  mutable PressSight seen_;
  std::array<double, kShared> shared_, shared_sd_;
  bool by_stage_ = false;  // a flat sample's shortening is read from the approach, else from its edge
  std::vector<Observation> observations_;
};

bool Fit::take(ModulusFit& f) {
  if (frames_.empty()) return refuse(f, ModulusState::TooFew, "no frames");
  return sample_.flat() ? take_flat(f) : take_ball(f);
}

bool Fit::take_flat(ModulusFit& f) {
  if (way_ == ModulusMethod::Hertz)
    return refuse(f, ModulusState::NotApplicable,
                  std::string("no curvature: the face of a ") + to_string(sample_.shape) +
                      " is flat, its contact does not grow by Hertz");
  size_t staged = 0, edged = 0, deep = 0;
  for (const PressFrame& p : frames_) {
    const bool depth = p.mean_depth_mm.known() || p.depth_mm.known();
    deep += depth;
    staged += p.approach_mm.known() && depth;
    edged += p.radius_mm.known() && sample_.poisson > 0.05;
  }
  if (way_ == ModulusMethod::Joint) {
    size_t approaches = 0;
    for (uint32_t i = 0; i < frames_.size(); ++i) {
      const PressFrame& p = frames_[i];
      approaches += p.approach_mm.known();
      if (p.radius_mm.known()) observe(i, Seen::Radius, p.radius_mm.sd);
      if (p.depth_mm.known()) observe(i, Seen::Depth, p.depth_mm.sd);
      if (p.mean_depth_mm.known()) observe(i, Seen::MeanDepth, p.mean_depth_mm.sd);
      if (p.approach_mm.known()) observe(i, Seen::Approach, p.approach_mm.sd);
    }
    if (approaches == 0 && edged == 0)
      return refuse(
          f, ModulusState::NotApplicable,
          "force and depth depend on the pad alone: the sample's shortening needs the stage's approach "
          "or how the contact's edge moves");
    return true;
  }
  by_stage_ = staged >= 2 || (staged == 1 && std::isfinite(setup_.zero_sd_mm));
  if (!by_stage_ && edged == 0)
    return refuse(f, ModulusState::NotApplicable,
                  "the sample's shortening is not seen: no approach with a depth, no contact radius");
  const bool ratio = way_ == ModulusMethod::DisplacementRatio;
  if (ratio && deep == 0)
    return refuse(f, ModulusState::NotApplicable, "the pad's displacement is not known: no depth");
  for (uint32_t i = 0; i < frames_.size(); ++i) {
    const PressFrame& p = frames_[i];
    const PressValue& depth = p.mean_depth_mm.known() ? p.mean_depth_mm : p.depth_mm;
    const double h = ratio ? 1 : sample_.height_mm;
    if (by_stage_ ? p.approach_mm.known() && depth.known() : p.radius_mm.known() && (!ratio || depth.known()))
      observe(i, ratio ? Seen::Shortening : Seen::Strain,
              by_stage_ ? both(p.approach_mm, depth, 1 / h)
                        : p.radius_mm.sd / (nu_ * sample_.radius_mm()) * (ratio ? sample_.height_mm : 1));
  }
  return true;
}

bool Fit::take_ball(ModulusFit& f) {
  double widest = 0;
  for (uint32_t i = 0; i < frames_.size(); ++i) {
    const PressFrame& p = frames_[i];
    const bool radius = p.radius_mm.known() && p.radius_mm.value > 0, depth = p.depth_mm.known();
    if (p.radius_mm.known()) widest = std::max(widest, p.radius_mm.value);
    switch (way_) {
      case ModulusMethod::StressStrain:
        if (radius && p.force_N > 0) {
          // y ~ F / a^3
          const double y = 3 * p.force_N * sample_.radius_mm() / (4 * std::pow(p.radius_mm.value, 3));
          observe(i, Seen::Modulus, 3 * p.radius_mm.sd / p.radius_mm.value * y);
        }
        break;
      case ModulusMethod::DisplacementRatio:
        if (radius && depth)
          // The depth at a radius goes with its square.
          observe(i, Seen::Depth,
                  p.depth_mm.sd > 0 && p.radius_mm.sd > 0
                      ? root(p.depth_mm.sd, 2 * p.depth_mm.value / p.radius_mm.value * p.radius_mm.sd)
                      : 0);
        break;
      case ModulusMethod::Hertz:
        if (radius) observe(i, Seen::Radius, p.radius_mm.sd);
        break;
      case ModulusMethod::Joint:
        if (radius) observe(i, Seen::Radius, p.radius_mm.sd);
        if (depth) observe(i, Seen::Depth, p.depth_mm.sd);
        if (p.approach_mm.known()) observe(i, Seen::Approach, p.approach_mm.sd);
    }
  }
  if (observations_.empty() || (way_ == ModulusMethod::Joint && widest == 0 &&
                                std::none_of(observations_.begin(), observations_.end(),
                                             [](const auto& o) { return o.seen == Seen::Approach; })))
    return refuse(f, ModulusState::NotApplicable,
                  way_ == ModulusMethod::DisplacementRatio ? "no contact radius with a depth"
                                                           : "no contact radius, nor an approach");
  if (widest > PressModel::kWidest * sample_.radius_mm())
    return refuse(f, ModulusState::OutOfRange,
                  "the contact is wider than " + std::to_string(PressModel::kWidest).substr(0, 3) +
                      " of the ball's radius: press less hard");
  if (way_ == ModulusMethod::StressStrain && widest > kThinPad * setup_.pad.thickness_mm)
    return refuse(f, ModulusState::NotApplicable,
                  "the pad is thin for the contact (a / H above 0.3): stress over a / R takes it as a half "
                  "space");
  return true;
}

const PressSight& Fit::sight(double force_N, double young) const {
  // A frame's readings come one after the other.
  const std::array<double, 4> asked{force_N, young, pad_MPa(), size()};
  if (asked == asked_) return seen_;
  asked_ = asked;
  PressSight& s = seen_;
  s = model_.at_force(force_N, young, pad_MPa(), size());
  if (sample_.flat() && setup_.law == MaterialLaw::Rubber && s.strain > 0) {
    const double length = rubber_length(s.strain), b = sample_.radius_mm() * size();
    const double bulging = (s.radius_mm - b) / (b * nu_ * s.strain), ratio = young / pad_MPa();
    s.radius_mm = b * (1 + bulging * (1 / std::sqrt(length) - 1));
    const double mean =
        force_N / pad_MPa() * model_.mean_depth_per_force(ratio, s.radius_mm / sample_.radius_mm());
    s.depth_mm *= mean / s.mean_depth_mm;
    s.mean_depth_mm = mean;
    s.approach_mm = mean + sample_.height_mm * (1 - length);
    s.strain = 1 - length;
  }
  return s;
}

double Fit::measured(const Observation& o, double log_young) const {
  const PressFrame& p = frames_[o.frame];
  const double ratio = std::exp(log_young) / pad_MPa();
  switch (o.seen) {
    case Seen::Radius:
      return radius_mm(p) - (sample_.flat() ? shared_[kEdge] * sample_.radius_mm() : 0);
    case Seen::Depth:
      return depth_mm(p.depth_mm);
    case Seen::MeanDepth:
      return depth_mm(p.mean_depth_mm);
    case Seen::Approach:
      return approach_mm(p);
    case Seen::Strain: {
      const double strain = seen_strain(p, ratio);
      return setup_.law == MaterialLaw::Rubber && std::abs(strain) < 0.9 ? rubber_strain(1 - strain) : strain;
    }
    case Seen::Shortening:
      return seen_strain(p, ratio) * sample_.height_mm;
    case Seen::Modulus:
      return 3 * force_N(p) * sample_.radius_mm() * size() / (4 * std::pow(radius_mm(p), 3));
  }
  return kNaN;
}

double Fit::predicted(const Observation& o, double log_young, double force) const {
  const PressFrame& p = frames_[o.frame];
  const double young = std::exp(log_young), ratio = young / pad_MPa();
  const double face = sample_.face_mm2() * size() * size();
  switch (o.seen) {
    case Seen::Radius:
      return sight(force, young).radius_mm;
    case Seen::Depth:
      return way_ == ModulusMethod::DisplacementRatio
                 ? model_.depth_at_radius_mm(radius_mm(p), young, pad_MPa(), size())
                 : sight(force, young).depth_mm;
    case Seen::MeanDepth:
      return sight(force, young).mean_depth_mm;
    case Seen::Approach:
      return sight(force, young).approach_mm;
    case Seen::Strain:
      return force / face / (young * model_.stiffening(ratio));
    case Seen::Shortening:
      return pad_mean(p, ratio) / model_.mean_depth_per_force(ratio, spread(p)) / ratio * sample_.height_mm /
             face / model_.stiffening(ratio);
    case Seen::Modulus:
      return effective_modulus_MPa({young, sample_.poisson}, {pad_MPa(), setup_.pad.material.poisson});
  }
  return kNaN;
}

void Fit::find_slopes(double log_young) {
  for (size_t k = 0; k < kShared; ++k) {
    if (!(shared_sd_[k] > 0)) continue;
    const double step = k == kZero ? 1e-3 : 1e-4, at = shared_[k];
    for (Observation& o : observations_) o.slope[k] = -difference(o, log_young) / step;
    shared_[k] = at + step;
    for (Observation& o : observations_) o.slope[k] += difference(o, log_young) / step;
    shared_[k] = at;
  }
}

/// Sum of squares with what is shared at its best. Far from an answer the slopes are found anew.
double Fit::chi2(double log_young, std::vector<double>* left) {
  if (!std::isfinite(given_.near)) find_slopes(log_young);
  using Vector = Eigen::Matrix<double, kShared, 1>;
  Eigen::Matrix<double, kShared, kShared> normal = Eigen::Matrix<double, kShared, kShared>::Zero();
  Vector right = Vector::Zero();
  std::vector<double> apart(observations_.size());
  for (size_t i = 0; i < observations_.size(); ++i) {
    const Observation& o = observations_[i];
    apart[i] = difference(o, log_young);
    const Eigen::Map<const Vector> slope(o.slope.data());
    if (!std::isfinite(apart[i]) || !slope.allFinite()) return kInfinite;
    normal += o.weight * slope * slope.transpose();
    right -= o.weight * apart[i] * slope;
  }
  Vector hold = Vector::Zero();
  for (Eigen::Index k = 0; k < kShared; ++k) {
    const double sd = shared_sd_[static_cast<size_t>(k)];
    hold[k] = std::isfinite(sd) ? 1 / std::max(sd * sd, 1e-30) : 0;
    normal(k, k) += hold[k];
    if (normal(k, k) == 0) normal(k, k) = 1;
  }
  const Vector best = normal.ldlt().solve(right);
  double total = best.cwiseAbs2().dot(hold);
  for (size_t i = 0; i < observations_.size(); ++i) {
    apart[i] += Eigen::Map<const Vector>(observations_[i].slope.data()).dot(best);
    total += observations_[i].weight * apart[i] * apart[i];
  }
  if (left) *left = std::move(apart);
  return total;
}

/// Weights from the readings' errors, and what the force's error makes of them at this modulus.
void Fit::weigh(double log_young, const ScatterErrors& errors) {
  for (Observation& o : observations_) {
    const PressFrame& p = frames_[o.frame];
    double sd = o.sd > 0 ? o.sd : errors[static_cast<size_t>(o.seen)];
    if (p.force_sd_N > 0 && o.sd > 0 && std::isfinite(log_young)) {
      const double step = std::max(1e-4 * p.force_N, 1e-9), force = force_N(p);
      double slope = (predicted(o, log_young, force + step) - predicted(o, log_young, force)) / step;
      if (o.seen == Seen::Modulus) slope = measured(o, log_young) / force;
      if (std::isfinite(slope)) sd = root(sd, slope * p.force_sd_N);
    }
    // The ratio's other side has the depth's error, times that ratio.
    const PressValue& depth = p.mean_depth_mm.known() ? p.mean_depth_mm : p.depth_mm;
    if (o.seen == Seen::Shortening && o.sd > 0 && std::isfinite(log_young) && depth.value > 0)
      sd = root(sd, predicted(o, log_young, force_N(p)) / depth.value * depth.sd);
    o.weight = 1 / (sd * sd);
  }
  if (std::isfinite(log_young)) find_slopes(log_young);
}

double Fit::search() {
  double from = std::log(PressModel::kLeastRatio * pad_MPa()) + 1e-6,
         to = std::log(PressModel::kMostRatio * pad_MPa()) - 1e-6;
  const bool near = std::isfinite(given_.near);
  if (near) {
    from = std::max(from, given_.near - 3);
    to = std::min(to, given_.near + 3);
  }
  const int steps = near ? 6 : 50;
  double best = kNaN, least = kInfinite;
  const double step = (to - from) / steps;
  for (int i = 0; i <= steps; ++i) {
    const double value = chi2(from + i * step);
    if (value < least) {
      least = value;
      best = from + i * step;
    }
  }
  if (!std::isfinite(least)) return kNaN;
  double low = std::max(from, best - step), high = std::min(to, best + step);
  const double golden = 2 - std::numbers::phi;
  double a = low + golden * (high - low), b = high - golden * (high - low), fa = chi2(a), fb = chi2(b);
  while (high - low > (near ? 1e-4 : 1e-7)) {
    if (fa < fb || !std::isfinite(fb)) {
      high = b;
      b = a;
      fb = fa;
      fa = chi2(a = low + golden * (high - low));
    } else {
      low = a;
      a = b;
      fa = fb;
      fb = chi2(b = high - golden * (high - low));
    }
  }
  return (low + high) / 2;
}

ModulusFit Fit::run(ModulusFit f, ScatterErrors& errors, bool with_points) {
  std::array<uint32_t, kSeen> unstated{}, all{};
  std::array<double, kSeen> largest{};
  for (const Observation& o : observations_) {
    const auto k = static_cast<size_t>(o.seen);
    ++all[k];
    unstated[k] += !(o.sd > 0);
    largest[k] = std::max(largest[k], std::abs(measured(o, std::log(pad_MPa()))));
  }
  f.readings = static_cast<uint32_t>(observations_.size());
  const bool staged =
      all[static_cast<size_t>(Seen::Approach)] > 0 || (by_stage_ && way_ != ModulusMethod::Joint);
  if (staged && std::isinf(setup_.zero_sd_mm)) ++f.unknowns;
  bool scatter = false;
  ScatterErrors wanted{};
  for (size_t k = 0; k < kSeen; ++k) {
    if (unstated[k] == 0 || errors[k] > 0) continue;
    wanted[k] = 1;
    scatter = true;
    errors[k] = kFirstError * std::max(largest[k], 1e-9);
  }
  if (f.readings < f.unknowns || (scatter && f.readings < f.unknowns + 2)) {
    refuse(f, ModulusState::TooFew,
           std::to_string(f.readings) + " readings for " + std::to_string(f.unknowns) + " unknowns" +
               (scatter ? " and their own scatter: more frames, or readings with standard errors" : ""));
    return f;
  }
  double at = given_.near;
  std::vector<double> left;
  for (int round = 0; round < kErrorRounds; ++round) {
    weigh(at, errors);
    at = search();
    if (!std::isfinite(at)) {
      refuse(f, ModulusState::OutOfRange, "no modulus of the model's range explains the readings");
      return f;
    }
    f.chi2 = chi2(at, &left);
    const bool weights_stay =
        !scatter && frames_.front().force_sd_N <= 0 && way_ != ModulusMethod::DisplacementRatio;
    if (std::isfinite(given_.near) || weights_stay) break;
    for (size_t k = 0; k < kSeen; ++k) {
      if (wanted[k] == 0) continue;
      double sum = 0;
      for (size_t i = 0; i < left.size(); ++i)
        if (static_cast<size_t>(observations_[i].seen) == k) sum += left[i] * left[i];
      const double fraction = static_cast<double>(f.unknowns) * all[k] / f.readings;
      errors[k] = std::max(std::sqrt(sum / std::max(1.0, all[k] - fraction)), 1e-7 * largest[k]);
    }
  }
  f.log_young = at;
  f.found = true;
  if (!with_points) return f;
  weigh(at, errors);
  f.chi2 = chi2(at, &left);
  f.chi2_at_rigid = chi2(std::log(PressModel::kMostRatio * pad_MPa()) - 1e-6);
  double low = std::log(PressModel::kLeastRatio * pad_MPa()) + 1e-6, high = at;
  for (int i = 0; i < 40; ++i) {
    const double middle = (low + high) / 2;
    (chi2(middle) > f.chi2 + 2.71 ? low : high) = middle;
  }
  f.bound_log_young = high;
  for (size_t i = 0; i < observations_.size(); ++i) {
    const Observation& o = observations_[i];
    const PressFrame& p = frames_[o.frame];
    const double y = measured(o, at);
    const double against = o.seen == Seen::Strain       ? p.force_N / sample_.face_mm2()
                           : o.seen == Seen::Shortening ? pad_mean(p, std::exp(at) / pad_MPa())
                           : o.seen == Seen::Modulus    ? p.radius_mm.value
                           : o.seen == Seen::Depth && way_ == ModulusMethod::DisplacementRatio
                               ? p.radius_mm.value
                               : p.force_N;
    f.points.push_back(
        {o.frame, kNames[static_cast<size_t>(o.seen)], against, y, y - left[i], 1 / std::sqrt(o.weight)});
    const double strain = way_ == ModulusMethod::DisplacementRatio && !sample_.flat()
                              ? 0.2 * p.radius_mm.value / sample_.radius_mm()
                              : sight(p.force_N, std::exp(at)).strain;
    if (std::isfinite(strain)) f.strain_max = std::max(f.strain_max, strain);
  }
  return f;
}

}  // namespace

ModulusFit fit_modulus(ModulusMethod way, const std::vector<PressFrame>& frames, const ModulusSetup& setup,
                       const PressModel& model, const ModulusGiven& given, ScatterErrors& errors,
                       bool with_points) {
  Fit fit(way, frames, setup, model, given);
  ModulusFit f;
  if (!fit.take(f)) return f;
  return fit.run(std::move(f), errors, with_points);
}

}  // namespace palpate
