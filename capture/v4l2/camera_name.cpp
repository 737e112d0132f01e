#include "capture/v4l2/camera_name.h"

#include <algorithm>
#include <fstream>
#include <tuple>

#include "palpate/error.h"

namespace fs = std::filesystem;

namespace palpate::v4l2 {
namespace {

std::string first_line(const fs::path& file) {
  std::ifstream in(file);
  std::string line;
  std::getline(in, line);
  return line;
}

/// The USB device that a node belongs to; empty: it is on no USB.
fs::path usb_device(fs::path at) {
  for (; at.has_relative_path(); at = at.parent_path())
    if (fs::exists(at / "busnum") && fs::exists(at / "devpath")) return at;
  return {};
}

}  // namespace

std::vector<NamedCamera> named_cameras(const fs::path& sys) {
  std::vector<NamedCamera> cameras;
  std::error_code none;
  for (const auto& entry : fs::directory_iterator(sys / "class/video4linux", none)) {
    const std::string node = entry.path().filename().string();
    if (!node.starts_with("video") || first_line(entry.path() / "index") != "0") continue;
    const fs::path device = fs::canonical(entry.path() / "device", none);
    const fs::path usb = usb_device(device);
    cameras.push_back({.path = "/dev/" + node,
                       .card = first_line(entry.path() / "name"),
                       .port = (usb.empty() ? device : usb).filename().string(),
                       .serial = usb.empty() ? "" : first_line(usb / "serial")});
  }
  std::ranges::sort(cameras, {},
                    [](const NamedCamera& camera) { return std::tie(camera.port, camera.path); });
  return cameras;
}

/// Its port; of several on one device their cards tell them apart.
static const std::string& name_of(const NamedCamera& camera, const std::vector<NamedCamera>& cameras) {
  return std::ranges::count(cameras, camera.port, &NamedCamera::port) > 1 ? camera.card : camera.port;
}

std::string find_camera(const std::string& name, const std::vector<NamedCamera>& cameras) {
  std::vector<std::string> found;
  std::string names;
  for (const NamedCamera& camera : cameras) {
    const std::string& own = name_of(camera, cameras);
    if (name == own || name == camera.port || (name == camera.serial && !name.empty()))
      found.push_back(camera.path);
    names += (names.empty() ? "" : ", ") + own;
    if (!camera.serial.empty()) names += " or " + camera.serial;
    if (own != camera.card) names += " (" + camera.card + ")";
  }
  if (found.size() == 1) return found.front();
  const bool number =
      name.starts_with("/dev/video") || name.find_first_not_of("0123456789") == std::string::npos;
  throw Error(Failure::Device, "a camera by its port or serial number",
              "'" + name + "'" +
                  (found.size() > 1 ? ", which several have"
                   : number         ? ", a number that another camera may get at the next start"
                                    : ""),
              names.empty() ? "plugging it in: no camera is there" : names);
}

}  // namespace palpate::v4l2
