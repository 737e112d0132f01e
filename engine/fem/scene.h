// A block of tissue with a lump in it, how it is pressed, and what it answers: the forward model's question
// and answer.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "engine/tissue/inclusion_shape.h"
#include "engine/tissue/pressure_map.h"

namespace palpate::gpu {
class Context;
}  // namespace palpate::gpu

namespace palpate::fem {

/// A stiffer or softer body in the tissue, bonded to it. Poisson's ratio is the tissue's.
struct Inclusion {
  InclusionShape shape = InclusionShape::Sphere;
  std::array<double, 3> size_mm = {8, 8,
                                   8};  ///< along x, y, z; of a sphere the first, of a cylinder see size()
  double depth_mm = 5;                  ///< from the tissue's surface to the inclusion's top, >= 0
  double stiffness_ratio = 10;          ///< its Young's modulus over the tissue's, 0.01 to 1e5; 1: none
  std::array<double, 2> offset_mm = {0, 0};  ///< of its centre from the block's middle

  /// Outer sizes along x, y and z: a sphere is as wide everywhere; an upright cylinder is size_mm[0] across
  /// and size_mm[2] high, a lying one size_mm[2] across and size_mm[0] long.
  std::array<double, 3> size() const;
};

/// The block's top layer, of another modulus than what lies below it and bonded to that. Poisson's ratio is
/// the tissue's.
struct Skin {
  double thickness_mm = 2;     ///< part of the block's own, above 0, half of it at most
  double stiffness_ratio = 1;  ///< its Young's modulus over the tissue's, 0.01 to 1e5
};

/// One sheet of the sensor's pad, bonded to the sheets beside it.
struct PadSheet {
  double thickness_mm = 0;
  double young_Pa = 0;
};

/// Body that presses. The rim of the block is free; its bottom is bonded to a rigid floor.
enum class Presser : uint8_t {
  Flat,      ///< a rigid plate, see plate_half_mm; with a pad: the plate that the pad is bonded to
  Sphere,    ///< a rigid ball on the middle of the surface; contact where it presses, found node by node
  Pressure,  ///< the same pressure everywhere on the surface
};

/// The question. Lengths in mm, x and y along the surface, z down from it.
struct Scene {
  std::array<double, 3> block_mm = {40, 40, 20};  ///< length, width, thickness of the tissue
  double young_Pa = 4000;
  double poisson = 0.495;      ///< 0 to 0.4999, of tissue, inclusion and pad
  bool bottom_slides = false;  ///< the floor holds the tissue's height only, not its sides
  std::optional<Inclusion> inclusion = Inclusion{};
  std::vector<Inclusion> others;  ///< more of them, apart from it and from each other
  std::optional<Skin> skin;       ///< inclusions lie below it; none: the block is of one tissue

  std::vector<PadSheet> pad;  ///< from the tissue outwards; empty: the presser touches the tissue
  bool pad_slides = false;    ///< on the tissue, without friction and without lifting off; else bonded to it

  Presser presser = Presser::Flat;
  /// Half the length and width of a flat plate straight on the tissue, mm. It holds the tissue that lies
  /// under it at rest, the rest of the surface is free. Its edges lie on planes of nodes. None: the whole
  /// surface.
  std::optional<std::array<double, 2>> plate_half_mm;
  bool plate_sticks = false;  ///< a flat plate straight on the tissue holds it sideways; else it slides
  double plate_friction = 0;  ///< coefficient with which it slides, 0 to 2: at large strain alone
  double ball_radius_mm = 0;  ///< of Presser::Sphere
  std::optional<double> press_mm = 1;  ///< way of the presser from first touch (mean way of the surface under
                                       ///< Presser::Pressure), > 0
  std::optional<double> force_N;       ///< instead of press_mm, > 0

  std::array<uint32_t, 3> cells = {64, 64, 32};  ///< of the tissue along x, y, z; the pad has more of its own
};

/// Who solves the equations. Auto: the faster of the two on this grid, found by a trial of each.
enum class Worker : uint8_t { Processor, Device, Auto };

/// How it is solved.
struct Options {
  double residual = 0;   ///< relative, 1e-12 to 1e-2; 0: 1e-6, and 1e-8 above a Poisson ratio of 0.497
  uint32_t threads = 0;  ///< 0: one per core
  /// Neo-Hookean tissue in steps of at most `step_mm` instead of the linear model, see large_strain.h: the
  /// flat plate only, on the processor.
  bool large_strain = false;
  double step_mm = 0.5;
  bool quarter = true;  ///< scenes with two planes of symmetry are solved as a quarter
  uint32_t most_iterations = 2000;
  Worker worker = Worker::Processor;
  /// Opens the device of Device and Auto, once and only where it is wanted; what it returns outlives the
  /// call. Where it throws Error(Failure::Device), Auto goes on without.
  std::function<gpu::Context*()> device = {};
};

/// Deflections have the same nodes.
using Map = PressureMap;

/// The answer. Where `converged` is false no number in it is to be used but `residual`.
struct Result {
  bool converged = false;
  double residual = 0;      ///< of the equations in double precision, relative to the right side
  uint32_t iterations = 0;  ///< conjugate gradients', of all rounds
  uint32_t rounds = 0;      ///< of refinement and of contact search
  double wall_s = 0;
  uint64_t bytes = 0;  ///< held by the solver at its largest
  std::string solver;  ///< who solved it and, where it was chosen, why

  Map stress_Pa;      ///< normal stress on the tissue's surface, pressure counts up
  Map deflection_mm;  ///< of the tissue's surface, into the tissue counts up
  double force_N = 0;
  double press_mm = 0;
  double center_stress_Pa = 0;   ///< on the block's middle
  double contact_radius_mm = 0;  ///< of Presser::Sphere, of the circle of the same area
  double core_strain = 0;        ///< eps_zz in the inclusion's middle (block's, without one), stretch > 0;
                                 ///< NaN at large strain
  double tension_fraction = 0;   ///< of the pressed area where the presser would have to pull: what
                                 ///< real contact would lift off
  std::vector<std::string> warnings;  ///< one line each: what lies outside the model's validity
};

/// The scene's plate ends on planes of nodes along x and y, or is the whole surface.
bool plate_on_nodes(const Scene& scene);

/// Throws Error(Failure::Usage) naming the first field that is out of range or does not fit the others.
void check(const Scene& scene);

}  // namespace palpate::fem
