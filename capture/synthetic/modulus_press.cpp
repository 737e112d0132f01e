#include "capture/synthetic/modulus_press.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <random>

#include "capture/synthetic/optics.h"
#include "palpate/error.h"

namespace palpate {
namespace {

constexpr double kBlur_mm = 0.02;
constexpr double kSizeSd = 0.005, kMostStrain = 0.08, kWidest = 0.33, kMostForce_N = 2;
constexpr int kInPixel = 4;  // samples of the light along a side of a pixel

/// Distance of the place of a disc that stands for a place of the square of the same area: rings become
/// squares, areas stay.
double ring_of(double x, double y, bool square) {
  return square ? 2 / std::sqrt(std::numbers::pi) * std::max(std::abs(x), std::abs(y)) : std::hypot(x, y);
}

}  // namespace

Sample usual_sample(SampleShape shape) {
  Sample s;
  s.shape = shape;
  s.size_mm = shape == SampleShape::Sphere ? 16 : 10;
  s.height_mm = 10;
  s.relative_size_sd = kSizeSd;
  return s;
}

double usual_force_N(const PressModel& model, double young_MPa, double pad_MPa) {
  double force = kMostForce_N;
  for (;; force *= 0.97) {
    const PressSight s = model.at_force(force, young_MPa, pad_MPa);
    if (model.sample().flat() ? s.strain <= kMostStrain : s.radius_mm <= kWidest * model.sample().radius_mm())
      return force;
  }
}

Frame render_press(const SyntheticOptions& options, const TruePress& press, double gain, bool square,
                   double x_px, double y_px, uint64_t sequence) {
  const SyntheticSensor sensor(options);
  Frame frame = *sensor.own_background();
  const FrameFormat format = frame.format;
  frame.sequence = sequence;
  frame.time_ns = static_cast<int64_t>(1e9 * static_cast<double>(sequence) / options.rate_Hz);
  const optics::Field field(options);
  const optics::NormalNoise normal;
  const double pitch = optics::pitch_mm(options),
               limit = optics::kResponseLimit_gray * optics::scale(options.bit_depth);
  std::vector<float> noise(format.width);
  for (uint32_t y = 0; y < format.height; ++y) {
    normal.row(options.seed * 2, sequence, y, format.width, noise.data());
    for (uint32_t x = 0; x < format.width; ++x) {
      double pressure = 0;
      for (int i = 0; i < kInPixel * kInPixel; ++i) {
        const double dx = x - x_px + (i % kInPixel + 0.5) / kInPixel - 0.5,
                     dy = y - y_px + (i / kInPixel + 0.5) / kInPixel - 0.5;
        pressure += press.pressure_at_MPa(ring_of(dx * pitch, dy * pitch, square));
      }
      pressure /= kInPixel * kInPixel;
      double light = gain * pressure;
      if (options.response == SyntheticResponse::Saturating) light = limit * (1 - std::exp(-light / limit));
      const double x_mm = (x - (format.width - 1) / 2.0) * pitch,
                   y_mm = (y - (format.height - 1) / 2.0) * pitch;
      double gray = frame.at(0, x, y) + light * field.touch(x_mm, y_mm);
      gray += sensor.noise_sd_gray(gray) * double{noise[x]};
      frame.set(0, x, y, static_cast<uint32_t>(std::lround(std::clamp(gray, 0.0, 1.0 * format.max_gray()))));
    }
  }
  return frame;
}

SimulatedPresses simulate_presses(const ModulusScene& scene, const PressTruth* truth) {
  if (scene.sensor.mode != SyntheticMode::Waveguide)
    throw Error(Failure::Input, "a simulated sensor that shows pressure", "another mode", "mode=waveguide");
  SimulatedPresses out;
  out.sensor = synthetic_sensor(scene.sensor);
  const Pad pad{{scene.sensor.pad_young_MPa, 0.5}, scene.sensor.pad_thickness_mm, Base::Bonded};
  std::optional<PressTruth> made;
  if (!truth) {
    Sample sample = scene.sample;
    sample.size_mm *= 1 + scene.size_error;
    truth = &made.emplace(pad, sample);
  }
  out.background = *SyntheticSensor(scene.sensor).own_background();
  std::mt19937_64 random(scene.sensor.seed * 31 + 7);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> within(-0.5, 0.5);
  const double x_px = (out.background.format.width - 1) / 2.0 + within(random),
               y_px = (out.background.format.height - 1) / 2.0 + within(random);
  double brightest = 0;
  for (size_t i = 0; i < scene.forces_N.size(); ++i) {
    out.truth.push_back(
        truth->press(scene.forces_N[i], scene.young_MPa, scene.sensor.pad_young_MPa * (1 + scene.pad_error)));
    const TruePress& press = out.truth.back();
    if (!press.converged)
      throw Error(
          Failure::Input, "a contact that the ball's face holds",
          std::to_string(scene.forces_N[i]) + " N on " + std::to_string(1e3 * scene.young_MPa) + " kPa",
          "smaller forces");
    out.approach_mm.push_back(press.approach_mm + scene.zero_error_mm + scene.stage_sd_mm * normal(random));
    // A rim's peak is blurred by the pixel.
    for (double r = 0; r < press.r_mm.back() - kBlur_mm; r += kBlur_mm)
      brightest = std::max(brightest, press.pressure_at_MPa(r));
  }
  const double usual = optics::kGrayPerMPa * optics::scale(scene.sensor.bit_depth),
               light = scene.light > 0
                           ? scene.light
                           : scene.brightness * out.background.format.max_gray() / (brightest * usual);
  // A longer exposure: more gray for the same pressure, all else as before.
  out.sensor.elastic.gray_per_MPa *= light;
  if (out.sensor.force) {
    out.sensor.force->c1_N_per_gray /= light;
    out.sensor.force->covariance = {out.sensor.force->covariance[0], out.sensor.force->covariance[1] / light,
                                    out.sensor.force->covariance[2] / (light * light)};
    out.sensor.force->gray_max *= light;
  }
  for (size_t i = 0; i < out.truth.size(); ++i)
    out.frames.push_back(render_press(scene.sensor, out.truth[i], usual * light,
                                      scene.sample.shape == SampleShape::Cube, x_px, y_px, i));
  return out;
}

}  // namespace palpate
