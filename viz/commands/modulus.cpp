// palpate modulus: Young's modulus of a sample from presses against the pad: from a recording, a table, or a
// simulated sample.
#include <cmath>
#include <map>
#include <utility>

#include "capture/files/output_file.h"
#include "capture/run/input.h"
#include "capture/run/modulus/modulus_recording.h"
#include "capture/synthetic/modulus_press.h"
#include "engine/gpu/context.h"
#include "palpate/error.h"
#include "viz/commands/command.h"
#include "viz/commands/option_groups/run_options.h"
#include "viz/commands/support/options.h"
#include "viz/commands/support/progress.h"
#include "viz/commands/support/run_watch.h"
#include "viz/report/modulus_report.h"

namespace palpate {
namespace {

struct Options {
  std::string input, sample, gauge, approach;
  std::filesystem::path sensor, background, frames;
  double poisson = 0.5, pad_kPa = 0, pad_thickness_mm = 0, pad_poisson = 0.5;
  double pad_sd = 0.02, force_sd = 0.01, size_sd = 0.005, scale_sd = 0, stage_sd_mm = kStageSd_mm;
  double zero_sd_mm = std::numeric_limits<double>::infinity(), expected_kPa = 0, simulate_kPa = 0;
  std::vector<double> forces_N = {0.8, 1.0};
  Support table = Support::Sliding;
  MaterialLaw law = MaterialLaw::Linear;
  uint32_t replicates = 200;
  bool one_sequence = false;
};

/// The pad by the options, else by the sensor file.
void set_pad(const Options& o, const Sensor* sensor, ModulusSetup& setup) {
  setup.pad = pad_of({o.pad_kPa * 1e-3, o.pad_poisson}, o.pad_thickness_mm, sensor);
}

ModulusSetup setup_of(const Common& common, const Options& o) {
  ModulusSetup s;
  if (o.sample.empty()) throw Error(Failure::Usage, "--sample", "none", "--sample cube,10mm");
  s.sample = parse_sample(o.sample);
  s.sample.poisson = o.poisson;
  s.sample.relative_size_sd = o.size_sd;
  s.sample.table = o.table;
  s.pad_relative_sd = o.pad_sd;
  s.force_relative_sd = o.force_sd;
  s.length_relative_sd = o.scale_sd;
  s.zero_sd_mm = o.zero_sd_mm;
  s.law = o.law;
  s.seed = common.seed;
  s.replicates = o.replicates;
  return s;
}

/// A recording's presses, by force; what was passed over becomes a note.
void read_recording(gpu::Context& context, const Common& common, const Options& o, ModulusReport& r) {
  const MeasuredInput input = find_input(common.seed, o.input, o.sensor, o.background);
  const PressRecording recording{input, o.gauge, o.approach, o.stage_sd_mm, o.one_sequence};
  check(recording);
  set_pad(o, &input.sensor, r.setup);
  if (!(o.scale_sd > 0)) r.setup.length_relative_sd = scale_sd(input.sensor);
  SamplePresses presses = read_press_frames(context, recording, r.setup.sample, run_watch(common));
  r.setup.depth_by_pressure = presses.depth_by_pressure;
  r.frames = std::move(presses.frames);
  r.notes = std::move(presses.notes);
}

void simulate(gpu::Context& context, const Common& common, const Options& o, ModulusReport& r) {
  ModulusScene scene;
  scene.sample = r.setup.sample;
  scene.young_MPa = o.simulate_kPa * 1e-3;
  scene.forces_N = o.forces_N;
  scene.stage_sd_mm = o.stage_sd_mm;
  scene.sensor.seed = common.seed;
  if (o.pad_kPa > 0) scene.sensor.pad_young_MPa = o.pad_kPa * 1e-3;
  if (o.pad_thickness_mm > 0) scene.sensor.pad_thickness_mm = o.pad_thickness_mm;
  const SimulatedPresses presses = simulate_presses(scene);
  set_pad(o, &presses.sensor, r.setup);
  SampleReader reader(context, presses.sensor, presses.background, r.setup.sample);
  r.setup.depth_by_pressure = reader.depth_by_pressure();
  for (size_t i = 0; i < presses.frames.size(); ++i) {
    std::optional<PressFrame> p = reader.read(presses.frames[i]);
    if (!p) {
      r.notes.push_back("press " + std::to_string(i) + " left out: " + reader.why_not());
      continue;
    }
    if (o.stage_sd_mm > 0) p->approach_mm = {presses.approach_mm[i], o.stage_sd_mm};
    r.frames.push_back(*p);
  }
  r.expected_MPa = scene.young_MPa;
  r.notes.push_back("simulated by finite elements of pad and sample, seen through the simulated waveguide" +
                    std::string(o.stage_sd_mm > 0 ? ", with a stage" : ", without a stage"));
}

Report run(const Common& common, const Options& o) {
  ModulusReport r;
  r.setup = setup_of(common, o);
  if ((!o.input.empty()) + (!o.frames.empty()) + (o.simulate_kPa > 0) != 1)
    throw Error(Failure::Usage, "one of RECORDING, --frames FILE.csv and --simulate KPA",
                o.input.empty() && o.frames.empty() && !(o.simulate_kPa > 0) ? "none" : "several",
                "palpate modulus --help");
  r.expected_MPa = o.expected_kPa * 1e-3;
  int code = 0;
  if (!o.frames.empty()) {
    r.frames = read_press_table(o.frames, r.notes);
    std::optional<Sensor> sensor;
    if (!o.sensor.empty()) sensor = load_sensor(o.sensor);
    set_pad(o, sensor ? &*sensor : nullptr, r.setup);
  } else {
    const std::unique_ptr<gpu::Context> context = open_device(common);
    if (o.simulate_kPa > 0)
      simulate(*context, common, o, r);
    else
      read_recording(*context, common, o, r);
    if (interrupted()) return interrupted_report();
    if (!validation_clean(*context)) code = kInternalError;
  }
  r.answer = estimate_modulus(r.frames, r.setup);
  Report report(facts_of(r), code);
  if (!common.out.empty()) {
    make_output_folder(common.out);
    const auto file = [&](const char* name) { return (common.out / name).string(); };
    write_whole(file("modulus.csv"), std::string_view(ways_csv(r.answer)));
    write_whole(file("presses.csv"), std::string_view(press_table(r.frames)));
    write_whole(file("points.csv"), std::string_view(points_csv(r.answer)));
    write_whole(file("modulus.json"), std::string_view(report.json.dump(2)));
    std::string written = "written: " + file("modulus.csv") + ", presses.csv, points.csv, modulus.json";
    draw_plot(modulus_plot(r), file("modulus"), written);
    draw_plot(residual_plot(r), file("residuals"), written);
    report.say(written);
  }
  return report;
}

}  // namespace

void add_modulus(CommandLine& program, Common& common, Command& chosen) {
  CommandLine* command = program.add_subcommand(
      "modulus", "Young's modulus of a sample pressed between the pad and a rigid table, with its interval");
  auto o = std::make_shared<Options>();
  const auto fraction = Check::range(0.0, 0.49);
  command->add_option("RECORDING", o->input, "A recording of two presses or more, as process takes it");
  command->add_option("--frames", o->frames,
                      "Instead: CSV of presses: force_N, and radius_mm or area_mm2, depth_mm, mean_depth_mm, "
                      "approach_mm; each also with its standard error (force_sd_N, radius_sd_mm, ...)");
  command->add_option("--simulate", o->simulate_kPa, "Instead: a simulated sample of this modulus, kPa")
      ->check(Check::positive());
  command->add_option("--forces", o->forces_N, "Of the simulated presses, N")
      ->delimiter(',')
      ->check(Check::positive());
  command->add_option("--sample", o->sample,
                      "cube,10mm; block,10x8mm (width x height); cylinder,12x10mm (diameter x height); "
                      "sphere,16mm (diameter)");
  command->add_option("--sample-poisson", o->poisson, "Its Poisson's ratio, 0 to 0.5")->capture_default_str();
  command->add_setting("--size-sd", o->size_sd, fraction, "Relative standard error of its size");
  command
      ->add_option("--table", o->table,
                   "sliding: the sample is free to widen on the table; bonded: it sticks")
      ->transform(
          one_of(std::map<std::string, Support>{{"sliding", Support::Sliding}, {"bonded", Support::Bonded}}));
  command
      ->add_option("--law", o->law,
                   "linear, or rubber: incompressible neo-Hookean, for strains beyond some %")
      ->transform(one_of(std::map<std::string, MaterialLaw>{{"linear", MaterialLaw::Linear},
                                                            {"rubber", MaterialLaw::Rubber}}));
  command->add_option("--sensor", o->sensor,
                      "Sensor file: force calibration, scale and, of a waveguide, the pad");
  command->add_option("--background", o->background, "Image of the untouched sensor");
  add_sequence(*command, o->one_sequence);
  command->add_option("--pad-kPa", o->pad_kPa, "The pad's Young's modulus (default: the sensor file's)")
      ->check(Check::positive());
  command->add_option("--pad-thickness-mm", o->pad_thickness_mm, "Its thickness, bonded to a rigid base")
      ->check(Check::positive());
  command->add_option("--pad-poisson", o->pad_poisson, "Its Poisson's ratio")->capture_default_str();
  command->add_setting("--pad-sd", o->pad_sd, fraction, "Relative standard error of its modulus");
  command->add_setting("--force-sd", o->force_sd, fraction, "Relative standard error of the force's scale");
  command->add_option("--scale-sd", o->scale_sd, "Relative standard error of the camera's scale")
      ->check(fraction);
  command->add_option("--gauge", o->gauge,
                      "CSV of a force gauge with the recording, instead of the image's force");
  command->add_option("--approach", o->approach, "CSV with frame and approach_mm: the stage's travel");
  command->add_setting("--stage-sd-mm", o->stage_sd_mm, Check::non_negative(),
                       "Standard error of one reading of the stage; 0 with "
                       "--simulate: no stage");
  command
      ->add_option("--zero-sd-mm", o->zero_sd_mm,
                   "Standard error of the approach's zero, first touch (default: not known)")
      ->check(Check::non_negative());
  command->add_option("--expected-kPa", o->expected_kPa, "A known modulus to compare with")
      ->check(Check::positive());
  command->add_setting("--replicates", o->replicates, Check::range(50, 10000), "Of the bootstrap");
  command->add_option("--out", common.out,
                      "Folder for modulus.csv, presses.csv, points.csv, modulus.json and plots");
  add_common(
      *command, common,
      "  palpate modulus --simulate 103 --sample cube,10mm --forces 0.8,1.0 --out out/cl2000x\n"
      "  palpate modulus --frames presses.csv --sample sphere,16mm --pad-kPa 200 --pad-thickness-mm 6\n"
      "  palpate modulus out/press --sample cube,10mm --approach stage.csv --out out/modulus\n"
      "  palpate modulus press.avi --sensor pad.json --gauge gauge.csv --sample sphere,50mm --json\n");
  command->runs(chosen, [&common, o] { return run(common, *o); });
}

}  // namespace palpate
