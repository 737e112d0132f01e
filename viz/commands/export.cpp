// palpate export: a recording in the formats of other programs.

#include "capture/run/input.h"
#include "capture/run/processing.h"
#include "capture/session/session.h"
#include "engine/gpu/context.h"
#include "palpate/error.h"
#include "viz/commands/option_groups/look_options.h"
#include "viz/commands/option_groups/run_options.h"
#include "viz/commands/support/options.h"
#include "viz/commands/support/run_watch.h"
#include "viz/display/recording_pictures.h"

namespace palpate {
namespace {

struct Options {
  ProcessRequest request;
  std::map<DepthFormat, bool> depth;
  bool csv = false;
  std::string images;
  std::string range;
  uint64_t every = 0;
  LookOptions look;
};

FrameRange chosen_frames(const Options& options) {
  FrameRange range;
  if (!options.range.empty()) range = parse_frame_range(options.range);
  if (options.every == 0) return range;
  if (range.step != 1)
    throw Error(Failure::Usage, "one step", "--frames " + options.range + " and --every", "one of them");
  range.step = options.every;
  return range;
}

// A session is measured with the settings of its recording, for what is asked for.
void choose_outputs(const MeasuredInput& input, ProcessRequest& request) {
  if (!request.depth.empty() && !wants(input.outputs, Output::Surface))
    throw Error(Failure::Usage, "a surface for depth files", "a sensor that measures no surface",
                "--csv, --mp4 or --images, or a sensor file with \"reading\"");
  if (!request.traction.empty() && !layer_of(input.sensor))
    throw Error(Failure::Usage, "an elastic layer for traction files", "a sensor without one",
                "\"layer\" in the sensor file (young_MPa, poisson, thickness_mm)");
  request.outputs = request.rows || request.video || request.mcap ? input.outputs : Output::Force;
  if (input.session) {
    const SessionInfo& info = *input.session;
    if (!info.outputs.empty() && (request.rows || request.mcap) && !request.video)
      request.outputs = info.outputs;
    as_recorded(request, info);
  }
  if (!request.depth.empty()) {
    request.outputs |= Output::Surface;
    if (has_gel_contacts(input.sensor) && wants(input.outputs, Output::Contacts))
      request.outputs |= Output::Contacts;
  }
  if (!request.traction.empty()) request.outputs |= input.outputs | Output::Traction;
}

std::string list_of_files(const ProcessRequest& request) {
  std::string files = "summary.json";
  if (request.rows) files += ", measurements.csv";
  if (request.rows && wants(request.outputs, Output::Contacts)) files += ", contacts.csv";
  for (const DepthFormat format : request.depth) files += ", depth/*." + std::string(extension(format));
  for (const TractionFormat format : request.traction)
    files += ", traction/*." + std::string(extension(format));
  if (request.video) files += ", recording.mp4";
  if (request.mcap) files += ", recording.mcap, metadata.yaml";
  if (!request.images.empty()) files += ", images/*" + request.images + ", sensor.json, background.png";
  return files;
}

Report run_export(const Common& common, const Options& options) {
  ProcessRequest request = options.request;
  request.rows = options.csv;
  if (!options.images.empty()) request.images = options.images == "tiff" ? ".tif" : ".png";
  for (const auto& [format, wanted] : options.depth)
    if (wanted) request.depth.push_back(format);
  if (!request.rows && request.depth.empty() && !request.video && request.images.empty() &&
      request.traction.empty() && !request.mcap)
    throw Error(
        Failure::Usage, "what to export", "nothing asked for",
        "some of --csv, --npy, --png16, --tiff, --ply, --obj, --traction npy, --mp4, --mcap, --images png");
  if (request.cloud && !request.mcap)
    throw Error(Failure::Usage, "--mcap with --cloud", "--cloud alone", "--mcap --cloud, or --ply");
  request.range = chosen_frames(options);
  request.seed = common.seed;
  const MeasuredInput input = find_input(request);
  request.input = input.input;
  choose_outputs(input, request);
  viz::PictureOptions look;
  options.look.apply(look);
  request.draw = viz::recording_pictures(look);
  const std::unique_ptr<gpu::Context> context = open_device(common);
  const ProcessSummary summary =
      process_recording(*context, input.sensor, request, common.out, run_watch(common));
  Report report;
  report.json = facts_of(summary, request, input.sensor, *context).json;
  report.text = std::to_string(summary.frames) + (summary.frames == 1 ? " frame" : " frames") +
                " exported to " + common.out.string() + ": " + list_of_files(request);
  if (!summary.complete) report.text += "\nended early: " + summary.ended_by;
  if (summary.depth_clipped_px)
    report.text += "\n" + std::to_string(summary.depth_clipped_px) +
                   " pixels outside the range of 16-bit depth, clipped";
  if (!summary.warning.empty()) report.text += "\nwarning: " + summary.warning;
  if (summary.flaws.px > 0) report.text += "\nwarning: " + summary.flaws.describe();
  report.exit_code = !summary.complete ? kInterrupted : validation_clean(*context) ? 0 : kInternalError;
  return report;
}

}  // namespace

void add_export(CommandLine& program, Common& common, Command& chosen) {
  CommandLine* command = program.add_subcommand(
      "export", "Convert a session, or any recording, to the formats of other programs");
  auto options = std::make_shared<Options>();
  ProcessRequest& request = options->request;
  command
      ->add_option("INPUT", request.input,
                   "Session folder, video file, image file, folder of images, or synthetic:SCENE")
      ->required();
  command->add_option("--out", common.out, "Folder for the files")->required();
  add_settings(*command, request, {{"sequence"}});
  command->add_flag("--csv", options->csv, "measurements.csv: one row a frame");
  command->add_flag("--npy", options->depth[DepthFormat::Npy], "depth/NNNNNN.npy: float32, mm");
  command->add_flag("--png16", options->depth[DepthFormat::Png16],
                    "depth/NNNNNN.png: 16 bits, 0.2 um a count (depth.json says from where)");
  command->add_flag("--tiff", options->depth[DepthFormat::Tiff],
                    "depth/NNNNNN.tif: signed 16 bits, 1 um a count, with its scale in its tags");
  command->add_flag("--ply", options->depth[DepthFormat::Ply], "depth/NNNNNN.ply: mesh in mm, binary");
  command->add_flag("--obj", options->depth[DepthFormat::Obj], "depth/NNNNNN.obj: mesh in mm, text");
  command
      ->add_option(
          "--traction", request.traction,
          "traction/NNNNNN: pressure and shear on the pad, kPa, of sensors with a layer: npy (cells of "
          "pressure, shear x, shear y), tiff (pressure) or ply (the mesh with them at its vertices)")
      ->delimiter(',')
      ->transform(one_of(kTractionFormats));
  command->add_flag("--mp4", request.video, "recording.mp4: each frame as the window shows it");
  command->add_flag("--mcap", request.mcap,
                    "recording.mcap: images, depth, wrench and all measurements with their times, as "
                    "ROS 2 and Foxglove read them, with metadata.yaml, for `ros2 bag play`");
  command->add_flag("--cloud", request.cloud, "With --mcap: the surface as points too, thrice the size");
  command
      ->add_option("--images", options->images,
                   "images/NNNNNN: the frames without loss, png or tiff, with sensor.json and "
                   "background.png, which palpate process reads")
      ->check(Check::one_of({"png", "tiff"}));
  command->add_option("--frames", options->range,
                      "Of the recording FIRST:END or FIRST:END:STEP, END not included, or one number; as in "
                      "the column 'frame' (default: all)");
  command->add_option("--every", options->every, "Every N-th of those frames")
      ->check(Check::range(uint64_t{1}, uint64_t{1000000000}));
  add_settings(
      *command, request,
      {{"sensor", "Sensor file (default: the session's own)"},
       {"background", "Untouched image (default: the session's, the sensor file's, or the first frames)"},
       {"solver", "Surface solver: live or best (default: the session's; best)"},
       {"rate_Hz"}});
  options->look.add(*command);
  add_common(*command, common,
             "  palpate export out/press --out out/csv --csv\n"
             "  palpate export out/press --out out/mesh --ply --frames 40:60:5\n"
             "  palpate export out/press --out out/depth --tiff --npy --every 10\n"
             "  palpate export out/press --out out/film --mp4 --view 30,40\n"
             "  palpate export out/press --out out/bag --mcap\n"
             "  palpate export out/press --out out/raw --images png\n"
             "  palpate process out/raw/images --sensor out/raw/sensor.json --out out/again\n"
             "Shear, slip and shift are followed from frame to frame: with --csv, --mcap and --mp4 all "
             "frames before\n"
             "the first one are measured too. Numbered files of an earlier run are replaced.\n");
  command->runs(chosen, [&common, options] { return run_export(common, *options); });
}

}  // namespace palpate
