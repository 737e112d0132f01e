// Hands buffers to shaders: pushed into the command buffer, or by plain descriptor sets where a device
// cannot.
#pragma once

#include <vulkan/vulkan.h>

#include <cstdint>
#include <span>
#include <vector>

namespace palpate::gpu {

class Context;

/// A kernel binds at most as many buffers.
inline constexpr uint32_t kMaxBindings = 12;

/// The sets of one command buffer, from pools that grow while it is first recorded and are used again each
/// time after. Without pools where the device pushes descriptors.
class DescriptorSets {
 public:
  DescriptorSets() = default;
  explicit DescriptorSets(Context& context) : context_(&context) {}
  ~DescriptorSets();
  DescriptorSets(DescriptorSets&& other) noexcept { swap(other); }
  DescriptorSets& operator=(DescriptorSets&& other) noexcept {
    swap(other);
    return *this;
  }

  /// Binds what `writes` describe (texel and storage buffers; their dstSet is set here) as set 0 for the
  /// commands recorded next. Throws Error(Failure::Device) when memory runs out.
  void bind(VkCommandBuffer cmd, VkPipelineBindPoint point, VkPipelineLayout layout,
            VkDescriptorSetLayout set_layout, std::span<VkWriteDescriptorSet> writes);
  /// All sets are free again: the command buffer is recorded anew, or has finished.
  void reset();
  size_t pools() const { return pools_.size(); }

 private:
  void swap(DescriptorSets& other) noexcept;
  VkDescriptorSet take(VkDescriptorSetLayout layout);
  void add_pool();

  Context* context_ = nullptr;
  std::vector<VkDescriptorPool> pools_;
  size_t taken_ = 0;  ///< sets in use
};

}  // namespace palpate::gpu
