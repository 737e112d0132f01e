#include "perf/profile/solvers.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <random>

#include "capture/heights.h"
#include "engine/gpu/commands.h"
#include "engine/gpu/context.h"
#include "engine/solve/poisson_dct.h"
#include "engine/stages/contact.h"
#include "engine/stages/slope.h"
#include "engine/stages/surface.h"
#include "engine/tuning.h"
#include "perf/rivals.h"

namespace palpate::perf {
namespace {

constexpr double kSlopeNoise = 0.02;  // of the steepest slope

struct Truth {
  std::string name;
  std::vector<double> height;    ///< height x width, about its mean
  std::vector<float> gradients;  ///< height x width x 2
};

Truth make_truth(const std::string& name, const scenes::HeightField& field, const FrameSize& size,
                 bool noisy) {
  Truth truth;
  truth.name = name;
  truth.gradients = scenes::gradients(field, size.height_px, size.width_px);
  for (uint32_t y = 0; y < size.height_px; ++y)
    for (uint32_t x = 0; x < size.width_px; ++x) truth.height.push_back(field.height(x, y));
  if (noisy) {
    float steepest = 0;
    for (const float g : truth.gradients) steepest = std::max(steepest, std::abs(g));
    std::mt19937 random(1);
    std::normal_distribution<float> noise(0, static_cast<float>(kSlopeNoise) * steepest);
    for (float& g : truth.gradients) g += noise(random);
  }
  return truth;
}

std::vector<Truth> make_truths(const FrameSize& size) {
  const double w = size.width_px, h = size.height_px, side = std::min(w, h);
  const auto bump = scenes::gaussian(w / 2, h / 2, side / 10, side / 20);
  std::vector<Truth> truths;
  truths.push_back(make_truth("smooth", bump, size, false));
  truths.push_back(make_truth("wide", scenes::broad_press(w, h, side / 20), size, false));
  truths.push_back(make_truth("tilted", scenes::tilt(), size, false));
  truths.push_back(
      make_truth("capped", scenes::cap(w / 2 + 0.3, h / 2 - 0.2, side / 3, side / 6), size, false));
  truths.push_back(make_truth("noisy", bump, size, true));
  return truths;
}

struct Errors {
  double relative_rms = 0;
  double peak_to_valley = 0;
};

/// `at(x, y)` is the height found, up to a constant.
template <typename At>
Errors errors_of(const Truth& truth, const FrameSize& size, At at) {
  const double n = static_cast<double>(size.width_px) * size.height_px;
  double mean_truth = 0, mean_found = 0;
  double low_truth = INFINITY, high_truth = -INFINITY, low_found = INFINITY, high_found = -INFINITY;
  size_t i = 0;
  for (uint32_t y = 0; y < size.height_px; ++y) {
    for (uint32_t x = 0; x < size.width_px; ++x, ++i) {
      const double t = truth.height[i], f = at(x, y);
      mean_truth += t / n;
      mean_found += f / n;
      low_truth = std::min(low_truth, t);
      high_truth = std::max(high_truth, t);
      low_found = std::min(low_found, f);
      high_found = std::max(high_found, f);
    }
  }
  double error = 0, whole = 0;
  i = 0;
  for (uint32_t y = 0; y < size.height_px; ++y) {
    for (uint32_t x = 0; x < size.width_px; ++x, ++i) {
      const double t = truth.height[i] - mean_truth, f = at(x, y) - mean_found;
      error += (f - t) * (f - t);
      whole += t * t;
    }
  }
  return {std::sqrt(error / whole), std::abs((high_found - low_found) / (high_truth - low_truth) - 1)};
}

/// Gradients on the GPU, and one solver there.
class GpuSolver {
 public:
  GpuSolver(gpu::Context& context, const FrameSize& size, SurfaceSolver solver)
      : size_(size),
        surface_(context, size.width_px, size.height_px, solver, load_tuning(context).tuning),
        slope_(context, size.width_px, size.height_px, load_tuning(context).tuning),
        grid_(surface_.grid()),
        p_(context, "d/dx", grid_),
        q_(context, "d/dy", grid_),
        depth_(context, "heights", grid_),
        up_p_(context, "d/dx upload", grid_.bytes(), gpu::Memory::Upload),
        up_q_(context, "d/dy upload", grid_.bytes(), gpu::Memory::Upload),
        right_(context, "right side readback", grid_.bytes(), gpu::Memory::Readback),
        heights_(context, "heights readback", grid_.bytes(), gpu::Memory::Readback),
        load_(context),
        solve_(context),
        read_(context) {
    load_.begin();
    load_.copy(up_p_, p_.buffer, grid_.bytes());
    load_.copy(up_q_, q_.buffer, grid_.bytes());
    load_.barrier();
    slope_.record_given(load_, p_, q_, surface_);
    load_.copy(surface_.right_side().buffer, right_, grid_.bytes());
    load_.host_barrier();
    load_.end();
    if (solver != SurfaceSolver::Exact) {
      solve_.begin();
      surface_.record(solve_, depth_);
      solve_.end();
    }
    read_.begin();
    read_.copy(depth_.buffer, heights_, grid_.bytes());
    read_.host_barrier();
    read_.end();
  }

