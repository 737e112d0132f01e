// palpate lump scan: several presses of one block as a map, an outline, an estimate and a report.
#include <algorithm>
#include <cmath>
#include <map>
#include <span>

#include "capture/run/palpation/hand_recording.h"
#include "capture/run/palpation/scan_recording.h"
#include "engine/base/json.h"
#include "engine/base/stop.h"
#include "engine/base/text.h"
#include "engine/fem/large_strain/extrapolation.h"
#include "engine/lump/network/network.h"
#include "engine/palpation/hand/hand_answer.h"
#include "palpate/error.h"
#include "viz/commands/lump/error_options.h"
#include "viz/commands/lump/lump.h"
#include "viz/commands/option_groups/block_options.h"
#include "viz/commands/support/forward_options.h"
#include "viz/commands/support/lump_method.h"
#include "viz/commands/support/options.h"
#include "viz/commands/support/progress.h"
#include "viz/commands/support/run_watch.h"
#include "viz/report/scan_report.h"

namespace palpate {
namespace {

struct Options {
  Options() {
    plan.scene.cells = {40, 40, 20};
    // A lump whose size, depth and stiffness the map decides.
    lump.size_mm = {12, 12, 12};
    lump.depth_mm = 3;
    lump.stiffness_ratio = 4;
  }

