// Interface of the module for GenICam cameras (USB3 Vision, GigE Vision): everything that needs Aravis goes
// through these functions.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "capture/camera/camera_options.h"

namespace palpate::genicam {

/// A camera that answers on a bus or a network.
struct Identity {
  std::string id;  ///< as it is opened: vendor, model and serial number joined by "-"
  std::string vendor;
  std::string model;
  std::string serial;
  std::string address;   ///< of GigE cameras their IP address
  std::string protocol;  ///< "USB3Vision", "GigEVision" or "Fake"
};

/// A range of whole numbers in steps.
struct WholeRange {
  int64_t least = 0, most = 0, step = 1;
  bool holds(int64_t value) const { return value >= least && value <= most && (value - least) % step == 0; }
};
struct Range {
  double least = 0, most = 0;
};

/// What a camera can do, and how it stands.
struct Abilities {
  std::vector<std::string> formats;  ///< by GenICam's Pixel Format Naming Convention
  WholeRange width_px, height_px;    ///< of the part of the chip that is read
  std::optional<Range> rate_Hz;      ///< nothing: it has no rate that can be set
  std::optional<Range> exposure_us;
  std::optional<Range> gain_dB;  ///< some cameras call their own steps so
  bool exposure_auto = false, gain_auto = false, white_balance_auto = false;
  std::vector<std::string> triggers;  ///< sources that can start a frame: "Line0", "Software"
};

/// What is wanted of the stream. Names and sizes that the camera has.
struct Request {
  std::string format;  ///< GenICam's name
  uint32_t width = 0, height = 0;
  double rate_Hz = 0;  ///< 0: as it stands
  CameraOptions options;
};

/// How the camera stands once all is set, as it reads back.
struct Settings {
  std::string format;
  uint32_t width = 0, height = 0;
  double rate_Hz = 0;     ///< 0: it does not say
  double exposure_s = 0;  ///< 0: it does not say, or rules it by itself
  /// Exposure and others, with units, for people and records.
  std::vector<std::pair<std::string, std::string>> facts;
};

/// A buffer that the camera filled: ours until `pixels` is gone.
struct Filled {
  std::shared_ptr<const uint8_t> pixels;  ///< null: damaged
  size_t bytes = 0;
  uint32_t width = 0, height = 0;
  uint32_t stride_bytes = 0;
  uint64_t number = 0;   ///< by the camera; 16 bits of older GigE cameras go on as 64
  int64_t stamp_ns = 0;  ///< on the camera's own clock; 0: it has none
  std::string damage;    ///< what is wrong with it, in a few words
};

enum class Event {
  Nothing,  ///< the time is over
  Ready,    ///< a buffer was filled, whole or damaged
  Gone,     ///< the camera does not answer any more
};

/// One open camera. One thread.
class Device {
 public:
  virtual ~Device() = default;
  virtual const Identity& identity() const = 0;
  virtual Abilities abilities() const = 0;
  /// Sets all, checks what reads back, and starts. Throws Error(Failure::Device) that names what the camera
  /// refuses or keeps otherwise.
  virtual Settings start(const Request& request) = 0;
  virtual Event wait(int timeout_ms, Filled& filled) = 0;
  /// Buffers that the camera can fill now.
  virtual uint32_t with_camera() const = 0;
  /// Stops the stream and starts it again; false where the camera refuses.
  virtual bool restart() = 0;
  /// Packets that were lost on the way and asked for again, since the start; nothing: no packets.
  virtual std::optional<uint64_t> resent_packets() const = 0;
};

struct Module {
  /// Every camera that answers within a second. `with_fake`: Aravis's own simulated camera, too.
  std::vector<Identity> (*list)(bool with_fake);
  /// Throws Error(Failure::Device) where it is missing, held by another program, or does not speak GenICam.
  std::unique_ptr<Device> (*open)(const std::string& id);
};

/// Loads the module at its first call. Throws Error(Failure::Device) where it is missing.
const Module& module();
/// The same; null where it is missing.
const Module* module_if_there();

}  // namespace palpate::genicam
