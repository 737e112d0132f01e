// palpate profile: speed, error and memory of a device, and machines side by side.
#include <spdlog/spdlog.h>

#include "capture/files/output_file.h"
#include "engine/base/json.h"
#include "engine/gpu/context.h"
#include "palpate/error.h"
#include "perf/profile/report/answers.h"
#include "perf/profile/report/compare.h"
#include "perf/profile/report/files.h"
#include "perf/profile/report/tables.h"
#include "perf/profile/run.h"
#include "viz/commands/command.h"
#include "viz/commands/support/options.h"
#include "viz/commands/support/progress.h"
#include "viz/display/picture.h"

namespace palpate {
namespace {

struct Options {
  std::vector<std::string> sizes;
  bool quick = false;
  bool all_devices = false;
  double budget_s = 0;
  std::vector<std::string> compare;
};

void warn_of_plots(const std::string& hindrance) {
  if (!hindrance.empty())
    spdlog::warn("no plots: {}; tables and files are complete (Debian: gnuplot-nox)", hindrance);
}

Report compare(const Common& common, const Options& options) {
  if (options.compare.size() < 2)
    throw Error(Failure::Usage, "two or more profile.json behind --compare", "one",
                "palpate profile --compare a/profile.json b/profile.json");
  std::vector<perf::Profile> profiles;
  for (const std::string& file : options.compare) profiles.push_back(perf::load_profile(file));
  const perf::MachineComparison comparison = perf::compare_profiles(profiles);
  Report report{perf::describe(comparison), perf::to_json(comparison), 0};
  if (!common.out.empty()) {
    make_output_folder(common.out);
    warn_of_plots(perf::write_comparison(comparison, common.out));
    report.text += "written: " + (common.out / "compare.html").string() + "\n";
  }
  return report;
}

/// Indices of the devices to measure; empty text: whatever --device or the best one is.
std::vector<std::string> chosen_devices(const Common& common, const Options& options) {
  if (!options.all_devices) return {common.device};
  std::vector<std::string> indices;
  for (const gpu::DeviceReport& device : gpu::list_devices()) {
    if (device.refusals.empty())
      indices.push_back(std::to_string(device.index));
    else
      spdlog::info("device {} {}: refused, {}", device.index, device.name, device.refusals.front());
  }
  if (indices.empty())
    throw Error(Failure::Device, "a usable Vulkan device", "none", "palpate devices, which says why");
  return indices;
}

/// The profile, and whether the validation layer had nothing to say.
std::pair<perf::Profile, bool> measure(const Common& common, const Options& options,
                                       const std::string& device, const std::filesystem::path& out) {
  gpu::ContextOptions context;
  context.device = device;
  context.validation = common.validation;
  perf::ProfileRequest request;
  request.quick = options.quick;
  request.budget_s = options.budget_s;
  request.drawer = viz::timed_drawer;
  for (const std::string& size : options.sizes) request.sizes.push_back(perf::parse_size(size));
  perf::Watch watch;
  watch.stopped = interrupted;
  watch.say = [](const std::string& line) { spdlog::info("{}", line); };
  bool clean = true;
  watch.leave = [&](const gpu::Context& done) { clean = validation_clean(done) && clean; };
  gpu::Context{context};  // a device that is not there is said before a folder is made
  make_output_folder(out);
  const perf::Profile profile = perf::run_profile(
      context, request, watch, [&](const perf::Profile& so_far) { perf::write_figures(so_far, out); });
  warn_of_plots(perf::write_report(profile, out));
  return {profile, clean};
}

std::string describe(const perf::Profile& profile, const std::filesystem::path& out) {
  std::string text =
      perf::headline(profile) + "\n" + profile.machine.device + ", " + profile.machine.driver + "\n\n";
  for (const perf::Table& table : perf::tables_of(profile)) text += perf::to_text(table) + "\n";
  if (!profile.complete) text += "ended before it was complete\n";
  return text + "written: " + (out / "report.html").string() + "\n";
}

Report profile(const Common& common, const Options& options) {
  if (!options.compare.empty()) return compare(common, options);
  if (common.out.empty())
    throw Error(Failure::Usage, "--out DIR for the profile, or --compare A.json B.json ...", "neither",
                "palpate profile --out out/profile");
  const std::vector<std::string> devices = chosen_devices(common, options);
  Report report;
  json::Value list = json::Value::array();
  for (const std::string& device : devices) {
    if (interrupted()) break;
    const std::filesystem::path out = options.all_devices ? common.out / ("device-" + device) : common.out;
    const auto [result, clean] = measure(common, options, device, out);
    if (!clean) report.exit_code = kInternalError;
    report.text += describe(result, out);
    list.push_back(perf::to_json(result));
  }
  if (interrupted()) report.exit_code = kInterrupted;
  if (list.empty()) return interrupted_report();
  report.json = options.all_devices ? list : list.at(0);
  return report;
}

}  // namespace

void add_profile(CommandLine& program, Common& common, Command& chosen) {
  CommandLine* command = program.add_subcommand(
      "profile", "Measure speed, bandwidth, error and memory of this machine, or compare machines");
  auto options = std::make_shared<Options>();
  command->add_option("--out", common.out, "Folder for profile.json, CSV files, plots and report.html");
  command->add_option("--sizes", options->sizes, "Frames, e.g. 640x480,1392x1042 [160x120 to 8192x8192]")
      ->delimiter(',')
      ->option_text("LIST");
  command
      ->add_option("--budget", options->budget_s,
                   "Time for one device, s, about; what does not fit is skipped and listed [180]")
      ->check(Check::range(1.0, 86400.0))
      ->option_text("S");
  auto* quick = command->add_flag("--quick", options->quick, "Three small sizes in 20 s");
  auto* all = command->add_flag("--all-devices", options->all_devices,
                                "Every usable device, each in a folder device-INDEX");
  auto* pair = command
                   ->add_option("--compare", options->compare,
                                "profile.json of two or more machines side by side; measures nothing")
                   ->option_text("A.json B.json ...");
  pair->excludes(quick)->excludes(all);
  add_common(
      *command, common,
      "  palpate profile --out out/profile                    three minutes; open out/profile/report.html\n"
      "  palpate profile --quick --out out/quick --device 1   20 s on one device\n"
      "  palpate profile --all-devices --out out/devices      every device of this machine\n"
      "  palpate profile --compare a/profile.json b/profile.json --out out/compare\n");
  command->get_option("--device")->excludes(all);
  command->runs(chosen, [&common, options] { return profile(common, *options); });
}

}  // namespace palpate
