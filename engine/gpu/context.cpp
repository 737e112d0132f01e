#include "engine/gpu/context.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <optional>
#include <span>
#include <type_traits>

#include "engine/base/text.h"
#include "engine/base/trace.h"
#include "engine/gpu/device_access.h"
#include "engine/gpu/stops.h"
#include "palpate/device.h"
#include "palpate/error.h"
#include "palpate/frame.h"

namespace palpate::gpu {
namespace {

thread_local Stops counted;

std::filesystem::path pipeline_cache_file(const VkPhysicalDeviceProperties& properties) {
  const std::filesystem::path folder = cache_folder();
  if (folder.empty()) return {};
  std::string uuid;
  for (const uint8_t byte : properties.pipelineCacheUUID) {
    constexpr char kHex[] = "0123456789abcdef";
    uuid += kHex[byte >> 4];
    uuid += kHex[byte & 15];
  }
  return folder / ("pipelines-" + uuid);
}

std::vector<char> read_all(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

// The file is the driver's data and their checksum: a driver is never given damaged data, which some keep as
// they are.
constexpr size_t kSealBytes = 8;
std::array<char, kSealBytes> seal(std::span<const char> data) {
  uint64_t hash = 0xcbf29ce484222325;  // FNV-1a
  for (const char byte : data) hash = (hash ^ static_cast<uint8_t>(byte)) * 0x100000001b3;
  return std::bit_cast<std::array<char, kSealBytes>>(hash);
}

/// The driver's cache in the file; empty where it is damaged or nothing but a header.
std::vector<char> read_cache(const std::filesystem::path& file) {
  std::vector<char> data = read_all(file);
  if (data.size() <= kSealBytes + sizeof(VkPipelineCacheHeaderVersionOne)) return {};
  const auto sealed = std::span(data).last<kSealBytes>();
  const auto expected = seal(std::span(data).first(data.size() - kSealBytes));
  if (!std::ranges::equal(sealed, expected)) return {};
  data.resize(data.size() - kSealBytes);
  return data;
}

}  // namespace

std::filesystem::path cache_folder() {
  if (const char* cache = std::getenv("XDG_CACHE_HOME"); cache && *cache)
    return std::filesystem::path(cache) / "palpate";
  if (const char* home = std::getenv("HOME"); home && *home)
    return std::filesystem::path(home) / ".cache" / "palpate";
  return {};
}

VKAPI_ATTR VkBool32 VKAPI_CALL Context::on_message(VkDebugUtilsMessageSeverityFlagBitsEXT,
                                                   VkDebugUtilsMessageTypeFlagsEXT,
                                                   const VkDebugUtilsMessengerCallbackDataEXT* data,
                                                   void* self) {
  auto* context = static_cast<Context*>(self);
  const std::lock_guard lock(context->message_mutex_);
  context->messages_.emplace_back(data->pMessage);
  return VK_FALSE;
}

Context::Context(const ContextOptions& options)
    : options_(with_environment(options)), handle_(DeviceAccess::handle(*this)) {
  open();
}

void Context::open() {
  try {
    create_instance(options_);
    choose_device(options_);
    create_device(options_);
    load_pipeline_cache();
  } catch (...) {
    close();
    throw;
  }
}

Context::~Context() {
  if (device_ && !hung_) {
    vkDeviceWaitIdle(device_);
    save_pipeline_cache();
  }
  close();
}

void Context::reopen() {
  if (device_ && !hung_) vkDeviceWaitIdle(device_);
  close();
  open();
}

// Memory that a device that hangs may still use is left to the end of the process.
void Context::close() {
  compiled_.clear();
  if (!hung_) {
    if (pipeline_cache_) vkDestroyPipelineCache(device_, pipeline_cache_, nullptr);
    if (device_) vkDestroyDevice(device_, nullptr);
    if (messenger_) {
      auto destroy = reinterpret_cast<PFN_vkDestroyDebugUtilsMessengerEXT>(
          vkGetInstanceProcAddr(instance_, "vkDestroyDebugUtilsMessengerEXT"));
      destroy(instance_, messenger_, nullptr);
    }
    if (instance_) vkDestroyInstance(instance_, nullptr);
  }
  pipeline_cache_ = VK_NULL_HANDLE;
  device_ = VK_NULL_HANDLE;
  messenger_ = VK_NULL_HANDLE;
  instance_ = VK_NULL_HANDLE;
  physical_device_ = VK_NULL_HANDLE;
  hung_ = false;
}

void Context::create_instance(const ContextOptions& options) {
  VkDebugUtilsMessengerCreateInfoEXT messenger{};
  messenger.sType = VK_STRUCTURE_TYPE_DEBUG_UTILS_MESSENGER_CREATE_INFO_EXT;
  messenger.messageSeverity =
      VK_DEBUG_UTILS_MESSAGE_SEVERITY_WARNING_BIT_EXT | VK_DEBUG_UTILS_MESSAGE_SEVERITY_ERROR_BIT_EXT;
  messenger.messageType =
      VK_DEBUG_UTILS_MESSAGE_TYPE_VALIDATION_BIT_EXT | VK_DEBUG_UTILS_MESSAGE_TYPE_PERFORMANCE_BIT_EXT;
  messenger.pfnUserCallback = on_message;
  messenger.pUserData = this;
  instance_ = make_instance(options, &messenger);
  if (options.validation) {
    auto create = reinterpret_cast<PFN_vkCreateDebugUtilsMessengerEXT>(
        vkGetInstanceProcAddr(instance_, "vkCreateDebugUtilsMessengerEXT"));
    check(create(instance_, &messenger, nullptr, &messenger_), "the validation messenger");
    set_name_ = reinterpret_cast<PFN_vkSetDebugUtilsObjectNameEXT>(
        vkGetInstanceProcAddr(instance_, "vkSetDebugUtilsObjectNameEXT"));
    begin_label_ = reinterpret_cast<PFN_vkCmdBeginDebugUtilsLabelEXT>(
        vkGetInstanceProcAddr(instance_, "vkCmdBeginDebugUtilsLabelEXT"));
    end_label_ = reinterpret_cast<PFN_vkCmdEndDebugUtilsLabelEXT>(
        vkGetInstanceProcAddr(instance_, "vkCmdEndDebugUtilsLabelEXT"));
  }
}

void Context::choose_device(const ContextOptions& options) {
  const std::vector<VkPhysicalDevice> devices = enumerate_devices(instance_);
  std::string listing;
  // The fastest kind; of processors' drivers the one with the widest vectors; of equals the one with most
  // memory.
  std::array<uint64_t, 3> best{};
  bool matched = false;
  for (uint32_t i = 0; i < devices.size(); ++i) {
    DeviceReport report = inspect(devices[i], i, options.presentation);
    VkPhysicalDeviceProperties properties{};
    vkGetPhysicalDeviceProperties(devices[i], &properties);
    // One or two digits are an index, never a part of a name: "LLVM 15.0.6" is full of digits.
    const bool by_index =
        options.device.size() <= 2 && std::all_of(options.device.begin(), options.device.end(),
                                                  [](char c) { return c >= '0' && c <= '9'; });
    const bool wanted =
        options.device.empty() || (by_index ? options.device == std::to_string(i)
                                            : report.name.find(options.device) != std::string::npos);
    matched = matched || wanted;
    std::string verdict;
    for (const std::string& refusal : report.refusals) verdict += (verdict.empty() ? "" : ", ") + refusal;
    if (verdict.empty()) verdict = wanted ? "usable" : "not the one asked for";
    listing += (listing.empty() ? "" : "; ") + std::to_string(i) + " " + report.name + ": " + verdict;
    if (!wanted || !report.refusals.empty()) continue;
    const bool processor = properties.deviceType == VK_PHYSICAL_DEVICE_TYPE_CPU;
    const std::array<uint64_t, 3> score{static_cast<uint64_t>(type_score(properties.deviceType)),
                                        processor ? report.subgroup_size : 0, report.memory_bytes};
    if (physical_device_ == VK_NULL_HANDLE || score > best) {
      best = score;
      physical_device_ = devices[i];
      properties_ = properties;
      report_ = std::move(report);
    }
  }
  if (physical_device_ == VK_NULL_HANDLE) {
    const std::string wanted = options.device.empty()
                                   ? "a usable Vulkan 1.2 device"
                                   : "a usable Vulkan device matching '" + options.device + "'";
    throw Error(Failure::Device, wanted, listing.empty() ? "no Vulkan device at all" : listing,
                matched ? "palpate devices, or installing mesa-vulkan-drivers, which runs on any processor"
                        : "an index or part of a name from palpate devices");
  }
  vkGetPhysicalDeviceMemoryProperties(physical_device_, &memory_);
  queue_family_ = *find_queue_family(physical_device_);
  // A float map of the largest frame is as many texels as it has pixels.
  storage_texels_ = !options.texel_buffers || properties_.limits.maxTexelBufferElements < kMaxPixels;
  const bool timestamps = properties_.limits.timestampComputeAndGraphics == VK_TRUE;
  timers_ = options.timers && !options.host_timers && timestamps;
  host_timers_ = options.host_timers || (options.timers && !timestamps);
  constexpr double kGpuLimit_s = 20, kProcessorLimit_s = 600;
  const double kind_limit_s = is_software() ? kProcessorLimit_s : kGpuLimit_s;
  const double limit_s = options.wait_limit_s > 0 ? options.wait_limit_s : kind_limit_s;
  wait_limit_ns_ = static_cast<uint64_t>(1e9 * limit_s);
}

void Context::create_device(const ContextOptions& options) {
  const float priority = 1;
  VkDeviceQueueCreateInfo queue{};
  queue.sType = VK_STRUCTURE_TYPE_DEVICE_QUEUE_CREATE_INFO;
  queue.queueFamilyIndex = queue_family_;
  queue.queueCount = 1;
  queue.pQueuePriorities = &priority;

  VkPhysicalDeviceSynchronization2Features synchronization{};
  synchronization.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_SYNCHRONIZATION_2_FEATURES;
  synchronization.synchronization2 = VK_TRUE;
  std::vector<const char*> extensions;
  const bool core = std::min(vulkan_version(options), properties_.apiVersion) >= VK_API_VERSION_1_3;
  if (!core) extensions.push_back(VK_KHR_SYNCHRONIZATION_2_EXTENSION_NAME);
  const bool pushes =
      options.push_descriptors && has_extension(physical_device_, VK_KHR_PUSH_DESCRIPTOR_EXTENSION_NAME);
  if (pushes) extensions.push_back(VK_KHR_PUSH_DESCRIPTOR_EXTENSION_NAME);
  if (options.presentation) extensions.push_back(VK_KHR_SWAPCHAIN_EXTENSION_NAME);
  const bool imports = can_import_host_memory(physical_device_);
  if (imports) extensions.push_back(VK_EXT_EXTERNAL_MEMORY_HOST_EXTENSION_NAME);

  VkPhysicalDevicePipelineExecutablePropertiesFeaturesKHR executables{};
  executables.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PIPELINE_EXECUTABLE_PROPERTIES_FEATURES_KHR;
  executables.pipelineExecutableInfo = VK_TRUE;
  statistics_ = options.statistics;
  on_kernel_ = options.on_kernel;
  if (statistics_) {
    extensions.push_back(VK_KHR_PIPELINE_EXECUTABLE_PROPERTIES_EXTENSION_NAME);
    synchronization.pNext = &executables;
  }

  VkPhysicalDeviceFeatures offered{}, features{};
  vkGetPhysicalDeviceFeatures(physical_device_, &offered);
  features.shaderFloat64 = offered.shaderFloat64;
  has_double_ = offered.shaderFloat64 == VK_TRUE;

  VkDeviceCreateInfo info{};
  info.sType = VK_STRUCTURE_TYPE_DEVICE_CREATE_INFO;
  info.pNext = &synchronization;
  info.queueCreateInfoCount = 1;
  info.pQueueCreateInfos = &queue;
  info.enabledExtensionCount = static_cast<uint32_t>(extensions.size());
  info.ppEnabledExtensionNames = extensions.data();
  info.pEnabledFeatures = &features;
  check(vkCreateDevice(physical_device_, &info, nullptr, &device_), "opening the device");
  vkGetDeviceQueue(device_, queue_family_, 0, &queue_);
  load_functions(core);
  if (pushes)
    push_descriptors_ = reinterpret_cast<PFN_vkCmdPushDescriptorSetKHR>(
        vkGetDeviceProcAddr(device_, "vkCmdPushDescriptorSetKHR"));
  if (!imports) return;
  host_pointer_properties_ = reinterpret_cast<PFN_vkGetMemoryHostPointerPropertiesEXT>(
      vkGetDeviceProcAddr(device_, "vkGetMemoryHostPointerPropertiesEXT"));
  VkPhysicalDeviceExternalMemoryHostPropertiesEXT host{};
  host.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_EXTERNAL_MEMORY_HOST_PROPERTIES_EXT;
  VkPhysicalDeviceProperties2 properties{};
  properties.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PROPERTIES_2;
  properties.pNext = &host;
  vkGetPhysicalDeviceProperties2(physical_device_, &properties);
  host_import_alignment_ = host.minImportedHostPointerAlignment;
}

void Context::load_functions(bool core) {
  const auto load = [&](auto& function, std::string name) {
    if (!core) name += "KHR";
    function = reinterpret_cast<std::remove_reference_t<decltype(function)>>(
        vkGetDeviceProcAddr(device_, name.c_str()));
  };
  load(queue_submit_, "vkQueueSubmit2");
  load(pipeline_barrier_, "vkCmdPipelineBarrier2");
  load(write_timestamp_, "vkCmdWriteTimestamp2");
}

uint32_t Context::host_pointer_types(const void* pointer) const {
  VkMemoryHostPointerPropertiesEXT found{};
  found.sType = VK_STRUCTURE_TYPE_MEMORY_HOST_POINTER_PROPERTIES_EXT;
  const VkResult result = host_pointer_properties_(
      device_, VK_EXTERNAL_MEMORY_HANDLE_TYPE_HOST_ALLOCATION_BIT_EXT, pointer, &found);
  return result == VK_SUCCESS ? found.memoryTypeBits : 0;
}

void Context::load_pipeline_cache() {
  const std::vector<char> data = read_cache(pipeline_cache_file(properties_));
  VkPipelineCacheCreateInfo info{};
  info.sType = VK_STRUCTURE_TYPE_PIPELINE_CACHE_CREATE_INFO;
  info.initialDataSize = data.size();
  info.pInitialData = data.data();
  if (vkCreatePipelineCache(device_, &info, nullptr, &pipeline_cache_) != VK_SUCCESS) {
    info.initialDataSize = 0;  // a damaged cache costs a recompilation, nothing else
    check(vkCreatePipelineCache(device_, &info, nullptr, &pipeline_cache_), "creating the pipeline cache");
  }
}

// Best effort: a cache that cannot be written only costs time at the next start.
void Context::save_pipeline_cache() const {
  size_t size = 0;
  if (vkGetPipelineCacheData(device_, pipeline_cache_, &size, nullptr) != VK_SUCCESS) return;
  std::vector<char> data(size);
  if (vkGetPipelineCacheData(device_, pipeline_cache_, &size, data.data()) != VK_SUCCESS) return;
  data.resize(size);
  std::ranges::copy(seal(data), std::back_inserter(data));
  const auto file = pipeline_cache_file(properties_);
  if (file.empty() || read_all(file) == data) return;
  std::error_code ignored;
  std::filesystem::create_directories(file.parent_path(), ignored);
  // The process's own temporary name, so that two programs that end together do not mix their files.
  auto temporary = file;
  temporary += "." + std::to_string(reinterpret_cast<uintptr_t>(this)) + ".tmp";
  {
    std::ofstream out(temporary, std::ios::binary);
    out.write(data.data(), std::ssize(data));
    if (!out) return;
  }
  std::filesystem::rename(temporary, file, ignored);
}

std::shared_ptr<const CompiledKernel> Context::compiled(
    const std::string& bytes, const std::function<std::shared_ptr<const CompiledKernel>()>& compile) {
  {
    const std::lock_guard lock(compiled_mutex_);
    if (const auto found = compiled_.find(bytes); found != compiled_.end()) return found->second;
  }
  std::shared_ptr<const CompiledKernel> made = compile();  // others may compile meanwhile
  constexpr size_t kMostKept = 256;                        // all kernels of a run are some 60
  const std::lock_guard lock(compiled_mutex_);
  if (compiled_.size() >= kMostKept) drop_unused();
  return compiled_.try_emplace(bytes, std::move(made)).first->second;
}

void Context::drop_unused_kernels() {
  const std::lock_guard lock(compiled_mutex_);
  drop_unused();
}

void Context::drop_unused() {
  std::erase_if(compiled_, [](const auto& kept) { return kept.second.use_count() == 1; });
}

Stops stops() {
  return counted;
}

void Context::submit(const VkSubmitInfo2& info, VkFence fence) {
  ++counted.submits;
  const TraceSpan span("submit");
  const std::lock_guard lock(queue_mutex_);
  check(queue_submit_(queue_, 1, &info, fence), "submitting work");
}

VkResult Context::present(const VkPresentInfoKHR& info) {
  const std::lock_guard lock(queue_mutex_);
  return vkQueuePresentKHR(queue_, &info);
}

void Context::wait(VkFence fence, const char* what) {
  ++counted.waits;
  const TraceSpan span("device wait");
  if (!hung_) {
    const VkResult result = vkWaitForFences(device_, 1, &fence, VK_TRUE, wait_limit_ns_);
    if (result != VK_TIMEOUT) return check(result, what);
    hung_ = true;
  }
  throw DeviceLost(
      what, text("none after %.3g s: the device hangs", 1e-9 * static_cast<double>(wait_limit_ns_)),
      "starting again; more time with PALPATE_WAIT_LIMIT_S, or another device (palpate devices)");
}

void Context::settle(VkFence fence) noexcept {
  if (!hung_ && vkWaitForFences(device_, 1, &fence, VK_TRUE, wait_limit_ns_) == VK_TIMEOUT) hung_ = true;
}

void Context::wait_idle() {
  if (hung_) return;
  const std::lock_guard lock(queue_mutex_);
  vkDeviceWaitIdle(device_);
}

std::optional<uint32_t> Context::find_memory_type(uint32_t type_bits, VkMemoryPropertyFlags wanted) const {
  for (uint32_t i = 0; i < memory_.memoryTypeCount; ++i)
    if ((type_bits & (1u << i)) && (memory_.memoryTypes[i].propertyFlags & wanted) == wanted) return i;
  return std::nullopt;
}

uint32_t Context::memory_type(uint32_t type_bits, VkMemoryPropertyFlags wanted,
                              VkMemoryPropertyFlags preferred) const {
  for (const VkMemoryPropertyFlags flags : {wanted | preferred, wanted})
    if (const auto type = find_memory_type(type_bits, flags)) return *type;
  throw Error(Failure::Device, "a suitable kind of device memory", "none",
              "another device (palpate devices)");
}

void Context::set_name(VkObjectType type, uint64_t handle, const std::string& name) const {
  if (!set_name_) return;
  VkDebugUtilsObjectNameInfoEXT info{};
  info.sType = VK_STRUCTURE_TYPE_DEBUG_UTILS_OBJECT_NAME_INFO_EXT;
  info.objectType = type;
  info.objectHandle = handle;
  info.pObjectName = name.c_str();
  set_name_(device_, &info);
}

void Context::begin_label(VkCommandBuffer cmd, const char* name) const {
  if (!begin_label_) return;
  VkDebugUtilsLabelEXT label{};
  label.sType = VK_STRUCTURE_TYPE_DEBUG_UTILS_LABEL_EXT;
  label.pLabelName = name;
  begin_label_(cmd, &label);
}

void Context::end_label(VkCommandBuffer cmd) const {
  if (end_label_) end_label_(cmd);
}

std::vector<std::string> Context::validation_messages() const {
  const std::lock_guard lock(message_mutex_);
  return messages_;
}

}  // namespace palpate::gpu
