#include "perf/lab/kernels/tune.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <memory>
#include <optional>

#include "capture/synthetic/synthetic.h"
#include "engine/gpu/commands.h"
#include "engine/gpu/context.h"
#include "engine/pipeline/pipeline_access.h"
#include "engine/stages/frame/contact.h"
#include "engine/stages/frame/upload.h"
#include "engine/stages/surface/rest_level.h"
#include "engine/stages/surface/slope.h"
#include "engine/stages/surface/surface.h"
#include "palpate/error.h"
#include "palpate/pipeline.h"

namespace palpate::perf {
namespace {

constexpr double kLeastGain = 0.01;
constexpr double kSample_ms = 3;  // long enough for the clock of CPU time, and for warm caches
constexpr int kSweeps = 2;        // over all constants; the second only over those whose neighbours changed

enum class Stage { Contact, ContactKeeping, Slope, Surface, RestLevel };

/// Which stages a constant shapes, and which constants shape each other.
struct Reach {
  const char* prefix;
  std::vector<Stage> stages;
};
std::vector<Stage> stages_of(const std::string& field) {
  static const Reach kReaches[] = {
      {"contact_rows_keeping", {Stage::ContactKeeping}},
      {"contact_workgroup", {Stage::Contact, Stage::ContactKeeping}},
      {"contact_tiles", {Stage::Contact, Stage::ContactKeeping}},
      {"contact", {Stage::Contact}},
      {"slope", {Stage::Slope}},
      {"surface", {Stage::Surface}},
      {"coarsest", {Stage::Surface}},
      {"rest_level", {Stage::RestLevel}},
  };
  for (const Reach& reach : kReaches)
    if (field.starts_with(reach.prefix)) return reach.stages;
  return {Stage::Contact, Stage::ContactKeeping, Stage::Slope, Stage::Surface, Stage::RestLevel};
}

/// One frame with contact of one sensor on the GPU, and every stage's input.
struct Scene {
  Scene(gpu::Context& gpu_context, TuneRequest::Size size, SyntheticMode mode)
      : context(gpu_context), options(options_for(size, mode)), sensor(synthetic_sensor(options)) {
    const SyntheticSensor source(options);
    rest = *source.own_background();
    source.render(source.frame_count().value_or(2) / 2, image);
    const Tuning usual = default_tuning(context);
    keeps = sensor.reading == SurfaceReading::Shading;
    contact.emplace(context, sensor, image.format, keeps, usual);
    surface.emplace(context, size.width, size.height, Solve::Live, usual);
    frame.emplace(context, "frame", image.format);
    background.emplace(context, "background", image.format);
    frame->write(image);
    background->write(rest);
    records = gpu::DeviceBuffer(context, "records", contact->record_bytes(), gpu::Memory::Readback);
    depth = FloatMap(context, "depth", surface->grid());
    slope.emplace(context, sensor, image.format, *contact, surface->right_sides(), usual);
    clipped = gpu::DeviceBuffer(context, "clipped pixels", slope->clipped_bytes(), gpu::Memory::Readback);
    gpu::Commands commands(context);
    commands.begin();
    frame->record(commands);
    background->record(commands);
    commands.barrier();
    contact->record(commands, *frame, *background, records);
    slope->record(commands, *frame, *background, *surface, clipped);
    surface->record(commands, depth);
    commands.end();
    commands.submit();
    commands.wait();
  }

  static SyntheticOptions options_for(TuneRequest::Size size, SyntheticMode mode) {
    SyntheticOptions o;
    o.scene = "slide";
    o.width = size.width;
    o.height = size.height;
    o.mode = mode;
    return o;
  }

  gpu::Context& context;
  SyntheticOptions options;
  Sensor sensor;
  Frame rest, image;
  bool keeps = false;
  std::optional<Contact> contact;
  std::optional<Slope> slope;
  gpu::DeviceBuffer clipped;
  std::optional<Surface> surface;
  std::optional<PaddedImage> frame, background;
  gpu::DeviceBuffer records;
  FloatMap depth;
};

/// One stage with one tuning, recorded once and run often.
class Run {
 public:
  Run(const Scene& scene, Stage stage, const Tuning& tuning) : context_(scene.context), commands_(context_) {
    const Frame& image = scene.image;
    if (stage == Stage::Contact || stage == Stage::ContactKeeping) {
      contact_.emplace(context_, scene.sensor, image.format, stage == Stage::ContactKeeping, tuning);
      records_ = gpu::DeviceBuffer(context_, "records", contact_->record_bytes(), gpu::Memory::Readback);
    } else if (stage == Stage::Slope) {
      slope_.emplace(context_, scene.sensor, image.format, *scene.contact, scene.surface->right_sides(),
                     tuning);
      clipped_ =
          gpu::DeviceBuffer(context_, "clipped pixels", slope_->clipped_bytes(), gpu::Memory::Readback);
    } else if (stage == Stage::Surface) {
      surface_.emplace(context_, image.format.width, image.format.height, Solve::Live, tuning);
      gpu::Commands fill(context_);
      fill.begin();
      scene.slope->record(fill, *scene.frame, *scene.background, *surface_, scene.clipped);
      fill.end();
      fill.submit();
      fill.wait();
    } else {
      rest_level_.emplace(context_, *scene.contact, scene.surface->grid(), tuning);
      records_ = gpu::DeviceBuffer(context_, "rest level records", rest_level_->record_bytes(),
                                   gpu::Memory::Readback);
    }
    commands_.begin();
    if (contact_) contact_->record(commands_, *scene.frame, *scene.background, records_);
    if (slope_) slope_->record(commands_, *scene.frame, *scene.background, *scene.surface, clipped_);
    if (surface_) surface_->record(commands_, scene.depth);
    if (rest_level_) rest_level_->record(commands_, scene.depth, scene.records, records_);
    commands_.end();
    once();  // what the driver does at a first run is not the kernel's time
    const double ms = std::max(time_runs([this] { once(); }, 1).wall_ms, 1e-3);
    runs_ = static_cast<int>(std::clamp(std::ceil(kSample_ms / ms), 1.0, 100.0));
  }

