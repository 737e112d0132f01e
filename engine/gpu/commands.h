// One command buffer with its fence and timers. Recorded once a frame, or once and submitted often.
#pragma once

#include <vulkan/vulkan.h>

#include <array>
#include <cstdint>
#include <initializer_list>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "engine/gpu/descriptor_sets.h"

namespace palpate::gpu {

class Context;
class DeviceBuffer;
class TexelView;
class Kernel;

/// Time of one named scope, by the GPU's clock or (ContextOptions::host_timers) the host's. After a render
/// pass in the same process lavapipe's timestamps are garbage: see perf/README.md.
struct ScopeTime {
  std::string name;
  double ms = 0;
};

/// Memory traffic of one named scope: each buffer that a kernel or copy is given, counted once whole. That is
/// what no cache can spare it where the kernel needs all of it, and an upper bound where it does not.
struct ScopeTraffic {
  std::string name;
  uint64_t read_bytes = 0;
  uint64_t written_bytes = 0;
  uint32_t dispatches = 0;  ///< kernels and copies
};

/// One thing bound to a kernel: a texel view (read) or a buffer (read and write).
using Argument = std::variant<const TexelView*, const DeviceBuffer*>;

/// Numbers of workgroups that a kernel left in a buffer: the record of three words at `index`.
struct IndirectGroups {
  const DeviceBuffer* buffer = nullptr;
  uint32_t index = 0;
};
inline constexpr uint64_t kIndirectBytes = 12;

class Commands {
 public:
  Commands() = default;
  explicit Commands(Context& context);
  ~Commands();
  Commands(Commands&& other) noexcept { swap(other); }
  Commands& operator=(Commands&& other) noexcept {
    swap(other);
    return *this;
  }

  void begin();
  /// Ends recording. The buffer may then be submitted any number of times.
  void end();
  void submit() { submit(nullptr); }
  /// `first`, if any, goes with it and before it, and is finished when this is.
  void submit(Commands* first);
  bool finished() const;
  void wait() const;
  /// As wait, for destructors: the error of a lost device is of no use there.
  void settle() const noexcept;

  /// Binds, pushes and dispatches. The arguments' order is the kernel's bindings'.
  void dispatch(const Kernel& kernel, std::span<const Argument> arguments, const void* push,
                std::array<uint32_t, 3> groups);
  template <typename Push>
  void dispatch(const Kernel& kernel, std::initializer_list<Argument> arguments, const Push& push,
                std::array<uint32_t, 3> groups) {
    static_assert(sizeof(Push) % 4 == 0);
    dispatch(kernel, std::span(arguments.begin(), arguments.size()), &push, groups);
  }
  /// As many workgroups as a kernel before the last barrier found; none cost next to nothing.
  void dispatch(const Kernel& kernel, std::span<const Argument> arguments, const void* push,
                const IndirectGroups& groups);
  template <typename Push>
  void dispatch(const Kernel& kernel, std::initializer_list<Argument> arguments, const Push& push,
                const IndirectGroups& groups) {
    static_assert(sizeof(Push) % 4 == 0);
    dispatch(kernel, std::span(arguments.begin(), arguments.size()), &push, groups);
  }
  void copy(const DeviceBuffer& from, const DeviceBuffer& to, uint64_t bytes);
  /// All writes so far become visible to all kernels and copies after it: the one synchronisation rule
  /// between stages.
  void barrier();
  /// Writes so far become visible to the host.
  void host_barrier();

  /// A named stretch of commands: debug label and timer at once.
  class Scope {
   public:
    Scope(Commands& commands, const char* name);
    ~Scope();
    Scope(const Scope&) = delete;
    Scope& operator=(const Scope&) = delete;

   private:
    Commands& commands_;
    uint32_t index_;
    uint32_t outer_;
  };
  Scope scope(const char* name) { return {*this, name}; }

  /// Scope times of the last finished submission; empty unless the context has timers.
  std::vector<ScopeTime> times() const;
  /// Memory traffic of each scope with every submission; known once it is recorded.
  std::vector<ScopeTraffic> traffic() const;
  VkCommandBuffer handle() const { return buffer_; }
  size_t descriptor_pools() const { return sets_.pools(); }  ///< 0 where descriptors are pushed

 private:
  static constexpr uint32_t kMaxScopes = 32;
  static constexpr uint32_t kNoScope = UINT32_MAX;
  /// A stretch of commands that the host times by itself.
  struct Part {
    VkCommandBuffer buffer = VK_NULL_HANDLE;
    uint32_t scope = kNoScope;
    double ms = 0;  ///< of its last submission
  };

  void swap(Commands& other) noexcept;
  struct Traffic {
    uint64_t read, written;
  };
  Traffic bind(const Kernel& kernel, std::span<const Argument> arguments, const void* push);
  void count(uint64_t read_bytes, uint64_t written_bytes);
  void begin_part(uint32_t scope);
  void submit_buffers(std::span<const VkCommandBuffer> buffers);

  Context* context_ = nullptr;
  VkCommandPool pool_ = VK_NULL_HANDLE;
  DescriptorSets sets_;
  VkCommandBuffer buffer_ = VK_NULL_HANDLE;
  VkFence fence_ = VK_NULL_HANDLE;
  bool submitted_ = false;  // the fence will be signalled: nobody waits for a submission that failed
  VkQueryPool queries_ = VK_NULL_HANDLE;
  std::vector<const char*> scopes_;
  std::vector<ScopeTraffic> traffic_;
  uint32_t open_ = kNoScope;  ///< the innermost scope that is being recorded
  std::vector<Part> parts_;   ///< empty unless the host times scopes
};

/// Records once, submits and waits: for setting up and for single answers, not for frames.
template <typename Record>
void run_once(Context& context, const Record& record) {
  Commands commands(context);
  commands.begin();
  record(commands);
  commands.end();
  commands.submit();
  commands.wait();
}

/// Fills a buffer of floats with 0 and waits for it: for what kernels read before anything writes it.
void clear(Context& context, const DeviceBuffer& buffer);

}  // namespace palpate::gpu
