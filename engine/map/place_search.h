// Place search: where on a map a key frame may lie of which nothing is known, over all turns and shifts.
#pragma once

#include <cstdint>
#include <vector>

#include "engine/map/key_frame.h"
#include "engine/motion/rigid_motion.h"

namespace palpate {

struct PlaceGuess {
  RigidMotion motion;   ///< from the map to the pad, to a cell and half a step of the turn
  double likeness = 0;  ///< correlation of both reliefs there, up to 1
};

/// Correlates the frame's relief, freed of its level and tilt, with that of a mosaic of key frames, in cells
/// of a twentieth of its contact's radius.
class PlaceSearch {
 public:
  /// A key frame of the map, and where it lies.
  struct Part {
    const KeyFrame& frame;
    const RigidMotion& motion;  ///< from the map to the pad
  };
  static constexpr int kTurns = 72;              ///< to a full one
  static constexpr double kLeastLikeness = 0.5;  ///< of what is told
  static constexpr double kLeastShared = 0.5;    ///< part of the frame's middle that the map shows there
  static constexpr size_t kMost = 6;             ///< guesses

  PlaceSearch(const std::vector<Part>& map, const KeyFrame& frame);

  /// One turn; false: all are done.
  bool step();
  /// The likeliest places, none twice; the likeliest first.
  std::vector<PlaceGuess> guesses() const;
  /// The map's relief is like itself elsewhere, and may be like itself beyond the map: a place on it may be
  /// one of many, the others not yet seen.
  bool map_repeats();

 private:
  /// A relief in cells; where `known` is 0 the rest is, too.
  struct Cells {
    int width = 0, height = 0;
    double left_mm = 0, top_mm = 0;
    std::vector<float> depth, relief, known;
    size_t at(int x, int y) const { return static_cast<size_t>(y) * static_cast<size_t>(width) + size_t(x); }
  };
  struct Point {
    double x_mm, y_mm, depth;
    float relief;
  };
  struct Peak {
    double turn_rad, x_mm, y_mm, likeness;
  };
  Cells cells_of(const std::vector<Part>& parts) const;
  void find_relief(Cells& cells) const;
  /// Fills the sums over all shifts of the points, which are turned about their origin; returns the sum of
  /// their squares.
  double correlate(const std::vector<Point>& points, double turn_rad);
  void keep(const Peak& peak);
  RigidMotion motion_of(const Peak& peak) const;

  double cell_mm_ = 0;
  Eigen::Vector3d middle_mm_ = Eigen::Vector3d::Zero();
  Cells map_;
  std::vector<float> squares_;  ///< of the map's relief
  std::vector<Point> points_;   ///< of the frame, from its middle
  std::vector<Peak> peaks_;
  int turn_ = 0;
  std::vector<float> product_, map_squares_, frame_squares_;
};

}  // namespace palpate