  ScanPlan plan;
  lump::StitchOptions stitch;
  fem::Inclusion lump;
  bool simulate = false, no_inclusion = false, by_hand = false;
  HandScanOptions hand;
  std::vector<double> first_mm;
  std::vector<double> block_mm, window_mm, size_mm, offset_mm, second_mm;
  std::vector<uint32_t> cells, size_px, leave_out;
  uint32_t threads = 0;
  std::vector<std::string> recordings;
  std::string positions, gauge;
  RecordedOptions recorded;
  std::string method = "refined";
  lump::ErrorSources errors;
  SkinOptions skin;
  PlateOptions plate;
  bool force_given = false;
  std::string of_others;  ///< an option that says nothing of presses by hand; empty: none is given
};

/// Of a simulated block and its sensor, and of a stage.
constexpr const char* kNotByHand[] = {
    "--no-inclusion", "--shape",     "--size-mm",       "--depth-mm",       "--stiffness-ratio",
    "--offset-mm",    "--second-mm", "--poisson",       "--cells",          "--window-mm",
    "--size",         "--noise",     "--full-scale-Pa", "--stage-error-mm", "--leave-out",
    "--stage-sd-mm",  "--skin-mm",   "--skin-ratio",    "--plate-friction", "--plate-sticks"};
constexpr const char* kByHandAlone[] = {"--first-mm", "--first-sd-mm"};

ScanPlan plan_of(const Common& common, const Options& o) {
  ScanPlan plan = o.plan;
  plan.seed = common.seed;
  std::copy_n(o.block_mm.begin(), o.block_mm.size(), plan.scene.block_mm.begin());
  std::copy_n(o.window_mm.begin(), o.window_mm.size(), plan.sensor.window_mm.begin());
  std::copy_n(o.size_px.begin(), o.size_px.size(), plan.sensor.size_px.begin());
  std::copy_n(o.cells.begin(), o.cells.size(), plan.scene.cells.begin());
  for (const uint32_t cells : plan.scene.cells)
    if (cells % 2 != 0)
      throw Error(Failure::Usage, "even numbers of cells", std::to_string(cells), "--cells 40 40 20");
  plan.scene.inclusion.reset();
  if (!o.no_inclusion) {
    fem::Inclusion lump = o.lump;
    if (o.size_mm.size() == 1) lump.size_mm.fill(o.size_mm[0]);
    if (o.size_mm.size() == 3) std::copy_n(o.size_mm.begin(), 3, lump.size_mm.begin());
    if (o.size_mm.size() == 2) throw Error(Failure::Usage, "one size or three", "2", "--size-mm 8");
    std::copy_n(o.offset_mm.begin(), o.offset_mm.size(), lump.offset_mm.begin());
    plan.scene.inclusion = lump;
    if (!o.second_mm.empty()) {
      std::copy_n(o.second_mm.begin(), o.second_mm.size(), lump.offset_mm.begin());
      plan.scene.others = {lump};
    }
  }
  if (const auto skin = skin_of(o.skin, plan.scene.block_mm[2]))
    plan.scene.skin = fem::Skin{skin->thickness_mm, skin->stiffness_ratio};
  if (const auto plate = plate_of(o.plate)) {
    plan.scene.plate_sticks = plate->sticks;
    plan.scene.plate_friction = plate->friction;
  }
  check(plan.scene);
  return plan;
}

void add_inputs(const ScanPlan& plan, ScanReport& report) {
  const fem::Scene& s = plan.scene;
  report.inputs = {
      {"block", text("%g x %g x %g mm", s.block_mm[0], s.block_mm[1], s.block_mm[2])},
      {"tissue", text("Young's modulus %g Pa, Poisson's ratio %g", s.young_Pa, s.poisson)},
      {"loads", text("%u up to %g N on the block, presses differ by %.2g %%", plan.loads, plan.force_N,
                     100 * plan.force_sd)},
      {"window", text("%g x %g mm", plan.sensor.window_mm[0], plan.sensor.window_mm[1]) +
                     text(", %u x %u px", plan.sensor.size_px[0], plan.sensor.size_px[1])},
      {"noise of the sensor", text("%g gray a pixel, %.2g %% of the peak a node",
                                   plan.sensor.pixel_noise_gray, 100 * plan.sensor.noise_fraction)},
      {"stage", text("good to %g mm", plan.stage_sd_mm)},
      {"source", "a synthetic block, " +
                     text("%u x %u x %u cells, extrapolated with half as many, seed ", s.cells[0], s.cells[1],
                          s.cells[2]) +
                     std::to_string(plan.seed)}};
}

std::vector<lump::ScanPress> simulated(const Common& common, const Options& o, ScanReport& report) {
  if (!o.recordings.empty() || !o.positions.empty())
    throw Error(Failure::Usage, "recordings, or --simulate", "both", "one of them");
  const ScanPlan plan = plan_of(common, o);
  fem::LargeStrainOptions solver;
  solver.threads = o.threads;
  solver.stop = interrupted;
  std::vector<lump::ScanPress> presses =
      simulate_scan(plan, [&](const fem::Scene& scene, const std::vector<fem::PressLoad>& loads) {
        return solve_extrapolated(scene, loads, solver);
      });
  for (const uint32_t press : o.leave_out)
    if (press < 1 || press > presses.size())
      throw Error(Failure::Usage, "presses to leave out, 1 to " + std::to_string(presses.size()),
                  std::to_string(press), "--leave-out 2");
  std::erase_if(presses, [&](const lump::ScanPress& p) {
    return std::any_of(o.leave_out.begin(), o.leave_out.end(),
                       [&](uint32_t n) { return p.name == "press " + std::to_string(n); });
  });
  report.truth = plan.scene;
  add_inputs(plan, report);
  return presses;
}

RecordedOptions recorded_options(const Common& common, const Options& o) {
  RecordedOptions options = o.recorded;
  std::copy_n(o.block_mm.begin(), o.block_mm.size(), options.block_mm.begin());
  options.young_Pa = o.plan.scene.young_Pa;
  options.seed = common.seed;
  options.loads = o.plan.loads;
  options.force_N = o.force_given ? o.plan.force_N : 0;
  return options;
}

std::vector<lump::ScanPress> recorded(const Common& common, const Options& o, ScanReport& report,
                                      std::vector<std::string>& notes) {
  if (o.positions.empty())
    throw Error(Failure::Usage, "--simulate, --by-hand, or --positions FILE with the recordings' places",
                "none of them", "palpate lump scan --simulate");
  const RecordedOptions options = recorded_options(common, o);
  const std::vector<RecordedPress> rows = read_places(o.positions, o.recordings, o.gauge);
  std::vector<lump::ScanPress> presses = read_presses(rows, options, notes, run_watch(common));
  report.add_block(options.block_mm, options.young_Pa);
  report.inputs.emplace_back("places", o.positions);
  for (const RecordedPress& row : rows)
    report.inputs.emplace_back(
        "press",
        row.recording + text(" at %g, %g mm, force of ", row.place_mm[0], row.place_mm[1]) + row.gauge);
  return presses;
}

HandRecording by_hand(const Common& common, const Options& o, HandScanOptions& hand, ScanReport& report,
                      std::vector<std::string>& notes) {
  if (o.simulate || !o.positions.empty())
    throw Error(Failure::Usage, "--by-hand, where the skin tells the places",
                o.simulate ? "--simulate with it" : "--positions with it", "one of them");
  if (o.recordings.empty())
    throw Error(Failure::Usage, "recordings of presses by hand", "none",
                "palpate lump scan --by-hand 'synthetic:tissue?hand=13'");
  if (!o.of_others.empty())
    throw Error(Failure::Usage, "--by-hand with options of recorded presses",
                o.of_others + ", which is of a stage or a simulated block", "without " + o.of_others);
  const RecordedOptions options = recorded_options(common, o);
  for (size_t c = 0; c < o.first_mm.size(); ++c)
    if (!(std::abs(o.first_mm[c]) <= options.block_mm[c] / 2))
      throw Error(Failure::Usage,
                  text("a first press aimed at the block, to %g and %g mm from its middle",
                       options.block_mm[0] / 2, options.block_mm[1] / 2),
                  text("--first-mm %g %g", o.first_mm[0], o.first_mm[1]), "--first-mm 0 0");
  HandRecording recording = read_hand_presses(o.recordings, o.gauge, options, notes, run_watch(common));
  report.add_block(options.block_mm, options.young_Pa);
  for (const std::string& name : o.recordings) report.inputs.emplace_back("presses by hand", name);
  std::copy_n(o.first_mm.begin(), o.first_mm.size(), hand.places.first_mm.begin());
  report.inputs.emplace_back("first press", text("at %g, %g +- %g mm", hand.places.first_mm[0],
                                                 hand.places.first_mm[1], hand.places.first_sd_mm));
  return recording;
}

/// A skin and a plate as they are stated, of the block of all presses.
void set_conditions(const Options& o, std::vector<lump::ScanPress>& presses, ScanReport& report) {
  if (const std::optional<lump::Plate> plate = plate_of(o.plate)) {
    for (lump::ScanPress& press : presses) press.observation.plate = plate;
    report.inputs.emplace_back("plate", plate->sticks
                                            ? std::string("holds the tissue")
                                            : text("slides with a friction of %g", plate->friction));
  }
  const double thickness_mm = presses.empty() ? 20 : presses.front().observation.block_mm[2];
  const std::optional<lump::Skin> skin = skin_of(o.skin, thickness_mm);
  if (!skin) return;
  for (lump::ScanPress& press : presses) press.observation.skin = skin;
  report.inputs.emplace_back("skin", text("%g mm, %g times as stiff as the tissue below", skin->thickness_mm,
                                          skin->stiffness_ratio));
}

Report scan(const Common& common, const Options& o) {
  if (!o.by_hand && !o.of_others.empty())
    throw Error(Failure::Usage, "--by-hand for " + o.of_others, "a scan without it",
                "without " + o.of_others);
  ScanReport report;
  std::vector<std::string> notes;
  HandRecording recording;
  HandScanOptions hand = o.hand;
  hand.places.stop = interrupted;
  std::vector<lump::ScanPress> presses;
  if (o.by_hand)
    recording = by_hand(common, o, hand, report, notes);
  else if (o.simulate)
    presses = simulated(common, o, report);
  else
    presses = recorded(common, o, report, notes);
  if (interrupted()) return interrupted_report("interrupted");
  set_conditions(o, presses, report);
  lump::Estimator estimator;
  if (o.method != "none") {
    const auto network = lump::load_network("");
    report.model =
        o.method == "direct" ? "direct inversion by finite elements" : o.method + ": " + network->made_from();
    estimator =
        lump::named_estimator(o.method, network, o.errors, {.threads = o.threads, .stop = interrupted});
  }
  if (estimator) report.add_errors(o.errors);
  if (o.by_hand)
    report.take_hand(answer_by_hand(recording, hand, estimator, common.seed));
  else
    report.answer = evaluate_scan(presses, o.stitch, estimator, common.seed);
  report.answer.warnings.insert(report.answer.warnings.end(), notes.begin(), notes.end());
  std::string words = scan_text(report);
  if (!common.out.empty()) words += "written: " + write_scan(report, common.out) + "\n";
  return {words, scan_json(report)};
}

Report run(const Common& common, const Options& o) {
  try {
    return scan(common, o);
  } catch (const Stopped&) {
    return interrupted_report("interrupted");
  }
}

void add_recording_options(CommandLine& command, Options& o) {
  command.add_option("RECORDING", o.recordings,
                     "Sessions or videos, one press each (default: all in --positions); by hand any number");
  command
      .add_option("--positions", o.positions,
                  "CSV: recording,x_mm,y_mm[,gauge], places of the window's middle")
      ->check(Check::existing_file());
  command.add_option("--gauge", o.gauge,
                     "CSV of the force on the block, where --positions names none; truth: of synthetic "
                     "blocks (by hand also gauge.csv beside the recording)");
  command.add_flag("--by-hand", o.by_hand,
                   "Presses without a stage: the skin's texture tells their places, pressure their tilts");
  command
      .add_option("--first-mm", o.first_mm, "By hand: where the first press was aimed at, x y (default 0 0)")
      ->expected(2);
  command.add_setting("--first-sd-mm", o.hand.places.first_sd_mm, Check::range(0.0, 10.0),
                      "By hand: standard error of that");
  command.add_option("--sensor", o.recorded.sensor, "Sensor file (default: the sessions' own)");
  command.add_setting("--pitch-mm", o.recorded.pitch_mm, Check::range(0.2, 5.0), "Of the map, of recordings");
}

void add_block_options(CommandLine& command, Options& o) {
  add_block(command, o.block_mm, o.plan.scene.young_Pa)->capture_default_str();
  command.add_option("--poisson", o.plan.scene.poisson, "Poisson's ratio of the tissue")
      ->capture_default_str();
  command.add_flag("--no-inclusion", o.no_inclusion, "Tissue alone");
  command.add_option("--shape", o.lump.shape, "sphere, ellipsoid, cylinder (upright), lying")
      ->transform(one_of(lump_shapes()))
      ->default_str("sphere");
  command.add_option("--size-mm", o.size_mm, "Diameter of the lump, or its sizes along x, y, z (default 12)")
      ->expected(1, 3);
  command.add_option("--depth-mm", o.lump.depth_mm, "From the surface to the lump's top")
      ->capture_default_str();
  command.add_option("--stiffness-ratio", o.lump.stiffness_ratio, "Lump's modulus over the tissue's")
      ->capture_default_str();
  command.add_option("--offset-mm", o.offset_mm, "Lump's centre from the block's middle, x y")->expected(2);
  command
      .add_option("--second-mm", o.second_mm,
                  "A second lump of the same kind, its centre x y from the middle")
      ->expected(2);
}

/// Gives --force-N.
CommandOption* add_press_options(CommandLine& command, Options& o) {
  CommandOption* force = command.add_setting("--force-N", o.plan.force_N, Check::positive(),
                                             "Highest force on the block (recordings: what all reached)");
  command.add_setting("--loads", o.plan.loads, Check::range(1, 8), "Loads of each press, 1 to 8");
  command.add_option("--window-mm", o.window_mm, "What the sensor sees of the plate (default 27.84 20.88)")
      ->expected(2);
  command.add_option("--size", o.size_px, "Its pixels (default 640 480)")->expected(2);
  command.add_setting("--noise", o.plan.sensor.noise_fraction, Check::range(0.0, 1.0),
                      "Noise of a value after calibration, as a fraction of the peak");
  command
      .add_option("--full-scale-Pa", o.plan.sensor.full_scale_Pa,
                  "Pressure at which the camera saturates, Pa (default: the peak at 90 %)")
      ->check(Check::positive());
  command.add_setting("--stage-error-mm", o.plan.stage_sd_mm, Check::range(0.0, 10.0),
                      "Standard error of the window's positions, mm");
  command.add_option("--leave-out", o.leave_out, "Presses to leave out, numbered from 1");
  command.add_setting("--stage-sd-mm", o.stitch.stage_sd_mm, Check::range(1e-4, 10.0),
                      "Standard error of the stage that the stitching assumes, mm");
  for (const char* of_sensor : {"--window-mm", "--size", "--noise", "--full-scale-Pa", "--stage-error-mm"})
    command.get_option(of_sensor)->group("Simulated sensor");
  return force;
}

}  // namespace

void add_lump_scan(CommandLine& group, Common& common, Command& chosen) {
  CommandLine* command =
      group.add_subcommand("scan", "Scan a block by several presses: map, outline, estimate, report");
  auto o = std::make_shared<Options>();
  add_recording_options(*command, *o);
  command->add_setting("--method", o->method, Check::one_of({"network", "refined", "direct", "none"}),
                       std::string(kLumpMethodHelp) + ", none");
  command->add_flag("--simulate", o->simulate, "Scan a synthetic block");
  add_block_options(*command, *o);
  add_skin(*command, o->skin);
  add_plate(*command, o->plate);
  add_error_sources(*command, o->errors);
  command
      ->add_option("--cells", o->cells,
                   "Cells of the tissue along x, y, z, even numbers (default 40 40 20); half as many are "
                   "also solved and extrapolated with")
      ->expected(3);
  CommandOption* force = add_press_options(*command, *o);
  command->add_setting("--threads", o->threads, Check::range(0, 256), "Threads; 0: one per core");
  command->add_option("--out", common.out, "Folder for the report, maps and tables");
  add_common(
      *command, common,
      "  palpate lump scan --simulate --out out/scan                  then open out/scan/report.html\n"
      "  palpate lump scan --simulate --size-mm 8 --depth-mm 5 --stiffness-ratio 10\n"
      "                                             a lump whose stiffness the map does not determine\n"
      "  palpate lump scan --by-hand out/presses --young-Pa 4000 --gauge gauge.csv --out out/scan\n"
      "  palpate lump scan --by-hand 'synthetic:tissue?hand=13'       a hand that trembles, and tilts the "
      "pad\n"
      "  palpate lump scan out/press1 out/press2 --positions places.csv --gauge truth --out out/scan\n"
      "Research use, not a diagnosis.\n");
  command->callback([o, command, force, &common, &chosen] {
    o->force_given = force->count() > 0;
    for (const char* option : o->by_hand ? std::span<const char* const>(kNotByHand) : kByHandAlone)
      if (command->get_option(option)->count() > 0) o->of_others = option;
    chosen = [o, &common] { return run(common, *o); };
  });
}

}  // namespace palpate
