#include "capture/synthetic/scene.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>
#include <mutex>
#include <utility>

#include "engine/base/text.h"
#include "palpate/error.h"

namespace palpate {

double Scene::largest_force_N() const {
  double largest = 0;
  for (const Keyframe& k : keyframes) largest = std::max(largest, k.force_N);
  for (const Script& script : others)
    for (const Keyframe& k : script) largest = std::max(largest, k.force_N);
  return largest;
}

double Scene::duration_s() const {
  double duration = keyframes.back().time_s;
  for (const Script& script : others) duration = std::max(duration, script.back().time_s);
  return duration;
}

Keyframe at(const Script& keyframes, double time_s) {
  const auto after =
      std::find_if(keyframes.begin(), keyframes.end(), [&](const Keyframe& k) { return k.time_s > time_s; });
  if (after == keyframes.end()) return keyframes.back();
  if (after == keyframes.begin()) return keyframes.front();
  const Keyframe& a = *(after - 1);
  const Keyframe& b = *after;
  const double u = (time_s - a.time_s) / (b.time_s - a.time_s);
  const double s = u * u * (3 - 2 * u);
  const auto between = [s](double from, double to) { return from + s * (to - from); };
  return {time_s,
          between(a.x_mm, b.x_mm),
          between(a.y_mm, b.y_mm),
          between(a.force_N, b.force_N),
          between(a.pull_x, b.pull_x),
          between(a.pull_y, b.pull_y),
          between(a.turn, b.turn),
          between(a.roll_x_mm, b.roll_x_mm),
          between(a.roll_y_mm, b.roll_y_mm)};
}

namespace {

/// "slides-N", made when it is first asked for; null where the name is no such scene.
const Scene* drawn_scene(const std::string& name) {
  constexpr std::string_view kDrawn = "slides-";
  uint32_t seed = 0;
  if (!name.starts_with(kDrawn)) return nullptr;
  const char* const end = name.data() + name.size();
  const auto [stop, error] = std::from_chars(name.data() + kDrawn.size(), end, seed);
  if (error != std::errc{} || stop != end) return nullptr;
  static std::mutex mutex;
  static std::map<uint32_t, Scene> drawn;
  const std::lock_guard lock(mutex);
  return &drawn.try_emplace(seed, slides_scene(seed)).first->second;
}

}  // namespace

const Scene& find_scene(const std::string& name) {
  if (const Scene* scene = drawn_scene(name)) return *scene;
  std::string list;
  std::vector<std::string> names;
  for (const Scene& scene : scripted_scenes()) {
    if (scene.name == name) return scene;
    list += scene.name + ", ";
    names.push_back(scene.name);
  }
  names.insert(names.end(), {"object", "tissue"});  // sensors of their own
  throw Error(Failure::Input, "a synthetic scene", "'" + name + "'" + did_you_mean(name, names),
              "one of " + list + "object, tissue, slides-N");
}

namespace {

/// Hysteresis of the light: while unloading it is that of a force larger by up to hysteresis * full scale,
/// most at half of it; from one branch to the other over a tenth of full scale.
void add_hysteresis(std::vector<ScriptState>& states, const ScriptRules& rules) {
  if (rules.hysteresis == 0 || rules.largest_force_N <= 0) return;
  double before_N = 0, unloading = 0;
  for (ScriptState& s : states) {
    const double force_N = s.indenter.force_N, full_N = rules.largest_force_N, x = force_N / full_N;
    unloading = force_N <= 0 ? 0 : std::clamp(unloading + (before_N - force_N) / (0.1 * full_N), 0.0, 1.0);
    if (force_N > 0) s.light = 1 + rules.hysteresis * unloading * 4 * (1 - x);
    before_N = force_N;
  }
}

}  // namespace

std::vector<ScriptState> play(const Script& script, size_t frames, const ScriptRules& rules) {
  const double rate_Hz = rules.rate_Hz, stiffness = rules.stiffness_N_per_mm;
  const int substeps =
      std::max(1, static_cast<int>(std::ceil(500 / rate_Hz)));  // 2 ms resolve every slip of the scripts
  std::vector<ScriptState> states(frames);
  double foot_x = 0, foot_y = 0, rolled_x = 0, rolled_y = 0;
  bool touching = false;
  for (size_t frame = 0; frame < frames; ++frame) {
    ScriptState& s = states[frame];
    for (int step = frame == 0 ? substeps : 1; step <= substeps; ++step) {
      const double time_s =
          rules.begin_s + (static_cast<double>(frame) - 1 + static_cast<double>(step) / substeps) / rate_Hz;
      s.indenter = at(script, time_s);
      s.indenter.force_N *= rules.force_scale;
      s.slipping = false;
      s.indenter.x_mm += s.indenter.roll_x_mm;
      s.indenter.y_mm += s.indenter.roll_y_mm;
      foot_x += s.indenter.roll_x_mm - std::exchange(rolled_x, s.indenter.roll_x_mm);
      foot_y += s.indenter.roll_y_mm - std::exchange(rolled_y, s.indenter.roll_y_mm);
      const double limit_N = rules.friction * s.indenter.force_N;
      if (touching) {
        s.indenter.x_mm += s.indenter.pull_x * limit_N / stiffness;
        s.indenter.y_mm += s.indenter.pull_y * limit_N / stiffness;
      }
      if (s.indenter.force_N <= 0) {
        touching = false;
      } else if (!touching) {
        touching = true;
        foot_x = s.indenter.x_mm;
        foot_y = s.indenter.y_mm;
      }
      s.shear_x_N = touching ? stiffness * (s.indenter.x_mm - foot_x) : 0;
      s.shear_y_N = touching ? stiffness * (s.indenter.y_mm - foot_y) : 0;
      const double shear_N = std::hypot(s.shear_x_N, s.shear_y_N);
      // A contact that stopped at its limit is there but for rounding.
      if (shear_N > limit_N * (1 + 1e-9)) {
        s.slipping = true;
        s.shear_x_N *= limit_N / shear_N;
        s.shear_y_N *= limit_N / shear_N;
        foot_x = s.indenter.x_mm - s.shear_x_N / stiffness;
        foot_y = s.indenter.y_mm - s.shear_y_N / stiffness;
      }
    }
    s.indenter.time_s = rules.begin_s + static_cast<double>(frame) / rate_Hz;
    if (!touching) continue;
    const double limit_N = rules.friction * s.indenter.force_N,
                 load = std::min(std::hypot(s.shear_x_N, s.shear_y_N) / limit_N, 1.0);
    s.stick_share = s.slipping ? 0 : std::cbrt(1 - load);
    s.turn_rad =
        std::clamp(s.indenter.turn, -1.0, 1.0) * rules.turn_limit_rad * std::cbrt(s.indenter.force_N);
  }
  add_hysteresis(states, rules);
  return states;
}

}  // namespace palpate
