// One open camera node of Linux (V4L2, single-planar capture): what it can do, and setting it up.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "capture/camera/choose_format.h"

namespace palpate::v4l2 {

/// ioctl that starts again when a signal interrupts it. 0, or errno.
int call(int file, unsigned long request, void* argument);

/// Identity of a camera. The node's number changes when it is plugged in again; the rest does not.
struct Identity {
  std::string path;    ///< /dev/videoN
  std::string driver;  ///< kernel module
  std::string card;    ///< the camera's name
  std::string bus;     ///< where it is plugged in
  int index = 0;       ///< which of the nodes of this camera

  bool same_camera(const Identity& other) const {
    return card == other.card && bus == other.bus && index == other.index;
  }
};

/// A range of frame sizes, px; a single one where least and most are equal.
struct SizeRange {
  uint32_t least_width = 0, most_width = 0, step_width = 1;
  uint32_t least_height = 0, most_height = 0, step_height = 1;

  bool single() const { return least_width == most_width && least_height == most_height; }
  bool holds(uint32_t width, uint32_t height) const;
};

/// A range of frame rates; a single one where least and most are equal.
struct RateRange {
  double least_Hz = 0, most_Hz = 0;
};

enum class ControlType { Integer, Boolean, Menu, Button, Other };

/// A knob of the camera.
struct Control {
  uint32_t id = 0;
  std::string name;  ///< as the person types it: lower case, words joined by _
  ControlType type = ControlType::Other;
  int64_t least = 0, most = 0, step = 1, initial = 0;
  std::optional<int64_t> value;                        ///< where it can be read
  std::vector<std::pair<int64_t, std::string>> items;  ///< of a menu
  bool read_only = false;
  bool write_only = false;
  bool inactive = false;  ///< has no effect now, since another control (an auto mode) rules it
  bool grabbed = false;   ///< cannot be changed while frames come
};

/// Unit of a control's value where V4L2 defines one ("100 us", "K"), else empty.
std::string unit_of(uint32_t control_id);
/// "Exposure Time, Absolute" -> "exposure_time_absolute".
std::string control_name(const std::string& driver_name);

/// Settings that the driver chose; they may differ from the request.
struct Negotiated {
  uint32_t fourcc = 0;
  uint32_t width = 0;
  uint32_t height = 0;
  uint32_t stride_bytes = 0;
  uint32_t image_bytes = 0;
};

class Device {
 public:
  /// Throws Error(Failure::Device), one line for each of: no such device node (names what there is), no
  /// permission (names the group), busy, unplugged, no camera, a camera of an interface that is not spoken
  /// here.
  explicit Device(const std::string& path);
  ~Device();
  Device(const Device&) = delete;
  Device& operator=(const Device&) = delete;

  int file() const { return file_; }
  const Identity& identity() const { return identity_; }

  std::vector<OfferedFormat> formats() const;
  /// Empty where the driver does not say.
  std::vector<SizeRange> sizes(uint32_t fourcc) const;
  std::vector<RateRange> rates(uint32_t fourcc, uint32_t width, uint32_t height) const;
  Negotiated format() const;
  /// Throws Error(Failure::Device) where the driver refuses (busy: names the process).
  Negotiated set_format(uint32_t fourcc, uint32_t width, uint32_t height);
  /// Frames a second; 0 where the driver has no say in it.
  double rate_Hz() const;
  /// Sets the rate; returns the rate that results, 0 where it cannot be set.
  double set_rate(double rate_Hz);

  std::vector<Control> controls() const;
  std::optional<int64_t> get(uint32_t control_id) const;
  /// 0, or errno.
  int set(uint32_t control_id, int64_t value);

 private:
  int file_ = -1;
  Identity identity_;
};

/// One node of /dev/video*, whether or not it can be used.
struct NodeReport {
  std::string path;
  Identity identity;     ///< filled as far as the node could be asked
  bool capture = false;  ///< delivers frames (metadata and output nodes do not)
  std::string trouble;   ///< why it cannot be asked; empty: it can
};

/// Every node, in the order of their numbers.
std::vector<NodeReport> list_nodes();

/// Processes other than this one that hold the node open, "name (pid)" joined by commas; empty where none can
/// be seen.
std::string holders_of(const std::string& path);

}  // namespace palpate::v4l2
