#include "capture/synthetic/tissue_options.h"

#include <cmath>
#include <map>
#include <sstream>
#include <tuple>

#include "capture/synthetic/option_text.h"
#include "palpate/error.h"
#include "palpate/frame.h"

namespace palpate {
namespace {

constexpr const char* kPrefix = "synthetic:tissue";
constexpr const char* kTissueKeys =
    "size=WxH, seed=N, rate=HZ, noise=on|off, falloff=SHARE, repeat=N, force=N, loads=N, x=MM, y=MM (of the "
    "window), "
    "lump=sphere|ellipsoid|cylinder|lying|none, d=MM, h=MM, ratio=E_R, lx=MM, ly=MM (of the lump), "
    "lx2=MM, ly2=MM (of a second one like it), thickness=MM, "
    "young=PA, cells=N, hand=N (presses by hand), tilt=DEG, turn=DEG, tremor=MM, slide=MM, texture=SHARE (of "
    "a hand)";

constexpr OptionText kTissueText("synthetic block", kTissueKeys);

const std::map<std::string, InclusionShape> kShapes = {{"sphere", InclusionShape::Sphere},
                                                       {"ellipsoid", InclusionShape::Ellipsoid},
                                                       {"cylinder", InclusionShape::Cylinder},
                                                       {"lying", InclusionShape::LyingCylinder}};

void check_block(bool good, const std::string& wanted, double found, const char* remedy) {
  if (good) return;
  std::ostringstream text;
  text << found;
  throw Error(Failure::Input, "a synthetic block with " + wanted, text.str(), remedy);
}

}  // namespace

bool is_tissue(const std::string& input) {
  return OptionText::names(input, kPrefix);
}

TissueOptions parse_tissue(const std::string& input) {
  TissueOptions o;
  fem::Inclusion lump;
  std::array<double, 2> second_mm{};
  bool has_lump = true, has_second = false, force_given = false;
  double d = 8;
  for (const OptionText::Option& option : OptionText::options_of(input)) {
    const std::string& key = option.key;
    const std::map<std::string, double*> lengths = {{"rate", &o.rate_Hz},
                                                    {"force", &o.force_N},
                                                    {"falloff", &o.falloff},
                                                    {"x", &o.x_mm},
                                                    {"y", &o.y_mm},
                                                    {"d", &d},
                                                    {"h", &lump.depth_mm},
                                                    {"ratio", &lump.stiffness_ratio},
                                                    {"lx", &lump.offset_mm[0]},
                                                    {"ly", &lump.offset_mm[1]},
                                                    {"lx2", &second_mm[0]},
                                                    {"ly2", &second_mm[1]},
                                                    {"thickness", &o.scene.block_mm[2]},
                                                    {"young", &o.scene.young_Pa},
                                                    {"tilt", &o.skill.tilt_deg},
                                                    {"turn", &o.skill.turn_deg},
                                                    {"tremor", &o.skill.tremor_mm},
                                                    {"slide", &o.slide_mm},
                                                    {"texture", &o.texture}};
    if (const auto there = lengths.find(key); there != lengths.end()) {
      *there->second = kTissueText.number<double>(option);
      force_given = force_given || key == "force";
      has_second = has_second || key == "lx2" || key == "ly2";
    } else if (key == "size") {
      std::tie(o.width, o.height) = kTissueText.size(option.value);
    } else if (key == "seed") {
      o.seed = kTissueText.number<uint64_t>(option);
    } else if (key == "repeat") {
      o.repeat = kTissueText.number<uint32_t>(option);
    } else if (key == "loads") {
      o.loads = kTissueText.number<uint32_t>(option);
    } else if (key == "hand") {
      o.hand = kTissueText.number<uint32_t>(option);
    } else if (key == "cells") {
      const auto cells = kTissueText.number<uint32_t>(option);
      check_block(cells >= 16 && cells <= 64 && cells % 8 == 0,
                  "16 to 64 cells along its length, a multiple of 8", cells, "cells=40");
      o.scene.cells = {cells, cells, cells / 2};
    } else if (key == "noise") {
      o.noise = kTissueText.one_of(option, {"on", "off"}) == "on";
    } else if (key == "lump") {
      has_lump = option.value != "none";
      if (has_lump) lump.shape = kTissueText.choose(option, kShapes);
    } else {
      kTissueText.refuse(option);
    }
  }
  if (o.hand > 0 && !force_given) o.force_N = 3;
  check_block(o.width >= 32 && o.width <= kMaxSide_px, "a width of 32 px or more", o.width, "size=640x480");
  check_block(o.height >= 32 && o.height <= kMaxSide_px, "a height of 32 px or more", o.height,
              "size=640x480");
  check_block(o.rate_Hz >= 1 && o.rate_Hz <= 1000, "a rate of 1 to 1000 Hz", o.rate_Hz, "rate=30");
  check_block(o.falloff >= 0 && o.falloff <= 0.5, "a falloff of 0 to 0.5", o.falloff, "falloff=0.015");
  check_block(o.force_N > 0 && o.force_N <= 100, "a force above 0, up to 100 N", o.force_N, "force=2");
  check_block(o.loads >= 1 && o.loads <= 8, "1 to 8 loads", o.loads, "loads=4");
  check_block(std::abs(o.x_mm) <= 40 && std::abs(o.y_mm) <= 40, "its window within 40 mm of its middle",
              std::max(std::abs(o.x_mm), std::abs(o.y_mm)), "x=6");
  check_block(o.hand <= 64, "up to 64 presses by hand", o.hand, "hand=13");
  check_block(o.skill.tilt_deg >= 0 && o.skill.tilt_deg <= 15, "tilts of 0 to 15 degrees", o.skill.tilt_deg,
              "tilt=5");
  check_block(o.skill.turn_deg >= 0 && o.skill.turn_deg <= 45, "turns of 0 to 45 degrees", o.skill.turn_deg,
              "turn=6");
  check_block(o.skill.tremor_mm >= 0 && o.skill.tremor_mm <= 1, "a tremor of 0 to 1 mm", o.skill.tremor_mm,
              "tremor=0.1");
  check_block(o.slide_mm >= 0 && o.slide_mm <= 20, "a slide of 0 to 20 mm", o.slide_mm, "slide=8");
  check_block(o.texture >= 0 && o.texture <= 0.3, "a texture of 0 to 0.3 of the pressure", o.texture,
              "texture=0.15");
  o.scene.inclusion.reset();
  if (has_lump) {
    lump.size_mm = {d, d, d};
    if (lump.shape == InclusionShape::Ellipsoid) lump.size_mm[0] = 1.5 * d;
    if (lump.shape == InclusionShape::LyingCylinder) lump.size_mm[0] = 2.5 * d;
    o.scene.inclusion = lump;
    if (has_second) {
      lump.offset_mm = second_mm;
      o.scene.others = {lump};
    }
  } else if (has_second) {
    throw Error(Failure::Input, "a synthetic block with a lump that the second one is like", "lump=none",
                kTissueKeys);
  }
  try {
    fem::check(o.scene);
  } catch (const Error& error) {
    throw Error(Failure::Input, "a synthetic block that can be built",
                std::string("one that is refused (") + error.what() + ")", kTissueKeys);
  }
  return o;
}

std::string to_string(const TissueOptions& o) {
  std::ostringstream s;
  s.precision(12);
  s << kPrefix << "?size=" << o.width << 'x' << o.height << "&seed=" << o.seed << "&rate=" << o.rate_Hz
    << "&noise=" << (o.noise ? "on" : "off") << "&falloff=" << o.falloff << "&repeat=" << o.repeat
    << "&force=" << o.force_N << "&loads=" << o.loads << "&x=" << o.x_mm << "&y=" << o.y_mm
    << "&thickness=" << o.scene.block_mm[2] << "&young=" << o.scene.young_Pa << "&cells=" << o.scene.cells[0];
  if (o.hand > 0)
    s << "&hand=" << o.hand << "&tilt=" << o.skill.tilt_deg << "&turn=" << o.skill.turn_deg
      << "&tremor=" << o.skill.tremor_mm << "&slide=" << o.slide_mm << "&texture=" << o.texture;
  if (!o.scene.inclusion) {
    s << "&lump=none";
    return s.str();
  }
  const fem::Inclusion& lump = *o.scene.inclusion;
  for (const auto& [name, shape] : kShapes)
    if (shape == lump.shape) s << "&lump=" << name;
  s << "&d=" << lump.size_mm[2] << "&h=" << lump.depth_mm << "&ratio=" << lump.stiffness_ratio
    << "&lx=" << lump.offset_mm[0] << "&ly=" << lump.offset_mm[1];
  if (!o.scene.others.empty()) {
    const std::array<double, 2>& second_mm = o.scene.others.front().offset_mm;
    s << "&lx2=" << second_mm[0] << "&ly2=" << second_mm[1];
  }
  return s.str();
}

}  // namespace palpate
