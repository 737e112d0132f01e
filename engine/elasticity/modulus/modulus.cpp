#include "engine/elasticity/modulus/modulus.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <random>

#include "engine/base/normal.h"
#include "engine/base/text.h"
#include "engine/elasticity/modulus/fit.h"
#include "palpate/error.h"

namespace palpate {
namespace {

constexpr uint32_t kResampled = 8;     // frames from which the bootstrap draws frames, not readings
constexpr double kWidestSd = 0.4;      // standard error of ln E from which there is no value any more
constexpr double kContradiction = 4;   // RMS residual over the readings' errors
constexpr double kSmallStrain = 0.35;  // largest axial strain that the linear law is given for,
constexpr double kRubberStrain = 0.6;  // and the rubber's
constexpr double kLawMatters = 0.03;   // strain from which the law is worth a word
constexpr double kEdgeTells = 5;  // sample over pad: beyond, a face's edge alone came out 20 to 50 % too soft
constexpr double kMostlyFound = 0.8;   // of the replicates
constexpr double kModelError = 0.006;  // of E: measured against finite elements of pad and sample together
// A face stiffer than the pad presses with its rim, whose light the picture puts farther out than the model:
// flat samples come out too soft, the more the stiffer, by the edge alone sooner than with a stage.
constexpr double kStiffFaceError = 0.02;         // of E, for each time the pad's modulus
constexpr double kEdgeFrom = 1, kStageFrom = 4;  // beyond so many times

/// 97.5 % quantile of Student's t (Abramowitz and Stegun 26.7.5).
double student(double dof) {
  if (dof < 1) dof = 1;
  if (dof < 1.5) return 12.706;
  if (dof < 2.5) return 4.303;
  const double z = 1.959964, g1 = (z * z * z + z) / 4,
               g2 = (5 * std::pow(z, 5) + 16 * z * z * z + 3 * z) / 96;
  return z + g1 / dof + g2 / (dof * dof);
}

void check(const std::vector<PressFrame>& frames, const ModulusSetup& s) {
  const auto require = [](bool good, const std::string& wanted, double found) {
    if (!good) throw Error(Failure::Input, wanted, std::to_string(found), "checking the number and its unit");
  };
  for (const double sd : {s.pad_relative_sd, s.force_relative_sd, s.length_relative_sd})
    require(sd >= 0 && sd < 0.5, "standard errors of 0 to 0.5 of pad, force and scale", sd);
  require(s.zero_sd_mm >= 0, "a standard error of the approach's zero >= 0 mm", s.zero_sd_mm);
  require(s.replicates >= 50 && s.replicates <= 10000, "50 to 10000 replicates", s.replicates);
  for (size_t i = 0; i < frames.size(); ++i) {
    const PressFrame& f = frames[i];
    const std::string where = " in frame " + std::to_string(i);
    require(f.force_N >= 0 && std::isfinite(f.force_N), "a force >= 0 N" + where, f.force_N);
    require(f.force_sd_N >= 0 && std::isfinite(f.force_sd_N), "a force's standard error >= 0" + where,
            f.force_sd_N);
    for (const PressValue* r : {&f.radius_mm, &f.depth_mm, &f.mean_depth_mm, &f.approach_mm}) {
      if (!r->known()) continue;
      require(std::isfinite(r->value), "finite readings" + where, r->value);
      require(r->sd >= 0 && std::isfinite(r->sd), "standard errors >= 0" + where, r->sd);
    }
    require(!f.radius_mm.known() || f.radius_mm.value >= 0, "a contact radius >= 0 mm" + where,
            f.radius_mm.value);
  }
}

/// Standard errors of a frame's own readings, where they state none from those of what was made of them.
struct OwnErrors {
  double radius, depth, mean, approach;
};
OwnErrors own_errors(const PressFrame& f, const ModulusSetup& s, const ScatterErrors& scatter) {
  const auto of = [&](Seen seen) { return scatter[static_cast<size_t>(seen)]; };
  const double h = s.sample.height_mm, b = s.sample.radius_mm(), nu = std::min(s.sample.poisson, 0.4999);
  const double shortening = std::max(of(Seen::Strain) * h, of(Seen::Shortening));
  const double y = 3 * f.force_N * b / (4 * std::pow(std::max(f.radius_mm.value, 1e-9), 3));
  double radius = std::max(of(Seen::Radius), shortening / h * nu * b);
  if (of(Seen::Modulus) > 0 && y > 0) radius = of(Seen::Modulus) / (3 * y) * f.radius_mm.value;
  const auto stated = [](const PressValue& r, double other) { return r.sd > 0 ? r.sd : other; };
  return {stated(f.radius_mm, radius), stated(f.depth_mm, of(Seen::Depth)),
          stated(f.mean_depth_mm, of(Seen::MeanDepth)),
          stated(f.approach_mm, std::max(of(Seen::Approach), shortening))};
}

/// Standard error of ln E that the model leaves, whatever the readings.
double model_error(ModulusMethod way, const std::vector<PressFrame>& frames, const ModulusSetup& s,
                   double young_MPa) {
  if (!s.sample.flat()) return kModelError;
  const bool stage =
      std::any_of(frames.begin(), frames.end(), [](const PressFrame& f) { return f.approach_mm.known(); });
  if (stage && way != ModulusMethod::Joint) return kModelError;  // the edge is not asked
  const double ratio = young_MPa / s.pad.material.young_MPa;
  return kModelError + kStiffFaceError * std::max(0.0, ratio - (stage ? kStageFrom : kEdgeFrom));
}

class Bootstrap {
 public:
  Bootstrap(const std::vector<PressFrame>& frames, const ModulusSetup& setup, const PressModel& model)
      : frames_(frames), setup_(setup), model_(model) {}

