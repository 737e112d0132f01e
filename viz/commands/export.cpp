// palpate export: a recording in the formats of other programs.

#include <algorithm>

#include "capture/files/output_file.h"
#include "capture/pair/pair_clock.h"
#include "capture/pair/pair_export.h"
#include "capture/pair/pair_files.h"
#include "capture/run/input.h"
#include "capture/run/process/processing.h"
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
  std::vector<std::string> inputs;
  std::string hdf5;
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
  request.outputs = request.rows || request.video || request.mcap || !request.episode.empty() ? input.outputs
                                                                                              : Output::Force;
  if (input.session) {
    const SessionInfo& info = *input.session;
    if (!info.outputs.empty() && (request.rows || request.mcap || !request.episode.empty()) && !request.video)
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

std::string list_of_files(const ProcessRequest& request, bool folder) {
  if (!folder) return request.episode.string();
  std::string files = "summary.json";
  if (request.rows) files += ", measurements.csv";
  if (request.rows && wants(request.outputs, Output::Contacts)) files += ", contacts.csv";
  for (const DepthFormat format : request.depth) files += ", depth/*." + std::string(extension(format));
  for (const TractionFormat format : request.traction)
    files += ", traction/*." + std::string(extension(format));
  if (request.video) files += ", recording.mp4";
  if (request.mcap && !request.both) files += ", recording.mcap, metadata.yaml";
  if (!request.episode.empty()) files += ", " + request.episode.string();
  if (!request.images.empty()) files += ", images/*" + request.images + ", sensor.json, background.png";
  return files;
}

/// The recordings to export: the inputs, in place of a folder of sessions those that it holds.
std::vector<std::string> recordings_of(const std::vector<std::string>& inputs) {
  std::vector<std::string> all;
  for (const std::string& input : inputs) {
    std::vector<std::string> within;
    std::error_code code;
    const auto whole = [](const std::filesystem::path& folder) {
      return is_session(folder) || is_pair_session(folder);
    };
    if (!whole(input) && std::filesystem::is_directory(input, code))
      for (const auto& entry : std::filesystem::directory_iterator(input, code))
        if (entry.is_directory(code) && whole(entry.path())) within.push_back(entry.path());
    std::ranges::sort(within);
    if (within.empty()) within.push_back(input);
    all.insert(all.end(), within.begin(), within.end());
  }
  return all;
}

bool is_hdf5_file(const std::filesystem::path& path) {
  return path.extension() == ".h5" || path.extension() == ".hdf5";
}

/// The file of a recording's episode in `folder`.
std::filesystem::path episode_file(const std::filesystem::path& folder, const std::string& recording) {
  std::filesystem::path path = recording;
  if (!path.has_filename()) path = path.parent_path();
  const bool folder_of_ours =
      is_pair_session(recording) || (is_session(recording) && std::filesystem::is_directory(recording));
  std::string name = folder_of_ours ? path.filename() : path.stem();
  for (char& c : name)
    if (c == ':' || c == '?' || c == '&' || c == '=') c = '_';
  return folder / (name + ".h5");
}

Report export_one(gpu::Context& context, const Common& common, const Options& options,
                  const std::string& recording, const std::filesystem::path& episode);

/// Two fingers in one file, on the clock of their rows.
Report export_pair(gpu::Context& context, const Common& common, const Options& options,
                   const std::filesystem::path& folder, const std::filesystem::path& episode) {
  if (!options.request.mcap && episode.empty())
    throw Error(Failure::Usage, "--mcap or --hdf5 of two fingers", "other formats",
                "palpate export " + finger_folder(folder, Side::Left).string());
  if (options.request.mcap && common.out.empty())
    throw Error(Failure::Usage, "--out FOLDER", "none", "--out with a folder for the files");
  FilesForOthers both;
  if (options.request.mcap) {
    make_output_folder(common.out);
    both.mcap.emplace(common.out);
  }
  if (!episode.empty()) both.episode.emplace(episode);
  Report all;
  for (const Side side : kSides) {
    const std::filesystem::path session = finger_folder(folder, side);
    Common here = common;
    if (!common.out.empty()) here.out = finger_folder(common.out, side);
    Options one = options;
    one.request.both = &both;
    one.request.side = to_string(side);
    one.request.offset_s = pair_offset_s(session, folder / kPairRows, side).value_or(0);
    const Report report = export_one(context, here, one, session, episode);
    all.text += std::string(to_string(side)) + ": " + report.text + "\n";
    all.json[to_string(side)] = report.json;
    all.exit_code = report.exit_code;
    if (report.exit_code == 0) continue;
    if (both.mcap) both.mcap->close();  // what is there can be read
    return all;
  }
  for (const std::string& log : add_pair_rows(folder, both)) all.text += "log " + log + "\n";
  both.close();
  if (both.mcap) all.text += common.out.string() + ": recording.mcap, metadata.yaml\n";
  return all;
}

Report export_any(gpu::Context& context, const Common& common, const Options& options,
                  const std::string& recording, const std::filesystem::path& episode) {
  return is_pair_session(recording) ? export_pair(context, common, options, recording, episode)
                                    : export_one(context, common, options, recording, episode);
}

/// One file each; those that are there already are whole, and stay.
Report export_episodes(const Common& common, const Options& options) {
  const std::vector<std::string> recordings = recordings_of(options.inputs);
  const bool one_file = is_hdf5_file(options.hdf5);
  if (one_file && recordings.size() > 1)
    throw Error(Failure::Usage, "--hdf5 FOLDER for several recordings", "'" + options.hdf5 + "'",
                "a folder: each recording becomes a file in it");
  const std::filesystem::path file = options.hdf5;
  make_output_folder(!one_file ? file : file.has_parent_path() ? file.parent_path() : ".");
  std::map<std::filesystem::path, std::string> files;
  for (const std::string& recording : recordings) {
    const auto [at, is_new] = files.try_emplace(one_file ? file : episode_file(file, recording), recording);
    if (!is_new)
      throw Error(Failure::Usage, "recordings of different names",
                  "'" + at->second + "' and '" + recording + "'", "a folder of its own for one of them");
  }
  std::unique_ptr<gpu::Context> context;
  Report all;
  json::Value written = json::Value::array(), skipped = json::Value::array();
  for (const auto& [episode, recording] : files) {
    if (std::filesystem::exists(episode)) {
      skipped.push_back(episode.string());
      all.text += episode.string() + " is there already\n";
      continue;
    }
    if (!context) context = open_device(common);
    const Report one = export_any(*context, common, options, recording, episode);
    all.text += one.text + "\n";
    if (one.exit_code != 0) return {all.text, one.json, one.exit_code};
    written.push_back(episode.string());
  }
  all.json = {{"written", written}, {"skipped", skipped}};
  return all;
}

Report run_export(const Common& common, const Options& options) {
  const bool one = options.inputs.size() == 1;
  if (!options.hdf5.empty() && common.out.empty()) return export_episodes(common, options);
  if (!one)
    throw Error(Failure::Usage, "one recording", std::to_string(options.inputs.size()),
                "--hdf5 FOLDER without --out, which takes several");
  if (!options.hdf5.empty() && !is_hdf5_file(options.hdf5))
    throw Error(Failure::Usage, "--hdf5 FILE.h5 with --out", "'" + options.hdf5 + "'",
                "a name that ends in .h5");
  const std::unique_ptr<gpu::Context> context = open_device(common);
  return export_any(*context, common, options, options.inputs.at(0), options.hdf5);
}

Report export_one(gpu::Context& context, const Common& common, const Options& options,
                  const std::string& recording, const std::filesystem::path& episode) {
  ProcessRequest request = options.request;
  request.input = recording;
  request.episode = episode;
  request.rows = options.csv;
  if (!options.images.empty()) request.images = options.images == "tiff" ? ".tif" : ".png";
  for (const auto& [format, wanted] : options.depth)
    if (wanted) request.depth.push_back(format);
  const bool files = request.rows || !request.depth.empty() || request.video || !request.images.empty() ||
                     !request.traction.empty() || request.mcap;
  if (files && common.out.empty())
    throw Error(Failure::Usage, "--out FOLDER", "none", "--out with a folder for the files");
  if (!files && request.episode.empty())
    throw Error(
        Failure::Usage, "what to export", "nothing asked for",
        "some of --csv, --npy, --png16, --tiff, --ply, --obj, --traction npy, --mp4, --mcap, --hdf5 FILE, "
        "--images png");
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
  const ProcessSummary summary =
      process_recording(context, input.sensor, request, common.out, run_watch(common));
  Report report;
  report.json = facts_of(summary, request, input.sensor, context).json;
  report.text = std::to_string(summary.frames) + (summary.frames == 1 ? " frame" : " frames") +
                " exported to " + (common.out.empty() ? "" : common.out.string() + ": ") +
                list_of_files(request, !common.out.empty());
  if (!summary.complete) report.text += "\nended early: " + summary.ended_by;
  if (summary.depth_clipped_px)
    report.text += "\n" + std::to_string(summary.depth_clipped_px) +
                   " pixels outside the range of 16-bit depth, clipped";
  if (!summary.warning.empty()) report.text += "\nwarning: " + summary.warning;
  if (summary.flaws.px > 0) report.text += "\nwarning: " + summary.flaws.describe();
  report.exit_code = !summary.complete ? kInterrupted : validation_clean(context) ? 0 : kInternalError;
  return report;
}

}  // namespace

