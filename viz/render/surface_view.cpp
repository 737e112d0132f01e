#include "viz/render/surface_view.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstring>

#include "engine/gpu/commands.h"
#include "engine/gpu/context.h"
#include "palpate/error.h"
#include "shaders/shared/surface_view.h"
#include "shaders/surface_frag.spv.h"
#include "shaders/surface_vert.spv.h"
#include "viz/render/mesh_places.h"

namespace palpate::viz {
namespace {

constexpr std::array<uint32_t, 8> kLevels{48, 64, 96, 128, 192, 256, 384, MeshGovernor::kFinest};
constexpr size_t kFirstLevel = 2;
// Texels of the map in one pixel: from here on the blend of four slopes shows nothing that five texels do
// not.
constexpr double kSeveralTexels = 1.0;

VkShaderModule make_module(gpu::Context& context, std::span<const uint32_t> spirv, const char* name) {
  VkShaderModuleCreateInfo info{};
  info.sType = VK_STRUCTURE_TYPE_SHADER_MODULE_CREATE_INFO;
  info.codeSize = spirv.size_bytes();
  info.pCode = spirv.data();
  VkShaderModule module = VK_NULL_HANDLE;
  gpu::check(vkCreateShaderModule(context.device(), &info, nullptr, &module), name);
  return module;
}

constexpr VkShaderStageFlags kBothStages = VK_SHADER_STAGE_VERTEX_BIT | VK_SHADER_STAGE_FRAGMENT_BIT;

VkDescriptorSetLayout make_set_layout(gpu::Context& context, uint32_t buffers, const char* name) {
  std::vector<VkDescriptorSetLayoutBinding> bindings;
  for (uint32_t i = 0; i < buffers; ++i)
    bindings.push_back({i, context.texel_descriptor(), 1, kBothStages, nullptr});
  VkDescriptorSetLayoutCreateInfo info{};
  info.sType = VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO;
  if (context.push_descriptors()) info.flags = VK_DESCRIPTOR_SET_LAYOUT_CREATE_PUSH_DESCRIPTOR_BIT_KHR;
  info.bindingCount = buffers;
  info.pBindings = bindings.data();
  VkDescriptorSetLayout layout = VK_NULL_HANDLE;
  gpu::check(vkCreateDescriptorSetLayout(context.device(), &info, nullptr, &layout), name);
  return layout;
}

VkPipelineLayout make_layout(gpu::Context& context, VkDescriptorSetLayout set, uint32_t push_bytes,
                             const char* name) {
  const VkPushConstantRange range{kBothStages, 0, push_bytes};
  VkPipelineLayoutCreateInfo info{};
  info.sType = VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO;
  info.setLayoutCount = 1;
  info.pSetLayouts = &set;
  info.pushConstantRangeCount = 1;
  info.pPushConstantRanges = &range;
  VkPipelineLayout layout = VK_NULL_HANDLE;
  gpu::check(vkCreatePipelineLayout(context.device(), &info, nullptr, &layout), name);
  return layout;
}

// Vertex and fragment shader with the constants of the latter; their modules live as long as this.
class ShaderStages {
 public:
  ShaderStages(gpu::Context& context, const TexelPipeline::Shaders& shaders,
               const std::vector<int32_t>& constants)
      : context_(context) {
    for (auto& stage : infos) {
      stage.sType = VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO;
      stage.pName = "main";
    }
    infos[0].stage = VK_SHADER_STAGE_VERTEX_BIT;
    infos[0].module = make_module(context, context.form(shaders.vertex), shaders.name);
    infos[1].stage = VK_SHADER_STAGE_FRAGMENT_BIT;
    infos[1].module = make_module(context, context.form(shaders.fragment), shaders.name);
    for (uint32_t i = 0; i < constants.size(); ++i)
      entries_.push_back({i, i * static_cast<uint32_t>(sizeof(int32_t)), sizeof(int32_t)});
    special_ = {static_cast<uint32_t>(entries_.size()), entries_.data(), constants.size() * sizeof(int32_t),
                constants.data()};
    if (!constants.empty()) infos[1].pSpecializationInfo = &special_;
  }
  ~ShaderStages() {
    for (const auto& stage : infos) vkDestroyShaderModule(context_.device(), stage.module, nullptr);
  }
  ShaderStages(const ShaderStages&) = delete;
  ShaderStages& operator=(const ShaderStages&) = delete;

