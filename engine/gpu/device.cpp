#include "palpate/device.h"

#include "engine/gpu/device_access.h"

namespace palpate {

namespace {

gpu::ContextOptions options_for(const std::string& which) {
  gpu::ContextOptions options;
  options.device = which;
  return options;
}

}  // namespace

struct Device::Impl {
  explicit Impl(const std::string& which) : context(options_for(which)) {}

  gpu::Context context;
};

Device::Device() : Device(std::string()) {}
Device::Device(const std::string& which) : impl_(std::make_unique<Impl>(which)) {}
Device::~Device() = default;
Device::Device(Device&&) noexcept = default;
Device& Device::operator=(Device&&) noexcept = default;

const std::string& Device::name() const {
  return impl_->context.report().name;
}

bool Device::is_software() const {
  return impl_->context.is_software();
}

gpu::Context& DeviceAccess::context(Device& device) {
  return device.impl_->context;
}

}  // namespace palpate
