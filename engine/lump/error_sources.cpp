#include "engine/lump/error_sources.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "engine/base/normal.h"
#include "engine/base/numbers.h"
#include "engine/base/text.h"
#include "engine/lump/press_effect/press_effect.h"
#include "engine/lump/tissue/found_tissue.h"
#include "engine/lump/tissue/relaxation.h"
#include "palpate/error.h"

namespace palpate::lump {
namespace {

constexpr int kTissueRounds = 3;         // of lump and tissue in turn
constexpr double kTissueSettled = 1e-3;  // change of the modulus
constexpr double kMostShare = 0.5;       // of an input's error

// Shares of an effect, 90 % interval: press_effect/README.md.
constexpr double kSkinShare = 0.05, kPlateShare = 0.15;
constexpr double kMostFriction = 2, kJudgedFriction = 0.1;

constexpr const char *kSkinEffect = "skin's effect", *kPlateEffect = "plate's effect",
                     *kBothEffects = "skin's and plate's effect";
constexpr const char *kFriction = "plate's friction", *kRelaxation = "relaxation";
constexpr const char *kLight = "light", *kAlongX = "place along x", *kAlongY = "place along y";

constexpr std::array kLogarithmic{&Estimate::size_mm, &Estimate::depth_mm, &Estimate::stiffness_ratio};
constexpr std::array kLinear{&Estimate::x_mm, &Estimate::y_mm};

std::array<double, 3> changes(const Estimate& estimate, const Estimate& other) {
  std::array<double, 3> all{kNaN, kNaN, kNaN};
  if (reports_numbers(other.verdict))
    for (size_t p = 0; p < all.size(); ++p)
      all[p] = (other.*kLogarithmic[p]).value / (estimate.*kLogarithmic[p]).value - 1;
  return all;
}

/// Squares of the distances from values to the ends of their intervals, of which each source adds its own.
class Widening {
 public:
  explicit Widening(const Estimate& estimate) {
    for (size_t p = 0; p < kLogarithmic.size(); ++p) {
      const Value& v = estimate.*kLogarithmic[p];
      below_[p] = std::pow(std::log(v.value / v.low), 2);
      above_[p] = std::pow(std::log(v.high / v.value), 2);
    }
    for (size_t p = 0; p < kLinear.size(); ++p) {
      const Value& v = estimate.*kLinear[p];
      below_[kLogarithmic.size() + p] = std::pow(v.value - v.low, 2);
      above_[kLogarithmic.size() + p] = std::pow(v.high - v.value, 2);
    }
  }

  /// A source's two ends.
  void add(const Estimate& reference, const Estimate& lower, const Estimate& higher) {
    const bool low = reports_numbers(lower.verdict), high = reports_numbers(higher.verdict);
    const auto add_moves = [&](size_t p, double down, double up) {
      if (!low && !high) return;
      if (!low) down = -up;
      if (!high) up = -down;
      below_[p] += std::pow(std::min({down, up, 0.0}), 2);
      above_[p] += std::pow(std::max({down, up, 0.0}), 2);
    };
    for (size_t p = 0; p < kLogarithmic.size(); ++p) {
      const double at = std::log((reference.*kLogarithmic[p]).value);
      add_moves(p, std::log((lower.*kLogarithmic[p]).value) - at,
                std::log((higher.*kLogarithmic[p]).value) - at);
    }
    for (size_t p = 0; p < kLinear.size(); ++p) {
      const double at = (reference.*kLinear[p]).value;
      add_moves(kLogarithmic.size() + p, (lower.*kLinear[p]).value - at, (higher.*kLinear[p]).value - at);
    }
  }
  void add_place(double sd_mm) {
    for (size_t p = 0; p < kLinear.size(); ++p)
      for (auto* squares : {&below_, &above_})
        (*squares)[kLogarithmic.size() + p] += std::pow(kNormal90 * sd_mm, 2);
  }

  void apply(Estimate& estimate) const {
    for (size_t p = 0; p < kLogarithmic.size(); ++p) {
      Value& v = estimate.*kLogarithmic[p];
      v.low = v.value * std::exp(-std::sqrt(below_[p]));
      v.high = v.value * std::exp(std::sqrt(above_[p]));
    }
    for (size_t p = 0; p < kLinear.size(); ++p) {
      Value& v = estimate.*kLinear[p];
      v.low = v.value - std::sqrt(below_[kLogarithmic.size() + p]);
      v.high = v.value + std::sqrt(above_[kLogarithmic.size() + p]);
    }
  }

