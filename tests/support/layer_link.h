// Where a Vulkan layer finds the one below it.
#pragma once

#include <vulkan/vk_layer.h>
#include <vulkan/vulkan.h>

/// The link that the loader left in the chain of a create info; null without one.
template <typename Info>
Info* link_info(const void* chain, VkStructureType type) {
  for (auto* at = static_cast<const VkBaseInStructure*>(chain); at != nullptr; at = at->pNext) {
    auto* info = const_cast<Info*>(reinterpret_cast<const Info*>(at));
    if (at->sType == type && info->function == VK_LAYER_LINK_INFO) return info;
  }
  return nullptr;
}