  std::array<VkPipelineShaderStageCreateInfo, 2> infos{};

 private:
  gpu::Context& context_;
  std::vector<VkSpecializationMapEntry> entries_;
  VkSpecializationInfo special_{};
};

// Fixed-function state of a pipeline without vertex buffers.
struct FixedStages {
  FixedStages(VkPrimitiveTopology topology, VkSampleCountFlagBits samples, bool depth_test, bool blended) {
    no_vertices.sType = VK_STRUCTURE_TYPE_PIPELINE_VERTEX_INPUT_STATE_CREATE_INFO;
    assembly.sType = VK_STRUCTURE_TYPE_PIPELINE_INPUT_ASSEMBLY_STATE_CREATE_INFO;
    assembly.topology = topology;
    viewport.sType = VK_STRUCTURE_TYPE_PIPELINE_VIEWPORT_STATE_CREATE_INFO;
    viewport.viewportCount = 1;
    viewport.scissorCount = 1;
    raster.sType = VK_STRUCTURE_TYPE_PIPELINE_RASTERIZATION_STATE_CREATE_INFO;
    raster.polygonMode = VK_POLYGON_MODE_FILL;
    raster.cullMode = VK_CULL_MODE_NONE;  // the surface is seen from both sides
    raster.frontFace = VK_FRONT_FACE_CLOCKWISE;
    raster.lineWidth = 1;
    multisample.sType = VK_STRUCTURE_TYPE_PIPELINE_MULTISAMPLE_STATE_CREATE_INFO;
    multisample.rasterizationSamples = samples;
    depth.sType = VK_STRUCTURE_TYPE_PIPELINE_DEPTH_STENCIL_STATE_CREATE_INFO;
    depth.depthTestEnable = depth_test;
    depth.depthWriteEnable = depth_test;
    depth.depthCompareOp = VK_COMPARE_OP_LESS;
    if (blended) {
      written_.blendEnable = VK_TRUE;
      written_.srcColorBlendFactor = VK_BLEND_FACTOR_SRC_ALPHA;
      written_.dstColorBlendFactor = VK_BLEND_FACTOR_ONE_MINUS_SRC_ALPHA;
      written_.srcAlphaBlendFactor = VK_BLEND_FACTOR_ONE;
      written_.dstAlphaBlendFactor = VK_BLEND_FACTOR_ZERO;
    }
    written_.colorWriteMask = VK_COLOR_COMPONENT_R_BIT | VK_COLOR_COMPONENT_G_BIT | VK_COLOR_COMPONENT_B_BIT |
                              VK_COLOR_COMPONENT_A_BIT;
    blend.sType = VK_STRUCTURE_TYPE_PIPELINE_COLOR_BLEND_STATE_CREATE_INFO;
    blend.attachmentCount = 1;
    blend.pAttachments = &written_;
    dynamic.sType = VK_STRUCTURE_TYPE_PIPELINE_DYNAMIC_STATE_CREATE_INFO;
    dynamic.dynamicStateCount = static_cast<uint32_t>(states_.size());
    dynamic.pDynamicStates = states_.data();
  }
  FixedStages(const FixedStages&) = delete;
  FixedStages& operator=(const FixedStages&) = delete;

  VkPipelineVertexInputStateCreateInfo no_vertices{};
  VkPipelineInputAssemblyStateCreateInfo assembly{};
  VkPipelineViewportStateCreateInfo viewport{};
  VkPipelineRasterizationStateCreateInfo raster{};
  VkPipelineMultisampleStateCreateInfo multisample{};
  VkPipelineDepthStencilStateCreateInfo depth{};
  VkPipelineColorBlendStateCreateInfo blend{};
  VkPipelineDynamicStateCreateInfo dynamic{};

