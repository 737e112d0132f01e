// Contact, surface and whole frame beside OpenCV's CPU chain and FFTW, in one run. See perf/README.md for the
// method.
#include "perf/tools/bench.h"

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <optional>

#include "capture/files/output_file.h"
#include "perf/rivals/lump_scaling.h"
#include "perf/rivals/matching_rival.h"
#include "perf/rivals/spline_rival.h"
#include "perf/rivals/traction_study.h"
#include "perf/tools/program.h"
#include "viz/commands/support/options.h"

namespace palpate::perf {

Pipeline Bench::make_pipeline(const Scene& scene, uint32_t outputs, SurfaceSolver solver, Upload upload) {
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
  std::printf(
      "%-30s %-10s palpate %7.2f ms (p95 %7.2f, cpu %7.2f)  %-13s %7.2f ms (p95 %7.2f, cpu %7.2f)  ratio "
      "wall %.2f cpu %.2f\n",
      p.work.c_str(), p.size.c_str(), p.ours.wall_ms.median, p.ours.wall_ms.p95, p.ours.cpu_ms.median,
      p.rival.name.c_str(), p.rival.wall_ms.median, p.rival.wall_ms.p95, p.rival.cpu_ms.median, p.wall_ratio,
      p.cpu_ratio);
  std::fflush(stdout);
}

namespace {

struct Options {
  gpu::ContextOptions device;
  int repetitions = 21, seeds = 2;
  bool weighted = false, contacts = false, skin = false, gels = false, forward = false, splines = false;
  bool moduli = false, matching = false, lumps = false, traction = false;
  std::string out;

  void add_to(CommandLine& app);
  /// Of the table of what was asked for.
  const char* table() const {
    return forward    ? "forward.csv"
           : weighted ? "weighted.csv"
           : skin     ? "skin.csv"
           : gels     ? "gels.csv"
           : contacts ? "contacts.csv"
                      : "bench.csv";
  }
  bool all() const { return !weighted && !forward && !skin && !gels && !contacts; }
  void write(const std::string& name, const std::string& text) const {
    OutputFile file(out + "/" + name);
    file.write(text);
    file.commit();
  }
  void write_picture(const std::string& name, const std::string& bytes) const {
    if (!bytes.empty()) write(name, bytes);
  }
};

void Options::add_to(CommandLine& app) {
  app.add_option("--device", device.device, "index or part of a name");
  app.add_option("--repetitions", repetitions, "paired repetitions")->check(Check::range(3, 1000));
  app.add_option(
      "--out", out,
      "existing folder for the CSV files: bench.csv and throughput.csv, or one named by what is asked for");
  app.add_flag("--stages", device.timers,
               "GPU timers for single stages (they slow the frame down by a tenth)");
  app.add_flag("--weighted", weighted, "Weighted surfaces only: their rival takes half a minute");
  app.add_flag("--gels", gels,
               "Gels only: sum of gradients, readings with a normal table and by a table of depth");
  app.add_flag("--skin", skin, "Following the skin's pattern only");
  app.add_flag("--forward", forward, "The forward model's product and solve only");
  app.add_flag("--splines", splines, "Thin-plate splines only: error and time by points, kernel and lambda");
  app.add_flag("--matching", matching, "Matching of point sets beside Coherent Point Drift only: no device");
  app.add_flag("--lump-scaling", lumps,
               "Data sets of lumps only: cases a minute by threads and processes, beyond that a model");
  app.add_flag("--traction", traction,
               "Pressure of a layer only: error by run time and by Poisson's ratio, thickness and noise");
  app.add_flag("--contacts", contacts, "Contact, regions and moments only");
  app.add_flag("--modulus", moduli,
               "Errors and intervals of Young's modulus of simulated samples, nothing timed");
  app.add_option("--seeds", seeds, "samples of each shape and modulus, with --modulus")
      ->check(Check::range(1, 100));
}

void study_splines(const Options& options) {
  const SplineStudy study = spline_study(std::min(options.repetitions, 5));
  std::printf("%s", study.words.c_str());
  if (options.out.empty()) return;
  options.write("splines.csv", study.csv);
  options.write_picture("splines.png", study.png);
}

void study_lumps(const Options& options) {
  const std::filesystem::path self = std::filesystem::read_symlink("/proc/self/exe");
  const LumpScaling study = lump_scaling(self.parent_path() / "palpate");
  std::printf("%s", study.words.c_str());
  if (options.out.empty()) return;
  options.write("scaling.csv", study.csv);
  options.write("scaling.txt", study.words);
  options.write_picture("scaling.png", study.png);
  options.write_picture("scaling.svg", study.svg);
}

void study_matching(const Options& options) {
  const std::string csv = compare_matching(options.repetitions);
  if (!options.out.empty()) options.write("matching.csv", csv);
}

void study_traction(gpu::Context& context, const Options& options) {
  const std::string costs = traction_costs_csv(traction_costs(options.repetitions, &context));
  std::printf("%s", costs.c_str());
  const std::string stability = traction_stability_csv(traction_stability());
  std::printf("%s", stability.c_str());
  if (options.out.empty()) return;
  options.write("costs.csv", costs);
  options.write("stability.csv", stability);
}

/// True where one was asked for.
bool study_without_device(const Options& options) {
  if (options.splines)
    study_splines(options);
  else if (options.lumps)
    study_lumps(options);
  else if (options.matching)
    study_matching(options);
  else
    return false;
  return true;
}

/// The requested benchmarks, at one size.
void time_size(Bench& bench, const Options& options, const Size& size) {
  if (options.weighted) {
    bench.weighted(size);
    return;
  }
  if (options.gels) {
    bench.gradient(size);
    bench.normal_table(size);
    bench.lookup(size);
    return;
  }
  if (options.skin) {
    bench.skin(size, "markers");
    bench.skin(size, "texture");
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
  bench.normal_table(size);
  bench.lookup(size);
  bench.throughput(size, SyntheticMode::Lambert);
  bench.throughput(size, SyntheticMode::Gel);
}

int run(int argc, char** argv) {
  CommandLine app("Times palpate's stages beside OpenCV and FFTW in one run.");
  Options options;
  options.add_to(app);
  if (const std::optional<int> code = app.parse_or_exit(argc, argv)) return *code;
  if (study_without_device(options)) return 0;
  gpu::Context context(options.device);
  std::printf("%s, %s\n", context.report().name.c_str(), context.report().driver.c_str());
  if (options.moduli) {
    modulus_study(context, options.out, options.seeds);
    return 0;
  }
  if (options.traction) {
    study_traction(context, options);
    return 0;
  }
  Bench bench(context, options.repetitions);
  if (options.forward)
    for (const uint32_t along : {32u, 64u, 96u}) bench.forward(along);
  else
    for (const Size& size : {Size{640, 480, 640, 480}, Size{1392, 1042, 1400, 1050}})
      time_size(bench, options, size);
  if (options.out.empty()) return 0;
  options.write(options.table(), bench.csv());
  if (options.all()) options.write("throughput.csv", bench.throughput_csv());
  return 0;
}

}  // namespace
}  // namespace palpate::perf

int main(int argc, char** argv) {
  return palpate::perf::run_program("palpate_bench", palpate::perf::run, argc, argv);
}
