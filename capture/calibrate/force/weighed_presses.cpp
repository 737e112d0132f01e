#include "capture/calibrate/force/weighed_presses.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <memory>
#include <optional>

#include "capture/calibrate/frame/origin.h"
#include "capture/files/tables/units.h"
#include "capture/open_source.h"
#include "capture/run/run_recording.h"
#include "capture/series.h"
#include "engine/base/statistics.h"
#include "engine/base/text.h"
#include "engine/gpu/context.h"
#include "palpate/error.h"
#include "palpate/pipeline.h"

namespace palpate {
namespace {

constexpr double kHeld_s = 0.5;      // over which a scale's display averages
constexpr double kLeastPress = 0.1;  // of the largest press's force: less is a brush
// Scatter of the gain over objects, relative: on the second day of a GelSight Wedge; where pixels show
// pressure, what a kitchen scale and a hand leave open.
constexpr double kObjectsOnGel = 0.2, kObjects = 0.03;
constexpr double kSigmas = 2;  // of the calibration's limit, and of the presses' scatter over their errors
constexpr double kSdOfMedian = 1.4826;  // of a bell, over the median distance from its middle
constexpr size_t kEnoughWeighed = 3;    // presses against a calibration: one may be of an odd object

/// A touched frame.
struct Reading {
  double time_s = 0;
  Estimate force;
  bool at_border = false;
};

/// The sensor's force, or the layer's where it has no calibration of force.
Estimate force_in(const Sensor& sensor, const Touch& touch) {
  if (sensor.force) return touch.force_N;
  return touch.traction ? touch.traction->fz_N : Estimate{};
}

bool is_known(const Estimate& force) {
  static constexpr Validity kNumbers[] = {Validity::Valid, Validity::AtBorder, Validity::BelowRange,
                                          Validity::AboveRange, Validity::ShapeUnjudged};
  return std::ranges::find(kNumbers, force.validity) != std::end(kNumbers) && force.value > 0;
}

/// The largest mean of known readings over kHeld_s, or of the whole press where it is shorter.
std::optional<Reading> held(std::span<const Reading> press) {
  std::optional<Reading> most;
  for (size_t first = 0, end = 0; first < press.size(); ++first) {
    while (end < press.size() && press[end].time_s < press[first].time_s + kHeld_s) ++end;
    if (most && end == press.size()) break;
    Reading mean;
    double known = 0;
    for (const Reading& one : press.subspan(first, end - first)) {
      if (!is_known(one.force)) continue;
      known += 1;
      mean.force.value += one.force.value;
      mean.force.standard_error += one.force.standard_error;
      mean.at_border = mean.at_border || one.at_border;
    }
    if (known == 0) continue;
    mean.time_s = press[first].time_s;
    mean.force.value /= known;
    mean.force.standard_error /= known;
    if (!most || mean.force.value > most->force.value) most = mean;
  }
  return most;
}

}  // namespace

WeighedGain weigh(std::span<const WeighedPress> presses) {
  WeighedGain found;
  const auto n = static_cast<double>(presses.size());
  std::vector<double> gains, off;
  double variance = 0;
  for (const WeighedPress& p : presses) {
    gains.push_back(p.weight_N / p.force_N);
    variance += std::pow(p.own_sd_N / p.force_N, 2) / n;
    found.stated += p.stated_sd_N / p.force_N / n;
  }
  const double stated = found.stated;
  found.gain = 0.5 * (median_in_place(gains) + quantile_in_place(gains, 0.5));  // the middle two of four
  for (const double gain : gains) off.push_back(std::abs(gain - found.gain));
  const double scatter = presses.size() < kEnoughWeighed ? 0 : kSdOfMedian * median_in_place(off);
  found.sd = std::max(found.gain * std::sqrt(variance), scatter) / std::sqrt(n);
  found.limit = 1 + kSigmas * std::hypot(stated, found.sd / found.gain);
  double squares = 0;
  for (const WeighedPress& p : presses)
    squares += std::pow((p.weight_N / p.force_N / found.gain - 1) * p.force_N / p.own_sd_N, 2);
  found.agree = presses.size() < 2 || squares <= kSigmas * kSigmas * (n - 1);
  const auto [least, most] = std::ranges::minmax(gains);
  found.least = least, found.most = most;
  found.mended = found.gain;
  found.mended_sd = found.sd;
  if (!found.agree) {
    found.mended = 1;
    found.mended_sd = stated;
    return found;
  }
  const bool contradicted = found.gain > found.limit || found.gain < 1 / found.limit;
  if (!(stated > 0) || (contradicted && presses.size() >= kEnoughWeighed)) return found;
  const double presses_weight = 1 / (found.sd * found.sd), calibration_weight = 1 / (stated * stated);
  found.mended = (presses_weight * found.gain + calibration_weight) / (presses_weight + calibration_weight);
  found.mended_sd = std::hypot(1 / std::sqrt(presses_weight + calibration_weight),
                               contradicted ? 0.5 * (found.gain - 1) : 0);
  return found;
}

std::vector<WeighedPress> weighed_presses(gpu::Context& context, const Sensor& sensor,
                                          const std::string& input, std::span<const double> weight_g,
                                          const RunWatch& watch) {
  if (!sensor.force && !layer_of(sensor))
    throw Error(Failure::Sensor, "a calibration of force, or a layer, to weigh presses with", "neither",
                "palpate calibrate force, or the section 'layer' (young_MPa, poisson, thickness_mm)");
  const std::unique_ptr<Source> source = open_source(input, sensor);
  const bool separate = separate_presses(*source, false);
  Outputs outputs = Output::Force | Output::Gradient;
  if (layer_of(sensor) && sensor.reading != SurfaceReading::None)
    outputs |= Output::Surface | Output::Contacts | Output::Traction;
  Pipeline pipeline(context, for_rectified_frames(sensor), source->format(),
                    {.outputs = outputs, .solver = SurfaceSolver::Best, .separate = separate});
  pipeline.set_background(load_background(input, sensor, *source));
  if (separate) look_ahead(input, sensor, pipeline, watch.stop);
  std::vector<std::vector<Reading>> presses;
  bool touching = false;
  const RunWatch::Progress progress = watch.begin("weighing presses", source->frame_count().value_or(0));
  run_recording(*source, pipeline, 0, watch.stop, [&](const Result& result, const Frame& frame) {
    const Touch& touch = result.touch;
    progress(touch.sequence);
    if (touch.contact && (!touching || separate)) presses.emplace_back();
    touching = touch.contact;
    if (touching)
      presses.back().push_back(
          {static_cast<double>(frame.time_ns) * 1e-9, force_in(sensor, touch), touch.at_border});
  });
  if (watch.stopped()) return {};
  std::vector<Reading> readings;
  double most_N = 0;
  for (const std::vector<Reading>& press : presses)
    if (const std::optional<Reading> one = held(press)) {
      readings.push_back(*one);
      most_N = std::max(most_N, one->force.value);
    }
  std::erase_if(readings, [&](const Reading& r) { return r.force.value < kLeastPress * most_N; });
  if (readings.size() != weight_g.size()) {
    std::string found = text("%zu of them", readings.size());
    for (const Reading& r : readings)
      found += text("%s%.3g N at %.1f s", &r == readings.data() ? ": " : ", ", r.force.value, r.time_s);
    throw Error(Failure::Input,
                text("%zu presses of known force in '", weight_g.size()) + input + "', a weight each", found,
                "one --weight-g for each press, in their order");
  }
  const std::optional<LayerCalibration> layer = layer_of(sensor);
  const bool by_layer = layer && (!sensor.force || is_by_layer(sensor.force->signal));
  std::vector<WeighedPress> weighed;
  for (size_t i = 0; i < readings.size(); ++i) {
    const Estimate& force = readings[i].force;
    const double objects_N = force.value * (has_gel_contacts(sensor) ? kObjectsOnGel : kObjects);
    const double shared = by_layer ? std::min(layer->relative_sd * force.value, force.standard_error) : 0;
    weighed.push_back(
        {.weight_N = 1e-3 * kGravity * weight_g[i],
         .force_N = force.value,
         .own_sd_N = std::sqrt(std::pow(force.standard_error, 2) - shared * shared + objects_N * objects_N),
         .stated_sd_N = force.standard_error,
         .at_border = readings[i].at_border});
  }
  return weighed;
}

void set_gain(Sensor& sensor, const WeighedGain& gain, const std::string& input) {
  const Origin origin =
      origin_now(input, text("weighed presses: %.3f of what was read, +- %.1f %%", gain.gain, 100 * gain.sd));
  const bool by_layer = !sensor.force || is_by_layer(sensor.force->signal);
  if (by_layer) {
    LayerCalibration layer = layer_of(sensor).value();
    layer.young_MPa *= gain.mended;
    layer.relative_sd = gain.mended_sd / gain.mended;
    layer.origin = origin;
    sensor.layer = layer;
  }
  if (!sensor.force) return;
  ForceCalibration& force = *sensor.force;
  force.origin = origin;
  if (by_layer) {  // its curves are of a force that is mended already
    force.gray_min *= gain.mended;
    force.gray_max *= gain.mended;
    force.bending_N_per_mm *= gain.mended;
    return;
  }
  const auto scale = [&](auto& curve, double& c1) {
    c1 *= gain.mended;
    curve.c0_N *= gain.mended;
    curve.residual_sd_N *= gain.mended;
    for (std::array<double, 2>& knot : curve.knots) knot[1] *= gain.mended;
  };
  scale(force, force.c1_N_per_gray);
  for (std::optional<ForceCurve>* branch : {&force.loading, &force.unloading})
    if (*branch) scale(**branch, (*branch)->c1);
  for (double& part : force.covariance) part *= gain.mended * gain.mended;
  force.force_max_N *= gain.mended;
  force.residual_fraction = std::hypot(force.residual_fraction, gain.mended_sd / gain.mended);
  force.residual_grows_to_N = 0;  // a wrong gain errs the more the larger the force
}

}  // namespace palpate