  void load(const Truth& truth) {
    const std::span<float> p = up_p_.as<float>(), q = up_q_.as<float>();
    std::fill(p.begin(), p.end(), 0.0f);
    std::fill(q.begin(), q.end(), 0.0f);
    for (size_t y = 0; y < size_.height_px; ++y) {
      for (size_t x = 0; x < size_.width_px; ++x) {
        p[y * pitch() + x] = truth.gradients[2 * (y * size_.width_px + x)];
        q[y * pitch() + x] = truth.gradients[2 * (y * size_.width_px + x) + 1];
      }
    }
    up_p_.flush();
    up_q_.flush();
    run(load_);
    right_.invalidate();
  }
  void solve() { run(solve_); }
  Errors errors(const Truth& truth) {
    run(read_);
    heights_.invalidate();
    const auto z = heights_.as<const float>();
    return errors_of(truth, size_,
                     [&](uint32_t x, uint32_t y) { return double{z[size_t{y} * pitch() + x]}; });
  }

  /// What the ways on the CPU start from: height x width.
  std::vector<float> right_side() const {
    const auto f = right_.as<const float>();
    std::vector<float> rows;
    for (size_t y = 0; y < size_.height_px; ++y)
      rows.insert(rows.end(), f.begin() + static_cast<std::ptrdiff_t>(y * pitch()),
                  f.begin() + static_cast<std::ptrdiff_t>(y * pitch() + size_.width_px));
    return rows;
  }

 private:
  size_t pitch() const { return size_t{grid_.pitch} * 4; }
  static void run(gpu::Commands& commands) {
    commands.submit();
    commands.wait();
  }

  FrameSize size_;
  Surface surface_;
  Slope slope_;
  Grid grid_;
  FloatMap p_, q_, depth_;
  gpu::DeviceBuffer up_p_, up_q_, right_, heights_;
  gpu::Commands load_, solve_, read_;
};

/// The smallest size from `n` on that FFTW likes: only the factors 2, 3, 5 and 7.
uint32_t good_size(uint32_t n) {
  for (uint32_t size = n;; ++size) {
    uint32_t rest = size;
    for (const uint32_t factor : {2u, 3u, 5u, 7u})
      while (rest % factor == 0) rest /= factor;
    if (rest == 1) return size;
  }
}

/// All ways at one size, built once and used for every truth.
class Ways {
 public:
  Ways(gpu::Context& context, const FrameSize& size)
      : size_(size),
        live_(context, size, SurfaceSolver::Live),
        converged_(context, size, SurfaceSolver::Converged),
        exact_(size.width_px, size.height_px),
        fftw_(size.width_px, size.height_px, size.width_px, size.height_px),
        z_(size_t{size.width_px} * size.height_px) {
    const uint32_t width = good_size(size.width_px), height = good_size(size.height_px);
    if (width != size.width_px || height != size.height_px)
      padded_ = std::make_unique<FftwPoisson>(size.width_px, size.height_px, width, height);
  }

