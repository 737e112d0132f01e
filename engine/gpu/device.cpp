#include "palpate/device.h"

#include "engine/gpu/context.h"
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
  explicit Impl(const std::string& which)
      : own(std::make_unique<gpu::Context>(options_for(which))), context(*own) {}
  explicit Impl(gpu::Context& other) : context(other) {}

  std::unique_ptr<gpu::Context> own;  ///< empty: of a context that lives elsewhere
  gpu::Context& context;
};

Device::Device() : Device(std::string()) {}
Device::Device(const std::string& which) : impl_(std::make_unique<Impl>(which)) {}
Device::Device(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
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

std::unique_ptr<Device> DeviceAccess::handle(gpu::Context& context) {
  return std::unique_ptr<Device>(new Device(std::make_unique<Device::Impl>(context)));
}

}  // namespace palpate