  void once() {
    commands_.submit();
    commands_.wait();
  }
  /// Cost of a run, ms: the geometric mean of wall and CPU time where the processor is the device, else the
  /// GPU's own time, or wall time where it has no timestamps.
  double cost_ms() {
    if (context_.is_software()) {
      const Sample s = time_runs([this] { once(); }, runs_);
      return std::sqrt(std::max(s.wall_ms, 1e-6) * std::max(s.cpu_ms, 1e-6));
    }
    double gpu_ms = 0;
    const Sample s = time_runs(
        [&] {
          once();
          for (const gpu::ScopeTime& t : commands_.times()) gpu_ms += t.ms;
        },
        runs_);
    return gpu_ms > 0 ? gpu_ms / runs_ : s.wall_ms;
  }

 private:
  gpu::Context& context_;
  std::optional<Contact> contact_;
  std::optional<Slope> slope_;
  gpu::DeviceBuffer clipped_;
  std::optional<Surface> surface_;
  std::optional<RestLevel> rest_level_;
  gpu::DeviceBuffer records_;
  gpu::Commands commands_;
  int runs_ = 1;
};

class Search {
 public:
  Search(gpu::Context& context, const TuneRequest& request) : context_(context), request_(request) {
    for (const TuneRequest::Size size : request.sizes)
      for (const SyntheticMode mode : {SyntheticMode::Lambert, SyntheticMode::Gel})
        scenes_.push_back(std::make_unique<Scene>(context, size, mode));
  }

  Tuned run() {
    Tuned result;
    result.clock = context_.is_software() ? "wall and process CPU time"
                   : context_.timers()    ? "GPU timestamps"
                                          : "wall time";
    const Tuning usual = default_tuning(context_);
    result.tuning = usual;
    for (const TuningField& field : tuning_fields())
      result.fields.push_back(
          {field.name, usual.*field.value, usual.*field.value, usual.*field.value, {1, 1, 1}});
    std::vector<Stage> changed;
    for (int sweep = 0; sweep < kSweeps; ++sweep) {
      if (sweep > 0 && elapsed_s() > request_.seconds) break;
      std::vector<Stage> now_changed;
      for (size_t i = 0; i < result.fields.size(); ++i) {
        const TuningField& field = tuning_fields()[i];
        const std::vector<Stage> stages = stages_of(field.name);
        const auto touched = [&](Stage s) {
          return std::find(changed.begin(), changed.end(), s) != changed.end();
        };
        if (sweep > 0 && std::none_of(stages.begin(), stages.end(), touched)) continue;
        if (request_.stopped()) return result;
        request_.say(field.name);
        if (!improve(field, stages, result.tuning, result.fields[i])) continue;
        now_changed.insert(now_changed.end(), stages.begin(), stages.end());
      }
      changed = now_changed;
    }
    if (request_.stopped()) return result;
    request_.say("whole frames");
    result.frame_time = whole_frames(usual, result.tuning);
    result.frames_gained = result.tuning == usual || result.frame_time.median <= 1;
    if (!result.frames_gained) {
      result.tuning = usual;
      for (TunedField& f : result.fields) f.chosen = f.usual;
    }
    result.complete = !request_.stopped();
    return result;
  }

 private:
  struct Candidate {
    uint32_t value;
    std::vector<std::unique_ptr<Run>> runs;
    std::vector<double> ratios;  ///< one a repetition: cost over the present value's, mean over scenes
  };

  Candidate make(const TuningField& field, const std::vector<Stage>& stages, Tuning tuning, uint32_t value) {
    tuning.*field.value = value;
    Candidate c{value, {}, {}};
    for (const auto& scene : scenes_)
      for (const Stage stage : stages)
        // Only gray frames are ever kept filtered.
        if (stage != Stage::ContactKeeping || scene->keeps)
          c.runs.push_back(std::make_unique<Run>(*scene, stage, tuning));
    return c;
  }

