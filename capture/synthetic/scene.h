// Scripts of the synthetic sensor: positions and forces of the indenters, and the friction that follows.
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
  double pull_x =
      0;  ///< tangential load, as a fraction of the friction limit: moves the indenter on from x_mm
  double pull_y = 0;
  double turn = 0;       ///< about the normal, from +x towards +y, as a fraction of what friction holds
  double roll_x_mm = 0;  ///< way that the contact has rolled: it moves on and nothing slides
  double roll_y_mm = 0;
};

using Script = std::vector<Keyframe>;  ///< times ascend from 0

struct Scene {
  std::string name;
  std::string description;
  bool flat = false;  ///< flat-ended cylinder instead of a sphere
  double indenter_radius_mm = 8;
  Script keyframes;
  std::vector<Script> others = {};  ///< of further indenters of the same kind, far from each other

  double duration_s() const;
  double largest_force_N() const;  ///< of one indenter
};

Keyframe at(const Script& script, double time_s);

const std::vector<Scene>& scripted_scenes();
/// One of these, or "slides-N": touches, pulls, slides and rolls drawn at random from the number N. Throws
/// Error(Failure::Input) that lists the names.
const Scene& find_scene(const std::string& name);
/// The scene "slides-N".
Scene slides_scene(uint32_t seed);

/// Script of one finger that grips an object, lifts it so that it takes a tangential load, and lets go;
/// forces as fractions of the largest. `pull_y`: load of the weight while it is lifted, as Keyframe has it.
Script grip_script(double largest_N, double pull_y);

/// State of the scene at one frame.
struct ScriptState {
  Keyframe indenter;
  double shear_x_N = 0;
  double shear_y_N = 0;
  bool slipping = false;
  double stick_share = 1;  ///< Cattaneo: (1 - Q / (mu P))^(1/3); 0 while it slides
  double turn_rad = 0;     ///< of the skin under the contact
  double light = 1;        ///< touch light over that of the same force while loading
};

/// Player that turns a script into states.
struct ScriptRules {
  double rate_Hz = 30;
  double force_scale = 1;  ///< on the script's forces
  double stiffness_N_per_mm = 1;
  double friction = 0.5;
  double turn_limit_rad = 0;   ///< what friction holds at 1 N; grows with the cube root of the force
  double hysteresis = 0;       ///< see SyntheticOptions
  double largest_force_N = 0;  ///< full scale of the hysteresis, scaled
  double begin_s = 0;          ///< script's time at frame 0
};

/// The states at `frames` frames of the script: a spring K from where the contact stuck to the pad, whose
/// foot is dragged along once it pulls with friction * F_z (Coulomb).
std::vector<ScriptState> play(const Script& script, size_t frames, const ScriptRules& rules);

}  // namespace palpate
