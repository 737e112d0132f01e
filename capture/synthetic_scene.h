// The scripts of the synthetic sensor: where the indenter is and how hard it presses, and what friction makes
// of it.
#pragma once

#include <string>
#include <vector>

namespace palpate {

/// One moment of a script. From one to the next everything moves with a smooth start and stop.
struct Keyframe {
  double time_s = 0;
  double x_mm = 0;  ///< from the centre of the image, right
  double y_mm = 0;  ///< down
  double force_N = 0;
};

struct Scene {
  std::string name;
  std::string description;
  bool flat = false;  ///< flat-ended cylinder instead of a sphere
  double indenter_radius_mm = 8;
  std::vector<Keyframe> keyframes;  ///< times ascend from 0

  double duration_s() const { return keyframes.back().time_s; }
  double largest_force_N() const;
  Keyframe at(double time_s) const;
};

const std::vector<Scene>& scenes();
/// Throws Error(Failure::Input) that lists the names.
const Scene& find_scene(const std::string& name);

/// What happens at one frame.
struct ScriptState {
  Keyframe indenter;
  double shear_x_N = 0;
  double shear_y_N = 0;
  bool slipping = false;
};

/// The states at frames 0, 1, ... of the scene: a spring K from where the contact stuck to the pad, whose
/// foot is dragged along once it pulls with friction * F_z (Coulomb). Forces are scaled by `force_scale`.
std::vector<ScriptState> play(const Scene& scene, double rate_Hz, double force_scale,
                              double stiffness_N_per_mm, double friction);

}  // namespace palpate
