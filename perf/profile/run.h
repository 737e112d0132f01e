// One device's profile from start to end.
#pragma once

#include <vector>

#include "palpate/sensor.h"
#include "perf/profile/live.h"
#include "perf/profile/profile.h"
#include "perf/profile/sampling.h"
#include "perf/profile/sizes.h"

namespace palpate::gpu {
struct ContextOptions;
}

namespace palpate::perf {

struct ProfileRequest {
  std::vector<FrameSize> sizes;  ///< of the ladder; empty: default_sizes
  std::vector<SurfaceReading> readings{SurfaceReading::Shading, SurfaceReading::Photometric,
                                       SurfaceReading::Elastic};
  bool quick = false;
  double budget_s = 0;  ///< 0: 180, or 20 where quick. Sizes that would not fit are skipped, and said to be
  MakeDrawer drawer;    ///< draws what a live camera's frames show
};

/// Measures, in this order: ceiling, sizes, solvers, outputs, live, rates, photon. On a stop (watch.stopped)
/// what is finished is kept and `complete` stays false. `keep` is called with all there is after each part.
Profile run_profile(const gpu::ContextOptions& device, const ProfileRequest& request, const Watch& watch,
                    const std::function<void(const Profile&)>& keep);

}  // namespace palpate::perf
