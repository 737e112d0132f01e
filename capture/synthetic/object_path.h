// Object paths: where an object that is pressed into the simulated pad is at each time.
#pragma once

#include <filesystem>
#include <vector>

#include "capture/synthetic/object_options.h"
#include "engine/motion/rigid_motion.h"

namespace palpate {

/// The motion from where shape_mesh puts the object (its highest point at the middle of the untouched
/// surface) to where it is. A built-in path waits 0.3 s, presses in 0.7 s, goes its way, lifts in 0.6 s and
/// rests for 0.2 s.
class ObjectPath {
 public:
  /// `half_height_mm`: of the object that rolls. Throws Error(Failure::Input) where a .csv path is wrong.
  ObjectPath(const ObjectOptions& options, double half_height_mm);

  RigidMotion at(double time_s) const;
  double duration_s() const;

 private:
  struct Row {
    double time_s;
    Vector6d place;  // mm; rotation vector, radians
  };
  void read(const std::filesystem::path& file);
  RigidMotion on_rows(double time_s) const;
  /// x, y, z (mm) and turns about x, y, z (radians) at a time of the path itself, `deep` being the press.
  Vector6d place(double path_s, double deep) const;

  ObjectOptions options_;
  double half_height_mm_;
  std::vector<Row> rows_;  // of a .csv path
};

}  // namespace palpate
