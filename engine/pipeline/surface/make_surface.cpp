#include "engine/pipeline/surface/make_surface.h"

#include "engine/pipeline/surface/surface_elastic.h"
#include "engine/pipeline/surface/surface_gradient.h"
#include "engine/pipeline/surface/surface_lookup.h"

namespace palpate {

std::unique_ptr<SurfaceMethod> make_surface(gpu::Context& context, const Sensor& sensor,
                                            const FrameFormat& format, const FramePlan& plan,
                                            const Contact& contact, const Confidence* confidence,
                                            const Tuning& tuning) {
  switch (plan.surface) {
    case SurfaceKind::None:
      return nullptr;
    case SurfaceKind::Gradient:
      return std::make_unique<GradientSurface>(context, sensor, format, plan, contact, confidence, tuning);
    case SurfaceKind::Elastic:
      return std::make_unique<ElasticSurface>(context, sensor, format, plan, contact, tuning);
    case SurfaceKind::Lookup:
      return std::make_unique<LookupSurface>(context, sensor, format, plan, contact, tuning);
  }
  return nullptr;
}

}  // namespace palpate
