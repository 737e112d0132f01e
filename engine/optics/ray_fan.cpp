#include "engine/optics/ray_fan.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "engine/base/numbers.h"
#include "palpate/error.h"

namespace palpate::optics {
namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();

double slope(const GuideLayer& layer, double s) {
  return s / std::sqrt((layer.index - s) * (layer.index + s));
}

double top_of(const Waveguide& guide, size_t layer) {
  double depth = 0;
  for (size_t i = 0; i < layer; ++i) depth += guide.layers[i].thickness_mm;
  return depth;
}

/// Way along the guide until the touched face is met for the first time.
double first_meeting(const Waveguide& guide, const Course& course, size_t layer, double depth_mm, double s,
                     bool upwards) {
  if (!course.touches()) return kNever;
  double way = (depth_mm - top_of(guide, layer)) * slope(guide.layers[layer], s);
  for (size_t i = 0; i < layer; ++i) way += guide.layers[i].thickness_mm * slope(guide.layers[i], s);
  return upwards ? way : hop_mm(guide, course, s) - way;
}

double edge_passed(double from, double to, double s) {
  return (interface_fractions(from, to, s, Polarisation::S).passed +
          interface_fractions(from, to, s, Polarisation::P).passed) /
         2;
}

void check_length(double length_mm) {
  if (!(length_mm > 0) || !std::isfinite(length_mm))
    throw Error(Failure::Input, "a length of the waveguide > 0 mm", std::to_string(length_mm),
                "the pad's length from the LED to the far edge");
}

void check_depth(const Waveguide& guide, const EdgeLamp& lamp, double depth_mm) {
  if (layer_at(guide, depth_mm) != lamp.layer && depth_mm != top_of(guide, lamp.layer))
    throw Error(Failure::Input, "a depth within the layer that the LED lights",
                std::to_string(depth_mm) + " mm", "the layer at that depth");
}

}  // namespace

size_t layer_at(const Waveguide& guide, double depth_mm) {
  check_waveguide(guide);
  const double bottom = top_of(guide, guide.layers.size());
  if (!(depth_mm >= 0 && depth_mm <= bottom))
    throw Error(Failure::Input, "a depth below the touched face from 0 to " + std::to_string(bottom) + " mm",
                std::to_string(depth_mm), "a depth between the touched face and the camera's side");
  size_t layer = 0;
  while (layer + 1 < guide.layers.size() && depth_mm > top_of(guide, layer + 1)) ++layer;
  return layer;
}

const char* to_string(RayFate fate) {
  switch (fate) {
    case RayFate::Touching:
      return "touching";
    case RayFate::Guided:
      return "guided";
    case RayFate::Leaving:
      return "leaving";
  }
  return "";
}

EdgeRay trace_ray(const Waveguide& guide, const EdgeLamp& lamp, double depth_mm, double angle_rad,
                  double length_mm) {
  check_length(length_mm);
  check_depth(guide, lamp, depth_mm);
  if (!(std::abs(angle_rad) < kPi / 2))
    throw Error(Failure::Input, "a ray's angle between -90 and 90 deg",
                std::to_string(angle_rad * 180 / kPi) + " deg", "an angle from the edge's normal");
  EdgeRay ray;
  ray.angle_rad = angle_rad;
  const double n = guide.layers[lamp.layer].index, v = lamp.edge_index * std::sin(std::abs(angle_rad));
  ray.x_mm = {0};
  ray.depth_mm = {depth_mm};
  ray.first_mm = kNever;
  ray.entering = edge_passed(lamp.edge_index, n, v);
  if (v >= n) return ray;  // reflected at the edge
  const double s = std::sqrt((n - v) * (n + v));
  ray.tangential_index = s;
  if (s >= n) {  // along the layer
    ray.fate = RayFate::Guided;
    ray.x_mm.push_back(length_mm);
    ray.depth_mm.push_back(depth_mm);
    return ray;
  }
  const Course course = course_of(guide, lamp.layer, s);
  ray.fate = course.touches() ? RayFate::Touching : course.guided() ? RayFate::Guided : RayFate::Leaving;
  ray.hop_mm = hop_mm(guide, course, s);
  bool upwards = angle_rad > 0;
  ray.first_mm = first_meeting(guide, course, lamp.layer, depth_mm, s, upwards);
  size_t layer = lamp.layer;
  double x = 0, z = depth_mm;
  constexpr size_t kMostPoints = 4000;
  while (x < length_mm && ray.x_mm.size() < kMostPoints) {
    const double next = upwards ? top_of(guide, layer) : top_of(guide, layer + 1);
    const double t = slope(guide.layers[layer], s), step = std::abs(next - z) * t;
    if (x + step >= length_mm) {
      z += (upwards ? -1 : 1) * (length_mm - x) / t;
      x = length_mm;
    } else {
      x += step;
      z = next;
    }
    ray.x_mm.push_back(x);
    ray.depth_mm.push_back(z);
    if (x >= length_mm) break;
    const size_t last = upwards ? course.highest : course.lowest;
    if (layer != last) {
      layer = upwards ? layer - 1 : layer + 1;
    } else if (upwards ? course.leaves_above : course.leaves_below) {
      break;
    } else {
      upwards = !upwards;
    }
  }
  return ray;
}

