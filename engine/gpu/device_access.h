// The engine's own way into a public Device.
#pragma once

#include <memory>

#include "palpate/device.h"

namespace palpate {
namespace gpu {
class Context;
}

struct DeviceAccess {
  static gpu::Context& context(Device& device);
  /// The context as a Device, which does not own it.
  static std::unique_ptr<Device> handle(gpu::Context& context);
};

}  // namespace palpate
