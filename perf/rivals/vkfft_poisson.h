// Poisson by VkFFT, on the Vulkan device that our own solver runs on.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace palpate::gpu {
class Commands;
class Context;
}  // namespace palpate::gpu

namespace palpate::perf {

/// Poisson with natural boundary by the discrete cosine transforms of VkFFT, single precision, everything on
/// the device.
class VkfftPoisson {
 public:
  /// Throws Error(Failure::Usage) for a side with a prime factor above 13, Error(Failure::Device) where VkFFT
  /// has no plan for the size.
  VkfftPoisson(gpu::Context& context, uint32_t width, uint32_t height);
  ~VkfftPoisson();
  VkfftPoisson(const VkfftPoisson&) = delete;
  VkfftPoisson& operator=(const VkfftPoisson&) = delete;

  /// height x width values.
  void set_right_side(std::span<const float> right);
  /// Right side to heights, of mean 0.
  void record(gpu::Commands& commands);
  /// Heights of the last submission: height x width values.
  std::vector<float> heights() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace palpate::perf
