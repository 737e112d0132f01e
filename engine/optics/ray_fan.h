// Rays from a lamp at the edge through a waveguide's layers: their ways in the plane of the lamp, and how far
// from the edge its light first meets the touched face.
#pragma once

#include <vector>

#include "engine/optics/edge_light.h"

namespace palpate::optics {

enum class RayFate {
  Touching,  ///< guided and meets the touched face
  Guided,    ///< guided, but turned back before the touched face
  Leaving,   ///< leaves through an outside
};
const char* to_string(RayFate fate);

/// One ray in the plane of the lamp, edge at x = 0.
struct EdgeRay {
  double angle_rad = 0;         ///< outside, > 0 towards the touched face
  double tangential_index = 0;  ///< n cos of the angle inside
  RayFate fate = RayFate::Leaving;
  double entering = 0;                 ///< fraction that passes the edge, unpolarised
  double first_mm = 0;                 ///< where it first meets the touched face; infinity: never
  double hop_mm = 0;                   ///< from one meeting to the next
  std::vector<double> x_mm, depth_mm;  ///< its way: from the edge over each interface to its end
};

/// The layer at a depth below the touched face. Throws Error(Failure::Input) outside the guide.
size_t layer_at(const Waveguide& guide, double depth_mm);

/// A ray that enters the edge at `depth_mm`; followed to `length_mm`, or where it leaves. Throws
/// Error(Failure::Input) on an angle outside (-90, 90) deg or a length <= 0.
EdgeRay trace_ray(const Waveguide& guide, const EdgeLamp& lamp, double depth_mm, double angle_rad,
                  double length_mm);

/// Which fraction of the lamp's light has met the touched face at least once within a distance from the edge.
struct FirstMeetings {
  double nearest_mm = 0;            ///< of guided light in the lamp's plane: nearer, the face is dark
  std::vector<double> distance_mm;  ///< rising
  std::vector<double> fraction;     ///< of the lamp's light, rising to LampFractions::touching
  /// Distance at which that part of the touching light has met the face; infinity beyond the table.
  double distance_of(double part, double touching) const;
};
/// In all directions, not the lamp's plane only; on a grid of `side` x `side` directions.
FirstMeetings first_meetings(const Waveguide& guide, const EdgeLamp& lamp, double depth_mm, double length_mm,
                             int side = 400);

}  // namespace palpate::optics
