// Contact mechanics: golden numbers of the theory, closed forms against the exact layer, and the exact layer
// against its own integrals and limits.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "engine/elasticity/hertz.h"
#include "engine/elasticity/layer.h"
#include "palpate/error.h"

namespace palpate {
namespace {

/// Integral of p(r) 2 pi r over the contact, in r = a sin(t), which is smooth for Hertz and for the flat
/// punch.
template <class Pressure>
double integrate_pressure(double a, Pressure pressure) {
  constexpr int n = 4000;
  double sum = 0;
  for (int i = 0; i < n; ++i) {
    const double t = (i + 0.5) * std::numbers::pi / 2 / n;
    sum += pressure(a * std::sin(t)) * 2 * std::numbers::pi * a * std::sin(t) * a * std::cos(t) *
           std::numbers::pi / 2 / n;
  }
  return sum;
}

TEST(Hertz, GoldenModuli) {
  const double layers[] = {0.14, 0.08, 0.034};
  const double thickness[] = {2, 2, 2};
  const double paper = paper_series_modulus_MPa(layers);
  EXPECT_NEAR(effective_modulus_MPa({paper, 0.4}), 0.0242684, 5e-8);
  EXPECT_NEAR(series_modulus_MPa(layers, thickness), 3 * paper, 1e-15);
  EXPECT_NEAR(effective_modulus_MPa({2, 0.5}, {2, 0.5}), 1 / 0.75, 1e-15);
  EXPECT_DOUBLE_EQ(effective_radius_mm(5, 5), 2.5);
  EXPECT_DOUBLE_EQ(effective_radius_mm(5, INFINITY), 5);
}

TEST(Hertz, GoldenContact) {
  const IndenterContact c = hertz_contact(0.02, 0.0243, 5);
  EXPECT_NEAR(c.radius_mm, 1.45597, 5e-6);
  EXPECT_NEAR(c.pressure_max_MPa * 1e3, 4.50472, 5e-6);
  EXPECT_NEAR(c.indentation_mm, 0.42396, 1e-5);  // the golden number is truncated, not rounded
  EXPECT_EQ(c.warnings, 0u);
}

TEST(Hertz, PaperExampleIsCorrectedAndWarnedAbout) {
  const IndenterContact c = hertz_contact(2, 0.0243, 5);
  EXPECT_NEAR(c.radius_mm, 6.7580, 5e-5);
  EXPECT_NEAR(c.pressure_max_MPa, 0.020909, 5e-7);
  EXPECT_NEAR(c.indentation_mm, 9.13, 5e-3);
  EXPECT_EQ(c.warnings, uint32_t{kWideContact | kDeepIndentation});
  EXPECT_EQ(describe_warnings(c.warnings).size(), 2u);
}

TEST(Hertz, ThinPadIsWarnedAbout) {
  EXPECT_EQ(hertz_contact(0.02, 0.0243, 5, 100).warnings, 0u);
  EXPECT_TRUE(hertz_contact(0.02, 0.0243, 5, 6).warnings & kThinPad);
}

TEST(Hertz, PressureIntegratesToForce) {
  const IndenterContact sphere = hertz_contact(0.7, 0.3, 8);
  EXPECT_NEAR(integrate_pressure(sphere.radius_mm, [&](double r) { return hertz_pressure_MPa(sphere, r); }),
              0.7, 1e-6);
  EXPECT_EQ(hertz_pressure_MPa(sphere, sphere.radius_mm * 1.01), 0);
  const IndenterContact flat = flat_punch_contact(0.7, 0.3, 3);
  EXPECT_NEAR(integrate_pressure(3, [&](double r) { return flat_punch_pressure_MPa(flat, r); }), 0.7, 1e-6);
  EXPECT_NEAR(flat.indentation_mm, 0.7 / (2 * 0.3 * 3), 1e-15);
}

TEST(Hertz, SurfaceIsContinuousAndDecaysLikeAPointLoad) {
  const IndenterContact c = hertz_contact(0.7, 0.3, 8);
  const double a = c.radius_mm;
  EXPECT_NEAR(hertz_deflection_mm(c, a * (1 - 1e-9)), hertz_deflection_mm(c, a * (1 + 1e-9)), 1e-8);
  EXPECT_NEAR(hertz_deflection_mm(c, a), c.indentation_mm / 2, 1e-12);
  const double r = 100 * a;
  EXPECT_NEAR(hertz_deflection_mm(c, r) * std::numbers::pi * 0.3 * r / 0.7, 1, 1e-4);
  const IndenterContact flat = flat_punch_contact(0.7, 0.3, 3);
  EXPECT_NEAR(flat_punch_deflection_mm(flat, 300) * std::numbers::pi * 0.3 * 300 / 0.7, 1, 1e-4);
}

TEST(Hertz, BadInputIsRefused) {
  EXPECT_THROW(hertz_contact(-1, 1, 1), Error);
  EXPECT_THROW(hertz_contact(1, 0, 1), Error);
  EXPECT_THROW(hertz_contact(1, 1, NAN), Error);
  EXPECT_THROW(effective_modulus_MPa({1, 0.6}), Error);
  EXPECT_THROW(effective_modulus_MPa({}), Error);
  EXPECT_THROW(Layer({0.1, 0.5}, 0), Error);
  EXPECT_THROW(Layer({0.1, 0.5}, 1).press_flat(1, 7), Error);
}

TEST(Layer, ThickPadIsHertz) {
  const Layer layer({0.225, 0.5}, 1e4);
  const LayerContact c = layer.press_sphere(0.7, 8);
  const IndenterContact h = hertz_contact(0.7, 0.3, 8);
  EXPECT_NEAR(c.summary().radius_mm, h.radius_mm, 1e-4 * h.radius_mm);
  EXPECT_NEAR(c.summary().indentation_mm, h.indentation_mm, 4e-4 * h.indentation_mm);
  EXPECT_NEAR(c.summary().pressure_max_MPa, h.pressure_max_MPa, 4e-4 * h.pressure_max_MPa);
  for (double r : {0.3, 1.0, 1.9, 2.4, 2.6, 3.0, 8.0}) {
    EXPECT_NEAR(c.pressure_MPa(r), hertz_pressure_MPa(h, r), 1e-3 * h.pressure_max_MPa) << r;
    EXPECT_NEAR(c.deflection_mm(r), hertz_deflection_mm(h, r), 1e-3 * h.indentation_mm) << r;
  }
  const LayerContact p = layer.press_flat(0.7, 3);
  const IndenterContact f = flat_punch_contact(0.7, 0.3, 3);
  EXPECT_NEAR(p.pressure_MPa(2.9), flat_punch_pressure_MPa(f, 2.9), 1e-3 * flat_punch_pressure_MPa(f, 2.9));
  EXPECT_NEAR(p.deflection_mm(4), flat_punch_deflection_mm(f, 4), 1e-3 * f.indentation_mm);
}

TEST(Layer, ForcePressureAndSurfaceAgreeOnManyContacts) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> uniform(0, 1);
  for (int i = 0; i < 60; ++i) {
    const double poisson = i % 3 == 0 ? 0.5 : 0.5 * uniform(random);
    const double thickness = 1 + 9 * uniform(random), radius = 2 + 10 * uniform(random);
    const double a = thickness * (0.05 + 2.5 * uniform(random));
    const Layer layer({0.2, poisson}, thickness, i % 2 ? Base::Bonded : Base::Frictionless);
    SCOPED_TRACE("contact " + std::to_string(i) + " a/H " + std::to_string(a / thickness));
    const LayerContact c = layer.press_sphere_to_radius(a, radius);
    const double force = c.summary().force_N;
    ASSERT_GT(force, 0);
    EXPECT_NEAR(integrate_pressure(a, [&](double r) { return c.pressure_MPa(r); }), force, 1e-5 * force);
    EXPECT_NEAR(c.force_within_N(a * (1 - 1e-12)), force, 1e-5 * force);
    EXPECT_NEAR(c.force_within_N(0), 0, 1e-6 * force);
    // The surface meets the indenter smoothly at the rim.
    const double inside = c.deflection_mm(a), outside = c.deflection_mm(a * (1 + 1e-9));
    EXPECT_NEAR(inside, outside, 1e-6 * c.summary().indentation_mm);
    // By force the same contact comes back.
    EXPECT_NEAR(layer.press_sphere(force, radius).summary().radius_mm, a, 1e-9 * a);

    const LayerContact flat = layer.press_flat(0.5, a);
    EXPECT_NEAR(integrate_pressure(a, [&](double r) { return flat.pressure_MPa(r); }), 0.5, 1e-4);
    EXPECT_NEAR(flat.deflection_mm(a * (1 + 1e-12)), flat.summary().indentation_mm,
                1e-5 * flat.summary().indentation_mm);
  }
}

TEST(Layer, DeepeningObeysEnergy) {
  // dF/dd of a growing contact is the stiffness of the flat punch of the same radius.
  const Layer layer({0.2, 0.5}, 4);
  for (double a : {0.5, 1.5, 3.0, 6.0, 12.0}) {
    const double h = 1e-4 * a;
    const IndenterContact low = layer.press_sphere_to_radius(a - h, 20).summary();
    const IndenterContact high = layer.press_sphere_to_radius(a + h, 20).summary();
    const double stiffness = 1 / layer.press_flat(1, a).summary().indentation_mm;
    EXPECT_NEAR((high.force_N - low.force_N) / (high.indentation_mm - low.indentation_mm) / stiffness, 1,
                1e-5)
        << a;
  }
}

TEST(Layer, IncompressiblePadKeepsItsVolume) {
  // K(0) = 0 for Poisson 0.5: what sinks under the indenter rises around it.
  const Layer layer({0.2, 0.5}, 3);
  const LayerContact c = layer.press_sphere(1, 8);
  double volume = 0, sunk = 0;
  const double step = 0.002;
  for (double r = step / 2; r < 15 * 3; r += step) {
    const double u = c.deflection_mm(r) * 2 * std::numbers::pi * r * step;
    volume += u;
    sunk += std::max(u, 0.0);
  }
  EXPECT_LT(c.deflection_mm(2 * c.summary().radius_mm), 0);
  EXPECT_NEAR(volume / sunk, 0, 2e-3);
}

TEST(Layer, PublishedCorrectionsHoldWithinTheirStatedErrors) {
  const double thickness = 4, radius = 10;
  const Layer bonded({0.2, 0.5}, thickness), sliding({0.2, 0.5}, thickness, Base::Frictionless);
  const auto off = [&](const Layer& layer, double a, ThicknessModel model, double& chi) {
    const IndenterContact c = layer.press_sphere_to_radius(a, radius).summary();
    chi = std::sqrt(radius * c.indentation_mm) / thickness;
    return sphere_force_N(model, c.indentation_mm, layer.effective_modulus_MPa(), radius, thickness) /
               c.force_N -
           1;
  };
  for (double a = 0.1; a < 4; a += 0.1) {
    double chi = 0;
    const double dimitriadis = off(bonded, a, ThicknessModel::Dimitriadis, chi);
    if (chi <= 0.3) {
      EXPECT_LT(std::abs(dimitriadis), 0.03) << chi;
    }
    if (chi <= 0.3) {
      EXPECT_LT(std::abs(off(bonded, a, ThicknessModel::Garcia, chi)), 0.005) << chi;
    }
    if (chi <= 0.55) {
      EXPECT_LT(std::abs(off(bonded, a, ThicknessModel::Garcia, chi)), 0.015) << chi;
    }
    if (chi <= 0.55) {
      const IndenterContact c = bonded.press_sphere_to_radius(a, radius).summary();
      EXPECT_NEAR(sphere_contact_radius_mm(ThicknessModel::Garcia, c.indentation_mm, radius, thickness), a,
                  0.03 * a);
      EXPECT_NEAR(sphere_indentation_mm(ThicknessModel::Garcia, c.force_N, bonded.effective_modulus_MPa(),
                                        radius, thickness),
                  c.indentation_mm, 0.01 * c.indentation_mm);
    }
    const double unbonded = off(sliding, a, ThicknessModel::DimitriadisUnbonded, chi);
    if (chi <= 0.3) {
      EXPECT_LT(std::abs(unbonded), 0.05) << chi;
    }
    const double flat =
        1 / bonded.press_flat(1, a).summary().indentation_mm / (2 * bonded.effective_modulus_MPa() * a);
    if (a / thickness <= 0.7) {
      EXPECT_NEAR(flat_punch_thickness_factor(a / thickness) / flat, 1, 0.015) << a;
    }
  }
}

TEST(Layer, ClosedFormWarnsBeyondItsRange) {
  uint32_t warnings = 0;
  sphere_indentation_mm(ThicknessModel::Dimitriadis, 0.01, 0.2667, 10, 4, &warnings);
  EXPECT_EQ(warnings, 0u);
  sphere_indentation_mm(ThicknessModel::Dimitriadis, 1, 0.2667, 10, 4, &warnings);
  EXPECT_TRUE(warnings & kBeyondCorrection);
}

TEST(Hertz, TangentialStiffness) {
  EXPECT_NEAR(mindlin_stiffness_N_per_mm({0.3, 0.5}, 3), 8 * 0.1 * 3 / 1.5, 1e-12);
}

}  // namespace
}  // namespace palpate
