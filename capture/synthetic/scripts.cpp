// List of the scenes of the synthetic sensor.
#include <cmath>
#include <random>

#include "capture/synthetic/scene.h"

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

Scene still_scene() {
  return {"still", "nothing touches the pad, 4 s", false, 8, {{0, 0, 0, 0}, {4, 0, 0, 0}}};
}

Scene stairs_scene() {
  Scene scene{"press", "a ball presses in four steps to 1.5 N and lifts in three, 8 s", false, 8, {}};
  scene.keyframes = {
      {0, 0.8, -0.6, 0},     {0.5, 0.8, -0.6, 0},   {1.0, 0.8, -0.6, 0.2}, {1.4, 0.8, -0.6, 0.2},
      {2.0, 0.8, -0.6, 0.5}, {2.4, 0.8, -0.6, 0.5}, {3.0, 0.8, -0.6, 1.0}, {3.4, 0.8, -0.6, 1.0},
      {4.0, 0.8, -0.6, 1.5}, {4.6, 0.8, -0.6, 1.5}, {5.2, 0.8, -0.6, 0.8}, {5.6, 0.8, -0.6, 0.8},
      {6.2, 0.8, -0.6, 0.3}, {6.6, 0.8, -0.6, 0.3}, {7.2, 0.8, -0.6, 0},   {8.0, 0.8, -0.6, 0}};
  return scene;
}

Scene slide_scene() {
  Scene scene{
      "slide", "a ball presses with 1 N, sticks, slips sideways 7 mm, holds and lifts, 6 s", false, 8, {}};
  scene.keyframes = {{0, -3, 1, 0},     {0.4, -3, 1, 0},   {1.2, -3, 1, 1},   {1.6, -3, 1, 1},
                     {4.0, 3.7, -1, 1}, {4.8, 3.7, -1, 1}, {5.4, 3.7, -1, 0}, {6.0, 3.7, -1, 0}};
  return scene;
}

Scene flat_scene() {
  Scene scene{"flat", "a flat-ended cylinder presses with 0.2, 0.4 and 0.6 N, 6 s", true, 2.5, {}};
  press(scene.keyframes, 0, 0, 0.2, 0.5, 0.5, 0.5, 0.4);
  press(scene.keyframes, 0, 0, 0.4, 0.5, 0.5, 0.5, 0.4);
  press(scene.keyframes, 0, 0, 0.6, 0.5, 0.5, 0.5, 0.4);
  scene.keyframes.push_back({6, 0, 0, 0});
  return scene;
}

Scene palpation_scene() {
  Scene scene{"palpation",
              "a ball presses at five places with 0.3 to 1.5 N, sticks and slips, and lifts, 20 s",
              false,
              8,
              {}};
  auto& k = scene.keyframes;
  press(k, 0, 0, 0.6, 0.6, 0.4, 0.5, 0.5);
  press(k, -4, -2.5, 1.0, 0.7, 0.4, 0.5, 0.5);
  press(k, 4, -2, 0.3, 0.5, 0.4, 0.4, 0.5);
  press(k, 3.5, 2.5, 1.5, 0.9, 0.8, 0.7, 0.5);
  press(k, -3, 2.5, 0.8, 0.6, 0.4, 0.5, 0.5);
  double at_s = k.back().time_s;
  k.push_back({at_s += 0.5, -3.5, 0, 0});
  k.push_back({at_s += 0.8, -3.5, 0, 1.2});
  k.push_back({at_s += 0.6, -3.5, 0, 1.2});
  k.push_back({at_s += 3.0, 3.5, 0.8, 1.2});
  k.push_back({at_s += 0.6, 3.5, 0.8, 1.2});
  k.push_back({at_s += 0.7, 3.5, 0.8, 0});
  k.push_back({20, 3.5, 0.8, 0});
  return scene;
}

Scene rig_scene() {
  Scene scene{
      "rig",
      "a ball on a force rig: twelve steps up to 2 N, the paper's 0.537, 0.966 and 1.503 N among them, and "
      "back, 23 s",
      false,
      8,
      {{0, 0.4, 0.2, 0}, {0.5, 0.4, 0.2, 0}}};
  const std::vector<double> steps_N = {0.107, 0.215, 0.376, 0.537, 0.751, 0.966,
                                       1.181, 1.342, 1.503, 1.664, 1.825, 2.0};
  double t = 0.5;
  const auto step = [&](double force_N) {
    scene.keyframes.push_back({t += 0.3, 0.4, 0.2, force_N});
    scene.keyframes.push_back({t += 0.6, 0.4, 0.2, force_N});
  };
  for (const double force_N : steps_N) step(force_N);
  for (size_t i = steps_N.size() - 1; i-- > 0;) step(steps_N[i]);
  scene.keyframes.push_back({t += 0.3, 0.4, 0.2, 0});
  scene.keyframes.push_back({t += 1, 0.4, 0.2, 0});
  return scene;
}

