// Setup of a camera: from the requested settings to those that it takes: format, size, rate, controls.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "capture/camera/choose_format.h"
#include "capture/v4l2/device.h"

namespace palpate {

struct CameraSetup {
  const PixelFormat* format = nullptr;
  v4l2::Negotiated image;
  double rate_Hz = 0;                   ///< 0: the driver does not say
  uint32_t channels = 1;                ///< that frames are decoded to
  std::vector<v4l2::Control> controls;  ///< as they read once all was set
};

/// One control to set.
struct ControlStep {
  uint32_t id = 0;
  std::string name;
  int64_t value = 0;
};

/// Controls to set, in order: automatic modes first, then values, then the controls asked for by name. Every
/// automatic mode that V4L2 knows is switched off unless it is asked for. Throws Error(Failure::Device) where
/// the camera lacks a control that is asked for, or its range does not hold the value.
std::vector<ControlStep> plan_controls(const std::vector<v4l2::Control>& there, const CameraOptions& options);

/// Negotiates with the driver and reads back. Throws Error(Failure::Device) where what comes back differs
/// from what was asked: another format or size, a rate off by more than 1 %, a control off by more than its
/// step and 1 %.
CameraSetup set_up(v4l2::Device& device, const CameraOptions& options, const CameraNeeds& needs);

/// Exposure that the controls hold; 0 where they do not say, or the camera rules it.
double exposure_s(const std::vector<v4l2::Control>& controls);

/// Sets what reads otherwise than in `before`, once the camera is back from being unplugged. Returns the
/// names of those that could not be set.
std::string restore_controls(v4l2::Device& device, const std::vector<v4l2::Control>& before);

/// The node that `asked` means (see CameraOptions::node). Throws Error(Failure::Device) where there is no
/// camera at all.
std::string camera_node(const std::string& asked);

}  // namespace palpate
