#include "perf/rivals/vkfft_poisson.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#define VKFFT_BACKEND 0  // Vulkan
#include <vkFFT.h>

#include "engine/gpu/buffer.h"
#include "engine/gpu/commands.h"
#include "engine/gpu/context.h"
#include "engine/gpu/kernel.h"
#include "palpate/error.h"
#include "shaders/scale_spectrum.spv.h"

namespace palpate::perf {
namespace {

constexpr uint32_t kWorkgroup = 256;

void check(VkFFTResult error, const char* what) {
  if (error != VKFFT_SUCCESS)
    throw Error(Failure::Device, std::string("VkFFT: ") + what, "its error " + std::to_string(error),
                "another size");
}

// Of other sizes its cosine transforms are wrong.
bool has_small_factors(uint32_t n) {
  for (const uint32_t factor : {2u, 3u, 5u, 7u, 11u, 13u})
    while (n % factor == 0) n /= factor;
  return n == 1;
}

}  // namespace

struct VkfftPoisson::Impl {
  gpu::Context& context;
  uint32_t width, height;
  gpu::DeviceBuffer upload, right, spectrum, scale, readback;
  gpu::Kernel divide;
  // VkFFT keeps pointers to these.
  VkPhysicalDevice physical_device;
  VkDevice device;
  VkQueue queue;
  VkCommandPool pool = VK_NULL_HANDLE;
  VkFence fence = VK_NULL_HANDLE;
  VkBuffer work = VK_NULL_HANDLE;
  uint64_t bytes = 0;
  VkFFTApplication plan{};

  void send(const gpu::DeviceBuffer& to) const {
    upload.flush();
    gpu::run_once(context, [&](gpu::Commands& commands) {
      commands.copy(upload, to, upload.bytes());
      commands.barrier();
    });
  }
  void append(gpu::Commands& commands, bool inverse) {
    VkCommandBuffer buffer = commands.handle();
    VkFFTLaunchParams launch{};
    launch.commandBuffer = &buffer;
    launch.buffer = &work;
    check(VkFFTAppend(&plan, inverse ? 1 : -1, &launch), "a transform");
    commands.barrier();
  }
};

VkfftPoisson::VkfftPoisson(gpu::Context& context, uint32_t width, uint32_t height)
    : impl_(new Impl{context,
                     width,
                     height,
                     {},
                     {},
                     {},
                     {},
                     {},
                     {},
                     context.physical_device(),
                     context.device(),
                     context.queue()}) {
  if (!has_small_factors(width) || !has_small_factors(height))
    throw Error(Failure::Usage, "sides without prime factors above 13 for VkFFT",
                std::to_string(width) + " x " + std::to_string(height), "the next larger size of that kind");
  Impl& m = *impl_;
  const uint64_t bytes = m.bytes = uint64_t{width} * height * sizeof(float);
  m.upload = gpu::DeviceBuffer(context, "VkFFT's upload", bytes, gpu::Memory::Upload);
  m.readback = gpu::DeviceBuffer(context, "VkFFT's readback", bytes, gpu::Memory::Readback);
  m.right = gpu::DeviceBuffer(context, "VkFFT's right side", bytes, gpu::Memory::Device);
  m.spectrum = gpu::DeviceBuffer(context, "VkFFT's spectrum", bytes, gpu::Memory::Device);
  m.scale = gpu::DeviceBuffer(context, "inverse eigenvalues", bytes, gpu::Memory::Device);
  m.divide =
      gpu::Kernel(context, {"scale_spectrum", k_scale_spectrum},
                  {{gpu::Binding::Storage, gpu::Binding::Storage}, sizeof(uint32_t), {kWorkgroup, 1, 1}, {}});
  const std::span<float> scale = m.upload.as<float>();
  for (uint32_t y = 0; y < height; ++y)
    for (uint32_t x = 0; x < width; ++x) {
      const double eigenvalue =
          4 - 2 * std::cos(std::numbers::pi * x / width) - 2 * std::cos(std::numbers::pi * y / height);
      scale[size_t{y} * width + x] = x + y ? static_cast<float>(1 / eigenvalue) : 0.0f;
    }
  m.send(m.scale);

  const VkCommandPoolCreateInfo pool{VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO, nullptr,
                                     VK_COMMAND_POOL_CREATE_RESET_COMMAND_BUFFER_BIT, context.queue_family()};
  const VkFenceCreateInfo fence{VK_STRUCTURE_TYPE_FENCE_CREATE_INFO, nullptr, 0};
  if (vkCreateCommandPool(m.device, &pool, nullptr, &m.pool) != VK_SUCCESS ||
      vkCreateFence(m.device, &fence, nullptr, &m.fence) != VK_SUCCESS)
    throw Error(Failure::Device, "a command pool and a fence for VkFFT", "none", "a device with free memory");
  m.work = m.spectrum.handle();
  VkFFTConfiguration c{};
  c.FFTdim = 2;
  c.size[0] = width;
  c.size[1] = height;
  c.performDCT = 2;
  c.normalize = 1;
  c.physicalDevice = &m.physical_device;
  c.device = &m.device;
  c.queue = &m.queue;
  c.commandPool = &m.pool;
  c.fence = &m.fence;
  c.buffer = &m.work;
  c.bufferSize = &m.bytes;
  check(initializeVkFFT(&m.plan, c), "a plan for this size");
}

VkfftPoisson::~VkfftPoisson() {
  Impl& m = *impl_;
  deleteVkFFT(&m.plan);
  vkDestroyFence(m.device, m.fence, nullptr);
  vkDestroyCommandPool(m.device, m.pool, nullptr);
}

void VkfftPoisson::set_right_side(std::span<const float> right) {
  std::copy(right.begin(), right.end(), impl_->upload.as<float>().begin());
  impl_->send(impl_->right);
}

void VkfftPoisson::record(gpu::Commands& commands) {
  Impl& m = *impl_;
  // It transforms in place; the right side must outlast the solve.
  commands.copy(m.right, m.spectrum, m.bytes);
  commands.barrier();
  m.append(commands, false);
  const uint32_t count = m.width * m.height;
  commands.dispatch(m.divide, {&m.scale, &m.spectrum}, count, {(count + kWorkgroup - 1) / kWorkgroup, 1, 1});
  commands.barrier();
  m.append(commands, true);
}

std::vector<float> VkfftPoisson::heights() const {
  const Impl& m = *impl_;
  gpu::run_once(m.context, [&](gpu::Commands& commands) {
    commands.copy(m.spectrum, m.readback, m.readback.bytes());
    commands.host_barrier();
  });
  m.readback.invalidate();
  const std::span<const float> z = m.readback.as<float>();
  return {z.begin(), z.begin() + m.width * size_t{m.height}};
}

}  // namespace palpate::perf