  /// Logarithms of the moduli that replicates of the press give; missing where one gives none.
  std::vector<double> run(const ModulusFit& fit, ModulusMethod way, const ScatterErrors& scatter,
                          double inflate) {
    std::mt19937_64 random(setup_.seed * 4 + static_cast<uint64_t>(way));
    std::normal_distribution<double> normal;
    std::vector<double> found;
    const bool resample = frames_.size() >= kResampled;
    std::uniform_int_distribution<size_t> pick(0, frames_.size() - 1);
    const double model_sd = model_error(way, frames_, setup_, std::exp(fit.log_young));
    for (uint32_t i = 0; i < setup_.replicates; ++i) {
      std::vector<PressFrame> drawn = frames_;
      for (size_t k = 0; k < drawn.size(); ++k) {
        PressFrame& f = drawn[k];
        if (resample) {
          f = frames_[pick(random)];
          continue;
        }
        const OwnErrors sd = own_errors(f, setup_, scatter);
        f.radius_mm.value = std::max(0.0, f.radius_mm.value) + inflate * sd.radius * normal(random);
        f.depth_mm.value += inflate * sd.depth * normal(random);
        f.mean_depth_mm.value += inflate * sd.mean * normal(random);
        f.approach_mm.value += inflate * sd.approach * normal(random);
        f.force_N = std::max(0.0, f.force_N + f.force_sd_N * normal(random));
      }
      ModulusGiven given;
      given.pad = std::max(0.1, 1 + setup_.pad_relative_sd * normal(random));
      given.size = std::max(0.1, 1 + setup_.sample.relative_size_sd * normal(random));
      given.edge = edge_sd(setup_.sample) * normal(random);
      if (std::isfinite(setup_.zero_sd_mm)) given.zero_mm = setup_.zero_sd_mm * normal(random);
      given.near = fit.log_young;
      const double force = std::max(0.1, 1 + setup_.force_relative_sd * normal(random)),
                   length = std::max(0.1, 1 + setup_.length_relative_sd * normal(random));
      for (PressFrame& f : drawn) {
        f.force_N *= force;
        f.radius_mm.value *= length;
        if (!setup_.depth_by_pressure) continue;
        f.depth_mm.value /= given.pad;
        f.mean_depth_mm.value /= given.pad;
      }
      ScatterErrors errors = scatter;
      const ModulusFit again = fit_modulus(way, drawn, setup_, model_, given, errors, false);
      if (again.found) found.push_back(again.log_young + model_sd * normal(random));
    }
    std::sort(found.begin(), found.end());
    return found;
  }

