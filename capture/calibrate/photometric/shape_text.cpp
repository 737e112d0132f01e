#include "capture/calibrate/photometric/shape_text.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <map>
#include <string_view>
#include <vector>

#include "engine/base/text.h"

namespace palpate {
namespace {

constexpr double kLeast_mm = 1e-3, kMost_mm = 1000;      // as of a ball
constexpr double kSharpest_deg = 5, kBluntest_deg = 89;  // half angles of a cone

using Kind = PressedShape::Kind;
const std::map<std::string, Kind> kKinds = {
    {"ball", Kind::Ball}, {"dots", Kind::Ball}, {"cylinder", Kind::Cylinder}, {"cone", Kind::Cone}};

// A number of a shape by its name: what it is, its factor, and whose it is besides those of a radius.
struct Spelling {
  const char* name;
  double PressedShape::*value;
  double factor;
  const char* of;  // empty: of all but a cone
};
constexpr std::array kSpellings{Spelling{"radius", &PressedShape::radius_mm, 1, ""},
                                Spelling{"diameter", &PressedShape::radius_mm, 0.5, ""},
                                Spelling{"apart", &PressedShape::apart_mm, 1, "dots"},
                                Spelling{"tip-radius", &PressedShape::radius_mm, 1, "cone"},
                                Spelling{"half-angle", &PressedShape::half_angle_deg, 1, "cone"},
                                Spelling{"angle", &PressedShape::half_angle_deg, 0.5, "cone"}};

std::vector<std::string> parts_of(const std::string& typed) {
  std::vector<std::string> parts(1);
  for (const char c : typed)
    if (c == ':')
      parts.emplace_back();
    else
      parts.back() += c;
  return parts;
}

bool in_range(const PressedShape& shape, double PressedShape::*value) {
  const double number = shape.*value;
  return value == &PressedShape::half_angle_deg ? number >= kSharpest_deg && number <= kBluntest_deg
                                                : number >= kLeast_mm && number <= kMost_mm;
}

}  // namespace

PressedShape parse_shape(const std::string& typed, const std::string& where, Failure failure) {
  const auto refused = [&](const std::string& wanted, const std::string& found) {
    return Error(failure, wanted + " in " + where, found, kShapeSpellings);
  };
  const std::vector<std::string> parts = parts_of(typed);
  const std::string& name = parts.front();
  const auto kind = kKinds.find(name);
  if (kind == kKinds.end())
    throw refused("a known shape",
                  "'" + typed + "'" + did_you_mean(name, {"ball", "dots", "cylinder", "cone"}));
  PressedShape shape{kind->second};
  const bool cone = shape.kind == Kind::Cone, dots = name == "dots";
  std::vector<double PressedShape::*> needed{cone ? &PressedShape::half_angle_deg : &PressedShape::radius_mm},
      given;
  if (dots) needed.push_back(&PressedShape::apart_mm);
  const std::string sizes = cone   ? "half-angle or angle of a cone, and tip-radius of a rounded one,"
                            : dots ? "radius or diameter of the dots, and apart,"
                                   : "radius or diameter, by name, of a " + name;
  for (size_t i = 1; i < parts.size(); ++i) {
    const size_t equals = parts[i].find('=');
    const std::string number = equals == std::string::npos ? "" : parts[i].substr(equals + 1);
    const auto* const spelling = std::ranges::find_if(kSpellings, [&](const Spelling& s) {
      return parts[i].substr(0, equals) == s.name && (name == s.of || (!cone && *s.of == '\0'));
    });
    if (spelling == kSpellings.end()) throw refused(sizes, "'" + typed + "'");
    double& value = shape.*spelling->value;
    const auto [end, error] = std::from_chars(number.data(), number.data() + number.size(), value);
    value *= spelling->factor;
    if (number.empty() || error != std::errc() || end != number.data() + number.size() ||
        !in_range(shape, spelling->value))
      throw refused(std::string(spelling->name) + (spelling->value == &PressedShape::half_angle_deg
                                                       ? " so that a side is 5 to 89 deg from the axis"
                                                       : " of 0.001 to 1000 mm"),
                    "'" + typed + "'");
    if (std::ranges::find(given, spelling->value) != given.end())
      throw refused("each size once", "'" + typed + "'");
    given.push_back(spelling->value);
  }
  for (const auto value : needed)
    if (std::ranges::find(given, value) == given.end()) throw refused(sizes, "'" + typed + "'");
  if (dots && !(shape.apart_mm > shape.radius_mm))
    throw refused("dots farther apart than their radius", "'" + typed + "'");
  return shape;
}

ShapedRecording parse_shaped_recording(const std::string& typed) {
  for (const auto& [name, kind] : kKinds)
    if (const size_t at = typed.rfind("=" + name + ":"); at != std::string::npos && at > 0)
      return {typed.substr(0, at), parse_shape(typed.substr(at + 1))};
  return {std::nullopt, parse_shape(typed)};
}

}  // namespace palpate
