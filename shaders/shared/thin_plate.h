// Thin-plate map: push constants and what may be shown, read by GLSL and C++.
#ifndef PALPATE_SHARED_THIN_PLATE_H
#define PALPATE_SHARED_THIN_PLATE_H

#ifdef __cplusplus
#include <cstdint>
namespace palpate::shared {
using uint = uint32_t;
#endif

// The spline is summed at nodes so many px apart, with its derivatives; between them pieces of degree 3 by 3
// follow.
const uint kPlateStep = 8;
const uint kPlateNodeTexels =
    3;  // of a node: u and its derivatives, v and its, distance to the nearest point

const uint kPlateXx = 0, kPlateYy = 1, kPlateXy = 2;  // Green-Lagrange
const uint kPlateFirst = 3, kPlateSecond = 4;         // principal strains
const uint kPlateShear = 5;                           // half their difference
const uint kPlateArea = 6;                            // area over area at rest, less 1
const uint kPlateU = 7, kPlateV = 8;                  // the displacement itself, px

struct PlatePush {
  uint width;   // px
  uint height;  // px
  uint nodes_x;
  uint nodes_y;
  uint pitch;     // texels of four floats from one row of the map to the next
  uint count;     // points
  float first_x;  // of px (0, 0), in the points' own coordinates
  float first_y;
  float px;      // one px in those
  float reach2;  // square of the distance to the nearest point beyond which nothing is known, in those
  float u;       // polynomials: constant, and slopes per own unit
  float u_x;
  float u_y;
  float v;
  float v_x;
  float v_y;
};

#ifdef __cplusplus
}  // namespace palpate::shared
#endif
#endif
