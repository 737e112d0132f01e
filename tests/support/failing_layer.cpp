// A Vulkan layer for tests: the n-th call that may fail fails, as out of device memory or as a lost device,
// and what is created and not destroyed is counted. One instance and one device use it at a time. Controlled
// by the environment (PALPATE_FAIL_CALL, PALPATE_FAIL_AT, PALPATE_FAIL_MEMORY: read when the first instance
// is made) or, in the same process, by arm(). With PALPATE_FAIL_HANG the device is not lost, but never
// finishes what it is given from then on: waiting for that times out at once, and waiting for what it was
// given before takes as long as the machine needs, so that no test depends on a clock.
#include "tests/support/failing_layer.h"

#include <vulkan/vk_layer.h>
#include <vulkan/vulkan.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <cstring>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <string_view>

#include "tests/support/layer_link.h"

namespace {

std::mutex state_mutex;
std::string fail_call;    // empty: any
uint64_t fail_at = 0;     // counts from 1; 0: never
bool fail_lost = true;    // calls that can find the device lost do; false: they run out of memory
uint64_t calls = 0;       // that matched since armed
bool lost = false;        // a lost device stays lost; another one is not
bool hangs = false;       // instead of being lost
std::set<VkFence> never;  // fences of work that a hanging device does not do
std::string failed_call;
int64_t live = 0;  // objects created minus destroyed

PFN_vkGetInstanceProcAddr next_instance_proc = nullptr;
PFN_vkGetDeviceProcAddr next_device_proc = nullptr;
PFN_vkDestroyInstance next_destroy_instance = nullptr;
PFN_vkCreateDevice next_create_device = nullptr;
PFN_vkDestroyDevice next_destroy_device = nullptr;
PFN_vkDeviceWaitIdle next_wait_idle = nullptr;
VkDevice the_device = VK_NULL_HANDLE;

enum class Kind {
  Plain,  // may run out of memory
  Make,   // the same, and leaves an object
  Queue,  // may find the device lost
};

/// Result that the call `name` shall return instead of being made; VK_SUCCESS: make it.
VkResult verdict(const char* name, Kind kind) {
  const std::lock_guard lock(state_mutex);
  if (lost && kind == Kind::Queue) return hangs ? VK_SUCCESS : VK_ERROR_DEVICE_LOST;
  if (!fail_call.empty() && fail_call != name) return VK_SUCCESS;
  if (++calls != fail_at) return VK_SUCCESS;
  failed_call = name;
  if (kind != Kind::Queue || !fail_lost) return VK_ERROR_OUT_OF_DEVICE_MEMORY;
  lost = true;
  return hangs ? VK_SUCCESS : VK_ERROR_DEVICE_LOST;
}

/// A device that hangs takes work and does not do it.
std::optional<VkResult> instead_of(VkQueue, uint32_t, const VkSubmitInfo2*, VkFence& fence) {
  const std::lock_guard lock(state_mutex);
  if (!(lost && hangs)) return std::nullopt;
  never.insert(fence);
  return VK_SUCCESS;
}

/// The time of a device that may hang does not run while it works, and is over when it hangs.
std::optional<VkResult> instead_of(VkDevice, uint32_t count, const VkFence* fences, VkBool32,
                                   uint64_t& limit_ns) {
  const std::lock_guard lock(state_mutex);
  if (!hangs) return std::nullopt;
  if (std::any_of(fences, fences + count, [](VkFence fence) { return never.contains(fence); }))
    return VK_TIMEOUT;
  limit_ns = UINT64_MAX;
  return std::nullopt;
}

/// Every other call is made.
template <typename... Arguments>
std::optional<VkResult> instead_of(Arguments&&...) {
  return std::nullopt;
}

void count(int64_t change) {
  const std::lock_guard lock(state_mutex);
  live += change;
}

struct Name {
  char text[40] = {};
  template <size_t n>
  constexpr Name(const char (&given)[n]) {
    std::copy_n(given, n, text);
  }
};

template <Name name, Kind kind, typename Function>
struct Fallible;
template <Name name, Kind kind, typename... Arguments>
struct Fallible<name, kind, VkResult(VKAPI_PTR*)(Arguments...)> {
  static inline VkResult(VKAPI_PTR* next)(Arguments...) = nullptr;
  static VKAPI_ATTR VkResult VKAPI_CALL call(Arguments... arguments) {
    const VkResult instead = verdict(name.text, kind);
    if (instead != VK_SUCCESS) {
      // Work that a lost device had begun is complete.
      if (kind == Kind::Queue) next_wait_idle(the_device);
      return instead;
    }
    if (const std::optional<VkResult> hung = instead_of(arguments...)) return *hung;
    const VkResult result = next(arguments...);
    if (kind == Kind::Make && result == VK_SUCCESS) count(+1);
    return result;
  }
};

template <Name name, typename Function>
struct Destroying;
template <Name name, typename Handle>
struct Destroying<name, void(VKAPI_PTR*)(VkDevice, Handle, const VkAllocationCallbacks*)> {
  static inline void(VKAPI_PTR* next)(VkDevice, Handle, const VkAllocationCallbacks*) = nullptr;
  static VKAPI_ATTR void VKAPI_CALL call(VkDevice device, Handle handle,
                                         const VkAllocationCallbacks* allocator) {
    if (handle != VK_NULL_HANDLE) count(-1);
    next(device, handle, allocator);
  }
};

struct Hook {
  const char* name;
  PFN_vkVoidFunction call;
  void (*bind)(PFN_vkVoidFunction);
};
template <typename Wrapper>
constexpr Hook hook(const char* name) {
  return {name, reinterpret_cast<PFN_vkVoidFunction>(&Wrapper::call),
          [](PFN_vkVoidFunction next) { Wrapper::next = reinterpret_cast<decltype(Wrapper::next)>(next); }};
}
#define FALLIBLE(function, kind) hook<Fallible<#function, Kind::kind, PFN_##function>>(#function)
#define DESTROYING(function) hook<Destroying<#function, PFN_##function>>(#function)

const std::array kHooks = {
    FALLIBLE(vkAllocateMemory, Make),
    FALLIBLE(vkCreateBuffer, Make),
    FALLIBLE(vkCreateBufferView, Make),
    FALLIBLE(vkCreateDescriptorSetLayout, Make),
    FALLIBLE(vkCreatePipelineLayout, Make),
    FALLIBLE(vkCreateShaderModule, Make),
    FALLIBLE(vkCreateComputePipelines, Make),
    FALLIBLE(vkCreateGraphicsPipelines, Make),
    FALLIBLE(vkCreatePipelineCache, Make),
    FALLIBLE(vkCreateCommandPool, Make),
    FALLIBLE(vkCreateFence, Make),
    FALLIBLE(vkCreateDescriptorPool, Make),
    FALLIBLE(vkAllocateDescriptorSets, Plain),
    FALLIBLE(vkCreateQueryPool, Make),
    FALLIBLE(vkCreateImage, Make),
    FALLIBLE(vkCreateImageView, Make),
    FALLIBLE(vkBindBufferMemory, Plain),
    FALLIBLE(vkMapMemory, Plain),
    FALLIBLE(vkGetMemoryHostPointerPropertiesEXT, Plain),
    FALLIBLE(vkAllocateCommandBuffers, Plain),
    FALLIBLE(vkBeginCommandBuffer, Plain),
    FALLIBLE(vkEndCommandBuffer, Plain),
    FALLIBLE(vkResetFences, Plain),
    FALLIBLE(vkQueueSubmit2, Queue),
    FALLIBLE(vkWaitForFences, Queue),
    FALLIBLE(vkGetFenceStatus, Queue),
    DESTROYING(vkFreeMemory),
    DESTROYING(vkDestroyBuffer),
    DESTROYING(vkDestroyBufferView),
    DESTROYING(vkDestroyDescriptorSetLayout),
    DESTROYING(vkDestroyPipelineLayout),
    DESTROYING(vkDestroyShaderModule),
    DESTROYING(vkDestroyPipeline),
    DESTROYING(vkDestroyPipelineCache),
    DESTROYING(vkDestroyCommandPool),
    DESTROYING(vkDestroyFence),
    DESTROYING(vkDestroyDescriptorPool),
    DESTROYING(vkDestroyQueryPool),
    DESTROYING(vkDestroyImage),
    DESTROYING(vkDestroyImageView),
};

VKAPI_ATTR VkResult VKAPI_CALL create_instance(const VkInstanceCreateInfo* info,
                                               const VkAllocationCallbacks* allocator, VkInstance* instance) {
  auto* link =
      link_info<VkLayerInstanceCreateInfo>(info->pNext, VK_STRUCTURE_TYPE_LOADER_INSTANCE_CREATE_INFO);
  if (!link) return VK_ERROR_INITIALIZATION_FAILED;
  next_instance_proc = link->u.pLayerInfo->pfnNextGetInstanceProcAddr;
  link->u.pLayerInfo = link->u.pLayerInfo->pNext;
  if (const char* at = std::getenv("PALPATE_FAIL_AT")) {
    hangs = std::getenv("PALPATE_FAIL_HANG") != nullptr;
    const char* call = std::getenv("PALPATE_FAIL_CALL");
    palpate_layer_arm(call ? call : "", std::strtoull(at, nullptr, 10),
                      std::getenv("PALPATE_FAIL_MEMORY") == nullptr);
    unsetenv("PALPATE_FAIL_AT");  // the layer is loaded anew with each instance
  }
  const auto create =
      reinterpret_cast<PFN_vkCreateInstance>(next_instance_proc(VK_NULL_HANDLE, "vkCreateInstance"));
  const VkResult result = create(info, allocator, instance);
  if (result != VK_SUCCESS) return result;
  const auto find = [&](const char* name) { return next_instance_proc(*instance, name); };
  next_destroy_instance = reinterpret_cast<PFN_vkDestroyInstance>(find("vkDestroyInstance"));
  next_create_device = reinterpret_cast<PFN_vkCreateDevice>(find("vkCreateDevice"));
  return result;
}

VKAPI_ATTR void VKAPI_CALL destroy_instance(VkInstance instance, const VkAllocationCallbacks* allocator) {
  next_destroy_instance(instance, allocator);
}

VKAPI_ATTR VkResult VKAPI_CALL create_device(VkPhysicalDevice physical, const VkDeviceCreateInfo* info,
                                             const VkAllocationCallbacks* allocator, VkDevice* device) {
  auto* link = link_info<VkLayerDeviceCreateInfo>(info->pNext, VK_STRUCTURE_TYPE_LOADER_DEVICE_CREATE_INFO);
  if (!link) return VK_ERROR_INITIALIZATION_FAILED;
  next_device_proc = link->u.pLayerInfo->pfnNextGetDeviceProcAddr;
  link->u.pLayerInfo = link->u.pLayerInfo->pNext;
  if (const VkResult instead = verdict("vkCreateDevice", Kind::Plain); instead != VK_SUCCESS) return instead;
  const VkResult result = next_create_device(physical, info, allocator, device);
  if (result != VK_SUCCESS) return result;
  the_device = *device;
  {
    const std::lock_guard lock(state_mutex);
    lost = false;
    never.clear();
  }
  const auto find = [&](const char* name) { return next_device_proc(*device, name); };
  next_destroy_device = reinterpret_cast<PFN_vkDestroyDevice>(find("vkDestroyDevice"));
  next_wait_idle = reinterpret_cast<PFN_vkDeviceWaitIdle>(find("vkDeviceWaitIdle"));
  for (const Hook& h : kHooks) h.bind(find(h.name));
  return result;
}

VKAPI_ATTR void VKAPI_CALL destroy_device(VkDevice device, const VkAllocationCallbacks* allocator) {
  next_destroy_device(device, allocator);
}

PFN_vkVoidFunction own(const char* name) {
  const std::string_view wanted = name;
  if (wanted == "vkDestroyDevice") return reinterpret_cast<PFN_vkVoidFunction>(destroy_device);
  if (wanted == "vkGetDeviceProcAddr") return reinterpret_cast<PFN_vkVoidFunction>(palpate_layer_device_proc);
  for (const Hook& h : kHooks)
    if (wanted == h.name) return h.call;
  return nullptr;
}

}  // namespace