Scene pull_scene() {
  Scene scene{"pull",
              "a ball presses with 1 N and is pulled along x, then along y, below what friction holds, 14 s",
              false,
              8,
              {{0, 0.5, -0.3, 0}, {0.4, 0.5, -0.3, 0}, {1.2, 0.5, -0.3, 1}, {1.6, 0.5, -0.3, 1}}};
  double t = 1.6;
  const auto load = [&](double x, double y) {
    scene.keyframes.push_back({t += 0.5, 0.5, -0.3, 1, x, y});
    scene.keyframes.push_back({t += 0.3, 0.5, -0.3, 1, x, y});
  };
  for (const double fraction : {0.3, 0.6, 0.0, -0.6, 0.0, 0.8, 0.0}) load(fraction, 0);
  for (const double fraction : {0.3, 0.6, 0.0, -0.6, 0.0, 0.8, 0.0}) load(0, fraction);
  scene.keyframes.push_back({t += 0.6, 0.5, -0.3, 0});
  scene.keyframes.push_back({t += 0.6, 0.5, -0.3, 0});
  return scene;
}

Scene drag_scene() {
  Scene scene{
      "drag",
      "a ball presses with 1 N: sticks, begins to slip at its rim, slides right, sticks, slides down and "
      "back, 12 s",
      false,
      8,
      {{0, -3, -1.5, 0},
       {0.4, -3, -1.5, 0},
       {1.2, -3, -1.5, 1},
       {1.6, -3, -1.5, 1},
       {2.4, -3, -1.5, 1, 0.5},
       {2.8, -3, -1.5, 1, 0.5},
       {3.4, -3, -1.5, 1, 0.9},
       {3.8, -3, -1.5, 1, 0.9},
       {5.6, 2, -1.5, 1, 0.9},
       {6.0, 2, -1.5, 1, 0.9},
       {6.6, 2, -1.5, 1, 0.2},
       {7.0, 2, -1.5, 1, 0.2},
       {8.4, 2, 1.5, 1, 0.2},
       {8.8, 2, 1.5, 1, 0.2},
       {10.4, -2, 1.0, 1, 0},
       {10.8, -2, 1.0, 1, 0},
       {11.4, -2, 1.0, 0, 0},
       {12, -2, 1.0, 0, 0}}};
  return scene;
}

Scene twist_scene() {
  Scene scene{"twist",
              "a ball presses with 1 N and turns both ways about the normal without slipping, 10 s",
              false,
              8,
              {{0, -0.4, 0.5, 0}, {0.4, -0.4, 0.5, 0}, {1.2, -0.4, 0.5, 1}, {1.6, -0.4, 0.5, 1}}};
  double t = 1.6;
  for (const double fraction : {0.4, 0.8, 0.0, -0.4, -0.8, 0.0}) {
    scene.keyframes.push_back({t += 0.7, -0.4, 0.5, 1, 0, 0, fraction});
    scene.keyframes.push_back({t += 0.5, -0.4, 0.5, 1, 0, 0, fraction});
  }
  scene.keyframes.push_back({t += 0.6, -0.4, 0.5, 0});
  scene.keyframes.push_back({10, -0.4, 0.5, 0});
  return scene;
}

Scene stick_scene() {
  Scene scene{
      "stick",
      "a ball presses with 0.4 to 1.2 N and is pushed to and fro but never slips, 60 s (repeat=10: ten "
      "minutes)",
      false,
      8,
      {}};
  double t = 0;
  for (int press = 0; press < 5; ++press) {
    const double x = -2.0 + press, y = 0.8 * (press % 3) - 0.8;
    scene.keyframes.push_back({t, x, y, 0});
    scene.keyframes.push_back({t += 0.5, x, y, 0});
    scene.keyframes.push_back({t += 0.7, x, y, 0.8});
    for (int i = 0; i < 20; ++i) {
      const double angle = 2.4 * (i + 3 * press), fraction = 0.85 * (1 + i % 4) / 4;
      scene.keyframes.push_back({t += 0.5, x, y, 0.8 + 0.1 * ((3 * i) % 9 - 4), fraction * std::cos(angle),
                                 fraction * std::sin(angle)});
    }
    scene.keyframes.push_back({t += 0.4, x, y, 0.8});
    scene.keyframes.push_back({t += 0.4, x, y, 0});
  }
  return scene;
}

Scene grip_scene() {
  return {"grip", "one finger of two that grip an object, lift it, set it down and let go, 6 s", false, 8,
          grip_script(1.5, 0)};
}

