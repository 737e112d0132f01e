// The Vulkan device: its choice, why others were refused, and the validation layer's messages.
#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <unordered_map>
#include <vector>

#include "engine/gpu/physical_device.h"

namespace palpate {
class Device;
}

namespace palpate::gpu {

/// A shader in two forms with the same bindings: texels are read from texel buffers, or from storage buffers
/// (Context::storage_texels).
struct Spirv {
  std::span<const uint32_t> texels;
  std::span<const uint32_t> storage;
};

struct CompiledKernel;

class Context {
 public:
  /// With what the environment adds (with_environment). Throws Error(Failure::Device) listing every device
  /// and why it was refused.
  explicit Context(const ContextOptions& options);
  ~Context();
  /// Closes the device, if it can still be closed, and opens the best one that the options allow, as the
  /// constructor did. Nothing made with the context may be left. Throws Error(Failure::Device).
  void reopen();
  Context(const Context&) = delete;
  Context& operator=(const Context&) = delete;

  /// The same device, as the public interface takes it.
  operator Device&() { return *handle_; }

  VkInstance instance() const { return instance_; }
  VkPhysicalDevice physical_device() const { return physical_device_; }
  VkDevice device() const { return device_; }
  VkQueue queue() const { return queue_; }
  uint32_t queue_family() const { return queue_family_; }
  VkPipelineCache pipeline_cache() const { return pipeline_cache_; }
  const VkPhysicalDeviceProperties& properties() const { return properties_; }
  const DeviceReport& report() const { return report_; }
  /// A CPU driver (lavapipe): device memory is host memory, and views adapt to what it can draw.
  bool is_software() const { return properties_.deviceType == VK_PHYSICAL_DEVICE_TYPE_CPU; }
  /// ContextOptions::kernels.
  const std::string& kernels() const { return options_.kernels; }
  /// Kernels may compute in double precision (shaderFloat64).
  bool has_double() const { return has_double_; }
  bool timers() const { return timers_; }
  bool host_timers() const { return host_timers_; }  ///< also where the device has no timestamps

  /// Submits to the one queue; safe from several threads.
  void submit(const VkSubmitInfo2& info, VkFence fence);
  /// Presents on the one queue; safe from several threads. Returns the swapchain's verdict.
  VkResult present(const VkPresentInfoKHR& info);
  /// Returns at once where the device hangs.
  void wait_idle();
  /// Waits for the fence of a submission, no longer than ContextOptions::wait_limit_s. Throws DeviceLost
  /// where the device is lost or does not finish in time.
  void wait(VkFence fence, const char* what);
  /// As wait, for destructors: the error of a lost device is of no use there.
  void settle(VkFence fence) noexcept;
  /// A wait has passed its limit: the device may still be at work with what it was given, so none of it may
  /// be destroyed.
  bool hung() const { return hung_; }

  /// Index of a memory type with `wanted` flags (and, if there is one, `preferred` too). Throws
  /// Error(Failure::Device).
  uint32_t memory_type(uint32_t type_bits, VkMemoryPropertyFlags wanted,
                       VkMemoryPropertyFlags preferred) const;
  std::optional<uint32_t> find_memory_type(uint32_t type_bits, VkMemoryPropertyFlags wanted) const;

  VkMemoryPropertyFlags memory_flags(uint32_t type) const { return memory_.memoryTypes[type].propertyFlags; }

  /// Names an object for debuggers and validation messages.
  void set_name(VkObjectType type, uint64_t handle, const std::string& name) const;
  /// Begin and end of a debug label; no-ops without the validation option.
  void begin_label(VkCommandBuffer cmd, const char* name) const;
  void end_label(VkCommandBuffer cmd) const;
  bool statistics() const { return statistics_; }  ///< ContextOptions::statistics
  void tell_of(const Shader& shader, const KernelInterface& interface) const {
    if (on_kernel_) on_kernel_(shader, interface);
  }
  void tell_of(const Dispatch& dispatch) const {
    if (options_.on_dispatch) options_.on_dispatch(dispatch);
  }
  /// Null where the device has none: then there are plain descriptor sets (DescriptorSets).
  PFN_vkCmdPushDescriptorSetKHR push_descriptors() const { return push_descriptors_; }
  /// Kernels read texels from storage buffers: the device's texel buffers are too small for a frame.
  bool storage_texels() const { return storage_texels_; }
  VkDescriptorType texel_descriptor() const {
    return storage_texels_ ? VK_DESCRIPTOR_TYPE_STORAGE_BUFFER : VK_DESCRIPTOR_TYPE_UNIFORM_TEXEL_BUFFER;
  }
  /// The kernel that was compiled from the same bytes (SPIR-V and interface), or else what `compile` makes of
  /// them: kept as long as the device, since drivers compile each as if it were the first. Safe from several
  /// threads.
  std::shared_ptr<const CompiledKernel> compiled(
      const std::string& bytes, const std::function<std::shared_ptr<const CompiledKernel>()>& compile);
  /// Frees the compiled kernels that nothing uses.
  void drop_unused_kernels();
  /// The form of a shader that this device runs.
  std::span<const uint32_t> form(const Spirv& spirv) const {
    return storage_texels_ ? spirv.storage : spirv.texels;
  }