extern "C" {

VKAPI_ATTR VkResult VKAPI_CALL vkNegotiateLoaderLayerInterfaceVersion(VkNegotiateLayerInterface* version);

VKAPI_ATTR PFN_vkVoidFunction VKAPI_CALL palpate_layer_device_proc(VkDevice device, const char* name) {
  if (const PFN_vkVoidFunction ours = own(name)) return ours;
  return next_device_proc(device, name);
}

VKAPI_ATTR PFN_vkVoidFunction VKAPI_CALL palpate_layer_instance_proc(VkInstance instance, const char* name) {
  const std::string_view wanted = name;
  if (wanted == "vkGetInstanceProcAddr")
    return reinterpret_cast<PFN_vkVoidFunction>(palpate_layer_instance_proc);
  if (wanted == "vkCreateInstance") return reinterpret_cast<PFN_vkVoidFunction>(create_instance);
  if (wanted == "vkDestroyInstance") return reinterpret_cast<PFN_vkVoidFunction>(destroy_instance);
  if (wanted == "vkCreateDevice") return reinterpret_cast<PFN_vkVoidFunction>(create_device);
  if (const PFN_vkVoidFunction ours = own(name)) return ours;
  return next_instance_proc ? next_instance_proc(instance, name) : nullptr;
}

VKAPI_ATTR VkResult VKAPI_CALL vkNegotiateLoaderLayerInterfaceVersion(VkNegotiateLayerInterface* version) {
  version->loaderLayerInterfaceVersion = std::min(version->loaderLayerInterfaceVersion, 2u);
  version->pfnGetInstanceProcAddr = palpate_layer_instance_proc;
  version->pfnGetDeviceProcAddr = palpate_layer_device_proc;
  version->pfnGetPhysicalDeviceProcAddr = nullptr;
  return VK_SUCCESS;
}

void palpate_layer_arm(const char* call, uint64_t at, bool device_lost) {
  const std::lock_guard lock(state_mutex);
  fail_call = call;
  fail_at = at;
  fail_lost = device_lost;
  calls = 0;
  lost = false;
  failed_call.clear();
}

uint64_t palpate_layer_calls() {
  const std::lock_guard lock(state_mutex);
  return calls;
}

const char* palpate_layer_failed() {
  return failed_call.c_str();
}

int64_t palpate_layer_live() {
  const std::lock_guard lock(state_mutex);
  return live;
}
}
