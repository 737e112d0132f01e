// Choice of the surface method.
#pragma once

#include <memory>

#include "engine/pipeline/plan.h"
#include "engine/pipeline/surface/surface_method.h"

namespace palpate {

/// The method that the plan names; null where it names none. `confidence` is null where the plan has none;
/// everything lives longer than the method.
std::unique_ptr<SurfaceMethod> make_surface(gpu::Context& context, const Sensor& sensor,
                                            const FrameFormat& format, const FramePlan& plan,
                                            const Contact& contact, const Confidence* confidence,
                                            const Tuning& tuning);

}  // namespace palpate
