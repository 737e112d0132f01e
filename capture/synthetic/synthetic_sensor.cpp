// The synthetic sensor's options as text, and the sensor that fits them.
#include <cmath>
#include <functional>
#include <map>
#include <sstream>
#include <tuple>

#include "capture/synthetic/optics.h"
#include "capture/synthetic/option_text.h"
#include "capture/synthetic/scene.h"
#include "capture/synthetic/skin.h"
#include "capture/synthetic/synthetic.h"
#include "palpate/error.h"

namespace palpate {
namespace {

constexpr const char* kSceneKeys =
    "size=WxH, bits=8..16, mode=waveguide|gel|lambert, response=linear|saturating, seed=N, rate=HZ, "
    "repeat=N, noise=on|off, "
    "falloff=SHARE, force=N, radius=MM, skin=none|markers|texture, hysteresis=SHARE, drift=SHARE_PER_MIN; of "
    "the scene grip, side=left|right, weight_N=N, stiffness_N_per_mm=N, thickness_mm=MM, skew_ms=MS";

constexpr OptionText kSensorText("synthetic sensor", kSceneKeys);

const std::map<std::string, SyntheticSide> kGripSides = {{"left", SyntheticSide::Left},
                                                         {"right", SyntheticSide::Right}};
/// Numbers of a grip's object by their keys.
constexpr std::pair<const char*, double SyntheticGrip::*> kGripNumbers[] = {
    {"weight_N", &SyntheticGrip::weight_N},
    {"stiffness_N_per_mm", &SyntheticGrip::stiffness_N_per_mm},
    {"thickness_mm", &SyntheticGrip::thickness_mm},
    {"skew_ms", &SyntheticGrip::skew_ms}};

const std::map<std::string, SyntheticMode> kModes = {{"waveguide", SyntheticMode::Waveguide},
                                                     {"gel", SyntheticMode::Gel},
                                                     {"lambert", SyntheticMode::Lambert}};
const std::map<std::string, SyntheticResponse> kResponses = {{"linear", SyntheticResponse::Linear},
                                                             {"saturating", SyntheticResponse::Saturating}};
const std::map<std::string, SyntheticSkin> kSkins = {
    {"none", SyntheticSkin::None}, {"markers", SyntheticSkin::Markers}, {"texture", SyntheticSkin::Texture}};
const std::map<std::string, bool> kSwitch = {{"on", true}, {"off", false}};

template <class Value>
std::string name_of(Value value, const std::map<std::string, Value>& choices) {
  for (const auto& [name, v] : choices)
    if (v == value) return name;
  return {};
}

/// Takes a key of a grip; false: it is none, or this is no grip.
bool set_grip(SyntheticOptions& o, const OptionText::Option& option) {
  if (!is_grip(o)) return false;
  if (option.key == "side") {
    o.grip.side = kSensorText.choose(option, kGripSides);
    return true;
  }
  for (const auto& [name, member] : kGripNumbers) {
    if (option.key != name) continue;
    o.grip.*member = kSensorText.number<double>(option);
    return true;
  }
  return false;
}

void check(bool good, const std::string& wanted, double found, const std::string& remedy) {
  if (good) return;
  std::string number = std::to_string(found);
  if (number.find('.') != std::string::npos) number.erase(number.find_last_not_of('0') + 1);
  if (number.back() == '.') number.pop_back();
  throw Error(Failure::Input, "a synthetic sensor with " + wanted, number, remedy);
}

PhotometricCalibration gel_calibration() {
  // With lights at equal elevation and azimuths 120 degrees apart, sum_c cos(azimuth_c) dI_c / A_c = 3/2
  // cos(elevation) n_x exactly: n_z drops out. 1 / A_c is linearised across the frame; the square of its
  // gradient goes to the constant.
  PhotometricCalibration p;
  const double flat = std::cos(optics::kLightElevation_rad), e = optics::kGelGradient;
  for (int c = 0; c < 3; ++c) {
    const auto light = optics::gel_light(c);
    const double cx = light[0] / flat, cy = light[1] / flat;
    const double unit = 2 / (3 * flat * optics::kGelBrightness);
    const std::array<double, 3> inverse = {1 + e * e / 3, -e * cx, -e * cy};
    for (int k = 0; k < 3; ++k) {
      p.wx[c][k] = unit * cx * inverse[k];
      p.wy[c][k] = unit * cy * inverse[k];
    }
  }
  // Pixel noise of the three channels through the weights, and what rounding leaves of the untouched image;
  // the linearisation adds less.
  const double full = 255, gray = optics::kGelBrightness * 0.7 * full;
  const double sd_e = std::hypot(optics::kReadNoise_e, std::sqrt(gray / full * optics::kFullWell_e));
  const double normal_by_change = std::sqrt(1.5) * 2 / (3 * flat * optics::kGelBrightness);
  p.noise_sd = sd_e / optics::kFullWell_e * normal_by_change;
  p.normal_sd = std::hypot(p.noise_sd, normal_by_change / (full * std::sqrt(12.0)));
  p.pad_reach_px = 1;
  return p;
}

}  // namespace

SyntheticOptions parse_synthetic(const std::string& input) {
  SyntheticOptions o;
  std::string rest = input;
  if (rest.rfind("synthetic:", 0) == 0) rest = rest.substr(10);
  const size_t question = rest.find('?');
  if (const std::string scene = rest.substr(0, question); !scene.empty()) o.scene = scene;
  find_scene(o.scene);
  for (const OptionText::Option& option : OptionText::options_of(rest)) {
    const std::string& key = option.key;
    if (key == "size")
      std::tie(o.width, o.height) = kSensorText.size(option.value);
    else if (key == "bits")
      o.bit_depth = kSensorText.number<uint32_t>(option);
    else if (key == "mode")
      o.mode = kSensorText.choose(option, kModes);
    else if (key == "response")
      o.response = kSensorText.choose(option, kResponses);
    else if (key == "seed")
      o.seed = kSensorText.number<uint64_t>(option);
    else if (key == "rate")
      o.rate_Hz = kSensorText.number<double>(option);
    else if (key == "repeat")
      o.repeat = kSensorText.number<uint32_t>(option);
    else if (key == "noise")
      o.noise = kSensorText.choose(option, kSwitch);
    else if (key == "falloff")
      o.falloff = kSensorText.number<double>(option);
    else if (key == "force")
      o.force_N = kSensorText.number<double>(option);
    else if (key == "radius")
      o.indenter_radius_mm = kSensorText.number<double>(option);
    else if (key == "skin")
      o.skin = kSensorText.choose(option, kSkins);
    else if (key == "hysteresis")
      o.hysteresis = kSensorText.number<double>(option);
    else if (key == "drift")
      o.drift_per_min = kSensorText.number<double>(option);
    else if (!set_grip(o, option))
      kSensorText.refuse(option);
  }
  return o;
}

void validate(const SyntheticOptions& o) {
  for (const uint32_t side : {o.width, o.height})
    check(side >= 1 && side <= kMaxSide_px, "sides of 1 to " + std::to_string(kMaxSide_px) + " px", side,
          "size=640x480 or size=1392x1042");
  check(o.bit_depth >= 8 && o.bit_depth <= 16, "8 to 16 bits", o.bit_depth, "bits=8 or bits=12");
  check(o.mode != SyntheticMode::Gel || o.bit_depth == 8, "8 bits in mode gel", o.bit_depth, "bits=8");
  check(o.rate_Hz >= 0.1 && o.rate_Hz <= 10000, "a rate of 0.1 to 10000 Hz", o.rate_Hz, "rate=30");
  check(o.falloff >= 0 && o.falloff < 1, "a falloff of 0 to 1", o.falloff, "falloff=0.015");
  check(o.force_N >= 0 && o.force_N <= 20, "a force of 0 to 20 N (0: the scene's own)", o.force_N,
        "force=1.5");
  check(o.indenter_radius_mm >= 0 && o.indenter_radius_mm <= 1000,
        "an indenter radius of 0 to 1000 mm (0: the scene's own)", o.indenter_radius_mm, "radius=8");
  check(o.pad_young_MPa > 0 && o.pad_young_MPa < 1e6, "a pad modulus > 0 MPa", o.pad_young_MPa, "0.2");
  check(o.pad_thickness_mm > 0 && o.pad_thickness_mm < 1e4, "a pad thickness > 0 mm", o.pad_thickness_mm,
        "6");
  check(o.skin == SyntheticSkin::None || o.width >= skin::kLeastWidth_px,
        "a width of " + std::to_string(skin::kLeastWidth_px) + " px or more where the skin has a pattern",
        o.width, "size=640x480, or skin=none");
  check(o.hysteresis >= 0 && o.hysteresis <= 0.5, "a hysteresis of 0 to 0.5", o.hysteresis,
        "hysteresis=0.05");
  check(std::abs(o.drift_per_min) <= 0.5, "a drift of -0.5 to 0.5 per minute", o.drift_per_min, "drift=0.01");
  const bool glows = o.mode == SyntheticMode::Waveguide;
  check(glows || o.hysteresis == 0, "hysteresis only in mode waveguide", o.hysteresis, "mode=waveguide");
  check(glows || o.drift_per_min == 0, "drift only in mode waveguide", o.drift_per_min, "mode=waveguide");
  check(o.friction > 0 && o.friction <= 10, "a friction coefficient of 0 to 10", o.friction, "0.5");
  const SyntheticGrip& g = o.grip;
  check(g.weight_N >= 0 && g.weight_N <= 20, "a weight of 0 to 20 N", g.weight_N, "weight_N=0.4");
  check(g.stiffness_N_per_mm >= 0.01 && g.stiffness_N_per_mm <= 1e6, "a stiffness of 0.01 to 1e6 N/mm",
        g.stiffness_N_per_mm, "stiffness_N_per_mm=2");
  check(g.thickness_mm > 0 && g.thickness_mm <= 1000, "a thickness of 0 to 1000 mm", g.thickness_mm,
        "thickness_mm=20");
  check(g.skew_ms >= 0 && g.skew_ms <= 1000, "a skew of 0 to 1000 ms", g.skew_ms, "skew_ms=5");
}

std::string to_string(const SyntheticOptions& o) {
  std::ostringstream s;
  s << "synthetic:" << o.scene << "?size=" << o.width << 'x' << o.height << "&bits=" << o.bit_depth
    << "&mode=" << name_of(o.mode, kModes) << "&response=" << name_of(o.response, kResponses)
    << "&seed=" << o.seed << "&rate=" << o.rate_Hz << "&repeat=" << o.repeat
    << "&noise=" << name_of(o.noise, kSwitch) << "&falloff=" << o.falloff << "&force=" << o.force_N
    << "&radius=" << o.indenter_radius_mm;
  // Newer options are left out of the text where they are not used, so that recordings keep their names.
  if (o.skin != SyntheticSkin::None) s << "&skin=" << name_of(o.skin, kSkins);
  if (o.hysteresis != 0) s << "&hysteresis=" << o.hysteresis;
  if (o.drift_per_min != 0) s << "&drift=" << o.drift_per_min;
  if (is_grip(o)) {
    s << "&side=" << name_of(o.grip.side, kGripSides);
    for (const auto& [name, member] : kGripNumbers) s << '&' << name << '=' << o.grip.*member;
  }
  return s.str();
}

std::vector<std::pair<std::string, std::string>> synthetic_scenes() {
  std::vector<std::pair<std::string, std::string>> list;
  for (const Scene& scene : scripted_scenes()) list.emplace_back(scene.name, scene.description);
  return list;
}

Sensor synthetic_sensor(const SyntheticOptions& o) {
  validate(o);
  const double scale = optics::scale(o.bit_depth),
               largest = std::ldexp(1.0, static_cast<int>(o.bit_depth)) - 1;
  const Scene& scene = find_scene(o.scene);
  const double force_N = o.force_N > 0 ? o.force_N : scene.largest_force_N();

  Sensor s;
  s.name = "synthetic " + name_of(o.mode, kModes);
  s.pitch_mm_per_px = optics::pitch_mm(o);
  s.size_px = {o.width, o.height};
  s.channels = o.mode == SyntheticMode::Gel ? 3 : 1;
  s.bit_depth = o.bit_depth;
  s.signal = o.mode == SyntheticMode::Gel ? Signal::Either : Signal::Brighter;
  // Gel: of three noisy channels the largest change counts, about 2.5 gray where nothing touches.
  s.threshold_gray = (o.mode == SyntheticMode::Gel ? 6 : 4) * scale;
  s.saturation_gray = static_cast<uint32_t>(largest);
  if (o.mode == SyntheticMode::Lambert) {
    s.reading = SurfaceReading::Shading;
    s.shading.facing_gray = optics::kFacing_gray * scale;
    s.max_slope = 0.5;  // the scenes' contacts end at slopes of 0.4; the blurred rim must not read as a cliff
  } else if (o.mode == SyntheticMode::Gel) {
    s.reading = SurfaceReading::Photometric;
    s.photometric = gel_calibration();
    if (o.pad_thickness_mm >= LayerCalibration::kThinnest_px * s.pitch_mm_per_px)
      s.layer = LayerCalibration{.young_MPa = o.pad_young_MPa,
                                 .poisson = 0.5,
                                 .thickness_mm = o.pad_thickness_mm,
                                 .relative_sd = 0.01};
  }
  // Frames of less than 19 px across do not resolve the pad's thickness.
  if (o.mode == SyntheticMode::Waveguide &&
      o.pad_thickness_mm >= ElasticCalibration::kThinnest_px * s.pitch_mm_per_px) {
    s.reading = SurfaceReading::Elastic;
    s.elastic.gray_per_MPa = gray_per_MPa(o);
    if (o.response == SyntheticResponse::Saturating)
      s.elastic.limit_gray = optics::kResponseLimit_gray * scale;
    s.elastic.young_MPa = o.pad_young_MPa;
    s.elastic.thickness_mm = o.pad_thickness_mm;
    s.elastic.relative_sd = 0.01;  // the field's non-uniformity
  }
  if (o.mode == SyntheticMode::Waveguide && o.response == SyntheticResponse::Linear && force_N > 0) {
    // Summed over the contact, gray = s p field and the pressure's integral is the force.
    ForceCalibration f;
    f.c1_N_per_gray = s.pitch_mm_per_px * s.pitch_mm_per_px / gray_per_MPa(o);
    f.gray_max = force_N / f.c1_N_per_gray;
    f.residual_sd_N = 0.003 * force_N;
    const double relative = 0.004;  // the field's non-uniformity where the scenes press
    f.covariance = {0, 0, relative * relative * f.c1_N_per_gray * f.c1_N_per_gray};
    s.force = f;
  }
  if (o.skin != SyntheticSkin::None) {
    const double light = SkinMap(o).mean();
    SkinPattern pattern;
    if (o.skin == SyntheticSkin::Markers) {
      pattern.spacing_px = skin::kSpacing_mm / s.pitch_mm_per_px;
      pattern.size_px = 2 * skin::kRadius_mm / s.pitch_mm_per_px;
      // Pixels uncovered by a moved marker are not a touch.
      s.threshold_gray *= 2;
    } else {
      pattern.kind = SkinKind::Texture;
      pattern.spacing_px = std::max(0.6 / s.pitch_mm_per_px, 8.0);
      pattern.size_px = std::max(0.4 / s.pitch_mm_per_px, 6.0);
    }
    s.skin = pattern;
    s.elastic.gray_per_MPa *= light;
    if (s.force) {
      // The amount of pattern under a contact differs from place to place.
      const double relative = o.skin == SyntheticSkin::Markers ? 0.02 : 0.01;
      s.force->c1_N_per_gray /= light;
      s.force->gray_max *= light;
      s.force->covariance[2] = relative * relative * s.force->c1_N_per_gray * s.force->c1_N_per_gray;
    }
  }
  const double stiffness = shear_stiffness_N_per_mm(o);
  s.shear = ShearCalibration{stiffness, stiffness, o.friction, 0.005};
  if (s.skin) s.shear->signal = ShearSignal::Skin;
  return s;
}

}  // namespace palpate
