// Choice of a camera's controls and their values: automatic modes are off unless requested.
#include <linux/videodev2.h>

#include <algorithm>
#include <cmath>

#include "capture/v4l2/camera_setup.h"
#include "palpate/error.h"

namespace palpate {
namespace {

using v4l2::Control;

class Planner {
 public:
  explicit Planner(const std::vector<Control>& there) : there_(there) {}

  const Control* find(uint32_t id) const {
    const auto found =
        std::find_if(there_.begin(), there_.end(), [&](const Control& c) { return c.id == id; });
    return found == there_.end() ? nullptr : &*found;
  }
  const Control* find(const std::string& name) const {
    const auto found =
        std::find_if(there_.begin(), there_.end(), [&](const Control& c) { return c.name == name; });
    return found == there_.end() ? nullptr : &*found;
  }
  static bool has_item(const Control& c, int64_t item) {
    return std::any_of(c.items.begin(), c.items.end(), [&](const auto& i) { return i.first == item; });
  }
  std::string names() const {
    std::string list;
    for (const Control& c : there_) list += (list.empty() ? "" : ", ") + c.name;
    return list.empty() ? "no controls" : list;
  }
  /// A switch, where there is one.
  bool turn(uint32_t id, bool on) {
    const Control* c = find(id);
    if (c && !c->read_only) add(*c, on ? 1 : 0);
    return c != nullptr;
  }
  /// The first of `items` that the menu has.
  bool choose(uint32_t id, const std::vector<int64_t>& items) {
    const Control* c = find(id);
    if (!c || c->read_only) return false;
    for (const int64_t item : items) {
      if (!has_item(*c, item)) continue;
      add(*c, item);
      return true;
    }
    return false;
  }
  /// `value` in the control's own unit.
  void set(const Control& c, double value) {
    const int64_t whole = std::llround(value);
    const bool menu = c.type == v4l2::ControlType::Menu;
    if (c.read_only || whole < c.least || whole > c.most || (menu && !has_item(c, whole)))
      throw Error(Failure::Device, "control " + c.name + " at " + std::to_string(whole),
                  c.read_only ? "one that cannot be set"
                              : "a range from " + std::to_string(c.least) + " to " + std::to_string(c.most) +
                                    unit_words(c.id),
                  "a value within it");
    // Drivers round as they like; the nearest step is what is meant.
    add(c, menu ? whole : std::min(c.most, c.least + (whole - c.least + c.step / 2) / c.step * c.step));
  }
  static std::string unit_words(uint32_t id) {
    const std::string unit = v4l2::unit_of(id);
    return unit.empty() ? "" : " x " + unit;
  }
  void add(const Control& c, int64_t value) { steps_.push_back({c.id, c.name, value}); }
  std::vector<ControlStep> steps() && { return std::move(steps_); }

 private:
  const std::vector<Control>& there_;
  std::vector<ControlStep> steps_;
};

Error lacks(const std::string& what, const Planner& planner, const std::string& remedy) {
  return {Failure::Device, "a camera whose " + what + " can be set", "the controls " + planner.names(),
          remedy};
}

void plan_modes(Planner& planner, const CameraOptions& o) {
  const bool exposure =
      o.exposure.automatic
          ? planner.choose(V4L2_CID_EXPOSURE_AUTO, {V4L2_EXPOSURE_AUTO, V4L2_EXPOSURE_APERTURE_PRIORITY})
          : planner.choose(V4L2_CID_EXPOSURE_AUTO, {V4L2_EXPOSURE_MANUAL, V4L2_EXPOSURE_SHUTTER_PRIORITY});
  if (!exposure && o.exposure.automatic) throw lacks("exposure by itself", planner, "a fixed --exposure");
  // It would stretch the time between frames in the dark.
  if (!o.exposure.automatic) planner.turn(V4L2_CID_EXPOSURE_AUTO_PRIORITY, false);
  if (!planner.turn(V4L2_CID_AUTOGAIN, o.gain.automatic) && o.gain.automatic)
    throw lacks("gain by itself", planner, "a fixed --gain");
  const bool balance = planner.turn(V4L2_CID_AUTO_WHITE_BALANCE, o.white_balance.automatic);
  const bool preset =
      planner.choose(V4L2_CID_AUTO_N_PRESET_WHITE_BALANCE,
                     {o.white_balance.automatic ? V4L2_WHITE_BALANCE_AUTO : V4L2_WHITE_BALANCE_MANUAL});
  if (!balance && !preset && o.white_balance.automatic)
    throw lacks("white balance by itself", planner, "a fixed --white-balance");
  for (const uint32_t id : {V4L2_CID_AUTOBRIGHTNESS, V4L2_CID_HUE_AUTO, V4L2_CID_FOCUS_AUTO})
    planner.turn(id, false);
}

void plan_values(Planner& planner, const CameraOptions& o) {
  if (o.exposure.value) {
    const Control* time = planner.find(V4L2_CID_EXPOSURE_ABSOLUTE);
    if (!time)
      throw lacks("exposure in seconds", planner,
                  planner.find(V4L2_CID_EXPOSURE) ? "control.exposure=N in its own unit" : "no --exposure");
    planner.set(*time, *o.exposure.value / 100e-6);
  }
  if (o.gain.value) {
    const Control* gain = planner.find(V4L2_CID_GAIN);
    if (!gain) gain = planner.find(V4L2_CID_ANALOGUE_GAIN);
    if (!gain) throw lacks("gain", planner, "no --gain");
    planner.set(*gain, *o.gain.value);
  }
  if (o.white_balance.value) {
    const Control* balance = planner.find(V4L2_CID_WHITE_BALANCE_TEMPERATURE);
    if (!balance) throw lacks("white balance", planner, "no --white-balance");
    planner.set(*balance, *o.white_balance.value);
  }
}

}  // namespace

std::vector<ControlStep> plan_controls(const std::vector<Control>& there, const CameraOptions& options) {
  Planner planner(there);
  plan_modes(planner, options);
  plan_values(planner, options);
  for (const auto& [name, value] : options.controls) {
    const Control* c = planner.find(name);
    if (!c || c->type == v4l2::ControlType::Other || c->type == v4l2::ControlType::Button)
      throw Error(Failure::Device, "control '" + name + "'", "the controls " + planner.names(),
                  "one of those");
    planner.set(*c, static_cast<double>(value));
  }
  return std::move(planner).steps();
}

double exposure_s(const std::vector<Control>& controls) {
  const Planner there(controls);
  const Control* mode = there.find(V4L2_CID_EXPOSURE_AUTO);
  const bool by_hand =
      !mode || mode->value == V4L2_EXPOSURE_MANUAL || mode->value == V4L2_EXPOSURE_SHUTTER_PRIORITY;
  const Control* exposure = there.find(V4L2_CID_EXPOSURE_ABSOLUTE);
  constexpr double kUnit_s = 100e-6;
  return by_hand && exposure && exposure->value ? kUnit_s * static_cast<double>(*exposure->value) : 0;
}

}  // namespace palpate
