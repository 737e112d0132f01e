#include "engine/lump/change/change.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "engine/base/normal.h"
#include "engine/base/numbers.h"
#include "engine/base/text.h"
#include "engine/lump/network/detection_limit.h"
#include "engine/lump/network/fit.h"
#include "engine/lump/observation/map_at_load.h"
#include "engine/lump/observation/saturated_loads.h"
#include "engine/numeric/dense.h"

namespace palpate::lump {
namespace {

using Matrix5 = Eigen::Matrix<double, 5, 5>;
using Logs = std::array<double, kParameters>;

constexpr uint32_t kRounds = 12;
constexpr int kPlaceRounds = 2;
/// Parts of what is uncertain alike on both days that are left in their difference: of lumps that have not
/// changed, and more by each unit of the logarithm of the size; and of the growth itself. Chosen on 24 blocks
/// pressed anew without a change and with 10 % of growth.
constexpr double kLeft = 0.1, kLeftGrown = 5, kGrowth = 0.1;
/// Least standard errors of the logarithms' changes: an emulator is a little uneven from one place of a lump
/// to the next, which no covariance of one press has. Of 26 blocks pressed anew without a change.
constexpr Logs kLeast = {0.004, 0.008, 0.012};
constexpr double kUnlikeLoads =
    1.5;  // the higher day's load over the other's, from which on they are refused
constexpr double kJudgedLoads = 1.16;  // and up to which intervals have been judged
constexpr double kLowestLoad = 0.7;    // of a day's own lowest one, down to which it is read below that
constexpr double kSamePitch = 0.01, kSameNoise = 3;  // of two days by one pad: share, and factor
constexpr double kElsewhere = 4;  // standard errors of the places beyond which it is another lump
constexpr double kTurnedCloser =
    0.3;  // of the way between places, if the second day is turned by 180 degrees

/// One day's maps, and the lumps that explain them.
struct Pressed {
  PressedNodes nodes;
  Weighing weighing;
  double temperature = 1;