 private:
  const std::vector<PressFrame>& frames_;
  const ModulusSetup& setup_;
  const PressModel& model_;
};

void set(ModulusEstimate& e, ModulusState state, const std::string& reason) {
  e.state = state;
  e.reason = reason;
}

/// No value: the sample is too stiff for the pad, or the readings are too coarse for it.
void refuse_wide(ModulusEstimate& e, const ModulusFit& fit, const ModulusSetup& setup, double sd) {
  const double ratio = std::exp(fit.log_young) / setup.pad.material.young_MPa;
  const bool unbounded = fit.chi2_at_rigid < fit.chi2 + 2.71;
  e.young_MPa = 0;
  if (unbounded || ratio > 3) {
    e.low_MPa = std::min(std::exp(fit.bound_log_young), std::exp(fit.log_young - kNormal90 * sd));
    e.high_MPa = std::numeric_limits<double>::infinity();
    set(e, ModulusState::PadLimited,
        text("the pad gives way, not the sample: at least %.3g kPa (95 %%), %.3g times the pad's",
             1e3 * e.low_MPa, e.low_MPa / setup.pad.material.young_MPa));
  } else {
    e.low_MPa = std::exp(fit.log_young - 1.96 * sd);
    e.high_MPa = std::exp(fit.log_young + 1.96 * sd);
    set(e, ModulusState::NotDetermined,
        text("the readings' errors are as large as what the sample does (strain to %.2g): press harder, or "
             "more "
             "frames",
             fit.strain_max));
  }
}

ModulusEstimate estimate(ModulusMethod way, const std::vector<PressFrame>& frames, const ModulusSetup& setup,
                         const PressModel& model) {
  ModulusEstimate e;
  e.way = way;
  ScatterErrors scatter{};
  ModulusFit fit = fit_modulus(way, frames, setup, model, {}, scatter, true);
  e.readings = fit.readings;
  e.strain_max = fit.strain_max;
  e.points = std::move(fit.points);
  if (!fit.found) {
    set(e, fit.state, fit.reason);
    return e;
  }
  const double dof = std::max(1.0, static_cast<double>(fit.readings) - static_cast<double>(fit.unknowns));
  e.residual = std::sqrt(fit.chi2 / dof);
  const double pad_MPa = setup.pad.material.young_MPa;
  const bool stated = scatter == ScatterErrors{};
  std::vector<double> found =
      Bootstrap(frames, setup, model).run(fit, way, scatter, std::max(1.0, e.residual));
  if (static_cast<double>(found.size()) < kMostlyFound * setup.replicates) {
    if (fit.chi2_at_rigid < fit.chi2 + 2.71) {
      refuse_wide(e, fit, setup, 0);
      return e;
    }
    set(e, ModulusState::NotDetermined,
        text("only %zu of %u replicates of the press give a modulus", found.size(), setup.replicates));
    return e;
  }
  const auto quantile = [&](double q) {
    return found[static_cast<size_t>(q * static_cast<double>(found.size() - 1))];
  };
  // Half of the middle 68 % is robust against replicates that diverge; the tails count where they are wider.
  const double middle = (quantile(0.84) - quantile(0.16)) / 2,
               tails = (quantile(0.975) - quantile(0.025)) / 3.92;
  const double sd = std::max(middle, tails);
  const bool edge = std::abs(fit.log_young - std::log(PressModel::kMostRatio * pad_MPa)) < 1;
  if (sd > kWidestSd || edge ||
      (fit.chi2_at_rigid < fit.chi2 + 2.71 && way != ModulusMethod::DisplacementRatio)) {
    refuse_wide(e, fit, setup, sd);
    return e;
  }
  e.young_MPa = std::exp(fit.log_young);
  const double frames_dof = static_cast<double>(frames.size()) - static_cast<double>(fit.unknowns);
  const double width = sd * (stated && frames.size() < kResampled ? 1.96 : student(frames_dof));
  e.low_MPa = e.young_MPa * std::exp(-width);
  e.high_MPa = e.young_MPa * std::exp(width);
  const double ratio = e.young_MPa / pad_MPa;
  const bool rubber = setup.law == MaterialLaw::Rubber;
  if (ratio < 3 * PressModel::kLeastRatio || ratio > PressModel::kMostRatio / 3)
    set(e, ModulusState::OutOfRange, "the ratio of sample to pad is at the end of the model's range");
  else if (setup.sample.flat() && fit.strain_max > (rubber ? kRubberStrain : kSmallStrain))
    set(e, ModulusState::OutOfRange,
        text("a strain of %.0f %% is no small one: press less hard%s", 100 * fit.strain_max,
             rubber ? "" : ", or --law rubber where the sample is one"));
  else if (setup.sample.flat() && ratio > kEdgeTells &&
           std::none_of(frames.begin(), frames.end(), [](const auto& f) { return f.approach_mm.known(); })) {
    e.young_MPa = 0;
    e.high_MPa = std::numeric_limits<double>::infinity();
    set(e, ModulusState::PadLimited,
        text("the edge of a face so much stiffer than the pad hardly moves: at least %.3g kPa; the stage's "
             "approach "
             "would tell",
             1e3 * e.low_MPa));
  } else if (e.residual > kContradiction)
    set(e, ModulusState::DoesNotFit,
        text("readings miss the model by %.1f of their standard errors: check sample, pad and their sizes",
             e.residual));
  else {
    e.state = ModulusState::Valid;
    if (setup.sample.flat() && !rubber && fit.strain_max > kLawMatters)
      e.reason = text("at %.1f %% strain a rubber would be some %.0f %% softer than the linear law says",
                      100 * fit.strain_max, 100 * fit.strain_max);
  }
  return e;
}

/// Two methods whose intervals (or bounds) have nothing in common, in words; empty: none.
std::string contradiction(const std::array<ModulusEstimate, kModulusMethods>& methods) {
  const auto reports = [](const ModulusEstimate& e) {
    return e.state == ModulusState::Valid || e.state == ModulusState::PadLimited;
  };
  const auto words = [](const ModulusEstimate& e) {
    return to_string(e.way) + (std::isfinite(e.high_MPa)
                                   ? text(" (%.4g to %.4g kPa)", 1e3 * e.low_MPa, 1e3 * e.high_MPa)
                                   : text(" (above %.4g kPa)", 1e3 * e.low_MPa));
  };
  for (const ModulusEstimate& a : methods)
    for (const ModulusEstimate& b : methods)
      if (reports(a) && reports(b) && a.high_MPa < b.low_MPa)
        return words(a) + " and " + words(b) + " contradict each other";
  return {};
}

}  // namespace

const char* to_string(ModulusMethod way) {
  constexpr std::array<const char*, kModulusMethods> kWays = {"stress over strain", "displacement ratio",
                                                              "Hertz", "joint fit"};
  return kWays[static_cast<size_t>(way)];
}

const char* to_string(ModulusState state) {
  constexpr std::array<const char*, 7> kStates = {
      "valid", "not applicable", "too few", "not determined", "pad limited", "out of range", "does not fit"};
  return kStates[static_cast<size_t>(state)];
}

ModulusAnswer estimate_modulus(const std::vector<PressFrame>& frames, const ModulusSetup& setup) {
  return estimate_modulus(frames, setup, PressModel(setup.pad, setup.sample));
}

ModulusAnswer estimate_modulus(const std::vector<PressFrame>& frames, const ModulusSetup& setup,
                               const PressModel& model) {
  check(frames, setup);
  ModulusAnswer answer;
  for (size_t i = 0; i < kModulusMethods; ++i)
    answer.methods[i] = estimate(static_cast<ModulusMethod>(i), frames, setup, model);
  ModulusEstimate& joint = answer.methods[static_cast<size_t>(ModulusMethod::Joint)];
  if (joint.state == ModulusState::Valid) {
    if (const std::string why = contradiction(answer.methods); !why.empty()) {
      set(joint, ModulusState::DoesNotFit, why + ": check the sample's shape and size, and the pad");
      answer.why = "a wrong shape or pad bends each way differently, and each may fit well by itself";
      return answer;
    }
    answer.why = "it uses every reading, with the pad's thickness and the contact's own shape";
    return answer;
  }
  // A fault of the press affects every method, also one that fits its part of the readings.
  if (joint.state == ModulusState::DoesNotFit) {
    answer.why = "a way that fits by itself uses a part of the readings, and all of them contradict it";
    return answer;
  }
  double narrowest = std::numeric_limits<double>::infinity();
  if (joint.state == ModulusState::TooFew || joint.state == ModulusState::NotApplicable) {
    if (const std::string why = contradiction(answer.methods); !why.empty()) {
      set(joint, ModulusState::DoesNotFit, why + ": check the sample's shape and size, and the pad");
      answer.why = "a wrong shape or pad bends each way differently, and each may fit well by itself";
      return answer;
    }
    for (const ModulusEstimate& e : answer.methods)
      if (e.state == ModulusState::Valid && e.high_MPa / e.low_MPa < narrowest) {
        narrowest = e.high_MPa / e.low_MPa;
        answer.chosen = e.way;
      }
  }
  answer.why = answer.chosen == ModulusMethod::Joint
                   ? "no way gives a value; the joint fit says most about why"
                   : std::string("the joint fit is out (") + to_string(joint.state) +
                         ") and this has the narrowest valid interval";
  return answer;
}

}  // namespace palpate
