#include "capture/calibrate/force/shear.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/base/json.h"
#include "engine/base/text.h"
#include "palpate/error.h"

namespace palpate {
namespace {

using Json = json::Value;
using Phase = ShearSample::Phase;

constexpr double kShiftNoise_px = 0.05;
constexpr double kOffset = 0.05;  // of the largest force: a gauge that is not at zero

double largest_force(const ShearOutcome& o) {
  double largest_N = 0;
  for (const ShearSample& s : o.samples) largest_N = std::max(largest_N, std::hypot(s.fx_N, s.fy_N));
  return largest_N;
}

size_t count(const ShearOutcome& o, Phase phase) {
  return static_cast<size_t>(std::count_if(o.samples.begin(), o.samples.end(),
                                           [&](const ShearSample& s) { return s.phase == phase; }));
}

double unexplained(const ShearFit& fit) {
  return 2 - fit.x.r_squared - fit.y.r_squared;
}

Json stiffness_json(const Stiffness& s) {
  return {{"k_N_per_mm", s.k_N_per_mm}, {"sd_N_per_mm", s.sd_N_per_mm}, {"r_squared", s.r_squared},
          {"residual_N", s.residual_N}, {"offset_N", s.offset_N},       {"shift_max_mm", s.shift_max_mm},
          {"readings", s.readings}};
}

}  // namespace

Outputs shear_outputs(const MeasuredInput& input, std::optional<ShearSignal> signal) {
  const bool skin = input.sensor.skin && signal != ShearSignal::Centroid;
  return skin ? Output::Force | Output::Skin : Output::Force;
}

std::vector<ShearSample> shear_samples(const std::vector<GaugedRecording>& recordings, ShearSignal signal) {
  std::vector<ShearSample> samples;
  uint32_t contacts = 0;
  for (const GaugedRecording& r : recordings) {
    bool touching = false;
    for (const GaugedFrame& f : r.frames) {
      const Touch& t = f.touch;
      if (t.contact && !touching) ++contacts;
      touching = t.contact;
      if (!t.contact || !std::isfinite(f.fx_N) || !std::isfinite(f.fy_N)) continue;
      ShearSample s;
      s.fx_N = f.fx_N;
      s.fy_N = f.fy_N;
      s.contact = contacts;
      const bool known =
          t.force_N.validity == Validity::Valid || t.force_N.validity == Validity::ShapeUnjudged;
      s.normal_N = std::isfinite(f.force_N) ? f.force_N
                   : known                  ? t.force_N.value
                                            : std::numeric_limits<double>::quiet_NaN();
      if (signal == ShearSignal::Centroid) {
        s.ux_mm = t.shift_x_mm;
        s.uy_mm = t.shift_y_mm;
      } else {
        if (!t.skin || t.skin->shift_x_mm.validity != Validity::Valid) continue;
        s.ux_mm = t.skin->shift_x_mm.value;
        s.uy_mm = t.skin->shift_y_mm.value;
      }
      samples.push_back(s);
    }
  }
  return samples;
}

ShearOutcome calibrate_shear(std::vector<GaugedRecording> recordings, const Sensor& sensor,
                             const ShearRequest& request) {
  ShearOutcome o;
  o.recordings = std::move(recordings);
  const double noise_mm = kShiftNoise_px * sensor.pitch_mm_per_px;
  const auto fit = [&](ShearSignal signal, std::vector<ShearSample>& samples) {
    samples = shear_samples(o.recordings, signal);
    return fit_shear(samples, noise_mm);
  };
  bool has_skin = false;
  for (const GaugedRecording& r : o.recordings)
    for (const GaugedFrame& f : r.frames) has_skin |= f.touch.skin.has_value();
  if (request.signal == ShearSignal::Skin && !has_skin)
    throw Error(Failure::Sensor, "a pad whose skin shows a pattern, for signal 'skin'", "none",
                "a section \"skin\" in the sensor file, or signal centroid");
  if (request.signal) {
    o.signal = *request.signal;
    o.fit = fit(o.signal, o.samples);
  } else {
    o.fit = fit(ShearSignal::Centroid, o.samples);
    if (has_skin) {
      std::vector<ShearSample> samples;
      try {
        o.other = fit(ShearSignal::Skin, samples);
      } catch (const Error& error) {
        o.recordings.front().notes.push_back(std::string("the skin's shift cannot be used: ") + error.what());
      }
      if (o.other && unexplained(*o.other) < unexplained(o.fit)) {
        std::swap(*o.other, o.fit);
        o.samples = std::move(samples);
        o.signal = ShearSignal::Skin;
      }
    }
  }
  ShearCalibration& c = o.calibration;
  c.signal = o.signal;
  c.kx_N_per_mm = o.fit.x.k_N_per_mm;
  c.ky_N_per_mm = o.fit.y.k_N_per_mm;
  c.relative_sd = std::max(o.fit.x.sd_N_per_mm / c.kx_N_per_mm, o.fit.y.sd_N_per_mm / c.ky_N_per_mm);
  c.shift_max_mm = std::max(o.fit.x.shift_max_mm, o.fit.y.shift_max_mm);
  if (request.friction) {
    c.friction = *request.friction;
    o.friction_from = "given";
  } else if (o.fit.has_friction) {
    c.friction = o.fit.friction;
    c.friction_sd = o.fit.friction_sd;
    o.friction_from = "from slip";
  } else if (sensor.shear) {
    c.friction = sensor.shear->friction;
    c.friction_sd = sensor.shear->friction_sd;
    o.friction_from = "from the sensor file";
  } else {
    throw Error(Failure::Input, "a recording in which the contact slips, for the friction",
                "only sticking, or no normal force with it (tangential force up to " +
                    palpate::text("%.3g", o.fit.largest_ratio) + " of the normal one)",
                "a further recording that slides, a gauge table with force_N too, or --friction");
  }
  for (const auto& [axis, s] : {std::pair{'x', &o.fit.x}, std::pair{'y', &o.fit.y}})
    if (std::abs(s->offset_N) > kOffset * largest_force(o))
      o.recordings.front().notes.push_back(palpate::text(
          "the gauge's f%c reads %.3g N where nothing is shifted: was it tared?", axis, s->offset_N));
  if (const size_t departs = count(o, Phase::Departs); 2 * departs > o.samples.size())
    o.recordings.front().notes.push_back(
        palpate::text("%zu of %zu touched frames were left out, after a slip: K rests on the lesser part",
                      departs, o.samples.size()));
  c.origin =
      origin_of(o.recordings, palpate::text("signal %s, %zu frames that stick, %zu that slip, friction %s",
                                            to_string(o.signal), o.fit.x.readings, o.fit.slip_readings,
                                            o.friction_from.c_str()));
  return o;
}

std::string describe(const ShearOutcome& o) {
  std::string text;
  for (const GaugedRecording& r : o.recordings) text += describe(r);
  text += palpate::text("%zu touched frames: %zu stick, %zu slip, %zu in between after a slip (left out)\n",
                        o.samples.size(), count(o, Phase::Sticks), count(o, Phase::Slips),
                        count(o, Phase::Departs));
  text += palpate::text("\nF = K u, u the shift of the %s since onset\n",
                        o.signal == ShearSignal::Skin ? "skin" : "centroid");
  text += "         K, N/mm   standard error      R^2   residual, N   largest shift, mm\n";
  for (const auto& [axis, s] : {std::pair{'x', &o.fit.x}, std::pair{'y', &o.fit.y}})
    text += palpate::text("%c  %13.5g   %14.2g %8.5f %13.3g %19.3g\n", axis, s->k_N_per_mm, s->sd_N_per_mm,
                          s->r_squared, s->residual_N, s->shift_max_mm);
  if (o.other)
    text += palpate::text("by the %s instead: R^2 %.5f and %.5f\n",
                          o.signal == ShearSignal::Skin ? "centroid" : "skin", o.other->x.r_squared,
                          o.other->y.r_squared);
  text += palpate::text("friction %.4g", o.calibration.friction);
  if (o.calibration.friction_sd > 0) text += palpate::text(" +- %.2g", o.calibration.friction_sd);
  if (o.friction_from == "from slip")
    text += palpate::text(", from %zu frames that slip\n", o.fit.slip_readings);
  else
    text += palpate::text(", %s; it stuck up to %.3g of the normal force\n", o.friction_from.c_str(),
                          o.fit.largest_ratio);
  return text;
}

json::Value to_json(const ShearOutcome& o, const std::string& sensor_file) {
  Json value = {{"sensor", sensor_file},
                {"recordings", to_json(o.recordings)},
                {"touched_frames", o.samples.size()},
                {"signal", to_string(o.signal)},
                {"x", stiffness_json(o.fit.x)},
                {"y", stiffness_json(o.fit.y)},
                {"relative_sd", o.calibration.relative_sd},
                {"friction", o.calibration.friction},
                {"friction_sd", o.calibration.friction_sd},
                {"friction_from", o.friction_from},
                {"slip_frames", o.fit.slip_readings},
                {"largest_sticking_ratio", o.fit.largest_ratio}};
  return value;
}

}  // namespace palpate
