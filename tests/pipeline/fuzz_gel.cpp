#include "tests/pipeline/fuzz_gel.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "engine/pipeline/pipeline_access.h"
#include "tests/pipeline/dice.h"
#include "tests/support/pipelines.h"

namespace palpate::fuzz {
namespace {

constexpr double kPress_mm = 3;  // radius
constexpr uint32_t kUntouched = 12, kTouched = 4;

/// A random gel by its seed.
class Gel {
 public:
  explicit Gel(const Case& c)
      : format_(c.format), pitch_mm_(c.sensor.pitch_mm_per_px), dice_(c.seed * 7 + 1) {
    for (double& level : level_) level = dice_.between(60, 130);
    along_x_ = 40 * dice_.unit() - 20;
    along_y_ = 40 * dice_.unit() - 20;
    noise_gray_ = 0.5 + dice_.unit();
    const double radius_px = kPress_mm / pitch_mm_;
    x_px_ = radius_px + 4 + (format_.width - 2 * radius_px - 8) * dice_.unit();
    y_px_ = radius_px + 4 + (format_.height - 2 * radius_px - 8) * dice_.unit();
    const uint32_t pixels = format_.width * format_.height;
    for (uint32_t i = dice_.below(pixels / 200 + 1); i > 0; --i) specks_.push_back(dice_.below(pixels));
    // Exposure steps once, lamps drift from then on.
    steps_at_ = dice_.between(1, kUntouched + kTouched);
    for (double& gain : gain_) gain = dice_.one_in(2) ? 1 : 0.85 + 0.3 * dice_.unit();
    drift_gray_ = dice_.one_in(2) ? 0 : 0.02 * dice_.unit();
  }

  double x_px() const { return x_px_; }
  double y_px() const { return y_px_; }

  Frame untouched() { return frame(0, false); }
  /// Frames from 1 on.
  Frame frame(uint32_t index, bool touched) {
    Frame f;
    f.reshape(format_);
    for (uint32_t c = 0; c < 3; ++c) {
      const double gain = index >= steps_at_ ? gain_[c] : 1;
      for (uint32_t y = 0; y < format_.height; ++y)
        for (uint32_t x = 0; x < format_.width; ++x) {
          const double u = static_cast<double>(x) / format_.width,
                       v = static_cast<double>(y) / format_.height;
          double gray = level_[c] + along_x_ * u + along_y_ * v + drift_gray_ * index * u;
          if (touched) gray += slope_gray(c, x, y);
          gray = gain * gray + noise_gray_ * (dice_.unit() + dice_.unit() + dice_.unit() - 1.5) * 2;
          f.set(c, x, y, static_cast<uint32_t>(std::lround(std::clamp(gray, 0.0, 254.0))));
        }
      for (size_t i = 0; i < specks_.size(); ++i)
        f.set(c, specks_[i] % format_.width, specks_[i] / format_.width, i % 2 == 0 ? 255 : 0);
    }
    f.sequence = index;
    return f;
  }

 private:
  // A ball's slopes, seen by three lights.
  double slope_gray(uint32_t c, uint32_t x, uint32_t y) const {
    const double dx = (x - x_px_) * pitch_mm_ / kPress_mm, dy = (y - y_px_) * pitch_mm_ / kPress_mm;
    const double r = std::hypot(dx, dy);
    if (r >= 1) return 0;
    return 40 * r * std::cos(std::atan2(dy, dx) - c * 2 * std::numbers::pi / 3);
  }

  FrameFormat format_;
  double pitch_mm_;
  Dice dice_;
  std::array<double, 3> level_{}, gain_{};
  double along_x_, along_y_, noise_gray_, x_px_, y_px_, drift_gray_;
  std::vector<uint32_t> specks_;
  uint32_t steps_at_;
};

std::string number(double value) {
  return std::to_string(value);
}

}  // namespace

void make_gel(Case& c) {
  Dice dice(c.seed);
  c.format = {dice.between(120, 400), dice.between(120, 300), 3, 8};
  c.images = kUntouched + kTouched + 2;
  Sensor& s = c.sensor;
  s.name = "gel";
  // Twice a press' diameter along the shorter side at least.
  s.pitch_mm_per_px = 4 * kPress_mm / std::min(c.format.width, c.format.height) * (1 + 0.5 * dice.unit());
  s.channels = 3;
  s.bit_depth = 8;
  s.signal = Signal::Either;
  s.threshold_gray = 12;
  s.reading = SurfaceReading::Photometric;
  for (auto* weights : {&s.photometric.wx, &s.photometric.wy})
    for (auto& row : *weights)
      for (double& weight : row) weight = dice.unit() - 0.5;
  s.max_slope = 3;
  c.solve = dice.one_in(2) ? Solve::Live : Solve::Converged;
}

std::string gel_trouble(gpu::Context& context, const Case& c) {
  Gel gel(c);
  PipelineOptions options;
  options.outputs = Output::Force | Output::Contacts | (c.seed % 2 == 0 ? Output::Surface : Output::Force);
  Pipeline pipeline = PipelineAccess::tuned(context, c.sensor, c.format, solved(c.solve, options), c.tuning);
  pipeline.set_background(gel.untouched());
  for (uint32_t i = 1; i < c.images; ++i) {
    const bool touched = i > kUntouched && i <= kUntouched + kTouched;
    if (!pipeline.submit(gel.frame(i, touched))) return "a free slot was refused";
    const Result result = *pipeline.wait();
    const Touch& t = result.touch;
    const std::string place = "image " + std::to_string(i) + (touched ? ", touched: " : ", untouched: ");
    if (t.saturated_px > 0) return place + std::to_string(t.saturated_px) + " px saturated";
    if (!t.light || t.light->state == LightState::Unknown) return place + "light not known";
    const size_t wanted = touched ? 1 : 0;
    // The first touched frame may wait for the second.
    const bool right = touched && t.surface ? !t.contacts.empty() : t.contacts.size() == wanted;
    if (!right && i != kUntouched + 1)
      return place + std::to_string(t.contacts.size()) + " contacts, light " + to_string(t.light->state);
    if (t.surface) {  // of random weights: it may split the contact
      for (const float depth : result.depth_mm())
        if (!std::isfinite(depth)) return place + "a depth that is no number";
      continue;
    }
    for (const ContactTouch& contact : t.contacts) {
      const double off_mm = c.sensor.pitch_mm_per_px * std::hypot(contact.centroid_x_px - gel.x_px(),
                                                                  contact.centroid_y_px - gel.y_px());
      if (!(off_mm < 0.5)) return place + "contact off by " + number(off_mm) + " mm";
    }
  }
  return {};
}

}  // namespace palpate::fuzz
