#include "engine/lump/network/consistency.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <optional>

#include "engine/base/statistics.h"
#include "engine/base/text.h"
#include "engine/lump/network/block_hypotheses.h"
#include "engine/lump/network/slide.h"

namespace palpate::lump {
namespace {

// Mean pressure over force and area of a window in the block: lumps and windows make 0.7 to 1.6 of it.
constexpr std::array<double, 2> kBalance = {0.4, 3};
constexpr std::array<double, 2> kUnitFits = {0.75, 1.6};
constexpr double kMostLoad = 1.2;  // force over area and modulus that no press of the model comes near
constexpr double kGauge = 0.01;    // standard deviation of a force that is still called honest
constexpr double kMostSum = 1.06;
constexpr double kRimPressure = 0.3;  // of the mean: a row beside the block that carries as much
constexpr double kNoPressure = 0.25;  // of the mean: a row on the block that carries no more
constexpr double kOneForce = 0.05;    // of a load, against what the others say
constexpr double kSlide_mm = 1;
constexpr double kPitch = 0.12, kShift_mm = 1.7, kTilt = 0.08;
constexpr double kRival = 1.4;  // a thickness leaves so many times the chi-square that a pitch does
constexpr double kPitchLeaves =
    0.55;  // of the chi-square, at most; large stiff lumps with right inputs: 0.59 and more
constexpr double kEvidence = 40;  // fall of chi-square, in units of what is left per node
constexpr double kFits = 1.7;     // chi-square per node of a block that is explained

/// Sums over what one load's map shows of the block.
struct MapSums {
  double mean_Pa = 0;  ///< of the nodes that are stated to lie on the block
  double force_N = 0;  ///< of all nodes
  double nodes = 0;    ///< that were seen
};

std::array<double, 2> place_of(const Observation& observation, const PressureMap& map, uint32_t x,
                               uint32_t y) {
  return {observation.window_mm[0] + (x - (map.width - 1) / 2.0) * map.pitch_mm[0],
          observation.window_mm[1] + (y - (map.height - 1) / 2.0) * map.pitch_mm[1]};
}

MapSums sums_of(const Observation& observation, const PressureMap& map) {
  MapSums sums;
  double on_block = 0;
  for (uint32_t y = 0; y < map.height; ++y)
    for (uint32_t x = 0; x < map.width; ++x) {
      const auto value = double{map.at(x, y)};
      if (!std::isfinite(value)) continue;
      sums.force_N += 1e-6 * map.pitch_mm[0] * map.pitch_mm[1] * value;
      ++sums.nodes;
      const auto place = place_of(observation, map, x, y);
      if (std::abs(place[0]) > observation.block_mm[0] / 2 ||
          std::abs(place[1]) > observation.block_mm[1] / 2)
        continue;
      sums.mean_Pa += value;
      ++on_block;
    }
  sums.mean_Pa /= std::max(1.0, on_block);
  return sums;
}

struct Unit {
  const char* name;
  double factor;  ///< SI units in one
};
constexpr std::array kPressureUnits = {
    Unit{"kPa", 1e3},   Unit{"MPa (N/mm2)", 1e6}, Unit{"hPa (mbar)", 100}, Unit{"mmHg", 133.322},
    Unit{"N/cm2", 1e4}, Unit{"bar", 1e5},         Unit{"psi", 6894.76},    Unit{"gf/cm2", 98.0665}};
constexpr std::array kForceUnits = {Unit{"mN", 1e-3},     Unit{"gf", 9.80665e-3}, Unit{"cN", 1e-2},
                                    Unit{"kgf", 9.80665}, Unit{"lbf", 4.44822},   Unit{"kN", 1e3}};
constexpr std::array kModulusUnits = {Unit{"kPa", 1e3}, Unit{"MPa (N/mm2)", 1e6}};

bool within(double value, const std::array<double, 2>& range, double slack = 1) {
  return value >= range[0] / slack && value <= range[1] * slack;
}

/// Everything that one look at an observation finds.
class ConsistencyCheck {
 public:
  ConsistencyCheck(const Model& model, const Observation& observation, const PressedNodes* nodes)
      : model_(model), observation_(observation), nodes_(nodes) {
    const double area_m2 = 1e-6 * observation.block_mm[0] * observation.block_mm[1];
    for (size_t k = 0; k < observation.force_N.size(); ++k) {
      sums_.push_back(sums_of(observation, observation.pressure_Pa[k]));
      balance_.push_back(sums_.back().mean_Pa * area_m2 / observation.force_N[k]);
      load_.push_back(observation.force_N[k] / (area_m2 * observation.young_Pa));
    }
  }

