// A compute kernel: SPIR-V checked against the interface that the C++ side expects, then compiled.
#pragma once

#include <vulkan/vulkan.h>

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "engine/gpu/context.h"

namespace palpate::gpu {

/// Uniform texel buffer; storage buffer; uniform buffer: a few numbers that all invocations read alike.
enum class Binding : uint8_t { Texels, Storage, Uniform };

VkDescriptorType descriptor_type(const Context& context, Binding binding);

/// A shader's access to a binding, as its SPIR-V declares it.
struct BindingAccess {
  bool reads = true;
  bool writes = false;
  uint32_t texel_bytes = 0;  ///< of one element, where texels are read from a storage buffer
};

/// SPIR-V made at build time, with its name for messages.
struct Shader {
  const char* name;
  Spirv spirv;
};

/// Bindings that the C++ side will set. Binding i of set 0 is bindings[i].
struct KernelInterface {
  std::vector<Binding> bindings;
  uint32_t push_bytes = 0;
  std::array<uint32_t, 3> local_size{64, 1, 1};  ///< handed to the shader as specialisation constants 0, 1, 2
  std::vector<uint32_t> constants;               ///< specialisation constants 3, 4, ...
};

/// What the driver made of a shader for one interface. Freed with its last user; never where the device
/// hangs.
struct CompiledKernel {
  explicit CompiledKernel(Context& owner) : context(owner) {}
  ~CompiledKernel();
  CompiledKernel(const CompiledKernel&) = delete;
  CompiledKernel& operator=(const CompiledKernel&) = delete;

  Context& context;
  std::vector<BindingAccess> access;
  VkDescriptorSetLayout set_layout = VK_NULL_HANDLE;
  VkPipelineLayout layout = VK_NULL_HANDLE;
  VkPipeline pipeline = VK_NULL_HANDLE;
};

/// Compiled once a context: the same shader with the same interface again costs nothing (Context::compiled).
class Kernel {
 public:
  Kernel() = default;
  /// Throws Error(Failure::Device) naming shader and binding where the shader's interface differs.
  Kernel(Context& context, const Shader& shader, const KernelInterface& interface);

  VkPipeline pipeline() const { return compiled_ ? compiled_->pipeline : VK_NULL_HANDLE; }
  VkPipelineLayout layout() const { return compiled_->layout; }
  const KernelInterface& interface() const { return interface_; }
  const char* name() const { return name_; }
  const BindingAccess& access(size_t binding) const { return compiled_->access[binding]; }
  /// The driver's compiler statistics, by the driver's own names ("VGPRs"); empty unless the context
  /// asked for it (ContextOptions::statistics).
  std::map<std::string, double> statistics() const;
  VkDescriptorSetLayout set_layout() const { return compiled_->set_layout; }

 private:
  const char* name_ = "";
  KernelInterface interface_;
  std::shared_ptr<const CompiledKernel> compiled_;
};

}  // namespace palpate::gpu
