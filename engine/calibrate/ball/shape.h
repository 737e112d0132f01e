// Rigid shapes of known size that are pressed into a pad: the slopes of the pad where it follows them.
#pragma once

#include <compare>
#include <string>

namespace palpate {

/// A pad that follows a shape has the shape's slopes, which depend on the distance from its middle alone: a
/// point, or the axis of a cylinder that lies on the pad.
struct PressedShape {
  enum class Kind { Ball, Cylinder, Cone };

  Kind kind = Kind::Ball;
  double radius_mm = 0;        ///< of the ball, of the cylinder, of the cone's tip; 0: a sharp cone
  double half_angle_deg = 90;  ///< of a cone, from its axis to its side
  double apart_mm = 0;         ///< of a grid of equal balls, from one to the next; 0: a single ball

  static PressedShape ball(double radius_mm) { return {Kind::Ball, radius_mm}; }

  bool round() const { return kind != Kind::Cylinder; }
  /// Length of the normal's part along the pad where the shape is steepest, 0 to 1.
  double steepest() const;
  /// Distance from the middle up to which the slope grows, mm.
  double rounded_mm() const { return radius_mm * steepest(); }
  /// Contacts are narrower than this half width, mm; a cone has no such limit.
  double widest_mm() const;
  /// Height at a distance from the middle, mm, above a level of the shape's own.
  double height_mm(double off_mm) const;

  auto operator<=>(const PressedShape&) const = default;  // NOLINT(modernize-use-nullptr): a false alarm
};

/// "ball", "cylinder", "cone".
const char* name_of(PressedShape::Kind kind);
/// "a ball of 3 mm radius", "a cylinder of 2 mm radius", "a cone of 60 deg half angle, tip of 0.3 mm radius",
/// "dots of 0.5 mm radius, 2 mm apart".
std::string describe(const PressedShape& shape);

}  // namespace palpate
