#include "capture/synthetic/tissue_hand.h"

#include <algorithm>
#include <cstddef>
#include <random>

#include "capture/synthetic/optics.h"

namespace palpate {
namespace {

constexpr double kHandRest_s = 0.5, kHandRise_s = 1.5, kHandHold_s = 0.4, kHandLift_s = 0.3;
constexpr double kHandPress_s = kHandRest_s + kHandRise_s + kHandHold_s + kHandLift_s;
constexpr double kSlide_mm_s = 8;
constexpr double kHandMiss_mm = 1.5, kFirstMiss_mm = 0.7;  // of its aim
// Shorter waves are averaged within a node's cell; the longer ones tell places from each other.
constexpr std::array<double, 2> kTexture_mm = {0.5, 2};
constexpr double kTexturePitch_mm = 0.08;

}  // namespace

TissueHand::TissueHand(const TissueOptions& o) : slide_mm_(o.slide_mm), slide_s_(o.slide_mm / kSlide_mm_s) {
  std::mt19937_64 random(o.seed * 6364136223846793005ULL + 1442695040888963407ULL);
  const double window_mm = optics::kFieldWidth_mm;
  const auto aims = hand_aims(o.scene.block_mm, {window_mm, window_mm * o.height / o.width});
  std::uniform_real_distribution<double> share(1.0 / 3, 1);
  for (uint32_t p = 0; p < o.hand; ++p) {
    const auto& aim = aims[p % aims.size()];
    HandSkill skill = o.skill;
    if (p == 0) skill.turn_deg /= 3;
    presses_.push_back(
        held_press(skill, {aim[0] + o.x_mm, aim[1] + o.y_mm}, p == 0 ? kFirstMiss_mm : kHandMiss_mm, random));
    force_N_.push_back(o.force_N * share(random));
  }
  const SkinTexture skin(o.texture, kTexture_mm, random);
  texture_.pitch_mm = {kTexturePitch_mm, kTexturePitch_mm};
  texture_.width = static_cast<uint32_t>(o.scene.block_mm[0] / kTexturePitch_mm);
  texture_.height = static_cast<uint32_t>(o.scene.block_mm[1] / kTexturePitch_mm);
  for (uint32_t j = 0; j < texture_.height; ++j)
    for (uint32_t i = 0; i < texture_.width; ++i)
      texture_.values.push_back(
          static_cast<float>(skin.at((i - (texture_.width - 1) / 2.0) * kTexturePitch_mm,
                                     (j - (texture_.height - 1) / 2.0) * kTexturePitch_mm)));
}

Script TissueHand::script() const {
  Script script = {{0, 0, 0, 0}};
  double t = 0;
  for (const double force_N : force_N_) {
    script.push_back({t += kHandRest_s, 0, 0, 0});
    script.push_back({t += kHandRise_s, 0, 0, force_N});
    script.push_back({t += kHandHold_s + slide_s_, 0, 0, force_N});
    script.push_back({t += kHandLift_s, 0, 0, 0});
  }
  script.push_back({t + kHandRest_s, 0, 0, 0});
  return script;
}

HeldPose TissueHand::held(double time_s) const {
  const double each_s = kHandPress_s + slide_s_;
  const auto p = std::min(static_cast<size_t>(time_s / each_s), presses_.size() - 1);
  const double press_s = time_s - static_cast<double>(p) * each_s;
  HeldPose pose = presses_[p].at(press_s);
  if (slide_s_ > 0) {  // along x, towards the middle
    const double share = std::clamp((press_s - kHandRest_s - kHandRise_s - kHandHold_s) / slide_s_, 0.0, 1.0);
    pose.at_mm[0] += (presses_[p].pose.at_mm[0] > 0 ? -1 : 1) * share * slide_mm_;
  }
  return pose;
}

double TissueHand::share_at(const std::array<double, 2>& place_mm) const {
  // Straight between the nodes.
  const double x =
      std::clamp(place_mm[0] / kTexturePitch_mm + (texture_.width - 1) / 2.0, 0.0, texture_.width - 1.001);
  const double y =
      std::clamp(place_mm[1] / kTexturePitch_mm + (texture_.height - 1) / 2.0, 0.0, texture_.height - 1.001);
  const auto i = static_cast<uint32_t>(x), j = static_cast<uint32_t>(y);
  const auto fx = static_cast<float>(x - i), fy = static_cast<float>(y - j);
  const float there = (1 - fy) * ((1 - fx) * texture_.at(i, j) + fx * texture_.at(i + 1, j)) +
                      fy * ((1 - fx) * texture_.at(i, j + 1) + fx * texture_.at(i + 1, j + 1));
  return std::max(0.0, 1 + static_cast<double>(there));
}

}  // namespace palpate
