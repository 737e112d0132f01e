// palpate live: the surface and the measurements while they happen.
#include <spdlog/spdlog.h>

#include <CLI/CLI.hpp>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>

#include "capture/measurements.h"
#include "capture/output_file.h"
#include "capture/source.h"
#include "engine/gpu/context.h"
#include "viz/command.h"
#include "viz/input.h"
#include "viz/live.h"
#include "viz/window.h"

namespace palpate {
namespace {

struct Options {
  std::string input = "synthetic:palpation?mode=gel&repeat=0";
  std::filesystem::path sensor;
  std::filesystem::path background;
  SurfaceSolver solver = SurfaceSolver::Live;
  bool skip_untouched = false;
  viz::LiveOptions live;
};

Report live(const Common& common, Options options) {
  // Before anything else is opened: without a display the rest is in vain.
  const std::vector<const char*> extensions = viz::window_extensions();
  const MeasuredInput input = find_input(common, options.input, options.sensor, options.background);
  const std::unique_ptr<Source> first = open_source(input.input, input.sensor);
  const Frame background = load_background(input.input, input.sensor, *first);
  const FrameFormat format = first->format();

  const std::unique_ptr<gpu::Context> context = open_device(common, &extensions);
  PipelineOptions pipeline{
      .outputs = input.outputs, .solver = options.solver, .skip_untouched = options.skip_untouched};
  std::optional<Measurements> measurements;
  if (!common.out.empty()) {
    make_output_folder(common.out);
    measurements.emplace(
        common.out / "measurements.csv",
        Measurements::Columns{.outputs = input.outputs, .truth = false, .time = first->rate_Hz() > 0});
    options.live.on_result = [&](const Touch& touch) { measurements->add(touch, nullptr); };
    options.live.screenshots = common.out;
  }
  options.live.title = "palpate: " + input.input;
  options.live.interrupted = interrupted;
  const viz::LiveReport report = viz::run_live(
      *context, [&] { return open_source(input.input, input.sensor); }, input.sensor, background, pipeline,
      options.live);
  if (measurements) measurements->close();

  const nlohmann::ordered_json value = {{"input", input.input},
                                        {"sensor", input.sensor.name},
                                        {"device", context->report().name},
                                        {"width_px", format.width},
                                        {"height_px", format.height},
                                        {"complete", !report.interrupted},
                                        {"seconds", report.seconds},
                                        {"captured", report.captured},
                                        {"processed", report.processed},
                                        {"shown", report.shown},
                                        {"shown_per_s", report.shown_per_s},
                                        {"dropped_before_engine", report.dropped_before_engine},
                                        {"dropped_before_display", report.dropped_before_display},
                                        {"latency_median_ms", report.latency_median_ms},
                                        {"latency_p95_ms", report.latency_p95_ms},
                                        {"draw_median_ms", report.draw_median_ms}};
  char text[320];
  std::snprintf(text, sizeof text,
                "%llu frames captured, %llu measured, %llu shown in %.1f s: %.1f pictures/s\n"
                "latency from delivery to display: median %.1f ms, 95 %% below %.1f ms\n",
                static_cast<unsigned long long>(report.captured),
                static_cast<unsigned long long>(report.processed),
                static_cast<unsigned long long>(report.shown), report.seconds, report.shown_per_s,
                report.latency_median_ms, report.latency_p95_ms);
  return {text, value.dump(2, ' ', false, nlohmann::json::error_handler_t::replace),
          report.interrupted           ? kInterrupted
          : validation_clean(*context) ? 0
                                       : kInternalError};
}

}  // namespace

void add_live(CLI::App& program, Common& common, Command& chosen) {
  CLI::App* command = program.add_subcommand("live", "Show surface and measurements live in a window");
  auto options = std::make_shared<Options>();
  viz::LiveOptions& live_options = options->live;
  command->add_option(
      "INPUT", options->input,
      "Video, folder of images, or synthetic:SCENE (default: a simulated palpation, without end)");
  command->add_option("--sensor", options->sensor,
                      "Sensor file (JSON, see README.md); synthetic inputs need none");
  command
      ->add_option("--background", options->background,
                   "Untouched image (default: the sensor file's, or a recording's first frames)")
      ->check(CLI::ExistingFile);
  command->add_option("--out", common.out,
                      "Folder for measurements.csv (frames that were measured) and screenshots");
  command
      ->add_option("--solver", options->solver,
                   "Surface solver: live (default), fine, converged or exact (CPU)")
      ->transform(CLI::CheckedTransformer(kSolverNames));
  command->add_flag("--skip-untouched", options->skip_untouched,
                    "Compute only a window around the contact; beyond it depth is 0");
  command->add_option("--frames", live_options.max_frames, "End after that many frames");
  command->add_option("--seconds", live_options.max_seconds, "End after so long")->check(CLI::PositiveNumber);
  command
      ->add_option("--rate", live_options.rate_Hz,
                   "Frames a second (default: the recording's own, 10 for images)")
      ->check(CLI::PositiveNumber);
  command->add_flag("--loop", live_options.loop, "Start a recording again at its end");
  command->add_flag("--close", live_options.close_at_end, "Close the window at the end of the recording");
  command
      ->add_option("--vsync", live_options.vsync,
                   "on (default), mailbox (newest picture at each refresh), off (at once, may tear)")
      ->transform(CLI::CheckedTransformer(std::map<std::string, viz::Vsync>{
          {"on", viz::Vsync::On}, {"mailbox", viz::Vsync::Mailbox}, {"off", viz::Vsync::Off}}));
  add_common(*command, common,
             "  palpate live                                       a simulated palpation on a gel skin\n"
             "  palpate live press.avi --sensor gel.json --loop    a recording, again and again\n"
             "  palpate live synthetic:slide --seconds 6 --close --out out/live --json\n"
             "In the window: drag to orbit, right-drag to pan, wheel to zoom, H for all keys.\n"
             "Live, the newest frame wins: frames that come too fast are dropped, counted and shown.\n");
  command->callback(
      [&common, &chosen, options] { chosen = [&common, options] { return live(common, *options); }; });
}

}  // namespace palpate