  std::optional<Fit> fit(InclusionShape shape) const {
    for (const Fit& one : weighing.fits)
      if (one.shape == shape) return one;
    return std::nullopt;
  }
  /// Of the likeliest lump, mm from the block's middle.
  std::array<double, 2> place_mm() const {
    const Fit& best = best_of(weighing.fits);
    return weighing.look.patch.view.place_mm(best.at(3), best.at(4));
  }
};

std::optional<Pressed> pressed(const Model& model, const Observation& observation) {
  Estimate estimate;
  const auto seen = without_saturated_loads(observation, estimate);
  auto nodes = seen ? pressed_nodes(model, *seen, estimate) : std::nullopt;
  if (!nodes) return std::nullopt;
  Weighing weighing = weigh(model, *nodes, Method::Refined);
  const double temperature =
      calibration_at(model, Method::Refined, nodes->loads.size(), nodes->noise_fraction).temperature;
  return Pressed{std::move(*nodes), std::move(weighing), temperature};
}

/// The day's own fit of that shape, or one from where another day's lies, whichever is better.
Fit fit_near(const Model& model, const Pressed& day, InclusionShape shape, const std::optional<Fit>& other) {
  std::optional<Fit> best = day.fit(shape);
  if (other) {
    Fit from = *other;
    from.at(3) = best ? best->at(3) : 0;
    from.at(4) = best ? best->at(4) : 0;
    Fitter(model, day.nodes, day.weighing.look.patch).search(from, kRounds);
    if (!best || from.chi_square < best->chi_square) best = from;
  }
  return *best;
}

/// Covariance of a fit that one press's noise and gauge make, and of another pad its own pattern.
Matrix5 press_covariance(const Model& model, const Pressed& day, const Fit& fit, bool another_pad) {
  const PatchObservation& patch = day.weighing.look.patch;
  Eigen::MatrixXd jacobian;
  (void)Fitter(model, day.nodes, patch).factors(fit, &jacobian);
  const Eigen::MatrixXd gain = dense::inverse(fit.normal) * jacobian.transpose();
  const Eigen::MatrixXd own = another_pad
                                  ? patch.errors.of_another_pad(day.weighing.found.pattern * day.nodes.peak)
                                  : patch.errors.of_one_press();
  return gain * patch.whitener.of_covariance(own) * gain.transpose();
}

/// Two days together: means over shapes, of logarithms.
struct Difference {
  Logs first{}, change{};
  Logs chance{};    ///< variance of the change if there were none
  Logs variance{};  ///< and as it is
};

Difference difference_of(const Model& model, const Pressed& a, const Pressed& b, bool another_pad) {
  struct One {
    Logs first, change, chance, variance;
    double energy;
  };
  std::vector<One> all;
  for (size_t s = 0; s < 4; ++s) {
    const auto shape = static_cast<InclusionShape>(s);
    const auto of_a = a.fit(shape), of_b = b.fit(shape);
    if (!of_a && !of_b) continue;
    const Fit fit_a = fit_near(model, a, shape, of_b), fit_b = fit_near(model, b, shape, fit_a);
    const Matrix5 press =
        press_covariance(model, a, fit_a, another_pad) + press_covariance(model, b, fit_b, another_pad);
    const Matrix5 shared = 0.5 * (dense::inverse(fit_a.normal) + dense::inverse(fit_b.normal));
    const double grown = fit_b.at(kSize) - fit_a.at(kSize);
    One one{{}, {}, {}, {}, (fit_a.chi_square + fit_b.chi_square) / (a.temperature + b.temperature)};
    for (size_t p = 0; p < kParameters; ++p) {
      const auto i = static_cast<Eigen::Index>(p);
      one.first[p] = fit_a.at(i);
      one.change[p] = fit_b.at(i) - fit_a.at(i);
      one.chance[p] = press(i, i) + kLeft * kLeft * shared(i, i) + kLeast[p] * kLeast[p];
      one.variance[p] =
          one.chance[p] +
          grown * grown * (kLeftGrown * kLeftGrown * shared(i, i) + (p == kSize ? kGrowth * kGrowth : 0));
    }
    all.push_back(one);
  }
  const double least = std::min_element(all.begin(), all.end(), [](const One& x, const One& y) {
                         return x.energy < y.energy;
                       })->energy;
  double sum = 0;
  for (const One& one : all) sum += std::exp(-0.5 * (one.energy - least));
  Difference d;
  for (const One& one : all) {
    const double weight = std::exp(-0.5 * (one.energy - least)) / sum;
    for (size_t p = 0; p < kParameters; ++p) {
      d.first[p] += weight * one.first[p];
      d.change[p] += weight * one.change[p];
      const double square = one.change[p] * one.change[p];
      d.chance[p] += weight * (one.chance[p] + square);
      d.variance[p] += weight * (one.variance[p] + square);
    }
  }
  for (size_t p = 0; p < kParameters; ++p)
    for (Logs* of : {&d.chance, &d.variance}) (*of)[p] -= d.change[p] * d.change[p];
  return d;
}

/// Both days, their windows put where the lump has one place in the tissue: what it seems to have moved, the
/// windows have, each in proportion to its own uncertainty.
struct Pair {
  Observation first, second;
  bool another_pad = false;          ///< on the second day: errors of the pads do not cancel
  std::array<double, 2> moved_mm{};  ///< of the second window against the first
  double turned_mm = kNaN;  ///< how far apart the places lie if the second day is turned by 180 degrees
};

std::optional<Difference> difference_of(const Model& model, const Pair& pair) {
  const auto a = pressed(model, pair.first), b = pressed(model, pair.second);
  if (!a || !b) return std::nullopt;
  return difference_of(model, *a, *b, pair.another_pad);
}

/// The observations show by themselves that two pads made them.
bool unlike_pads(const Observation& first, const Observation& second) {
  const double pitch = second.pressure_Pa.front().pitch_mm[0] / first.pressure_Pa.front().pitch_mm[0];
  const double noise = second.noise_Pa / first.noise_Pa;  // NaN or infinite where one has none
  return std::abs(std::log(pitch)) > kSamePitch ||
         (std::isfinite(noise) && noise > 0 && std::abs(std::log(noise)) > std::log(kSameNoise));
}

std::optional<Pair> one_place(const Model& model, const Observation& first, const Observation& second) {
  Pair pair{first, second, unlike_pads(first, second), {}};
  const double of_first = std::pow(pair.first.place_sd_mm, 2),
               of_second = std::pow(pair.second.place_sd_mm, 2);
  for (int round = 0; round < kPlaceRounds && of_first + of_second > 0; ++round) {
    const auto a = pressed(model, pair.first), b = pressed(model, pair.second);
    if (!a || !b) return std::nullopt;
    const auto from = a->place_mm(), to = b->place_mm();
    if (round == 0) pair.turned_mm = std::hypot(from[0] + to[0], from[1] + to[1]);
    for (size_t axis = 0; axis < 2; ++axis) {
      const double apart = to[axis] - from[axis];
      pair.moved_mm[axis] -= apart;
      pair.first.window_mm[axis] += apart * of_first / (of_first + of_second);
      pair.second.window_mm[axis] -= apart * of_second / (of_first + of_second);
    }
    if (std::hypot(to[0] - from[0], to[1] - from[1]) < kPlaceSd_mm) break;
  }
  return pair;
}

/// The same press at other loads. As it is where those loads lie beyond its own.
Observation at_loads(const Observation& observation, const std::vector<double>& loads) {
  const std::vector<double> own = loads_of(observation);
  if (loads.front() < kLowestLoad * own.front() || loads.back() > own.back() * (1 + 1e-9)) return observation;
  Observation other = observation;
  other.pressure_Pa.clear();
  other.force_N.clear();
  for (const double load : loads) {
    const double force_N = load / own.back() * observation.force_N.back();
    other.pressure_Pa.push_back(map_at_load(observation, force_N));
    other.force_N.push_back(force_N);
  }
  return other;
}

/// Adds to each logarithm's variance what an error of one standard deviation moves the change by.
class Errors {
 public:
  Errors(const Model& model, const Pair& pair, Difference& of) : model_(model), pair_(pair), of_(of) {}

