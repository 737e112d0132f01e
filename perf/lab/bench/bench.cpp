// palpate-lab bench: contact, surface and whole frame against OpenCV's CPU chain and FFTW, in one run. See
// perf/README.md for the method.
#include "perf/lab/bench/bench.h"

#include <algorithm>
#include <filesystem>
#include <map>
#include <optional>

#include "capture/files/output_file.h"
#include "engine/base/json.h"
#include "engine/base/text.h"
#include "perf/lab/commands/commands.h"
#include "perf/lab/rivals/lump_scaling.h"
#include "perf/lab/rivals/matching_rival.h"
#include "perf/lab/rivals/spline_rival.h"
#include "perf/lab/rivals/traction_study.h"
#include "perf/lab/say.h"
#include "viz/commands/support/options.h"

namespace palpate::perf {

Pipeline Bench::make_pipeline(const Scene& scene, Outputs outputs, SurfaceSolver solver, Upload upload) {
  PipelineOptions options;
  options.outputs = outputs;
  options.upload = upload;
  options.solver = solver;
  Pipeline pipeline(context_, scene.sensor, scene.background.format, options);
  pipeline.set_background(scene.background);
  return pipeline;
}

int Bench::inner(const Size& size, int at_vga) {
  return std::max(3, static_cast<int>(at_vga * 307200 / (size.width * size.height)));
}

void Bench::add(const Pair& p) {
  csv_ += csv_row(p);
  say(text(
      "%-30s %-10s palpate %7.2f ms (p95 %7.2f, cpu %7.2f)  %-13s %7.2f ms (p95 %7.2f, cpu %7.2f)  ratio "
      "wall %.2f cpu %.2f\n",
      p.work.c_str(), p.size.c_str(), p.ours.wall_ms.median, p.ours.wall_ms.p95, p.ours.cpu_ms.median,
      p.rival.name.c_str(), p.rival.wall_ms.median, p.rival.wall_ms.p95, p.rival.cpu_ms.median, p.wall_ratio,
      p.cpu_ratio));
}

namespace {

struct Options {
  int repetitions = 21, seeds = 2;
  bool weighted = false, contacts = false, skin = false, gels = false, forward = false, splines = false;
  bool moduli = false, surfaces = false, matching = false, lumps = false, traction = false, stages = false;

  /// Name of the table of what was asked for.
  const char* table() const {
    return forward    ? "forward.csv"
           : weighted ? "weighted.csv"
           : skin     ? "skin.csv"
           : gels     ? "gels.csv"
           : contacts ? "contacts.csv"
           : surfaces ? "surfaces.csv"
                      : "bench.csv";
  }
  bool all() const { return !weighted && !forward && !skin && !gels && !contacts && !surfaces; }
};

/// Results of a benchmark, as files by their names.
using Files = std::map<std::string, std::string>;

Files study_splines(const Options& options) {
  const SplineStudy study = spline_study(std::min(options.repetitions, 5));
  say(study.words);
  return {{"splines.csv", study.csv}, {"splines.png", study.png}};
}

Files study_lumps() {
  const LumpScaling study = lump_scaling(std::filesystem::read_symlink("/proc/self/exe"));
  say(study.words);
  return {{"scaling.csv", study.csv},
          {"scaling.txt", study.words},
          {"scaling.png", study.png},
          {"scaling.svg", study.svg}};
}

Files study_traction(gpu::Context& context, const Options& options) {
  const std::string costs = traction_costs_csv(traction_costs(options.repetitions, &context));
  say(costs);
  const std::string stability = traction_stability_csv(traction_stability());
  say(stability);
  return {{"costs.csv", costs}, {"stability.csv", stability}};
}

/// None where what was asked for needs a device.
std::optional<Files> study_without_device(const Options& options) {
  if (options.splines) return study_splines(options);
  if (options.lumps) return study_lumps();
  if (options.matching) return Files{{"matching.csv", compare_matching(options.repetitions)}};
  return std::nullopt;
}

/// The requested benchmarks, at one size.
void time_size(Bench& bench, const Options& options, const Size& size) {
  if (options.weighted) {
    bench.weighted(size);
    return;
  }
  if (options.gels) {
    bench.gradient(size);
    bench.place_weights(size);
    bench.lookup(size);
    return;
  }
  if (options.skin) {
    bench.skin(size, "markers");
    bench.skin(size, "texture");
    return;
  }
  if (options.surfaces) {
    bench.surface(size);
    return;
  }
  bench.contact(size);
  bench.regions(size);
  bench.moments(size);
  if (options.contacts) return;
  bench.upload(size);
  bench.surface(size);
  bench.elastic(size);
  bench.frame(size, SyntheticMode::Lambert);
  bench.frame(size, SyntheticMode::Gel);
  bench.place_weights(size);
  bench.lookup(size);
  bench.throughput(size, SyntheticMode::Lambert);
  bench.throughput(size, SyntheticMode::Gel);
}

Files study_on_device(gpu::Context& context, const Options& options, const std::filesystem::path& out) {
  say(text("%s, %s\n", context.report().name.c_str(), context.report().driver.c_str()));
  if (options.moduli) return modulus_study(context, out, options.seeds);
  if (options.traction) return study_traction(context, options);
  Bench bench(context, options.repetitions);
  if (options.forward)
    for (const uint32_t along : {32u, 64u, 96u}) bench.forward(along);
  else {
    if (options.gels) time_size(bench, options, {320, 240, 320, 240});
    for (const Size& size : {Size{640, 480, 640, 480}, Size{1392, 1042, 1400, 1050}})
      time_size(bench, options, size);
  }
  Files files = {{options.table(), bench.csv()}};
  if (options.all()) files["throughput.csv"] = bench.throughput_csv();
  return files;
}

Report run(const Common& common, const Options& options) {
  if (common.json) say_nothing();
  if (!common.out.empty()) make_output_folder(common.out);
  std::optional<Files> files = study_without_device(options);
  bool clean = true;
  if (!files) {
    gpu::ContextOptions device;
    device.device = common.device;
    device.validation = common.validation;
    device.timers = options.stages;
    gpu::Context context(device);
    files = study_on_device(context, options, common.out);
    clean = validation_clean(context);
  }
  json::Value tables = json::Value::object();
  for (const auto& [name, bytes] : *files) {
    if (name.ends_with(".csv")) tables[name] = bytes;
    if (!common.out.empty() && !bytes.empty()) write_whole(common.out / name, std::string_view(bytes));
  }
  return {"", json::Value({{"tables", tables}}), clean ? 0 : kInternalError};
}

}  // namespace
}  // namespace palpate::perf

