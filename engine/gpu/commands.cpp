#include "engine/gpu/commands.h"

#include <cassert>
#include <utility>

#include "engine/gpu/buffer.h"
#include "engine/gpu/context.h"
#include "engine/gpu/kernel.h"

namespace palpate::gpu {

Commands::Commands(Context& context) : context_(&context) {
  VkCommandPoolCreateInfo pool{};
  pool.sType = VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO;
  pool.flags = VK_COMMAND_POOL_CREATE_RESET_COMMAND_BUFFER_BIT;
  pool.queueFamilyIndex = context.queue_family();
  check(vkCreateCommandPool(context.device(), &pool, nullptr, &pool_), "a command pool");
  VkCommandBufferAllocateInfo buffer{};
  buffer.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO;
  buffer.commandPool = pool_;
  buffer.level = VK_COMMAND_BUFFER_LEVEL_PRIMARY;
  buffer.commandBufferCount = 1;
  check(vkAllocateCommandBuffers(context.device(), &buffer, &buffer_), "a command buffer");
  VkFenceCreateInfo fence{};
  fence.sType = VK_STRUCTURE_TYPE_FENCE_CREATE_INFO;
  fence.flags = VK_FENCE_CREATE_SIGNALED_BIT;
  check(vkCreateFence(context.device(), &fence, nullptr, &fence_), "a fence");
  if (context.timers()) {
    VkQueryPoolCreateInfo queries{};
    queries.sType = VK_STRUCTURE_TYPE_QUERY_POOL_CREATE_INFO;
    queries.queryType = VK_QUERY_TYPE_TIMESTAMP;
    queries.queryCount = 2 * kMaxScopes;
    check(vkCreateQueryPool(context.device(), &queries, nullptr, &queries_), "timers");
  }
}

Commands::~Commands() {
  if (!context_) return;
  vkWaitForFences(context_->device(), 1, &fence_, VK_TRUE, UINT64_MAX);
  if (queries_) vkDestroyQueryPool(context_->device(), queries_, nullptr);
  vkDestroyFence(context_->device(), fence_, nullptr);
  vkDestroyCommandPool(context_->device(), pool_, nullptr);
}

void Commands::swap(Commands& other) noexcept {
  std::swap(context_, other.context_);
  std::swap(pool_, other.pool_);
  std::swap(buffer_, other.buffer_);
  std::swap(fence_, other.fence_);
  std::swap(queries_, other.queries_);
  std::swap(scopes_, other.scopes_);
}

void Commands::begin() {
  VkCommandBufferBeginInfo info{};
  info.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO;
  check(vkBeginCommandBuffer(buffer_, &info), "recording commands");
  scopes_.clear();
  if (queries_) vkCmdResetQueryPool(buffer_, queries_, 0, 2 * kMaxScopes);
  barrier();  // frames share scratch memory: wait for what earlier submissions still write or read
}

void Commands::end() {
  check(vkEndCommandBuffer(buffer_), "recording commands");
}

void Commands::submit() {
  check(vkResetFences(context_->device(), 1, &fence_), "resetting a fence");
  VkCommandBufferSubmitInfo buffer{};
  buffer.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_SUBMIT_INFO;
  buffer.commandBuffer = buffer_;
  VkSubmitInfo2 info{};
  info.sType = VK_STRUCTURE_TYPE_SUBMIT_INFO_2;
  info.commandBufferInfoCount = 1;
  info.pCommandBufferInfos = &buffer;
  context_->submit(info, fence_);
}

bool Commands::finished() const {
  const VkResult result = vkGetFenceStatus(context_->device(), fence_);
  if (result == VK_NOT_READY) return false;
  check(result, "a finished frame");
  return true;
}

void Commands::wait() const {
  check(vkWaitForFences(context_->device(), 1, &fence_, VK_TRUE, UINT64_MAX), "a finished frame");
}

void Commands::dispatch(const Kernel& kernel, std::span<const Argument> arguments, const void* push,
                        std::array<uint32_t, 3> groups) {
  constexpr size_t kMaxArguments = 12;
  const KernelInterface& interface = kernel.interface();
  assert(arguments.size() == interface.bindings.size() && arguments.size() <= kMaxArguments);
  std::array<VkDescriptorBufferInfo, kMaxArguments> buffers{};
  std::array<VkBufferView, kMaxArguments> views{};
  std::array<VkWriteDescriptorSet, kMaxArguments> writes{};
  uint32_t i = 0;
  for (const Argument& argument : arguments) {
    VkWriteDescriptorSet& write = writes[i];
    write.sType = VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET;
    write.dstBinding = i;
    write.descriptorCount = 1;
    if (interface.bindings[i] == Binding::Texels) {
      views[i] = std::get<const TexelView*>(argument)->handle();
      write.descriptorType = VK_DESCRIPTOR_TYPE_UNIFORM_TEXEL_BUFFER;
      write.pTexelBufferView = &views[i];
    } else {
      buffers[i] = {std::get<const DeviceBuffer*>(argument)->handle(), 0, VK_WHOLE_SIZE};
      write.descriptorType = VK_DESCRIPTOR_TYPE_STORAGE_BUFFER;
      write.pBufferInfo = &buffers[i];
    }
    ++i;
  }
  vkCmdBindPipeline(buffer_, VK_PIPELINE_BIND_POINT_COMPUTE, kernel.pipeline());
  context_->push_descriptors()(buffer_, VK_PIPELINE_BIND_POINT_COMPUTE, kernel.layout(), 0, i, writes.data());
  if (interface.push_bytes) {
    vkCmdPushConstants(buffer_, kernel.layout(), VK_SHADER_STAGE_COMPUTE_BIT, 0, interface.push_bytes, push);
  }
  vkCmdDispatch(buffer_, groups[0], groups[1], groups[2]);
}

void Commands::copy(const DeviceBuffer& from, const DeviceBuffer& to, uint64_t bytes) {
  const VkBufferCopy region{0, 0, bytes};
  vkCmdCopyBuffer(buffer_, from.handle(), to.handle(), 1, &region);
}

namespace {
void memory_barrier(VkCommandBuffer buffer, VkPipelineStageFlags2 from, VkAccessFlags2 from_access,
                    VkPipelineStageFlags2 to, VkAccessFlags2 to_access) {
  VkMemoryBarrier2 barrier{};
  barrier.sType = VK_STRUCTURE_TYPE_MEMORY_BARRIER_2;
  barrier.srcStageMask = from;
  barrier.srcAccessMask = from_access;
  barrier.dstStageMask = to;
  barrier.dstAccessMask = to_access;
  VkDependencyInfo dependency{};
  dependency.sType = VK_STRUCTURE_TYPE_DEPENDENCY_INFO;
  dependency.memoryBarrierCount = 1;
  dependency.pMemoryBarriers = &barrier;
  vkCmdPipelineBarrier2(buffer, &dependency);
}
constexpr VkPipelineStageFlags2 kWork = VK_PIPELINE_STAGE_2_COMPUTE_SHADER_BIT | VK_PIPELINE_STAGE_2_COPY_BIT;
}  // namespace

void Commands::barrier() {
  memory_barrier(buffer_, kWork, VK_ACCESS_2_MEMORY_WRITE_BIT, kWork,
                 VK_ACCESS_2_MEMORY_READ_BIT | VK_ACCESS_2_MEMORY_WRITE_BIT);
}

void Commands::host_barrier() {
  memory_barrier(buffer_, kWork, VK_ACCESS_2_MEMORY_WRITE_BIT, VK_PIPELINE_STAGE_2_HOST_BIT,
                 VK_ACCESS_2_HOST_READ_BIT);
}

Commands::Scope::Scope(Commands& commands, const char* name)
    : commands_(commands), index_(static_cast<uint32_t>(commands.scopes_.size())) {
  assert(index_ < kMaxScopes);
  commands_.scopes_.push_back(name);
  commands_.context_->begin_label(commands_.buffer_, name);
  if (commands_.queries_) {
    vkCmdWriteTimestamp2(commands_.buffer_, VK_PIPELINE_STAGE_2_ALL_COMMANDS_BIT, commands_.queries_,
                         2 * index_);
  }
}

Commands::Scope::~Scope() {
  if (commands_.queries_) {
    vkCmdWriteTimestamp2(commands_.buffer_, VK_PIPELINE_STAGE_2_ALL_COMMANDS_BIT, commands_.queries_,
                         2 * index_ + 1);
  }
  commands_.context_->end_label(commands_.buffer_);
}

std::vector<ScopeTime> Commands::times() const {
  if (!queries_ || scopes_.empty()) return {};
  std::vector<uint64_t> stamps(2 * scopes_.size());
  check(vkGetQueryPoolResults(context_->device(), queries_, 0, static_cast<uint32_t>(stamps.size()),
                              stamps.size() * 8, stamps.data(), 8,
                              VK_QUERY_RESULT_64_BIT | VK_QUERY_RESULT_WAIT_BIT),
        "reading timers");
  std::vector<ScopeTime> times;
  const double ms_per_tick = context_->properties().limits.timestampPeriod * 1e-6;
  for (size_t i = 0; i < scopes_.size(); ++i) {
    times.push_back({scopes_[i], static_cast<double>(stamps[2 * i + 1] - stamps[2 * i]) * ms_per_tick});
  }
  return times;
}

}  // namespace palpate::gpu
