#include "engine/fem/device/grid.h"

#include <algorithm>
#include <cstring>
#include <vector>

#include "engine/gpu/commands.h"
#include "engine/gpu/context.h"

namespace palpate::fem {
namespace {

constexpr uint32_t kSegmentOnGpu = 4;
/// Columns with which a processor's cores are busy without cutting them into segments.
constexpr uint32_t kColumnsOnCpu = 512;
constexpr uint64_t kSingleBytes = 16, kWideBytes = 32;  // of a node

}  // namespace

DeviceTexels::DeviceTexels(gpu::Context& context, const std::string& name, uint64_t bytes, VkFormat format)
    : buffer(context, name, bytes, gpu::Memory::Device), texels(context, buffer, format) {
  gpu::clear(context, buffer);
}

DeviceTexels::DeviceTexels(gpu::Context& context, const std::string& name, uint64_t bytes, VkFormat format,
                           std::span<const float> content)
    : buffer(context, name, bytes, gpu::Memory::Device), texels(context, buffer, format) {
  const auto fill = [&](const gpu::DeviceBuffer& target) {
    const std::span<float> values = target.as<float>();
    // As bytes: some of the words are no floats.
    std::memcpy(values.data(), content.data(), content.size_bytes());
    std::memset(values.data() + content.size(), 0, values.size_bytes() - content.size_bytes());
    target.flush();
  };
  if (buffer.mapped()) {
    fill(buffer);
    return;
  }
  const gpu::DeviceBuffer staging(context, name, bytes, gpu::Memory::Upload);
  fill(staging);
  gpu::run_once(context, [&](gpu::Commands& commands) {
    commands.copy(staging, buffer, bytes);
    commands.barrier();
  });
}

DeviceGrid::DeviceGrid(gpu::Context& context, const std::string& name, const Stiffness& stiffness,
                       const FixedNodes& fixed) {
  const CellGrid& grid = stiffness.grid();
  row_ = grid.cells[0] + 1;
  plane_ = row_ * (grid.cells[1] + 1);
  planes_ = grid.cells[2] + 1;
  segment_ = !context.is_software()       ? kSegmentOnGpu
             : columns() >= kColumnsOnCpu ? planes_
                                          : std::max(kSegmentOnGpu, planes_ * columns() / kColumnsOnCpu);
  first_layer_ = stiffness.layer(0);

  // With every node the four cells around it in the layer below: one texel instead of four.
  std::vector<float> moduli(4 * (nodes() + 2 * size_t{lead()}));
  for (uint32_t k = 0; k < grid.cells[2]; ++k)
    for (uint32_t j = 0; j < grid.cells[1]; ++j)
      for (uint32_t i = 0; i < grid.cells[0]; ++i)
        for (uint32_t corner = 0; corner < 4; ++corner)
          moduli[4 * (lead() + grid.node(i + (corner & 1), j + (corner >> 1), k)) + 3 - corner] =
              grid.young[grid.cell(i, j, k)];
  moduli_ = DeviceTexels(context, name + " moduli", moduli.size() * sizeof(float),
                         VK_FORMAT_R32G32B32A32_SFLOAT, moduli);

  const std::vector<float> blocks = stiffness.inverse_blocks(fixed);
  std::vector<float> inverse(8 * size_t{nodes()});
  for (size_t n = 0; n < nodes(); ++n) {
    for (size_t s = 0; s < 3; ++s) {
      inverse[8 * n + s] = blocks[s * nodes() + n];
      inverse[8 * n + 4 + s] = blocks[(3 + s) * nodes() + n];
    }
    inverse[8 * n + 3] = static_cast<float>(~uint32_t{fixed[n]} & 7u);
  }
  inverse_ = DeviceTexels(context, name + " block inverses", inverse.size() * sizeof(float),
                          VK_FORMAT_R32G32B32A32_SFLOAT, inverse);

  const size_t spare = shared::kForwardSpareLayers, count = grid.cells[2] + 2 * spare;
  std::vector<float> layers(4 * count);
  std::vector<double> wide(2 * count);
  for (size_t l = 0; l < count; ++l) {
    const bool inside = l >= spare && l < spare + grid.cells[2];
    const double height = inside ? grid.size_z_mm[l - spare] / grid.size_z_mm[0] : 1;
    layered_ = layered_ || height != 1;
    layers[4 * l] = static_cast<float>(height);
    layers[4 * l + 1] = static_cast<float>(1 / height);
    wide[2 * l] = height;
    wide[2 * l + 1] = 1 / height;
  }
  std::vector<float> words(4 * count);
  std::memcpy(words.data(), wide.data(), words.size() * sizeof(float));
  layers_ = DeviceTexels(context, name + " layers", 16 * count, VK_FORMAT_R32G32B32A32_SFLOAT, layers);
  wide_layers_ = DeviceTexels(context, name + " wide layers", 16 * count, VK_FORMAT_R32G32B32A32_UINT, words);
}

DeviceTexels DeviceGrid::single_vector(gpu::Context& context, const std::string& name) const {
  return {context, name, (nodes() + 2 * uint64_t{lead()}) * kSingleBytes, VK_FORMAT_R32G32B32A32_SFLOAT};
}

DeviceTexels DeviceGrid::wide_vector(gpu::Context& context, const std::string& name) const {
  return {context, name, (nodes() + 2 * uint64_t{lead()}) * kWideBytes, VK_FORMAT_R32G32B32A32_UINT};
}

std::array<uint32_t, 3> DeviceGrid::product_groups() const {
  return {(columns() + kWorkgroup - 1) / kWorkgroup, segments(), 1};
}

std::array<uint32_t, 3> DeviceGrid::node_groups() const {
  return {(nodes() + kWorkgroup - 1) / kWorkgroup, 1, 1};
}

std::array<uint32_t, 3> DeviceGrid::vector_groups() const {
  return {(nodes() + kWorkgroup * kNodesEach - 1) / (kWorkgroup * kNodesEach), 1, 1};
}

shared::ForwardStepPush DeviceGrid::step_push(double keep, double gain) const {
  const auto& s = first_layer_;
  const auto real = [](double x) { return static_cast<float>(x); };
  return {row_,
          plane_,
          planes_,
          lead(),
          segment_,
          real(keep),
          real(gain),
          {real(s.bulk), real(s.twice_mu), real(s.gx), real(s.gy), real(s.gz), real(s.xx), real(s.yy),
           real(s.zz), real(s.xy), real(s.xz), real(s.yz)}};
}

shared::ForwardWidePush DeviceGrid::wide_push() const {
  const auto& s = first_layer_;
  return {row_,
          plane_,
          planes_,
          lead(),
          segment_,
          0,
          {s.bulk, s.twice_mu, s.gx, s.gy, s.gz, s.xx, s.yy, s.zz, s.xy, s.xz, s.yz}};
}

shared::ForwardNodesPush DeviceGrid::nodes_push(double gain) const {
  return {nodes(), lead(), static_cast<float>(gain)};
}

uint64_t DeviceGrid::bytes() const {
  return moduli_.buffer.bytes() + inverse_.buffer.bytes() + layers_.buffer.bytes() +
         wide_layers_.buffer.bytes();
}

}  // namespace palpate::fem
