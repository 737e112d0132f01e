#include "engine/lump/observation/scan_stitch.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "engine/base/numbers.h"
#include "engine/base/statistics.h"
#include "engine/base/text.h"
#include "engine/lump/observation/placed_press.h"
#include "engine/numeric/dense.h"
#include "palpate/error.h"

namespace palpate::lump {
namespace {

constexpr double kReach = 1.1;          // no extrapolation farther beyond a press's highest force
constexpr double kWorstDeviation = 4;   // of a press that saw the same as the others
constexpr double kWholeBlock = 0.99;    // of its places seen, all but the rim
constexpr double kLeastFeather = 0.05;  // of the weight on a window's very edge

void refuse(const std::string& name, const std::string& wanted, const std::string& found) {
  throw Error(Failure::Input, wanted + " in press '" + name + "'", found,
              "the press again, or leaving it out");
}

void check(const std::vector<ScanPress>& presses) {
  if (presses.empty()) throw Error(Failure::Input, "presses to stitch", "none", "one or more");
  const Observation& first = presses[0].observation;
  for (const ScanPress& p : presses) {
    const Observation& r = p.observation;
    if (r.block_mm != first.block_mm || r.young_Pa != first.young_Pa)
      refuse(p.name, "the block of the first press", "another block");
    if (r.pressure_Pa.empty() || r.pressure_Pa.size() != r.force_N.size())
      refuse(p.name, "a map for each force",
             std::to_string(r.pressure_Pa.size()) + " maps, " + std::to_string(r.force_N.size()) + " forces");
    if (r.force_N.size() != first.force_N.size())
      refuse(p.name, std::to_string(first.force_N.size()) + " loads, as in the first press",
             std::to_string(r.force_N.size()));
    for (size_t k = 0; k < r.force_N.size(); ++k)
      if (!(r.force_N[k] > (k > 0 ? r.force_N[k - 1] : 0)))
        refuse(p.name, "forces that rise", text("%g N", r.force_N[k]));
    for (const PressureMap& map : r.pressure_Pa)
      if (map.width < 4 || map.height < 4 || map.values.size() != size_t{map.width} * map.height ||
          !(map.pitch_mm[0] > 0) || !(map.pitch_mm[1] > 0) || map.width != r.pressure_Pa[0].width ||
          map.height != r.pressure_Pa[0].height)
        refuse(p.name, "maps of one size of at least 4 x 4 nodes",
               std::to_string(map.width) + " x " + std::to_string(map.height));
    if (!(r.noise_Pa >= 0)) refuse(p.name, "a noise of 0 or more", text("%g Pa", r.noise_Pa));
  }
}

/// Nodes of the block.
struct Grid {
  uint32_t width, height;
  double pitch_mm;
  double x(uint32_t i) const { return (i - (width - 1) / 2.0) * pitch_mm; }
  double y(uint32_t j) const { return (j - (height - 1) / 2.0) * pitch_mm; }
};

/// Refines places and scales; `covariance` of them in the end, by the presses' noise and the priors.
class Registration {
 public:
  Registration(std::vector<Placed>& presses, const Grid& grid, const StitchOptions& options)
      : presses_(presses), grid_(grid), options_(options), each_(options.tilt_sd_per_mm > 0 ? 5 : 3) {}

  void run() {
    for (int round = 0; round < 12; ++round) {
      assemble();
      const Eigen::VectorXd step = dense::Ldlt(normal_).solve(right_);
      if (!step.allFinite()) break;
      double largest = 0;
      for (size_t p = 0; p < presses_.size(); ++p) {
        Eigen::VectorXd s = step.segment(at(p), each_);
        const double length = s.head<2>().norm();
        if (length > grid_.pitch_mm) s *= grid_.pitch_mm / length;
        presses_[p].place.head(each_) += s;
        largest = std::max(largest, s.cwiseAbs().maxCoeff());
      }
      if (largest < 1e-4) break;
    }
    assemble();
    covariance = dense::inverse(normal_);
  }
  Eigen::MatrixXd covariance;

  /// Where a press's unknowns begin.
  Eigen::Index at(size_t press) const { return each_ * static_cast<Eigen::Index>(press); }

