// palpate process: from a recording to measurements.

#include <spdlog/spdlog.h>

#include "capture/files/measurements.h"
#include "capture/run/input.h"
#include "capture/run/process/processing.h"
#include "engine/base/json.h"
#include "engine/gpu/context.h"
#include "palpate/error.h"
#include "viz/commands/option_groups/block_options.h"
#include "viz/commands/option_groups/camera_options.h"
#include "viz/commands/option_groups/look_options.h"
#include "viz/commands/option_groups/pair_options.h"
#include "viz/commands/option_groups/run_options.h"
#include "viz/commands/option_groups/serve_options.h"
#include "viz/commands/support/options.h"
#include "viz/commands/support/run_watch.h"
#include "viz/commands/support/trace_option.h"
#include "viz/commands/workflow/serving.h"
#include "viz/display/recording_pictures.h"

namespace palpate {
namespace {

const std::map<std::string, DepthFormat> kConfidenceFormats = {{"png16", DepthFormat::Png16},
                                                               {"npy", DepthFormat::Npy}};

struct Options {
  ProcessRequest request;
  CameraChoice camera;
  bool all_digits = false;
  BlockChoice block;
  LookOptions look;
  ServeChoice serve;
  TraceOption trace;
};

/// A recorded pair of fingers, as it was recorded.
Report process_fingers(const Common& common, const ProcessRequest& asked, const ServeChoice& serve) {
  const std::filesystem::path folder = asked.input;
  if (!asked.sensor.empty() || !asked.background.empty() || !asked.chosen_outputs.empty() || asked.solver ||
      !asked.depth.empty() || !asked.confidence.empty() || asked.pictures || asked.video ||
      asked.max_frames != 0)
    throw Error(Failure::Usage, "two fingers as they were recorded", "options for one of them",
                finger_folder(folder, Side::Left).string() + " with these options");
  std::function<void(const GripFrame&)> on_row;
  if (common.jsonl) on_row = [](const GripFrame& row) { print_line(grip_json_line(row)); };
  std::optional<Serving> serving;
  const auto attach = [&](const PairParts& parts) {
    if (!serve.on) return;
    serving.emplace(serve.options(), parts, common.out);
    spdlog::info("{}", serving->where());
  };
  std::unique_ptr<gpu::Context> context;
  const PairOutcome outcome = process_pair(
      [&]() -> gpu::Context& {
        context = open_device(common);
        return *context;
      },
      folder, common.out, on_row, run_watch(common), attach);
  Facts facts = facts_of(outcome);
  if (serving) facts.take(serving->finish());
  facts.json["complete"] = !outcome.run.interrupted;
  return {facts.text, facts.json,
          outcome.run.interrupted      ? kInterrupted
          : validation_clean(*context) ? 0
                                       : kInternalError};
}

Report process(const Common& common, Options options) {
  ProcessRequest& request = options.request;
  if (is_pair_session(request.input)) return process_fingers(common, request, options.serve);
  request.input = options.camera.input(request.input);
  if (request.input.empty())
    throw Error(Failure::Usage, "an input", "none", "a recording, or --camera /dev/video0");
  request.seed = common.seed;
  const MeasuredInput input = find_input(request);
  const Sensor& sensor = input.sensor;
  request.input = input.input;
  request.outputs = input.outputs;
  if (request.as_recorded) {
    if (!input.session)
      throw Error(Failure::Usage, "a session for --as-recorded", "'" + request.input + "'",
                  "a folder that palpate record wrote");
    const SessionInfo& info = *input.session;
    request.outputs = info.outputs;
    request.chosen_outputs.clear();
    request.solver = info.solver;
    request.solve_by = info.solve_by;
    request.fixed_light = info.fixed_light;
    request.one_sequence = request.one_sequence && !info.separate;
  }
  if (!request.confidence.empty()) request.outputs |= Output::Confidence;
  if (!request.depth.empty() && !wants(request.outputs, Output::Surface)) {
    throw Error(
        Failure::Usage, "a surface for --depth",
        request.chosen_outputs.empty() ? "a sensor that measures no surface" : "--outputs force",
        request.chosen_outputs.empty() ? "a sensor file with \"reading\"" : "--outputs force,surface");
  }
  viz::PictureOptions look;
  options.look.apply(look);
  request.draw = viz::recording_pictures(look);
  if (options.all_digits) request.digits = Digits::All;
  if (common.jsonl) request.on_row = print_line;
  request.watch = [&](const Frame& background) { return monitor_presses(options.block, input, background); };
  const std::unique_ptr<TraceFile> trace = options.trace.start();
  const std::unique_ptr<gpu::Context> context = open_device(common);
  std::optional<Serving> serving;
  if (options.serve.on) {
    serving.emplace(
        options.serve.options(),
        LiveHub::Publisher{sensor, request.outputs, MeasuredColumns::of(sensor, request.outputs), {}},
        common.out);
    serving->attach(request);
    spdlog::info("{}", serving->where());
  }
  const ProcessSummary summary = process_recording(*context, sensor, request, common.out, run_watch(common));
  Report report = facts_of(summary, request, sensor, *context);
  if (!has_scale(sensor)) report.text.insert(0, "no scale is known: lengths are in px (--sensor FILE)\n");
  report.say("\nwritten: " + (common.out / "measurements.csv").string() +
             (wants(request.outputs, Output::Contacts) ? ", contacts.csv" : "") +
             (wants(request.outputs, Output::Force) ? ", summary.csv" : "") + ", summary.json");
  if (serving) report.take(serving->finish());
  report.exit_code = !summary.complete ? kInterrupted : validation_clean(*context) ? 0 : kInternalError;
  return report;
}

}  // namespace

void add_process(CommandLine& program, Common& common, Command& chosen) {
  CommandLine* command = program.add_subcommand(
      "process", "Measure a recording: video, image, folder of images, session, or synthetic:SCENE");
  auto options = std::make_shared<Options>();
  ProcessRequest& request = options->request;
  command->add_option("INPUT", request.input,
                      "Video file, image file, folder of images, session folder, or synthetic:SCENE");
  options->camera.add_to(*command);
  add_settings(
      *command, request,
      {{"sensor"},
       {"background", "Untouched image (default: the sensor file's, or a recording's first frames)"}});
  command
      ->add_option("--out", common.out,
                   "Folder for measurements.csv, summary.csv, summary.json and what else is asked for")
      ->required();
  add_settings(
      *command, request,
      {{"outputs",
        "What to compute: force, surface, confidence, contacts, skin, gradient, traction, motion (default: "
        "force and contacts, "
        "and surface and skin where the sensor can); with contacts separate contacts are distinguished and "
        "followed, with skin the pattern on the pad shows stick, slip and torsion, with motion where "
        "what touches the pad has moved, with confidence the surface leaves out what is not known"},
       {"solver",
        "Surface solver: best (default), on the device or the processor, or live, which is faster"}});
  command->add_flag("--as-recorded", request.as_recorded,
                    "Of a session: measure the frames that were measured live, with the same solver and "
                    "outputs, and check that every digit is as recorded");
  add_settings(*command, request, {{"fixed_light"}});
  command
      ->add_option("--depth", request.depth,
                   "Write each frame's depth map: png16, tiff, npy, ply, obj (repeatable)")
      ->delimiter(',')
      ->transform(one_of(kDepthFormats));
  command
      ->add_option("--confidence", request.confidence,
                   "Write each frame's map of confidence: png16, npy (repeatable); asks for that output too")
      ->delimiter(',')
      ->transform(one_of(kConfidenceFormats));
  command->add_flag("--pictures", request.pictures,
                    "Write pictures/NNNNNN.png: each frame as the window shows it");
  command->add_flag("--video", request.video, "Write recording.mp4: the same as a film");
  command->add_setting("--picture-every", request.picture_every, Check::range(uint64_t{1}, uint64_t{1000000}),
                       "Write a picture (and film frame) every N frames");
  options->look.add(*command);
  options->serve.add_to(*command);
  options->block.add_to(*command);
  add_settings(
      *command, request,
      {{"logs",
        "Log of a robot or another instrument (CSV or JSON lines, a file), written as NAME_log.csv at the "
        "frames' times; the logs of a session come by themselves"}});
  command->add_option("--log-offset", request.log_offset_s,
                      "Seconds to add to its times (default: by its stamps, else by the lag at which it goes "
                      "best with the touch)");
  add_settings(*command, request, {{"rate_Hz"}, {"sequence"}, {"frames", "Stop after that many frames"}});
  options->trace.add_to(*command);
  add_common(
      *command, common,
      "  palpate process press.avi --sensor gel.json --out out/press\n"
      "  palpate process frames/ --sensor pad.json --out out/run --outputs force --json\n"
      "  palpate process press.avi --sensor gel.json --out out/press --depth png16 --depth ply --video\n"
      "  palpate process press.avi --sensor gel.json --out out/press --confidence png16\n"
      "  palpate process --camera /dev/video0 --sensor pad.json --out out/press     until Ctrl-C\n"
      "  palpate process press.avi --sensor gel.json --out out/press --serve     seen in a browser "
      "meanwhile\n"
      "  palpate process out/grip --out out/again                   both fingers of a recorded pair\n"
      "  palpate process synthetic:palpation --out out/check        adds true_* columns and an error table\n"
      "Rows of measurements.csv are whole as they are written; summary.json appears at the end and states\n"
      "whether the recording was processed to its end (\"complete\"). Numbered files of an earlier run in\n"
      "depth/, confidence/ and pictures/ are replaced.\n");
  add_jsonl(*command, common);
  command->add_flag(
      "--all-digits", options->all_digits,
      "Write every digit of each number, including those that its standard error makes meaningless");
  command->runs(chosen, [&common, options] { return process(common, *options); });
}

}  // namespace palpate