 private:
  std::array<double, kLogarithmic.size() + kLinear.size()> below_{}, above_{};
};

std::string side_text(const std::array<double, 3>& changes) {
  if (!std::isfinite(changes[0])) return "no numbers";
  return text("size %+.2g %%, depth %+.2g %%, ratio %+.2g %%", 100 * changes[0], 100 * changes[1],
              100 * changes[2]);
}

}  // namespace

Estimator::Estimator(Inverse inverse, const ErrorSources& sources, Inverse moves)
    : inverse_(std::move(inverse)), moves_(std::move(moves)), sources_(sources) {
  for (const double share : {sources.young, sources.thickness, sources.pitch})
    if (!(share >= 0 && share <= kMostShare))
      throw Error(Failure::Usage, "input errors from 0 to 0.5", text("%g", share), "0.1, which is 10 %");
}

Estimator Estimator::until(const StopAsked& stop) const {
  if (!stop) return *this;
  const auto stopped = [&stop](const Inverse& inverse) -> Inverse {
    if (!inverse) return {};
    return [stop, inverse](const Observation& observation) {
      check_stop(stop);
      return inverse(observation);
    };
  };
  Estimator other = *this;
  other.inverse_ = stopped(inverse_);
  other.moves_ = stopped(moves_);
  return other;
}

Estimate Estimator::operator()(const Observation& observation, const UnevenLight& uneven) const {
  if (observation.relaxation) return of_relaxing(observation, uneven);
  if (observation.skin || observation.plate) return pressed_otherwise(observation, uneven);
  return observation.press_mm.empty() ? widened(observation, sources_, uneven)
                                      : in_found_tissue(observation, uneven);
}

Estimate Estimator::in_found_tissue(const Observation& observation, const UnevenLight& uneven) const {
  const bool told = observation.young_Pa > 0;
  const TissuePrior prior{told ? sources_.young / kNormal90 : std::numeric_limits<double>::infinity(),
                          sources_.thickness / kNormal90};
  Observation pressed = observation;
  Estimate lump;
  FoundTissue tissue = find_tissue(observation, prior, lump);
  for (int round = 0; tissue.unusable.empty() && round < kTissueRounds; ++round) {
    pressed.young_Pa = tissue.young_Pa;
    pressed.block_mm[2] = tissue.thickness_mm;
    lump = (moves_ ? moves_ : inverse_)(pressed);
    const double before_Pa = tissue.young_Pa;
    tissue = find_tissue(observation, prior, lump);
    if (std::abs(tissue.young_Pa / before_Pa - 1) < kTissueSettled) break;
  }
  if (!tissue.unusable.empty()) {
    Estimate estimate;
    estimate.method = "none";
    if (told) estimate = widened(observation, sources_, uneven);
    estimate.reasons.insert(estimate.reasons.begin(), tissue.unusable);
    return estimate;
  }
  pressed.young_Pa = tissue.young_Pa;
  pressed.block_mm[2] = tissue.thickness_mm;
  ErrorSources sources = sources_;
  sources.young = kNormal90 * tissue.young_sd_at_thickness;
  sources.thickness = kNormal90 * tissue.thickness_sd;
  sources.young_by_thickness = tissue.young_by_thickness;
  const bool open = !(sources.young <= kMostShare && sources.thickness <= kMostShare);
  const auto lit = [&](double fraction) {
    Observation other = uneven(fraction);
    other.young_Pa = pressed.young_Pa;
    other.block_mm = pressed.block_mm;
    return other;
  };
  Estimate estimate =
      widened(pressed, open ? ErrorSources::none() : sources, uneven ? UnevenLight(lit) : uneven);
  if (!open) estimate.tissue = tissue.tissue();
  std::string reason = tissue.contradiction;
  if (!reason.empty()) {
    estimate.verdict = Status::Inconsistent;
  } else if (open) {
    estimate.verdict = Status::Unusable;
    reason =
        text("the way of the plate, known to %.2g mm, tells the modulus to no better than a factor of %.2g",
             observation.press_sd_mm, std::exp(kNormal90 * tissue.young_sd));
  }
  if (!reason.empty()) estimate.reasons.insert(estimate.reasons.begin(), reason);
  return estimate;
}

namespace {

/// Lumps of an estimate: its own, or each of two.
std::vector<Estimate> parts_of(const Estimate& estimate) {
  return estimate.lumps.empty() ? std::vector<Estimate>{estimate} : estimate.lumps;
}

/// The same lumps in another estimate, each the nearest; without numbers where they are not as many.
std::vector<Estimate> same_parts(const std::vector<Estimate>& parts, const Estimate& other) {
  std::vector<Estimate> found = parts_of(other);
  if (found.size() != parts.size()) return std::vector<Estimate>(parts.size());
  const auto apart = [](const Estimate& a, const Estimate& b) {
    return std::hypot(a.x_mm.value - b.x_mm.value, a.y_mm.value - b.y_mm.value);
  };
  if (found.size() == 2 && apart(parts[0], found[1]) + apart(parts[1], found[0]) <
                               apart(parts[0], found[0]) + apart(parts[1], found[1]))
    std::swap(found[0], found[1]);
  return found;
}

/// The same lumps in another estimate; an estimate's own where that has no numbers.
std::vector<Estimate> reference_parts(const Estimate& estimate, const Estimate& other) {
  const std::vector<Estimate> own = parts_of(estimate);
  std::vector<Estimate> parts = same_parts(own, other);
  for (size_t i = 0; i < own.size(); ++i)
    if (!reports_numbers(parts[i].verdict)) parts[i] = own[i];
  return parts;
}

/// The intervals of each lump of an estimate.
class PartWidening {
 public:
  explicit PartWidening(Estimate& estimate) {
    if (estimate.lumps.empty())
      parts_ = {&estimate};
    else
      for (Estimate& lump : estimate.lumps) parts_.push_back(&lump);
    for (const Estimate* part : parts_) each_.emplace_back(*part);
  }
  bool any() const {
    return std::any_of(parts_.begin(), parts_.end(),
                       [](const Estimate* part) { return reports_numbers(part->verdict); });
  }
  void add(const std::string& input, double error, const std::vector<Estimate>& reference,
           const Estimate& lower, const Estimate& higher) {
    const std::vector<Estimate> low = same_parts(reference, lower), high = same_parts(reference, higher);
    for (size_t i = 0; i < parts_.size(); ++i) {
      each_[i].add(reference[i], low[i], high[i]);
      parts_[i]->input_effects.push_back(
          {input, error, changes(reference[i], low[i]), changes(reference[i], high[i])});
    }
  }
  void add_place(double sd_mm) {
    for (Widening& widening : each_) widening.add_place(sd_mm);
  }
  void apply() {
    for (size_t i = 0; i < parts_.size(); ++i) {
      if (!reports_numbers(parts_[i]->verdict)) continue;
      each_[i].apply(*parts_[i]);
      open_wide_ratio(*parts_[i]);
    }
  }

