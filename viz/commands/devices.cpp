// palpate devices: the Vulkan devices of this machine, and the reason for each refusal.

#include "capture/files/output_file.h"
#include "engine/base/json.h"
#include "engine/gpu/context.h"
#include "palpate/error.h"
#include "viz/commands/command.h"
#include "viz/commands/support/options.h"

namespace palpate {
namespace {

std::string mebibytes(uint64_t bytes) {
  return std::to_string(bytes >> 20) + " MiB";
}

Report list(const Common& common) {
  std::vector<gpu::DeviceReport> devices;
  std::string none = "no Vulkan device; install a driver (Debian: mesa-vulkan-drivers runs on any processor)";
  try {
    devices = gpu::list_devices();
  } catch (const Error& error) {  // without any driver Vulkan does not even start
    none = error.what();
  }
  json::Value list = json::Value::array();
  std::string text;
  bool usable = false;
  for (const gpu::DeviceReport& device : devices) {
    const bool ok = device.refusals.empty();
    usable = usable || ok;
    list.push_back({{"index", device.index},
                    {"name", device.name},
                    {"type", device.type},
                    {"driver", device.driver},
                    {"api_version", device.api_version},
                    {"memory_bytes", device.memory_bytes},
                    {"subgroup_size", device.subgroup_size},
                    {"usable", ok},
                    {"refusals", device.refusals}});
    text += std::to_string(device.index) + "  " + (ok ? "usable   " : "refused  ") + device.name + "\n";
    text += "            " + device.type + ", driver " + device.driver + ", Vulkan " + device.api_version +
            ", " + mebibytes(device.memory_bytes) + ", subgroups of " + std::to_string(device.subgroup_size) +
            "\n";
    for (const std::string& refusal : device.refusals) text += "            refused: " + refusal + "\n";
  }
  json::Value value = {{"devices", list}, {"usable", usable}};
  if (devices.empty()) {
    text = none;
    value["reason"] = none;
  }
  Report report{text, value, usable ? 0 : static_cast<int>(Failure::Device)};
  if (!common.out.empty()) {
    make_output_folder(common.out);
    write_whole(common.out / "devices.json", report.json.dump(2, json::Utf8::Replace) + "\n");
  }
  return report;
}

}  // namespace

void add_devices(CommandLine& program, Common& common, Command& chosen) {
  CommandLine* command =
      program.add_subcommand("devices", "List Vulkan devices, and why any of them cannot be used");
  command->add_option("--out", common.out, "Folder for devices.json");
  add_common(*command, common,
             "  palpate devices                     what is there\n"
             "  palpate devices --json              for a script: .devices[].usable\n");
  command->runs(chosen, [&common] { return list(common); });
}

}  // namespace palpate