  std::vector<Contradiction> all(bool surroundings) {
    // A load of which nothing was seen contradicts nothing; the estimate says that it was not seen.
    for (const MapSums& sums : sums_)
      if (sums.nodes < 1) return {};
    // The rest contradicts the block anyway where a unit or the order is wrong.
    if (units() || order()) return std::move(found_);
    if (nodes_ != nullptr && surroundings) {
      slide();
      block();
    }
    if (found_.empty()) sum();
    if (found_.empty()) rim();
    return std::move(found_);
  }

 private:
  void add(Fault fault, double value, double sd, std::string reason) {
    found_.push_back({fault, value, sd, std::move(reason)});
  }
  bool units();
  bool modulus_unit();
  bool order();
  bool one_force(const std::vector<double>& gain, const std::vector<double>& sd);
  void sum();
  void rim();
  void slide();
  void block();
  bool fits(double chi_square, const BlockHypotheses& hypotheses) const;
  void add_pitch(const ChangeFit& fit);
  void add_window(const ChangeFit& fit, double distance_mm);

  const Model& model_;
  const Observation& observation_;
  const PressedNodes* nodes_;
  std::vector<MapSums> sums_;
  std::vector<double> balance_, load_;
  std::vector<Contradiction> found_;
};

bool ConsistencyCheck::units() {
  const double balance = median(balance_), load = load_.back();
  if (within(balance, kBalance)) return modulus_unit();
  // The balance alone does not separate a small pressure from a large force; the load does.
  std::vector<std::string> fitting;
  for (const bool plausible : {true, false}) {
    if (!fitting.empty()) break;
    for (const Unit& unit : kPressureUnits)
      if (within(balance * unit.factor, kUnitFits) && within(load, model_.load, 1.5) == plausible)
        fitting.push_back(std::string("pressures in ") + unit.name);
    for (const Unit& unit : kForceUnits)
      if (within(balance / unit.factor, kUnitFits) &&
          within(load * unit.factor, model_.load, 1.5) == plausible)
        fitting.push_back(std::string("forces in ") + unit.name);
  }
  std::string causes;
  for (const std::string& one : fitting) causes += (causes.empty() ? "" : " or ") + one;
  add(Fault::Unit, balance, balance * kGauge,
      text(
          "the maps' mean pressure is %.3g times the force over the block's area, and should be about that: ",
          balance) +
          (causes.empty() ? "pressures, forces or the block's size are wrong" : causes + " would fit") +
          "; give Pa, N and mm");
  return true;
}

bool ConsistencyCheck::modulus_unit() {
  const double load = load_.back();
  if (load < kMostLoad) return false;
  for (const Unit& unit : kModulusUnits)
    if (within(load / unit.factor, model_.load, 1.5)) {
      add(Fault::Unit, load, load * kGauge,
          text("pressures and forces agree, but are %.3g times the tissue's modulus of %.4g Pa, which no "
               "block bears: a modulus in %s would fit; give Pa",
               load, observation_.young_Pa, unit.name));
      return true;
    }
  return false;
}

bool ConsistencyCheck::order() {
  const size_t loads = observation_.force_N.size();
  if (loads < 2) return false;
  std::vector<double> gain, sd;
  for (size_t k = 0; k < loads; ++k) {
    // Without the model's own block a block that spreads under load carries less per area.
    double expected = 1;
    if (nodes_ != nullptr && nodes_->loads.size() == loads)
      expected = (nodes_->total - nodes_->rest).col(static_cast<Eigen::Index>(k)).mean() /
                 nodes_->total.col(static_cast<Eigen::Index>(k)).mean() * balance_[k];
    gain.push_back(balance_[k] / std::max(1e-9, expected));
    const double mean_sd = observation_.noise_Pa / std::sqrt(std::max(1.0, sums_[k].nodes));
    sd.push_back(std::hypot(kGauge, mean_sd / std::max(1e-9, std::abs(sums_[k].mean_Pa))));
  }
  std::vector<size_t> by_pressure(loads);
  std::iota(by_pressure.begin(), by_pressure.end(), size_t{0});
  std::stable_sort(by_pressure.begin(), by_pressure.end(),
                   [&](size_t a, size_t b) { return sums_[a].mean_Pa < sums_[b].mean_Pa; });
  if (std::is_sorted(by_pressure.begin(), by_pressure.end())) return one_force(gain, sd);
  // Maps in the order of their forces whose pressures rise in another one: how far beyond noise?
  double worst = 0, worst_sd = 1;
  size_t at = 0;
  for (size_t k = 0; k + 1 < loads; ++k) {
    const double fall = std::log(gain[k] / std::max(1e-9, gain[k + 1]));
    if (fall > worst) {
      worst = fall;
      worst_sd = std::hypot(sd[k], sd[k + 1]);
      at = k;
    }
  }
  if (worst < kOneForce + 5 * worst_sd) return false;
  std::string forces;
  std::vector<double> sorted(loads);
  for (size_t rank = 0; rank < loads; ++rank) sorted[by_pressure[rank]] = observation_.force_N[rank];
  for (const double force : sorted) forces += (forces.empty() ? "" : ", ") + text("%.4g", force);
  add(Fault::Order, std::exp(worst), std::exp(worst) * worst_sd,
      text("the map at %.4g N shows less pressure than the one at %.4g N (%.3g and %.3g Pa in the mean): in "
           "the "
           "order of these maps forces of ",
           observation_.force_N[at + 1], observation_.force_N[at], sums_[at + 1].mean_Pa, sums_[at].mean_Pa) +
          forces + " N would fit; give each map its own force");
  return true;
}

bool ConsistencyCheck::one_force(const std::vector<double>& gain, const std::vector<double>& sd) {
  // A lump changes the share of the force that a window carries, evenly from load to load.
  const size_t loads = gain.size();
  if (nodes_ == nullptr || nodes_->loads.size() != loads) return false;
  size_t worst = 0;
  double off = 0, off_sd = 1, most = 0;
  for (size_t k = 0; k < loads; ++k) {
    const size_t before = k > 0       ? k - 1
                          : loads > 2 ? 2
                                      : 1,
                 after = k + 1 < loads ? k + 1
                         : loads > 2   ? loads - 3
                                       : 0;
    const double there = std::log(gain[k]) - 0.5 * (std::log(gain[before]) + std::log(gain[after]));
    const double there_sd = std::hypot(sd[k], 0.5 * std::hypot(sd[before], sd[after]));
    if (std::abs(there) / there_sd > most) {
      most = std::abs(there) / there_sd;
      off = there;
      off_sd = there_sd;
      worst = k;
    }
  }
  const double allowed = loads == 2 ? 1.5 * kOneForce : kOneForce;
  if (std::abs(off) < allowed + 4 * off_sd) return false;
  if (loads == 2) {
    add(Fault::OneForce, std::exp(off), std::exp(off) * off_sd,
        text("the two maps do not belong to their forces: pressure over force differs by %.2g %% (standard "
             "error "
             "%.2g %%); give forces of the same press",
             100 * std::abs(std::expm1(off)), 100 * off_sd));
    return true;
  }
  add(Fault::OneForce, std::exp(off), std::exp(off) * off_sd,
      text("the map at %.4g N carries %.2g %% %s than the other loads say (standard error %.2g %%): a force "
           "of "
           "%.3g N would fit; give the force of the same press, or leave this load out",
           observation_.force_N[worst], 100 * std::abs(std::expm1(off)), off > 0 ? "more" : "less",
           100 * off_sd, observation_.force_N[worst] * std::exp(off)));
  return true;
}

void ConsistencyCheck::sum() {
  size_t at = 0;
  double most = 0;
  for (size_t k = 0; k < sums_.size(); ++k) {
    const double carried = sums_[k].force_N / observation_.force_N[k];
    if (carried > most) {
      most = carried;
      at = k;
    }
  }
  const PressureMap& map = observation_.pressure_Pa[at];
  const double sd = std::hypot(kGauge, 1e-6 * map.pitch_mm[0] * map.pitch_mm[1] * observation_.noise_Pa *
                                           std::sqrt(sums_[at].nodes) / observation_.force_N[at]);
  if (most < kMostSum + 4 * sd) return;
  add(Fault::Sum, most, sd,
      text("the map at %.4g N carries %.3g N by itself, %.2g %% more than the force on the whole block "
           "(standard error %.2g %%): a smaller pitch than %.3g mm, smaller pressures or a larger force "
           "would fit",
           observation_.force_N[at], sums_[at].force_N, 100 * (most - 1), 100 * sd, map.pitch_mm[0]));
}

void ConsistencyCheck::rim() {
  // The lowest load spreads the block least; a row of nodes has little noise.
  const PressureMap& map = observation_.pressure_Pa.front();
  const double mean = sums_.front().mean_Pa, spread = 1 + 0.06 + 0.6 * std::min(1.0, load_.front());
  for (size_t axis = 0; axis < 2; ++axis) {
    const uint32_t rows = axis == 0 ? map.width : map.height, along = axis == 0 ? map.height : map.width;
    const double half = observation_.block_mm[axis] / 2;
    for (uint32_t row = 0; row < rows; ++row) {
      double sum = 0, count = 0, place = 0;
      for (uint32_t i = 0; i < along; ++i) {
        const uint32_t x = axis == 0 ? row : i, y = axis == 0 ? i : row;
        const auto at = place_of(observation_, map, x, y);
        place = at[axis];
        const auto value = double{map.at(x, y)};
        if (!std::isfinite(value) || std::abs(at[1 - axis]) > 0.8 * observation_.block_mm[1 - axis] / 2)
          continue;
        sum += value;
        ++count;
      }
      if (count < 5) continue;
      const double sd = observation_.noise_Pa / std::sqrt(count), share = sum / count / mean;
      const char* side = axis == 0 ? (place < 0 ? "left" : "right") : (place < 0 ? "upper" : "lower");
      if (std::abs(place) > half * spread && share > kRimPressure + 5 * sd / mean) {
        add(Fault::Rim, std::abs(place) - half, map.pitch_mm[axis] / 2,
            text("there is pressure %.3g mm beside the block's %s rim, %.2g %% of the mean: a smaller pitch, "
                 "another window or a larger block would fit",
                 std::abs(place) - half, side, 100 * share));
        return;
      }
      if (std::abs(place) < half - map.pitch_mm[axis] && share < kNoPressure - 5 * sd / mean) {
        add(Fault::Rim, std::abs(place) - half, map.pitch_mm[axis] / 2,
            text("there is no pressure on the block %.3g mm from its %s rim: a larger pitch, another window "
                 "or a "
                 "smaller block would fit",
                 half - std::abs(place), side));
        return;
      }
    }
  }
}

void ConsistencyCheck::slide() {
  const auto moved = find_slide(model_, *nodes_);
  if (!moved || moved->distance_mm < kSlide_mm + 5 * moved->sd_mm) return;
  add(Fault::Slide, moved->distance_mm, moved->sd_mm,
      text("the map at %.4g N lies %.2g mm (%.2g, %.2g mm; standard error %.2g mm) beside that of the other "
           "loads: the press slid, or the maps are of other places; press again, or leave this load out",
           nodes_->loads[moved->load] * 1e-6 * observation_.block_mm[0] * observation_.block_mm[1] *
               observation_.young_Pa,
           moved->distance_mm, moved->shift_mm[0], moved->shift_mm[1], moved->sd_mm));
}

bool ConsistencyCheck::fits(double chi_square, const BlockHypotheses& hypotheses) const {
  const double left = std::max(1.0, chi_square / hypotheses.nodes());
  return chi_square / hypotheses.nodes() < kFits && (hypotheses.chi_square() - chi_square) / left > kEvidence;
}

void ConsistencyCheck::block() {
  const BlockHypotheses hypotheses(model_, *nodes_, observation_.uneven_sd);
  if (hypotheses.chi_square() < kEvidence) return;
  const ChangeFit pitch = hypotheses.best_pitch(), shift = hypotheses.best_shift();
  const LinearFit tilt = hypotheses.tilt();
  if (pitch.chi_square < std::min(shift.chi_square, tilt.chi_square)) {
    // A pitch stated too large puts pressure outside the block, see rim(); large stiff lumps look like it
    // else. Stiff lumps near the surface change what is around them as a thickness does, and a pitch a
    // little.
    const double rival = hypotheses.best_thickness().chi_square;
    if (fits(pitch.chi_square, hypotheses) && pitch.change.pitch > kPitch + 4 * pitch.sd &&
        pitch.chi_square < kPitchLeaves * hypotheses.chi_square() && kRival * pitch.chi_square < rival)
      add_pitch(pitch);
    return;
  }
  const double distance = std::hypot(shift.change.shift_mm[0], shift.change.shift_mm[1]);
  const double unsure = observation_.place_sd_mm > kPlaceSd_mm ? observation_.place_sd_mm : 0;
  const double slope = std::hypot(tilt.value(0), tilt.value(1)), slope_sd = tilt.sd.maxCoeff();
  if (shift.chi_square <= tilt.chi_square && fits(shift.chi_square, hypotheses) &&
      distance > kShift_mm + 3 * std::hypot(shift.sd, unsure))
    add_window(shift, distance);
  else if (tilt.chi_square < shift.chi_square && fits(tilt.chi_square, hypotheses) &&
           slope > kTilt + 3 * slope_sd)
    add(Fault::Tilt, slope, slope_sd,
        text("the pressure rises by %.2g %% (standard error %.2g %%) from the block's middle to one rim: the "
             "plate is "
             "tilted, the light is uneven or the window lies elsewhere; level the plate, take a new "
             "background, or "
             "state the window's place",
             100 * slope, 100 * slope_sd));
}

void ConsistencyCheck::add_pitch(const ChangeFit& fit) {
  const double told_mm = observation_.pressure_Pa.front().pitch_mm[0];
  add(Fault::Pitch, fit.change.pitch, fit.sd,
      text("the pressure falls towards the rim as in maps with a pitch of %.3g mm (standard error %.2g mm), "
           "not of "
           "%.3g mm: check the pitch, and that the maps show as much of the block as stated",
           told_mm * (1 + fit.change.pitch), told_mm * fit.sd, told_mm));
}

void ConsistencyCheck::add_window(const ChangeFit& fit, double distance_mm) {
  const auto& told = observation_.window_mm;
  add(Fault::Window, distance_mm, fit.sd,
      text(
          "the pressure falls towards the rim as around a window at %.2g, %.2g mm from the block's middle "
          "(standard error %.2g mm), not at %.3g, %.3g mm: state the window's place, or centre the block and "
          "level the "
          "plate",
          told[0] + fit.change.shift_mm[0], told[1] + fit.change.shift_mm[1], fit.sd, told[0], told[1]));
}

}  // namespace

const char* to_string(Fault fault) {
  constexpr std::array kNames = {"unit",  "sum",   "rim",    "order", "one force",
                                 "slide", "pitch", "window", "tilt"};
  return kNames[static_cast<size_t>(fault)];
}

std::vector<Contradiction> find_contradictions(const Model& model, const Observation& observation,
                                               const PressedNodes* nodes) {
  return ConsistencyCheck(model, observation, nodes).all(true);
}

void report_contradictions(const Model& model, const Observation& observation, const PressedNodes* nodes,
                           Estimate& estimate) {
  const bool one = estimate.verdict != Status::SeveralLumps;
  const std::vector<Contradiction> found = ConsistencyCheck(model, observation, nodes).all(one);
  if (found.empty()) return;
  estimate.verdict = Status::Inconsistent;
  for (size_t i = 0; i < found.size(); ++i)
    estimate.reasons.insert(estimate.reasons.begin() + static_cast<std::ptrdiff_t>(i), found[i].reason);
}

}  // namespace palpate::lump
