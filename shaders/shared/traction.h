// Traction stage: what its kernels share, read by GLSL and C++.
#ifndef PALPATE_SHARED_TRACTION_H
#define PALPATE_SHARED_TRACTION_H

#ifdef __cplusplus
#include <cstdint>
namespace palpate::shared {
using uint = uint32_t;
#endif

// Maps are padded to whole blocks of so many cells each way; what is padded is neither known nor contact.
const uint kTractionBlock = 8;
// Bits of a cell's byte as the host writes it.
const uint kTractionContact = 1;
const uint kTractionKnown = 2;
// Squares of what is deeper would be too large for single precision.
const float kTractionDeepest_mm = 1e6f;

struct TractionPush {
  uint width;  // cells
  uint height;
  uint pitch;         // texels of four cells from row to row
  uint rows;          // padded
  uint row_block;     // rows of an invocation that transforms rows
  uint column_block;  // rows of one that answers along columns
  uint workgroup;     // invocations
  float per_cell2;    // 1 / cell^2, 1 / mm^2
  float prior;        // what the square of a MPa costs relative to the slopes
  float first_step;   // of cells that enter where there is no curvature to go by
  float tolerance;    // of the residual
  float cell_mm;
};

// Dispatches whose workgroups are counted on the GPU: none once the solve has converged.
const uint kTractionScalars = 0;    // direction, step
const uint kTractionMovedRows = 1;  // what the direction does to the depth
const uint kTractionMovedColumns = 2;
const uint kTractionMovedBack = 3;
const uint kTractionFreshRows = 4;  // what the pressure does, where steps do not add up to it
const uint kTractionFreshColumns = 5;
const uint kTractionFreshBack = 6;
const uint kTractionLaplacian = 7;  // the gradient
const uint kTractionGradientRows = 8;
const uint kTractionGradientColumns = 9;
const uint kTractionGradientBack = 10;
const uint kTractionDispatches = 11;

// The solve's scalars; they stay on the GPU until it is over.
struct TractionState {
  float goal;       // sum of squares of the right side, where there is contact
  float residual2;  // sum of squares of the gradient that is left
  float squares;    // the part of it on cells that carry pressure, one iteration before
  uint entered;     // cells came back to the contact: the last direction is of no use
  uint iterations;  // that changed something
  uint converged;
  uint steps;      // since the pressure's depth was computed afresh
  uint first_row;  // rows with contact: from this one on, before the other
  uint end_row;
  uint first_pair;  // texels of a row, and their mirror images, outside all contact
  uint parts;       // partial sums of the gradient's squares
};

// The part of the host's sums that one lane found.
struct TractionRecord {
  float pressure;    // sum over cells, MPa
  float pressure_x;  // times x from the middle, MPa mm
  float pressure_y;
  float slopes2;  // sum over edges of squared differences that no pressure explains, 1
  uint edges;     // between known cells
  uint border;    // cells in the outermost rows and columns that carry pressure
};

#ifdef __cplusplus
static_assert(sizeof(TractionState) == 44 && sizeof(TractionRecord) == 24);
}  // namespace palpate::shared
#endif
#endif
