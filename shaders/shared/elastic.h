// Elastic stage: the grids of the pyramid, read by GLSL and C++.
#ifndef PALPATE_SHARED_ELASTIC_H
#define PALPATE_SHARED_ELASTIC_H

#ifdef __cplusplus
#include <cstdint>
namespace palpate::shared {
using uint = uint32_t;
#endif

// A level is stored with kElasticMargin cells around it, in texels of four. Pressure beyond kElasticReach is
// 0 and never written, so that kernels need no border code; answers are computed as far as kElasticReach,
// since interpolation asks for them.
const uint kElasticMargin = 8;
const uint kElasticReach = 4;
// Stencils reach kElasticRadius cells and have the symmetries of the square.
const uint kElasticRadius = 4;
const uint kElasticOrbits = 15;
// Invocations that look along the frame's border, and records that they leave.
const uint kElasticBorderRecords = 256;

struct ElasticPressurePush {
  uint width;       // px
  uint height;      // px
  uint in_pitch;    // texels of eight 16-bit pixels from one row of the filtered image to the next
  uint pitch;       // texels of four floats from one row of the pressure map to the next, margins included
  uint rows;        // that one invocation streams through
  float threshold;  // stored units
  float scale;      // MPa per stored unit, for small pressures
  float limit;      // stored units that no pressure exceeds; 0: the response is linear
  float top;        // stored units; more is read as this much
};

// One level and the next coarser one.
struct ElasticPush {
  uint width;  // cells of the level that is written
  uint height;
  uint pitch;         // texels from row to row of the finer level, margins included
  uint total;         // texels of the finer level
  uint coarse_pitch;  // the same of the coarser level
  uint coarse_total;
  uint out_pitch;  // texels from row to row of what is written
  uint rows;       // that one invocation streams through, even
  float stencil[kElasticOrbits];
};

struct ElasticCoarsestPush {
  uint width;  // cells
  uint height;
  uint pitch;        // texels, margins included
  uint table_pitch;  // texels from one row of the table to the next
};

#ifdef __cplusplus
}  // namespace palpate::shared
#endif
#endif
