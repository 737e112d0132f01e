#include "engine/gpu/physical_device.h"

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <sstream>
#include <string>
#include <string_view>

#include "palpate/device.h"
#include "palpate/error.h"

namespace palpate::gpu {
namespace {

constexpr const char* kValidationLayer = "VK_LAYER_KHRONOS_validation";

const char* result_name(VkResult result) {
  switch (result) {
    case VK_ERROR_OUT_OF_HOST_MEMORY:
      return "out of host memory";
    case VK_ERROR_OUT_OF_DEVICE_MEMORY:
      return "out of device memory";
    case VK_ERROR_INITIALIZATION_FAILED:
      return "initialisation failed";
    case VK_ERROR_DEVICE_LOST:
      return "device lost";
    case VK_ERROR_LAYER_NOT_PRESENT:
      return "layer not present";
    case VK_ERROR_EXTENSION_NOT_PRESENT:
      return "extension not present";
    case VK_ERROR_INCOMPATIBLE_DRIVER:
      return "no compatible driver";
    case VK_ERROR_SURFACE_LOST_KHR:
      return "surface lost";
    default:
      return "Vulkan error";
  }
}

const char* type_name(VkPhysicalDeviceType type) {
  switch (type) {
    case VK_PHYSICAL_DEVICE_TYPE_DISCRETE_GPU:
      return "discrete GPU";
    case VK_PHYSICAL_DEVICE_TYPE_INTEGRATED_GPU:
      return "integrated GPU";
    case VK_PHYSICAL_DEVICE_TYPE_VIRTUAL_GPU:
      return "virtual GPU";
    case VK_PHYSICAL_DEVICE_TYPE_CPU:
      return "CPU";
    default:
      return "other";
  }
}

std::string version_text(uint32_t v) {
  return std::to_string(VK_API_VERSION_MAJOR(v)) + "." + std::to_string(VK_API_VERSION_MINOR(v)) + "." +
         std::to_string(VK_API_VERSION_PATCH(v));
}

/// One of the words that PALPATE_WITHOUT may hold; null: none of them.
bool* optional_feature(ContextOptions& options, std::string_view name) {
  if (name == "push_descriptors") return &options.push_descriptors;
  if (name == "texel_buffers") return &options.texel_buffers;
  if (name == "vulkan_1_3") return &options.vulkan_1_3;
  return nullptr;
}

}  // namespace

ContextOptions with_environment(ContextOptions options) {
  const char* device = std::getenv("PALPATE_DEVICE");
  if (options.device.empty() && device) options.device = device;
  const char* without = std::getenv("PALPATE_WITHOUT");
  std::istringstream names(without ? without : "");
  for (std::string name; std::getline(names, name, ',');) {
    bool* feature = optional_feature(options, name);
    if (!feature)
      throw Error(Failure::Usage, "PALPATE_WITHOUT of push_descriptors, texel_buffers, vulkan_1_3",
                  "'" + name + "'", "these words with commas between");
    *feature = false;
  }
  if (const char* kernels = std::getenv("PALPATE_KERNELS"); kernels && options.kernels.empty()) {
    options.kernels = kernels;
    if (options.kernels != "processor" && options.kernels != "gpu")
      throw Error(Failure::Usage, "PALPATE_KERNELS of processor, gpu", "'" + options.kernels + "'",
                  "unsetting it: the device's kind decides");
  }
  if (const char* limit = std::getenv("PALPATE_WAIT_LIMIT_S"); limit && options.wait_limit_s == 0) {
    char* end = nullptr;
    options.wait_limit_s = std::strtod(limit, &end);
    if (end == limit || *end != 0 || !(options.wait_limit_s > 0 && options.wait_limit_s <= 1e6))
      throw Error(Failure::Usage, "PALPATE_WAIT_LIMIT_S in seconds, up to a million",
                  "'" + std::string(limit) + "'", "20, which GPUs have without it");
  }
  return options;
}

uint32_t vulkan_version(const ContextOptions& options) {
  uint32_t loader_version = VK_API_VERSION_1_0;
  vkEnumerateInstanceVersion(&loader_version);
  if (loader_version < VK_API_VERSION_1_2) {
    throw Error(Failure::Device, "a Vulkan 1.2 loader", "Vulkan " + version_text(loader_version),
                "a newer Vulkan loader (package libvulkan1)");
  }
  return options.vulkan_1_3 && loader_version >= VK_API_VERSION_1_3 ? VK_API_VERSION_1_3 : VK_API_VERSION_1_2;
}

VkInstance make_instance(const ContextOptions& options, const VkDebugUtilsMessengerCreateInfoEXT* messenger) {
  VkApplicationInfo application{};
  application.sType = VK_STRUCTURE_TYPE_APPLICATION_INFO;
  application.pApplicationName = "palpate";
  application.apiVersion = vulkan_version(options);

  std::vector<const char*> extensions = options.instance_extensions;
  std::vector<const char*> layers;
  const VkValidationFeatureEnableEXT enabled[] = {
      VK_VALIDATION_FEATURE_ENABLE_SYNCHRONIZATION_VALIDATION_EXT};
  VkValidationFeaturesEXT validation{};
  validation.sType = VK_STRUCTURE_TYPE_VALIDATION_FEATURES_EXT;
  validation.enabledValidationFeatureCount = 1;
  validation.pEnabledValidationFeatures = enabled;
  validation.pNext = messenger;
  if (options.validation) {
    uint32_t count = 0;
    vkEnumerateInstanceLayerProperties(&count, nullptr);
    std::vector<VkLayerProperties> available(count);
    vkEnumerateInstanceLayerProperties(&count, available.data());
    const bool found = std::any_of(available.begin(), available.end(), [](const VkLayerProperties& l) {
      return std::strcmp(l.layerName, kValidationLayer) == 0;
    });
    if (!found) {
      throw Error(Failure::Device, std::string("the layer ") + kValidationLayer, "no such layer",
                  "installing vulkan-validationlayers, or running without --validation");
    }
    layers.push_back(kValidationLayer);
    extensions.push_back(VK_EXT_DEBUG_UTILS_EXTENSION_NAME);
  }

  VkInstanceCreateInfo info{};
  info.sType = VK_STRUCTURE_TYPE_INSTANCE_CREATE_INFO;
  info.pNext = options.validation ? &validation : nullptr;
  info.pApplicationInfo = &application;
  info.enabledLayerCount = static_cast<uint32_t>(layers.size());
  info.ppEnabledLayerNames = layers.data();
  info.enabledExtensionCount = static_cast<uint32_t>(extensions.size());
  info.ppEnabledExtensionNames = extensions.data();
  VkInstance instance = VK_NULL_HANDLE;
  const VkResult result = vkCreateInstance(&info, nullptr, &instance);
  if (result == VK_ERROR_INCOMPATIBLE_DRIVER) {
    throw Error(Failure::Device, "a Vulkan driver", "none installed",
                "installing mesa-vulkan-drivers, which runs on any processor");
  }
  check(result, "creating the Vulkan instance");
  return instance;
}

std::vector<VkPhysicalDevice> enumerate_devices(VkInstance instance) {
  uint32_t count = 0;
  check(vkEnumeratePhysicalDevices(instance, &count, nullptr), "counting devices");
  std::vector<VkPhysicalDevice> devices(count);
  check(vkEnumeratePhysicalDevices(instance, &count, devices.data()), "listing devices");
  devices.resize(count);
  return devices;
}

bool has_extension(VkPhysicalDevice device, const char* name) {
  uint32_t count = 0;
  vkEnumerateDeviceExtensionProperties(device, nullptr, &count, nullptr);
  std::vector<VkExtensionProperties> extensions(count);
  vkEnumerateDeviceExtensionProperties(device, nullptr, &count, extensions.data());
  return std::any_of(extensions.begin(), extensions.end(),
                     [&](const VkExtensionProperties& e) { return std::strcmp(e.extensionName, name) == 0; });
}

DeviceReport inspect(VkPhysicalDevice device, uint32_t index, bool presentation) {
  VkPhysicalDeviceSubgroupProperties subgroup{
      VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_SUBGROUP_PROPERTIES, nullptr, 0, 0, 0, 0};
  VkPhysicalDeviceDriverProperties driver{};
  driver.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_DRIVER_PROPERTIES;
  driver.pNext = &subgroup;
  VkPhysicalDeviceProperties2 properties{};
  properties.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PROPERTIES_2;
  properties.pNext = &driver;
  vkGetPhysicalDeviceProperties2(device, &properties);
  const VkPhysicalDeviceProperties& p = properties.properties;

  DeviceReport report;
  report.index = index;
  report.name = p.deviceName;
  report.type = type_name(p.deviceType);
  report.driver = std::string(driver.driverName) + " " + driver.driverInfo;
  report.api_version = version_text(p.apiVersion);
  report.subgroup_size = subgroup.subgroupSize;
  VkPhysicalDeviceMemoryProperties memory{};
  vkGetPhysicalDeviceMemoryProperties(device, &memory);
  for (uint32_t i = 0; i < memory.memoryHeapCount; ++i) {
    if (memory.memoryHeaps[i].flags & VK_MEMORY_HEAP_DEVICE_LOCAL_BIT)
      report.memory_bytes = std::max<uint64_t>(report.memory_bytes, memory.memoryHeaps[i].size);
  }

  if (p.apiVersion < VK_API_VERSION_1_2) {
    report.refusals.push_back("Vulkan " + report.api_version + ", needs 1.2");
    return report;
  }
  if (!(subgroup.supportedOperations & VK_SUBGROUP_FEATURE_VOTE_BIT) ||
      !(subgroup.supportedStages & VK_SHADER_STAGE_COMPUTE_BIT))
    report.refusals.emplace_back("no votes in subgroups of compute kernels");
  VkPhysicalDeviceSynchronization2Features synchronization{};
  synchronization.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_SYNCHRONIZATION_2_FEATURES;
  VkPhysicalDeviceFeatures2 features{};
  features.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_FEATURES_2;
  features.pNext = &synchronization;
  vkGetPhysicalDeviceFeatures2(device, &features);
  if (!synchronization.synchronization2) report.refusals.emplace_back("no synchronization2");
  if (!find_queue_family(device)) report.refusals.emplace_back("no queue for both graphics and compute");
  if (presentation && !has_extension(device, VK_KHR_SWAPCHAIN_EXTENSION_NAME))
    report.refusals.emplace_back("no VK_KHR_swapchain (cannot show a window)");
  return report;
}

int type_score(VkPhysicalDeviceType type) {
  switch (type) {
    case VK_PHYSICAL_DEVICE_TYPE_DISCRETE_GPU:
      return 4;
    case VK_PHYSICAL_DEVICE_TYPE_INTEGRATED_GPU:
      return 3;
    case VK_PHYSICAL_DEVICE_TYPE_VIRTUAL_GPU:
      return 2;
    case VK_PHYSICAL_DEVICE_TYPE_CPU:
      return 1;
    default:
      return 0;
  }
}

std::optional<uint32_t> find_queue_family(VkPhysicalDevice device) {
  uint32_t count = 0;
  vkGetPhysicalDeviceQueueFamilyProperties(device, &count, nullptr);
  std::vector<VkQueueFamilyProperties> families(count);
  vkGetPhysicalDeviceQueueFamilyProperties(device, &count, families.data());
  constexpr VkQueueFlags kNeeded = VK_QUEUE_GRAPHICS_BIT | VK_QUEUE_COMPUTE_BIT;
  for (uint32_t i = 0; i < count; ++i) {
    if ((families[i].queueFlags & kNeeded) == kNeeded) return i;
  }
  return std::nullopt;
}

bool can_import_host_memory(VkPhysicalDevice device) {
  if (!has_extension(device, VK_EXT_EXTERNAL_MEMORY_HOST_EXTENSION_NAME)) return false;
  VkPhysicalDeviceExternalBufferInfo info{};
  info.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_EXTERNAL_BUFFER_INFO;
  info.usage = kImportUsage;
  info.handleType = VK_EXTERNAL_MEMORY_HANDLE_TYPE_HOST_ALLOCATION_BIT_EXT;
  VkExternalBufferProperties found{};
  found.sType = VK_STRUCTURE_TYPE_EXTERNAL_BUFFER_PROPERTIES;
  vkGetPhysicalDeviceExternalBufferProperties(device, &info, &found);
  return (found.externalMemoryProperties.externalMemoryFeatures &
          VK_EXTERNAL_MEMORY_FEATURE_IMPORTABLE_BIT) != 0;
}

void check(VkResult result, const char* what) {
  if (result == VK_SUCCESS) return;
  const char* remedy = "another device (palpate devices), or a newer driver";
  if (result == VK_ERROR_OUT_OF_HOST_MEMORY || result == VK_ERROR_OUT_OF_DEVICE_MEMORY)
    remedy = "a smaller frame or crop, or another device (palpate devices)";
  if (result == VK_ERROR_DEVICE_LOST)
    throw DeviceLost(what, result_name(result),
                     "starting again; if it comes back, another device (palpate devices) or a newer driver");
  throw Error(Failure::Device, what, std::string(result_name(result)) + " (" + std::to_string(result) + ")",
              remedy);
}

std::vector<DeviceReport> list_devices() {
  VkInstance instance = make_instance(with_environment({}), nullptr);
  std::vector<DeviceReport> reports;
  const std::vector<VkPhysicalDevice> devices = enumerate_devices(instance);
  for (uint32_t i = 0; i < devices.size(); ++i) reports.push_back(inspect(devices[i], i, false));
  vkDestroyInstance(instance, nullptr);
  return reports;
}

}  // namespace palpate::gpu
