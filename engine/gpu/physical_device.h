// The machine's Vulkan devices before one is opened: what each is and what it lacks.
#pragma once

#include <optional>
#include <vector>

#include "engine/gpu/context.h"

namespace palpate::gpu {

/// With the validation layer and its `messenger` where the options ask for it. Throws Error(Failure::Device).
VkInstance make_instance(const ContextOptions& options, const VkDebugUtilsMessengerCreateInfoEXT* messenger);

std::vector<VkPhysicalDevice> enumerate_devices(VkInstance instance);

/// Everything the kernels rely on; a missing piece becomes a reason for refusal.
DeviceReport inspect(VkPhysicalDevice device, uint32_t index, bool presentation);

/// A faster kind of device scores higher; memory decides among equals.
int type_score(VkPhysicalDeviceType type);

/// The first queue family for both graphics and compute.
std::optional<uint32_t> find_queue_family(VkPhysicalDevice device);

/// Whether buffers of the kernels' kinds can lie in memory that the host has mapped elsewhere.
bool can_import_host_memory(VkPhysicalDevice device);

}  // namespace palpate::gpu
