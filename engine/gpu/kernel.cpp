#include "engine/gpu/kernel.h"

#include <spirv_cross/spirv_cross_c.h>

#include <algorithm>
#include <span>
#include <string>
#include <type_traits>

#include "engine/gpu/context.h"
#include "palpate/error.h"

namespace palpate::gpu {
namespace {

[[noreturn]] void mismatch(const Shader& shader, const std::string& wanted, const std::string& found) {
  throw Error(Failure::Device, std::string("shader '") + shader.name + "' with " + wanted, found,
              "rebuilding from clean: shader and program are of different versions");
}

const char* binding_name(Binding binding) {
  switch (binding) {
    case Binding::Texels:
      return "texel buffer";
    case Binding::Storage:
      return "storage buffer";
    case Binding::Uniform:
      return "uniform buffer";
  }
  return "";
}

// Reads the SPIR-V's interface and compares it with what the C++ side will bind and push.
class Reflection {
 public:
  Reflection(const Shader& shader, std::span<const uint32_t> spirv) : shader_(shader) {
    spvc_parsed_ir ir = nullptr;
    if (spvc_context_create(&context_) != SPVC_SUCCESS ||
        spvc_context_parse_spirv(context_, spirv.data(), spirv.size(), &ir) != SPVC_SUCCESS ||
        spvc_context_create_compiler(context_, SPVC_BACKEND_NONE, ir, SPVC_CAPTURE_MODE_COPY, &compiler_) !=
            SPVC_SUCCESS ||
        spvc_compiler_create_shader_resources(compiler_, &resources_) != SPVC_SUCCESS) {
      const std::string why = context_ ? spvc_context_get_last_error_string(context_) : "no memory";
      spvc_context_destroy(context_);
      mismatch(shader, "valid SPIR-V", why);
    }
  }
  ~Reflection() { spvc_context_destroy(context_); }
  Reflection(const Reflection&) = delete;
  Reflection& operator=(const Reflection&) = delete;

  void compare(const KernelInterface& interface, bool storage_texels) {
    std::vector<Binding> wanted = interface.bindings;
    if (storage_texels) std::ranges::replace(wanted, Binding::Texels, Binding::Storage);
    std::vector<bool> seen(wanted.size());
    compare_bindings(wanted, SPVC_RESOURCE_TYPE_SEPARATE_IMAGE, Binding::Texels, seen);
    compare_bindings(wanted, SPVC_RESOURCE_TYPE_SAMPLED_IMAGE, Binding::Texels, seen);
    compare_bindings(wanted, SPVC_RESOURCE_TYPE_STORAGE_BUFFER, Binding::Storage, seen);
    compare_bindings(wanted, SPVC_RESOURCE_TYPE_UNIFORM_BUFFER, Binding::Uniform, seen);
    for (size_t i = 0; i < seen.size(); ++i) {
      if (!seen[i]) mismatch(shader_, "binding " + std::to_string(i), "no such binding in the shader");
    }
    compare_push(interface.push_bytes);
    compare_local_size();
  }

  std::vector<BindingAccess> access(const KernelInterface& interface) {
    std::vector<BindingAccess> access(interface.bindings.size());
    for (const auto& resource : list(SPVC_RESOURCE_TYPE_STORAGE_BUFFER)) {
      const SpvDecoration* decorations = nullptr;
      size_t count = 0;
      spvc_compiler_get_buffer_block_decorations(compiler_, resource.id, &decorations, &count);
      const auto declared = [&](SpvDecoration d) {
        return std::find(decorations, decorations + count, d) != decorations + count;
      };
      const unsigned slot = spvc_compiler_get_decoration(compiler_, resource.id, SpvDecorationBinding);
      access[slot] = {!declared(SpvDecorationNonReadable), !declared(SpvDecorationNonWritable)};
      if (interface.bindings[slot] == Binding::Texels)
        spvc_compiler_type_struct_member_array_stride(
            compiler_, spvc_compiler_get_type_handle(compiler_, resource.base_type_id), 0,
            &access[slot].texel_bytes);
    }
    return access;
  }

 private:
  std::span<const spvc_reflected_resource> list(spvc_resource_type type) {
    const spvc_reflected_resource* items = nullptr;
    size_t count = 0;
    spvc_resources_get_resource_list_for_type(resources_, type, &items, &count);
    return {items, count};
  }

  void compare_bindings(const std::vector<Binding>& wanted, spvc_resource_type type, Binding kind,
                        std::vector<bool>& seen) {
    for (const auto& resource : list(type)) {
      const unsigned set = spvc_compiler_get_decoration(compiler_, resource.id, SpvDecorationDescriptorSet);
      const unsigned slot = spvc_compiler_get_decoration(compiler_, resource.id, SpvDecorationBinding);
      const std::string place = "binding " + std::to_string(slot);
      if (set != 0) mismatch(shader_, place + " in set 0", "set " + std::to_string(set));
      if (slot >= wanted.size()) mismatch(shader_, std::to_string(wanted.size()) + " bindings", place);
      if (wanted[slot] != kind)
        mismatch(shader_, place + " as " + binding_name(wanted[slot]), binding_name(kind));
      seen[slot] = true;
    }
  }

