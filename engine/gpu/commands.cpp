#include "engine/gpu/commands.h"

#include <algorithm>
#include <cassert>
#include <chrono>
#include <utility>

#include "engine/gpu/buffer.h"
#include "engine/gpu/context.h"
#include "engine/gpu/kernel.h"
#include "palpate/error.h"

namespace palpate::gpu {

// Built on the default constructor, so that the destructor frees what was made before a failure.
Commands::Commands(Context& context) : Commands() {
  context_ = &context;
  sets_ = DescriptorSets(context);
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
  settle();
  if (context_->hung()) return;
  if (queries_) vkDestroyQueryPool(context_->device(), queries_, nullptr);
  vkDestroyFence(context_->device(), fence_, nullptr);
  vkDestroyCommandPool(context_->device(), pool_, nullptr);
}

void Commands::swap(Commands& other) noexcept {
  std::swap(context_, other.context_);
  std::swap(pool_, other.pool_);
  std::swap(sets_, other.sets_);
  std::swap(buffer_, other.buffer_);
  std::swap(fence_, other.fence_);
  std::swap(submitted_, other.submitted_);
  std::swap(queries_, other.queries_);
  std::swap(scopes_, other.scopes_);
  std::swap(traffic_, other.traffic_);
  std::swap(open_, other.open_);
  std::swap(parts_, other.parts_);
}

void Commands::begin() {
  if (!parts_.empty()) {
    for (size_t i = 1; i < parts_.size(); ++i)
      vkFreeCommandBuffers(context_->device(), pool_, 1, &parts_[i].buffer);
    buffer_ = parts_.front().buffer;
    parts_.clear();
  }
  VkCommandBufferBeginInfo info{};
  info.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO;
  check(vkBeginCommandBuffer(buffer_, &info), "recording commands");
  sets_.reset();
  scopes_.clear();
  traffic_.clear();
  open_ = kNoScope;
  if (context_->host_timers()) parts_.push_back({buffer_});
  if (queries_) vkCmdResetQueryPool(buffer_, queries_, 0, 2 * kMaxScopes);
  barrier();  // frames share scratch memory: wait for what earlier submissions still write or read
}

void Commands::end() {
  check(vkEndCommandBuffer(buffer_), "recording commands");
}

void Commands::submit(Commands* first) {
  if (parts_.empty()) {
    const std::array buffers{first ? first->buffer_ : VK_NULL_HANDLE, buffer_};
    return submit_buffers(std::span(buffers).subspan(first ? 0 : 1));
  }
  if (first) first->submit(nullptr);
  for (Part& part : parts_) {
    const auto start = std::chrono::steady_clock::now();
    submit_buffers({&part.buffer, 1});
    wait();
    part.ms = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
  }
}

// Ends the buffer that is being recorded and goes on in a new one.
void Commands::begin_part(uint32_t scope) {
  check(vkEndCommandBuffer(buffer_), "recording commands");
  VkCommandBufferAllocateInfo allocation{};
  allocation.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO;
  allocation.commandPool = pool_;
  allocation.level = VK_COMMAND_BUFFER_LEVEL_PRIMARY;
  allocation.commandBufferCount = 1;
  check(vkAllocateCommandBuffers(context_->device(), &allocation, &buffer_), "a command buffer");
  parts_.push_back({buffer_, scope});
  VkCommandBufferBeginInfo info{};
  info.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO;
  check(vkBeginCommandBuffer(buffer_, &info), "recording commands");
  barrier();
}

void Commands::submit_buffers(std::span<const VkCommandBuffer> buffers) {
  submitted_ = false;
  check(vkResetFences(context_->device(), 1, &fence_), "resetting a fence");
  std::array<VkCommandBufferSubmitInfo, 2> infos{};
  assert(buffers.size() <= infos.size());
  for (size_t i = 0; i < buffers.size(); ++i) {
    infos[i].sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_SUBMIT_INFO;
    infos[i].commandBuffer = buffers[i];
  }
  VkSubmitInfo2 info{};
  info.sType = VK_STRUCTURE_TYPE_SUBMIT_INFO_2;
  info.commandBufferInfoCount = static_cast<uint32_t>(buffers.size());
  info.pCommandBufferInfos = infos.data();
  context_->submit(info, fence_);
  submitted_ = true;
}

bool Commands::finished() const {
  if (!submitted_) return true;
  const VkResult result = vkGetFenceStatus(context_->device(), fence_);
  if (result == VK_NOT_READY) return false;
  check(result, "a finished frame");
  return true;
}

void Commands::wait() const {
  if (!submitted_) return;
  context_->wait(fence_, "a finished frame");
}

void Commands::settle() const noexcept {
  if (submitted_) context_->settle(fence_);
}

void Commands::dispatch(const Kernel& kernel, std::span<const Argument> arguments, const void* push,
                        std::array<uint32_t, 3> groups) {
  const Traffic bytes = bind(kernel, arguments, push);
  context_->tell_of({kernel.name(), kernel.interface(), uint64_t{groups[0]} * groups[1] * groups[2],
                     bytes.read, bytes.written});
  vkCmdDispatch(buffer_, groups[0], groups[1], groups[2]);
}

void Commands::dispatch(const Kernel& kernel, std::span<const Argument> arguments, const void* push,
                        const IndirectGroups& groups) {
  const Traffic bytes = bind(kernel, arguments, push);
  context_->tell_of({kernel.name(), kernel.interface(), 0, bytes.read, bytes.written});
  vkCmdDispatchIndirect(buffer_, groups.buffer->handle(), uint64_t{groups.index} * kIndirectBytes);
}

Commands::Traffic Commands::bind(const Kernel& kernel, std::span<const Argument> arguments,
                                 const void* push) {
  const KernelInterface& interface = kernel.interface();
  assert(arguments.size() == interface.bindings.size() && arguments.size() <= kMaxBindings);
  std::array<VkDescriptorBufferInfo, kMaxBindings> buffers{};
  std::array<VkBufferView, kMaxBindings> views{};
  std::array<VkWriteDescriptorSet, kMaxBindings> writes{};
  // Two views on one buffer are one buffer read.
  std::array<VkBuffer, kMaxBindings> read{};
  uint64_t read_bytes = 0, written_bytes = 0;
  uint32_t i = 0;
  for (const Argument& argument : arguments) {
    const auto* view = std::get_if<const TexelView*>(&argument);
    const VkBuffer source = view ? (*view)->buffer() : std::get<const DeviceBuffer*>(argument)->handle();
    const uint64_t bytes = view ? (*view)->bytes() : std::get<const DeviceBuffer*>(argument)->bytes();
    if (kernel.access(i).reads && std::find(read.begin(), read.end(), source) == read.end()) {
      read[i] = source;
      read_bytes += bytes;
    }
    if (kernel.access(i).writes) written_bytes += bytes;
    VkWriteDescriptorSet& write = writes[i];
    write.sType = VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET;
    write.dstBinding = i;
    write.descriptorCount = 1;
    write.descriptorType = descriptor_type(*context_, interface.bindings[i]);
    if (write.descriptorType == VK_DESCRIPTOR_TYPE_UNIFORM_TEXEL_BUFFER) {
      views[i] = std::get<const TexelView*>(argument)->handle();
      write.pTexelBufferView = &views[i];
    } else {
      // CPU drivers reach further than they state.
      const uint64_t limit = context_->properties().limits.maxStorageBufferRange;
      if (bytes > limit && !context_->is_software()) {
        throw Error(Failure::Device,
                    std::to_string(bytes >> 20) + " MiB in one buffer for kernel '" + kernel.name() + "'",
                    "a device limit of " + std::to_string(limit >> 20),
                    "a smaller frame or crop, or another device");
      }
      if (view && (*view)->element_bytes() != kernel.access(i).texel_bytes)
        throw Error(Failure::Device,
                    "binding " + std::to_string(i) + " of kernel '" + kernel.name() + "' in texels of " +
                        std::to_string(kernel.access(i).texel_bytes) + " bytes",
                    "texels of " + std::to_string((*view)->element_bytes()),
                    "rebuilding from clean: shader and program are of different versions");
      buffers[i] = {source, 0, VK_WHOLE_SIZE};
      write.pBufferInfo = &buffers[i];
    }
    ++i;
  }
  vkCmdBindPipeline(buffer_, VK_PIPELINE_BIND_POINT_COMPUTE, kernel.pipeline());
  sets_.bind(buffer_, VK_PIPELINE_BIND_POINT_COMPUTE, kernel.layout(), kernel.set_layout(),
             std::span(writes).first(i));
  if (interface.push_bytes) {
    vkCmdPushConstants(buffer_, kernel.layout(), VK_SHADER_STAGE_COMPUTE_BIT, 0, interface.push_bytes, push);
  }
  count(read_bytes, written_bytes);
  return {read_bytes, written_bytes};
}

void Commands::count(uint64_t read_bytes, uint64_t written_bytes) {
  if (open_ == kNoScope) return;
  ScopeTraffic& traffic = traffic_[open_];
  traffic.read_bytes += read_bytes;
  traffic.written_bytes += written_bytes;
  ++traffic.dispatches;
}

void Commands::copy(const DeviceBuffer& from, const DeviceBuffer& to, uint64_t bytes) {
  const VkBufferCopy region{0, 0, bytes};
  vkCmdCopyBuffer(buffer_, from.handle(), to.handle(), 1, &region);
  count(bytes, bytes);
}

namespace {
void memory_barrier(const Context& context, VkCommandBuffer buffer, VkPipelineStageFlags2 from,
                    VkAccessFlags2 from_access, VkPipelineStageFlags2 to, VkAccessFlags2 to_access) {
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
  context.pipeline_barrier(buffer, dependency);
}
constexpr VkPipelineStageFlags2 kWork = VK_PIPELINE_STAGE_2_COMPUTE_SHADER_BIT | VK_PIPELINE_STAGE_2_COPY_BIT;
}  // namespace

void Commands::barrier() {
  memory_barrier(*context_, buffer_, kWork, VK_ACCESS_2_MEMORY_WRITE_BIT,
                 kWork | VK_PIPELINE_STAGE_2_DRAW_INDIRECT_BIT,
                 VK_ACCESS_2_MEMORY_READ_BIT | VK_ACCESS_2_MEMORY_WRITE_BIT);
}

void Commands::host_barrier() {
  // And to what is drawn: the host need not wait in between.
  memory_barrier(*context_, buffer_, kWork, VK_ACCESS_2_MEMORY_WRITE_BIT,
                 VK_PIPELINE_STAGE_2_HOST_BIT | VK_PIPELINE_STAGE_2_ALL_COMMANDS_BIT,
                 VK_ACCESS_2_HOST_READ_BIT | VK_ACCESS_2_MEMORY_READ_BIT);
}

Commands::Scope::Scope(Commands& commands, const char* name)
    : commands_(commands), index_(static_cast<uint32_t>(commands.scopes_.size())), outer_(commands.open_) {
  assert(index_ < kMaxScopes);
  commands_.scopes_.push_back(name);
  commands_.traffic_.push_back({name});
  commands_.open_ = index_;
  if (!commands_.parts_.empty()) commands_.begin_part(index_);
  commands_.context_->begin_label(commands_.buffer_, name);
  if (commands_.queries_) {
    commands_.context_->write_timestamp(commands_.buffer_, VK_PIPELINE_STAGE_2_ALL_COMMANDS_BIT,
                                        commands_.queries_, 2 * index_);
  }
}

Commands::Scope::~Scope() {
  if (commands_.queries_) {
    commands_.context_->write_timestamp(commands_.buffer_, VK_PIPELINE_STAGE_2_ALL_COMMANDS_BIT,
                                        commands_.queries_, 2 * index_ + 1);
  }
  commands_.context_->end_label(commands_.buffer_);
  commands_.open_ = outer_;
  if (!commands_.parts_.empty()) commands_.begin_part(outer_);
}

std::vector<ScopeTraffic> Commands::traffic() const {
  return traffic_;
}

std::vector<ScopeTime> Commands::times() const {
  if (!parts_.empty()) {
    std::vector<ScopeTime> times;
    for (const char* name : scopes_) times.push_back({name, 0});
    for (const Part& part : parts_)
      if (part.scope != kNoScope) times[part.scope].ms += part.ms;
    return times;
  }
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

void clear(Context& context, const DeviceBuffer& buffer) {
  if (buffer.mapped()) {
    std::ranges::fill(buffer.as<float>(), 0.0f);
    buffer.flush();
    return;
  }
  const DeviceBuffer zeros(context, "zeros", buffer.bytes(), Memory::Upload);
  clear(context, zeros);
  run_once(context, [&](Commands& commands) {
    commands.copy(zeros, buffer, buffer.bytes());
    commands.barrier();
  });
}

}  // namespace palpate::gpu
