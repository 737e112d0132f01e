#include "engine/gpu/buffer.h"

#include <algorithm>
#include <optional>

#include "engine/gpu/context.h"
#include "palpate/error.h"

namespace palpate::gpu {

// Built on the default constructor, so that the destructor frees what was made before a failure.
DeviceBuffer::DeviceBuffer(Context& context, const std::string& name, uint64_t bytes, Memory memory)
    : DeviceBuffer() {
  context_ = &context;
  bytes_ = std::max<uint64_t>(bytes, 16);
  VkBufferCreateInfo info{};
  info.sType = VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO;
  info.size = (bytes_ + 15) / 16 * 16;  // whole texels, also of bytes that are read as words
  info.usage = VK_BUFFER_USAGE_STORAGE_BUFFER_BIT | VK_BUFFER_USAGE_UNIFORM_TEXEL_BUFFER_BIT |
               VK_BUFFER_USAGE_UNIFORM_BUFFER_BIT | VK_BUFFER_USAGE_INDEX_BUFFER_BIT |
               VK_BUFFER_USAGE_INDIRECT_BUFFER_BIT | VK_BUFFER_USAGE_TRANSFER_SRC_BIT |
               VK_BUFFER_USAGE_TRANSFER_DST_BIT;
  check(vkCreateBuffer(context.device(), &info, nullptr, &buffer_), ("a buffer for " + name).c_str());

  VkMemoryRequirements needs{};
  vkGetBufferMemoryRequirements(context.device(), buffer_, &needs);
  constexpr auto kVisible = VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT;
  uint32_t type = 0;
  if (memory == Memory::Device) {
    type = context.memory_type(needs.memoryTypeBits, VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT,
                               context.is_software() ? kVisible : 0);
  } else if (memory == Memory::Constant) {
    type = context.memory_type(needs.memoryTypeBits, kVisible,
                               VK_MEMORY_PROPERTY_HOST_COHERENT_BIT | VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT);
  } else if (memory == Memory::Upload) {
    type = context.memory_type(needs.memoryTypeBits, kVisible, VK_MEMORY_PROPERTY_HOST_COHERENT_BIT);
  } else {
    type = context.memory_type(needs.memoryTypeBits, kVisible, VK_MEMORY_PROPERTY_HOST_CACHED_BIT);
  }

  VkMemoryAllocateInfo allocation{};
  allocation.sType = VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO;
  allocation.allocationSize = needs.size;
  allocation.memoryTypeIndex = type;
  VkResult result = vkAllocateMemory(context.device(), &allocation, nullptr, &memory_);
  if (result != VK_SUCCESS &&
      memory == Memory::Constant) {  // cards may map a small part of their memory only
    allocation.memoryTypeIndex =
        context.memory_type(needs.memoryTypeBits, kVisible, VK_MEMORY_PROPERTY_HOST_COHERENT_BIT);
    result = vkAllocateMemory(context.device(), &allocation, nullptr, &memory_);
  }
  if (result != VK_SUCCESS) {
    throw Error(Failure::Device, std::to_string(needs.size >> 10) + " KiB of device memory for " + name,
                "not enough", "a smaller frame or crop, or another device (palpate devices)");
  }
  const VkMemoryPropertyFlags flags = context.memory_flags(allocation.memoryTypeIndex);
  coherent_ = (flags & VK_MEMORY_PROPERTY_HOST_COHERENT_BIT) != 0;
  check(vkBindBufferMemory(context.device(), buffer_, memory_, 0), "binding buffer memory");
  if (flags & kVisible)
    check(vkMapMemory(context.device(), memory_, 0, VK_WHOLE_SIZE, 0, &mapped_), "mapping memory");
  context.set_name(VK_OBJECT_TYPE_BUFFER, reinterpret_cast<uint64_t>(buffer_), name);
}

DeviceBuffer DeviceBuffer::imported(Context& context, const std::string& name, const uint8_t* memory,
                                    uint64_t bytes) {
  constexpr auto kHost = VK_EXTERNAL_MEMORY_HANDLE_TYPE_HOST_ALLOCATION_BIT_EXT;
  const uint64_t alignment = context.host_import_alignment();
  if (alignment == 0 || bytes == 0 || bytes % alignment != 0 ||
      reinterpret_cast<uintptr_t>(memory) % alignment != 0)
    return {};
  DeviceBuffer buffer;
  buffer.context_ = &context;
  buffer.bytes_ = bytes;
  VkExternalMemoryBufferCreateInfo external{};
  external.sType = VK_STRUCTURE_TYPE_EXTERNAL_MEMORY_BUFFER_CREATE_INFO;
  external.handleTypes = kHost;
  VkBufferCreateInfo info{};
  info.sType = VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO;
  info.pNext = &external;
  info.size = bytes;
  info.usage = kImportUsage;
  if (vkCreateBuffer(context.device(), &info, nullptr, &buffer.buffer_) != VK_SUCCESS) return {};
  VkMemoryRequirements needs{};
  vkGetBufferMemoryRequirements(context.device(), buffer.buffer_, &needs);
  // Host writes must be visible without a flush: the pages are not mapped through Vulkan.
  const std::optional<uint32_t> type =
      context.find_memory_type(needs.memoryTypeBits & context.host_pointer_types(memory),
                               VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_COHERENT_BIT);
  if (!type || needs.size > bytes) return {};
  VkImportMemoryHostPointerInfoEXT import{};
  import.sType = VK_STRUCTURE_TYPE_IMPORT_MEMORY_HOST_POINTER_INFO_EXT;
  import.handleType = kHost;
  import.pHostPointer = const_cast<uint8_t*>(memory);
  VkMemoryAllocateInfo allocation{};
  allocation.sType = VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO;
  allocation.pNext = &import;
  allocation.allocationSize = bytes;
  allocation.memoryTypeIndex = *type;
  if (vkAllocateMemory(context.device(), &allocation, nullptr, &buffer.memory_) != VK_SUCCESS ||
      vkBindBufferMemory(context.device(), buffer.buffer_, buffer.memory_, 0) != VK_SUCCESS)
    return {};
  context.set_name(VK_OBJECT_TYPE_BUFFER, reinterpret_cast<uint64_t>(buffer.buffer_), name);
  return buffer;
}

DeviceBuffer::~DeviceBuffer() {
  if (!context_ || context_->hung()) return;
  vkDestroyBuffer(context_->device(), buffer_, nullptr);
  vkFreeMemory(context_->device(), memory_, nullptr);
}

void DeviceBuffer::swap(DeviceBuffer& other) noexcept {
  std::swap(context_, other.context_);
  std::swap(buffer_, other.buffer_);
  std::swap(memory_, other.memory_);
  std::swap(bytes_, other.bytes_);
  std::swap(mapped_, other.mapped_);
  std::swap(coherent_, other.coherent_);
}

void DeviceBuffer::flush() const {
  if (coherent_ || !mapped_) return;
  const VkMappedMemoryRange range{VK_STRUCTURE_TYPE_MAPPED_MEMORY_RANGE, nullptr, memory_, 0, VK_WHOLE_SIZE};
  check(vkFlushMappedMemoryRanges(context_->device(), 1, &range), "flushing memory");
}

void DeviceBuffer::invalidate() const {
  if (coherent_ || !mapped_) return;
  const VkMappedMemoryRange range{VK_STRUCTURE_TYPE_MAPPED_MEMORY_RANGE, nullptr, memory_, 0, VK_WHOLE_SIZE};
  check(vkInvalidateMappedMemoryRanges(context_->device(), 1, &range), "invalidating memory");
}

TexelView::TexelView(Context& context, const DeviceBuffer& buffer, VkFormat format)
    : context_(&context), buffer_(buffer.handle()) {
  uint32_t texel_bytes = 4;
  if (format == VK_FORMAT_R8_UINT) texel_bytes = 1;
  if (format == VK_FORMAT_R16_UINT) texel_bytes = 2;
  if (format == VK_FORMAT_R32G32B32A32_UINT || format == VK_FORMAT_R32G32B32A32_SFLOAT) texel_bytes = 16;
  if (format == VK_FORMAT_R32G32_UINT || format == VK_FORMAT_R32G32_SFLOAT) texel_bytes = 8;
  const uint64_t texels = buffer.bytes() / texel_bytes;
  bytes_ = texels * texel_bytes;
  element_bytes_ = std::max(texel_bytes, 4u);
  const uint64_t limit = context.properties().limits.maxTexelBufferElements;
  if (texels > limit && context.storage_texels()) return;
  if (texels > limit) {
    throw Error(Failure::Device, std::to_string(texels) + " texels in one buffer",
                "a device limit of " + std::to_string(limit), "a smaller frame or crop, or another device");
  }
  VkBufferViewCreateInfo info{};
  info.sType = VK_STRUCTURE_TYPE_BUFFER_VIEW_CREATE_INFO;
  info.buffer = buffer.handle();
  info.format = format;
  info.range = bytes_;
  check(vkCreateBufferView(context.device(), &info, nullptr, &view_), "a texel view");
}

TexelView::~TexelView() {
  if (context_ && !context_->hung()) vkDestroyBufferView(context_->device(), view_, nullptr);
}

}  // namespace palpate::gpu
