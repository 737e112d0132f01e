// Forward model: what its kernels share, read by GLSL and C++. Node vectors have one texel a node in single
// precision (x, y, z, spare) and two in double (x and y, z and spare), with a lead and a tail of a plane, a
// row and a node of finite numbers; moduli have one a node too, of the four cells around it in the layer
// below, zero for cells that are not there.
#ifndef PALPATE_SHARED_FORWARD_H
#define PALPATE_SHARED_FORWARD_H

#ifdef __cplusplus
#include <cstdint>
namespace palpate::shared {
using uint = uint32_t;
#endif

// A cell's numbers, as LayerStiffness in engine/fem/linear/stiffness.h, for a layer of relative height 1.
struct ForwardStiffness {
  float bulk, twice_mu;
  float gx, gy, gz;
  float xx, yy, zz, xy, xz, yz;
};
struct ForwardStiffnessWide {
  double bulk, twice_mu;
  double gx, gy, gz;
  double xx, yy, zz, xy, xz, yz;
};

// A grid's nodes: `row` along x, `plane` in a plane, `planes` of them; `lead` nodes before the first.
// `segment`: planes that an invocation marches through.
struct ForwardStepPush {
  uint row, plane, planes, lead, segment;
  float keep;  // of the last step
  float gain;  // on the residual, scaled by the inverse blocks
  ForwardStiffness stiffness;
};
struct ForwardWidePush {
  uint row, plane, planes, lead, segment, spare;
  ForwardStiffnessWide stiffness;
};
struct ForwardNodesPush {
  uint nodes, lead;
  float gain;
};
// From a grid to its half and back.
struct ForwardTransferPush {
  uint fine_row, fine_plane, fine_nodes, fine_lead;
  uint coarse_row, coarse_plane, coarse_nodes, coarse_lead;
};

// Layers that are not there, before the first and behind the last, so that transfers need no branch.
const uint kForwardSpareLayers = 2;

// Steps of the scalar kernel, on the sums that the others leave.
const uint kForwardBalance = 0;    // a new round: squares of all forces, and of those out of balance
const uint kForwardDirection = 1;  // after the cycle: residual times correction, both over `scale`
const uint kForwardLength = 2;     // after the product: direction times product
const uint kForwardLeft = 3;       // after the step: squares of the residual

struct ForwardScalarPush {
  uint stage;
  uint sums;
  uint unknowns;
};

// The solve's scalars; they stay on the device, the host looks at them between iterations.
struct ForwardScalars {
  double wanted;      // relative residual; the host's
  double all_forces;  // norm of supports' and loads'
  double left;        // norm of the residual
  double scale;       // of what the cycle works on
  double along;       // residual times preconditioned residual
  double alpha;       // length of the step
  double beta;        // share of the last direction in the next
  uint most;          // iterations; the host's
  uint iterations;
  uint done;  // nothing moves any more in this round
  uint spare;
};

#ifdef __cplusplus
static_assert(sizeof(ForwardScalars) == 72);
}  // namespace palpate::shared
#endif
#endif
