// Script of the scene "grip": motions of both fingers and their object.
#include <algorithm>
#include <cmath>
#include <limits>

#include "capture/synthetic/contact.h"
#include "capture/synthetic/synthetic.h"

namespace palpate {
namespace {

SyntheticOptions left_finger(SyntheticOptions options) {
  options.grip.side = SyntheticSide::Left;
  return options;
}

}  // namespace

struct GripScript::Impl {
  explicit Impl(SyntheticOptions of) : options(std::move(of)) {}

  SyntheticOptions options;
  Scene scene = scene_of(options);
  ScriptRules rules = script_rules(options);
  PressedPad pad{options};
};

GripScript::GripScript(const SyntheticOptions& options)
    : impl_(std::make_unique<Impl>(left_finger(options))) {}
GripScript::~GripScript() = default;

double GripScript::round_s() const {
  return impl_->options.repeat == 1 ? std::numeric_limits<double>::infinity() : impl_->scene.duration_s();
}

GripTruth GripScript::at(double time_s) const {
  const auto& [options, scene, rules, pad] = *impl_;
  const Keyframe k = palpate::at(scene.keyframes, std::fmod(time_s, round_s()));
  GripTruth truth;
  truth.force_N = k.force_N * rules.force_scale;
  // More than friction holds slips through the fingers.
  truth.load_z_N = -2 * std::clamp(k.pull_y, 0.0, 1.0) * rules.friction * truth.force_N;
  truth.thickness_mm = options.grip.thickness_mm - truth.force_N / options.grip.stiffness_N_per_mm;
  truth.opening_mm = truth.thickness_mm;
  if (truth.force_N > 0) truth.opening_mm -= 2 * pad.press(truth.force_N).summary().indentation_mm;
  return truth;
}

}  // namespace palpate
