// The model that moduli are fitted with and the finite elements that judge it, each against closed forms and
// against each other.
#include "engine/elasticity/modulus/press_model.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "engine/elasticity/modulus/press_truth.h"
#include "engine/fem/linear/solver.h"
#include "palpate/error.h"

namespace palpate {
namespace {

constexpr double kBonded_MPa = 0.2;
const Pad kBondedPad{{kBonded_MPa, 0.5}, 6, Base::Bonded};

Sample cylinder() {
  return {SampleShape::Cylinder, 10, 10, 0.5, 0, Support::Sliding};
}
Sample ball() {
  return {SampleShape::Sphere, 16, 16, 0.5, 0, Support::Sliding};
}

TEST(AxisymmetricSolid, UniaxialCylinderIsExact) {
  for (const double poisson : {0.0, 0.3, 0.4999}) {
    const FaceCompliance c = face_compliance(cylinder_mesh(graded(0, 5, 12, 0.9), graded(0, 8, 9, 0.95), 5),
                                             poisson, Support::Sliding);
    const double area = std::numbers::pi * 25;
    for (size_t i = 0; i < c.size(); ++i) {
      double down = 0, out = 0;
      for (size_t j = 0; j < c.size(); ++j) {
        down += c.down[i * c.size() + j] * c.area_mm2[j] / area;
        out += c.out[i * c.size() + j] * c.area_mm2[j] / area;
      }
      EXPECT_NEAR(down, 8 / area, 1e-10) << poisson << " node " << i;
      EXPECT_NEAR(out, poisson * c.r_mm[i] / area, 1e-10) << poisson << " node " << i;
    }
  }
}

TEST(AxisymmetricSolid, BallOnAPlateIsHertzWhereTheContactIsSmall) {
  const double radius = 8;
  for (const double poisson : {0.3, 0.4999}) {
    const FaceCompliance c =
        face_compliance(half_sphere_mesh(radius, graded(0, 2, 80, 1), 0.025), poisson, Support::Sliding);
    std::vector<double> gap;
    for (const double r : c.r_mm) gap.push_back(radius - std::sqrt(radius * radius - r * r));
    const double force_N = 0.06;
    const FaceContact contact = press_faces(c.down, gap, force_N);
    ASSERT_TRUE(contact.converged);
    const IndenterContact hertz = hertz_contact(force_N, effective_modulus_MPa({1, poisson}), radius);
    EXPECT_NEAR(contact.force_N[1] / c.area_mm2[1], hertz.pressure_max_MPa, 0.01 * hertz.pressure_max_MPa);
    // The rest of the ball is short of a half space by about the contact's fraction of its radius.
    EXPECT_NEAR(contact.approach_mm, hertz.indentation_mm, 0.035 * hertz.indentation_mm);
    EXPECT_LT(contact.approach_mm, hertz.indentation_mm);
  }
}

TEST(AxisymmetricSolid, RigidBallOnThePadIsTheExactLayer) {
  std::vector<double> radii = graded(0, 4.5, 60, 1);
  for (double step = 0.08; radii.back() < 45; step *= 1.08) radii.push_back(radii.back() + step);
  const FaceCompliance c =
      face_compliance(cylinder_mesh(radii, graded(0, 6, 36, 1 / 1.05), 4.5), 0.4999, Support::Bonded);
  std::vector<double> gap;
  for (const double r : c.r_mm) gap.push_back(r * r / 16);
  const Layer layer({1, 0.5}, 6);
  for (const double force_N : {0.5, 2.0, 5.0}) {
    const IndenterContact exact = layer.press_sphere(force_N, 8).summary();
    EXPECT_NEAR(press_faces(c.down, gap, force_N).approach_mm, exact.indentation_mm,
                5e-4 * exact.indentation_mm);
  }
}

TEST(AxisymmetricSolid, BadMeshesAreRefused) {
  EXPECT_THROW(face_compliance(cylinder_mesh({0, 1}, {0, 1}, 1), 0.5, Support::Sliding), Error);
  EXPECT_THROW(face_compliance(cylinder_mesh({0, 1, 1}, {0, 1}, 1), 0.3, Support::Sliding), Error);
}

TEST(PressModel, FlatSampleIsWhatFiniteElementsSay) {
  const PressModel model(kBondedPad, cylinder());
  const PressTruth truth(kBondedPad, cylinder(), 60);
  for (const double young : {0.005, 0.103, 0.2, 1.0, 5.0}) {
    const double force_N = std::min(1.0, 0.08 * young * cylinder().face_mm2());
    const TruePress t = truth.press(force_N, young, kBonded_MPa);
    const PressSight s = model.at_force(force_N, young, kBonded_MPa);
    ASSERT_TRUE(t.converged);
    EXPECT_NEAR(s.mean_depth_mm, t.mean_depth_mm, 0.005 * t.mean_depth_mm) << young;
    EXPECT_NEAR(s.depth_mm, t.depth_mm, 0.02 * t.depth_mm) << young;
    EXPECT_NEAR(s.approach_mm, t.approach_mm, 0.003 * t.approach_mm) << young;
    const double grown = t.r_mm.back() - 5;
    // Under a sample that is stiffer than the pad the edge is a singular place, and its way small.
    EXPECT_NEAR(s.radius_mm - 5, grown, (young > 0.5 ? 0.06 : 0.015) * grown) << young;
    EXPECT_NEAR(s.strain, force_N / (young * cylinder().face_mm2()), 1e-4 * s.strain) << young;
  }
}

TEST(PressModel, BallIsWhatFiniteElementsSay) {
  const PressModel model(kBondedPad, ball());
  const PressTruth truth(kBondedPad, ball(), 80);
  for (const double young : {0.01, 0.103, 1.0, 5.0}) {
    double force_N = 1;
    while (!(model.at_force(force_N, young, kBonded_MPa).radius_mm < 0.3 * 8)) force_N *= 0.95;
    const TruePress t = truth.press(force_N, young, kBonded_MPa);
    const PressSight s = model.at_force(force_N, young, kBonded_MPa);
    ASSERT_TRUE(t.converged);
    EXPECT_NEAR(s.depth_mm, t.depth_mm, 0.003 * t.depth_mm) << young;
    EXPECT_NEAR(s.approach_mm, t.approach_mm, 0.005 * t.approach_mm) << young;
    // The rim lies between the last node that carries and the next.
    size_t last = 0;
    for (size_t i = 0; i < t.r_mm.size(); ++i)
      if (t.pressure_MPa[i] > 0) last = i;
    EXPECT_NEAR(s.radius_mm, t.r_mm[last], 1.5 * t.r_mm[1]) << young;
  }
}

TEST(PressModel, TruthHardlyChangesWithItsGrid) {
  for (const Sample& sample : {cylinder(), ball()}) {
    const TruePress coarse = PressTruth(kBondedPad, sample, 60).press(0.3, 0.103, kBonded_MPa),
                    fine = PressTruth(kBondedPad, sample, 90).press(0.3, 0.103, kBonded_MPa);
    EXPECT_NEAR(coarse.approach_mm, fine.approach_mm, 0.001 * fine.approach_mm);
    EXPECT_NEAR(coarse.depth_mm, fine.depth_mm, 0.002 * fine.depth_mm);
    EXPECT_NEAR(coarse.r_mm.back(), fine.r_mm.back(), 1e-4 * fine.r_mm.back());
  }
}

TEST(PressModel, RigidAndSoftLimits) {
  const PressModel model(kBondedPad, ball());
  const PadIndenter rigid(kBondedPad, {IndenterShape::Sphere, 8, 0, {}});
  const Indentation exact = rigid.at_force(0.3);
  const PressSight s = model.at_force(0.3, kBonded_MPa * 9e5, kBonded_MPa);
  EXPECT_NEAR(s.radius_mm, exact.radius_mm, 1e-3 * exact.radius_mm);
  EXPECT_NEAR(s.depth_mm, exact.depth_mm, 1e-3 * exact.depth_mm);
  EXPECT_NEAR(model.depth_at_radius_mm(s.radius_mm, kBonded_MPa * 9e5, kBonded_MPa), s.depth_mm, 1e-6);
  // A flat sample far softer than the pad presses evenly: it widens by Poisson's ratio times the strain.
  EXPECT_NEAR(PressModel(kBondedPad, cylinder()).bulging(2e-5), 1, 1e-3);
}

TEST(PressModel, OutOfRangeIsNaNAndNonsenseIsRefused) {
  const PressModel model(kBondedPad, ball());
  EXPECT_TRUE(std::isnan(model.at_force(50, 0.005, kBonded_MPa).radius_mm));
  EXPECT_TRUE(std::isnan(model.at_force(-1, 0.1, kBonded_MPa).radius_mm));
  EXPECT_TRUE(std::isnan(model.at_force(1, 1e9, kBonded_MPa).radius_mm));
  Sample s = cylinder();
  s.size_mm = 0;
  EXPECT_THROW(PressModel(kBondedPad, s), Error);
  s = cylinder();
  s.poisson = 0.6;
  EXPECT_THROW(PressModel(kBondedPad, s), Error);
  s = cylinder();
  s.size_mm = 100;
  EXPECT_THROW(PressModel(kBondedPad, s), Error);
  EXPECT_THROW(PressModel({{-1, 0.5}, 6, Base::Bonded}, cylinder()), Error);
}

// The truth takes a cube for the cylinder of the same face. In three dimensions, a quarter of pad and cube as
// bricks that slide on each other, it is that: force, the pad's mean depth and the deepest point.
TEST(PressTruth, CubeInSpaceIsTheCylinderOfItsFace) {
  constexpr uint32_t kHalfFace = 8, kAcross = 3 * kHalfFace, kPadLayers = 16, kSampleLayers = 16;
  constexpr double kPoisson = 0.45;
  for (const double young_MPa : {0.05, 0.2, 1.0}) {
    SCOPED_TRACE(young_MPa);
    fem::CellGrid grid;
    grid.cells = {kAcross, kAcross, kPadLayers + 1 + kSampleLayers};
    grid.size_x_mm = grid.size_y_mm = 5.0 / kHalfFace;
    grid.size_z_mm.assign(kPadLayers, 6.0 / kPadLayers);
    grid.slit = kPadLayers;
    grid.size_z_mm.push_back(0);
    grid.size_z_mm.insert(grid.size_z_mm.end(), kSampleLayers, 10.0 / kSampleLayers);
    for (uint32_t k = 0; k < grid.cells[2]; ++k)
      for (uint32_t j = 0; j < kAcross; ++j)
        for (uint32_t i = 0; i < kAcross; ++i) {
          const float sample =
              i < kHalfFace && j < kHalfFace ? static_cast<float>(young_MPa / kBonded_MPa) : 1e-6f;
          grid.young.push_back(k < kPadLayers ? 1.0f : k == kPadLayers ? 0.0f : sample);
        }
    const size_t nodes = grid.nodes();
    fem::FixedNodes fixed(nodes);
    std::vector<double> u(3 * nodes), force;
    for (uint32_t k = 0; k <= grid.cells[2]; ++k)
      for (uint32_t j = 0; j <= kAcross; ++j)
        for (uint32_t i = 0; i <= kAcross; ++i) {
          const size_t n = grid.node(i, j, k);
          fixed[n] = static_cast<uint8_t>((k == 0               ? fem::kFixedAll
                                           : k == grid.cells[2] ? fem::kFixedZ
                                                                : 0) |
                                          (i == 0 ? fem::kFixedX : 0) | (j == 0 ? fem::kFixedY : 0));
          u[2 * nodes + n] = k == 0 ? 1 : 0;
        }
    WorkTeam team(2);
    fem::Solver solver(grid, kPoisson, fixed, team);
    ASSERT_TRUE(solver.solve(std::vector<double>(3 * nodes), u, 1e-6, 500).converged);
    solver.forces(u, force);
    double stiffness = 0, mean = 0, area = 0;  // N/mm; depths over the approach
    for (uint32_t j = 0; j <= kAcross; ++j)
      for (uint32_t i = 0; i <= kAcross; ++i) {
        stiffness += 4 * kBonded_MPa * force[2 * nodes + grid.node(i, j, 0)];
        if (i > kHalfFace || j > kHalfFace) continue;
        const double fraction = (i % kHalfFace == 0 ? 0.5 : 1) * (j % kHalfFace == 0 ? 0.5 : 1);
        mean += fraction * (1 - u[2 * nodes + grid.node(i, j, kPadLayers)]);
        area += fraction;
      }
    mean /= area;
    Pad pad;
    pad.material = {kBonded_MPa, kPoisson};
    pad.thickness_mm = 6;
    Sample cube;
    cube.poisson = kPoisson;
    const TruePress truth = PressTruth(pad, cube).press(0.001, young_MPa, kBonded_MPa);
    EXPECT_NEAR(std::abs(stiffness), truth.force_N / truth.approach_mm, 0.015 * std::abs(stiffness));
    EXPECT_NEAR(mean, truth.mean_depth_mm / truth.approach_mm, 0.015 * mean);
    const double deepest = 1 - u[2 * nodes + grid.node(0, 0, kPadLayers)];
    EXPECT_NEAR(deepest, truth.depth_mm / truth.approach_mm, 0.015 * deepest);
  }
}

}  // namespace
}  // namespace palpate
