// Fusion: key frames at known places as one height map with its standard error.
#pragma once

#include <cstdint>
#include <vector>

#include "engine/map/key_frame.h"
#include "engine/map/pad_field.h"

namespace palpate {

/// Row-major; places in mm of the map: x to the right, y down, z out of the object, as a pad's depth.
struct FusedMap {
  uint32_t width = 0, height = 0;  ///< px
  double pitch_mm = 0;
  double left_mm = 0, top_mm = 0;  ///< of the first pixel's centre
  std::vector<float> height_mm;    ///< NaN where nothing was seen
  std::vector<float>
      error_mm;  ///< standard error, of noise, places, the pad and its bend; NaN there and without noise_mm
  std::vector<float> coverage;  ///< key frames, each counted by its weight (1 away from a contact's border)
  double noise_mm =
      0;  ///< of one key frame where its error is largest, by where they differ; NaN where no two overlap
  double pad_mm =
      0;  ///< standard error that goes with the pad, alike in all key frames; in error_mm undivided
  double bend_mm = 0;  ///< RMS of the error by the pad's own curvature, which bends the map; in error_mm
  MapBend bend = {};   ///< the same, place by place

  double covered_mm2() const;
};

class Fusion {
 public:
  struct Options {
    double pitch_mm = 0;  ///< > 0; doubled until the map has at most most_px pixels
    uint32_t most_px = 4u << 20;
    uint32_t border_px = 4;  ///< of a key frame that are left out, where the skin spans to the pad
    double ramp_mm = 1;      ///< a key frame's weight rises over that way from there
  };
  /// A key frame where it lies.
  struct Part {
    const KeyFrame& frame;
    const RigidMotion& motion;   ///< from the map to the pad
    const Matrix6d& covariance;  ///< of the motion that is missing, seen at the frame's middle
  };

  /// A map that holds all of the parts.
  Fusion(const std::vector<Part>& parts, const Options& options);
  void add(const Part& part);
  /// Once all are added, each once more: what it shows other than the map, place by place of the pad.
  void compare(const Part& part);
  FusedMap finish() const;

 private:
  /// What a frame shows at a pixel of the map.
  struct Seen {
    double height_mm = 0, share = 0, weight = 0;
    Vector6d by = Vector6d::Zero();  ///< of the height, by the frame's missing motion
    double right = 0, down = 0;      ///< place in the frame's picture, 0 to 1
  };
  template <typename See>
  void look(const Part& part, const See& see) const;
  Eigen::Vector2d place_of(size_t cell) const;
  MapBend bend_of_map() const;

  struct Cell {
    float weight = 0;   ///< sum of weights
    float squares = 0;  ///< sum of their squares over the depth's precision
    float mean_mm = 0;
    float spread = 0;     ///< weighted squares about the mean
    float place_mm2 = 0;  ///< sum of weighted variances by the frames' places
    float coverage = 0;
  };

  Options options_;
  uint32_t width_ = 0, height_ = 0;
  double left_mm_ = 0, top_mm_ = 0;
  std::vector<Cell> cells_;
  PadField pad_;
  double pad_width_mm_ = 0, pad_height_mm_ = 0;
  Eigen::Matrix3d turned_ = Eigen::Matrix3d::Zero();  ///< sum of the compared frames' curvatures_in_map
  double compared_ = 0;
};

}  // namespace palpate