 private:
  VkPipelineColorBlendAttachmentState written_{};
  std::array<VkDynamicState, 2> states_{VK_DYNAMIC_STATE_VIEWPORT, VK_DYNAMIC_STATE_SCISSOR};
};

}  // namespace

Vec3 surface_half_size_mm(uint32_t width, uint32_t height, double pitch_mm_per_px,
                          const SurfaceStyle& style) {
  return {0.5 * width * pitch_mm_per_px, 0.5 * height * pitch_mm_per_px,
          0.5 * style.range_mm * style.exaggeration};
}

TexelPipeline::TexelPipeline(gpu::Context& context, const RenderPass& pass, const Shaders& shaders,
                             uint32_t push_bytes, VkPrimitiveTopology topology, bool depth_test, bool blended,
                             uint32_t buffers, const std::vector<int32_t>& constants)
    : context_(context), push_bytes_(push_bytes) {
  set_layout_ = make_set_layout(context, buffers, shaders.name);
  layout_ = make_layout(context, set_layout_, push_bytes, shaders.name);
  const ShaderStages stages(context, shaders, constants);
  const FixedStages fixed(topology, pass.samples(), depth_test, blended);
  VkGraphicsPipelineCreateInfo info{};
  info.sType = VK_STRUCTURE_TYPE_GRAPHICS_PIPELINE_CREATE_INFO;
  info.stageCount = static_cast<uint32_t>(stages.infos.size());
  info.pStages = stages.infos.data();
  info.pVertexInputState = &fixed.no_vertices;
  info.pInputAssemblyState = &fixed.assembly;
  info.pViewportState = &fixed.viewport;
  info.pRasterizationState = &fixed.raster;
  info.pMultisampleState = &fixed.multisample;
  info.pDepthStencilState = &fixed.depth;
  info.pColorBlendState = &fixed.blend;
  info.pDynamicState = &fixed.dynamic;
  info.layout = layout_;
  info.renderPass = pass.handle();
  const VkResult result =
      vkCreateGraphicsPipelines(context.device(), context.pipeline_cache(), 1, &info, nullptr, &pipeline_);
  gpu::check(result, shaders.name);
}

TexelPipeline::~TexelPipeline() {
  if (context_.hung()) return;
  vkDestroyPipeline(context_.device(), pipeline_, nullptr);
  vkDestroyPipelineLayout(context_.device(), layout_, nullptr);
  vkDestroyDescriptorSetLayout(context_.device(), set_layout_, nullptr);
}

void TexelPipeline::bind(VkCommandBuffer cmd, gpu::DescriptorSets& sets,
                         std::span<const gpu::TexelView* const> texels, const void* push) const {
  constexpr size_t kMost = 4;
  std::array<VkBufferView, kMost> views{};
  std::array<VkDescriptorBufferInfo, kMost> buffers{};
  std::array<VkWriteDescriptorSet, kMost> writes{};
  assert(texels.size() <= kMost);
  for (size_t i = 0; i < texels.size(); ++i) {
    views[i] = texels[i]->handle();
    writes[i].sType = VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET;
    writes[i].dstBinding = static_cast<uint32_t>(i);
    writes[i].descriptorCount = 1;
    writes[i].descriptorType = context_.texel_descriptor();
    writes[i].pTexelBufferView = &views[i];
    buffers[i] = {texels[i]->buffer(), 0, VK_WHOLE_SIZE};
    writes[i].pBufferInfo = &buffers[i];
  }
  vkCmdBindPipeline(cmd, VK_PIPELINE_BIND_POINT_GRAPHICS, pipeline_);
  sets.bind(cmd, VK_PIPELINE_BIND_POINT_GRAPHICS, layout_, set_layout_,
            std::span(writes).first(texels.size()));
  vkCmdPushConstants(cmd, layout_, VK_SHADER_STAGE_VERTEX_BIT | VK_SHADER_STAGE_FRAGMENT_BIT, 0, push_bytes_,
                     push);
}

SurfaceView::SurfaceView(gpu::Context& context, const RenderPass& pass, uint32_t frames_in_flight)
    : context_(context), pass_(pass), frames_in_flight_(frames_in_flight) {
  pipeline({}, true);
}

const TexelPipeline& SurfaceView::pipeline(const SurfaceStyle& style, bool fine) {
  std::unique_ptr<TexelPipeline>& made = pipelines_[{style.map, style.quantity, fine}];
  if (!made)
    made = std::make_unique<TexelPipeline>(
        context_, pass_, TexelPipeline::Shaders{"surface view", k_surface_vert, k_surface_frag},
        sizeof(SurfacePush), VK_PRIMITIVE_TOPOLOGY_TRIANGLE_LIST, true, true, 3u,
        std::vector<int32_t>{static_cast<int32_t>(style.map), static_cast<int32_t>(style.quantity),
                             fine ? 1 : 0});
  return *made;
}

std::pair<uint32_t, uint32_t> SurfaceView::mesh_size(const SurfaceMap& map, uint32_t mesh_columns) {
  const uint32_t limit = mesh_columns ? mesh_columns : kMaxMeshColumns;
  const uint32_t longest = std::max(map.width, map.height);
  const double step = std::max(1.0, static_cast<double>(longest) / limit);
  const auto vertices = [&](uint32_t texels) {
    return std::max(2u, static_cast<uint32_t>(std::lround(texels / step)));
  };
  return {vertices(map.width), vertices(map.height)};
}

// Two triangles a cell, in square blocks, so that a vertex is shaded once while its block lasts.
const SurfaceView::Mesh& SurfaceView::mesh(uint32_t columns, uint32_t rows) {
  auto [found, is_new] = meshes_.try_emplace({columns, rows});
  Mesh& mesh = found->second;
  if (!is_new) return mesh;
  constexpr uint32_t kBlock = 14;
  std::vector<uint32_t> indices;
  indices.reserve(size_t{6} * (columns - 1) * (rows - 1));
  for (uint32_t y0 = 0; y0 + 1 < rows; y0 += kBlock) {
    for (uint32_t x0 = 0; x0 + 1 < columns; x0 += kBlock) {
      for (uint32_t y = y0; y < std::min(y0 + kBlock, rows - 1); ++y) {
        for (uint32_t x = x0; x < std::min(x0 + kBlock, columns - 1); ++x) {
          const uint32_t a = y * columns + x, b = a + columns;
          indices.insert(indices.end(), {a, a + 1, b, b, a + 1, b + 1});
        }
      }
    }
  }
  mesh.count = static_cast<uint32_t>(indices.size());
  const uint64_t bytes = indices.size() * sizeof(uint32_t);
  mesh.indices = gpu::DeviceBuffer(context_, "surface mesh", bytes, gpu::Memory::Device);
  if (mesh.indices.mapped()) {
    std::memcpy(mesh.indices.as<uint32_t>().data(), indices.data(), bytes);
    mesh.indices.flush();
    return mesh;
  }
  gpu::DeviceBuffer staging(context_, "surface mesh staging", bytes, gpu::Memory::Upload);
  std::memcpy(staging.as<uint32_t>().data(), indices.data(), bytes);
  staging.flush();
  gpu::Commands commands(context_);
  commands.begin();
  commands.copy(staging, mesh.indices, bytes);
  commands.end();
  commands.submit();
  commands.wait();
  return mesh;
}

/// Bindings of the next picture. The oldest picture's sets and places serve again; its view is of a buffer
/// that may be gone.
SurfaceView::Bound& SurfaceView::bind(const SurfaceMap& map) {
  gpu::TexelView heights(context_, *map.buffer, VK_FORMAT_R32_SFLOAT);
  if (bound_.size() > frames_in_flight_) {
    Bound oldest = std::move(bound_.front());
    bound_.pop_front();
    oldest.sets.reset();
    oldest.heights = std::move(heights);
    bound_.push_back(std::move(oldest));
    return bound_.back();
  }
  constexpr uint64_t kBytes = uint64_t{2} * kMaxMeshColumns * sizeof(float);
  gpu::DeviceBuffer places(context_, "places of the mesh", kBytes, gpu::Memory::Upload);
  gpu::TexelView place_texels(context_, places, VK_FORMAT_R32_SFLOAT);
  bound_.push_back(
      {std::move(heights), gpu::DescriptorSets(context_), std::move(places), std::move(place_texels)});
  return bound_.back();
}

void SurfaceView::draw(VkCommandBuffer cmd, const SurfaceMap& map, double offset_mm, double pitch_mm_per_px,
                       const Eye& eye, const SurfaceStyle& style, const ViewRect& view, uint32_t mesh_columns,
                       const LoadTexels& load, const std::optional<PixelRect>& dense) {
  const Bound& bound = bind(map);
  const auto [columns, rows] = mesh_size(map, mesh_columns);
  const PixelRect part = dense.value_or(PixelRect{});
  const std::span<float> places = bound.places.as<float>();
  const auto put = [&places](const std::vector<float>& side, size_t at) {
    std::copy(side.begin(), side.end(), places.begin() + static_cast<ptrdiff_t>(at));
  };
  put(mesh_places(map.width, columns, part.x, static_cast<double>(part.x) + part.width), 0);
  put(mesh_places(map.height, rows, part.y, static_cast<double>(part.y) + part.height), columns);
  bound.places.flush();

  SurfacePush push{};
  push.clip_from_world = eye.clip_from_world;
  push.eye_x_mm = static_cast<float>(eye.position.x);
  push.eye_y_mm = static_cast<float>(eye.position.y);
  push.eye_z_mm = static_cast<float>(eye.position.z);
  push.grid_mm = static_cast<float>(style.grid_mm);
  push.pitch_mm = static_cast<float>(pitch_mm_per_px);
  push.exaggeration = static_cast<float>(style.exaggeration);
  push.offset_mm = static_cast<float>(offset_mm);
  push.colour_range = static_cast<float>(last_colour(style));
  push.width = map.width;
  push.height = map.height;
  push.row_pitch = map.pitch;
  push.mesh_size = columns | rows << 16;
  push.load_size = std::max(load.width, 1u) | std::max(load.height, 1u) << 16;
  const double texels_per_px = eye.mm_per_px(view.height) / pitch_mm_per_px;
  const bool fine = texels_per_px < kSeveralTexels;
  const auto spread = static_cast<uint32_t>(std::clamp(std::round(texels_per_px / 2), 1.0, 1000.0));
  push.lit_spread = (style.lit ? 1u : 0u) | (fine ? 0 : spread) << 1;

  const VkViewport viewport{static_cast<float>(view.x),
                            static_cast<float>(view.y),
                            static_cast<float>(view.width),
                            static_cast<float>(view.height),
                            0,
                            1};
  const VkRect2D scissor{{view.x, view.y}, {view.width, view.height}};
  vkCmdSetViewport(cmd, 0, 1, &viewport);
  vkCmdSetScissor(cmd, 0, 1, &scissor);
  const Mesh& grid = mesh(columns, rows);
  // Without loads the second buffer is not read, but must be one.
  const gpu::TexelView* const heights = &bound.heights;
  const std::array texels{heights, load.texels ? load.texels : heights, &bound.place_texels};
  assert(load.texels || (style.quantity != Quantity::Pressure && style.quantity != Quantity::Friction));
  pipeline(style, fine).bind(cmd, bound_.back().sets, texels, &push);
  vkCmdBindIndexBuffer(cmd, grid.indices.handle(), 0, VK_INDEX_TYPE_UINT32);
  vkCmdDrawIndexed(cmd, grid.count, 1, 0, 0, 0);
}

MeshGovernor::MeshGovernor(bool fixed, double budget_ms)
    : fixed_(fixed), budget_ms_(budget_ms), level_(kFirstLevel) {}

uint32_t MeshGovernor::columns() const {
  return fixed_ ? 0 : kLevels[level_];
}

void MeshGovernor::record(double draw_ms) {
  constexpr size_t kWindow = 8;
  constexpr int kPatience = 40;
  recent_ms_.push_back(draw_ms);
  if (recent_ms_.size() < kWindow) {
    if (typical_ms_ == 0) typical_ms_ = draw_ms;
    return;
  }
  std::nth_element(recent_ms_.begin(), recent_ms_.begin() + kWindow / 2, recent_ms_.end());
  typical_ms_ = recent_ms_[kWindow / 2];
  recent_ms_.clear();
  wait_ = std::max(0, wait_ - static_cast<int>(kWindow));
  if (typical_ms_ > 1.15 * budget_ms_ && level_ > 0) {
    --level_;
    wait_ = kPatience;
  } else if (typical_ms_ < 0.55 * budget_ms_ && level_ + 1 < kLevels.size() && wait_ == 0) {
    ++level_;
  }
}

}  // namespace palpate::viz
