#include "viz/commands/option_groups/camera_options.h"

#include <utility>

#include "capture/camera/camera_options.h"
#include "capture/v4l2/camera_name.h"
#include "palpate/error.h"
#include "viz/commands/support/options.h"

namespace palpate {
namespace {

constexpr const char* kCameraGroup = "Camera";

bool side_of(const std::string& node) {
  return node.starts_with("left=") || node.starts_with("right=");
}

}  // namespace

void CameraChoice::add_to(CommandLine& command) {
  command_ = &command;
  const auto add = [&](const char* name, std::string& value, const char* about) {
    command.add_option(name, value, about)->group(kCameraGroup);
  };
  command
      .add_option("--camera", nodes,
                  "Take frames from this camera: /dev/videoN, N or genicam:ID (see palpate cameras); two "
                  "fingers: left=NAME and right=NAME, port or serial number")
      ->expected(1)
      ->take_all()
      ->group(kCameraGroup);
  add("--format", format,
      "Pixel format: GREY, Y10, Y12, Y16, YUYV, UYVY, NV12, RGB8, RGGB8 and its kin, MJPEG, "
      "packed ones as Mono12p "
      "(default: fits the sensor)");
  add("--size", size, "Size in px, as 1392x1042 (default: the sensor's, or the largest that comes smoothly)");
  add("--fps", rate, "Frames a second, as 7.5 or 30000/1001 (default: the most the camera has, up to 60)");
  add("--exposure", exposure, "Exposure, as 8ms or 500us, or auto (default: locked where it is)");
  add("--gain", gain, "Gain in the camera's own steps, or auto (default: locked where it is)");
  add("--white-balance", white_balance, "White balance in K, or auto (default: locked where it is)");
  command.add_option("--control", controls, "Any other control: NAME=VALUE (repeatable)")
      ->group(kCameraGroup);
  add("--trigger", trigger,
      "Source that starts each frame of a GenICam camera: Line0, Software ... (default: its rate)");
  add("--camera-timeout", timeout, "Restart the stream after this long without a frame, e.g. 3s");
  add("--camera-buffers", buffers, "Frames that the driver keeps, 3 to 32 (default 8)");
}

std::string CameraChoice::composed(const std::string& node) const {
  const std::pair<const char*, const std::string*> options[] = {
      {"format", &format},     {"size", &size},       {"fps", &rate},
      {"exposure", &exposure}, {"gain", &gain},       {"white_balance", &white_balance},
      {"trigger", &trigger},   {"timeout", &timeout}, {"buffers", &buffers}};
  std::string composed = "camera:" + node;
  char mark = '?';
  const auto add = [&](const std::string& key, const std::string& value) {
    composed += mark + key + "=" + value;
    mark = '&';
  };
  for (const auto& [key, value] : options)
    if (!value->empty()) add(key, *value);
  for (const std::string& control : controls)
    add("control." + control.substr(0, control.find('=')),
        control.find('=') == std::string::npos ? "" : control.substr(control.find('=') + 1));
  if (node.empty() && mark == '?') return {};
  if (node.empty())
    throw Error(Failure::Usage, "--camera NODE for the options of a camera", "none", "--camera /dev/video0");
  return to_string(parse_camera(composed));
}

std::string CameraChoice::input(const std::string& input) const {
  if (nodes.size() > 1 || (!nodes.empty() && side_of(nodes.front())))
    throw Error(Failure::Usage, "one camera", std::to_string(nodes.size()) + " with --camera",
                "--camera left=NAME --camera right=NAME with palpate record or serve, for two fingers");
  const std::string node = nodes.empty() ? "" : nodes.front();
  std::string camera = composed(node);
  if (camera.empty()) return input;
  const CommandOption* positional = command_ ? command_->get_option("INPUT") : nullptr;
  if (positional && positional->count() > 0)
    throw Error(Failure::Usage, "one input", "--camera " + node + " and '" + input + "'", "either of them");
  return camera;
}

std::string CameraChoice::finger(const std::string& side) const {
  std::string name;
  bool sides = false;
  for (const std::string& node : nodes) {
    sides = sides || side_of(node);
    if (!node.starts_with(side + "=")) continue;
    if (!name.empty()) throw Error(Failure::Usage, "one --camera " + side + "=NAME", "two", "either of them");
    name = node.substr(side.size() + 1);
  }
  for (const std::string& node : nodes)
    if (sides && !side_of(node))
      throw Error(Failure::Usage, "--camera left=NAME and --camera right=NAME", "--camera " + node,
                  "a side for each");
  if (name.empty()) return {};
  return composed(name.starts_with("genicam:") ? name : v4l2::find_camera(name, v4l2::named_cameras()));
}

}  // namespace palpate
