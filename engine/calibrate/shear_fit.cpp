#include "engine/calibrate/shear_fit.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <functional>
#include <string>

#include "engine/base/statistics.h"
#include "engine/base/text.h"
#include "palpate/error.h"

namespace palpate {
namespace {

using Phase = ShearSample::Phase;

constexpr size_t kLeastReadings = 10;
constexpr double kLeastFraction = 0.1;    // of the other direction's force: less is not pulled in
constexpr double kLeastShift_noise = 10;  // times the shift's noise
constexpr double kBehind = 0.08;        // fraction of the largest force by which K u may miss while it sticks
constexpr double kBehind_sd = 4;        // and so many robust scatters
constexpr double kBehindAtMost = 0.15;  // the same, whatever the scatter: a slide is no scatter
constexpr double kAtLimit = 0.9;        // of the force that it slips at
constexpr double kLeastRSquared = 0.8;  // of K u: less is no spring
constexpr int kForGood = 3;             // frames in a row
constexpr double kPlateau = 0.93;       // of the upper tenth's ratio: still the plateau
constexpr size_t kShearStretches = 8;

std::string rounded(double value) {
  return text("%.3g", value);
}

/// One direction's component of shift and force.
struct Axis {
  double ShearSample::*u;
  double ShearSample::*f;
  const char* name;
};
constexpr std::array kAxes{Axis{&ShearSample::ux_mm, &ShearSample::fx_N, "x (to the right in the image)"},
                           Axis{&ShearSample::uy_mm, &ShearSample::fy_N, "y (downwards in the image)"}};

double through_origin(std::span<const ShearSample> samples, const Axis& axis,
                      const std::function<bool(size_t)>& counts) {
  double uu = 0, uf = 0;
  for (size_t i = 0; i < samples.size(); ++i) {
    if (!counts(i)) continue;
    const double u = samples[i].*axis.u;
    uu += u * u;
    uf += u * samples[i].*axis.f;
  }
  return uu > 0 ? uf / uu : 0;
}

/// Refuses a direction that says nothing of its stiffness.
void check_pulled(std::span<const ShearSample> samples, double noise_mm) {
  std::array<double, 2> force_N{}, shift_mm{};
  for (const ShearSample& s : samples)
    for (const size_t a : {0, 1}) {
      force_N[a] = std::max(force_N[a], std::abs(s.*kAxes[a].f));
      shift_mm[a] = std::max(shift_mm[a], std::abs(s.*kAxes[a].u));
    }
  for (const size_t a : {0, 1}) {
    const bool force = force_N[a] > kLeastFraction * std::max(force_N[0], force_N[1]);
    const bool shift = shift_mm[a] > kLeastShift_noise * noise_mm;
    if (force && shift && force_N[a] > 0) continue;
    throw Error(Failure::Input, "a contact that is pulled in both directions, x and y",
                "none along " + std::string(kAxes[a].name) + ": at most " + rounded(force_N[a]) + " N and " +
                    rounded(shift_mm[a]) + " mm there",
                "a recording in which it is pulled that way too");
  }
}

/// Stiffness by each contact's first pull, before it can have slipped: from its onset until it is pulled by
/// half as much as ever. Later shifts may be slides of any length.
std::array<double, 2> first_stiffness(std::span<const ShearSample> samples) {
  std::vector<bool> first(samples.size());
  for (size_t i = 0; i < samples.size();) {
    size_t end = i;
    double largest_N = 0;
    for (; end < samples.size() && samples[end].contact == samples[i].contact; ++end)
      largest_N = std::max(largest_N, std::hypot(samples[end].fx_N, samples[end].fy_N));
    for (size_t j = i; j < end && std::hypot(samples[j].fx_N, samples[j].fy_N) < 0.5 * largest_N; ++j)
      first[j] = true;
    i = end;
  }
  const auto counts = [&](size_t i) { return bool{first[i]}; };
  std::array<double, 2> k{through_origin(samples, kAxes[0], counts),
                          through_origin(samples, kAxes[1], counts)};
  // A direction that no first pull has moved in is taken as stiff as the other until the frames that stick
  // tell its own.
  std::array<double, 2> shift_mm{};
  for (const size_t a : {0, 1})
    for (size_t i = 0; i < samples.size(); ++i)
      if (first[i]) shift_mm[a] = std::max(shift_mm[a], std::abs(samples[i].*kAxes[a].u));
  for (const size_t a : {0, 1})
    if (shift_mm[a] < 0.1 * shift_mm[1 - a]) k[a] = k[1 - a];
  return k;
}

/// Frames from a contact's first lasting departure on do not stick.
void find_sticking(std::vector<ShearSample>& samples) {
  double largest_N = 0;
  for (const ShearSample& s : samples) largest_N = std::max(largest_N, std::hypot(s.fx_N, s.fy_N));
  std::array<double, 2> k = first_stiffness(samples);
  for (int round = 0; round < 6; ++round) {
    std::vector<double> off(samples.size()), kept;
    for (size_t i = 0; i < samples.size(); ++i) {
      const ShearSample& s = samples[i];
      off[i] = std::hypot(s.fx_N - k[0] * s.ux_mm, s.fy_N - k[1] * s.uy_mm);
      if (round == 0 || s.phase == Phase::Sticks) kept.push_back(off[i]);
    }
    const double allowed_N =
        std::clamp(kBehind_sd * median(kept), kBehind * largest_N, kBehindAtMost * largest_N);
    bool changed = false;
    for (size_t i = 0; i < samples.size();) {
      size_t end = i, row = 0, departed = samples.size();
      for (; end < samples.size() && samples[end].contact == samples[i].contact; ++end) {
        row = off[end] > allowed_N ? row + 1 : 0;
        if (row == kForGood && departed == samples.size()) departed = end + 1 - kForGood;
      }
      // The departure is seen late: just before it the force is at its limit already.
      const auto pull_N = [&](size_t j) { return std::hypot(samples[j].fx_N, samples[j].fy_N); };
      if (departed < end)
        for (const double limit_N = pull_N(departed);
             departed > i && pull_N(departed - 1) > kAtLimit * limit_N;)
          --departed;
      for (size_t j = i; j < end; ++j) {
        const Phase phase = j >= departed ? Phase::Departs : Phase::Sticks;
        changed |= phase != samples[j].phase;
        samples[j].phase = phase;
      }
      i = end;
    }
    const auto sticks = [&](size_t i) { return samples[i].phase == Phase::Sticks; };
    for (const size_t a : {0, 1}) k[a] = through_origin(samples, kAxes[a], sticks);
    if (round > 0 && !changed) break;
  }
}

Stiffness stiffness_of(std::span<const ShearSample> samples, const Axis& axis) {
  std::vector<size_t> used;
  for (size_t i = 0; i < samples.size(); ++i)
    if (samples[i].phase == Phase::Sticks) used.push_back(i);
  Stiffness s;
  s.readings = used.size();
  const auto sticks = [&](size_t i) { return samples[i].phase == Phase::Sticks; };
  s.k_N_per_mm = through_origin(samples, axis, sticks);
  double squares = 0, ff = 0, u_sum = 0, f_sum = 0, uu = 0, uf = 0;
  for (const size_t i : used) {
    const double u = samples[i].*axis.u, f = samples[i].*axis.f, r = f - s.k_N_per_mm * u;
    squares += r * r;
    ff += f * f;
    u_sum += u;
    f_sum += f;
    uu += u * u;
    uf += u * f;
    s.shift_max_mm = std::max(s.shift_max_mm, std::abs(u));
  }
  const auto n = static_cast<double>(used.size());
  s.residual_N = std::sqrt(squares / n);
  s.r_squared = ff > 0 ? 1 - squares / ff : 0;
  const double spread = uu - u_sum * u_sum / n;
  if (spread > 0) s.offset_N = f_sum / n - (uf - u_sum * f_sum / n) / spread * u_sum / n;
  // Jackknife over stretches of time.
  std::array<double, kShearStretches> without{};
  double mean = 0;
  for (size_t b = 0; b < kShearStretches; ++b) {
    std::vector<bool> counts(samples.size());
    for (size_t j = 0; j < used.size(); ++j) counts[used[j]] = j * kShearStretches / used.size() != b;
    without[b] = through_origin(samples, axis, [&](size_t i) { return bool{counts[i]}; });
    mean += without[b] / kShearStretches;
  }
  double variance = 0;
  for (const double k : without) variance += (k - mean) * (k - mean);
  s.sd_N_per_mm = std::sqrt(variance * (kShearStretches - 1) / kShearStretches);
  return s;
}

void find_friction(std::vector<ShearSample>& samples, ShearFit& fit) {
  const auto ratio_of = [](const ShearSample& s) { return std::hypot(s.fx_N, s.fy_N) / s.normal_N; };
  std::vector<double> departed;
  for (const ShearSample& s : samples) {
    if (!(s.normal_N > 0)) continue;
    if (s.phase == Phase::Sticks)
      fit.largest_ratio = std::max(fit.largest_ratio, ratio_of(s));
    else
      departed.push_back(ratio_of(s));
  }
  if (departed.size() < kLeastReadings) return;
  std::sort(departed.begin(), departed.end());
  const double top = departed[departed.size() - 1 - departed.size() / 20];  // the upper tenth's median
  std::vector<double> plateau, off;
  for (ShearSample& s : samples) {
    if (s.phase == Phase::Sticks || !(s.normal_N > 0) || ratio_of(s) < kPlateau * top) continue;
    s.phase = Phase::Slips;
    plateau.push_back(ratio_of(s));
  }
  if (plateau.size() < kLeastReadings) return;
  fit.has_friction = true;
  fit.slip_readings = plateau.size();
  fit.friction = median(plateau);
  for (const double ratio : plateau) off.push_back(std::abs(ratio - fit.friction));
  // Frames of one slide err alike: as if every tenth counted.
  const double independent = std::max(static_cast<double>(plateau.size()) / 10, 1.0);
  fit.friction_sd = 1.2533 * 1.4826 * median(off) / std::sqrt(independent);
}

}  // namespace

ShearFit fit_shear(std::vector<ShearSample>& samples, double noise_mm) {
  if (samples.size() < kLeastReadings)
    throw Error(
        Failure::Input,
        "at least " + std::to_string(kLeastReadings) + " frames of a contact with tangential gauge readings",
        std::to_string(samples.size()), "a recording in which something presses and is pulled");
  check_pulled(samples, noise_mm);
  find_sticking(samples);
  ShearFit fit;
  for (const size_t a : {0, 1}) {
    Stiffness& s = a ? fit.y : fit.x;
    s = stiffness_of(samples, kAxes[a]);
    if (s.readings >= kLeastReadings && s.shift_max_mm < kLeastShift_noise * noise_mm)
      throw Error(Failure::Input,
                  "a contact that is pulled along " + std::string(kAxes[a].name) + " while it sticks",
                  "at most " + rounded(s.shift_max_mm) + " mm there before it slips",
                  "a recording in which it is pulled that way too, with more normal force");
    if (s.readings < kLeastReadings || !(s.k_N_per_mm > 0))
      throw Error(Failure::Input,
                  "a contact that sticks and follows the pull along " + std::string(kAxes[a].name),
                  s.readings < kLeastReadings ? std::to_string(s.readings) + " frames that stick"
                                              : "a shift against the force",
                  s.readings < kLeastReadings ? "a slower pull, or more normal force"
                                              : "the gauge's signs: x to the right and y down in the image");
    if (s.r_squared < kLeastRSquared)
      throw Error(Failure::Input,
                  "a shift that follows the pull along " + std::string(kAxes[a].name) + " (R^2 of " +
                      rounded(kLeastRSquared) + " or more)",
                  "R^2 " + rounded(s.r_squared) + " over " + std::to_string(s.readings) +
                      " frames that seem to stick",
                  "checking that gauge and recording belong together and run on one clock, or a slower pull");
  }
  find_friction(samples, fit);
  return fit;
}

}  // namespace palpate
