#include "engine/pipeline/plan.h"

#include <algorithm>
#include <cmath>

#include "engine/base/divide_up.h"
#include "engine/sensor/fit.h"

namespace palpate {
namespace {

constexpr uint32_t kLeast_px = 64;  // sides of a window below which nothing is gained

// The smallest side of at least `least` px that reaches the frame's end from a place in steps of
// kWindowStep_px.
uint32_t side_for(uint32_t least, uint32_t frame) {
  const uint32_t rest = frame % kWindowStep_px;
  const uint32_t side = divide_up(std::max(least, rest) - rest, kWindowStep_px) * kWindowStep_px + rest;
  return std::min(side, frame);
}

// Where the sum of the change's gradients is asked for, and where the force is read from it.
bool needs_gradient(const Sensor& sensor, uint32_t outputs) {
  return sensor.bit_depth == 8 &&
         (wants(outputs, Output::Gradient) ||
          (wants(outputs, Output::Force) && sensor.force && sensor.force->signal == ForceSignal::Gradient));
}

// Where it is asked for, and where the force is read from it.
bool needs_traction(const Sensor& sensor, uint32_t outputs) {
  return wants(outputs, Output::Traction) ||
         (wants(outputs, Output::Force) && sensor.force && sensor.force->signal == ForceSignal::Layer &&
          wants(outputs, Output::Surface));
}

bool needs_skin(const Sensor& sensor, uint32_t outputs) {
  return follows_skin(sensor, wants(outputs, Output::Skin), wants(outputs, Output::Force));
}

// Where printed markers would be taken for slopes, and moved ones for contacts.
bool needs_markers(const Sensor& sensor, const FrameFormat& format) {
  return sensor.skin && sensor.skin->kind == SkinKind::Markers && has_gel_contacts(sensor) &&
         format.channels == 3 && format.bit_depth == 8;
}

// Contacts are found where they are requested, and where traction restricts pressure to them: over a whole
// frame the errors of slopes would add up to a force.
bool needs_contacts(const Sensor& sensor, uint32_t outputs) {
  return wants(outputs, Output::Contacts) ||
         (needs_traction(sensor, outputs) && sensor.reconstruction != Reconstruction::Elastic);
}

bool needs_gel_contacts(const Sensor& sensor, uint32_t outputs) {
  return needs_contacts(sensor, outputs) && has_gel_contacts(sensor);
}

SurfaceKind surface_kind(const Sensor& sensor, uint32_t outputs) {
  if (!wants(outputs, Output::Surface)) return SurfaceKind::None;
  if (sensor.reconstruction == Reconstruction::Elastic) return SurfaceKind::Elastic;
  if (sensor.reconstruction == Reconstruction::Lookup) return SurfaceKind::Lookup;
  return SurfaceKind::Gradient;
}

}  // namespace

FramePlan make_plan(const Sensor& sensor, const FrameFormat& format, const PipelineOptions& options) {
  FramePlan plan;
  plan.windowed = options.skip_untouched && can_window(sensor, format, options);
  plan.background = sensor.background.kind == BackgroundKind::Untouched;
  plan.regions = needs_contacts(sensor, options.outputs);
  plan.gel_contacts = needs_gel_contacts(sensor, options.outputs);
  plan.steady_light = follows_light(sensor) && !options.fixed_light;
  plan.gradient = needs_gradient(sensor, options.outputs);
  plan.separate = options.separate;
  plan.skin = !options.separate && needs_skin(sensor, options.outputs);
  plan.markers = needs_markers(sensor, format);
  plan.confidence = needs_confidence(sensor, options.outputs);
  plan.surface = surface_kind(sensor, options.outputs);
  plan.traction = needs_traction(sensor, options.outputs);
  plan.traction_by = options.traction == TractionBy::Auto && options.solver == SurfaceSolver::Exact
                         ? TractionBy::Host
                         : options.traction;
  // Where each pixel has its confidence, specks have none and are left out by it.
  plan.specks = plan.background && !plan.confidence && !plan.windowed && sensor.bit_depth == 8 &&
                sensor.reconstruction == Reconstruction::Photometric;
  plan.keep_filtered =
      plan.surface != SurfaceKind::None && sensor.reconstruction != Reconstruction::Photometric;
  plan.weights = plan.surface == SurfaceKind::Gradient && plan.confidence;
  plan.solver = options.solver;
  // A window's frames do not follow each other: it moves in between.
  plan.warm_start = options.warm_start && !plan.windowed && !options.separate;
  plan.upload = options.upload;
  plan.slots = std::max(options.slots, 1u);
  return plan;
}

std::vector<PixelRect> window_sizes(const FrameFormat& format) {
  constexpr double kFractions[] = {0.375, 0.5, 0.625};
  std::vector<PixelRect> sizes;
  const uint32_t shorter = std::min(format.width, format.height);
  for (const double fraction : kFractions) {
    const auto side = static_cast<uint32_t>(std::ceil(fraction * shorter));
    const PixelRect size{0, 0, side_for(side, format.width), side_for(side, format.height)};
    if (side < kLeast_px || 2 * uint64_t{size.width} * size.height > uint64_t{format.width} * format.height)
      continue;
    sizes.push_back(size);
  }
  return sizes;
}

bool can_window(const Sensor& sensor, const FrameFormat& format, const PipelineOptions& options) {
  if (sensor.background.kind != BackgroundKind::Untouched || sensor.filter != Filter::Binomial5) return false;
  if (needs_confidence(sensor, options.outputs) || needs_gradient(sensor, options.outputs) ||
      needs_skin(sensor, options.outputs) || needs_gel_contacts(sensor, options.outputs) ||
      needs_markers(sensor, format) || needs_traction(sensor, options.outputs))
    return false;
  const SurfaceKind surface = surface_kind(sensor, options.outputs);
  if (surface == SurfaceKind::Elastic || surface == SurfaceKind::Lookup) return false;
  if (surface == SurfaceKind::Gradient && options.solver == SurfaceSolver::Exact) return false;
  return std::lround(sensor.threshold_gray * 128) > 0 && !window_sizes(format).empty();
}

}  // namespace palpate
