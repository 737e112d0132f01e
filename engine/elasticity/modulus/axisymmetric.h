// Finite elements for a solid of revolution that is pressed on its top: bilinear quadrilaterals with the
// element's mean dilatation, which do not lock near Poisson's ratio 0.5. Small strains. What comes out is how
// the pressed face answers forces on it, so that a contact between two solids is a small dense problem for
// any pair of moduli. Lengths in mm, forces in N (around the whole circle), moduli in MPa.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace palpate {

struct SolidMesh {
  std::vector<std::array<double, 2>> nodes;    ///< r >= 0 and z, mm
  std::vector<std::array<uint32_t, 4>> quads;  ///< in order around; two corners may coincide
  std::vector<uint32_t> top;                   ///< nodes of the pressed face, from the axis outwards
  std::vector<uint32_t> base;                  ///< nodes that the support holds
};

/// How the support holds the base.
enum class Support : uint8_t {
  Bonded,   ///< neither along nor across
  Sliding,  ///< along the axis only: a smooth table, or a plane of symmetry
};

/// An upright cylinder with nodes at these radii (rising, from 0 to its own) and heights (rising from 0). The
/// top face has the nodes up to `top_radius_mm`.
SolidMesh cylinder_mesh(const std::vector<double>& radii_mm, const std::vector<double>& heights_mm,
                        double top_radius_mm);
/// The upper half of a sphere on its equator: nodes along the meridian at these distances r from the axis
/// (rising from 0, the pressed face), then on to the equator; `layer_mm` is the thickness of the outermost
/// elements, which grow inwards.
SolidMesh half_sphere_mesh(double radius_mm, const std::vector<double>& top_radii_mm, double layer_mm);

/// `count` + 1 numbers from `from` to `to`, each step `growth` times the one before.
std::vector<double> graded(double from, double to, int count, double growth);

/// The face's answer at unit Young's modulus; for another one divide by it. Matrices are row by row, n x n.
struct FaceCompliance {
  std::vector<double> r_mm;      ///< of the face's n nodes
  std::vector<double> area_mm2;  ///< of the face that each node stands for: its force under 1 MPa
  std::vector<double> down;      ///< (i, j): how far node i goes in under 1 N on node j, mm
  std::vector<double> out;       ///< (i, j): how far node i moves away from the axis, mm
  size_t size() const { return r_mm.size(); }
};

/// Throws Error(Failure::Input) on a Poisson's ratio outside [0, 0.4999] or a mesh with an element that is
/// turned over.
FaceCompliance face_compliance(const SolidMesh& mesh, double poisson, Support support);

/// A face pressed against another: what carries, and how far the two have come together.
struct FaceContact {
  std::vector<double> force_N;  ///< of each node
  double approach_mm = 0;
  bool converged = false;
};
/// Frictionless contact that cannot pull: forces f >= 0 with C f + gap = approach where f > 0 and more where
/// not, and sum f = force. `compliance`: of both together, n x n; `gap_mm`: at rest, >= 0, of each node.
FaceContact press_faces(const std::vector<double>& compliance, const std::vector<double>& gap_mm,
                        double force_N);

}  // namespace palpate