  void compare_push(uint32_t wanted) {
    size_t bytes = 0;
    for (const auto& resource : list(SPVC_RESOURCE_TYPE_PUSH_CONSTANT)) {
      spvc_compiler_get_declared_struct_size(
          compiler_, spvc_compiler_get_type_handle(compiler_, resource.base_type_id), &bytes);
    }
    if (bytes != wanted)
      mismatch(shader_, std::to_string(wanted) + " bytes of push constants",
               std::to_string(bytes) + " bytes");
  }

  // The workgroup size must be the specialisation constants 0, 1, 2 so that the host can choose it for the
  // device.
  void compare_local_size() {
    spvc_specialization_constant size[3]{};
    spvc_compiler_get_work_group_size_specialization_constants(compiler_, &size[0], &size[1], &size[2]);
    for (unsigned i = 0; i < 3; ++i) {
      if (size[i].id == 0 || size[i].constant_id != i)
        mismatch(shader_, "its workgroup size as specialisation constants 0, 1 and 2", "another declaration");
    }
  }

  const Shader& shader_;
  spvc_context context_ = nullptr;
  spvc_compiler compiler_ = nullptr;
  spvc_resources resources_ = nullptr;
};

// The least that every device has, 128 invocations and four storage buffers, is too little for some kernels.
void compare_limits(const Shader& shader, const KernelInterface& interface, bool storage_texels,
                    const VkPhysicalDeviceLimits& limits) {
  const auto within = [&](const char* what, uint32_t needed, uint32_t limit) {
    if (needed > limit)
      throw Error(Failure::Device,
                  std::to_string(needed) + " " + what + " for kernel '" + std::string(shader.name) + "'",
                  "a device limit of " + std::to_string(limit), "another device (palpate devices)");
  };
  const auto& size = interface.local_size;
  within("bytes pushed", interface.push_bytes, limits.maxPushConstantsSize);
  within("invocations a workgroup", size[0] * size[1] * size[2], limits.maxComputeWorkGroupInvocations);
  for (size_t i = 0; i < 3; ++i)
    within("invocations along an axis", size[i], limits.maxComputeWorkGroupSize[i]);
  const auto texels = std::ranges::count(interface.bindings, Binding::Texels);
  const auto storage =
      std::ranges::count(interface.bindings, Binding::Storage) + (storage_texels ? texels : 0);
  within("storage buffers", static_cast<uint32_t>(storage), limits.maxPerStageDescriptorStorageBuffers);
}

}  // namespace

VkDescriptorType descriptor_type(const Context& context, Binding binding) {
  switch (binding) {
    case Binding::Texels:
      return context.texel_descriptor();
    case Binding::Storage:
      return VK_DESCRIPTOR_TYPE_STORAGE_BUFFER;
    case Binding::Uniform:
      return VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER;
  }
  return VK_DESCRIPTOR_TYPE_MAX_ENUM;
}

namespace {

std::shared_ptr<const CompiledKernel> compile(Context& context, const Shader& shader,
                                              std::span<const uint32_t> spirv,
                                              const KernelInterface& interface) {
  const bool storage = context.storage_texels();
  auto compiled = std::make_shared<CompiledKernel>(context);
  Reflection reflection(shader, spirv);
  reflection.compare(interface, storage);
  compiled->access = reflection.access(interface);
  compare_limits(shader, interface, storage, context.properties().limits);

  std::vector<VkDescriptorSetLayoutBinding> bindings;
  for (uint32_t i = 0; i < interface.bindings.size(); ++i) {
    bindings.push_back(
        {i, descriptor_type(context, interface.bindings[i]), 1, VK_SHADER_STAGE_COMPUTE_BIT, nullptr});
  }
  VkDescriptorSetLayoutCreateInfo set_info{};
  set_info.sType = VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO;
  if (context.push_descriptors()) set_info.flags = VK_DESCRIPTOR_SET_LAYOUT_CREATE_PUSH_DESCRIPTOR_BIT_KHR;
  set_info.bindingCount = static_cast<uint32_t>(bindings.size());
  set_info.pBindings = bindings.data();
  check(vkCreateDescriptorSetLayout(context.device(), &set_info, nullptr, &compiled->set_layout),
        shader.name);

  const VkPushConstantRange push{VK_SHADER_STAGE_COMPUTE_BIT, 0, interface.push_bytes};
  VkPipelineLayoutCreateInfo layout_info{};
  layout_info.sType = VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO;
  layout_info.setLayoutCount = 1;
  layout_info.pSetLayouts = &compiled->set_layout;
  layout_info.pushConstantRangeCount = interface.push_bytes ? 1 : 0;
  layout_info.pPushConstantRanges = &push;
  check(vkCreatePipelineLayout(context.device(), &layout_info, nullptr, &compiled->layout), shader.name);

  VkShaderModuleCreateInfo module_info{};
  module_info.sType = VK_STRUCTURE_TYPE_SHADER_MODULE_CREATE_INFO;
  module_info.codeSize = spirv.size_bytes();
  module_info.pCode = spirv.data();
  VkShaderModule module = VK_NULL_HANDLE;
  check(vkCreateShaderModule(context.device(), &module_info, nullptr, &module), shader.name);

  std::vector<uint32_t> values(interface.local_size.begin(), interface.local_size.end());
  values.insert(values.end(), interface.constants.begin(), interface.constants.end());
  std::vector<VkSpecializationMapEntry> entries;
  for (uint32_t i = 0; i < values.size(); ++i) entries.push_back({i, i * 4, 4});
  const VkSpecializationInfo specialization{static_cast<uint32_t>(entries.size()), entries.data(),
                                            values.size() * 4, values.data()};
  VkComputePipelineCreateInfo info{};
  info.sType = VK_STRUCTURE_TYPE_COMPUTE_PIPELINE_CREATE_INFO;
  info.stage.sType = VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO;
  info.stage.stage = VK_SHADER_STAGE_COMPUTE_BIT;
  info.stage.module = module;
  info.stage.pName = "main";
  info.stage.pSpecializationInfo = &specialization;
  info.layout = compiled->layout;
  if (context.statistics()) info.flags = VK_PIPELINE_CREATE_CAPTURE_STATISTICS_BIT_KHR;
  const VkResult result = vkCreateComputePipelines(context.device(), context.pipeline_cache(), 1, &info,
                                                   nullptr, &compiled->pipeline);
  vkDestroyShaderModule(context.device(), module, nullptr);
  check(result, shader.name);
  context.set_name(VK_OBJECT_TYPE_PIPELINE, reinterpret_cast<uint64_t>(compiled->pipeline), shader.name);
  return compiled;
}

/// All that a compiled kernel depends on, lengths included.
std::string bytes_of(std::span<const uint32_t> spirv, const KernelInterface& interface) {
  std::string bytes;
  const auto add = [&](const auto& values) {
    const auto raw = std::as_bytes(std::span(values));
    bytes += std::to_string(raw.size()) + ' ';
    bytes.append(reinterpret_cast<const char*>(raw.data()), raw.size());
  };
  add(spirv);
  add(interface.bindings);
  add(std::array{interface.push_bytes});
  add(interface.local_size);
  add(interface.constants);
  return bytes;
}

}  // namespace

Kernel::Kernel(Context& context, const Shader& shader, const KernelInterface& interface)
    : name_(shader.name), interface_(interface) {
  context.tell_of(shader, interface);
  const std::span<const uint32_t> spirv = context.form(shader.spirv);
  compiled_ = context.compiled(bytes_of(spirv, interface),
                               [&] { return compile(context, shader, spirv, interface); });
}

CompiledKernel::~CompiledKernel() {
  if (context.hung()) return;
  vkDestroyPipeline(context.device(), pipeline, nullptr);
  vkDestroyPipelineLayout(context.device(), layout, nullptr);
  vkDestroyDescriptorSetLayout(context.device(), set_layout, nullptr);
}

std::map<std::string, double> Kernel::statistics() const {
  const Context& context = compiled_->context;
  const auto load = [&](auto& function, const char* name) {
    function = reinterpret_cast<std::remove_reference_t<decltype(function)>>(
        vkGetDeviceProcAddr(context.device(), name));
  };
  PFN_vkGetPipelineExecutableStatisticsKHR read = nullptr;
  if (context.statistics()) load(read, "vkGetPipelineExecutableStatisticsKHR");
  if (!read) return {};
  VkPipelineExecutableInfoKHR info{};  // a compute pipeline is one executable
  info.sType = VK_STRUCTURE_TYPE_PIPELINE_EXECUTABLE_INFO_KHR;
  info.pipeline = compiled_->pipeline;
  uint32_t count = 0;
  check(read(context.device(), &info, &count, nullptr), name_);
  std::vector<VkPipelineExecutableStatisticKHR> found(
      count, {VK_STRUCTURE_TYPE_PIPELINE_EXECUTABLE_STATISTIC_KHR, nullptr, {}, {}, {}, {}});
  check(read(context.device(), &info, &count, found.data()), name_);
  std::map<std::string, double> values;
  for (const auto& one : found) {
    const auto& value = one.value;
    values[one.name] = one.format == VK_PIPELINE_EXECUTABLE_STATISTIC_FORMAT_FLOAT64_KHR ? value.f64
                       : one.format == VK_PIPELINE_EXECUTABLE_STATISTIC_FORMAT_INT64_KHR
                           ? static_cast<double>(value.i64)
                           : static_cast<double>(value.u64);
  }
  return values;
}

}  // namespace palpate::gpu
