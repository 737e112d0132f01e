// One grid of the forward model on a Vulkan device: its moduli, layers, block inverses and supports, as the
// forward_*.comp kernels read them.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "engine/fem/linear/stiffness.h"
#include "engine/gpu/buffer.h"
#include "shaders/shared/forward.h"

namespace palpate::fem {

/// A buffer that kernels read as texels and write as storage.
struct DeviceTexels {
  gpu::DeviceBuffer buffer;
  gpu::TexelView texels;

  DeviceTexels() = default;
  /// Zeros.
  DeviceTexels(gpu::Context& context, const std::string& name, uint64_t bytes, VkFormat format);
  /// Holds `content`, padded with zeros to `bytes`.
  DeviceTexels(gpu::Context& context, const std::string& name, uint64_t bytes, VkFormat format,
               std::span<const float> content);
};

class DeviceGrid {
 public:
  /// Copies what it needs of the grid.
  DeviceGrid(gpu::Context& context, const std::string& name, const Stiffness& stiffness,
             const FixedNodes& fixed);

  /// A vector of three numbers a node, zeros: `single_vector` R32G32B32A32 floats, one texel a node,
  /// `wide_vector` doubles, two texels a node; both with a lead and a tail of lead() nodes.
  DeviceTexels single_vector(gpu::Context& context, const std::string& name) const;
  DeviceTexels wide_vector(gpu::Context& context, const std::string& name) const;

  uint32_t nodes() const { return plane_ * planes_; }
  uint32_t lead() const { return plane_ + row_ + 1; }
  uint32_t row() const { return row_; }
  uint32_t plane() const { return plane_; }
  bool layered() const { return layered_; }  ///< layers of unequal height
  /// Invocations of a product: one for each column of nodes and segment of planes.
  uint32_t columns() const { return plane_; }
  uint32_t segments() const { return (planes_ + segment_ - 1) / segment_; }
  std::array<uint32_t, 3> product_groups() const;
  std::array<uint32_t, 3> node_groups() const;
  std::array<uint32_t, 3> vector_groups() const;  ///< of kernels that take kNodesEach nodes an invocation

  shared::ForwardStepPush step_push(double keep, double gain) const;
  shared::ForwardWidePush wide_push() const;
  shared::ForwardNodesPush nodes_push(double gain) const;

  const DeviceTexels& moduli() const { return moduli_; }
  const DeviceTexels& inverse() const { return inverse_; }
  const DeviceTexels& layers() const { return layers_; }
  const DeviceTexels& wide_layers() const { return wide_layers_; }
  uint64_t bytes() const;

  static constexpr uint32_t kWorkgroup = 64;
  static constexpr uint32_t kNodesEach = 8;

 private:
  uint32_t row_, plane_, planes_, segment_;
  bool layered_ = false;
  LayerStiffness<double> first_layer_;
  DeviceTexels moduli_, inverse_, layers_, wide_layers_;
};

}  // namespace palpate::fem
