#include "capture/calibrate/photometric/ball_reading.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

#include "engine/base/statistics.h"
#include "engine/calibrate/photometric/fit.h"
#include "engine/gpu/context.h"
#include "engine/pipeline/pipeline_access.h"
#include "palpate/pipeline.h"

namespace palpate {
namespace {

struct Compared {
  double gain = 0, error_mm = 0, cap_rms_mm = 0;
};

/// Depth against the cap of a rigid ball, where the pad follows it for certain; the rim's own depth is not
/// known.
Compared compare(std::span<const float> depth_mm, const BallPress& press, double pitch_mm) {
  const FrameFormat& f = press.frame.format;
  const FoundBall& ball = press.ball;
  double n = 0, r = 0, t = 0, rr = 0, rt = 0, tt = 0;
  const double judged_px = PhotometricFit::kJudgedShare * ball.radius_px;
  const double rim_mm = press.shape.height_mm(judged_px * pitch_mm);
  for (uint32_t y = 0; y < f.height; ++y)
    for (uint32_t x = 0; x < f.width; ++x) {
      const size_t i = size_t{y} * f.width + x;
      const double off_px = std::hypot(x - ball.center_x_px, y - ball.center_y_px);
      if (off_px > judged_px || (!press.mask.empty() && press.mask[i] != 0)) continue;
      if (!std::isfinite(depth_mm[i])) continue;
      const double read = double{depth_mm[i]};
      const double cap = press.shape.height_mm(off_px * pitch_mm) - rim_mm;
      n += 1, r += read, t += cap, rr += read * read, rt += read * cap, tt += cap * cap;
    }
  if (n < 3) return {};
  const double read_var = rr / n - r * r / (n * n), cap_var = tt / n - t * t / (n * n),
               both = rt / n - r * t / (n * n);
  if (!(cap_var > 0)) return {};
  return {.gain = both / cap_var,
          .error_mm = std::sqrt(std::max(0.0, read_var - 2 * both + cap_var)),
          .cap_rms_mm = std::sqrt(tt / n)};
}

/// Relative error of one press's depth by the calibration's own.
double relative_sd(const Sensor& sensor, const BallPress& press, const Compared& compared) {
  if (sensor.reading == SurfaceReading::Lookup)
    return compared.cap_rms_mm > 0 ? sensor.lookup.depth_sd_mm / compared.cap_rms_mm : 0;
  // A component of a ball's normal has half of what is judged, as a share of the radius, as its RMS.
  const double tilt = PhotometricFit::kJudgedShare * press.ball.radius_px * sensor.pitch_mm_per_px /
                      press.shape.radius_mm / 2;
  return sensor.photometric.normal_sd / tilt;
}

}  // namespace

BallReading read_balls(gpu::Context& device, const Sensor& sensor, const BallPresses& found) {
  Pipeline pipeline(device, for_rectified_frames(sensor), found.format,
                    {.outputs = Output::Surface, .solver = SurfaceSolver::Best, .separate = true});
  BallReading reading;
  std::vector<double> gains, errors, caps, scatter;
  const Frame* untouched = nullptr;
  for (size_t i = 0; i < found.presses.size(); ++i) {
    if (!untouched || untouched->bytes != found.backgrounds[i].bytes) {
      untouched = &found.backgrounds[i];
      pipeline.set_background(*untouched);
      for (size_t of = 0; of < found.presses.size(); ++of)
        if (found.backgrounds[of].bytes == untouched->bytes)
          PipelineAccess::look_ahead(pipeline, found.presses[of].frame);
    }
    const Result result = pipeline.process(found.presses[i].frame);
    const Compared one = compare(result.depth_mm(), found.presses[i], sensor.pitch_mm_per_px);
    if (!(one.cap_rms_mm > 0)) continue;
    gains.push_back(one.gain);
    errors.push_back(one.error_mm);
    caps.push_back(one.cap_rms_mm);
    scatter.push_back(relative_sd(sensor, found.presses[i], one));
  }
  reading.presses = gains.size();
  if (gains.empty()) return reading;
  reading.gain = median_in_place(gains);
  reading.error_mm = median_in_place(errors);
  reading.cap_rms_mm = median_in_place(caps);
  reading.gain_sd = median_in_place(scatter) / std::sqrt(static_cast<double>(reading.presses));
  return reading;
}

}  // namespace palpate
