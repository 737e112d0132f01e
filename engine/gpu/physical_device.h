// The machine's Vulkan devices before one is opened: what each is and what it lacks.
#pragma once

#include <vulkan/vulkan.h>

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace palpate::gpu {

struct Shader;
struct KernelInterface;

/// One dispatch of a kernel: how many workgroups, and the bytes of the buffers that it is given, as
/// ScopeTraffic counts them.
struct Dispatch {
  const char* kernel;
  const KernelInterface& interface;
  uint64_t groups;  ///< 0: another kernel finds out
  uint64_t read_bytes, written_bytes;
};

struct ContextOptions {
  std::string device;       ///< index (one or two digits) or part of a name; empty: the best one
  bool validation = false;  ///< validation layer with synchronisation validation; messages are collected
  bool timers = false;      ///< GPU timestamps around every scope
  /// Every scope is submitted by itself and timed by the host's clock, where GPU timestamps cannot be
  /// trusted. Slow: a submission waits for each of its scopes.
  bool host_timers = false;
  std::vector<const char*> instance_extensions;  ///< what a window needs (glfwGetRequiredInstanceExtensions)
  bool presentation = false;                     ///< ask for VK_KHR_swapchain
  // Optional features. With false a feature stays unused where the device has it, so that the other way can
  // be tested on any device.
  bool push_descriptors = true;  ///< VK_KHR_push_descriptor; without: plain descriptor sets
  bool texel_buffers = true;     ///< of a frame's size; without: texels are read from storage buffers
  bool vulkan_1_3 = true;        ///< without: Vulkan 1.2 and VK_KHR_synchronization2
  /// Which form of the kernels to start from: "processor", "gpu", or empty, the device's own kind. What was
  /// measured on the device does not count then.
  std::string kernels;
  /// For how long the device may work on one submission before it counts as lost, s; 0: 20 s on a GPU, 600 s
  /// on a processor.
  double wait_limit_s = 0;
  /// The driver reports statistics of each compiled kernel (VK_KHR_pipeline_executable_properties, which is
  /// then required).
  bool statistics = false;
  /// Called with each kernel before it is compiled.
  std::function<void(const Shader&, const KernelInterface&)> on_kernel;
  /// Called with each dispatch as it is recorded.
  std::function<void(const Dispatch&)> on_dispatch;
};

/// The options with what the environment adds: PALPATE_DEVICE where no device is named, and PALPATE_WITHOUT,
/// a list of `push_descriptors`, `texel_buffers`, `vulkan_1_3` with commas between, PALPATE_KERNELS and
/// PALPATE_WAIT_LIMIT_S.
/// Throws Error(Failure::Usage) for another word or number.
ContextOptions with_environment(ContextOptions options);

/// One physical device as `palpate devices` lists it.
struct DeviceReport {
  uint32_t index = 0;
  std::string name;
  std::string type;  ///< "discrete GPU", "integrated GPU", "virtual GPU", "CPU"
  std::string driver;
  std::string api_version;
  uint64_t memory_bytes = 0;  ///< largest device-local heap
  uint32_t subgroup_size = 0;
  std::vector<std::string> refusals;  ///< what it lacks; empty: usable
};

/// The Vulkan version that programs ask for: 1.3, or 1.2 where the options or the loader have no more. Throws
/// Error(Failure::Device) below that.
uint32_t vulkan_version(const ContextOptions& options);

/// With the validation layer and its `messenger` where the options ask for it. Throws Error(Failure::Device).
VkInstance make_instance(const ContextOptions& options, const VkDebugUtilsMessengerCreateInfoEXT* messenger);

std::vector<VkPhysicalDevice> enumerate_devices(VkInstance instance);

/// Everything the kernels rely on; a missing piece becomes a reason for refusal.
DeviceReport inspect(VkPhysicalDevice device, uint32_t index, bool presentation);

/// A faster kind of device scores higher.
int type_score(VkPhysicalDeviceType type);

/// The first queue family for both graphics and compute.
std::optional<uint32_t> find_queue_family(VkPhysicalDevice device);

bool has_extension(VkPhysicalDevice device, const char* name);

/// Usage of buffers that are memory of the host: kernels read them.
inline constexpr VkBufferUsageFlags kImportUsage =
    VK_BUFFER_USAGE_UNIFORM_TEXEL_BUFFER_BIT | VK_BUFFER_USAGE_STORAGE_BUFFER_BIT;

/// Whether buffers of the kernels' kinds can lie in memory that the host has mapped elsewhere.
bool can_import_host_memory(VkPhysicalDevice device);

/// Every Vulkan device of the machine, usable or not.
std::vector<DeviceReport> list_devices();

/// Throws Error(Failure::Device) naming `what` unless `result` is VK_SUCCESS.
void check(VkResult result, const char* what);

}  // namespace palpate::gpu
