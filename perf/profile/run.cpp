#include "perf/profile/run.h"

#include <algorithm>
#include <limits>

#include "engine/base/text.h"
#include "engine/gpu/context.h"
#include "perf/profile/ceiling.h"
#include "perf/profile/machine.h"
#include "perf/profile/outputs.h"
#include "perf/profile/photon.h"
#include "perf/profile/rates.h"
#include "perf/profile/solvers.h"

namespace palpate::perf {
namespace {

constexpr double kBudget_s = 180, kQuickBudget_s = 20;
// Fractions of the budget; the rest is for plots and the report. What a part leaves goes to those after it.
constexpr double kCeiling = 0.06, kSizes = 0.33, kSolvers = 0.18, kOutputs = 0.14, kLive = 0.06,
                 kRates = 0.05, kPhoton = 0.11, kReport = 0.07;
// Frames and pipelines that the least of a part takes.
constexpr double kSolverFrames = 60, kSolverPipelines = 8, kOutputFrames = 40, kOutputPipelines = 10;

double pixels_of(const FrameSize& size) {
  return static_cast<double>(size.width_px) * size.height_px;
}

/// Time of so many frames and pipelines at a size, by the slowest reading there; infinite where it was not
/// measured.
double cost_s(const Profile& profile, const FrameSize& size, double frames, double pipelines) {
  double most_s = 0;
  for (const SizeFigure& s : profile.sizes)
    if (s.width_px == size.width_px && s.height_px == size.height_px)
      most_s = std::max(most_s, 1e-3 * (frames * s.latency.median_ms + pipelines * s.setup_ms));
  return most_s > 0 ? most_s : std::numeric_limits<double>::infinity();
}

/// Errors and costs are measured where cameras are: of 640 x 480 and 1392 x 1042 those that were measured and
/// fit into the time; where neither does, the largest that does, or the smallest.
std::vector<FrameSize> camera_sizes(const Profile& profile, std::vector<FrameSize> ladder, double frames,
                                    double pipelines, double seconds) {
  std::sort(ladder.begin(), ladder.end(),
            [](const FrameSize& a, const FrameSize& b) { return pixels_of(a) < pixels_of(b); });
  double left_s = seconds;
  const auto fits = [&](const FrameSize& size) {
    const double cost = cost_s(profile, size, frames, pipelines);
    if (cost > left_s) return false;
    left_s -= cost;
    return true;
  };
  std::vector<FrameSize> sizes;
  for (const FrameSize& size : {FrameSize{640, 480}, FrameSize{1392, 1042}})
    if (fits(size)) sizes.push_back(size);
  for (size_t i = ladder.size(); i-- > 0 && sizes.empty();)
    if (i == 0 || fits(ladder[i])) sizes.push_back(ladder[i]);
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
  // A part's fraction of what is left, of the fractions of the parts that are left.
  const auto seconds_of = [&](double part, double later) {
    const double left_s = profile.budget_s - (wall_now_s() - start_s);
    return std::max(0.0, left_s * part / (part + later + kReport));
  };

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
  measure_sizes(device, sizes, request.readings,
                seconds_of(kSizes, kSolvers + kOutputs + kLive + kRates + kPhoton), watch, profile);
  if (!finished()) return profile;
  double seconds = seconds_of(kSolvers, kOutputs + kLive + kRates + kPhoton);
  measure_solvers(device, camera_sizes(profile, sizes, kSolverFrames, kSolverPipelines, seconds), seconds,
                  watch, profile);
  if (!finished()) return profile;
  seconds = seconds_of(kOutputs, kLive + kRates + kPhoton);
  measure_outputs(device, camera_sizes(profile, sizes, kOutputFrames, kOutputPipelines, seconds).back(),
                  seconds, watch, profile);
  if (!finished()) return profile;
  seconds = seconds_of(kLive, kRates + kPhoton);
  measure_live(device, camera_sizes(profile, sizes, 0, 2, seconds), request.drawer, seconds, watch, profile);
  if (!finished()) return profile;
  measure_rates(device, seconds_of(kRates, kPhoton), watch, profile);
  if (!finished()) return profile;
  measure_photon(device, request.drawer, seconds_of(kPhoton, 0), watch, profile);
  profile.complete = !watch.stopped();
  finished();
  return profile;
}

}  // namespace palpate::perf
