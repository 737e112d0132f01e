// palpate map: a recording of a pad that moves over an object, as one height map.
#include <spdlog/spdlog.h>

#include "capture/files/map_files.h"
#include "capture/files/output_file.h"
#include "capture/run/map/map_recording.h"
#include "engine/base/json.h"
#include "engine/base/text.h"
#include "engine/gpu/context.h"
#include "palpate/error.h"
#include "viz/commands/command.h"
#include "viz/commands/option_groups/run_options.h"
#include "viz/commands/support/options.h"
#include "viz/commands/support/progress.h"
#include "viz/commands/support/run_watch.h"
#include "viz/report/plot.h"

namespace palpate {
namespace {

struct Options {
  MapRequest request;
  bool no_loops = false;
};

/// One point of some, so that a large map is drawn at once.
PlotMap plot_of(const FusedMap& map, const std::vector<float>& values, const char* label) {
  constexpr uint32_t kMost = 500;  // columns or rows
  const uint32_t step = std::max({1u, map.width / kMost, map.height / kMost});
  PlotMap plot{.columns = map.width / step,
               .rows = map.height / step,
               .pitch_x = map.pitch_mm * step,
               .pitch_y = map.pitch_mm * step};
  for (uint32_t row = 0; row < plot.rows; ++row)
    for (uint32_t column = 0; column < plot.columns; ++column)
      plot.values.push_back(double{values[size_t{row} * step * map.width + size_t{column} * step]});
  plot.x = map.left_mm + (plot.columns - 1) * plot.pitch_x / 2;
  plot.y = map.top_mm + (plot.rows - 1) * plot.pitch_y / 2;
  plot.label = label;
  return plot;
}

Plot picture_of(const MapPiece& piece) {
  const auto panel = [&](const char* title, const std::vector<float>& values, const char* label) {
    PlotPanel out{title, "x, mm", "y, mm"};
    out.map = plot_of(piece.map, values, label);
    out.down = true;
    out.equal = true;
    return out;
  };
  PlotPanel height = panel("Height", piece.map.height_mm, "mm");
  // Where the pad's middle was.
  PlotCurve way{.title = "", .width = 1};
  for (const MapKey& key : piece.keys) {
    const Eigen::Vector3d place = key.motion.inverse() * Eigen::Vector3d::Zero();
    way.add(place[0], place[1]);
  }
  height.curves.push_back(way);
  return {.panels = {height, panel("Coverage", piece.map.coverage, "key frames")},
          .width_px = 1100,
          .height_px = 900};
}

std::string table_of(const MapSnapshot& map) {
  std::string out;
  size_t number = 0;
  for (const MapPiece& piece : map.pieces) {
    const FusedMap& m = piece.map;
    out += text("map %zu: %.1f x %.1f mm, %.0f mm2 seen, %zu key frames, pixels of %.3g mm, ", ++number,
                m.width * m.pitch_mm, m.height * m.pitch_mm, m.covered_mm2(), piece.keys.size(), m.pitch_mm);
    out += std::isnan(m.noise_mm)
               ? "error not known: no two key frames overlap\n"
               : text("standard error %.2g mm (one key frame: %.2g mm)\n", stated_error_mm(m), m.noise_mm);
  }
  return out;
}

/// What there is to say of a recording that gave little or several pieces.
std::string words_of(const RecordingMap& found) {
  const MapSnapshot& map = *found.map;
  std::string out;
  if (found.tracked == 0)
    out += "no map: the contact is too small or none in all frames\n";
  else if (map.keys == 1)
    out +=
        "one key frame alone: the pad did not move over the object, or its surface does not show by how "
        "much\n";
  if (map.found_again > 0)
    out += text("found again on what was mapped before: %u of %u tracks\n", map.found_again, found.tracks);
  if (map.ambiguous > 0)
    out += text("looked alike at several places, and joined to none: %u searches\n", map.ambiguous);
  if (map.pieces.size() > 1)
    out += text("not connected: %zu pieces, each in its own axes\n", map.pieces.size());
  if (map.smooth > 0)
    out += text("%u key frames hang together with no other one: too smooth, or something else was touched\n",
                map.smooth);
  if (map.missed > 0) out += text("%u key frames found no room (--most-keys)\n", map.missed);
  uint64_t sliding = 0;
  for (const auto& [name, frames] : found.surfaces) sliding += name == "none" ? 0 : frames;
  if (2 * sliding > found.tracked)
    out += "no texture: in " + std::to_string(sliding) + " of " + std::to_string(found.tracked) +
           " frames the contact slides along itself unseen\n";
  return out;
}

Report report_of(const RecordingMap& found) {
  const MapSnapshot& map = *found.map;
  Report report;
  report.json = map_report(found);
  report.say(text(
      "%llu frames: %llu tracked, %llu lost, %llu without contact; %u key frames, %u loops, %u refused\n",
      static_cast<unsigned long long>(found.frames), static_cast<unsigned long long>(found.tracked),
      static_cast<unsigned long long>(found.lost), static_cast<unsigned long long>(found.no_contact),
      map.keys, map.loops, map.refused));
  report.say(table_of(map));
  report.say(words_of(found));
  return report;
}

Report run(const Common& common, Options options) {
  MapRequest& request = options.request;
  request.seed = common.seed;
  request.map.loops = !options.no_loops;
  catch_interrupts();
  if (!common.out.empty()) make_output_folder(common.out);  // refused before the work, not after it
  const std::unique_ptr<gpu::Context> context = open_device(common);
  const RecordingMap found = map_recording(*context, request, run_watch(common));
  if (!found.warning.empty()) spdlog::warn("{}", found.warning);
  if (!found.error.empty()) spdlog::error("{}", found.error);
  Report report = report_of(found);
  if (!common.out.empty()) {
    std::string written = "written to " + common.out.string() + ":";
    for (const std::string& name : write_map(common.out, found)) written += " " + name;
    if (!found.map->pieces.empty()) {
      std::string drawn;
      draw_plot(picture_of(found.map->pieces.front()), common.out / "map", drawn);
      written += drawn;
    }
    report.say(written);
  }
  report.exit_code = !validation_clean(*context)                         ? kInternalError
                     : interrupted()                                     ? kInterrupted
                     : found.map->pieces.empty() || !found.error.empty() ? static_cast<int>(Failure::Input)
                                                                         : 0;
  return report;
}

}  // namespace

void add_map(CommandLine& program, Common& common, Command& chosen) {
  CommandLine* command = program.add_subcommand(
      "map", "One height map larger than the pad, of a recording that moves over an object");
  auto options = std::make_shared<Options>();
  MapRequest& request = options->request;
  command
      ->add_option("INPUT", request.input, "Session folder, video file, folder of images, or synthetic:SCENE")
      ->required();
  add_settings(*command, request,
               {{"sensor"},
                {"background", "Untouched image (default: the sensor file's, or a recording's first frames)"},
                {"solver"},
                {"fixed_light"}});
  command->add_option("--pitch-mm", request.map.pitch_mm, "Of the map's pixels (default: the key frames')")
      ->check(Check::positive());
  command->add_setting("--key-overlap", request.map.key_overlap,
                       Check::range(MapRequest::kLeastOverlap, MapRequest::kMostOverlap),
                       "Part of a contact that the next key frame still shows");
  command->add_setting("--links", request.map.links, Check::range(1, MapRequest::kMostLinks),
                       "Key frames that each one is compared with");
  command->add_flag("--no-loops", options->no_loops, "Compare each key frame with the last one alone");
  command->add_setting("--most-keys", request.map.most_keys, Check::range(2, MapRequest::kMostKeys),
                       "Key frames that are kept, 0.2 MB each");
  command->add_setting(
      "--contact-share", request.contact_share, Check::range(MapRequest::kLeastShare, MapRequest::kMostShare),
      "Part of the way from a frame's lowest to its deepest place from which it counts as touched");
  add_settings(*command, request, {{"rate_Hz"}, {"frames", "Stop after that many frames"}});
  command->add_option(
      "--out", common.out,
      "Folder for map.npy, map_error.npy, coverage.npy, map.ply, map.tif, map.json, pictures");
  add_common(
      *command, common,
      "  palpate map slide.avi --sensor gel.json --out out/map\n"
      "  palpate map out/slide --pitch-mm 0.1 --no-loops --json\n"
      "Heights are in the pad's axes at the first key frame: x right, y down, z out of the object.\n"
      "Parts that no texture connects are maps of their own: map.npy is the largest, map_2.npy the next.\n"
      "Ctrl-C ends the recording, and what was seen until then is mapped (exit code 130). Exit code 3\n"
      "where there is no map, or the recording is damaged: what came before that is mapped.\n");
  command->runs(chosen, [&common, options] { return run(common, *options); });
}

}  // namespace palpate
