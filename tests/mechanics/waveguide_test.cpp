// The pad as a waveguide: golden angles, indices from laser spots, and a LED's light against Monte Carlo.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "engine/optics/edge_light.h"
#include "engine/optics/ray_fan.h"
#include "engine/optics/refractive_index.h"
#include "palpate/error.h"

namespace palpate {
namespace {

constexpr double kDegree_rad = std::numbers::pi / 180;

optics::Waveguide pad() {
  return {1, {{1.39, 2}, {1.40, 2}, {1.41, 2}}, 1};
}

TEST(Waveguide, GoldenAngles) {
  const double golden[][4] = {{1.39, 46.006983, 0.965453, 74.895740},
                              {1.40, 45.584691, 0.979796, 78.463041},
                              {1.41, 45.171476, 0.994032, 83.737305}};
  for (const auto& [n, critical, aperture, accepted] : golden) {
    EXPECT_NEAR(*optics::critical_angle_rad(n, 1) / kDegree_rad, critical, 5e-7);
    EXPECT_NEAR(optics::numerical_aperture(n, 1), aperture, 5e-7);
    EXPECT_NEAR(optics::acceptance(n, 1, 1).half_angle_rad / kDegree_rad, accepted, 5e-7);
    EXPECT_FALSE(optics::acceptance(n, 1, 1).all);
    // To 1e-9 by other functions: sin^2 + cos^2 = 1 in the acceptance triangle.
    EXPECT_NEAR(std::atan2(1, std::sqrt(n * n - 1)), *optics::critical_angle_rad(n, 1), 1e-14);
    EXPECT_NEAR(std::atan2(std::sqrt(n * n - 1), std::sqrt(2 - n * n)),
                optics::acceptance(n, 1, 1).half_angle_rad, 1e-13);
  }
}

TEST(Waveguide, HighIndexAcceptsAll) {
  EXPECT_TRUE(optics::acceptance(1.5, 1, 1).all);
  EXPECT_DOUBLE_EQ(optics::acceptance(1.5, 1, 1).half_angle_rad, std::numbers::pi / 2);
  EXPECT_TRUE(optics::acceptance(std::sqrt(2.0) + 1e-12, 1, 1).all);
  EXPECT_FALSE(optics::critical_angle_rad(1.3, 1.33).has_value());
  EXPECT_EQ(optics::numerical_aperture(1.3, 1.33), 0);
}

TEST(Waveguide, LayersShareTheTangentialIndex) {
  const std::vector<optics::LayerGuidance> layers = optics::guidance(pad(), 1);
  for (size_t i = 0; i < 3; ++i) {
    EXPECT_NEAR(std::sin(*layers[i].critical_above_rad) * pad().layers[i].index, 1, 1e-15);
    EXPECT_EQ(layers[i].touching_to, 1.39);  // what is steeper than grazing in 1.39 gets there
  }
  // Glass below: light is held by the air behind the glass; without air there only what 1.39 turns back...
  // is.
  const optics::Waveguide on_glass{1, {{1.41, 2}, {1.40, 2}}, 1.52};
  const optics::LayerGuidance top = optics::guidance(on_glass, 1)[0];
  EXPECT_EQ(top.guided_from, 1.40);
  EXPECT_EQ(top.guided_to, 1.41);
  EXPECT_TRUE(optics::course_of(on_glass, 0, 1.405).touches());
  EXPECT_FALSE(optics::course_of(on_glass, 0, 1.3).guided());
  EXPECT_FALSE(optics::course_of(on_glass, 1, 1.3).guided());
}

TEST(Waveguide, CoursesAgreeWithTheBandsEverywhere) {
  std::mt19937_64 random(2);
  std::uniform_real_distribution<double> u(0, 1);
  for (int i = 0; i < 300; ++i) {
    optics::Waveguide guide;
    guide.above = 1 + 0.6 * u(random);
    guide.below = 1 + 0.6 * u(random);
    for (int j = 0; j < 4; ++j) guide.layers.push_back({1 + 0.8 * u(random), 1});
    const std::vector<optics::LayerGuidance> bands = optics::guidance(guide, 1);
    for (size_t j = 0; j < 4; ++j) {
      const double s = guide.layers[j].index * u(random);
      const optics::Course course = optics::course_of(guide, j, s);
      EXPECT_EQ(course.guided(), s >= bands[j].guided_from && s < bands[j].guided_to);
      EXPECT_EQ(course.touches(), s >= bands[j].touching_from && s < bands[j].touching_to);
    }
  }
}

TEST(Waveguide, LambertsLampInClosedForm) {
  // Where nothing is reflected at the edge, the fraction within |n sin| < NA of a Lambert lamp is that of a
  // strip in the unit disc: 2/pi (asin q + q sqrt(1 - q^2)), q = NA / n.
  for (const double n : {1.1, 1.3, 1.41, 2.0}) {
    const optics::Waveguide guide{1, {{n, 5}}, 1};
    optics::EdgeLamp lamp;
    lamp.edge_index = n;
    const double q = optics::numerical_aperture(n, 1) / n;
    const optics::LampFractions fractions = optics::lamp_fractions(guide, lamp);
    EXPECT_NEAR(fractions.entering, 1, 1e-9);
    EXPECT_NEAR(fractions.guided, 2 / std::numbers::pi * (std::asin(q) + q * std::sqrt(1 - q * q)), 1e-9)
        << n;
    EXPECT_NEAR(fractions.touching, fractions.guided, 1e-12);
  }
}

TEST(Waveguide, LampSharesAgreeWithThrownRays) {
  struct Case {
    size_t layer;
    double edge, order, half_deg;
  };
  std::mt19937_64 random(4);
  std::uniform_real_distribution<double> u(0, 1);
  for (const Case& c : {Case{0, 1, 1, 90}, Case{1, 1, 1, 90}, Case{2, 1.4, 1, 90}, Case{1, 1.5, 3, 90},
                        Case{2, 1.2, 1, 50}}) {
    const optics::Waveguide guide = pad();
    optics::EdgeLamp lamp;
    lamp.layer = c.layer;
    lamp.edge_index = c.edge;
    lamp.order = c.order;
    lamp.half_angle_rad = c.half_deg * kDegree_rad;
    const optics::LampFractions fractions = optics::lamp_fractions(guide, lamp);
    const double n = guide.layers[c.layer].index;
    constexpr int kRays = 200'000;
    double entering = 0, guided = 0, touching = 0, meetings = 0;
    const double least = std::pow(std::cos(c.half_deg * kDegree_rad), c.order + 1);
    for (int i = 0; i < kRays; ++i) {
      // A direction as cos^order has it, then Snell with vectors at the edge x = 0.
      const double cosine = std::pow(least + (1 - least) * u(random), 1 / (c.order + 1));
      const double sine = std::sqrt(1 - cosine * cosine), phi = 2 * std::numbers::pi * u(random);
      const double y = c.edge / n * sine * std::cos(phi), z = c.edge / n * sine * std::sin(phi);
      if (y * y + z * z >= 1) continue;
      const double x = std::sqrt(1 - y * y - z * z);
      const double rs = (c.edge * cosine - n * x) / (c.edge * cosine + n * x);
      const double rp = (n * cosine - c.edge * x) / (n * cosine + c.edge * x);
      const double passed = 1 - (rs * rs + rp * rp) / 2, sideways = std::sqrt(x * x + y * y);
      entering += passed;
      const double s = n * sideways;
      if (s < 1) continue;
      guided += passed;
      if (s >= 1.39) continue;
      touching += passed;
      double way = 0;
      for (const optics::GuideLayer& layer : guide.layers) {
        const double a = std::asin(s / layer.index);
        way += 2 * layer.thickness_mm * std::tan(a);
      }
      meetings += passed / (way * x / sideways);
    }
    EXPECT_NEAR(fractions.entering, entering / kRays, 0.004);
    EXPECT_NEAR(fractions.guided, guided / kRays, 0.004);
    EXPECT_NEAR(fractions.touching, touching / kRays, 0.005);
    EXPECT_NEAR(fractions.arriving_per_mm / (meetings / kRays), 1, 0.02);
  }
}

TEST(Waveguide, ContactTakesWhatItsIndexAllows) {
  const optics::Waveguide guide = pad();
  optics::EdgeLamp lamp;
  lamp.layer = 1;
  EXPECT_EQ(optics::contact_light(guide, lamp, {{1, 0}}).leaving_per_mm, 0);  // air is no contact
  double before = 0;
  for (const double n : {1.05, 1.1, 1.2, 1.3, 1.38}) {
    const optics::ContactLight light = optics::contact_light(guide, lamp, {{n, 0}});
    EXPECT_GT(light.leaving_per_mm, before);
    EXPECT_LE(light.reached_to, n);
    EXPECT_NEAR(light.reached_to, n, 1e-3);
    before = light.leaving_per_mm;
  }
  // The layer's own index lets out everything that arrives.
  const optics::ContactLight all = optics::contact_light(guide, lamp, {{1.39, 0}});
  EXPECT_NEAR(all.per_meeting, 1, 1e-12);
  EXPECT_NEAR(all.leaving_per_mm, optics::lamp_fractions(guide, lamp).arriving_per_mm, 1e-9);
  // One angle against Fresnel by hand, and a gap takes light away.
  const double s = 1.2, c1 = std::sqrt(1 - s * s / 1.39 / 1.39), c2 = std::sqrt(1 - s * s / 1.33 / 1.33);
  const double rs = (1.39 * c1 - 1.33 * c2) / (1.39 * c1 + 1.33 * c2);
  const double rp = (1.33 * c1 - 1.39 * c2) / (1.33 * c1 + 1.39 * c2);
  EXPECT_NEAR(optics::contact_transmittance(guide, {{1.33, 0}}, s), 1 - (rs * rs + rp * rp) / 2, 1e-14);
  EXPECT_LT(optics::contact_light(guide, lamp, {{1.39, 0}, 100}).leaving_per_mm, 0.6 * all.leaving_per_mm);
}

TEST(Waveguide, GrayFollowsLightAndSaturates) {
  const optics::Waveguide guide = pad();
  const optics::EdgeLamp lamp;
  optics::GrayReference reference{optics::contact_light(guide, lamp, {{1.4, 0}}), 0.8, 100, 255};
  EXPECT_NEAR(optics::predict_gray(reference, reference.light, 0.8).gray, 100, 1e-12);
  EXPECT_NEAR(optics::predict_gray(reference, reference.light, 0.4).gray, 50, 1e-12);
  const optics::ContactLight water = optics::contact_light(guide, lamp, {{1.33, 0}});
  EXPECT_NEAR(optics::predict_gray(reference, water, 0.8).gray,
              100 * water.leaving_per_mm / reference.light.leaving_per_mm, 1e-9);
  reference.gray = 220;
  const optics::PredictedGray bright = optics::predict_gray(reference, reference.light, 1);
  EXPECT_TRUE(bright.saturated);
  EXPECT_EQ(bright.gray, 255);
  EXPECT_NEAR(bright.unlimited, 275, 1e-9);
  EXPECT_THROW(optics::predict_gray(reference, water, 1.1), Error);
  reference.light = optics::contact_light(guide, lamp, {{1, 0}});
  EXPECT_THROW(optics::predict_gray(reference, water, 1), Error);
}

TEST(Waveguide, RaysMeetTheFaceWhereGeometrySays) {
  const optics::Waveguide guide = pad();
  optics::EdgeLamp lamp;
  lamp.layer = 1;
  for (const double deg : {-70.0, -30.0, 25.0, 40.0, 77.0}) {
    const optics::EdgeRay ray = optics::trace_ray(guide, lamp, 3, deg * kDegree_rad, 200);
    EXPECT_NEAR(ray.tangential_index, std::sqrt(1.96 - std::pow(std::sin(deg * kDegree_rad), 2)), 1e-12);
    ASSERT_EQ(ray.fate, optics::RayFate::Touching) << deg;
    // The drawn way meets depth 0 first at first_mm, then every hop_mm.
    double next = ray.first_mm;
    for (size_t i = 0; i < ray.x_mm.size(); ++i)
      if (ray.depth_mm[i] == 0) {
        EXPECT_NEAR(ray.x_mm[i], next, 1e-9 * next) << deg;
        next += ray.hop_mm;
      }
    EXPECT_GT(next, 200);
  }
  EXPECT_EQ(optics::trace_ray(guide, lamp, 3, 85 * kDegree_rad, 50).fate,
            optics::RayFate::Leaving);  // above 78.46 deg
  EXPECT_EQ(optics::trace_ray(guide, lamp, 3, 5 * kDegree_rad, 50).fate,
            optics::RayFate::Guided);  // n sin above 1.39
  EXPECT_EQ(optics::trace_ray(guide, lamp, 3, 0, 50).fate, optics::RayFate::Guided);
  EXPECT_EQ(optics::layer_at(guide, 0), 0u);
  EXPECT_EQ(optics::layer_at(guide, 3.5), 1u);
  EXPECT_THROW(optics::layer_at(guide, 6.5), Error);
}

TEST(Waveguide, FirstMeetingsEndAtTheTouchingShare) {
  const optics::Waveguide guide = pad();
  optics::EdgeLamp lamp;
  lamp.layer = 0;
  const double touching = optics::lamp_fractions(guide, lamp).touching;
  const optics::FirstMeetings near = optics::first_meetings(guide, lamp, 1, 5),
                              far = optics::first_meetings(guide, lamp, 1, 5000);
  EXPECT_NEAR(far.fraction.back(), touching, 0.01);
  EXPECT_LT(near.fraction.back(), touching);
  // 1 mm up at the critical angle of 1.39: tan(46.007 deg) mm.
  EXPECT_NEAR(near.nearest_mm, std::tan(46.006983 * kDegree_rad), 1e-6);
  for (size_t i = 1; i < near.fraction.size(); ++i) EXPECT_GE(near.fraction[i], near.fraction[i - 1]);
}

TEST(RefractiveIndex, SpotsOfAKnownLiquid) {
  for (const double n : {1.33, 1.41, 1.7}) {
    const double incidence = std::atan(800.0 / 600), inside = std::asin(std::sin(incidence) * 1.000271 / n);
    optics::LaserSpots spots;
    spots.od = {800, 0.5};
    spots.on = {600, 0.5};
    spots.nm2 = {20, 0.1};
    spots.m1m2 = {20 * std::tan(inside) / std::tan(incidence), 0.1};
    const optics::MeasuredIndex m = optics::index_from_spots(spots);
    EXPECT_NEAR(m.index, n, 1e-12);
    EXPECT_NEAR(m.incidence_rad, incidence, 1e-15);
    // The stated error against the scatter of 20000 measurements with such errors.
    std::mt19937_64 random(9);
    std::normal_distribution<double> normal;
    double sum = 0, squares = 0;
    constexpr int kTimes = 20'000;
    for (int i = 0; i < kTimes; ++i) {
      optics::LaserSpots noisy = spots;
      for (optics::MeasuredLength* l : {&noisy.od, &noisy.on, &noisy.m1m2, &noisy.nm2})
        l->mm += l->sd_mm * normal(random);
      const double found = optics::index_from_spots(noisy).index;
      sum += found - n;
      squares += (found - n) * (found - n);
    }
    const double sd = std::sqrt(squares / kTimes - std::pow(sum / kTimes, 2));
    EXPECT_NEAR(m.standard_error / sd, 1, 0.04) << n;
  }
}

TEST(RefractiveIndex, SeveralMeasurementsAreWeighed) {
  const optics::MeasuredIndex a{1.40, 0.01, 0, 0, 0, 0, 0, 0, 0}, b{1.42, 0.02, 0, 0, 0, 0, 0, 0, 0};
  const optics::MeasuredIndex parts[] = {a, b};
  const optics::CombinedIndex c = optics::combine(parts);
  EXPECT_NEAR(c.index, (1.40 * 4 + 1.42) / 5, 1e-12);
  EXPECT_NEAR(c.standard_error, 0.02 / std::sqrt(5), 1e-12);
  EXPECT_FALSE(c.widened);
  const optics::MeasuredIndex apart[] = {a, {1.60, 0.02, 0, 0, 0, 0, 0, 0, 0}};
  EXPECT_TRUE(optics::combine(apart).widened);
  EXPECT_NEAR(optics::combine(apart).standard_error,
              0.02 / std::sqrt(5) * std::sqrt(optics::combine(apart).chi_square), 1e-12);
  const optics::MeasuredIndex mixed[] = {a, {1.42, 0, 0, 0, 0, 0, 0, 0, 0}};
  EXPECT_THROW(optics::combine(mixed), Error);
  EXPECT_THROW(optics::combine({}), Error);
}

TEST(RefractiveIndex, BadGeometryIsRefused) {
  optics::LaserSpots good;
  good.od = {800, 0.5};
  good.on = {600, 0.5};
  good.m1m2 = {11.6, 0.1};
  good.nm2 = {20, 0.1};
  EXPECT_GT(optics::index_from_spots(good).index, 1.3);
  const auto refuse = [&](auto change) {
    optics::LaserSpots spots = good;
    change(spots);
    EXPECT_THROW(optics::index_from_spots(spots), Error);
  };
  refuse([](optics::LaserSpots& s) { s.od.mm = 0; });
  refuse([](optics::LaserSpots& s) { s.on.mm = -1; });
  refuse([](optics::LaserSpots& s) { s.on.mm = NAN; });
  refuse([](optics::LaserSpots& s) { s.nm2.mm = INFINITY; });
  refuse([](optics::LaserSpots& s) { s.m1m2.mm = 20; });  // n = 1: no liquid
  refuse([](optics::LaserSpots& s) { s.m1m2.mm = 30; });
  refuse([](optics::LaserSpots& s) { s.nm2.sd_mm = -1; });
  refuse([](optics::LaserSpots& s) { s.n_air = 0.5; });
}

TEST(Waveguide, BadInputIsRefused) {
  EXPECT_THROW(optics::critical_angle_rad(0.9, 1), Error);
  EXPECT_THROW(optics::critical_angle_rad(NAN, 1), Error);
  EXPECT_THROW(optics::acceptance(1.4, 1, 0), Error);
  EXPECT_THROW(optics::check_waveguide({1, {}, 1}), Error);
  EXPECT_THROW(optics::check_waveguide({1, {{1.4, 0}}, 1}), Error);
  EXPECT_THROW(optics::check_waveguide({1, {{1.4, 2}}, 0.99}), Error);
  EXPECT_THROW(optics::course_of(pad(), 3, 1), Error);
  EXPECT_THROW(optics::course_of(pad(), 0, 1.39), Error);
  optics::EdgeLamp lamp;
  lamp.order = 0.5;
  EXPECT_THROW(optics::lamp_fractions(pad(), lamp), Error);
  lamp = {};
  lamp.half_angle_rad = 2;
  EXPECT_THROW(optics::lamp_fractions(pad(), lamp), Error);
  EXPECT_NEAR(optics::order_from_half_intensity(60 * kDegree_rad), 1, 1e-12);
  EXPECT_THROW(optics::order_from_half_intensity(70 * kDegree_rad), Error);
}

}  // namespace
}  // namespace palpate
