// Pictures that do not go with an untouched image: of another pad, under another light, or not as the camera
// gave them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "capture/calibrate/photometric/pad_change.h"
#include "engine/measure/picture/picture_check.h"
#include "palpate/frame.h"
#include "palpate/sensor.h"

namespace palpate {

class PadMatch {
 public:
  static constexpr double kBrightness = 0.05, kColour = 0.04;  ///< of a colour's level: another light
  static constexpr double kLeastShare = 0.2;  ///< of the picture under one light: below, another pad
  static constexpr double kSureShare = 0.4;   ///< of one picture at least, of several

  PadMatch(const Frame& untouched, const Sensor& sensor);

  /// Reason in words for which a picture does not go with the untouched image; empty: it does.
  std::string look_at(const Frame& frame);

  size_t pictures() const { return lights_.size() + damaged_; }
  /// Light of the pictures that are as the camera gave them.
  const std::vector<PadLight>& lights() const { return lights_; }
  /// Pictures that do not go with it: all of several where not one has kSureShare.
  size_t foreign() const;
  /// Half of the pictures or more are foreign.
  bool most() const;
  /// "13 of 28 pictures do not go with the untouched image (colours exchanged)"; empty: all do.
  std::string describe() const;
  /// Throws Error(Failure::Input) where most() of `input` are.
  void refuse_most(const std::string& input) const;

 private:
  bool known_pad() const;
  static bool other_pad(const PadLight& light);
  static bool other_light(const PadLight& light);
  size_t other_pads() const;

  const Frame& untouched_;
  Sensor sensor_;
  PictureCheck check_;
  std::vector<PadLight> lights_;
  size_t damaged_ = 0;
  PictureFault fault_ = PictureFault::None;  ///< the last one's
};

/// Description of the pictures of `input` where half of them or more do not go with the sensor's untouched
/// image; empty: they do. `more` (pictures so far) may end it by returning false.
std::string foreign_pictures(const std::string& input, const Sensor& sensor,
                             const std::function<bool(uint64_t)>& more);

}  // namespace palpate