  template <typename Apply>
  void add(const Apply& apply) {
    Pair other = pair_;
    apply(other);
    const auto moved = difference_of(model_, other);
    for (size_t p = 0; moved && p < kParameters; ++p)
      variance_[p] += std::pow(moved->change[p] - of_.change[p], 2);
  }
  void apply() {
    for (size_t p = 0; p < kParameters; ++p)
      for (Logs* of : {&of_.chance, &of_.variance}) (*of)[p] += variance_[p];
  }

 private:
  const Model& model_;
  const Pair& pair_;
  Difference& of_;
  Logs variance_{};
};

void add_errors(const Model& model, const Pair& pair, const ErrorSources& sources, Difference& of) {
  Errors errors(model, pair, of);
  for (const auto& [input, share] : {std::pair{Input::Modulus, sources.young},
                                     {Input::Thickness, sources.thickness},
                                     {Input::Pitch, sources.pitch}})
    if (share > 0)
      errors.add([input = input, share = share](Pair& p) {
        for (Observation* day : {&p.first, &p.second})
          *day = with_input(std::move(*day), input, 1 + share / kNormal90);
      });
  if (sources.light)
    for (Observation Pair::*day : {&Pair::first, &Pair::second})
      if ((pair.*day).uneven_sd > 0)
        errors.add([&](Pair& p) { p.*day = with_uneven_light(std::move(p.*day), (p.*day).uneven_sd); });
  // Where both windows lie together.
  const double of_first = std::pow(pair.first.place_sd_mm, 2),
               of_second = std::pow(pair.second.place_sd_mm, 2);
  if (sources.place && of_first + of_second > 0)
    for (const size_t axis : {size_t{0}, size_t{1}})
      errors.add([&](Pair& p) {
        const double far_mm = std::sqrt(of_first * of_second / (of_first + of_second));
        p.first.window_mm[axis] += far_mm;
        p.second.window_mm[axis] += far_mm;
      });
  errors.apply();
}

/// Whether a day's numbers may be followed. A lump outside of the training's ranges changes as others do.
bool followed(const Estimate& e) {
  return reports_numbers(e.verdict) || (e.verdict == Status::OutsideTraining && e.detection_statistic >= 1);
}

/// One block has one modulus: what two days were told differently, within the error that is stated of it, is
/// taken as the mean of both. False where they differ by more.
bool one_modulus(const ErrorSources& sources, Observation& first, Observation& second) {
  if (sources.young == 0 || first.young_Pa <= 0 || second.young_Pa <= 0) return true;
  if (std::abs(std::log(second.young_Pa / first.young_Pa)) > 2 * std::log1p(sources.young)) return false;
  first.young_Pa = second.young_Pa = std::sqrt(first.young_Pa * second.young_Pa);
  return true;
}

void fill(const Difference& d, LumpChange& change) {
  const auto value = [&](size_t p, const auto& of) {
    const double half = kNormal90 * std::sqrt(d.variance[p]);
    return Value{of(d.change[p]), of(d.change[p] - half), of(d.change[p] + half)};
  };
  const auto told = [&](size_t p, const Logs& variance) {
    return std::abs(d.change[p]) > kTold * std::sqrt(variance[p]);
  };
  const double size = std::exp(d.first[kSize]), depth = std::exp(d.first[kDepth]);
  change.size_mm = value(kSize, [&](double log) { return size * std::expm1(log); });
  change.depth_mm = value(kDepth, [&](double log) { return depth * std::expm1(log); });
  for (const Parameter p : {kSize, kDepth, kRatio})
    change.factor[p] = value(p, [](double log) { return std::exp(log); });
  change.ratio_changed = told(kRatio, d.variance);
  change.least_mm = size * std::expm1((kTold + kNineInTen) * std::sqrt(d.chance[kSize]));
  change.verdict = !told(kSize, d.chance) ? ChangeVerdict::NoChange
                   : d.change[kSize] > 0  ? ChangeVerdict::Grown
                                          : ChangeVerdict::Shrunk;
}

/// The verdict of two days of which one has no lump whose change could be measured.
void without_numbers(const Estimate& first, const Estimate& second, LumpChange& change) {
  const bool none_then = first.verdict == Status::NoLump, none_now = second.verdict == Status::NoLump;
  if (none_then && none_now) {
    change.verdict = ChangeVerdict::NoLump;
  } else if (none_then && followed(second)) {
    change.verdict = ChangeVerdict::Appeared;
  } else if (followed(first) && none_now) {
    change.verdict = ChangeVerdict::Gone;
  }
  if (change.verdict != ChangeVerdict::NotComparable) {
    for (const auto& [name, e] : {std::pair{"first", &first}, {"second", &second}})
      if (const std::string limit = sentence_of(e->detection_limits); !limit.empty())
        change.reasons.push_back(std::string("on the ") + name + " day " + limit);
  } else {
    for (const auto& [name, e] : {std::pair{"first", &first}, {"second", &second}})
      if (!followed(*e) && e->verdict != Status::NoLump) {
        change.reasons.push_back(std::string("the ") + name + " day alone is: " + status_text(e->verdict));
        if (!e->reasons.empty()) change.reasons.push_back(e->reasons.front());
      }
  }
}

}  // namespace

const char* to_string(ChangeVerdict verdict) {
  constexpr const char* kNames[] = {"no change", "grown",   "shrunk",        "appeared",
                                    "gone",      "no lump", "not comparable"};
  return kNames[static_cast<size_t>(verdict)];
}

LumpChange compare(const Network& network, const Day& first, const Day& second, const ErrorSources& sources) {
  LumpChange change;
  change.size_mm = change.depth_mm = {kNaN, kNaN, kNaN};
  change.factor.fill(change.size_mm);
  change.least_mm = kNaN;
  if (first.observation.skin || second.observation.skin) {
    change.reasons.emplace_back("a lump under a skin is estimated on each day, its change is not told");
    return change;
  }
  if (first.observation.plate || second.observation.plate) {
    change.reasons.emplace_back(
        "a lump under a plate that rubs or sticks is estimated on each day, its change is not told");
    return change;
  }
  if (!followed(first.estimate) || !followed(second.estimate)) {
    without_numbers(first.estimate, second.estimate, change);
    return change;
  }
  Observation of_first = first.observation, of_second = second.observation;
  if (!one_modulus(sources, of_first, of_second)) {
    change.reasons.push_back(text(
        "the tissue's modulus was told as %.4g and %.4g Pa, further apart than its stated error of %.2g %%: "
        "estimate both days with one modulus, or with --young-error 0 where the tissue has changed",
        of_first.young_Pa, of_second.young_Pa, 100 * sources.young));
    return change;
  }
  const double unlike = loads_of(of_second).back() / loads_of(of_first).back();
  if (std::max(unlike, 1 / unlike) > kUnlikeLoads) {
    change.reasons.push_back(
        text("the highest load is %.3g times the first day's, at most %.2g can be compared: press as hard",
             unlike, kUnlikeLoads));
    return change;
  }
  const Model& model = network.model();
  if (unlike > 1)
    of_second = at_loads(of_second, loads_of(of_first));
  else
    of_first = at_loads(of_first, loads_of(of_second));
  const auto pair = one_place(model, of_first, of_second);
  auto difference = pair ? difference_of(model, *pair) : std::nullopt;
  if (!difference) {
    change.reasons.emplace_back("too little of the lump is seen where both windows are put");
    return change;
  }
  change.moved_mm = pair->moved_mm;
  const double moved = std::hypot(pair->moved_mm[0], pair->moved_mm[1]);
  const double places_sd = std::hypot(first.observation.place_sd_mm, second.observation.place_sd_mm);
  if (moved > kElsewhere * std::max(places_sd, kPlaceSd_mm)) {
    change.reasons.push_back(text(
        "the lump lies %.3g mm from where the first day has it, places are known to %.2g mm: another lump, "
        "or the place or turn of the window is another one than told",
        moved, places_sd));
    if (pair->turned_mm < kTurnedCloser * moved)
      change.reasons.push_back(
          text("turned by 180 degrees the second day's lump would lie %.2g mm from there: was the pad or the "
               "block turned?",
               pair->turned_mm));
    return change;
  }
  add_errors(model, *pair, sources, *difference);
  fill(*difference, change);
  if (pair->another_pad)
    change.reasons.emplace_back(
        "pitch or noise of the two days differ: they count as two pads, whose own patterns do not cancel");
  if (std::max(unlike, 1 / unlike) > kJudgedLoads)
    change.reasons.push_back(text("loads differ by %.2g %%: intervals have been judged up to %.2g %%",
                                  100 * std::abs(unlike - 1), 100 * (kJudgedLoads - 1)));
  for (const auto& [name, day] : {std::pair{"first", &first}, {"second", &second}})
    if (day->estimate.verdict == Status::OutsideTraining)
      change.reasons.push_back(
          std::string("the ") + name +
          " day alone is outside of what the model was made for; its change is followed all the same");
  return change;
}

std::string sentence_of(const LumpChange& c) {
  const auto by = [&](const char* what, double sign) {
    const Value& v = c.size_mm;
    const double low = sign > 0 ? v.low : -v.high, high = sign > 0 ? v.high : -v.low;
    return text("has %s by %.2g mm (%.2g to %.2g), %.2g %% of its diameter", what, sign * v.value, low, high,
                100 * sign * (c.factor[kSize].value - 1));
  };
  switch (c.verdict) {
    case ChangeVerdict::Grown:
      return by("grown", 1);
    case ChangeVerdict::Shrunk:
      return by("shrunk", -1);
    case ChangeVerdict::NoChange:
      return text("no change of the size (%+.2g mm, %.2g to %.2g); growth of %.2g mm would be seen",
                  c.size_mm.value, c.size_mm.low, c.size_mm.high, c.least_mm);
    case ChangeVerdict::Appeared:
      return "a lump where none was seen";
    case ChangeVerdict::Gone:
      return "none is seen where a lump was";
    case ChangeVerdict::NoLump:
      return "no lump on either day";
    case ChangeVerdict::NotComparable:
      break;
  }
  return "cannot be compared" + (c.reasons.empty() ? std::string() : ": " + c.reasons.front());
}

}  // namespace palpate::lump