  // Core in Vulkan 1.3, of VK_KHR_synchronization2 before.
  void pipeline_barrier(VkCommandBuffer cmd, const VkDependencyInfo& dependency) const {
    pipeline_barrier_(cmd, &dependency);
  }
  void write_timestamp(VkCommandBuffer cmd, VkPipelineStageFlags2 stage, VkQueryPool pool,
                       uint32_t query) const {
    write_timestamp_(cmd, stage, pool, query);
  }

  /// Bytes to which address and length of memory that the device reads in place must be aligned; 0: the
  /// device cannot (VK_EXT_external_memory_host).
  uint64_t host_import_alignment() const { return host_import_alignment_; }
  /// Memory types that host memory at `pointer` can be imported as; 0: none.
  uint32_t host_pointer_types(const void* pointer) const;

  /// Warnings and errors of the validation layer so far (empty without the option).
  std::vector<std::string> validation_messages() const;

 private:
  void open();
  void create_instance(const ContextOptions& options);
  void choose_device(const ContextOptions& options);
  void load_functions(bool core);
  void create_device(const ContextOptions& options);
  void load_pipeline_cache();
  void save_pipeline_cache() const;
  static VKAPI_ATTR VkBool32 VKAPI_CALL on_message(VkDebugUtilsMessageSeverityFlagBitsEXT severity,
                                                   VkDebugUtilsMessageTypeFlagsEXT type,
                                                   const VkDebugUtilsMessengerCallbackDataEXT* data,
                                                   void* self);

  void close();
  void drop_unused();  ///< under compiled_mutex_

  ContextOptions options_;
  std::unique_ptr<Device> handle_;
  uint64_t wait_limit_ns_ = 0;
  std::atomic<bool> hung_{false};
  VkInstance instance_ = VK_NULL_HANDLE;
  VkDebugUtilsMessengerEXT messenger_ = VK_NULL_HANDLE;
  VkPhysicalDevice physical_device_ = VK_NULL_HANDLE;
  VkDevice device_ = VK_NULL_HANDLE;
  VkQueue queue_ = VK_NULL_HANDLE;
  uint32_t queue_family_ = 0;
  VkPipelineCache pipeline_cache_ = VK_NULL_HANDLE;
  VkPhysicalDeviceProperties properties_{};
  VkPhysicalDeviceMemoryProperties memory_{};
  DeviceReport report_;
  bool has_double_ = false;
  bool timers_ = false;
  bool host_timers_ = false;
  uint64_t host_import_alignment_ = 0;
  bool storage_texels_ = false;
  bool statistics_ = false;
  std::function<void(const Shader&, const KernelInterface&)> on_kernel_;
  PFN_vkQueueSubmit2 queue_submit_ = nullptr;
  PFN_vkCmdPipelineBarrier2 pipeline_barrier_ = nullptr;
  PFN_vkCmdWriteTimestamp2 write_timestamp_ = nullptr;
  PFN_vkCmdPushDescriptorSetKHR push_descriptors_ = nullptr;
  PFN_vkGetMemoryHostPointerPropertiesEXT host_pointer_properties_ = nullptr;
  PFN_vkSetDebugUtilsObjectNameEXT set_name_ = nullptr;
  PFN_vkCmdBeginDebugUtilsLabelEXT begin_label_ = nullptr;
  PFN_vkCmdEndDebugUtilsLabelEXT end_label_ = nullptr;
  std::mutex queue_mutex_;
  std::mutex compiled_mutex_;
  std::unordered_map<std::string, std::shared_ptr<const CompiledKernel>> compiled_;
  mutable std::mutex message_mutex_;
  std::vector<std::string> messages_;
};

/// palpate's folder in the user's cache (XDG_CACHE_HOME or ~/.cache); empty: there is none. May not exist
/// yet.
std::filesystem::path cache_folder();

}  // namespace palpate::gpu
