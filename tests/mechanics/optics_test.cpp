// Light in plane layers: golden numbers of the theory, balance and limits, and other methods as truth.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "engine/optics/optical_stack.h"
#include "palpate/error.h"
#include "tests/reference/light_paths.h"

namespace palpate {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

optics::OpticalStack stacked_pad() {
  optics::OpticalStack stack;
  stack.layers = {{{1.39, 0}, 2}, {{1.40, 0}, 2}, {{1.41, 0}, 2}};
  return stack;
}

TEST(Optics, GoldenReflectanceOfThePad) {
  const double golden[][2] = {
      {0, 0.0540931862277}, {30, 0.0562253669366}, {60, 0.126627602153}, {80, 0.524408582105}};
  for (const auto& [deg, r] : golden)
    EXPECT_NEAR(optics::unpolarised_light(stacked_pad(), deg * kDegree).reflectance, r, 1e-12) << deg;
}

TEST(Optics, GoldenReflectanceFromInside) {
  optics::OpticalStack stack;
  stack.from = {1.41, 0};
  stack.layers = {{{1.40, 0}, 2}, {{1.39, 0}, 2}};
  const double golden[][2] = {{0, 0.0266518554589}, {40, 0.0994995526513}, {45, 0.63220646943}};
  for (const auto& [deg, r] : golden)
    EXPECT_NEAR(optics::unpolarised_light(stack, deg * kDegree).reflectance, r, 1e-11) << deg;
  for (const double deg : {45.2, 46.0, 60.0, 80.0, 85.0, 89.999, 90.0}) {
    const optics::StackLight light = optics::unpolarised_light(stack, deg * kDegree);
    EXPECT_EQ(light.reflectance, 1) << deg;
    EXPECT_EQ(light.transmittance, 0) << deg;
  }
}

TEST(Optics, GoldenAbsorbingPad) {
  optics::OpticalStack stack = stacked_pad();
  for (optics::OpticalLayer& layer : stack.layers) {
    const double k = 0.05 / layer.thickness_mm * stack.wavelength_nm * 1e-6 / (4 * std::numbers::pi);
    layer.index = {layer.index.real(), -k};
  }
  const double golden[][3] = {
      {0, 0.046973491, 0.813986674}, {30, 0.048432128, 0.803539728}, {60, 0.108478342, 0.719599354}};
  for (const auto& [deg, r, t] : golden) {
    const optics::StackLight light = optics::unpolarised_light(stack, deg * kDegree);
    EXPECT_NEAR(light.reflectance, r, 1e-9) << deg;
    EXPECT_NEAR(light.transmittance, t, 1e-9) << deg;
    EXPECT_NEAR(light.absorbed(), 1 - r - t, 2e-9) << deg;
  }
}

TEST(Optics, SlabIsItsClosedForm) {
  for (const double n : {1.1, 1.41, 2.4}) {
    optics::OpticalStack slab;
    slab.layers = {{{n, 0}, 3}};
    for (const double deg : {0.0, 20.0, 55.0, 75.0, 89.0})
      for (const optics::Polarisation p : {optics::Polarisation::S, optics::Polarisation::P}) {
        const double s = std::sin(deg * kDegree), r = optics::interface_fractions(1, n, s, p).reflected;
        const optics::StackLight light = optics::stack_light(slab, deg * kDegree, p);
        EXPECT_NEAR(light.reflectance, 2 * r / (1 + r), 1e-13) << n << " " << deg;
        EXPECT_NEAR(light.transmittance, (1 - r) / (1 + r), 1e-13) << n << " " << deg;
      }
  }
  optics::OpticalStack slab;
  slab.layers = {{{1.41, 0}, 3}};
  EXPECT_NEAR(optics::unpolarised_light(slab, 0).reflectance, 0.056256, 5e-7);  // the paper's form says 0.973
}

/// Any stack: 1 to 50 layers, clear and absorbing ones, metals, films and slabs.
optics::OpticalStack random_stack(std::mt19937_64& random) {
  std::uniform_real_distribution<double> u(0, 1);
  const auto pick = [&](double from, double to) { return from + (to - from) * u(random); };
  optics::OpticalStack stack;
  stack.from = {pick(1, 3), 0};
  const int layers = 1 + static_cast<int>(pick(0, 50));
  const auto medium = [&]() -> optics::OpticalIndex {
    const double kind = u(random);
    if (kind < 0.35) return {pick(1, 3), 0};
    if (kind < 0.6) return {pick(1, 3), -std::pow(10, pick(-9, 1))};
    return {pick(0.05, 3), -pick(1e-3, 10)};
  };
  for (int i = 0; i < layers; ++i) stack.layers.push_back({medium(), std::pow(10, pick(-6, 2))});
  stack.to = medium();
  stack.wavelength_nm = pick(300, 1100);
  return stack;
}

TEST(Optics, BalanceHoldsOverRandomStacks) {
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> u(0, 1);
  for (int i = 0; i < 6000; ++i) {
    const optics::OpticalStack stack = random_stack(random);
    const double kind = u(random);
    const double angle = kind < 0.1   ? 0
                         : kind < 0.2 ? std::numbers::pi / 2
                         : kind < 0.5 ? std::numbers::pi / 2 * (1 - std::pow(10, -15 * u(random)))
                                      : std::numbers::pi / 2 * u(random);
    for (const optics::Polarisation p : {optics::Polarisation::S, optics::Polarisation::P}) {
      const optics::StackLight light = optics::stack_light(stack, angle, p);
      ASSERT_NEAR(light.reflectance + light.transmittance + light.absorbed(), 1, 1e-12)
          << "stack " << i << " angle " << angle;
      ASSERT_GE(light.reflectance, 0);
      ASSERT_GE(light.transmittance, 0);
      for (size_t j = 0; j < stack.layers.size(); ++j) {
        ASSERT_GE(light.absorptance[j], 0) << i;
        if (stack.layers[j].index.imag() == 0) {
          ASSERT_EQ(light.absorptance[j], 0) << i;
        }
      }
    }
  }
}

TEST(Optics, PassesTheSameEitherWay) {
  // Helmholtz: transmittance does not change when the light's way is reversed, absorbing or not.
  std::mt19937_64 random(11);
  std::uniform_real_distribution<double> u(0, 1);
  for (int i = 0; i < 500; ++i) {
    optics::OpticalStack stack = random_stack(random);
    for (optics::OpticalLayer& layer : stack.layers) layer.thickness_mm = std::min(layer.thickness_mm, 1e-4);
    stack.to = {1 + 2 * u(random), 0};
    const double s = std::min(stack.from.real(), stack.to.real()) * u(random);
    optics::OpticalStack back = stack;
    std::swap(back.from, back.to);
    std::reverse(back.layers.begin(), back.layers.end());
    for (const optics::Polarisation p : {optics::Polarisation::S, optics::Polarisation::P}) {
      const double there = optics::stack_light(stack, std::asin(s / stack.from.real()), p).transmittance;
      const double again = optics::stack_light(back, std::asin(s / back.from.real()), p).transmittance;
      EXPECT_NEAR(there, again, 1e-9 * std::max(there, 1e-6)) << i;
    }
  }
}

TEST(Optics, SumOfPathsAgrees) {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> u(0, 1);
  for (int i = 0; i < 200; ++i) {
    reference::Media media;
    optics::OpticalStack stack;
    const int layers = 1 + static_cast<int>(8 * u(random));
    media.index.push_back({1, 0});
    for (int j = 0; j < layers; ++j) {
      const optics::OpticalIndex index{1.2 + 0.8 * u(random), u(random) < 0.5 ? 0 : -1e-5 * u(random)};
      stack.layers.push_back({index, 0.1 + u(random)});
      media.index.push_back(index);
      media.thickness_mm.push_back(stack.layers.back().thickness_mm);
    }
    stack.to = {1 + u(random), 0};
    media.index.push_back(stack.to);
    const double angle = 85 * kDegree * u(random);
    for (const bool s_polarised : {true, false}) {
      const auto ends = reference::sum_of_paths(reference::pieces_of(media, std::sin(angle), s_polarised));
      const optics::StackLight light =
          optics::stack_light(stack, angle, s_polarised ? optics::Polarisation::S : optics::Polarisation::P);
      EXPECT_NEAR(light.reflectance, ends.reflected, 2e-10) << i;
      EXPECT_NEAR(light.transmittance, ends.passed, 2e-10) << i;
      for (int j = 0; j < layers; ++j) EXPECT_NEAR(light.absorptance[j], ends.absorbed[j], 2e-10) << i;
    }
  }
}

TEST(Optics, PhotonsAgree) {
  reference::Media media;
  media.index = {{1, 0}, {1.39, -2e-6}, {1.9, 0}, {1.41, -4e-6}, {1.3, 0}};
  media.thickness_mm = {2, 1, 3};
  optics::OpticalStack stack;
  for (size_t j = 0; j < 3; ++j) stack.layers.push_back({media.index[j + 1], media.thickness_mm[j]});
  stack.to = {1.3, 0};
  std::mt19937_64 random(5);
  constexpr int kPhotons = 400'000;
  for (const double deg : {0.0, 50.0, 82.0}) {
    const auto ends = reference::throw_photons(reference::pieces_of(media, std::sin(deg * kDegree), true),
                                               kPhotons, random);
    const optics::StackLight light = optics::stack_light(stack, deg * kDegree, optics::Polarisation::S);
    const auto close = [&](double found, double truth) {
      EXPECT_NEAR(found, truth, 4.5 * std::sqrt(truth * (1 - truth) / kPhotons) + 1e-6) << deg;
    };
    close(ends.reflected, light.reflectance);
    close(ends.passed, light.transmittance);
    for (size_t j = 0; j < 3; ++j) close(ends.absorbed[j], light.absorptance[j]);
  }
}

TEST(Optics, LimitsOfAbsorptionAndThickness) {
  optics::OpticalStack thin = stacked_pad(), clear = stacked_pad(), opaque = stacked_pad();
  for (optics::OpticalLayer& layer : thin.layers) layer = {{layer.index.real(), -1e-3}, 1e-12};
  opaque.layers = {{{1.39, -0.5}, 100}, {{1.40, 0}, 2}};
  optics::OpticalStack face;
  face.to = {1.39, -0.5};
  for (const double deg : {0.0, 40.0, 80.0}) {
    // As extinction or thickness go to 0 the clear stack is left; R moves with k^2 only.
    EXPECT_NEAR(optics::unpolarised_light(thin, deg * kDegree).reflectance,
                optics::unpolarised_light(clear, deg * kDegree).reflectance, 1e-6);
    EXPECT_LT(optics::unpolarised_light(thin, deg * kDegree).absorbed(), 1e-6);
    // An opaque layer hides what lies behind it.
    const optics::StackLight hidden = optics::unpolarised_light(opaque, deg * kDegree);
    EXPECT_NEAR(hidden.reflectance, optics::unpolarised_light(face, deg * kDegree).reflectance, 1e-14);
    EXPECT_EQ(hidden.transmittance, 0);
    EXPECT_EQ(hidden.absorptance[1], 0);
  }
  // Without layers it is the interface, and a layer of the outside's own index is not there.
  optics::OpticalStack none, same;
  same.layers = {{{1, 0}, 5}};
  none.to = same.to = {1.5, 0};
  EXPECT_NEAR(optics::unpolarised_light(none, 0).reflectance, 0.04, 1e-15);
  EXPECT_EQ(optics::unpolarised_light(none, 1).reflectance, optics::unpolarised_light(same, 1).reflectance);
}

TEST(Optics, AbsorbingLayerIsLambertAndBeer) {
  // Between media of its own index nothing is reflected, and exp(-alpha d / cos) is left.
  optics::OpticalStack stack;
  stack.from = stack.to = {1.4, 0};
  stack.layers = {{{1.4, -1e-5}, 2}};
  const double alpha = 4 * std::numbers::pi * 1e-5 / (stack.wavelength_nm * 1e-6);
  for (const double deg : {0.0, 35.0, 70.0})
    EXPECT_NEAR(optics::unpolarised_light(stack, deg * kDegree).transmittance,
                std::exp(-alpha * 2 / std::cos(deg * kDegree)), 1e-9);
}

TEST(Fresnel, AmplitudesAgreeWithIntensitiesAndTextbooks) {
  const double angle = 50 * kDegree, s = std::sin(angle);
  const double inside = std::asin(s / 1.5);
  const optics::FresnelAmplitudes a = optics::fresnel_amplitudes(1, 1.5, s);
  EXPECT_NEAR(a.r_s.real(), -std::sin(angle - inside) / std::sin(angle + inside), 1e-15);
  EXPECT_NEAR(a.r_p.real(), std::tan(angle - inside) / std::tan(angle + inside), 1e-15);
  EXPECT_NEAR(a.t_p.real(), 2 * std::cos(angle) / (1.5 * std::cos(angle) + std::cos(inside)), 1e-15);
  for (const optics::OpticalIndex to :
       {optics::OpticalIndex{1.5, 0}, optics::OpticalIndex{0.14, -3.6}, optics::OpticalIndex{2, -1}}) {
    const optics::FresnelAmplitudes f = optics::fresnel_amplitudes(1, to, s);
    const optics::InterfaceFractions fractions_s =
        optics::interface_fractions(1, to, s, optics::Polarisation::S);
    const optics::InterfaceFractions fractions_p =
        optics::interface_fractions(1, to, s, optics::Polarisation::P);
    EXPECT_NEAR(fractions_s.reflected, std::norm(f.r_s), 1e-15);
    EXPECT_NEAR(fractions_p.reflected, std::norm(f.r_p), 1e-15);
    EXPECT_NEAR(fractions_s.reflected + fractions_s.passed, 1, 1e-15);
    // Poynting: the flux that enters is Re(N2 cos2) |t_s|^2 / cos1 (Eq. 35).
    const std::complex<double> q = optics::normal_index(to, s);
    EXPECT_NEAR(fractions_s.passed, q.real() * std::norm(f.t_s) / std::cos(angle), 1e-14);
    // For p the conjugate of cos2 counts; Eq. 35 as printed holds for clear media only.
    EXPECT_NEAR(fractions_p.passed, (to * std::conj(q / to)).real() * std::norm(f.t_p) / std::cos(angle),
                1e-14);
  }
  // Brewster: no p is reflected at atan(n).
  EXPECT_NEAR(
      optics::interface_fractions(1, 1.5, std::sin(std::atan(1.5)), optics::Polarisation::P).reflected, 0,
      1e-30);
}

TEST(Fresnel, FrustratedReflectionBetweenItsLimits) {
  const double s = 1.41 * std::sin(60 * kDegree);
  for (const optics::Polarisation p : {optics::Polarisation::S, optics::Polarisation::P}) {
    const double touching = optics::interface_fractions(1.41, 1.5, s, p).passed;
    EXPECT_NEAR(optics::frustrated_transmittance(1.41, 1, {1.5, 0}, s, 0, 630, p), touching, 1e-14);
    double before = touching;
    for (double gap = 20; gap < 4000; gap *= 1.5) {
      const double passed = optics::frustrated_transmittance(1.41, 1, {1.5, 0}, s, gap, 630, p);
      EXPECT_LT(passed, before) << gap;
      before = passed;
    }
    // Far away it falls as exp(-2 k0 |q| gap).
    const double decay = 2 * 2 * std::numbers::pi / 630 * std::sqrt(s * s - 1);
    EXPECT_NEAR(std::log(optics::frustrated_transmittance(1.41, 1, {1.5, 0}, s, 2000, 630, p) /
                         optics::frustrated_transmittance(1.41, 1, {1.5, 0}, s, 2500, 630, p)),
                500 * decay, 1e-8);
    EXPECT_EQ(optics::frustrated_transmittance(1.41, 1, {1.2, 0}, s, 50, 630, p), 0);  // 1.2 < s
    // Finite where the gap is exactly at its critical angle.
    const double at = optics::frustrated_transmittance(1.41, 1, {1.5, 0}, 1, 100, 630, p);
    EXPECT_NEAR(at, optics::frustrated_transmittance(1.41, 1, {1.5, 0}, 1 + 1e-9, 100, 630, p), 1e-6);
    // Below the critical angle waves interfere: a gap of half a wave is not seen.
    const double half_nm = 630 / 2.0 / std::cos(20 * kDegree), flat = std::sin(20 * kDegree);
    EXPECT_NEAR(optics::frustrated_transmittance(1.41, 1, {1.5, 0}, flat, half_nm, 630, p),
                optics::interface_fractions(1.41, 1.5, flat, p).passed, 1e-12);
  }
}

TEST(Optics, BadInputIsRefused) {
  const auto refuse = [](auto change, double angle = 0.5) {
    optics::OpticalStack stack = stacked_pad();
    change(stack);
    EXPECT_THROW(optics::unpolarised_light(stack, angle), Error);
  };
  refuse([](optics::OpticalStack& s) { s.layers[1].index = {0.9, 0}; });
  refuse([](optics::OpticalStack& s) { s.layers[1].index = {NAN, 0}; });
  refuse([](optics::OpticalStack& s) { s.layers[1].index = {140, 0}; });
  refuse([](optics::OpticalStack& s) { s.layers[1].index = {1.4, 0.1}; });  // gains light
  refuse([](optics::OpticalStack& s) { s.layers[1].index = {1.4, -INFINITY}; });
  refuse([](optics::OpticalStack& s) { s.from = {1.4, -1e-6}; });
  refuse([](optics::OpticalStack& s) { s.layers[0].thickness_mm = 0; });
  refuse([](optics::OpticalStack& s) { s.layers[0].thickness_mm = NAN; });
  refuse([](optics::OpticalStack& s) { s.wavelength_nm = 0; });
  for (const double angle : {-0.1, 1.6, static_cast<double>(NAN)})
    refuse([](optics::OpticalStack&) {}, angle);
  EXPECT_THROW(optics::frustrated_transmittance(1.41, 1, {1.5, 0}, 1.2, -1, 630, optics::Polarisation::S),
               Error);
}

}  // namespace
}  // namespace palpate
