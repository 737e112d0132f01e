// palpate cameras: the cameras of this machine, their formats and their controls.
#include <cmath>

#include "capture/camera/frame_rate.h"
#include "capture/files/output_file.h"
#include "capture/genicam/camera.h"
#include "capture/genicam/module.h"
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
  return palpate::text("%.4g", value);
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
    words += (words.empty() ? "" : ", ") + rate_text(rate.least_Hz) +
             (rate.least_Hz == rate.most_Hz ? "" : " to " + rate_text(rate.most_Hz));
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
  for (const OfferedFormat& format : device.formats()) {
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

std::string range_text(const std::optional<genicam::Range>& range, const char* unit) {
  if (!range) return "cannot be set";
  return number(range->least) + " to " + number(range->most) + unit;
}

Json range_json(const std::optional<genicam::Range>& range) {
  return range ? Json{range->least, range->most} : Json(nullptr);
}

void list_genicam(const std::string& id, Report& all) {
  const std::unique_ptr<genicam::Device> device = genicam::module().open(id);
  const genicam::Identity& is = device->identity();
  const genicam::Abilities can = device->abilities();
  std::string readable, unknown, triggers;
  Json formats = Json::array();
  for (const std::string& name : can.formats) {
    const PixelFormat* known = find_pixel_format(name);
    std::string& list = known ? readable : unknown;
    list += (list.empty() ? "" : ", ") + (known ? std::string(known->name) + " (" + name + ")" : name);
    formats.push_back({{"format", known ? Json(known->name) : Json(nullptr)},
                       {"genicam", name},
                       {"readable", known != nullptr}});
  }
  for (const std::string& name : can.triggers) triggers += (triggers.empty() ? "" : ", ") + name;
  const auto side = [](const genicam::WholeRange& r) {
    return palpate::text("%lld to %lld px in steps of %lld", static_cast<long long>(r.least),
                         static_cast<long long>(r.most), static_cast<long long>(r.step));
  };
  all.text += "genicam:" + is.id + "  " + is.vendor + " " + is.model + " (" + is.protocol +
              ", serial number " + is.serial + (is.address.empty() ? "" : ", at " + is.address) + ")\n";
  all.text += "  formats " + (readable.empty() ? "none that can be read" : readable) + "\n";
  if (!unknown.empty()) all.text += "  cannot be read: " + unknown + "\n";
  all.text += "  width " + side(can.width_px) + ", height " + side(can.height_px) + "\n";
  all.text += "  rate " + range_text(can.rate_Hz, " frames/s") + "\n";
  all.text +=
      "  exposure " + range_text(can.exposure_us, " us") + (can.exposure_auto ? ", or auto" : "") + "\n";
  all.text += "  gain " + range_text(can.gain_dB, " dB") + (can.gain_auto ? ", or auto" : "") + "\n";
  all.text += "  triggers " + (triggers.empty() ? "none" : triggers) + "\n";
  const auto side_json = [](const genicam::WholeRange& r) { return Json{r.least, r.most, r.step}; };
  all.json["cameras"].push_back({{"node", "genicam:" + is.id},
                                 {"name", is.vendor + " " + is.model},
                                 {"driver", is.protocol},
                                 {"serial", is.serial},
                                 {"bus", is.address},
                                 {"formats", formats},
                                 {"width_px", side_json(can.width_px)},
                                 {"height_px", side_json(can.height_px)},
                                 {"rate_Hz", range_json(can.rate_Hz)},
                                 {"exposure_us", range_json(can.exposure_us)},
                                 {"gain_dB", range_json(can.gain_dB)},
                                 {"triggers", can.triggers}});
}

void list_v4l2(const std::string& path, Report& all) {
  const v4l2::Device device(path);
  const v4l2::Identity& id = device.identity();
  Facts one{path + "  " + id.card + " (driver " + id.driver + ", at " + id.bus + ")\n",
            {{"node", path}, {"name", id.card}, {"driver", id.driver}, {"bus", id.bus}}};
  list_formats(device, one);
  list_controls(device, one);
  all.json["cameras"].push_back(one.json);
  all.text += one.text;
}

Report list(const Common& common, const std::string& asked) {
  Report all("", {{"cameras", Json::array()}, {"other_nodes", Json::array()}});
  std::vector<std::string> paths;
  CameraOptions one;
  one.node = asked;
  if (is_genicam(one))
    list_genicam(asked.substr(asked.find(':') + 1), all);
  else if (!asked.empty())
    paths.push_back(camera_node(asked));
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
  for (const std::string& path : paths) list_v4l2(path, all);
  const genicam::Module* module = asked.empty() ? genicam::module_if_there() : nullptr;
  if (module)
    for (const genicam::Identity& camera : module->list(false)) list_genicam(camera.id, all);
  if (asked.empty() && !module)
    all.text +=
        "cameras of USB3 Vision and GigE Vision are not looked for: the module palpate_genicam is missing\n";
  if (all.json["cameras"].empty()) {
    all.text += std::string("no camera: nothing under /dev/video* delivers frames to this user") +
                (module ? ", no GenICam camera answers" : "") + "; plug one in, or see dmesg\n";
    all.exit_code = static_cast<int>(Failure::Device);
  }
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
  command->add_option("NODE", *node, "One of them, /dev/videoN, N or genicam:ID (default: all)");
  command->add_option("--out", common.out, "Folder for cameras.json");
  add_common(*command, common,
             "  palpate cameras                     every camera of this machine\n"
             "  palpate cameras /dev/video0         one of them\n"
             "  palpate cameras genicam:Fake_1      the simulated camera of Aravis\n"
             "  palpate cameras --json              for a script: .cameras[].formats[].sizes[]\n");
  command->runs(chosen, [&common, node] { return list(common, *node); });
}

}  // namespace palpate
