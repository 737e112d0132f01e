#include "engine/gpu/descriptor_sets.h"

#include <array>
#include <utility>

#include "engine/gpu/context.h"

namespace palpate::gpu {
namespace {

// Half a frame's dispatches; a kernel's bindings may all be of one kind.
constexpr uint32_t kSets = 32;

}  // namespace

DescriptorSets::~DescriptorSets() {
  if (context_ && context_->hung()) return;
  for (const VkDescriptorPool pool : pools_) vkDestroyDescriptorPool(context_->device(), pool, nullptr);
}

void DescriptorSets::swap(DescriptorSets& other) noexcept {
  std::swap(context_, other.context_);
  std::swap(pools_, other.pools_);
  std::swap(taken_, other.taken_);
}

void DescriptorSets::reset() {
  for (size_t i = 0; i * kSets < taken_; ++i) vkResetDescriptorPool(context_->device(), pools_[i], 0);
  taken_ = 0;
}

void DescriptorSets::add_pool() {
  const std::array<VkDescriptorPoolSize, 3> sizes{
      {{VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, kSets * kMaxBindings},
       {VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER, kSets * kMaxBindings},
       {VK_DESCRIPTOR_TYPE_UNIFORM_TEXEL_BUFFER, kSets * kMaxBindings}}};
  VkDescriptorPoolCreateInfo info{};
  info.sType = VK_STRUCTURE_TYPE_DESCRIPTOR_POOL_CREATE_INFO;
  info.maxSets = kSets;
  info.poolSizeCount = static_cast<uint32_t>(sizes.size());
  info.pPoolSizes = sizes.data();
  pools_.reserve(pools_.size() + 1);
  VkDescriptorPool pool = VK_NULL_HANDLE;
  check(vkCreateDescriptorPool(context_->device(), &info, nullptr, &pool), "a pool of descriptor sets");
  pools_.push_back(pool);
}

VkDescriptorSet DescriptorSets::take(VkDescriptorSetLayout layout) {
  const size_t pool = taken_ / kSets;
  if (pool == pools_.size()) add_pool();
  VkDescriptorSetAllocateInfo info{};
  info.sType = VK_STRUCTURE_TYPE_DESCRIPTOR_SET_ALLOCATE_INFO;
  info.descriptorPool = pools_[pool];
  info.descriptorSetCount = 1;
  info.pSetLayouts = &layout;
  VkDescriptorSet set = VK_NULL_HANDLE;
  check(vkAllocateDescriptorSets(context_->device(), &info, &set), "a descriptor set");
  ++taken_;
  return set;
}

void DescriptorSets::bind(VkCommandBuffer cmd, VkPipelineBindPoint point, VkPipelineLayout layout,
                          VkDescriptorSetLayout set_layout, std::span<VkWriteDescriptorSet> writes) {
  const auto count = static_cast<uint32_t>(writes.size());
  if (const auto push = context_->push_descriptors()) {
    push(cmd, point, layout, 0, count, writes.data());
    return;
  }
  const VkDescriptorSet set = take(set_layout);
  for (VkWriteDescriptorSet& write : writes) write.dstSet = set;
  vkUpdateDescriptorSets(context_->device(), count, writes.data(), 0, nullptr);
  vkCmdBindDescriptorSets(cmd, point, layout, 0, 1, &set, 0, nullptr);
}

}  // namespace palpate::gpu