 private:
  void assemble() {
    const auto unknowns = at(presses_.size());
    normal_ = Eigen::MatrixXd::Zero(unknowns, unknowns);
    right_ = Eigen::VectorXd::Zero(unknowns);
    std::vector<double> squares(presses_.size(), 0), counts(presses_.size(), 0);
    for (uint32_t j = 0; j < grid_.height; ++j)
      for (uint32_t i = 0; i < grid_.width; ++i) add_node(grid_.x(i), grid_.y(j), squares, counts);
    for (size_t p = 0; p < presses_.size(); ++p) {
      Placed& press = presses_[p];
      press.deviation = counts[p] > 0 ? std::sqrt(squares[p] / counts[p]) : 0;
      for (Eigen::Index c = 0; c < each_; ++c) add_prior(press, at(p) + c, c);
    }
  }

  void add_prior(const Placed& press, Eigen::Index row, Eigen::Index c) {
    constexpr double kHeld_mm = 1e-5;
    const double stage = options_.held_sd_mm.empty() ? options_.stage_sd_mm : kHeld_mm;
    const double sd = c < 2 ? stage : c == 2 ? options_.gain_sd : options_.tilt_sd_per_mm;
    const double far = press.place(c) - (c < 3 ? 0 : options_.tilt_per_mm[static_cast<size_t>(c - 3)]);
    // Cauchy: what lies far off is believed to be wrong, not everything else by a little. Tilts of all
    // presses at once would run away with that.
    const double off = each_ > 3 ? 0 : far / (2 * sd), weight = 1 / (sd * sd * (1 + off * off));
    normal_(row, row) += weight;
    right_(row) -= weight * far;
  }

  /// The place's true value is taken out: presses are held against their weighted mean. How that changes is
  /// taken from the mean as well: from a press's own noise it would favour scales that make all of it small.
  /// Between nodes noise is less than at them, which draws presses there: what a value's noise has in common
  /// with the slope's is taken out.
  void add_node(double x, double y, std::vector<double>& squares, std::vector<double>& counts) {
    // Slopes over less than that are mostly noise. Where places are held nothing moves along them, and a
    // short step costs no nodes beside those that were not seen.
    const double step_mm = options_.held_sd_mm.empty() ? grid_.pitch_mm : 0.1;
    struct Seen {
      size_t press;
      double value, weight;
      Eigen::Vector2d with_slopes;
    };
    std::vector<Seen> seen;
    for (size_t k = 0; k < presses_[0].maps.size(); ++k) {
      seen.clear();
      double weights = 0;
      Eigen::Vector3d mean = Eigen::Vector3d::Zero();  // slopes along x and y, value
      for (size_t p = 0; p < presses_.size(); ++p) {
        const Placed& press = presses_[p];
        // The outermost cells' interpolation has half its neighbours.
        if (!press.used || press.edge_mm(x, y) < press.maps[0].pitch_mm[0]) continue;
        const double v = press.at(k, x, y);
        const double dx = (press.at(k, x + step_mm, y) - press.at(k, x - step_mm, y)) / (2 * step_mm);
        const double dy = (press.at(k, x, y + step_mm) - press.at(k, x, y - step_mm)) / (2 * step_mm);
        if (!std::isfinite(v + dx + dy)) continue;
        seen.push_back({p, v, press.trust(), press.with_slopes(x, y, step_mm)});
        mean += press.trust() * Eigen::Vector3d(dx, dy, v);
        weights += press.trust();
      }
      if (seen.size() < 2) continue;
      mean /= weights;
      Eigen::Vector2d of_mean = Eigen::Vector2d::Zero();
      for (const Seen& a : seen) of_mean += std::pow(a.weight / weights, 2) * a.with_slopes;
      PlaceVector rows;
      const double rise = presses_[seen[0].press].rise[k];
      rows << mean, mean(2) * rise * x, mean(2) * rise * y;
      const Eigen::VectorXd row = rows.head(each_);
      const Eigen::MatrixXd square = row * row.transpose();
      for (const Seen& a : seen) {
        const double off = a.value - mean(2);
        squares[a.press] += a.weight * off * off;
        counts[a.press] += 1 - a.weight / weights;
        right_.segment(at(a.press), each_) += a.weight * off * row;
        right_.segment<2>(at(a.press)) -= a.weight * (a.weight / weights * a.with_slopes - of_mean);
        for (const Seen& b : seen) {
          const double fraction = (a.press == b.press ? a.weight : 0) - a.weight * b.weight / weights;
          normal_.block(at(a.press), at(b.press), each_, each_) += fraction * square;
        }
      }
    }
  }

