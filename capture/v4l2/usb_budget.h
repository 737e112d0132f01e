// What a USB bus can carry, summed over the cameras that this program streams from, before one more is
// started.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace palpate::v4l2 {

/// Where a camera hangs.
struct UsbPlace {
  std::string bus;        ///< number of the bus
  double speed_Mbit = 0;  ///< of the camera's connection, megabits a second
};
/// Of a node such as /dev/video0; none: it is on no USB, or the kernel does not say. `sys`: of another tree,
/// for tests.
std::optional<UsbPlace> usb_place(const std::string& node, const std::filesystem::path& sys = "/sys");

/// Bytes a second that isochronous transfers may take of a bus: at 480 Mbit/s six packets of 1024 bytes in
/// each of 8000 microframes (80 %, as USB 2.0 allows), at 12 Mbit/s one of 1023 in each of 1000 frames;
/// above, 80 % of what the line's coding leaves.
double usb_capacity(double speed_Mbit);

/// A format, size and rate that a camera offers.
struct UsbMode {
  std::string words;  ///< "--format GREY --size 640x480 --fps 30"
  double bytes_per_s = 0;
};

/// A camera's share of a bus, given back with the object.
class UsbShare {
 public:
  /// Takes what `wanted` needs of the bus. `offers`: asked for other modes of the camera where that is more
  /// than what the cameras before leave. Throws Error(Failure::Device) with the largest of them that fits.
  UsbShare(const UsbPlace& place, const std::string& camera, const UsbMode& wanted,
           const std::function<std::vector<UsbMode>()>& offers);
  ~UsbShare();
  UsbShare(const UsbShare&) = delete;
  UsbShare& operator=(const UsbShare&) = delete;

 private:
  uint64_t id_;
};

}  // namespace palpate::v4l2
