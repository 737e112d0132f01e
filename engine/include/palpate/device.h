// The Vulkan device that pipelines run on.
#pragma once

#include <memory>
#include <string>

#include "palpate/error.h"
#include "palpate/export.h"

namespace palpate {

/// The device is gone: its driver says so, or it did not finish in time what it was given. Nothing on it can
/// be used any more; a device that is opened anew may work.
class PALPATE_API DeviceLost : public Error {
 public:
  DeviceLost(const std::string& wanted, const std::string& found, const std::string& remedy)
      : Error(Failure::Device, wanted, found, remedy) {}
};

/// Opened once and shared by any number of pipelines, which it must outlive. Pipelines may use it from
/// several threads.
class PALPATE_API Device {
 public:
  /// The best one: discrete before integrated before the processor's own driver. Throws
  /// Error(Failure::Device) that lists every device of the machine and why it was refused.
  Device();
  /// `which`: its index as `palpate devices` lists it, or part of its name; empty: the best one.
  explicit Device(const std::string& which);
  ~Device();
  Device(Device&&) noexcept;
  Device& operator=(Device&&) noexcept;

  const std::string& name() const;
  /// The processor itself computes: device memory is host memory.
  bool is_software() const;

 private:
  friend struct DeviceAccess;
  struct PALPATE_HIDDEN Impl;
  PALPATE_HIDDEN explicit Device(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace palpate
