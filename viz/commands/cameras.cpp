// palpate cameras: the cameras of this machine, their formats and their controls.
#include <cmath>

#include "capture/files/output_file.h"
#include "capture/v4l2/camera_setup.h"
#include "capture/v4l2/device.h"
#include "engine/base/json.h"
#include "engine/base/text.h"
#include "palpate/error.h"
#include "viz/commands/command.h"
#include "viz/commands/support/options.h"

namespace palpate {
namespace {

using Json = json::Value;

std::string number(double value) {
  const std::string line = palpate::text("%.4g", value);
  return line;
}

const char* name_of(v4l2::ControlType type) {
  switch (type) {
    case v4l2::ControlType::Integer:
      return "integer";
    case v4l2::ControlType::Boolean:
      return "switch";
    case v4l2::ControlType::Menu:
      return "menu";
    case v4l2::ControlType::Button:
      return "button";
    default:
      return "other";
  }
}

void list_size(const v4l2::Device& device, uint32_t fourcc, const v4l2::SizeRange& size, Facts& to) {
  Json rates = Json::array();
  std::string words;
  for (const v4l2::RateRange& rate : device.rates(fourcc, size.most_width, size.most_height)) {
    rates.push_back({rate.least_Hz, rate.most_Hz});
    words += (words.empty() ? "" : ", ") + number(rate.least_Hz) +
             (rate.least_Hz == rate.most_Hz ? "" : " to " + number(rate.most_Hz));
  }
  std::string text = std::to_string(size.least_width) + "x" + std::to_string(size.least_height);
  Json json = {{"width_px", size.least_width}, {"height_px", size.least_height}};
  if (!size.single()) {
    text += " to " + std::to_string(size.most_width) + "x" + std::to_string(size.most_height) +
            ", steps of " + std::to_string(size.step_width) + "x" + std::to_string(size.step_height);
    json["most_width_px"] = size.most_width;
    json["most_height_px"] = size.most_height;
    json["step_width_px"] = size.step_width;
    json["step_height_px"] = size.step_height;
  }
  json["rates_Hz"] = rates;
  to.json.push_back(json);
  to.text += "    " + text + (words.empty() ? "" : "  at " + words + " frames/s") + "\n";
}

void list_formats(const v4l2::Device& device, Facts& to) {
  to.json["formats"] = Json::array();
  std::string unknown;
  for (const v4l2::FormatInfo& format : device.formats()) {
    const std::string code = fourcc_text(format.fourcc);
    if (!format.known) {
      unknown += (unknown.empty() ? "" : ", ") + code;
      to.json["formats"].push_back(
          {{"fourcc", code}, {"description", format.description}, {"readable", false}});
      continue;
    }
    to.text += std::string("  ") + format.known->name + "  " + format.description + ", " +
               std::to_string(format.known->bit_depth) + " bits, " +
               (format.known->channels == 3 ? "colour" : "gray") + (format.emulated ? ", emulated" : "") +
               "\n";
    Facts sizes{"", Json::array()};
    for (const v4l2::SizeRange& size : device.sizes(format.fourcc))
      list_size(device, format.fourcc, size, sizes);
    to.text += sizes.text;
    to.json["formats"].push_back({{"format", format.known->name},
                                  {"fourcc", code},
                                  {"description", format.description},
                                  {"readable", true},
                                  {"bit_depth", format.known->bit_depth},
                                  {"channels", format.known->channels},
                                  {"emulated", format.emulated},
                                  {"sizes", sizes.json}});
  }
  if (!unknown.empty()) to.text += "  cannot be read: " + unknown + "\n";
}

void list_controls(const v4l2::Device& device, Facts& to) {
  to.json["controls"] = Json::array();
  for (const v4l2::Control& c : device.controls()) {
    const std::string unit = v4l2::unit_of(c.id);
    Json json = {{"name", c.name}, {"type", name_of(c.type)}, {"least", c.least},
                 {"most", c.most}, {"step", c.step},          {"initial", c.initial},
                 {"unit", unit},   {"inactive", c.inactive},  {"read_only", c.read_only}};
    json["value"] = c.value ? Json(*c.value) : Json(nullptr);
    std::string text = "  " + c.name + "  ";
    if (c.type == v4l2::ControlType::Menu) {
      json["items"] = Json::array();
      for (const auto& [value, name] : c.items) {
        json["items"].push_back({{"value", value}, {"name", name}});
        text += std::to_string(value) + " " + name + ", ";
      }
    } else if (c.type == v4l2::ControlType::Button || c.type == v4l2::ControlType::Other) {
      text += std::string(name_of(c.type)) + ", ";
    } else {
      text += std::to_string(c.least) + " to " + std::to_string(c.most) +
              (c.step == 1 ? "" : " in steps of " + std::to_string(c.step)) + ", ";
    }
    if (!unit.empty()) text += "x " + unit + ", ";
    text += c.value ? "is " + std::to_string(*c.value) : std::string("cannot be read");
    if (c.inactive) text += " (an automatic mode rules it)";
    if (c.read_only) text += " (cannot be set)";
    to.json["controls"].push_back(json);
    to.text += text + "\n";
  }
}

Report list(const Common& common, const std::string& asked) {
  Report all("", {{"cameras", Json::array()}, {"other_nodes", Json::array()}});
  std::vector<std::string> paths;
  if (!asked.empty()) paths.push_back(camera_node(asked));
  for (const v4l2::NodeReport& node : v4l2::list_nodes()) {
    if (!asked.empty()) break;
    if (node.capture) {
      paths.push_back(node.path);
      continue;
    }
    const std::string why = node.trouble.empty() ? "delivers no frames" : node.trouble;
    all.json["other_nodes"].push_back({{"node", node.path}, {"reason", why}});
    all.text += node.path + "  " + why + "\n";
  }
  for (const std::string& path : paths) {
    const v4l2::Device device(path);
    const v4l2::Identity& id = device.identity();
    Facts one{path + "  " + id.card + " (driver " + id.driver + ", at " + id.bus + ")\n",
              {{"node", path}, {"name", id.card}, {"driver", id.driver}, {"bus", id.bus}}};
    list_formats(device, one);
    list_controls(device, one);
    all.json["cameras"].push_back(one.json);
    all.text += one.text;
  }
  if (paths.empty())
    all.text +=
        "no camera: nothing under /dev/video* delivers frames to this user; plug one in, or see dmesg\n";
  if (paths.empty()) all.exit_code = static_cast<int>(Failure::Device);
  if (!common.out.empty()) {
    make_output_folder(common.out);
    write_whole(common.out / "cameras.json", all.json.dump(2, json::Utf8::Replace) + "\n");
  }
  return all;
}

}  // namespace

void add_cameras(CommandLine& program, Common& common, Command& chosen) {
  CommandLine* command = program.add_subcommand(
      "cameras", "List cameras: formats, sizes, rates, and controls with their ranges");
  auto node = std::make_shared<std::string>();
  command->add_option("NODE", *node, "One of them, /dev/videoN or N (default: all)");
  command->add_option("--out", common.out, "Folder for cameras.json");
  add_common(*command, common,
             "  palpate cameras                     every camera of this machine\n"
             "  palpate cameras /dev/video0         one of them\n"
             "  palpate cameras --json              for a script: .cameras[].formats[].sizes[]\n");
  command->callback([&common, &chosen, node] { chosen = [&common, node] { return list(common, *node); }; });
}

}  // namespace palpate
