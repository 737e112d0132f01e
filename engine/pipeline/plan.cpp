#include "engine/pipeline/plan.h"

#include <algorithm>

#include "engine/pipeline/choose_solve.h"
#include "engine/sensor/fit.h"

namespace palpate {
namespace {

// Where the sum of the change's gradients is asked for, and where the force is read from it.
bool needs_gradient(const Sensor& sensor, Outputs outputs) {
  return sensor.bit_depth == 8 &&
         (wants(outputs, Output::Gradient) ||
          (wants(outputs, Output::Force) && sensor.force && sensor.force->signal == ForceSignal::Gradient));
}

// Where it is asked for, and where the force is read from it.
bool needs_traction(const Sensor& sensor, Outputs outputs) {
  return wants(outputs, Output::Traction) ||
         (wants(outputs, Output::Force) && sensor.force && is_by_layer(sensor.force->signal) &&
          wants(outputs, Output::Surface));
}

bool needs_skin(const Sensor& sensor, Outputs outputs) {
  return follows_skin(sensor, wants(outputs, Output::Skin), wants(outputs, Output::Force));
}

// Where printed markers would be taken for slopes, and moved ones for contacts.
bool needs_markers(const Sensor& sensor, const FrameFormat& format) {
  return sensor.skin && sensor.skin->kind == SkinKind::Markers && has_gel_contacts(sensor) &&
         format.channels == 3 && format.bit_depth == 8;
}

bool needs_motion(Outputs outputs, bool separate) {
  return wants(outputs, Output::Motion) && !separate;
}

// Contacts are found where they are requested, where traction restricts pressure to them: over a whole frame
// the errors of slopes would add up to a force, and where motion restricts the surface to them.
bool needs_contacts(const Sensor& sensor, Outputs outputs) {
  return wants(outputs, Output::Contacts) ||
         (needs_traction(sensor, outputs) && sensor.reading != SurfaceReading::Elastic) ||
         (wants(outputs, Output::Motion) && has_gel_contacts(sensor));
}

bool needs_gel_contacts(const Sensor& sensor, Outputs outputs) {
  return needs_contacts(sensor, outputs) && has_gel_contacts(sensor);
}

SurfaceKind surface_kind(const Sensor& sensor, Outputs outputs) {
  if (!wants(outputs, Output::Surface)) return SurfaceKind::None;
  if (sensor.reading == SurfaceReading::Elastic) return SurfaceKind::Elastic;
  if (sensor.reading == SurfaceReading::Lookup) return SurfaceKind::Lookup;
  return SurfaceKind::Gradient;
}

}  // namespace

FramePlan make_plan(const Sensor& sensor, const FrameFormat& format, const PipelineOptions& options,
                    bool processor) {
  FramePlan plan;
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
  plan.motion = needs_motion(options.outputs, options.separate);
  // Where each pixel has its confidence, specks have none and are left out by it.
  plan.specks = plan.background && !plan.confidence && sensor.bit_depth == 8 &&
                sensor.reading == SurfaceReading::Photometric;
  plan.flaws = shows_flaws(sensor);
  plan.keep_filtered = plan.surface != SurfaceKind::None && sensor.reading != SurfaceReading::Photometric;
  plan.weights = plan.surface == SurfaceKind::Gradient && plan.confidence;
  plan.solve = choose_solve(
      options.solver, options.solve_by,
      {.transforms = plan.surface == SurfaceKind::Gradient && !plan.weights, .processor = processor});
  plan.traction_on_host = traction_on_host(options.solve_by, plan.solve, processor);
  plan.motion_on_host = motion_on_host(options.solve_by, processor);
  plan.upload = options.upload;
  plan.slots = std::max(options.slots, 1u);
  return plan;
}

}  // namespace palpate
