// Brings a colour gel's frames to the light of the untouched image: changes of exposure, white balance and
// lamps are removed before anything is measured.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "engine/measure/picture/light_change.h"
#include "palpate/frame.h"
#include "palpate/touch.h"

namespace palpate {

/// Samples about 1500 places of 4 x 4 px. In each frame a gain and an offset of each colour are estimated
/// (LightEstimate), and removed where they explain the image clearly better than no change does. A slow drift
/// that remains at each place (lamps) is learned from untouched frames only. A frame in which too few places
/// agree on one light keeps that of the frame before, and its state says so. One whose places scatter, since
/// a wide touch bends the pad around it, mostly keeps that of the last frame that was calmer, or of the
/// series that look_ahead() saw (ExpectedLight).
///
/// Runs on the host, frames in order; the result depends on the frames alone.
class SteadyLight {
 public:
  static constexpr double kLeast_gray = 0.25;      ///< less is left as it is
  static constexpr double kUntouched_gray = 1;     ///< a place that changes by no more may be untouched
  static constexpr double kUntouchedShare = 0.98;  ///< of places, in a frame that nothing touches
  static constexpr uint32_t kMemory_frames = 32;   ///< of drift
  static constexpr double kDrift_gray = 0.01;      ///< a frame, by which a light may change unseen
  static constexpr double kSeriesInliers = 0.3;    ///< of places, in a picture of a series that has a light

  /// Frames of three colours and 8 bits. `saturation_gray`: of pixels, which stay what they are from it on.
  /// `separate`: frames do not follow each other; one of unknown light is left as it is, and no drift is
  /// learned.
  SteadyLight(const FrameFormat& format, uint32_t saturation_gray, bool separate = false);

  /// A series that was looked at stays: forget_series().
  void set_background(const Frame& background);
  /// A picture of the series to which separate frames belong, before the first of them; any order.
  void look_ahead(const Frame& picture);
  void forget_series();
  /// The frame in the light of the background: `frame` itself where nothing has changed, else a copy that
  /// lives until the next call.
  const Frame& steady(const Frame& frame);
  /// As if the last frame had not been: a spoilt picture teaches nothing about the light.
  void forget_last();
  /// Summary of the last frame.
  const LightSummary& summary() const { return summary_; }

 private:
  static constexpr uint32_t kSide = 4;    // px, of a place
  static constexpr uint32_t kBayer = 16;  // thresholds of the dither
  using Curve = std::array<uint8_t, 256>;

  void look_at(const Frame& frame);
  bool find_light();
  LightChange find_light(uint32_t colour);
  bool changes_clearly(uint32_t colour, const LightChange& light);
  void follow_drift();
  double largest_change();
  /// A curve by whole numbers.
  struct Line {
    int32_t per_gray = 0, offset = 0;
    bool exact = false;  ///< for every gray level and threshold
  };
  void make_curves();
  void find_line(uint32_t colour);
  void apply_line(const Line& line, uint32_t y, std::span<const uint8_t> from, std::span<uint8_t> to) const;
  void correct(const Frame& frame);
  void drift_along(uint32_t colour, uint32_t y);

  FrameFormat format_;
  uint32_t saturation_gray_;
  bool separate_;
  float most_gray_;  // that is not saturated
  uint32_t step_, places_x_, places_y_;
  LightEstimate estimate_;
  LightTrust trust_;
  std::array<std::vector<float>, 3> untouched_, change_, drift_;  // of each place
  std::array<double, 3> gray_{};                                  // mean of untouched_
  std::array<LightChange, 3> light_{};                            // taken out
  std::array<LightSeries, 3> series_;
  bool series_known_ = false;              // some picture has shown that it is of this pad
  std::array<ExpectedLight, 3> expected_;  // by the series, or by frames before
  struct Learned {
    std::array<LightChange, 3> light{};
    std::array<ExpectedLight, 3> expected;
    std::array<std::vector<float>, 3> drift;
    LightTrust trust;
  };
  Learned before_;  // the last frame
  bool drifts_ = false;
  LightSummary summary_;
  std::vector<float> scratch_;
  std::array<std::array<Curve, kBayer>, 3> curves_;
  std::array<Line, 3> lines_;
  std::vector<float> row_;  // drift along a row
  Frame corrected_;
};

}  // namespace palpate