// Far enough apart that no two ever touch the same place.
Scene fingers_scene() {
  Scene scene{"fingers", "five balls come, press, move and go, each in its own time, 10 s", false, 5, {}};
  scene.keyframes = {{0, -8, -3, 0},   {0.5, -8, -3, 0}, {1.1, -8, -3, 0.6},
                     {6, -8, -3, 0.6}, {6.6, -8, -3, 0}, {10, -8, -3, 0}};
  scene.others = {{{0, -8, 5, 0},
                   {1.0, -8, 5, 0},
                   {1.6, -8, 5, 0.4},
                   {3, -8, 5, 0.4},
                   {5, -5, 5, 0.4},
                   {5.6, -5, 5, 0},
                   {7, -7, 5, 0},
                   {7.6, -7, 5, 0.5},
                   {8.6, -7, 5, 0.5},
                   {9.2, -7, 5, 0}},
                  {{0, 0, -5, 0},
                   {1.5, 0, -5, 0},
                   {2.1, 0, -5, 0.8},
                   {4, 0, -5, 0.3},
                   {6, 0.5, -5, 0.8},
                   {7.8, 0.5, -5, 0.8},
                   {8.4, 0.5, -5, 0}},
                  {{0, 1, 3, 0},
                   {2.0, 1, 3, 0},
                   {2.6, 1, 3, 0.5},
                   {3.4, 1, 3, 0.5},
                   {6.4, 4, 4.5, 0.5},
                   {7.4, 4, 4.5, 0.5},
                   {8.0, 4, 4.5, 0}},
                  {{0, 8, 0, 0},
                   {2.5, 8, 0, 0},
                   {3.1, 8, 0, 0.7},
                   {5, 8, -3, 0.7},
                   {7, 8, 1.5, 0.7},
                   {8.2, 8, 1.5, 0.7},
                   {9, 8, 1.5, 0}}};
  return scene;
}

}  // namespace

Script grip_script(double largest_N, double pull_y) {
  const double half_N = largest_N / 2, full_N = largest_N;
  return {{0, 0.5, -0.3, 0},
          {0.4, 0.5, -0.3, 0},
          {1.0, 0.5, -0.3, half_N},
          {1.2, 0.5, -0.3, half_N},
          {1.8, 0.5, -0.3, full_N},
          {2.1, 0.5, -0.3, full_N},
          {2.7, 0.5, -0.3, full_N, 0, pull_y},
          {3.9, 0.5, -0.3, full_N, 0, pull_y},
          {4.5, 0.5, -0.3, full_N},
          {4.8, 0.5, -0.3, full_N},
          {5.6, 0.5, -0.3, 0},
          {6.0, 0.5, -0.3, 0}};
}

Scene slides_scene(uint32_t seed) {
  std::mt19937 random(seed);
  // By hand, since each library has its own distributions.
  const auto between = [&](double low, double high) {
    return low + (high - low) * (double(random()) / 4294967296.0);
  };
  Scene scene{
      "slides-" + std::to_string(seed), "touches, pulls, slides and rolls drawn at random", false, 8, {}};
  Keyframe k{0, between(-3, 3), between(-2, 2), 0};
  const auto go_on = [&](double seconds) {
    k.time_s += seconds;
    scene.keyframes.push_back(k);
  };
  const auto rest = [&] { go_on(between(0.4, 0.9)); };
  // Towards the middle, more or less, so that no contact leaves the frame.
  const auto direction = [&] {
    return std::atan2(-k.y_mm - k.roll_y_mm, -k.x_mm - k.roll_x_mm) + between(-1, 1);
  };
  go_on(0);
  for (int touch = 0; touch < 2; ++touch) {
    rest();
    k.force_N = between(0.4, 1.4);
    go_on(between(0.3, 0.8));
    rest();
    const double angle = direction(), pull = between(0, 0.7);
    k.pull_x = pull * std::cos(angle);
    k.pull_y = pull * std::sin(angle);
    go_on(between(0.2, 0.6));
    rest();
    for (int slide = 0; slide < 2; ++slide) {
      const double way_mm = between(2, 5), speed_mm_per_s = between(1, 5), towards = direction();
      k.x_mm += way_mm * std::cos(towards);
      k.y_mm += way_mm * std::sin(towards);
      k.force_N *= between(0.8, 1.25);
      go_on(way_mm / speed_mm_per_s);
      rest();
    }
    k.force_N = 0;
    go_on(between(0.3, 0.7));
    k.pull_x = k.pull_y = 0;
    rest();
  }
  // A ball that rolls freely.
  k.force_N = between(0.4, 1.4);
  go_on(between(0.3, 0.8));
  rest();
  const double way_mm = between(1, 4), towards = direction();
  k.roll_x_mm = way_mm * std::cos(towards);
  k.roll_y_mm = way_mm * std::sin(towards);
  go_on(way_mm / between(1, 5));
  rest();
  k.force_N = 0;
  go_on(between(0.3, 0.7));
  rest();
  return scene;
}

const std::vector<Scene>& scripted_scenes() {
  static const std::vector<Scene> all = {still_scene(),     stairs_scene(), slide_scene(), flat_scene(),
                                         palpation_scene(), rig_scene(),    pull_scene(),  drag_scene(),
                                         twist_scene(),     stick_scene(),  grip_scene(),  fingers_scene()};
  return all;
}

}  // namespace palpate
