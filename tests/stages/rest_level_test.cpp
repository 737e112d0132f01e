// The rest level's records: those of the kernel are those that the host finds of the same heights.
#include "engine/stages/surface/rest_level.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "engine/gpu/commands.h"
#include "engine/gpu/tuning.h"
#include "engine/stages/frame/contact.h"
#include "tests/support/gpu_fixture.h"

namespace palpate {
namespace {

using RestLevelTest = GpuTest;

TEST_F(RestLevelTest, HostFindsWhatTheKernelDoes) {
  for (const auto& [width, height] : {std::array{379u, 277u}, {640u, 480u}, {33u, 18u}}) {
    Sensor sensor;
    sensor.size_px = {width, height};
    const Contact contact(context(), sensor, {width, height, 1, 8}, false, default_tuning(context()), false);
    const Grid grid = grid_for(width, height);
    const RestLevel level(context(), contact, grid, default_tuning(context()));
    const FloatMap depth(context(), "depth", grid);
    const gpu::DeviceBuffer from(context(), "heights", grid.bytes(), gpu::Memory::Upload);
    const gpu::DeviceBuffer touched(context(), "contact", contact.record_bytes(), gpu::Memory::Upload);
    const gpu::DeviceBuffer records(context(), "records", level.record_bytes(), gpu::Memory::Readback);
    const HeightRows heights{from.as<float>(), width, height, grid.pitch * 4};
    std::ranges::fill(heights.values, std::numeric_limits<float>::quiet_NaN());  // padding must not matter
    for (uint32_t y = 0; y < height; ++y)
      for (uint32_t x = 0; x < width; ++x)
        heights.row(y)[x] = static_cast<float>(0.3 + std::sin(x / 9.0) * std::cos(y / 7.0) - 1e-3 * x);
    const auto contacts = touched.as<shared::ContactRecord>();
    std::ranges::fill(contacts, shared::ContactRecord{});
    for (size_t tile = 0; tile < contact.tiles(); tile += 3) contacts[tile].area = 5;
    from.flush();
    touched.flush();
    gpu::run_once(context(), [&](gpu::Commands& commands) {
      commands.copy(from, depth.buffer, grid.bytes());
      commands.barrier();
      level.record(commands, depth, touched, records);
      commands.host_barrier();
    });
    records.invalidate();
    std::vector<shared::RestLevelRecord> by_host(contact.tiles());
    level.measure(heights, contacts, by_host);
    for (size_t tile = 0; tile < contact.tiles(); ++tile) {
      const shared::RestLevelRecord& by_kernel = records.as<const shared::RestLevelRecord>()[tile];
      ASSERT_EQ(by_host[tile].pixels, by_kernel.pixels) << tile;
      ASSERT_EQ(by_host[tile].highest, by_kernel.highest) << tile;
      ASSERT_NEAR(by_host[tile].mean, by_kernel.mean, 1e-6) << tile;
    }
  }
}

}  // namespace
}  // namespace palpate
