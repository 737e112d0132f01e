#include "engine/stages/frame/skin.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "engine/gpu/commands.h"
#include "engine/gpu/context.h"
#include "engine/stages/workgroups.h"
#include "palpate/error.h"
#include "shaders/shared/skin.h"
#include "shaders/skin.spv.h"
#include "shaders/skin_color.spv.h"
#include "shaders/skin_wide.spv.h"

namespace palpate {
namespace {

using Texel = std::array<float, 4>;

gpu::Shader shader_for(const FrameFormat& format) {
  if (format.bit_depth > 8) return {"skin_wide", k_skin_wide};
  if (format.channels == 3) return {"skin_color", k_skin_color};
  return {"skin", k_skin};
}

// Steps of the search: an eighth of what lies between the points at most, so that it ends half way to the
// next.
float search_step(const SkinPattern& pattern) {
  const double step = pattern.kind == SkinKind::Markers ? std::max(1.0, pattern.size_px / 3) : 2.0;
  return static_cast<float>(std::min(step, std::max(1.0, pattern.spacing_px / 6)));
}

void upload(gpu::Context& context, const std::vector<Texel>& texels, const gpu::DeviceBuffer& to) {
  const gpu::DeviceBuffer staging(context, "skin upload", texels.size() * sizeof(Texel), gpu::Memory::Upload);
  std::copy(texels.begin(), texels.end(), staging.as<Texel>().begin());
  staging.flush();
  gpu::run_once(context, [&](gpu::Commands& commands) {
    commands.copy(staging, to, staging.bytes());
    commands.barrier();
  });
}

}  // namespace

Skin::Skin(gpu::Context& context, const Sensor& sensor, const FrameFormat& format)
    : context_(context),
      format_(format),
      pattern_(sensor.skin.value()),
      window_(pattern_),
      search_px_(search_step(pattern_)) {
  kernel_ = gpu::Kernel(context, shader_for(format),
                        {{gpu::Binding::Texels, gpu::Binding::Texels, gpu::Binding::Texels,
                          gpu::Binding::Texels, gpu::Binding::Storage},
                         sizeof(shared::SkinPush),
                         {kWorkgroup, 1, 1},
                         {window_.side, window_.stride}});
}

void Skin::set_background(const Frame& background) {
  templates_ = skin_templates(skin_image(background), format_.width, format_.height, pattern_);
  constexpr size_t kLeast = 3;
  if (templates_.size() < kLeast) {
    const size_t found = templates_.size();
    templates_.clear();
    throw Error(Failure::Input,
                std::string("an untouched image with a pattern on the skin: ") + to_string(pattern_.kind) +
                    " " + std::to_string(std::lround(pattern_.spacing_px)) + " px apart",
                std::to_string(found) + " points to follow",
                "'skin' of the sensor file as it is seen in the rectified frame, or outputs without skin");
  }
  const size_t count = templates_.size();
  const size_t fours = (window_.side + 3) / 4;
  std::vector<Texel> points, windows(count * window_.side * fours * 4), before(count, Texel{0, 0, 1, 0});
  for (size_t i = 0; i < count; ++i) {
    const SkinTemplate& t = templates_[i];
    points.push_back({static_cast<float>(t.x_px), static_cast<float>(t.y_px), t.contrast, 0});
    Texel& beside = points.emplace_back();
    for (size_t k = 0; k < 4; ++k) beside[k] = static_cast<float>(t.neighbours[k]);
    for (size_t k = 0; k < window_.samples(); ++k) {
      const size_t row = k / window_.side, column = k % window_.side;
      for (size_t which = 0; which < 4; ++which)
        windows[((row * fours + column / 4) * 4 + which) * count + i][column % 4] = t.window[k][which];
    }
  }
  const auto make = [this](const char* name, const std::vector<Texel>& texels, gpu::DeviceBuffer& buffer,
                           gpu::TexelView& view) {
    view = {};
    buffer = gpu::DeviceBuffer(context_, name, texels.size() * sizeof(Texel), gpu::Memory::Device);
    upload(context_, texels, buffer);
    view = gpu::TexelView(context_, buffer, VK_FORMAT_R32G32B32A32_SFLOAT);
  };
  make("skin points", points, points_, point_texels_);
  make("skin windows", windows, windows_, window_texels_);
  make("skin before", before, before_, before_texels_);
}

void Skin::record(gpu::Commands& commands, const PaddedImage& frame, const gpu::DeviceBuffer& records) const {
  const auto scope = commands.scope("skin");
  const shared::SkinPush push{points(),       format_.width,
                              format_.height, PaddedLayout(format_).pitch * 4,
                              search_px_,     static_cast<float>(pattern_.spacing_px)};
  commands.barrier();  // the frame before has left its motions
  commands.dispatch(kernel_, {&frame.words(), &point_texels_, &window_texels_, &before_texels_, &records},
                    push, workgroups(points()));
  commands.barrier();
  commands.copy(records, before_, record_bytes());
  commands.barrier();
}

void Skin::read(std::span<const Motion> motions, std::vector<SkinPoint>& points,
                std::vector<float>& sd_px) const {
  points.resize(templates_.size());
  sd_px.resize(templates_.size());
  for (size_t i = 0; i < templates_.size(); ++i) {
    const SkinTemplate& t = templates_[i];
    const Motion& m = motions[i];
    points[i] = {t.centre[0], t.centre[1], m.shift_x_px, m.shift_y_px, m.correlation};
    sd_px[i] = static_cast<float>(std::max(double{m.noise} * t.step_sd, pattern_.shift_sd_px));
  }
}

}  // namespace palpate
