// The engine's own way into a public Device.
#pragma once

#include "engine/gpu/context.h"
#include "palpate/device.h"

namespace palpate {

struct DeviceAccess {
  static gpu::Context& context(Device& device);
};

}  // namespace palpate