  /// False where it was stopped.
  bool measure(const Truth& truth, double seconds, const Watch& watch, std::vector<SolverFigure>& figures) {
    live_.load(truth);
    converged_.load(truth);
    right_ = live_.right_side();
    struct Way {
      const char* where;
      std::function<Errors()> errors;
    };
    const auto on_host = [&] {
      return errors_of(truth, size_,
                       [&](uint32_t x, uint32_t y) { return double{z_[size_t{y} * size_.width_px + x]}; });
    };
    std::vector<Contender> contenders;
    std::vector<Way> ways;
    const auto add = [&](const char* name, const char* where, std::function<void()> run,
                         std::function<Errors()> errors) {
      contenders.push_back({name, std::move(run)});
      ways.push_back({where, std::move(errors)});
    };
    add(
        "live", "GPU", [&] { live_.solve(); }, [&] { return live_.errors(truth); });
    add(
        "converged", "GPU", [&] { converged_.solve(); }, [&] { return converged_.errors(truth); });
    add(
        "exact", "CPU", [&] { exact_.solve(right_.data(), z_.data(), size_.width_px); }, on_host);
    add(
        "FFTW", "CPU", [&] { fftw_.solve(right_.data(), z_.data()); }, on_host);
    if (padded_)
      add(
          "FFTW padded", "CPU", [&] { padded_->solve(right_.data(), z_.data()); }, on_host);
    add(
        "line integral", "CPU",
        [&] { line_integral(truth.gradients.data(), size_.width_px, size_.height_px, z_.data()); }, on_host);

    const Rounds rounds{5, 100, seconds};
    if (!take_turns(contenders, rounds, watch)) return false;
    std::vector<double> time, error;
    const size_t first = figures.size();
    for (size_t i = 0; i < contenders.size(); ++i) {
      contenders[i].run();
      const Errors errors = ways[i].errors();
      SolverFigure figure;
      figure.truth = truth.name;
      figure.width_px = size_.width_px;
      figure.height_px = size_.height_px;
      figure.solver = contenders[i].name;
      figure.where = ways[i].where;
      figure.relative_rms_error = errors.relative_rms;
      figure.peak_to_valley_error = errors.peak_to_valley;
      figure.time = distribution_of(contenders[i].wall_ms);
      figure.cpu_ms = median(contenders[i].cpu_ms);
      time.push_back(figure.time.median_ms);
      error.push_back(figure.relative_rms_error);
      figures.push_back(std::move(figure));
    }
    const std::vector<bool> front = pareto_front(time, error);
    for (size_t i = 0; i < front.size(); ++i) figures[first + i].on_front = front[i];
    return true;
  }

 private:
  FrameSize size_;
  GpuSolver live_, converged_;
  PoissonDct exact_;
  FftwPoisson fftw_;
  std::unique_ptr<FftwPoisson> padded_;
  std::vector<float> right_, z_;
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
      profile.skipped.push_back({what, "the time budget is used up"});
      watch.say(what + ": skipped, the time budget is used up");
      continue;
    }
    Ways ways(context, sizes[i]);
    const std::vector<Truth> truths = make_truths(sizes[i]);
    const double share_s =
        std::max(0.0, end_s - wall_now_s()) / static_cast<double>((sizes.size() - i) * truths.size());
    for (const Truth& truth : truths) {
      if (!ways.measure(truth, share_s, watch, profile.solvers)) return;
    }
    watch.say(what + ": done");
  }
  watch.leave(context);
}

}  // namespace palpate::perf