  std::vector<Placed>& presses_;
  const Grid& grid_;
  const StitchOptions& options_;
  Eigen::Index each_;  // unknowns of a press
  Eigen::MatrixXd normal_;
  Eigen::VectorXd right_;
};

PressureMap empty_map(const Grid& grid, float value) {
  return {grid.width,
          grid.height,
          {grid.pitch_mm, grid.pitch_mm},
          std::vector<float>(size_t{grid.width} * grid.height, value)};
}

/// Results of the blending other than the maps.
struct Blend {
  double variance = 0;                         // of a blended value by the presses' noise, summed
  double between = 0, freedom = 0, noise = 0;  // squares between presses; their number; what noise makes
  size_t seen = 0, inner = 0, inner_seen = 0;  // of places off the rim
  size_t covered = 0, lost = 0;                // lost: covered by a window and not seen, off the rim
};

Blend blend(const std::vector<Placed>& presses, const Grid& grid, const StitchOptions& options,
            ScanMap& out) {
  Blend b;
  const size_t loads = presses[0].maps.size();
  const auto nothing = static_cast<float>(kNaN);
  out.observation.pressure_Pa.assign(loads, empty_map(grid, nothing));
  out.disagreement_Pa = empty_map(grid, nothing);
  out.presses = empty_map(grid, 0);
  // A place on the rim has no whole cell around it: a sensor's value there belongs to another place.
  for (uint32_t j = 1; j + 1 < grid.height; ++j)
    for (uint32_t i = 1; i + 1 < grid.width; ++i) {
      const size_t node = size_t{j} * grid.width + i;
      const double x = grid.x(i), y = grid.y(j);
      bool inside = false;
      for (size_t k = 0; k < loads; ++k) {
        double sum = 0, weights = 0, variance = 0, plain = 0, squares = 0, noise = 0;
        int count = 0;
        for (const Placed& p : presses) {
          if (!p.used) continue;
          const double edge = p.edge_mm(x, y);
          inside = inside || edge >= 0;
          const double v = p.near(k, x, y);
          if (!std::isfinite(v)) continue;
          const double w = p.weight() * std::clamp(edge / options.feather_mm, kLeastFeather, 1.0);
          sum += w * v;
          weights += w;
          variance += w * w / p.weight();
          plain += v;
          squares += v * v;
          noise += 1 / p.weight();
          ++count;
        }
        if (count == 0) continue;
        out.observation.pressure_Pa[k].values[node] = static_cast<float>(sum / weights);
        if (k + 1 < loads) continue;
        ++b.seen;
        b.variance += variance / (weights * weights);
        out.presses.values[node] = static_cast<float>(count);
        if (count < 2) continue;
        const double spread = std::max(0.0, squares - plain * plain / count);
        b.between += spread;
        b.freedom += count - 1;
        b.noise += noise / count * (count - 1);
        out.disagreement_Pa.values[node] = static_cast<float>(std::sqrt(spread / (count - 1)));
      }
      const bool seen = std::isfinite(out.observation.pressure_Pa.back().values[node]);
      ++b.inner;
      b.inner_seen += seen;
      b.covered += inside;
      b.lost += inside && !seen;
    }
  return b;
}

// Median forces of each load.
std::vector<double> common_forces(const std::vector<ScanPress>& presses) {
  std::vector<double> common;
  for (size_t k = 0; k < presses[0].observation.force_N.size(); ++k) {
    std::vector<double> forces;
    forces.reserve(presses.size());
    for (const ScanPress& p : presses) forces.push_back(p.observation.force_N[k]);
    common.push_back(median(forces));
  }
  return common;
}

Grid grid_of(const std::vector<ScanPress>& presses, const StitchOptions& options) {
  const Observation& first = presses[0].observation;
  std::vector<double> pitches;
  pitches.reserve(presses.size());
  for (const ScanPress& p : presses) pitches.push_back(p.observation.pressure_Pa[0].pitch_mm[0]);
  const double pitch_mm = options.pitch_mm > 0 ? options.pitch_mm : median(pitches);
  return {2 * static_cast<uint32_t>(std::floor(first.block_mm[0] / (2 * pitch_mm) + 1e-9)) + 1,
          2 * static_cast<uint32_t>(std::floor(first.block_mm[1] / (2 * pitch_mm) + 1e-9)) + 1, pitch_mm};
}

// The presses at the scan's forces; names and reasons of those that do not reach them go to the scan's
// places.
std::vector<Placed> place_presses(const std::vector<ScanPress>& presses, const StitchOptions& options,
                                  ScanMap& out) {
  std::vector<double> noises;
  for (const ScanPress& p : presses)
    if (p.observation.noise_Pa > 0) noises.push_back(p.observation.noise_Pa);
  std::vector<Placed> placed;
  for (const ScanPress& p : presses) {
    PressPlace place;
    place.name = p.name;
    place.stage_mm = p.observation.window_mm;
    place.used = kReach * p.observation.force_N.back() >= out.observation.force_N.back();
    if (!place.used)
      place.reason = text("it reached %.3g N, the scan %.3g N", p.observation.force_N.back(),
                          out.observation.force_N.back());
    Placed one{p.observation.pressure_Pa, p.observation.window_mm, p.turn_rad,
               p.observation.noise_Pa > 0 ? p.observation.noise_Pa
               : noises.empty()           ? 1
                                          : median(noises)};
    one.used = place.used;
    const double area_m2 = 1e-6 * p.observation.block_mm[0] * p.observation.block_mm[1];
    one.unlike_Pa = options.unlike_sd * out.observation.force_N.back() / area_m2;
    if (options.tilt_sd_per_mm > 0) one.place.tail<2>() << options.tilt_per_mm[0], options.tilt_per_mm[1];
    if (one.used) one.read(p.observation, out.observation.force_N);
    placed.push_back(std::move(one));
    out.places.push_back(std::move(place));
  }
  return placed;
}

// One that saw something else spoils the others' mean as well: the worst goes first.
void leave_out_strangers(std::vector<Placed>& placed, Registration& registration, ScanMap& out) {
  for (size_t left_out = 0; left_out < placed.size() / 3; ++left_out) {
    size_t worst = 0;
    std::vector<double> deviations;
    for (size_t p = 0; p < placed.size(); ++p) {
      if (placed[p].used && placed[p].deviation > 0) deviations.push_back(placed[p].deviation);
      if (placed[p].used && placed[p].deviation > placed[worst].deviation) worst = p;
    }
    if (deviations.size() < 3 ||
        placed[worst].deviation < kWorstDeviation * std::max(1.0, median(deviations)))
      break;
    placed[worst].used = false;
    out.places[worst].used = false;
    out.places[worst].reason =
        text("it is unlike what the others saw of the same places (%.1f times the noise)",
             placed[worst].deviation);
    for (Placed& p : placed) p.place.head<3>().setZero();
    registration.run();
  }
}

// Noise, what was seen and what was saturated.
void judge(const Blend& b, const std::vector<ScanPress>& presses, ScanMap& out) {
  if (b.seen > 0) {
    const double worse = b.noise > 0 ? std::max(1.0, std::sqrt(b.between / b.noise)) : 1;
    out.observation.noise_Pa = worse * std::sqrt(b.variance / static_cast<double>(b.seen));
    if (b.freedom > 0) out.between_presses_Pa = std::sqrt(b.between / b.freedom);
  }
  out.seen_fraction = static_cast<double>(b.inner_seen) / static_cast<double>(std::max<size_t>(1, b.inner));
  const bool saturated = std::any_of(presses.begin(), presses.end(),
                                     [](const ScanPress& p) { return p.observation.saturated_fraction > 0; });
  if (saturated && b.covered > 0)
    out.observation.saturated_fraction = static_cast<double>(b.lost) / static_cast<double>(b.covered);
}

// Where a press came to lie, with its standard errors.
void fill_place(const Placed& placed, const Eigen::MatrixXd& covariance, Eigen::Index at, bool tilted,
                PressPlace& place) {
  for (int c = 0; c < 2; ++c) {
    place.shift_mm[static_cast<size_t>(c)] = placed.place(c);
    place.shift_sd_mm[static_cast<size_t>(c)] = std::sqrt(covariance(at + c, at + c));
  }
  place.gain = std::exp(placed.place(2));
  place.gain_sd = place.gain * std::sqrt(covariance(at + 2, at + 2));
  for (int c = 0; c < 2 && tilted; ++c) {
    place.tilt_per_mm[static_cast<size_t>(c)] = placed.place(3 + c);
    place.tilt_sd_per_mm[static_cast<size_t>(c)] = std::sqrt(covariance(at + 3 + c, at + 3 + c));
  }
  place.deviation = placed.deviation;
}

void warn_of(const PressPlace& place, double log_gain, double saturated_fraction,
             const StitchOptions& options, std::vector<std::string>& warnings) {
  const double shift = std::hypot(place.shift_mm[0], place.shift_mm[1]);
  if (options.held_sd_mm.empty() && shift > 3 * options.stage_sd_mm)
    warnings.push_back("press '" + place.name + "' lies " +
                       text("%.2f mm from where it was said to be", shift));
  if (std::abs(log_gain) > 3 * options.gain_sd)
    warnings.push_back("press '" + place.name + "' reads " +
                       text("%+.1f %% off the others", 100 * (place.gain - 1)));
  if (saturated_fraction > 0)
    warnings.push_back("press '" + place.name + "' was saturated in " +
                       text("%.2g %% of its window", 100 * saturated_fraction));
}

}  // namespace

ScanMap stitch(const std::vector<ScanPress>& presses, const StitchOptions& options) {
  check(presses);
  ScanMap out;
  out.observation.block_mm = presses[0].observation.block_mm;
  out.observation.young_Pa = presses[0].observation.young_Pa;
  out.observation.skin = presses[0].observation.skin;
  out.observation.plate = presses[0].observation.plate;
  out.observation.force_N = common_forces(presses);
  const Grid grid = grid_of(presses, options);
  std::vector<Placed> placed = place_presses(presses, options, out);

  Registration registration(placed, grid, options);
  registration.run();
  // Pressure is not quite in proportion to force: what a tilt makes of it is read anew.
  for (int round = 0; round < 4 && options.tilt_sd_per_mm > 0; ++round) {
    for (size_t p = 0; p < placed.size(); ++p)
      if (placed[p].used) placed[p].read(presses[p].observation, out.observation.force_N);
    registration.run();
  }
  leave_out_strangers(placed, registration, out);
  judge(blend(placed, grid, options, out), presses, out);

  out.observation.place_sd_mm = out.observation.uneven_sd = 0;
  for (size_t p = 0; p < placed.size(); ++p) {
    PressPlace& place = out.places[p];
    if (!place.used) {
      out.warnings.push_back("press '" + place.name + "' is left out: " + place.reason);
      continue;
    }
    fill_place(placed[p], registration.covariance, registration.at(p), options.tilt_sd_per_mm > 0, place);
    if (!options.held_sd_mm.empty()) place.shift_sd_mm.fill(options.held_sd_mm[p]);
    for (const double sd_mm : place.shift_sd_mm)
      out.observation.place_sd_mm = std::max(out.observation.place_sd_mm, sd_mm);
    out.observation.uneven_sd = std::max(out.observation.uneven_sd, presses[p].observation.uneven_sd);
    warn_of(place, placed[p].place(2), presses[p].observation.saturated_fraction, options, out.warnings);
  }
  if (out.seen_fraction < kWholeBlock)
    out.warnings.push_back(text("%.3g %% of the block was not seen", 100 * (1 - out.seen_fraction)));
  return out;
}

}  // namespace palpate::lump
