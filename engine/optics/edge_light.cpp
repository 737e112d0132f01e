#include "engine/optics/edge_light.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "engine/base/numbers.h"
#include "engine/numeric/quadrature.h"
#include "palpate/error.h"

namespace palpate::optics {
namespace {

constexpr int kNodes = 40;  // per smooth piece and direction

/// Light that has entered, by the two parts of n times its direction which the edge leaves as they are: u
/// along the guide's width, v across its layers. v alone decides where it turns, for the tangential index is
/// sqrt(n^2 - v^2). Calls add(v, share, spread): the fraction of the lamp's light within the node's dv (of
/// all four quarters), and that share lengthened by its slant, 1 / cos of the way's angle to the guide's
/// length.
template <class Add>
void integrate(const Waveguide& guide, const EdgeLamp& lamp, std::vector<double> edges, const Add& add) {
  const double n = guide.layers[lamp.layer].index, ne = lamp.edge_index;
  const double radius = std::min(ne * std::sin(lamp.half_angle_rad), n);
  const double total =
      2 * kPi * (1 - std::pow(std::cos(lamp.half_angle_rad), lamp.order + 1)) / (lamp.order + 1);
  edges.insert(edges.end(), {0, radius});
  std::erase_if(edges, [&](double v) { return !(v >= 0 && v <= radius); });
  std::sort(edges.begin(), edges.end());
  for (size_t i = 1; i < edges.size(); ++i) {
    const Quadrature vs = end_clustered(kNodes, edges[i - 1], edges[i]);
    for (size_t k = 0; k < vs.x.size(); ++k) {
      const double v = vs.x[k], along2 = (n - v) * (n + v);
      const Quadrature us = end_clustered(kNodes, 0, std::sqrt((radius - v) * (radius + v)));
      double fraction = 0, spread = 0;
      for (size_t j = 0; j < us.x.size(); ++j) {
        const double u = us.x[j], tangential = std::sqrt(u * u + v * v);
        const double cos2 = std::max(0.0, 1 - tangential * tangential / (ne * ne));
        const double passed = (interface_fractions(ne, n, tangential, Polarisation::S).passed +
                               interface_fractions(ne, n, tangential, Polarisation::P).passed) /
                              2;
        const double weight = us.w[j] * passed * std::pow(cos2, (lamp.order - 1) / 2);
        fraction += weight;
        if (along2 > u * u) spread += weight * std::sqrt(along2 / (along2 - u * u));
      }
      const double scale = 4 * vs.w[k] / (ne * ne * total);
      add(v, scale * fraction, scale * spread);
    }
  }
}

/// Where the course of light changes, in v.
std::vector<double> turning_points(const Waveguide& guide, const EdgeLamp& lamp) {
  const double n = guide.layers[lamp.layer].index;
  std::vector<double> edges;
  const auto add = [&](double other) {
    if (other < n) edges.push_back(std::sqrt((n - other) * (n + other)));
  };
  add(guide.above);
  add(guide.below);
  for (const GuideLayer& layer : guide.layers) add(layer.index);
  return edges;
}

double tangential_of(const Waveguide& guide, const EdgeLamp& lamp, double v) {
  const double n = guide.layers[lamp.layer].index;
  return std::sqrt((n - v) * (n + v));
}

}  // namespace

void check_lamp(const Waveguide& guide, const EdgeLamp& lamp) {
  course_of(guide, lamp.layer, 0);
  optical_index(lamp.edge_index);
  if (!(lamp.order >= 1 && lamp.order <= 1000))
    throw Error(Failure::Input, "an order of the LED's cosine law from 1 to 1000", std::to_string(lamp.order),
                "1 for a bare LED");
  if (!(lamp.half_angle_rad > 0 && lamp.half_angle_rad <= kPi / 2))
    throw Error(Failure::Input, "a half angle of the LED above 0 and up to 90 deg",
                std::to_string(lamp.half_angle_rad * 180 / kPi) + " deg", "90 for a bare LED");
}

double order_from_half_intensity(double angle_rad) {
  if (!(angle_rad > 0 && angle_rad <= kPi / 3 * (1 + 1e-12)))
    throw Error(Failure::Input, "an angle of half intensity above 0 and up to 60 deg",
                std::to_string(angle_rad * 180 / kPi) + " deg", "60 (Lambert's law) for a bare LED");
  return std::log(0.5) / std::log(std::cos(angle_rad));
}

LampFractions lamp_fractions(const Waveguide& guide, const EdgeLamp& lamp) {
  check_lamp(guide, lamp);
  LampFractions fractions;
  integrate(guide, lamp, turning_points(guide, lamp), [&](double v, double fraction, double spread) {
    const double s = tangential_of(guide, lamp, v);
    const Course course = course_of(guide, lamp.layer, s);
    fractions.entering += fraction;
    if (course.guided()) fractions.guided += fraction;
    if (!course.touches()) return;
    fractions.touching += fraction;
    fractions.arriving_per_mm += spread / hop_mm(guide, course, s);
  });
  return fractions;
}

double contact_transmittance(const Waveguide& guide, const FaceContact& contact, double s) {
  const double top = guide.layers.front().index;
  double sum = 0;
  for (const Polarisation p : {Polarisation::S, Polarisation::P})
    sum += contact.gap_nm > 0 ? frustrated_transmittance(top, guide.above, contact.index, s, contact.gap_nm,
                                                         contact.wavelength_nm, p)
                              : interface_fractions(top, contact.index, s, p).passed;
  return sum / 2;
}

ContactLight contact_light(const Waveguide& guide, const EdgeLamp& lamp, const FaceContact& contact) {
  check_lamp(guide, lamp);
  optical_index(contact.index.real(), -contact.index.imag());
  const double n = guide.layers[lamp.layer].index, nc = contact.index.real();
  std::vector<double> edges = turning_points(guide, lamp);
  if (nc < n) edges.push_back(std::sqrt((n - nc) * (n + nc)));
  ContactLight light;
  double arriving = 0;
  integrate(guide, lamp, edges, [&](double v, double, double spread) {
    const double s = tangential_of(guide, lamp, v);
    const Course course = course_of(guide, lamp.layer, s);
    if (!course.touches()) return;
    const double per_mm = spread / hop_mm(guide, course, s),
                 passed = contact_transmittance(guide, contact, s);
    arriving += per_mm;
    light.leaving_per_mm += per_mm * passed;
  });
  light.per_meeting = arriving > 0 ? light.leaving_per_mm / arriving : 0;
  const double most = guidance(guide, lamp.edge_index)[lamp.layer].touching_to;
  if (light.leaving_per_mm > 0) light.reached_to = contact.index.imag() == 0 ? std::min(nc, most) : most;
  return light;
}

PredictedGray predict_gray(const GrayReference& reference, const ContactLight& light, double albedo) {
  for (const double a : {reference.albedo, albedo})
    if (!(a >= 0 && a <= 1))
      throw Error(Failure::Input, "an albedo from 0 to 1", std::to_string(a),
                  "1 for white paper, 0.04 for black");
  const double seen = reference.light.leaving_per_mm * reference.albedo;
  if (!(seen > 0) || !(reference.gray > 0) || !(reference.most_gray > 0))
    throw Error(Failure::Input, "a reference contact that lets light out and shows a change of gray",
                "gray " + std::to_string(reference.gray) + " from " + std::to_string(seen) +
                    " of the LED's light per mm",
                "a reference whose index is above the outside's");
  PredictedGray p;
  p.unlimited = reference.gray * light.leaving_per_mm * albedo / seen;
  p.saturated = p.unlimited >= reference.most_gray;
  p.gray = std::min(p.unlimited, reference.most_gray);
  return p;
}

}  // namespace palpate::optics