  /// One turn: every candidate against the present value, scene by scene.
  void turn(Candidate& present, std::vector<Candidate*>& others) {
    std::vector<double> logs(others.size(), 0);
    for (size_t run = 0; run < present.runs.size(); ++run) {
      const double base = present.runs[run]->cost_ms();
      for (size_t i = 0; i < others.size(); ++i) logs[i] += std::log(others[i]->runs[run]->cost_ms() / base);
    }
    for (size_t i = 0; i < others.size(); ++i)
      others[i]->ratios.push_back(std::exp(logs[i] / static_cast<double>(present.runs.size())));
  }

  /// Tries a constant's candidates; true if it changed.
  bool improve(const TuningField& field, const std::vector<Stage>& stages, Tuning& tuning,
               TunedField& report) {
    Candidate present = make(field, stages, tuning, tuning.*field.value);
    std::vector<Candidate> candidates;
    for (const uint32_t value : field.candidates) {
      if (value == present.value) continue;
      Tuning tried = tuning;
      tried.*field.value = value;
      try {
        validate(tried, context_.properties().limits);
      } catch (const Error&) {
        continue;  // beyond this device
      }
      candidates.push_back(make(field, stages, tuning, value));
    }
    if (candidates.empty()) return false;
    std::vector<Candidate*> all;
    all.reserve(candidates.size());
    for (Candidate& c : candidates) all.push_back(&c);
    // Screening may take two fifths of a constant's fraction of the time, the decision the rest.
    const double share_s = request_.seconds / static_cast<double>(tuning_fields().size());
    repeat(std::max(3, request_.repetitions / 3), 3, 0.4 * share_s, [&] { turn(present, all); });
    if (request_.stopped()) return false;
    Candidate* best = *std::min_element(all.begin(), all.end(), [](const Candidate* a, const Candidate* b) {
      return quartiles(a->ratios).median < quartiles(b->ratios).median;
    });
    // The best of many looks better than it is: what decides is measured anew.
    best->ratios.clear();
    std::vector<Candidate*> one{best};
    repeat(request_.repetitions, 5, 0.6 * share_s, [&] { turn(present, one); });
    if (request_.stopped()) return false;
    const Quartiles time = quartiles(best->ratios);
    const bool better = time.high < 1 - kLeastGain;
    // A second sweep that finds nothing leaves the first one's gain standing, and what it finds adds to it.
    const double before = report.chosen == report.usual ? 1 : report.best_time.median;
    if (better || report.chosen == report.usual) {
      report.best = best->value;
      report.best_time = {before * time.low, before * time.median, before * time.high};
    }
    if (!better) return false;
    report.chosen = best->value;
    tuning.*field.value = best->value;
    return true;
  }

  /// At least `least` times, at most `most`, and in between until the time is over.
  void repeat(int most, int least, double seconds, const std::function<void()>& work) const {
    const double end = elapsed_s() + seconds;
    for (int i = 0; i < most && !request_.stopped() && (i < std::min(least, most) || elapsed_s() < end); ++i)
      work();
  }

  Quartiles whole_frames(const Tuning& usual, const Tuning& chosen) {
    if (usual == chosen) return {1, 1, 1};
    struct Both {
      Pipeline usual, chosen;
      const Scene* scene;
    };
    std::vector<Both> all;
    all.reserve(scenes_.size());
    for (const auto& scene : scenes_) {
      const auto make_pipeline = [&](const Tuning& tuning) {
        PipelineOptions options;
        options.slots = 1;
        Pipeline pipeline =
            PipelineAccess::tuned(context_, scene->sensor, scene->image.format, options, tuning);
        pipeline.set_background(scene->rest);
        pipeline.process(scene->image);
        return pipeline;
      };
      all.push_back({make_pipeline(usual), make_pipeline(chosen), scene.get()});
    }
    std::vector<double> ratios;
    repeat(request_.repetitions, 5, 0.1 * request_.seconds, [&] {
      double sum = 0;
      for (Both& both : all) sum += std::log(cost(both.chosen, *both.scene) / cost(both.usual, *both.scene));
      ratios.push_back(std::exp(sum / static_cast<double>(all.size())));
    });
    return ratios.empty() ? Quartiles{1, 1, 1} : quartiles(ratios);
  }

  double elapsed_s() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  }

  double cost(Pipeline& pipeline, const Scene& scene) const {
    const Sample s = time_runs([&] { pipeline.process(scene.image); }, 2);
    return context_.is_software() ? std::sqrt(s.wall_ms * std::max(s.cpu_ms, 1e-6)) : s.wall_ms;
  }

  gpu::Context& context_;
  const TuneRequest& request_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
  std::vector<std::unique_ptr<Scene>> scenes_;
};

}  // namespace

Tuned measure_tuning(gpu::Context& context, const TuneRequest& request) {
  return Search(context, request).run();
}

}  // namespace palpate::perf
