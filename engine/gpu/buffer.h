// A buffer with its memory: move-only, freed with its owner. Host-visible kinds stay mapped.
#pragma once

#include <vulkan/vulkan.h>

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <utility>

namespace palpate::gpu {

class Context;

enum class Memory {
  Device,    ///< fastest for kernels; mapped only where the device shares memory with the host
  Upload,    ///< written by the host, read by kernels once or copied
  Constant,  ///< written once by the host, read by kernels again and again: near them where there is room
  Readback,  ///< written by kernels or copies, read by the host (cached)
};

class DeviceBuffer {
 public:
  DeviceBuffer() = default;
  /// Storage, texel, uniform, index and transfer use. Throws Error(Failure::Device) naming `name` when memory
  /// runs out.
  DeviceBuffer(Context& context, const std::string& name, uint64_t bytes, Memory memory);
  /// A buffer that is memory which the host has mapped already: kernels read it in place, through texel
  /// views. Empty where the device does not take it: no such feature, address or length not aligned as it
  /// wants, or memory that cannot be pinned. The memory must stay mapped as long as the buffer lives.
  static DeviceBuffer imported(Context& context, const std::string& name, const uint8_t* memory,
                               uint64_t bytes);
  ~DeviceBuffer();
  DeviceBuffer(DeviceBuffer&& other) noexcept { swap(other); }
  DeviceBuffer& operator=(DeviceBuffer&& other) noexcept {
    swap(other);
    return *this;
  }

  VkBuffer handle() const { return buffer_; }
  uint64_t bytes() const { return bytes_; }
  bool mapped() const { return mapped_ != nullptr; }
  explicit operator bool() const { return buffer_ != VK_NULL_HANDLE; }

  /// The mapped memory as an array of T; only where `mapped()`.
  template <typename T>
  std::span<T> as() const {
    return {static_cast<T*>(mapped_), static_cast<size_t>(bytes_ / sizeof(T))};
  }

  /// Makes host writes visible to the device, and device writes to the host (no-ops on coherent memory).
  void flush() const;
  void invalidate() const;

 private:
  void swap(DeviceBuffer& other) noexcept;

  Context* context_ = nullptr;
  VkBuffer buffer_ = VK_NULL_HANDLE;
  VkDeviceMemory memory_ = VK_NULL_HANDLE;
  uint64_t bytes_ = 0;
  void* mapped_ = nullptr;
  bool coherent_ = true;
};

/// A typed window on a buffer, read by kernels with texelFetch: on lavapipe five times faster than a storage
/// buffer.
class TexelView {
 public:
  TexelView() = default;
  /// Throws Error(Failure::Device) where the device's limit on texels is too small for the buffer.
  TexelView(Context& context, const DeviceBuffer& buffer, VkFormat format);
  ~TexelView();
  TexelView(TexelView&& other) noexcept { swap(other); }
  TexelView& operator=(TexelView&& other) noexcept {
    swap(other);
    return *this;
  }
  /// Null where kernels read texels from storage buffers and the device's texel buffers are too small.
  VkBufferView handle() const { return view_; }
  VkBuffer buffer() const { return buffer_; }  ///< that it is a window on
  uint64_t bytes() const { return bytes_; }
  /// Size of an element of the kernel's array that holds the texels: one texel, or a word of several.
  uint32_t element_bytes() const { return element_bytes_; }

 private:
  void swap(TexelView& other) noexcept {
    std::swap(context_, other.context_);
    std::swap(buffer_, other.buffer_);
    std::swap(bytes_, other.bytes_);
    std::swap(element_bytes_, other.element_bytes_);
    std::swap(view_, other.view_);
  }
  Context* context_ = nullptr;
  VkBuffer buffer_ = VK_NULL_HANDLE;
  uint64_t bytes_ = 0;
  uint32_t element_bytes_ = 0;
  VkBufferView view_ = VK_NULL_HANDLE;
};

}  // namespace palpate::gpu
