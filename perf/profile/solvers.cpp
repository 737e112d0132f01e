#include "perf/profile/solvers.h"

#include <memory>

#include "engine/gpu/context.h"
#include "engine/numeric/poisson_dct.h"
#include "perf/profile/gpu_solvers.h"
#include "perf/profile/truths.h"

namespace palpate::perf {
namespace {

/// All ways at one size, built once and used for every truth.
class Ways {
 public:
  Ways(gpu::Context& context, const FrameSize& size)
      : size_(size),
        slopes_(context, size),
        live_(context, slopes_, Solve::Live),
        converged_(context, slopes_, Solve::Converged),
        weighted_live_(context, slopes_, WeightedSurface::kLiveIterations),
        weighted_(context, slopes_, WeightedSurface::kConvergedIterations),
        exact_(size.width_px, size.height_px) {}

  /// False where it was stopped.
  bool measure(const Truth& truth, double seconds, const Watch& watch, std::vector<SolverFigure>& figures) {
    slopes_.load(truth);
    converged_.prepare();
    right_ = converged_.right_side();
    ways_.clear();
    contenders_.clear();
    add_all(truth);
    if (!take_turns(contenders_, {3, 100, seconds, true, cold_}, watch)) return false;
    cold_ = false;

    std::vector<double> time, error;
    const size_t first = figures.size();
    for (size_t i = 0; i < contenders_.size(); ++i) {
      const SurfaceErrors errors = ways_[i].errors();
      SolverFigure figure;
      figure.truth = truth.name;
      figure.width_px = size_.width_px;
      figure.height_px = size_.height_px;
      figure.solver = contenders_[i].name;
      figure.where = ways_[i].where;
      figure.relative_rms_error = errors.relative_rms;
      figure.peak_to_valley_error = errors.peak_to_valley;
      figure.time = distribution_of(contenders_[i].wall_ms);
      figure.cpu_ms = quantile(contenders_[i].cpu_ms, 0.5);
      time.push_back(figure.time.median_ms);
      error.push_back(figure.relative_rms_error);
      figures.push_back(std::move(figure));
    }
    const std::vector<bool> front = pareto_front(time, error);
    for (size_t i = 0; i < front.size(); ++i) figures[first + i].on_front = front[i];
    return true;
  }

 private:
  struct Way {
    const char* where;
    std::function<SurfaceErrors()> errors;
  };

  template <typename Solver>
  void add_gpu(const char* name, Solver& solver, const Truth& truth) {
    contenders_.push_back({name, [&solver] { solver.solve(); }, [&solver] { solver.prepare(); }});
    ways_.push_back({"GPU", [&solver, &truth] { return solver.errors(truth); }});
  }
  /// `solve` writes height x width heights.
  void add_cpu(const char* name, const Truth& truth, const std::function<void(float*)>& solve) {
    auto z = std::make_shared<std::vector<float>>(size_t{size_.width_px} * size_.height_px);
    contenders_.push_back({name, [solve, z] { solve(z->data()); }});
    ways_.push_back({"CPU", [this, z, &truth] {
                       return errors_of(truth, size_, [&](uint32_t x, uint32_t y) {
                         return (*z)[size_t{y} * size_.width_px + x];
                       });
                     }});
  }

  void add_all(const Truth& truth) {
    add_gpu("live", live_, truth);
    add_gpu("best, device", converged_, truth);
    add_gpu("live, weighted", weighted_live_, truth);
    add_gpu("best, weighted", weighted_, truth);
    add_cpu("best, host", truth, [this](float* z) { exact_.solve(right_.data(), z, size_.width_px); });
    add_cpu("line integral", truth, [this, gradients = truth.gradients.data()](float* z) {
      line_integral(gradients, size_.width_px, size_.height_px, z);
    });
  }

  FrameSize size_;
  GpuSlopes slopes_;
  MultigridSolver live_, converged_;
  WeightedSolver weighted_live_, weighted_;
  PoissonDct exact_;
  bool cold_ = true;
  std::vector<float> right_;
  std::vector<Way> ways_;
  std::vector<Contender> contenders_;
};

}  // namespace

std::vector<bool> pareto_front(std::span<const double> time, std::span<const double> error) {
  std::vector<bool> front(time.size(), true);
  for (size_t i = 0; i < time.size(); ++i) {
    for (size_t j = 0; j < time.size(); ++j) {
      const bool as_good = time[j] <= time[i] && error[j] <= error[i];
      if (as_good && (time[j] < time[i] || error[j] < error[i])) front[i] = false;
    }
  }
  return front;
}

void measure_solvers(const gpu::ContextOptions& device, const std::vector<FrameSize>& sizes, double seconds,
                     const Watch& watch, Profile& profile) {
  gpu::Context context(device);
  const double end_s = wall_now_s() + seconds;
  for (size_t i = 0; i < sizes.size(); ++i) {
    const std::string what = "error against run time at " + size_text(sizes[i].width_px, sizes[i].height_px);
    const double left_s = end_s - wall_now_s();
    if (i > 0 && left_s <= 0) {
      skip(what, watch, profile);
      continue;
    }
    Ways ways(context, sizes[i]);
    const std::vector<Truth> truths = make_truths(sizes[i]);
    const double share_s =
        std::max(0.0, end_s - wall_now_s()) / static_cast<double>((sizes.size() - i) * truths.size());
    double last_s = 0;
    for (size_t t = 0; t < truths.size(); ++t) {
      const double begin_s = wall_now_s();
      if (t > 0 && end_s - begin_s < last_s / 2) {
        skip(what + ", truth " + truths[t].name, watch, profile);
        continue;
      }
      if (!ways.measure(truths[t], share_s, watch, profile.solvers)) return;
      last_s = wall_now_s() - begin_s;
    }
    watch.say(what + ": done");
  }
  watch.leave(context);
}

}  // namespace palpate::perf
