#include "engine/calibrate/ball/shape.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "engine/base/text.h"

namespace palpate {
namespace {

double radians(double degrees) {
  return degrees * std::numbers::pi / 180;
}

}  // namespace

double PressedShape::steepest() const {
  return kind == Kind::Cone ? std::cos(radians(half_angle_deg)) : 1;
}

double PressedShape::widest_mm() const {
  return kind == Kind::Cone ? std::numeric_limits<double>::infinity() : radius_mm;
}

double PressedShape::height_mm(double off_mm) const {
  const double side_mm = kind == Kind::Cone ? std::max(0.0, off_mm - rounded_mm()) : 0,
               tip_mm = off_mm - side_mm;
  const double tip = std::sqrt(radius_mm * radius_mm - tip_mm * tip_mm);
  return side_mm > 0 ? tip - side_mm / std::tan(radians(half_angle_deg)) : tip;
}

const char* name_of(PressedShape::Kind kind) {
  switch (kind) {
    case PressedShape::Kind::Ball:
      break;
    case PressedShape::Kind::Cylinder:
      return "cylinder";
    case PressedShape::Kind::Cone:
      return "cone";
  }
  return "ball";
}

std::string describe(const PressedShape& shape) {
  switch (shape.kind) {
    case PressedShape::Kind::Ball:
      break;
    case PressedShape::Kind::Cylinder:
      return text("a cylinder of %.4g mm radius", shape.radius_mm);
    case PressedShape::Kind::Cone:
      return text("a cone of %.4g deg half angle", shape.half_angle_deg) +
             (shape.radius_mm > 0 ? text(", tip of %.4g mm radius", shape.radius_mm) : "");
  }
  if (shape.apart_mm > 0)
    return text("dots of %.4g mm radius, %.4g mm apart", shape.radius_mm, shape.apart_mm);
  return text("a ball of %.4g mm radius", shape.radius_mm);
}

}  // namespace palpate
