#include "viz/commands/option_groups/pair_options.h"

#include <spdlog/spdlog.h>

#include "capture/live/live_report.h"
#include "engine/base/text.h"
#include "palpate/error.h"
#include "viz/commands/support/options.h"

namespace palpate {
namespace {

constexpr const char* kPairGroup = "Two fingers";

std::string finger_line(Side side, const LiveReport& report, uint64_t alone) {
  return text("  %-5s  %llu frames measured, %llu without a partner\n", to_string(side),
              static_cast<unsigned long long>(report.processed), static_cast<unsigned long long>(alone));
}

}  // namespace

void PairChoice::add_to(CommandLine& command) {
  command
      .add_option("--left", left, "Input of the left finger, with --right: a gripper's two sensors together")
      ->group(kPairGroup);
  command.add_option("--right", right, "Input of the right finger")->group(kPairGroup);
  command.add_option("--left-sensor", left_sensor, "Sensor file of the left finger (default: --sensor)")
      ->group(kPairGroup);
  command.add_option("--right-sensor", right_sensor, "Sensor file of the right finger (default: --sensor)")
      ->group(kPairGroup);
  command
      .add_option("--grip", grip,
                  "Poses of both pads and the gripper's opening (JSON, see capture/pair/README.md)")
      ->group(kPairGroup);
}

std::optional<std::array<RunSettings, 2>> PairChoice::fingers(const RunSettings& settings,
                                                              const CameraChoice& camera) const {
  std::array<std::string, 2> inputs = {left, right};
  for (const Side side : kSides) {
    const std::string seen = camera.finger(to_string(side));
    std::string& input = inputs[index(side)];
    if (!seen.empty() && !input.empty())
      throw Error(Failure::Usage, std::string("one input of the ") + to_string(side) + " finger", "two",
                  "either of them");
    if (!seen.empty()) input = seen;
  }
  if (inputs[0].empty() && inputs[1].empty()) {
    if (left_sensor.empty() && right_sensor.empty() && grip.empty()) return std::nullopt;
    throw Error(Failure::Usage, "two fingers for --grip, --left-sensor and --right-sensor", "one input",
                "--left INPUT --right INPUT");
  }
  const std::string both = "--left INPUT --right INPUT, or --camera left=NAME --camera right=NAME";
  for (const Side side : kSides)
    if (inputs[index(side)].empty())
      throw Error(Failure::Usage, "two fingers", std::string("none on the ") + to_string(side), both);
  if (!settings.input.empty())
    throw Error(Failure::Usage, "two fingers", "a third input, '" + settings.input + "'", both);
  std::array<RunSettings, 2> fingers = {settings, settings};
  for (size_t i = 0; i < 2; ++i) fingers[i].input = inputs[i];
  ++fingers[1].seed;  // two cameras do not share their noise
  if (!left_sensor.empty()) fingers[0].sensor = left_sensor;
  if (!right_sensor.empty()) fingers[1].sensor = right_sensor;
  return fingers;
}

PairRequest PairChoice::request(std::array<RunSettings, 2> fingers, const std::string& run) const {
  PairRequest request;
  request.fingers = std::move(fingers);
  request.grip = grip;
  request.on_device_lost = [run](const DeviceLost& lost) {
    spdlog::warn("{}; opened anew, {} goes on", lost.what(), run);
  };
  request.on_state = [](Side side, const std::string& state) {
    if (state.empty())
      spdlog::info("{}: frames come again", to_string(side));
    else
      spdlog::warn("{}: {}; the other finger goes on", to_string(side), state);
  };
  return request;
}

Facts facts_of(const PairOutcome& outcome) {
  const SkewStatistics& skew = outcome.run.skew;
  Facts facts;
  facts.add("pairs", skew.pairs(),
            text("%llu pairs, skew %.3f ms, spread %.3f ms\n", static_cast<unsigned long long>(skew.pairs()),
                 skew.mean_ms(), skew.sd_ms()));
  facts.add("skew_mean_ms", skew.mean_ms());
  facts.add("skew_sd_ms", skew.sd_ms());
  for (const Side side : kSides) {
    const size_t i = index(side);
    const LiveReport& report = outcome.run.fingers[i];
    json::Value value = {{"input", outcome.inputs[i]}, {"sensor", outcome.sensors[i]}};
    value.update(facts_of(report, outcome.sessions(side)).json);
    value["alone"] = outcome.run.alone[i];
    facts.add(to_string(side), value, finger_line(side, report, outcome.run.alone[i]));
  }
  for (const std::string& log : outcome.logs) facts.say("log " + log + "\n");
  if (!outcome.logs.empty()) facts.json["logs"] = outcome.logs;
  facts.add("rows", outcome.rows);
  for (const std::filesystem::path& folder : outcome.folders)
    facts.say("written: " + (folder / kPairRows).string() + ", left, right\n");
  return facts;
}

}  // namespace palpate
