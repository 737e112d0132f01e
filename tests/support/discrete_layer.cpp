// A Vulkan layer for tests: shows a processor's driver as a card with memory of its own, which the host
// cannot map, next to memory of the host. What is then written through staging buffers, read back and chosen
// for such a device can be tested on any machine. One instance and one device use it at a time.
#include <vulkan/vk_layer.h>
#include <vulkan/vulkan.h>

#include <algorithm>
#include <iterator>
#include <string_view>

#include "tests/support/layer_link.h"

namespace {

constexpr uint32_t kOwnType = 0, kHostType = 1;

PFN_vkGetInstanceProcAddr next_instance_proc = nullptr;
PFN_vkGetDeviceProcAddr next_device_proc = nullptr;
VkInstance the_instance = VK_NULL_HANDLE;
VkDevice the_device = VK_NULL_HANDLE;

template <typename Function>
Function below(const char* name) {
  const PFN_vkVoidFunction found =
      the_device && next_device_proc ? next_device_proc(the_device, name) : nullptr;
  return reinterpret_cast<Function>(found ? found : next_instance_proc(the_instance, name));
}
#define BELOW(function) below<PFN_##function>(#function)

VKAPI_ATTR VkResult VKAPI_CALL create_instance(const VkInstanceCreateInfo* info,
                                               const VkAllocationCallbacks* allocator, VkInstance* instance) {
  auto* link =
      link_info<VkLayerInstanceCreateInfo>(info->pNext, VK_STRUCTURE_TYPE_LOADER_INSTANCE_CREATE_INFO);
  if (!link) return VK_ERROR_INITIALIZATION_FAILED;
  next_instance_proc = link->u.pLayerInfo->pfnNextGetInstanceProcAddr;
  link->u.pLayerInfo = link->u.pLayerInfo->pNext;
  const auto create =
      reinterpret_cast<PFN_vkCreateInstance>(next_instance_proc(VK_NULL_HANDLE, "vkCreateInstance"));
  const VkResult result = create(info, allocator, instance);
  if (result == VK_SUCCESS) the_instance = *instance;
  return result;
}

VKAPI_ATTR VkResult VKAPI_CALL create_device(VkPhysicalDevice physical, const VkDeviceCreateInfo* info,
                                             const VkAllocationCallbacks* allocator, VkDevice* device) {
  auto* link = link_info<VkLayerDeviceCreateInfo>(info->pNext, VK_STRUCTURE_TYPE_LOADER_DEVICE_CREATE_INFO);
  if (!link) return VK_ERROR_INITIALIZATION_FAILED;
  next_device_proc = link->u.pLayerInfo->pfnNextGetDeviceProcAddr;
  link->u.pLayerInfo = link->u.pLayerInfo->pNext;
  const auto create =
      reinterpret_cast<PFN_vkCreateDevice>(next_instance_proc(the_instance, "vkCreateDevice"));
  const VkResult result = create(physical, info, allocator, device);
  if (result == VK_SUCCESS) the_device = *device;
  return result;
}

VKAPI_ATTR void VKAPI_CALL destroy_device(VkDevice device, const VkAllocationCallbacks* allocator) {
  const auto destroy = BELOW(vkDestroyDevice);
  the_device = VK_NULL_HANDLE;
  destroy(device, allocator);
}

VKAPI_ATTR void VKAPI_CALL properties(VkPhysicalDevice device, VkPhysicalDeviceProperties* found) {
  BELOW(vkGetPhysicalDeviceProperties)(device, found);
  found->deviceType = VK_PHYSICAL_DEVICE_TYPE_DISCRETE_GPU;
}

VKAPI_ATTR void VKAPI_CALL properties2(VkPhysicalDevice device, VkPhysicalDeviceProperties2* found) {
  BELOW(vkGetPhysicalDeviceProperties2)(device, found);
  found->properties.deviceType = VK_PHYSICAL_DEVICE_TYPE_DISCRETE_GPU;
}

VKAPI_ATTR void VKAPI_CALL memory_properties(VkPhysicalDevice device,
                                             VkPhysicalDeviceMemoryProperties* found) {
  BELOW(vkGetPhysicalDeviceMemoryProperties)(device, found);
  const VkDeviceSize size = found->memoryHeaps[0].size;
  found->memoryHeapCount = found->memoryTypeCount = 2;
  found->memoryHeaps[0] = {size / 2, VK_MEMORY_HEAP_DEVICE_LOCAL_BIT};
  found->memoryHeaps[1] = {size / 2, 0};
  found->memoryTypes[kOwnType] = {VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT, 0};
  found->memoryTypes[kHostType] = {VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT |
                                       VK_MEMORY_PROPERTY_HOST_COHERENT_BIT |
                                       VK_MEMORY_PROPERTY_HOST_CACHED_BIT,
                                   1};
}

VKAPI_ATTR void VKAPI_CALL buffer_needs(VkDevice device, VkBuffer buffer, VkMemoryRequirements* found) {
  BELOW(vkGetBufferMemoryRequirements)(device, buffer, found);
  found->memoryTypeBits = 1u << kOwnType | 1u << kHostType;
}

VKAPI_ATTR void VKAPI_CALL image_needs(VkDevice device, VkImage image, VkMemoryRequirements* found) {
  BELOW(vkGetImageMemoryRequirements)(device, image, found);
  found->memoryTypeBits = 1u << kOwnType;
}

VKAPI_ATTR VkResult VKAPI_CALL host_pointer(VkDevice device, VkExternalMemoryHandleTypeFlagBits handle,
                                            const void* pointer, VkMemoryHostPointerPropertiesEXT* found) {
  const VkResult result = BELOW(vkGetMemoryHostPointerPropertiesEXT)(device, handle, pointer, found);
  found->memoryTypeBits = found->memoryTypeBits ? 1u << kHostType : 0;
  return result;
}

VKAPI_ATTR VkResult VKAPI_CALL allocate(VkDevice device, const VkMemoryAllocateInfo* info,
                                        const VkAllocationCallbacks* allocator, VkDeviceMemory* memory) {
  VkMemoryAllocateInfo real = *info;
  real.memoryTypeIndex = 0;  // the only one that there is
  return BELOW(vkAllocateMemory)(device, &real, allocator, memory);
}

struct Hook {
  std::string_view name;
  PFN_vkVoidFunction call;
};

PFN_vkVoidFunction own(const char* name);

VKAPI_ATTR PFN_vkVoidFunction VKAPI_CALL device_proc(VkDevice device, const char* name) {
  if (const PFN_vkVoidFunction ours = own(name)) return ours;
  return next_device_proc(device, name);
}

VKAPI_ATTR PFN_vkVoidFunction VKAPI_CALL instance_proc(VkInstance instance, const char* name) {
  if (const PFN_vkVoidFunction ours = own(name)) return ours;
  return next_instance_proc ? next_instance_proc(instance, name) : nullptr;
}

template <typename Function>
Hook hook(std::string_view name, Function call) {
  return {name, reinterpret_cast<PFN_vkVoidFunction>(call)};
}

PFN_vkVoidFunction own(const char* name) {
  static const Hook kHooks[] = {
      hook("vkGetInstanceProcAddr", instance_proc),
      hook("vkGetDeviceProcAddr", device_proc),
      hook("vkCreateInstance", create_instance),
      hook("vkCreateDevice", create_device),
      hook("vkDestroyDevice", destroy_device),
      hook("vkGetPhysicalDeviceProperties", properties),
      hook("vkGetPhysicalDeviceProperties2", properties2),
      hook("vkGetPhysicalDeviceMemoryProperties", memory_properties),
      hook("vkGetBufferMemoryRequirements", buffer_needs),
      hook("vkGetImageMemoryRequirements", image_needs),
      hook("vkGetMemoryHostPointerPropertiesEXT", host_pointer),
      hook("vkAllocateMemory", allocate),
  };
  const std::string_view wanted = name;
  const auto* found = std::ranges::find(kHooks, wanted, &Hook::name);
  return found == std::end(kHooks) ? nullptr : found->call;
}

}  // namespace

extern "C" VKAPI_ATTR VkResult VKAPI_CALL
vkNegotiateLoaderLayerInterfaceVersion(VkNegotiateLayerInterface* version) {
  version->loaderLayerInterfaceVersion = std::min(version->loaderLayerInterfaceVersion, 2u);
  version->pfnGetInstanceProcAddr = instance_proc;
  version->pfnGetDeviceProcAddr = device_proc;
  version->pfnGetPhysicalDeviceProcAddr = nullptr;
  return VK_SUCCESS;
}
