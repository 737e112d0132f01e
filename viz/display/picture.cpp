#include "viz/display/picture.h"

#include <unistd.h>

#include <cstdint>
#include <vector>

#include "capture/files/images/image_file.h"
#include "capture/files/output_file.h"
#include "capture/video/module.h"
#include "engine/base/readable.h"
#include "engine/gpu/context.h"
#include "palpate/error.h"
#include "viz/display/scene.h"

namespace palpate::viz {
namespace {

// Pictures are seen in pages, 560 px wide of their 1280: the smallest letters (kSmall_px) then have 8 px.
constexpr float kReadableHeight = 504;

}  // namespace

struct PictureRenderer::Impl {
  Impl(gpu::Context& context, const Sensor& sensor, const PictureOptions& o, const Frame* background)
      : options(o),
        software(context.is_software()),
        pass(context, OffscreenTarget::kFormat, choose_samples(context),
             VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL),
        target(context, pass, {o.width, o.height}),
        scene(context, pass, sensor, background, 1, nullptr,
              o.scale > 0 ? o.scale : static_cast<float>(o.height) / kReadableHeight) {
    ViewState& state = scene.state();
    state.camera = o.camera;
    state.lit = o.lit;
    state.map = o.map;
    state.quantity = state.can_show(o.quantity) ? o.quantity : Quantity::Depth;
    state.charts = o.charts;
    state.chart_span_s = o.chart_span_s;
    state.section = o.section.has_value();
    state.sensor_panel = o.calibrations;
    state.skin_strain = o.skin_strain;
    if (o.section) state.line = *o.section;
    if (o.separate) scene.set_timeline({.timed = false, .separate = true});
    if (o.colour_range > 0) {
      if (o.quantity == Quantity::Pressure) state.automatic_pressure = false;
      (o.quantity == Quantity::Pressure   ? state.range_MPa
       : o.quantity == Quantity::Friction ? state.friction_range
                                          : state.strain_range) = o.colour_range;
    }
    if (o.range_mm > 0) {
      state.automatic_range = false;
      state.range_mm = o.range_mm;
    }
    if (o.exaggeration > 0) {
      state.automatic_exaggeration = false;
      state.exaggeration = o.exaggeration;
    }
  }

  PictureOptions options;
  bool software;
  RenderPass pass;
  OffscreenTarget target;
  Scene scene;
};

PictureRenderer::PictureRenderer(gpu::Context& context, const Sensor& sensor, const PictureOptions& options,
                                 const Frame* background)
    : impl_(std::make_unique<Impl>(context, sensor, options, background)) {}
PictureRenderer::~PictureRenderer() = default;

RgbImage PictureRenderer::render(const Frame& frame, const Touch& touch, const Result& result) {
  Impl& i = *impl_;
  i.scene.follow(touch);
  i.target.begin();
  i.scene.record(i.target.cmd(), i.target.extent(), {frame, touch, result},
                 i.software ? i.options.mesh_columns : 0, nullptr, [&] { i.target.begin_pass(); });
  return i.target.finish();
}

void PictureRenderer::follow(const Touch& touch) {
  impl_->scene.follow(touch);
}

double PictureRenderer::draw_ms() const {
  return impl_->target.draw_ms();
}

std::function<void(const Frame&, const Result&)> timed_drawer(gpu::Context& context, const Sensor& sensor) {
  PictureOptions look;
  const auto renderer = std::make_shared<PictureRenderer>(context, sensor, look);
  return
      [renderer](const Frame& frame, const Result& result) { renderer->render(frame, result.touch, result); };
}

void write_png(const RgbImage& image, const std::filesystem::path& file) {
  const std::vector<uint8_t> bytes = encode_png(
      {image.rgb.data(), image.width, image.height, 3, 1, size_t{image.width} * 3, false}, PngPacking::Runs);
  if (bytes.empty())
    throw Error(Failure::Output, "to encode '" + file.string() + "'", "an error of the PNG encoder",
                "a smaller picture");
  write_whole(file, bytes);
}

struct Film::Impl {
  std::filesystem::path file;
  std::filesystem::path partial;
  std::unique_ptr<VideoEncoder> encoder;
  uint64_t count = 0;
  bool finished = false;
};

Film::Film(const std::filesystem::path& file, uint32_t width, uint32_t height, double rate_Hz)
    : impl_(std::make_unique<Impl>()) {
  // The extension chooses the container, so the unfinished file keeps it.
  impl_->file = file;
  impl_->partial = file.parent_path() / ("." + file.stem().string() + "." + std::to_string(::getpid()) +
                                         ".partial" + file.extension().string());
  impl_->encoder =
      video_module().encode(impl_->partial, file.string(), width, height, rate_Hz > 0 ? rate_Hz : 30);
}

Film::~Film() {
  if (impl_->finished) return;
  impl_->encoder.reset();
  std::error_code ignored;
  std::filesystem::remove(impl_->partial, ignored);
}

void Film::add(const RgbImage& image) {
  impl_->encoder->write(image.rgb);
  ++impl_->count;
}

// Only reading the film back shows that it is complete.
void Film::finish() {
  impl_->encoder->close();
  impl_->encoder.reset();
  uint64_t readable = 0;
  if (const auto back = video_module().decode(impl_->partial))
    while (back->grab()) ++readable;
  if (readable != impl_->count) {
    throw Error(Failure::Output, std::to_string(impl_->count) + " pictures in '" + impl_->file.string() + "'",
                std::to_string(readable) + " readable", "freeing disk space, or another --out folder");
  }
  std::error_code code;
  std::filesystem::rename(impl_->partial, impl_->file, code);
  if (code) {
    throw Error(Failure::Output, "to write '" + impl_->file.string() + "'", system_words(code),
                "another --out folder");
  }
  impl_->finished = true;
}

}  // namespace palpate::viz
