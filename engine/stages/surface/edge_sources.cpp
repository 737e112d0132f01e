#include "engine/stages/surface/edge_sources.h"

#include "engine/gpu/commands.h"
#include "engine/gpu/context.h"
#include "engine/stages/workgroups.h"
#include "shaders/edge_residual.spv.h"
#include "shaders/edge_sources.spv.h"

namespace palpate {

EdgeSources::EdgeSources(gpu::Context& context, const Capacitance& edge, const Grid& grid) {
  const auto cells = static_cast<uint32_t>(edge.cells.size()), row = grid.pitch * 4;
  const uint32_t in_fours = (cells + 3) / 4;
  push_ = {cells, in_fours, row, row * grid.height, 0};
  const auto upload = [&](const char* name, uint64_t words) {
    return gpu::DeviceBuffer(context, name, words * 4, gpu::Memory::Constant);
  };
  cells_ = upload("edge cells", cells);
  weights_ = upload("edge weights", uint64_t{cells} * 4);
  matrix_ = upload("edge matrix", uint64_t{cells} * in_fours * 4);
  for (uint32_t i = 0; i < cells; ++i) {
    const EdgeCell& cell = edge.cells[i];
    cells_.as<uint32_t>()[i] = cell.y * row + cell.x;
    const float weights[] = {cell.left, cell.right, cell.up, cell.down};
    std::copy_n(weights, 4, weights_.as<float>().begin() + std::ptrdiff_t{i} * 4);
  }
  const std::span<float> matrix = matrix_.as<float>();
  for (uint32_t column = 0; column < cells; ++column)
    for (uint32_t i = 0; i < in_fours * 4; ++i)
      matrix[size_t{column} * in_fours * 4 + i] = i < cells ? edge.sources[size_t{i} * cells + column] : 0.0f;
  for (const gpu::DeviceBuffer* buffer : {&cells_, &weights_, &matrix_}) buffer->flush();
  residual_ = gpu::DeviceBuffer(context, "edge residual", uint64_t{in_fours} * 16, gpu::Memory::Device);
  sources_ = gpu::DeviceBuffer(context, "edge sources", uint64_t{in_fours} * 16, gpu::Memory::Device);
  cell_words_ = gpu::TexelView(context, cells_, VK_FORMAT_R32_UINT);
  weight_texels_ = gpu::TexelView(context, weights_, VK_FORMAT_R32G32B32A32_SFLOAT);
  matrix_texels_ = gpu::TexelView(context, matrix_, VK_FORMAT_R32G32B32A32_SFLOAT);
  residual_words_ = gpu::TexelView(context, residual_, VK_FORMAT_R32_SFLOAT);
  source_words_ = gpu::TexelView(context, sources_, VK_FORMAT_R32_SFLOAT);
  using enum gpu::Binding;
  residual_kernel_ =
      gpu::Kernel(context, {"edge_residual", k_edge_residual},
                  {{Texels, Texels, Texels, Texels, Storage}, sizeof push_, {kWorkgroup, 1, 1}, {}});
  sources_kernel_ =
      gpu::Kernel(context, {"edge_sources", k_edge_sources},
                  {{Texels, Texels, Texels, Storage, Storage}, sizeof push_, {kWorkgroup, 1, 1}, {}});
}

void EdgeSources::record(gpu::Commands& commands, const FloatMap& right, const FloatMap& x,
                         bool first) const {
  shared::EdgePush push = push_;
  push.first = first ? 1 : 0;
  commands.dispatch(residual_kernel_, {&cell_words_, &weight_texels_, &x.words, &source_words_, &residual_},
                    push, workgroups(4 * push.groups));
  commands.barrier();
  commands.dispatch(sources_kernel_,
                    {&cell_words_, &matrix_texels_, &residual_words_, &sources_, &right.buffer}, push,
                    workgroups(push.groups));
  commands.barrier();
}

uint64_t EdgeSources::memory_bytes() const {
  return cells_.bytes() + weights_.bytes() + matrix_.bytes() + residual_.bytes() + sources_.bytes();
}

}  // namespace palpate
