// Indenters on pads of any thickness: closed forms, published corrections, integrals and limits.
#include "engine/elasticity/modulus/indentation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "palpate/error.h"

namespace palpate {
namespace {

constexpr Material kPadMaterial{0.2, 0.5};
constexpr IndenterShape kShapes[] = {IndenterShape::Paraboloid, IndenterShape::Sphere, IndenterShape::Cone,
                                     IndenterShape::FlatPunch};

/// r = a sin(t): smooth for spheres, and finite at a punch's rim.
double integral_of(const PadIndenter& indenter, const Indentation& c, int steps) {
  double sum = 0;
  for (int i = 0; i < steps; ++i) {
    const double t = (i + 0.5) * std::numbers::pi / 2 / steps, r = c.radius_mm * std::sin(t);
    sum += indenter.pressure_MPa(c, r) * 2 * std::numbers::pi * r * c.radius_mm * std::cos(t) *
           std::numbers::pi / 2 / steps;
  }
  return sum;
}

TEST(Indentation, ClosedFormsOnTheHalfSpace) {
  const double modulus = effective_modulus_MPa(kPadMaterial);
  const Pad deep{kPadMaterial};
  const Indentation hertz = PadIndenter(deep, {IndenterShape::Paraboloid, 8}).at_force(0.7);
  const IndenterContact closed = hertz_contact(0.7, modulus, 8);
  EXPECT_NEAR(hertz.radius_mm, closed.radius_mm, 1e-12);
  EXPECT_NEAR(hertz.depth_mm, closed.indentation_mm, 1e-12);
  EXPECT_NEAR(hertz.pressure_max_MPa, closed.pressure_max_MPa, 1e-13);
  const Indentation punch = PadIndenter(deep, {IndenterShape::FlatPunch, 3}).at_force(0.7);
  EXPECT_NEAR(punch.depth_mm, flat_punch_contact(0.7, modulus, 3).indentation_mm, 1e-14);
  // Sneddon's cone by hand.
  const double angle = 1.1;
  const Indentation cone = PadIndenter(deep, {IndenterShape::Cone, 1, angle}).at_depth(0.6);
  EXPECT_NEAR(cone.force_N, 2 / std::numbers::pi * modulus * 0.36 * std::tan(angle), 1e-13);
  EXPECT_NEAR(cone.radius_mm, 2 / std::numbers::pi * 0.6 * std::tan(angle), 1e-13);
  // Sneddon's sphere by hand: d = a/2 ln((R+a)/(R-a)), F = E* ((a^2+R^2)/2 ln((R+a)/(R-a)) - a R).
  const PadIndenter sphere(deep, {IndenterShape::Sphere, 5});
  for (const double a : {1e-3, 0.09, 0.11, 1.0, 3.0, 4.9}) {
    const double l = std::log1p(2 * a / (5 - a));
    const Indentation c = sphere.at_radius(a);
    EXPECT_NEAR(c.depth_mm, a / 2 * l, 1e-12 * c.depth_mm) << a;
    if (a > 0.05) {  // the closed form loses its digits below
      EXPECT_NEAR(c.force_N, modulus * ((a * a + 25) / 2 * l - 5 * a), 1e-10 * c.force_N) << a;
    }
  }
  // A small contact does not know a sphere from a paraboloid.
  EXPECT_NEAR(sphere.at_force(1e-7).depth_mm / hertz_contact(1e-7, modulus, 5).indentation_mm, 1, 1e-4);
}

TEST(Indentation, ForceAndDepthAreInverse) {
  std::mt19937_64 random(6);
  std::uniform_real_distribution<double> u(0, 1);
  for (int i = 0; i < 200; ++i) {
    Pad pad{{0.01 + u(random), 0.5 * u(random)}};
    if (i % 3) pad.thickness_mm = 1 + 9 * u(random);
    pad.base = i % 2 ? Base::Bonded : Base::Frictionless;
    Indenter indenter{kShapes[i % 4], 1 + 5 * u(random), 0.3 + 1.1 * u(random)};
    if (i % 5 == 0) indenter.material = {0.5, 0.4};
    const PadIndenter solver(pad, indenter);
    const double depth = 0.5 * u(random);
    const Indentation there = solver.at_depth(depth), back = solver.at_force(there.force_N);
    ASSERT_NEAR(there.depth_mm, depth, 1e-12);
    ASSERT_NEAR(back.depth_mm, depth, 1e-10) << i;
    ASSERT_NEAR(back.radius_mm, there.radius_mm, 1e-9) << i;
  }
  for (const IndenterShape shape : kShapes) {
    const PadIndenter solver({kPadMaterial, 4}, {shape, 2, 1});
    EXPECT_EQ(solver.at_force(0).depth_mm, 0);
    EXPECT_EQ(solver.at_depth(0).force_N, 0);
  }
}

TEST(Indentation, PressureIntegratesToTheForce) {
  for (const IndenterShape shape : kShapes)
    for (const double thickness : {1.5, 6.0, static_cast<double>(INFINITY)}) {
      const PadIndenter solver({{0.2, 0.45}, thickness}, {shape, 3, 1.2});
      const Indentation c = solver.at_force(0.4);
      EXPECT_NEAR(integral_of(solver, c, 300), 0.4, 2e-5) << static_cast<int>(shape) << " " << thickness;
      EXPECT_EQ(solver.pressure_MPa(c, 1.0001 * c.radius_mm), 0);
    }
}

TEST(Indentation, AgreesWithTheOtherSolverOfTheLayer) {
  for (const Base base : {Base::Bonded, Base::Frictionless}) {
    const Layer layer({0.2, 0.48}, 4, base);
    const PadIndenter paraboloid({{0.2, 0.48}, 4, base}, {IndenterShape::Paraboloid, 10});
    for (const double a : {0.1, 1.0, 4.0, 12.0}) {
      const IndenterContact truth = layer.press_sphere_to_radius(a, 10).summary();
      const Indentation c = paraboloid.at_radius(a);
      EXPECT_NEAR(c.force_N / truth.force_N, 1, 1e-8) << a;
      EXPECT_NEAR(c.depth_mm / truth.indentation_mm, 1, 1e-8) << a;
      EXPECT_NEAR(c.pressure_max_MPa / truth.pressure_max_MPa, 1, 1e-7) << a;
    }
    const PadIndenter punch({{0.2, 0.48}, 4, base}, {IndenterShape::FlatPunch, 5});
    EXPECT_NEAR(punch.at_force(1).depth_mm / layer.press_flat(1, 5).summary().indentation_mm, 1, 1e-8);
  }
}

TEST(Indentation, PublishedCorrectionsOfTheConeHold) {
  // Garcia and Garcia, Biophys. J. 114 (2018) 2923: bonded, incompressible, in u = d tan(theta) / H.
  const double modulus = effective_modulus_MPa(kPadMaterial), angle = 1.0, thickness = 4;
  const PadIndenter solver({kPadMaterial, thickness}, {IndenterShape::Cone, 1, angle});
  for (const double depth : {0.1, 0.4, 0.8, 1.2}) {
    const double u = depth * std::tan(angle) / thickness;
    const double published = 1 + u * (0.721 + u * (0.650 + u * (0.491 + u * 0.225)));
    EXPECT_NEAR(solver.at_depth(depth).force_N / cone_force_N(depth, modulus, angle), published,
                0.003 * published);
  }
}

TEST(Indentation, ThickPadsAreHalfSpaces) {
  for (const IndenterShape shape : kShapes) {
    const Indentation deep = PadIndenter({kPadMaterial}, {shape, 3, 1.2}).at_force(0.1);
    double before = 5;
    for (const double thickness : {10.0, 100.0, 1e3, 1e4}) {
      const double off = std::abs(
          PadIndenter({kPadMaterial, thickness}, {shape, 3, 1.2}).at_force(0.1).depth_mm / deep.depth_mm - 1);
      EXPECT_LT(off, 0.2 * before) << thickness;  // falls as a / H
      before = off;
    }
    EXPECT_LT(before, 1e-3);
  }
}

TEST(Indentation, AnElasticBallYieldsToo) {
  // On a half space as E* says; on a layer the ball's share does not feel the base.
  const Indenter soft{IndenterShape::Paraboloid, 5, 0, {0.2, 0.5}}, rigid{IndenterShape::Paraboloid, 5};
  const Indentation both = PadIndenter({kPadMaterial}, soft).at_force(0.1);
  EXPECT_NEAR(both.depth_mm,
              hertz_contact(0.1, effective_modulus_MPa(kPadMaterial, soft.material), 5).indentation_mm,
              1e-12);
  const Indentation thin = PadIndenter({kPadMaterial, 2}, soft).at_force(0.1);
  EXPECT_LT(thin.depth_mm, both.depth_mm);
  EXPECT_GT(thin.depth_mm, PadIndenter({kPadMaterial, 2}, rigid).at_force(0.1).depth_mm);
}

TEST(Indentation, ErrorsOfHertzAreWhatTheySay) {
  const Pad pad{kPadMaterial, 4};
  const Indenter ball{IndenterShape::Sphere, 5};
  const Indentation found = PadIndenter(pad, ball).at_force(1);
  const HertzErrors e = hertz_errors(pad, ball, found);
  const double modulus = effective_modulus_MPa(kPadMaterial);
  EXPECT_NEAR(1 + e.together,
              4.0 / 3 * modulus * std::sqrt(5) * std::pow(found.depth_mm, 1.5) / found.force_N, 1e-9);
  EXPECT_NEAR(1 + e.together, (1 + e.parabola) * (1 + e.thickness), 1e-12);
  EXPECT_LT(e.thickness, -0.4);
  EXPECT_GT(e.parabola, 0.01);
  EXPECT_NEAR(e.strain, 0.2 * found.radius_mm / 5, 1e-15);
}

TEST(Indentation, BadInputIsRefused) {
  const auto refuse = [](Pad pad, Indenter indenter) { EXPECT_THROW(PadIndenter(pad, indenter), Error); };
  refuse({{0, 0.5}}, {});
  refuse({{0.2, 0.51}}, {});
  refuse({{NAN, 0.5}}, {});
  refuse({{INFINITY, 0.5}}, {IndenterShape::Sphere, 1, 0, {1, 0.3}});
  refuse({kPadMaterial, 0}, {});
  refuse({kPadMaterial, -1}, {});
  refuse({kPadMaterial}, {IndenterShape::Sphere, 0});
  refuse({kPadMaterial}, {IndenterShape::Cone, 1, 0});
  refuse({kPadMaterial}, {IndenterShape::Cone, 1, std::numbers::pi / 2});
  const PadIndenter ball({kPadMaterial, 1}, {IndenterShape::Sphere, 5});
  EXPECT_THROW(ball.at_force(-1), Error);
  EXPECT_THROW(ball.at_force(NAN), Error);
  EXPECT_THROW(ball.at_depth(-1), Error);
  EXPECT_THROW(ball.at_radius(5.1), Error);
  EXPECT_THROW(ball.at_force(1e9), Error);  // would sink in to its equator
  EXPECT_THROW(PadIndenter({kPadMaterial, 0.2}, {IndenterShape::FlatPunch, 5}).at_force(1), Error);
}

}  // namespace
}  // namespace palpate
