// A synthetic recording with everything needed to measure it.
#pragma once

#include <stdexcept>
#include <string>

#include "capture/synthetic/synthetic.h"
#include "engine/gpu/context.h"
#include "palpate/pipeline.h"

namespace palpate {
/// A synthetic sensor with its calibration, untouched image, frames and truth.
struct SyntheticRun {
  /// `text`: a scene and its parameters, press?size=320x240.
  explicit SyntheticRun(const std::string& text)
      : options(parse_synthetic("synthetic:" + text)),
        source(options),
        sensor(synthetic_sensor(options)),
        background(*source.own_background()) {}

  /// Good until the next call.
  const Frame& frame(uint64_t k) {
    if (!source.render(k, frame_)) throw std::runtime_error("past the end");
    return frame_;
  }
  Truth truth(uint64_t k) const { return *source.truth(k); }
  uint64_t count() const { return *source.frame_count(); }
  Pipeline pipeline(gpu::Context& context, const PipelineOptions& pipeline_options) const {
    Pipeline made(context, sensor, source.format(), pipeline_options);
    made.set_background(background);
    return made;
  }

  SyntheticOptions options;
  SyntheticSensor source;
  Sensor sensor;
  Frame background;

 private:
  Frame frame_;
};

}  // namespace palpate
