#include "perf/profile/ceiling.h"

#include <algorithm>
#include <array>

#include "engine/gpu/buffer.h"
#include "engine/gpu/commands.h"
#include "engine/gpu/context.h"
#include "engine/gpu/kernel.h"
#include "shaders/stream.spv.h"

namespace palpate::perf {
namespace {

constexpr uint32_t kWorkgroup = 64;
constexpr uint32_t kTexelBytes = 16;
constexpr uint64_t kSmallest_bytes = uint64_t{1} << 20;
// In one sample, so that its submission weighs little; no less than the largest buffer.
constexpr uint64_t kMoved_bytes = uint64_t{64} << 20;
constexpr int kMostRepeats = 64;
constexpr double kClocksAgree = 0.2;  // without what a submission takes

struct StreamPush {
  uint32_t texels;
  uint32_t each;
};

/// The same work again and again in one submission; `times` is of all of them.
class Mover {
 public:
  Mover(gpu::Context& context, uint64_t bytes)
      : bytes_(bytes),
        repeats_(static_cast<int>(std::clamp<uint64_t>(kMoved_bytes / bytes, 1, kMostRepeats))),
        from_(context, "copy source", bytes, gpu::Memory::Device),
        to_(context, "copy target", bytes, gpu::Memory::Device),
        texels_(context, from_, VK_FORMAT_R32G32B32A32_SFLOAT),
        stream_(context, {"stream", k_stream},
                {{gpu::Binding::Texels, gpu::Binding::Storage}, sizeof(StreamPush), {kWorkgroup, 1, 1}, {}}),
        copying_(context),
        streaming_(context) {
    record(copying_, [&] { copying_.copy(from_, to_, bytes_); });
    // A processor wants few, long invocations; a GPU at least a thousand workgroups.
    const auto texels = static_cast<uint32_t>(bytes_ / kTexelBytes);
    const uint32_t most = context.is_software() ? 64 : 4096;
    const uint32_t groups = std::min((texels + kWorkgroup - 1) / kWorkgroup, most);
    const StreamPush push{texels, (texels + groups * kWorkgroup - 1) / (groups * kWorkgroup)};
    record(streaming_, [&] { streaming_.dispatch(stream_, {&texels_, &to_}, push, {groups, 1, 1}); });
    // Memory that was never written may not exist yet: a system can serve its reads from one page of zeros.
    gpu::run_once(context, [&](gpu::Commands& commands) {
      commands.dispatch(stream_, {&texels_, &to_}, push, {groups, 1, 1});
      commands.barrier();
      commands.copy(to_, from_, bytes_);
      commands.barrier();
    });
  }

  gpu::Commands& copying() { return copying_; }
  gpu::Commands& streaming() { return streaming_; }
  double GB_per_s(double ms) const { return 2.0 * static_cast<double>(bytes_) * repeats_ / (ms * 1e6); }

 private:
  template <typename Work>
  void record(gpu::Commands& commands, Work work) {
    commands.begin();
    {
      const auto scope = commands.scope("move");
      for (int i = 0; i < repeats_; ++i) {
        work();
        commands.barrier();
      }
    }
    commands.end();
  }

  uint64_t bytes_;
  int repeats_;
  gpu::DeviceBuffer from_, to_;
  gpu::TexelView texels_;
  gpu::Kernel stream_;
  gpu::Commands copying_, streaming_;
};

uint64_t affordable(const gpu::Context& context, uint64_t wanted_bytes) {
  const uint64_t texels = context.properties().limits.maxTexelBufferElements;
  return std::max(kSmallest_bytes,
                  std::min({wanted_bytes, context.report().memory_bytes / 8, texels * kTexelBytes}));
}

/// A submission and the wait for it, host clock, ms.
double run_ms(gpu::Commands& commands) {
  const double start_s = wall_now_s();
  commands.submit();
  commands.wait();
  return (wall_now_s() - start_s) * 1e3;
}

}  // namespace

Ceiling measure_ceiling(const gpu::ContextOptions& device, uint64_t largest_bytes, double seconds,
                        const Watch& watch) {
  gpu::ContextOptions options = device;
  options.timers = true;
  gpu::Context context(options);
  Ceiling ceiling;
  ceiling.clock = "host";

  gpu::Commands empty(context);
  empty.begin();
  empty.end();
  constexpr int kEmptyRuns = 50;
  std::vector<double> empty_ms;
  empty_ms.reserve(kEmptyRuns);
  for (int i = 0; i < kEmptyRuns; ++i) empty_ms.push_back(run_ms(empty));
  ceiling.submit_ms = quantile(empty_ms, 0.5);

  std::vector<uint64_t> sizes{affordable(context, largest_bytes)};
  while (sizes.back() / 4 >= kSmallest_bytes) sizes.push_back(sizes.back() / 4);
  const double share_s = seconds / (2.0 * static_cast<double>(sizes.size()));
  for (const uint64_t bytes : sizes) {
    if (watch.stopped()) break;
    Mover mover(context, bytes / kTexelBytes * kTexelBytes);
    // The largest goes first and decides whose clock times the rest.
    const bool first = ceiling.points.empty();
    std::array<double, 2> rate{};
    for (size_t way = 0; way < 2; ++way) {
      gpu::Commands& commands = way == 0 ? mover.copying() : mover.streaming();
      std::vector<double> host_ms, gpu_ms;
      run_ms(commands);
      const double start_s = wall_now_s();
      while (host_ms.size() < 3 || (host_ms.size() < 100 && wall_now_s() - start_s < share_s)) {
        host_ms.push_back(run_ms(commands));
        gpu_ms.push_back(commands.times().front().ms);
      }
      if (first && way == 0) {
        const double host = quantile(host_ms, 0.5);
        ceiling.clock_ratio =
            std::max(0.0, quantile(gpu_ms, 0.5) / std::max(host - ceiling.submit_ms, 0.1 * host));
        if (std::abs(ceiling.clock_ratio - 1) <= kClocksAgree) ceiling.clock = "GPU";
      }
      rate[way] = mover.GB_per_s(quantile(ceiling.clock == "GPU" ? gpu_ms : host_ms, 0.5));
    }
    ceiling.points.insert(ceiling.points.begin(), {bytes, rate[0], rate[1]});
    if (first) ceiling.GB_per_s = std::max(rate[0], rate[1]);
  }
  watch.leave(context);
  return ceiling;
}

}  // namespace palpate::perf
