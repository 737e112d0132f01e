// Cameras of Linux by what stays theirs: the port they are plugged into, or their serial number. A node's
// number goes to whichever camera is found first.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace palpate::v4l2 {

struct NamedCamera {
  std::string path;    ///< /dev/videoN
  std::string card;    ///< the camera's name
  std::string port;    ///< where it is plugged in: "1-2.3" on USB, else its device's name
  std::string serial;  ///< empty: it has none
};

/// The first node of each camera, by their ports. `sys`: of another tree, for tests.
std::vector<NamedCamera> named_cameras(const std::filesystem::path& sys = "/sys");

/// The node of the camera with this port or serial number; of several on one device, which a bus without
/// ports may have, with this card. Throws Error(Failure::Device) with the names there
/// are; also for a node's number, which is none.
std::string find_camera(const std::string& name, const std::vector<NamedCamera>& cameras);

}  // namespace palpate::v4l2
