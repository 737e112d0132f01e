// palpate gallery: every sensor that a sensor file is shipped for, measured on its published recording and
// shown side by side.
#include <spdlog/spdlog.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "capture/files/output_file.h"
#include "capture/run/input.h"
#include "capture/run/process/processing.h"
#include "capture/sensors/shipped_sensors.h"
#include "engine/base/json.h"
#include "engine/base/text.h"
#include "engine/gpu/context.h"
#include "palpate/error.h"
#include "viz/commands/command.h"
#include "viz/commands/support/options.h"
#include "viz/commands/support/progress.h"
#include "viz/commands/support/run_watch.h"
#include "viz/display/recording_pictures.h"
#include "viz/report/html.h"

namespace palpate {
namespace {

namespace fs = std::filesystem;

struct Options {
  fs::path data, list;
};

struct Entry {
  std::string title;
  fs::path sensor, recording, background;
};

/// One sensor's part of the page.
struct Shown {
  Entry entry;
  Sensor sensor;
  ProcessSummary summary;
  TouchSpan peak;       ///< of the largest touch
  std::string picture;  ///< its place next to the page
  std::string missing;  ///< why it was not measured
};

std::vector<Entry> entries(const Options& options) {
  const fs::path list =
      options.list.empty() ? shipped_sensors_folder() / "gallery/recordings.json" : options.list;
  std::ifstream in(list, std::ios::binary);
  if (!in)
    throw Error(Failure::Input, "a list of sensors and recordings", "nothing at " + list.string(),
                "--list FILE");
  const std::string bytes((std::istreambuf_iterator<char>(in)), {});
  std::vector<Entry> all;
  try {
    for (const json::Value& one : json::parse(bytes)) {
      Entry entry{one.at("title").text(),
                  list.parent_path() / one.at("sensor").text(),
                  options.data / one.at("recording").text(),
                  {}};
      if (one.contains("background")) entry.background = options.data / one.at("background").text();
      all.push_back(std::move(entry));
    }
  } catch (const json::Error& error) {
    throw Error(Failure::Input, "a list of objects with title, sensor and recording in " + list.string(),
                error.what(), "capture/sensors/gallery/recordings.json as an example");
  }
  return all;
}

/// Deepest, or strongest, or widest.
TouchSpan largest(const std::vector<TouchSpan>& spans) {
  const auto size = [](const TouchSpan& span) {
    return span.surface ? span.surface->depth_max_mm : static_cast<double>(span.largest_area_px) * 1e-9;
  };
  return spans.empty() ? TouchSpan{} : *std::ranges::max_element(spans, {}, size);
}

Shown measure(gpu::Context& context, const Common& common, const Entry& entry, size_t number) {
  Shown shown{entry, {}, {}, {}, {}, {}};
  try {
    const MeasuredInput input =
        find_input(common.seed, entry.recording.string(), entry.sensor, entry.background);
    shown.sensor = input.sensor;
    ProcessRequest request;
    request.input = input.input;
    request.outputs = input.outputs;
    request.draw = viz::recording_pictures({});
    const fs::path folder = common.out / text("%02zu", number);
    shown.summary = process_recording(context, input.sensor, request, folder, run_watch(common));
    if (interrupted()) return shown;
    shown.peak = largest(shown.summary.spans);
    request.pictures = true;
    request.picture_frames = {shown.peak.peak_frame};
    process_recording(context, input.sensor, request, folder, run_watch(common));
    shown.picture =
        text("%02zu/pictures/%06llu.png", number, static_cast<unsigned long long>(shown.peak.peak_frame));
  } catch (const Error& error) {
    shown.missing = error.what();
  }
  return shown;
}

std::string origin_of(const Sensor& sensor) {
  std::string text;
  const auto add = [&](const char* what, const Origin& origin) {
    if (!origin.note.empty()) text += "<li>" + std::string(what) + ": " + html_escaped(origin.note) + "</li>";
  };
  if (sensor.reading == SurfaceReading::Photometric) add("depth by colour", sensor.photometric.origin);
  if (sensor.reading == SurfaceReading::Lookup) add("depth by brightness", sensor.lookup.origin);
  if (sensor.force) add("force", sensor.force->origin);
  if (!text.empty()) return text;
  return sensor.reading != SurfaceReading::None ? "<li>depth: error not stated in the sensor file</li>"
         : has_scale(sensor)                    ? "<li>no depth, no force: areas in mm2</li>"
                                                : "<li>no depth, no force: areas in px</li>";
}

std::string depth_text(const TouchSpan& span) {
  if (!span.surface) return "-";
  const SurfaceSummary& s = *span.surface;
  std::string depth = text("%.3f", s.depth_max_mm);
  if (s.depth_sd_mm > 0) depth += text(" &plusmn; %.3f", s.depth_sd_mm);
  return depth + " (" + html_escaped(to_string(s.validity)) + ")";
}

std::string card(const Shown& s) {
  std::string html = "<section class=\"card\"><h2>" + html_escaped(s.entry.title) + "</h2>\n";
  if (!s.missing.empty())
    return html + "<p class=\"missing\">" + html_escaped(s.missing) + "</p></section>\n";
  html += "<img src=\"" + s.picture + "\" alt=\"" + html_escaped(s.entry.title) + "\">\n<ul>";
  html += "<li>" + html_escaped(s.sensor.name) + "</li>";
  html += has_scale(s.sensor) ? text("<li>%.4g mm per px</li>", s.sensor.pitch_mm_per_px)
                              : "<li>scale not known</li>";
  return html + origin_of(s.sensor) + "</ul></section>\n";
}

std::string row(const Shown& s) {
  if (!s.missing.empty())
    return "<tr><td>" + html_escaped(s.entry.title) + "</td><td colspan=\"7\">not measured</td></tr>\n";
  const ProcessSummary& m = s.summary;
  const auto whole = [](uint64_t n) { return "<td>" + std::to_string(n) + "</td>"; };
  return "<tr><td>" + html_escaped(s.entry.title) + "</td>" + whole(m.frames) + whole(m.contact_frames) +
         whole(m.most_contacts) + whole(m.contact_ids) + "<td>" + depth_text(s.peak) + "</td>" +
         whole(m.saturated_frames) +
         text("<td>%.0f</td></tr>\n", m.seconds > 0 ? static_cast<double>(m.frames) / m.seconds : 0);
}

std::string page(const std::vector<Shown>& all, const std::string& device) {
  const auto measured = static_cast<size_t>(std::ranges::count(all, std::string(), &Shown::missing));
  std::string html = "<h1>Sensors, side by side</h1>\n";
  html += text("<p>%zu of %zu sensors measured on %s; each picture is the frame of the largest touch.</p>\n",
               measured, all.size(), html_escaped(device).c_str());
  html += "<div class=\"cards\">\n";
  for (const Shown& one : all) html += card(one);
  html +=
      "</div>\n<table>\n<tr><th>sensor</th><th>frames</th><th>touched</th><th>most contacts</th><th>contact "
      "ids</th>"
      "<th>largest depth, mm (state)</th><th>saturated frames</th><th>frames/s</th></tr>\n";
  for (const Shown& one : all) html += row(one);
  return html_page("Sensors", html + "</table>\n");
}

Report gallery(const Common& common, const Options& options) {
  const std::vector<Entry> list = entries(options);
  catch_interrupts();
  const std::unique_ptr<gpu::Context> context = open_device(common);
  make_output_folder(common.out);
  std::vector<Shown> all;
  for (const Entry& entry : list) {
    if (interrupted()) break;
    all.push_back(measure(*context, common, entry, all.size() + 1));
    if (!all.back().missing.empty()) spdlog::warn("{}: {}", entry.title, all.back().missing);
  }
  const fs::path file = common.out / "index.html";
  write_whole(file, std::string_view(page(all, context->report().name)));
  json::Value value = json::Value::array();
  std::string text;
  size_t measured = 0;
  for (const Shown& s : all) {
    measured += s.missing.empty();
    text += palpate::text(
        "%-40s %s\n", s.entry.title.c_str(),
        s.missing.empty()
            ? palpate::text(
                  "%llu frames, up to %llu contacts at once%s",
                  static_cast<unsigned long long>(s.summary.frames),
                  static_cast<unsigned long long>(s.summary.most_contacts),
                  s.peak.surface ? palpate::text(", %.3f mm deep", s.peak.surface->depth_max_mm).c_str() : "")
                  .c_str()
            : s.missing.c_str());
    value.push_back({{"title", s.entry.title},
                     {"measured", s.missing.empty()},
                     {"frames", s.summary.frames},
                     {"most_contacts", s.summary.most_contacts},
                     {"picture", s.picture}});
  }
  const int code = interrupted() ? kInterrupted : measured == 0 ? static_cast<int>(Failure::Input) : 0;
  return {text + "written: " + file.string(), json::Value{{"page", file.string()}, {"sensors", value}}, code};
}

}  // namespace

void add_gallery(CommandLine& program, Common& common, Command& chosen) {
  CommandLine* command = program.add_subcommand(
      "gallery", "Measure every shipped sensor on its published recording, on one page");
  auto options = std::make_shared<Options>();
  command->add_option("DATA", options->data, "Folder with the published recordings")->required();
  command
      ->add_option("--list", options->list,
                   "Another list of titles, sensor files and recordings (default: the shipped sensors')")
      ->check(Check::existing_file());
  command->add_option("--out", common.out, "Folder for index.html and what it shows")->required();
  add_common(
      *command, common,
      "  palpate gallery recordings/ --out out/gallery\n"
      "  palpate gallery . --list mine.json --out out/mine\n"
      "The list is a JSON array of {\"title\", \"sensor\" (next to the list), \"recording\", \"background\" "
      "(below DATA)}. A missing recording is named on the page.\n");
  command->runs(chosen, [&common, options] { return gallery(common, *options); });
}

}  // namespace palpate
