#include "engine/stages/motion_sums.h"

#include <algorithm>
#include <cmath>

#include "engine/base/divide_up.h"
#include "engine/gpu/context.h"
#include "shaders/motion_residuals.spv.h"
#include "shaders/motion_scale.spv.h"
#include "shaders/motion_sums.spv.h"

namespace palpate {
namespace {

using gpu::Binding;
using Level = ContactSurface::Level;

constexpr uint32_t kPlanes = 4;

std::array<uint32_t, 3> groups_of(size_t pixels) {
  return {divide_up(static_cast<uint32_t>(pixels), shared::kMotionPixels), 1, 1};
}

gpu::Kernel sums_kernel(gpu::Context& context, bool judged) {
  return {context,
          {"motion_sums", k_motion_sums},
          {{Binding::Texels, Binding::Texels, Binding::Texels, Binding::Storage, Binding::Storage,
            Binding::Storage},
           sizeof(shared::MotionPush),
           {shared::kMotionLanes, 1, 1},
           {judged ? 1u : 0u}}};
}

}  // namespace

DeviceMotionSums::DeviceMotionSums(gpu::Context& context)
    : context_(context),
      residuals_(context, {"motion_residuals", k_motion_residuals},
                 {{Binding::Texels, Binding::Texels, Binding::Texels, Binding::Storage, Binding::Storage},
                  sizeof(shared::MotionPush),
                  {shared::kMotionLanes, 1, 1},
                  {}}),
      scale_of_(context, {"motion_scale", k_motion_scale},
                {{Binding::Storage, Binding::Storage, Binding::Storage},
                 sizeof(shared::MotionPush),
                 {shared::kMotionLanes, 1, 1},
                 {}}),
      step_(sums_kernel(context, false)),
      judge_(sums_kernel(context, true)),
      commands_(context),
      bins_(context, "motion bins", shared::kSizeBins * sizeof(uint32_t), gpu::Memory::Device),
      scale_(context, "motion scale", sizeof(shared::MotionScale), gpu::Memory::Readback) {
  gpu::clear(context, bins_);
}

void DeviceMotionSums::upload(const ContactSurface& from, Surface& to) const {
  to.first.clear();
  to.first_inside.clear();
  uint32_t texels = 0, inside = 0;
  for (const Level& level : from.levels()) {
    to.first.push_back(texels);
    to.first_inside.push_back(inside);
    texels += kPlanes * level.width * level.height;
    inside += static_cast<uint32_t>(level.inside.size());
  }
  const auto make = [&](const char* name, uint64_t bytes, VkFormat format, gpu::DeviceBuffer& buffer,
                        gpu::TexelView& view) {
    if (buffer.bytes() >= bytes) return;
    view = {};
    buffer = gpu::DeviceBuffer(context_, name, bytes, gpu::Memory::Constant);
    view = gpu::TexelView(context_, buffer, format);
  };
  make("motion surface", texels * sizeof(float), VK_FORMAT_R32_SFLOAT, to.planes, to.plane_texels);
  make("motion contact", std::max(inside, 1u) * sizeof(uint32_t), VK_FORMAT_R32_UINT, to.inside,
       to.inside_texels);
  auto plane = to.planes.as<float>().begin();
  auto pixel = to.inside.as<uint32_t>().begin();
  for (const Level& level : from.levels()) {
    for (const auto* of : {&level.depth, &level.slope_x, &level.slope_y, &level.inside_variance})
      plane = std::copy(of->begin(), of->end(), plane);
    pixel = std::transform(level.inside.begin(), level.inside.end(), pixel,
                           [&level](uint32_t at) { return at % level.width | (at / level.width) << 16; });
  }
  to.planes.flush();
  to.inside.flush();
  to.id = from.id();
}

DeviceMotionSums::Surface& DeviceMotionSums::surface_of(const ContactSurface& surface) {
  const auto known = std::ranges::find(surfaces_, surface.id(), &Surface::id);
  const auto oldest = std::ranges::min_element(surfaces_, {}, &Surface::used);
  Surface& at = known != surfaces_.end() ? *known : *oldest;
  if (known == surfaces_.end()) upload(surface, at);
  at.used = ++set_;
  return at;
}

void DeviceMotionSums::set(const ContactSurface& key, const ContactSurface& now) {
  key_ = &key;
  now_ = &now;
  there_ = &surface_of(key);
  here_ = &surface_of(now);
  make_room();
}

void DeviceMotionSums::make_room() {
  if (now_->count() <= room_) return;
  room_ = now_->count();
  const uint64_t groups = groups_of(room_)[0];
  parts_ = {context_, "motion residuals", groups * sizeof(shared::MotionResiduals), gpu::Memory::Device};
  sums_ = {context_, "motion sums", groups * shared::kJudgedSums * sizeof(float), gpu::Memory::Readback};
  terms_ = {context_, "motion terms", room_ * shared::kMotionTerms * sizeof(float), gpu::Memory::Readback};
}

void DeviceMotionSums::submit(const gpu::Kernel& kernel, bool compares, float scale) {
  push_.scale = scale;
  const std::array<uint32_t, 3> groups = groups_of(push_.count);
  commands_.begin();
  {
    const auto scope = commands_.scope("object motion");
    if (compares) {
      commands_.dispatch(
          residuals_, {&there_->plane_texels, &here_->plane_texels, &here_->inside_texels, &bins_, &parts_},
          push_, groups);
      commands_.barrier();
      commands_.dispatch(scale_of_, {&bins_, &parts_, &scale_}, push_, {1, 1, 1});
      commands_.barrier();
    }
    commands_.dispatch(
        kernel,
        {&there_->plane_texels, &here_->plane_texels, &here_->inside_texels, &scale_, &sums_, &terms_}, push_,
        groups);
  }
  commands_.host_barrier();
  commands_.end();
  commands_.submit();
  commands_.wait();
  sums_.invalidate();
}

LeftOver DeviceMotionSums::compare(size_t level, const MotionGuess& guess, Spread by) {
  level_ = level;
  const Level &there = key_->levels()[level], &here = now_->levels()[level];
  const PixelGuess seen(guess, there, here);
  push_ = {.key_first = there_->first[level],
           .key_width = there.width,
           .key_height = there.height,
           .first = here_->first[level],
           .width = here.width,
           .pixels = here.width * here.height,
           .first_inside = here_->first_inside[level],
           .count = static_cast<uint32_t>(here.inside.size()),
           .back = {},
           .origin = {},
           .middle = {},
           .pitch = static_cast<float>(here.pitch_mm),
           .per_pitch = static_cast<float>(1 / there.pitch_mm),
           .least_mm = static_cast<float>(least_scale_mm(here.pitch_mm)),
           .scale = 0,
           .by_squares = by == Spread::Squares ? 1u : 0u};
  std::ranges::copy(seen.back, push_.back);
  std::ranges::copy(seen.origin, push_.origin);
  std::ranges::copy(seen.middle, push_.middle);
  left_ = {};
  step_sums_ = {};
  if (push_.count == 0) return left_;
  submit(step_, true, 0);
  scale_.invalidate();
  const shared::MotionScale& found = scale_.as<shared::MotionScale>()[0];
  left_ = {found.compared, double{found.scale}, double{found.mean_precision}};
  step_sums_ = sums_of(added(shared::kStepSums), false);
  return left_;
}

/// The workgroups' sums, in their order.
std::vector<double> DeviceMotionSums::added(uint32_t sums) const {
  std::vector<double> out(sums);
  const auto parts = sums_.as<const float>();
  for (size_t group = 0; group < groups_of(push_.count)[0]; ++group)
    for (uint32_t k = 0; k < sums; ++k) out[k] += double{parts[group * sums + k]};
  return out;
}

MotionSums DeviceMotionSums::judged() {
  submit(judge_, false, 0);
  return sums_of(added(shared::kJudgedSums), true);
}

double DeviceMotionSums::loss(double scale) {
  submit(step_, false, static_cast<float>(scale));
  return added(shared::kStepSums)[shared::kMotionLoss] / static_cast<double>(left_.compared);
}

ScoreField DeviceMotionSums::field() {
  const Level& now = now_->levels()[level_];
  ScoreField out{.width = now.width, .height = now.height, .pixel = {}, .row = {}, .score = {}};
  terms_.invalidate();
  const auto terms = terms_.as<const float>();
  std::array<float, 6> row{};
  for (size_t i = 0; i < now.inside.size(); ++i) {
    const auto term = terms.subspan(i * shared::kMotionTerms, shared::kMotionTerms);
    if (term[7] <= 0) continue;
    std::copy_n(term.begin(), row.size(), row.begin());
    add_term(out, now.inside[i], row, term[6], left_.scale);
  }
  return out;
}

uint64_t DeviceMotionSums::memory_bytes() const {
  uint64_t bytes = bins_.bytes() + parts_.bytes() + scale_.bytes() + sums_.bytes() + terms_.bytes();
  for (const Surface& surface : surfaces_) bytes += surface.planes.bytes() + surface.inside.bytes();
  return bytes;
}

}  // namespace palpate
