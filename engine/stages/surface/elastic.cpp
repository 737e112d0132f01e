#include "engine/stages/surface/elastic.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/base/divide_up.h"
#include "engine/gpu/commands.h"
#include "engine/gpu/context.h"
#include "engine/stages/frame/contact.h"
#include "shaders/elastic_border.spv.h"
#include "shaders/elastic_coarsest.spv.h"
#include "shaders/elastic_finest.spv.h"
#include "shaders/elastic_level.spv.h"
#include "shaders/elastic_pressure.spv.h"
#include "shaders/elastic_restrict.spv.h"

namespace palpate {
namespace {

constexpr uint32_t kStripRowsOnCpu = 32;  // even; longer strips waste less on the rows that they only look at
constexpr uint32_t kStripRowsOnGpu = 8;
// More than this cost a GPU registers; surface_workgroup may be that of a tile.
constexpr uint32_t kMostElasticInvocations = 64;
// A saturating response is read up to here: beyond, a gray level is worth more than 2 % of the pressure.
constexpr double kReadableFraction = 0.98;

}  // namespace

Elastic::Elastic(gpu::Context& context, const ElasticPlan& plan, const Tuning& tuning)
    : grid_(grid_for(plan.levels.front().width, plan.levels.front().height)),
      strip_rows_(context.is_software() ? kStripRowsOnCpu : kStripRowsOnGpu),
      workgroup_(std::min(tuning.surface_workgroup, kMostElasticInvocations)) {
  const uint32_t margin = shared::kElasticMargin;
  for (const ElasticLevel& from : plan.levels) {
    const std::string name = "elastic level " + std::to_string(levels_.size());
    Level level;
    level.width = from.width;
    level.height = from.height;
    level.pitch = divide_up(from.width, 4) + margin / 2;
    level.rows = from.height + 2 * margin;
    const Grid stored{level.pitch * 4, level.rows, level.pitch};
    level.pressure = FloatMap(context, name + " pressure", stored);
    gpu::clear(context, level.pressure.buffer);  // its margins are read but never written
    if (!levels_.empty()) level.answer = FloatMap(context, name + " answer", stored);
    level.stencil = from.stencil;
    levels_.push_back(std::move(level));
  }

  // The table for signed distances along the row, so that the kernel reads it in whole texels.
  const Level& last = levels_.back();
  const uint32_t columns = divide_up(last.width, 4) + 2, rows = last.height + 2 * shared::kElasticReach;
  table_pitch_ = 2 * columns + 2;
  table_ =
      gpu::DeviceBuffer(context, "elastic table", uint64_t{table_pitch_} * rows * 16, gpu::Memory::Constant);
  const std::span<float> table = table_.as<float>();
  const int64_t middle = int64_t{table_pitch_} / 2 * 4;
  for (uint32_t y = 0; y < rows; ++y) {
    for (uint32_t x = 0; x < table_pitch_ * 4; ++x) {
      const int64_t away = std::abs(int64_t{x} - middle);
      table[size_t{y} * table_pitch_ * 4 + x] =
          away < plan.table_width ? plan.table[size_t{y} * plan.table_width + static_cast<size_t>(away)] : 0;
    }
  }
  table_.flush();
  table_texels_ = gpu::TexelView(context, table_, VK_FORMAT_R32G32B32A32_SFLOAT);

  using enum gpu::Binding;
  const auto make = [&](const gpu::Shader& shader, std::vector<gpu::Binding> bindings, uint32_t push_bytes) {
    return gpu::Kernel(context, shader, {std::move(bindings), push_bytes, {workgroup_, 1, 1}, {}});
  };
  constexpr uint32_t kPush = sizeof(shared::ElasticPush);
  restrict_kernel_ = make({"elastic_restrict", k_elastic_restrict}, {Texels, Storage}, kPush);
  finest_kernel_ = make({"elastic_finest", k_elastic_finest}, {Texels, Texels, Storage}, kPush);
  coarsest_kernel_ = make({"elastic_coarsest", k_elastic_coarsest}, {Texels, Texels, Storage},
                          sizeof(shared::ElasticCoarsestPush));
  if (levels_.size() > 2)
    level_kernel_ = make({"elastic_level", k_elastic_level}, {Texels, Texels, Storage}, kPush);
}

Elastic::Elastic(gpu::Context& context, const LayerKernel& kernel, uint32_t width, uint32_t height,
                 const Tuning& tuning)
    : Elastic(context, ElasticPlan(kernel, width, height), tuning) {}

Elastic::Elastic(gpu::Context& context, const Sensor& sensor, const FrameFormat& format,
                 const Contact& contact, const Tuning& tuning)
    : Elastic(context, LayerKernel(pad_of(sensor.elastic), sensor.pitch_mm_per_px), format.width,
              format.height, tuning) {
  using enum gpu::Binding;
  const ElasticCalibration& pad = sensor.elastic;
  const double units = contact.filtered_units_per_gray();
  const bool saturating = pad.limit_gray > 0;
  shared::ElasticPressurePush& p = pressure_push_;
  p.width = format.width;
  p.height = format.height;
  p.in_pitch = contact.tiles_x() * contact.tile_columns() / 8;
  p.pitch = levels_.front().pitch;
  p.rows = strip_rows_;
  p.threshold = static_cast<float>(sensor.threshold_gray * units);
  p.scale = static_cast<float>(1 / (pad.gray_per_MPa * units));
  p.limit = static_cast<float>(pad.limit_gray * units);
  p.top = static_cast<float>(saturating ? largest_readable_gray(pad) * units : 0);
  filtered_ = gpu::TexelView(context, contact.filtered(), VK_FORMAT_R32G32B32A32_UINT);
  pressure_kernel_ = gpu::Kernel(context, {"elastic_pressure", k_elastic_pressure},
                                 {{Texels, Storage}, sizeof p, {workgroup_, 1, 1}, {saturating ? 1u : 0u}});
  border_kernel_ = gpu::Kernel(context, {"elastic_border", k_elastic_border},
                               {{Texels, Texels, Storage}, sizeof p, {workgroup_, 1, 1}, {}});
}

uint32_t Elastic::pressure_start() const {
  return shared::kElasticMargin * pressure_pitch() + shared::kElasticMargin;
}

std::array<uint32_t, 3> Elastic::groups(uint32_t invocations) const {
  return {divide_up(invocations, workgroup_), 1, 1};
}

/// For the kernels between level `l` and the next coarser one; width and height of the one that is written
/// are the caller's.
shared::ElasticPush Elastic::push(size_t l, uint32_t strip_rows) const {
  const Level& fine = levels_[l];
  const Level& coarse = levels_[l + 1];
  shared::ElasticPush p{};
  p.pitch = fine.pitch;
  p.total = fine.total();
  p.coarse_pitch = coarse.pitch;
  p.coarse_total = coarse.total();
  p.rows = strip_rows;
  std::copy(fine.stencil.begin(), fine.stencil.end(), p.stencil);
  return p;
}

void Elastic::record_pressure(gpu::Commands& commands, const gpu::DeviceBuffer& border) const {
  const auto scope = commands.scope("pressure");
  const FloatMap& to = levels_.front().pressure;
  const uint32_t invocations =
      divide_up(pressure_push_.width, 8) * divide_up(pressure_push_.height, pressure_push_.rows);
  commands.dispatch(pressure_kernel_, {&filtered_, &to.buffer}, pressure_push_, groups(invocations));
  commands.barrier();
  commands.dispatch(border_kernel_, {&to.texels, &to.words, &border}, pressure_push_,
                    groups(shared::kElasticBorderRecords));
  commands.barrier();
}

void Elastic::record_deflection(gpu::Commands& commands, const FloatMap& depth) const {
  const auto scope = commands.scope("elastic");
  const uint32_t both_reaches = 2 * shared::kElasticReach;
  const size_t last = levels_.size() - 1;
  // Small levels want many short strips, or one core does them alone.
  const auto strip = [&](const Level& level) { return level.total() >= 16384 ? strip_rows_ : 8u; };
  for (size_t l = 0; l < last; ++l) {
    const Level& coarse = levels_[l + 1];
    shared::ElasticPush p = push(l, std::min(strip(coarse), 16u));
    p.width = coarse.width;
    p.height = coarse.height;
    p.out_pitch = coarse.pitch;
    const uint32_t columns = divide_up(coarse.width, 4) + 2;
    commands.dispatch(restrict_kernel_, {&levels_[l].pressure.texels, &coarse.pressure.buffer}, p,
                      groups(columns * divide_up(coarse.height + both_reaches, p.rows)));
    commands.barrier();
  }
  {
    const Level& coarsest = levels_[last];
    const shared::ElasticCoarsestPush p{coarsest.width, coarsest.height, coarsest.pitch, table_pitch_};
    commands.dispatch(coarsest_kernel_, {&table_texels_, &coarsest.pressure.texels, &coarsest.answer.buffer},
                      p, groups((divide_up(coarsest.width, 4) + 2) * (coarsest.height + both_reaches)));
    commands.barrier();
  }
  for (size_t l = last; l-- > 0;) {
    const Level& level = levels_[l];
    shared::ElasticPush p = push(l, strip(level));
    p.width = level.width;
    p.height = level.height;
    p.out_pitch = l == 0 ? grid_.pitch : level.pitch;
    const uint32_t texels = divide_up(level.width, 4);
    const uint32_t columns = l == 0 ? divide_up(texels, 2) : (texels + 2) / 2 + 1;
    const uint32_t strips = divide_up(level.height + (l == 0 ? 0 : both_reaches), p.rows);
    commands.dispatch(l == 0 ? finest_kernel_ : level_kernel_,
                      {&level.pressure.texels, &levels_[l + 1].answer.texels,
                       l == 0 ? &depth.buffer : &level.answer.buffer},
                      p, groups(columns * strips));
    commands.barrier();
  }
}

bool Elastic::touches_border(std::span<const float> border) {
  return std::any_of(border.begin(), border.end(), [](float pressure) { return pressure > 0; });
}

double Elastic::largest_readable_gray(const ElasticCalibration& pad) {
  return pad.limit_gray > 0 ? kReadableFraction * pad.limit_gray : std::numeric_limits<double>::infinity();
}

uint64_t Elastic::memory_bytes() const {
  uint64_t bytes = table_.bytes();
  for (const Level& level : levels_) bytes += level.pressure.buffer.bytes() + level.answer.buffer.bytes();
  return bytes;
}

}  // namespace palpate
