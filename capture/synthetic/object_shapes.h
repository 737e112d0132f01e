// Object shapes: analytic surfaces of things that are pressed into a pad, seen from the pad.
#pragma once

#include <cmath>
#include <functional>
#include <string>

namespace palpate::scenes {

inline constexpr double kDegree = M_PI / 180;

/// The object's surface: its depth in the pad over x and y, mm, as it lies before it moves.
struct SolidObject {
  std::string name;
  std::function<double(double x_mm, double y_mm)> depth_mm;
};

/// A dome of 30 mm radius with waves of about 1.5 mm in all directions.
SolidObject textured_dome(double relief_mm = 0.04);
/// The same waves without the dome: it fills the pad wherever it slides.
SolidObject textured_plane();
SolidObject ball(double radius_mm = 8, double depth_mm = 0.7);
SolidObject plane(double depth_mm = 0.4);
/// Along a line that is no axis of the pad.
SolidObject cylinder(double radius_mm = 6, double depth_mm = 0.6);
SolidObject ellipsoid();
/// A thread of one turn in 1.5 mm about a line along x.
SolidObject screw(double radius_mm = 5, double pitch_mm = 1.5);
/// A bow, a shaft and a bit with teeth, on a slight dome.
SolidObject key_relief();
/// A ring, a bar and dots on a flat ground.
SolidObject coin();

/// Distance of a solid's surface from its middle in a direction (a unit vector), mm.
struct RoundObject {
  std::string name;
  std::function<double(double x, double y, double z)> radius_mm;
};
/// A ball of 3 mm radius with waves of 1.1 to 2 mm all over it.
RoundObject bead(double radius_mm = 3, double relief_mm = 0.04);
/// An ellipsoid of 8 x 5 x 4 mm with shallow ribs along it.
RoundObject seed();

}  // namespace palpate::scenes
