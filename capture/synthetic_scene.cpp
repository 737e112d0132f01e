#include "capture/synthetic_scene.h"

#include <algorithm>
#include <cmath>

#include "engine/error.h"

namespace palpate {
namespace {

/// A press at one place: down, hold, up, then a pause without contact. Times in s.
void press(std::vector<Keyframe>& k, double x_mm, double y_mm, double force_N, double down_s, double hold_s,
           double up_s, double pause_s) {
  double t = k.empty() ? 0 : k.back().time_s;
  if (k.empty()) k.push_back({0, x_mm, y_mm, 0});
  k.push_back({t += pause_s, x_mm, y_mm, 0});
  k.push_back({t += down_s, x_mm, y_mm, force_N});
  k.push_back({t += hold_s, x_mm, y_mm, force_N});
  k.push_back({t += up_s, x_mm, y_mm, 0});
}

std::vector<Scene> make_scenes() {
  std::vector<Scene> all;
  all.push_back({"still", "nothing touches the pad, 4 s", false, 8, {{0, 0, 0, 0}, {4, 0, 0, 0}}});

  Scene stairs{"press", "a ball presses in four steps to 1.5 N and lifts in three, 8 s", false, 8, {}};
  stairs.keyframes = {
      {0, 0.8, -0.6, 0},     {0.5, 0.8, -0.6, 0},   {1.0, 0.8, -0.6, 0.2}, {1.4, 0.8, -0.6, 0.2},
      {2.0, 0.8, -0.6, 0.5}, {2.4, 0.8, -0.6, 0.5}, {3.0, 0.8, -0.6, 1.0}, {3.4, 0.8, -0.6, 1.0},
      {4.0, 0.8, -0.6, 1.5}, {4.6, 0.8, -0.6, 1.5}, {5.2, 0.8, -0.6, 0.8}, {5.6, 0.8, -0.6, 0.8},
      {6.2, 0.8, -0.6, 0.3}, {6.6, 0.8, -0.6, 0.3}, {7.2, 0.8, -0.6, 0},   {8.0, 0.8, -0.6, 0}};
  all.push_back(stairs);

  Scene slide{
      "slide", "a ball presses with 1 N, sticks, slips sideways 7 mm, holds and lifts, 6 s", false, 8, {}};
  slide.keyframes = {{0, -3, 1, 0},     {0.4, -3, 1, 0},   {1.2, -3, 1, 1},   {1.6, -3, 1, 1},
                     {4.0, 3.7, -1, 1}, {4.8, 3.7, -1, 1}, {5.4, 3.7, -1, 0}, {6.0, 3.7, -1, 0}};
  all.push_back(slide);

  Scene flat{"flat", "a flat-ended cylinder presses with 0.2, 0.4 and 0.6 N, 6 s", true, 2.5, {}};
  press(flat.keyframes, 0, 0, 0.2, 0.5, 0.5, 0.5, 0.4);
  press(flat.keyframes, 0, 0, 0.4, 0.5, 0.5, 0.5, 0.4);
  press(flat.keyframes, 0, 0, 0.6, 0.5, 0.5, 0.5, 0.4);
  flat.keyframes.push_back({6, 0, 0, 0});
  all.push_back(flat);

  Scene palpation{"palpation",
                  "a ball presses at five places with 0.3 to 1.5 N, sticks and slips, and lifts, 20 s",
                  false,
                  8,
                  {}};
  auto& k = palpation.keyframes;
  press(k, 0, 0, 0.6, 0.6, 0.4, 0.5, 0.5);
  press(k, -4, -2.5, 1.0, 0.7, 0.4, 0.5, 0.5);
  press(k, 4, -2, 0.3, 0.5, 0.4, 0.4, 0.5);
  press(k, 3.5, 2.5, 1.5, 0.9, 0.8, 0.7, 0.5);
  press(k, -3, 2.5, 0.8, 0.6, 0.4, 0.5, 0.5);
  double t = k.back().time_s;
  k.push_back({t += 0.5, -3.5, 0, 0});
  k.push_back({t += 0.8, -3.5, 0, 1.2});
  k.push_back({t += 0.6, -3.5, 0, 1.2});
  k.push_back({t += 3.0, 3.5, 0.8, 1.2});
  k.push_back({t += 0.6, 3.5, 0.8, 1.2});
  k.push_back({t += 0.7, 3.5, 0.8, 0});
  k.push_back({20, 3.5, 0.8, 0});
  all.push_back(palpation);
  return all;
}

}  // namespace

double Scene::largest_force_N() const {
  double largest = 0;
  for (const Keyframe& k : keyframes) largest = std::max(largest, k.force_N);
  return largest;
}

Keyframe Scene::at(double time_s) const {
  const auto after =
      std::find_if(keyframes.begin(), keyframes.end(), [&](const Keyframe& k) { return k.time_s > time_s; });
  if (after == keyframes.end()) return keyframes.back();
  if (after == keyframes.begin()) return keyframes.front();
  const Keyframe& a = *(after - 1);
  const Keyframe& b = *after;
  const double u = (time_s - a.time_s) / (b.time_s - a.time_s);
  const double s = u * u * (3 - 2 * u);
  return {time_s, a.x_mm + s * (b.x_mm - a.x_mm), a.y_mm + s * (b.y_mm - a.y_mm),
          a.force_N + s * (b.force_N - a.force_N)};
}

const std::vector<Scene>& scenes() {
  static const std::vector<Scene> all = make_scenes();
  return all;
}

const Scene& find_scene(const std::string& name) {
  std::string names;
  for (const Scene& scene : scenes()) {
    if (scene.name == name) return scene;
    names += (names.empty() ? "" : ", ") + scene.name;
  }
  throw Error(Failure::Input, "a synthetic scene", "'" + name + "'", "one of " + names);
}

std::vector<ScriptState> play(const Scene& scene, double rate_Hz, double force_scale,
                              double stiffness_N_per_mm, double friction) {
  const auto frames = static_cast<uint64_t>(std::max(1.0, std::round(scene.duration_s() * rate_Hz)));
  const int substeps =
      std::max(1, static_cast<int>(std::ceil(500 / rate_Hz)));  // 2 ms resolve every slip of the scripts
  std::vector<ScriptState> states(frames);
  double foot_x = 0, foot_y = 0;
  bool touching = false;
  for (uint64_t frame = 0; frame < frames; ++frame) {
    ScriptState& s = states[frame];
    for (int step = frame == 0 ? substeps : 1; step <= substeps; ++step) {
      const double time_s = (static_cast<double>(frame) - 1 + static_cast<double>(step) / substeps) / rate_Hz;
      s.indenter = scene.at(time_s);
      s.indenter.force_N *= force_scale;
      s.slipping = false;
      const double limit_N = friction * s.indenter.force_N;
      if (s.indenter.force_N <= 0) {
        touching = false;
      } else if (!touching) {
        touching = true;
        foot_x = s.indenter.x_mm;
        foot_y = s.indenter.y_mm;
      }
      s.shear_x_N = touching ? stiffness_N_per_mm * (s.indenter.x_mm - foot_x) : 0;
      s.shear_y_N = touching ? stiffness_N_per_mm * (s.indenter.y_mm - foot_y) : 0;
      const double shear_N = std::hypot(s.shear_x_N, s.shear_y_N);
      if (shear_N > limit_N) {
        s.slipping = true;
        s.shear_x_N *= limit_N / shear_N;
        s.shear_y_N *= limit_N / shear_N;
        foot_x = s.indenter.x_mm - s.shear_x_N / stiffness_N_per_mm;
        foot_y = s.indenter.y_mm - s.shear_y_N / stiffness_N_per_mm;
      }
    }
    s.indenter.time_s = static_cast<double>(frame) / rate_Hz;
  }
  return states;
}

}  // namespace palpate