double FirstMeetings::distance_of(double part, double touching) const {
  const auto found = std::lower_bound(fraction.begin(), fraction.end(), part * touching);
  return found == fraction.end() ? kNever : distance_mm[static_cast<size_t>(found - fraction.begin())];
}

FirstMeetings first_meetings(const Waveguide& guide, const EdgeLamp& lamp, double depth_mm, double length_mm,
                             int side) {
  check_length(length_mm);
  check_depth(guide, lamp, depth_mm);
  check_lamp(guide, lamp);
  const double n = guide.layers[lamp.layer].index, ne = lamp.edge_index;
  const double radius = std::min(ne * std::sin(lamp.half_angle_rad), n);
  const double total =
      2 * kPi * (1 - std::pow(std::cos(lamp.half_angle_rad), lamp.order + 1)) / (lamp.order + 1);
  constexpr int kBins = 400;
  std::vector<double> bins(kBins);
  FirstMeetings m;
  m.nearest_mm = kNever;
  // The steepest guided light that enters is the first to meet the face.
  const double steepest =
      std::max(guidance(guide, ne)[lamp.layer].touching_from, std::sqrt((n - radius) * (n + radius)));
  if (steepest < n)
    m.nearest_mm =
        first_meeting(guide, course_of(guide, lamp.layer, steepest), lamp.layer, depth_mm, steepest, true);
  for (int i = 0; i < side; ++i) {
    // Equal areas of the disc of directions: rings of equal area, sectors of equal angle.
    const double rho = radius * std::sqrt((i + 0.5) / side);
    const double weight = edge_passed(ne, n, rho) *
                          std::pow(1 - rho * rho / (ne * ne), (lamp.order - 1) / 2) * kPi * radius * radius /
                          (ne * ne * total * side * side);
    for (int j = 0; j < side; ++j) {
      const double phi = 2 * kPi * (j + 0.5) / side;
      const double u = rho * std::cos(phi), v = rho * std::sin(phi);
      const double s = std::sqrt((n - v) * (n + v));
      if (s >= n) continue;
      const Course course = course_of(guide, lamp.layer, s);
      const double slant = std::sqrt(std::max(0.0, 1 - u * u / (s * s)));
      const double x = slant * first_meeting(guide, course, lamp.layer, depth_mm, s, v > 0);
      if (x < length_mm) bins[static_cast<size_t>(x / length_mm * kBins)] += weight;
    }
  }
  double sum = 0;
  for (int k = 0; k < kBins; ++k) {
    sum += bins[static_cast<size_t>(k)];
    m.distance_mm.push_back(length_mm * (k + 1) / kBins);
    m.fraction.push_back(sum);
  }
  return m;
}

}  // namespace palpate::optics
