#include "capture/synthetic/object_options.h"

#include <algorithm>
#include <array>
#include <sstream>

#include "capture/synthetic/object_mesh.h"
#include "capture/synthetic/option_text.h"
#include "capture/synthetic/synthetic.h"
#include "palpate/error.h"

namespace palpate {
namespace {

constexpr const char* kPrefix = "synthetic:object";
constexpr const char* kObjectKeys =
    "shape=bead|key|..., file=FILE.npy|FILE.stl, pitch_mm=MM (of .npy), "
    "path=slide|turn|roll|hand|drag|FILE.csv, "
    "seconds=S, speed_mm_s=V, reach_mm=MM, depth_mm=MM, turn_deg=DEG, tilt_deg=DEG, tremor_mm=MM, x_mm=MM, "
    "y_mm=MM, smooth_mm=MM, creep=SHARE, creep_s=S, friction=MU, size=WxH, seed=N, rate=HZ, repeat=N, "
    "noise=on|off, skin=none|markers|texture, mode=gel";
constexpr OptionText kObjectText("synthetic object", kObjectKeys);
constexpr std::array kCameraKeys = {"size", "seed", "rate", "repeat", "noise", "skin", "mode"};

struct Number {
  const char* key;
  double ObjectOptions::*member;
  double least, most;
};
constexpr Number kNumbers[] = {
    {"pitch_mm", &ObjectOptions::pitch_mm, 0.001, 10},   {"seconds", &ObjectOptions::seconds, 0.1, 3600},
    {"speed_mm_s", &ObjectOptions::speed_mm_s, 0, 1000}, {"reach_mm", &ObjectOptions::reach_mm, 0.01, 200},
    {"depth_mm", &ObjectOptions::depth_mm, 0.01, 5},     {"turn_deg", &ObjectOptions::turn_deg, 0, 90},
    {"tilt_deg", &ObjectOptions::tilt_deg, 0, 30},       {"tremor_mm", &ObjectOptions::tremor_mm, 0, 2},
    {"x_mm", &ObjectOptions::x_mm, -200, 200},           {"y_mm", &ObjectOptions::y_mm, -200, 200},
    {"smooth_mm", &ObjectOptions::smooth_mm, 0, 2},      {"creep", &ObjectOptions::creep, 0, 0.9},
    {"creep_s", &ObjectOptions::creep_s, 0.01, 100}};

/// Sets a key of the object; false: it is none of its own.
bool set(ObjectOptions& o, const OptionText::Option& option) {
  const auto& [key, value] = option;
  if (key == "shape") {
    o.shape = kObjectText.one_of(option, object_shapes());
  } else if (key == "file") {
    o.file = value;
  } else if (key == "path") {
    o.path = value.ends_with(".csv") ? value
                                     : kObjectText.one_of(option, {"slide", "turn", "roll", "hand", "drag"});
  } else if (key == "friction") {
    o.camera.friction = kObjectText.number(option, 0.01, 10);
  } else {
    const auto* const found = std::ranges::find_if(kNumbers, [&](const Number& n) { return key == n.key; });
    if (found == std::end(kNumbers)) return false;
    o.*found->member = kObjectText.number(option, found->least, found->most);
  }
  return true;
}

}  // namespace

bool is_object(const std::string& input) {
  return OptionText::names(input, kPrefix);
}

ObjectOptions parse_object(const std::string& input) {
  ObjectOptions o;
  std::string camera = "synthetic:still?mode=gel&rate=60";
  for (const OptionText::Option& option : OptionText::options_of(input)) {
    if (std::ranges::find(kCameraKeys, option.key) != kCameraKeys.end())
      camera += "&" + option.key + "=" + option.value;
    else if (!set(o, option))
      kObjectText.refuse(option);
  }
  const double friction = o.camera.friction;
  o.camera = parse_synthetic(camera);
  o.camera.friction = friction;
  if (o.camera.mode != SyntheticMode::Gel)
    throw Error(Failure::Input, "a colour gel, which shows relief, for the synthetic object", "another mode",
                "mode=gel; synthetic:press and its like have waveguides");
  validate(o.camera);
  return o;
}

std::string to_string(const ObjectOptions& o) {
  static constexpr const char* kSkins[] = {"none", "markers", "texture"};
  const SyntheticOptions& c = o.camera;
  std::ostringstream s;
  s.precision(12);
  s << kPrefix << '?' << (o.file.empty() ? "shape=" + o.shape : "file=" + o.file) << "&path=" << o.path;
  for (const Number& n : kNumbers) s << '&' << n.key << '=' << o.*n.member;
  s << "&friction=" << c.friction << "&size=" << c.width << 'x' << c.height << "&seed=" << c.seed
    << "&rate=" << c.rate_Hz << "&repeat=" << c.repeat << "&noise=" << (c.noise ? "on" : "off")
    << "&skin=" << kSkins[static_cast<int>(c.skin)];
  return s.str();
}

}  // namespace palpate