namespace palpate {

void add_bench(CommandLine& program, Common& common, Command& chosen) {
  CommandLine* command = program.add_subcommand(
      "bench",
      "Time palpate's stages against OpenCV and FFTW in one run, or errors by run time of one of them");
  auto o = std::make_shared<perf::Options>();
  command->add_setting("--repetitions", o->repetitions, Check::range(3, 1000), "Paired repetitions");
  command->add_flag("--stages", o->stages,
                    "GPU timers for single stages (they slow the frame down by a tenth)");
  command->add_flag("--weighted", o->weighted, "Weighted surfaces only: their rival takes half a minute");
  command->add_flag("--gels", o->gels,
                    "Gels only: sum of gradients, readings with weights by place and by a table of depth");
  command->add_flag("--skin", o->skin, "Following the skin's pattern only");
  command->add_flag("--forward", o->forward, "The forward model's product and solve only");
  command->add_flag("--splines", o->splines,
                    "Thin-plate splines only: error and time by points, kernel and lambda");
  command->add_flag("--matching", o->matching,
                    "Matching of point sets against Coherent Point Drift only: no device");
  command->add_flag("--lump-scaling", o->lumps,
                    "Data sets of lumps only: cases a minute by threads and processes, beyond that a model");
  command->add_flag(
      "--traction", o->traction,
      "Pressure of a layer only: error by run time and by Poisson's ratio, thickness and noise");
  command->add_flag("--contacts", o->contacts, "Contact, regions and moments only");
  command->add_flag("--surfaces", o->surfaces,
                    "Right side to heights only, against FFTW, and VkFFT on the same device");
  command->add_flag("--modulus", o->moduli,
                    "Errors and intervals of Young's modulus of simulated samples, nothing timed");
  command->add_setting("--seeds", o->seeds, Check::range(1, 100),
                       "Samples of each shape and modulus, with --modulus");
  command->add_option("--out", common.out,
                      "Folder for bench.csv and throughput.csv, or a table named by what is asked for");
  add_common(*command, common,
             "  palpate-lab bench --out out/bench              some minutes\n"
             "  palpate-lab bench --contacts --repetitions 5\n"
             "  palpate-lab bench --modulus --seeds 5 --out out/modulus\n"
             "Each rival does the same work in the same run; the machine is best left alone meanwhile.\n");
  command->runs(chosen, [o, &common] { return perf::run(common, *o); });
}

}  // namespace palpate
