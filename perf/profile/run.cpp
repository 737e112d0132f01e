#include "perf/profile/run.h"

#include <algorithm>
#include <cstdio>

#include "engine/base/text.h"
#include "engine/gpu/context.h"
#include "perf/profile/ceiling.h"
#include "perf/profile/machine.h"
#include "perf/profile/outputs.h"
#include "perf/profile/solvers.h"

namespace palpate::perf {
namespace {

constexpr double kBudget_s = 180, kQuickBudget_s = 20;
// Fractions of the budget.
constexpr double kCeiling = 0.06, kSizes = 0.45, kSolvers = 0.22, kOutputs = 0.18, kLive = 0.09;

/// Errors and costs are measured where cameras are: 640 x 480, and 1392 x 1042 where the ladder goes that
/// far.
std::vector<FrameSize> camera_sizes(const std::vector<FrameSize>& ladder) {
  uint64_t most = 0;
  for (const FrameSize& size : ladder) most = std::max(most, uint64_t{size.width_px} * size.height_px);
  std::vector<FrameSize> sizes;
  for (const FrameSize& size : {FrameSize{640, 480}, FrameSize{1392, 1042}})
    if (uint64_t{size.width_px} * size.height_px <= most) sizes.push_back(size);
  if (sizes.empty()) sizes.push_back(ladder.back());
  return sizes;
}

}  // namespace

Profile run_profile(const gpu::ContextOptions& device, const ProfileRequest& request, const Watch& watch,
                    const std::function<void(const Profile&)>& keep) {
  const double start_s = wall_now_s();
  Profile profile;
  profile.budget_s = request.budget_s > 0 ? request.budget_s : request.quick ? kQuickBudget_s : kBudget_s;
  profile.machine = describe_machine(gpu::Context(device));
  const std::vector<FrameSize> sizes = request.sizes.empty() ? default_sizes(request.quick) : request.sizes;
  const std::vector<FrameSize> cameras = camera_sizes(sizes);

  const auto finished = [&] {
    profile.elapsed_s = wall_now_s() - start_s;
    keep(profile);
    return !watch.stopped();
  };
  const uint64_t largest_bytes = uint64_t{request.quick ? 64u : 256u} << 20;
  profile.ceiling = measure_ceiling(device, largest_bytes, kCeiling * profile.budget_s, watch);
  const std::string line = text("memory: %.3g GB/s; stages are timed by the %s clock",
                                profile.ceiling.GB_per_s, profile.ceiling.clock.c_str());
  watch.say(line);
  if (!finished()) return profile;
  measure_sizes(device, sizes, request.readings, kSizes * profile.budget_s, watch, profile);
  if (!finished()) return profile;
  measure_solvers(device, cameras, kSolvers * profile.budget_s, watch, profile);
  if (!finished()) return profile;
  measure_outputs(device, cameras.back(), kOutputs * profile.budget_s, watch, profile);
  if (!finished()) return profile;
  measure_live(device, cameras, request.drawer, kLive * profile.budget_s, watch, profile);
  profile.complete = !watch.stopped();
  finished();
  return profile;
}

}  // namespace palpate::perf
