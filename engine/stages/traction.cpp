#include "engine/stages/traction.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "engine/base/divide_up.h"
#include "engine/gpu/commands.h"
#include "engine/gpu/context.h"
#include "engine/pad/layer_kernel.h"
#include "palpate/error.h"
#include "shaders/traction_back_depth.spv.h"
#include "shaders/traction_back_gradient.spv.h"
#include "shaders/traction_back_right.spv.h"
#include "shaders/traction_back_unexplained.spv.h"
#include "shaders/traction_columns.spv.h"
#include "shaders/traction_columns_contact.spv.h"
#include "shaders/traction_direction.spv.h"
#include "shaders/traction_finish.spv.h"
#include "shaders/traction_laplacian.spv.h"
#include "shaders/traction_prepare.spv.h"
#include "shaders/traction_rows.spv.h"
#include "shaders/traction_rows_contact.spv.h"
#include "shaders/traction_start.spv.h"
#include "shaders/traction_step.spv.h"

namespace palpate {
namespace {

// A processor's threads take whole workgroups: small ones, so that none waits for the last; and long blocks,
// since arithmetic costs less there than what it is fetched with.
constexpr TractionStage::Blocks kOnCpu{16, 32, 8, 8}, kOnGpu{64, 128, 1, 2};

uint32_t padded(uint32_t cells) {
  return divide_up(cells, shared::kTractionBlock) * shared::kTractionBlock;
}

}  // namespace

TractionStage::Blocks TractionStage::blocks_for(const gpu::Context& context) {
  return context.is_software() ? kOnCpu : kOnGpu;
}

TractionStage::TractionStage(gpu::Context& context, const Pad& pad, const TractionGrid& grid,
                             const TractionOptions& options, uint32_t iterations)
    : TractionStage(context, pad, grid, options, iterations, blocks_for(context)) {}

TractionStage::TractionStage(gpu::Context& context, const Pad& pad, const TractionGrid& grid,
                             const TractionOptions& options, uint32_t iterations, const Blocks& blocks)
    : grid_(grid), iterations_(iterations), blocks_(blocks) {
  check_traction(grid, options);
  if (iterations == 0)
    throw Error(Failure::Input, "iterations of the traction stage", "none", "TractionStage::kIterations");
  const LayerKernel kernel(pad, grid.cell_mm);
  const TractionWeights weights = traction_weights(pad.material, options);
  push_.width = grid.width;
  push_.height = grid.height;
  push_.pitch = padded(grid.width) / 4;
  push_.rows = padded(grid.height);
  push_.row_block = blocks_.row_block;
  push_.column_block = blocks_.column_block;
  push_.workgroup = blocks_.workgroup;
  push_.per_cell2 = static_cast<float>(1 / (grid.cell_mm * grid.cell_mm));
  push_.prior = static_cast<float>(weights.prior);
  push_.first_step = static_cast<float>(weights.first_step);
  push_.tolerance = static_cast<float>(options.tolerance);
  push_.cell_mm = static_cast<float>(grid.cell_mm);
  const Grid cells{padded(grid.width), push_.rows, push_.pitch};
  for (const auto& [map, name] :
       {std::pair{&depth_, "depth"}, std::pair{&known_, "known"}, std::pair{&contact_, "contact"},
        std::pair{&pressure_, "pressure"}, std::pair{&gradient_, "gradient"},
        std::pair{&direction_, "direction"}, std::pair{&moved_, "moved"},
        std::pair{&unexplained_, "unexplained"}, std::pair{&laplacian_, "laplacian"}})
    *map = FloatMap(context, std::string("traction ") + name, cells);
  const Grid both{cells.width, 2 * cells.height, cells.pitch};
  mixed_ = FloatMap(context, "traction waves of rows", both);
  answered_ = FloatMap(context, "traction answered waves", both);
  const uint32_t sums = push_.pitch / 2 * (push_.rows / blocks_.row_block);
  sums_ = gpu::DeviceBuffer(context, "traction sums", uint64_t{sums} * 16, gpu::Memory::Device);
  sum_texels_ = gpu::TexelView(context, sums_, VK_FORMAT_R32G32B32A32_SFLOAT);
  state_ = gpu::DeviceBuffer(context, "traction state", sizeof(shared::TractionState), gpu::Memory::Device);
  groups_ = gpu::DeviceBuffer(context, "traction groups", shared::kTractionDispatches * gpu::kIndirectBytes,
                              gpu::Memory::Device);
  forget(context);
  make_tables(context, kernel);
  make_kernels(context);
}

void TractionStage::make_tables(gpu::Context& context, const LayerKernel& kernel) {
  const uint32_t width = grid_.width, height = grid_.height, period = 2 * width - 2;
  const uint32_t cells = padded(width), rows = push_.rows;
  // By numbers of quarter turns' parts, so that long rows lose no digits.
  std::vector<double> cosines(2 * size_t{period}), sines(cosines.size());
  for (size_t i = 0; i < cosines.size(); ++i) {
    const double angle = std::numbers::pi * static_cast<double>(i) / period;
    cosines[i] = std::cos(angle);
    sines[i] = std::sin(angle);
  }
  const auto upload = [&](FloatMap& map, const char* name, uint32_t lines, const std::vector<float>& values) {
    map = FloatMap(context, name, {cells, lines, push_.pitch});
    const gpu::DeviceBuffer from(context, name, map.buffer.bytes(), gpu::Memory::Upload);
    std::ranges::copy(values, from.as<float>().begin());
    from.flush();
    gpu::run_once(context, [&](gpu::Commands& commands) {
      commands.copy(from, map.buffer, from.bytes());
      commands.barrier();
    });
  };
  std::vector<float> waves(size_t{cells} * cells);
  for (uint32_t x = 0; x < cells / 2; ++x)
    for (uint32_t k = 0; k < width; ++k) {
      // Left of the middle by (cells - 1) / 2 - x; half cells make the table's steps half as long.
      const size_t half_cells = cells - 1 - 2 * size_t{x}, turn = half_cells * k % (2 * size_t{period});
      waves[2 * size_t{x} * cells + k] = static_cast<float>(cosines[turn]);
      waves[(2 * size_t{x} + 1) * cells + k] = -static_cast<float>(sines[turn]);
    }
  upload(waves_, "traction waves", cells, waves);
  std::vector<float> answers(size_t{2 * rows - 1} * cells);
  std::vector<double> row(width);
  for (uint32_t dy = 0; dy < height; ++dy) {
    for (uint32_t dx = 0; dx < width; ++dx) row[dx] = kernel.depth(dx, dy);
    for (uint32_t k = 0; k < width; ++k) {
      double sum = row[0] + (k % 2 == 0 ? 1 : -1) * row[width - 1];
      for (size_t dx = 1; dx + 1 < width; ++dx)
        sum += 2 * row[dx] * cosines[2 * dx * k % (2 * size_t{period})];
      const auto value = static_cast<float>(sum * (k == 0 || k + 1 == width ? 1 : 2) / period);
      answers[size_t{rows - 1 + dy} * cells + k] = answers[size_t{rows - 1 - dy} * cells + k] = value;
    }
  }
  upload(answers_, "traction answers", 2 * rows - 1, answers);
}

void TractionStage::make_kernels(gpu::Context& context) {
  using enum gpu::Binding;
  const auto make = [&](const gpu::Shader& shader, std::vector<gpu::Binding> bindings, uint32_t local,
                        std::vector<uint32_t> constants) {
    return gpu::Kernel(context, shader,
                       {std::move(bindings), sizeof push_, {local, 1, 1}, std::move(constants)});
  };
  prepare_kernel_ = make({"traction_prepare", k_traction_prepare},
                         {Texels, Texels, Storage, Storage, Storage, Storage}, blocks_.workgroup, {});
  laplacian_kernel_ =
      make({"traction_laplacian", k_traction_laplacian}, {Texels, Texels, Storage}, blocks_.workgroup, {});
  const std::vector<gpu::Binding> transform{Texels, Texels, Storage, Storage};
  rows_kernel_ = make({"traction_rows", k_traction_rows}, transform, blocks_.workgroup, {blocks_.row_block});
  rows_contact_kernel_ = make({"traction_rows_contact", k_traction_rows_contact}, transform,
                              blocks_.workgroup, {blocks_.row_block});
  columns_kernel_ =
      make({"traction_columns", k_traction_columns}, transform, blocks_.workgroup, {blocks_.column_block});
  columns_contact_kernel_ = make({"traction_columns_contact", k_traction_columns_contact}, transform,
                                 blocks_.workgroup, {blocks_.column_block});
  back_depth_kernel_ =
      make({"traction_back_depth", k_traction_back_depth}, transform, blocks_.workgroup, {blocks_.row_block});
  back_unexplained_kernel_ =
      make({"traction_back_unexplained", k_traction_back_unexplained},
           {Texels, Texels, Storage, Storage, Texels}, blocks_.workgroup, {blocks_.row_block});
  back_gradient_kernel_ = make({"traction_back_gradient", k_traction_back_gradient},
                               {Texels, Texels, Storage, Storage, Texels, Texels, Storage}, blocks_.workgroup,
                               {blocks_.row_block});
  back_right_kernel_ =
      make({"traction_back_right", k_traction_back_right}, {Texels, Texels, Storage, Storage, Texels},
           blocks_.workgroup, {blocks_.row_block});
  start_kernel_ = make({"traction_start", k_traction_start},
                       {Texels, Texels, Texels, Storage, Storage, Storage}, blocks_.lanes, {blocks_.lanes});
  direction_kernel_ =
      make({"traction_direction", k_traction_direction},
           {Texels, Texels, Texels, Texels, Storage, Storage, Storage}, blocks_.lanes, {blocks_.lanes});
  step_kernel_ =
      make({"traction_step", k_traction_step},
           {Texels, Texels, Texels, Texels, Texels, Texels, Storage, Storage, Texels, Storage, Storage},
           blocks_.lanes, {blocks_.lanes});
  finish_kernel_ = make({"traction_finish", k_traction_finish},
                        {Texels, Texels, Texels, Texels, Storage, Storage, Storage, Storage}, blocks_.lanes,
                        {blocks_.lanes});
}

TractionStage::Slot TractionStage::slot(gpu::Context& context) const {
  const uint64_t cells = uint64_t{grid_.width} * grid_.height;
  Slot slot;
  slot.depth = gpu::DeviceBuffer(context, "cell depths", cells * sizeof(float), gpu::Memory::Device);
  slot.depth_words = gpu::TexelView(context, slot.depth, VK_FORMAT_R32_SFLOAT);
  slot.flags = gpu::DeviceBuffer(context, "cell flags", cells, gpu::Memory::Constant);
  slot.flag_bytes = gpu::TexelView(context, slot.flags, VK_FORMAT_R8_UINT);
  slot.pressure = gpu::DeviceBuffer(context, "pressure", cells * sizeof(float), gpu::Memory::Readback);
  slot.state =
      gpu::DeviceBuffer(context, "traction result", sizeof(shared::TractionState), gpu::Memory::Readback);
  slot.records = gpu::DeviceBuffer(context, "traction records",
                                   blocks_.lanes * sizeof(shared::TractionRecord), gpu::Memory::Readback);
  write_masks(slot, {}, {});
  return slot;
}

void TractionStage::write_masks(const Slot& slot, std::span<const uint8_t> contact,
                                std::span<const uint8_t> known) const {
  const size_t cells = size_t{grid_.width} * grid_.height;
  for (const std::span<const uint8_t> mask : {contact, known})
    if (!mask.empty() && mask.size() != cells)
      throw Error(Failure::Input, "masks of " + std::to_string(cells) + " cells", std::to_string(mask.size()),
                  "masks of the stage's grid");
  const std::span<uint8_t> flags = slot.flags.as<uint8_t>();
  for (size_t i = 0; i < cells; ++i)
    flags[i] = static_cast<uint8_t>((contact.empty() || contact[i] != 0 ? shared::kTractionContact : 0) |
                                    (known.empty() || known[i] != 0 ? shared::kTractionKnown : 0));
  slot.flags.flush();
}

void TractionStage::forget(gpu::Context& context) const {
  gpu::clear(context, pressure_.buffer);
}

gpu::IndirectGroups TractionStage::counted(uint32_t dispatch) const {
  return {&groups_, dispatch};
}

// Leaves the waves of what pressure `from` does to the layer in answered_.
void TractionStage::press(gpu::Commands& commands, const FloatMap& from, uint32_t first) const {
  commands.dispatch(rows_contact_kernel_, {&from.texels, &waves_.texels, &state_, &mixed_.buffer}, push_,
                    counted(first));
  commands.barrier();
  commands.dispatch(columns_contact_kernel_, {&mixed_.texels, &answers_.texels, &state_, &answered_.buffer},
                    push_, counted(first + 1));
  commands.barrier();
}

// Gradient at the present pressure. The depth that it leaves is there already, where nothing was cut and
// nothing entered.
void TractionStage::gradient(gpu::Commands& commands) const {
  press(commands, pressure_, shared::kTractionFreshRows);
  commands.dispatch(back_unexplained_kernel_,
                    {&answered_.texels, &waves_.texels, &state_, &unexplained_.buffer, &depth_.texels}, push_,
                    counted(shared::kTractionFreshBack));
  commands.barrier();
  commands.dispatch(laplacian_kernel_, {&unexplained_.texels, &known_.texels, &laplacian_.buffer}, push_,
                    counted(shared::kTractionLaplacian));
  commands.barrier();
  commands.dispatch(rows_kernel_, {&laplacian_.texels, &waves_.texels, &state_, &mixed_.buffer}, push_,
                    counted(shared::kTractionGradientRows));
  commands.barrier();
  commands.dispatch(columns_kernel_, {&mixed_.texels, &answers_.texels, &state_, &answered_.buffer}, push_,
                    counted(shared::kTractionGradientColumns));
  commands.barrier();
  commands.dispatch(back_gradient_kernel_,
                    {&answered_.texels, &waves_.texels, &state_, &gradient_.buffer, &pressure_.texels,
                     &contact_.texels, &sums_},
                    push_, counted(shared::kTractionGradientBack));
  commands.barrier();
}

void TractionStage::iterate(gpu::Commands& commands) const {
  const auto scalars = counted(shared::kTractionScalars);
  commands.dispatch(direction_kernel_,
                    {&sum_texels_, &gradient_.texels, &pressure_.texels, &direction_.texels, &state_,
                     &direction_.buffer, &groups_},
                    push_, scalars);
  commands.barrier();
  press(commands, direction_, shared::kTractionMovedRows);
  commands.dispatch(back_depth_kernel_, {&answered_.texels, &waves_.texels, &state_, &moved_.buffer}, push_,
                    counted(shared::kTractionMovedBack));
  commands.barrier();
  commands.dispatch(
      step_kernel_,
      {&moved_.texels, &known_.texels, &direction_.texels, &gradient_.texels, &contact_.texels,
       &pressure_.texels, &state_, &pressure_.buffer, &unexplained_.texels, &unexplained_.buffer, &groups_},
      push_, scalars);
  commands.barrier();
  gradient(commands);
}

// Right side: the layer's response to the depth's divergence, in all of the grid.
void TractionStage::right_side(gpu::Commands& commands) const {
  const auto groups = [this](uint32_t invocations) {
    return std::array<uint32_t, 3>{(invocations + blocks_.workgroup - 1) / blocks_.workgroup, 1, 1};
  };
  commands.dispatch(laplacian_kernel_, {&depth_.texels, &known_.texels, &laplacian_.buffer}, push_,
                    groups(push_.pitch * push_.rows));
  commands.barrier();
  commands.dispatch(rows_kernel_, {&laplacian_.texels, &waves_.texels, &state_, &mixed_.buffer}, push_,
                    groups(push_.pitch * (push_.rows / blocks_.row_block)));
  commands.barrier();
  commands.dispatch(columns_kernel_, {&mixed_.texels, &answers_.texels, &state_, &answered_.buffer}, push_,
                    groups(push_.pitch * (push_.rows / blocks_.column_block)));
  commands.barrier();
  commands.dispatch(back_right_kernel_,
                    {&answered_.texels, &waves_.texels, &state_, &sums_, &contact_.texels}, push_,
                    groups(push_.pitch / 2 * (push_.rows / blocks_.row_block)));
  commands.barrier();
}

void TractionStage::record(gpu::Commands& commands, const Slot& slot) const {
  const auto scope = commands.scope("traction");
  constexpr std::array<uint32_t, 3> kOne{1, 1, 1};
  commands.dispatch(
      prepare_kernel_,
      {&slot.depth_words, &slot.flag_bytes, &depth_.buffer, &known_.buffer, &contact_.buffer, &state_}, push_,
      {(push_.pitch * push_.rows + blocks_.workgroup - 1) / blocks_.workgroup, 1, 1});
  commands.barrier();
  right_side(commands);
  commands.dispatch(start_kernel_,
                    {&sum_texels_, &contact_.texels, &pressure_.texels, &state_, &pressure_.buffer, &groups_},
                    push_, kOne);
  commands.barrier();
  gradient(commands);
  for (uint32_t i = 0; i < iterations_; ++i) iterate(commands);
  commands.dispatch(finish_kernel_,
                    {&sum_texels_, &pressure_.texels, &unexplained_.texels, &known_.texels, &state_,
                     &slot.pressure, &slot.state, &slot.records},
                    push_, kOne);
  commands.barrier();
}

TractionReading TractionStage::read(const Slot& slot) const {
  for (const gpu::DeviceBuffer* buffer : {&slot.pressure, &slot.state, &slot.records}) buffer->invalidate();
  const shared::TractionState& state = slot.state.as<const shared::TractionState>()[0];
  TractionReading reading;
  double force = 0, x = 0, y = 0, slopes2 = 0;
  uint64_t edges = 0, border = 0;
  for (const shared::TractionRecord& record : slot.records.as<const shared::TractionRecord>()) {
    force += double{record.pressure};
    x += double{record.pressure_x};
    y += double{record.pressure_y};
    slopes2 += double{record.slopes2};
    edges += record.edges;
    border += record.border;
  }
  const double area = grid_.cell_mm * grid_.cell_mm;
  reading.pressure_MPa = slot.pressure.as<const float>();
  reading.force_N = area * force;
  reading.mx_Nmm = area * y;
  reading.my_Nmm = -area * x;
  reading.residual = state.goal > 0 ? std::sqrt(double{state.residual2} / double{state.goal}) : 0;
  // Two edges, one each way, are one slope.
  reading.slope_rms = edges > 0 ? std::sqrt(slopes2 / (0.5 * static_cast<double>(edges))) : 0;
  reading.iterations = state.iterations;
  reading.converged = state.converged != 0;
  reading.at_border = border > 0;
  return reading;
}

uint64_t TractionStage::memory_bytes() const {
  uint64_t bytes = sums_.bytes() + state_.bytes() + groups_.bytes();
  for (const FloatMap* map : {&depth_, &known_, &contact_, &pressure_, &gradient_, &direction_, &moved_,
                              &unexplained_, &laplacian_, &mixed_, &answered_, &waves_, &answers_})
    bytes += map->buffer.bytes();
  return bytes;
}

}  // namespace palpate