void add_export(CommandLine& program, Common& common, Command& chosen) {
  CommandLine* command = program.add_subcommand(
      "export", "Convert a session, or any recording, to the formats of other programs");
  auto options = std::make_shared<Options>();
  ProcessRequest& request = options->request;
  command
      ->add_option("INPUT", options->inputs,
                   "Session folder, video file, image file, folder of images, or synthetic:SCENE")
      ->required();
  command->add_option("--out", common.out, "Folder for the files; not needed by --hdf5 alone");
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
  command->add_option(
      "--hdf5", options->hdf5,
      "A file of HDF5 for learning: frames, touch, depth and skin, each with its times; of a pair "
      "of fingers both. A folder, "
      "without --out: one file for each recording, and of a folder of sessions for each of them; "
      "files that are there already stay");
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
  add_common(
      *command, common,
      "  palpate export out/press --out out/csv --csv\n"
      "  palpate export out/press --out out/mesh --ply --frames 40:60:5\n"
      "  palpate export out/press --out out/depth --tiff --npy --every 10\n"
      "  palpate export out/press --out out/film --mp4 --view 30,40\n"
      "  palpate export out/press --out out/bag --mcap\n"
      "  palpate export out/sessions --hdf5 out/episodes\n"
      "  palpate export out/press --out out/raw --images png\n"
      "  palpate process out/raw/images --sensor out/raw/sensor.json --out out/again\n"
      "Shear, slip and shift are followed from frame to frame: with --csv, --mcap, --hdf5 and --mp4 all "
      "frames before\n"
      "the first one are measured too. Numbered files of an earlier run are replaced.\n");
  command->runs(chosen, [&common, options] { return run_export(common, *options); });
}

}  // namespace palpate