 private:
  std::vector<Estimate*> parts_;
  std::vector<Widening> each_;
};

/// Conditions of a press with one of them at either end of its interval.
struct PressEnds {
  const char* input;
  double error;
  PressConditions lower, higher;
};

/// Ends of all that an observation says is not exact.
std::vector<PressEnds> open_ends(const Observation& observation) {
  std::vector<PressEnds> all;
  const auto add = [&](const char* input, double error, const auto& change) {
    if (error <= 0) return;
    PressEnds ends{input, error, conditions_of(observation), conditions_of(observation)};
    change(ends.lower, -1);
    change(ends.higher, 1);
    all.push_back(ends);
  };
  if (observation.skin) {
    const double thick = std::exp(kNormal90 * observation.skin->thickness_sd),
                 stiff = std::exp(kNormal90 * observation.skin->ratio_sd);
    add("skin's thickness", thick - 1, [&](PressConditions& to, int side) {
      double& mm = to.skin->thickness_mm;
      mm = std::min(mm * (side < 0 ? 1 / thick : thick), observation.block_mm[2] / 2);
    });
    add("skin's stiffness", stiff - 1,
        [&](PressConditions& to, int side) { to.skin->stiffness_ratio *= side < 0 ? 1 / stiff : stiff; });
  }
  if (observation.plate && !observation.plate->sticks) {
    const double error = kNormal90 * observation.plate->friction_sd;
    add(kFriction, error, [&](PressConditions& to, int side) {
      to.plate_friction = std::clamp(to.plate_friction + side * error, 0.0, kMostFriction);
    });
  }
  return all;
}

}  // namespace

Estimate Estimator::widened(const Observation& observation, const ErrorSources& sources,
                            const UnevenLight& uneven) const {
  Estimate estimate = inverse_(observation);
  if (estimate.lumps.empty() && !reports_numbers(estimate.verdict)) return estimate;
  PartWidening widening(estimate);
  if (!widening.any()) return estimate;
  const auto estimate_again = [&](const Observation& other) {
    Estimate again = (moves_ ? moves_ : inverse_)(other);
    estimate.wall_s += again.wall_s;
    return again;
  };
  // Moves of another inverse count from its own answer without the error.
  std::vector<Estimate> reference;
  const auto add = [&](const std::string& input, double error, const Observation& low,
                       const Observation& high) {
    if (reference.empty())
      reference = moves_ ? reference_parts(estimate, estimate_again(observation)) : parts_of(estimate);
    const Estimate lower = estimate_again(low), higher = estimate_again(high);
    widening.add(input, error, reference, lower, higher);
    return lower.verdict != Status::NoLump && higher.verdict != Status::NoLump;
  };
  const auto with = [&](Input input, double factor) {
    Observation other = with_input(observation, input, factor);
    if (input == Input::Thickness && sources.young_by_thickness != 0)
      other = with_input(std::move(other), Input::Modulus, std::pow(factor, sources.young_by_thickness));
    return other;
  };
  for (const auto& [input, share] : {std::pair{Input::Modulus, sources.young},
                                     {Input::Thickness, sources.thickness},
                                     {Input::Pitch, sources.pitch}})
    if (share > 0) add(to_string(input), share, with(input, 1 - share), with(input, 1 + share));
  if (sources.light && observation.uneven_sd > 0) {
    const auto lit = [&](double fraction) {
      return uneven ? uneven(fraction) : with_uneven_light(observation, fraction);
    };
    const double fraction = kNormal90 * observation.uneven_sd;
    if (!add(kLight, fraction, lit(-fraction), lit(fraction))) {
      estimate.verdict = Status::Unusable;
      estimate.lumps.clear();
      estimate.reasons = {
          text("a lump, or no more than the sensor's own unevenness, which is known to %.2g %%",
               100 * observation.uneven_sd)};
      return estimate;
    }
  }
  if (sources.place) {
    widening.add_place(observation.place_sd_mm);
    // What a stage is off by moves none of the others.
    if (observation.place_sd_mm > kPlaceSd_mm)
      for (const size_t axis : {size_t{0}, size_t{1}}) {
        Observation less = observation, more = observation;
        const double far_mm = kNormal90 * observation.place_sd_mm;
        less.window_mm[axis] -= far_mm;
        more.window_mm[axis] += far_mm;
        add(axis == 0 ? kAlongX : kAlongY, far_mm, less, more);
      }
  }
  widening.apply();
  return estimate;
}

Estimate Estimator::of_relaxing(const Observation& observation, const UnevenLight& uneven) const {
  const auto lit = [&](double fraction) {
    Observation other = uneven(fraction);
    other.relaxation = observation.relaxation;
    return without_relaxation(other);
  };
  const Observation elastic = without_relaxation(observation);
  Estimate estimate = (*this)(elastic, uneven ? UnevenLight(lit) : uneven);
  PartWidening widening(estimate);
  const double error = observation.relaxation->share_error;
  if (!widening.any() || error <= 0) return estimate;
  const Estimator quick(moves_ ? moves_ : inverse_, ErrorSources::none());
  const Estimate reference = quick(elastic), less = quick(without_relaxation(observation, 1 - error)),
                 more = quick(without_relaxation(observation, 1 + error));
  widening.add(kRelaxation, error, reference_parts(estimate, reference), less, more);
  widening.apply();
  if (estimate.tissue && reference.tissue && less.tissue && more.tissue) {
    const auto moved = [&](const Estimate& other) {
      return std::abs(std::log(other.tissue->young_Pa.value / reference.tissue->young_Pa.value));
    };
    Value& young = estimate.tissue->young_Pa;
    const double by = std::max(moved(less), moved(more));
    young.low = young.value * std::exp(-std::hypot(std::log(young.value / young.low), by));
    young.high = young.value * std::exp(std::hypot(std::log(young.high / young.value), by));
  }
  return estimate;
}

Estimate Estimator::pressed_otherwise(const Observation& observation, const UnevenLight& uneven) const {
  const Estimator quick(moves_ ? moves_ : inverse_, ErrorSources::none());
  const TakenOff taken = take_off_effect(observation, [&quick](const Observation& o) { return quick(o); });
  if (!taken.effect) {
    Estimate estimate;
    estimate.method = "none";
    estimate.reasons = {taken.unusable};
    return estimate;
  }
  const auto lit = [&](double fraction) { return taken.effect->taken_off(uneven(fraction)); };
  Estimate estimate = (*this)(taken.plain, uneven ? UnevenLight(lit) : uneven);
  if (observation.plate && (observation.plate->sticks || observation.plate->friction > kJudgedFriction))
    estimate.reasons.emplace_back(
        "so firm a plate is taken off roughly, and its intervals are not judged: let it slide where it can");
  estimate.reasons.push_back("under " + conditions_text(conditions_of(observation)) +
                             text(", bumps are %.2g times as high", taken.effect->bump_factor()));
  PartWidening widening(estimate);
  if (!widening.any()) return estimate;
  const auto under = [&](const PressConditions& conditions) {
    const std::optional<Observation> other = taken_off_roughly(observation, taken, conditions);
    return other ? quick(*other) : Estimate{};
  };
  const std::vector<PressEnds> open = open_ends(observation);
  if (!open.empty()) {
    const std::vector<Estimate> rough = reference_parts(estimate, under(conditions_of(observation)));
    for (const PressEnds& ends : open)
      widening.add(ends.input, ends.error, rough, under(ends.lower), under(ends.higher));
  }
  const std::vector<Estimate> reference = reference_parts(estimate, quick(taken.plain));
  const char* effect = !observation.plate ? kSkinEffect : observation.skin ? kBothEffects : kPlateEffect;
  const double share = observation.plate ? kPlateShare : kSkinShare;
  widening.add(effect, share, reference, quick(taken.effect->taken_off(observation, 1 - share)),
               quick(taken.effect->taken_off(observation, 1 + share)));
  widening.apply();
  if (observation.skin && reports_numbers(estimate.verdict) &&
      estimate.depth_mm.high < observation.skin->thickness_mm) {
    estimate.verdict = Status::OutsideTraining;
    estimate.reasons.insert(estimate.reasons.begin(), "a lump within the skin, where it would be less deep");
  }
  return estimate;
}

const char* to_string(Input input) {
  constexpr const char* kNames[] = {"modulus", "thickness", "pitch"};
  return kNames[static_cast<size_t>(input)];
}

Observation with_input(Observation observation, Input input, double factor) {
  switch (input) {
    case Input::Modulus:
      observation.young_Pa *= factor;
      break;
    case Input::Thickness:
      observation.block_mm[2] *= factor;
      break;
    case Input::Pitch:
      for (PressureMap& map : observation.pressure_Pa)
        for (double& pitch : map.pitch_mm) pitch *= factor;
  }
  return observation;
}

Observation with_uneven_light(Observation observation, double fraction) {
  for (PressureMap& map : observation.pressure_Pa) {
    const double x_half = (map.width - 1) / 2.0, y_half = (map.height - 1) / 2.0;
    const double corner = x_half * x_half + y_half * y_half;
    for (uint32_t j = 0; j < map.height; ++j)
      for (uint32_t i = 0; i < map.width; ++i) {
        const double r = ((i - x_half) * (i - x_half) + (j - y_half) * (j - y_half)) / corner;
        map.values[size_t{j} * map.width + i] *= static_cast<float>(1 + fraction * (1.0 / 3 - r));
      }
  }
  return observation;
}

std::string effect_text(const InputEffect& effect) {
  const double percent = 100 * effect.error;
  if (effect.input == kLight)
    return text("if the window's middle reads %.2g %% darker than its corners: ", percent) +
           side_text(effect.lower) + text("; %.2g %% brighter: ", percent) + side_text(effect.higher);
  if (effect.input == kFriction)
    return text("if the plate's friction is %.2g less than stated: ", effect.error) +
           side_text(effect.lower) + text("; %.2g more: ", effect.error) + side_text(effect.higher);
  if (effect.input == kSkinEffect || effect.input == kPlateEffect || effect.input == kBothEffects)
    return std::string(effect.input == kSkinEffect    ? "if the skin changes"
                       : effect.input == kPlateEffect ? "if the plate changes"
                                                      : "if skin and plate change") +
           text(" the press by %.2g %% less than computed: ", percent) + side_text(effect.lower) +
           text("; %.2g %% more: ", percent) + side_text(effect.higher);
  if (effect.input == kAlongX || effect.input == kAlongY)
    return "if the " + effect.input + text(" is %.2g mm less than stated: ", effect.error) +
           side_text(effect.lower) + text("; %.2g mm more: ", effect.error) + side_text(effect.higher);
  return "if the " + effect.input + text(" is %.3g %% lower than stated: ", percent) +
         side_text(effect.lower) + text("; %.3g %% higher: ", percent) + side_text(effect.higher);
}

}  // namespace palpate::lump
