#include "engine/optics/waveguide.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "engine/optics/fresnel.h"
#include "palpate/error.h"

namespace palpate::optics {
namespace {

void check_layer(const Waveguide& guide, size_t layer) {
  check_waveguide(guide);
  if (layer >= guide.layers.size())
    throw Error(Failure::Input, "a layer from 1 to " + std::to_string(guide.layers.size()),
                std::to_string(layer + 1), "counting from the touched face");
}

}  // namespace

std::optional<double> critical_angle_rad(double n_in, double n_out) {
  optical_index(n_in);
  optical_index(n_out);
  if (n_out >= n_in) return std::nullopt;
  return std::asin(n_out / n_in);
}

double numerical_aperture(double n_in, double n_out) {
  optical_index(n_in);
  optical_index(n_out);
  return n_out >= n_in ? 0 : std::sqrt((n_in - n_out) * (n_in + n_out));
}

Acceptance acceptance(double n_in, double n_out, double n_edge) {
  optical_index(n_edge);
  const double aperture = numerical_aperture(n_in, n_out);
  if (aperture >= n_edge) return {std::numbers::pi / 2, true};
  return {std::asin(aperture / n_edge), false};
}

void check_waveguide(const Waveguide& guide) {
  if (guide.layers.empty())
    throw Error(Failure::Input, "a waveguide of at least one layer between two outsides", "no layer",
                "three indices or more: outside, layers, outside");
  optical_index(guide.above);
  optical_index(guide.below);
  for (const GuideLayer& layer : guide.layers) {
    optical_index(layer.index);
    if (!(layer.thickness_mm > 0) || !std::isfinite(layer.thickness_mm))
      throw Error(Failure::Input, "layers thicker than 0 mm", std::to_string(layer.thickness_mm),
                  "the layer's thickness in mm");
  }
}

double outside_index(const Waveguide& guide) {
  return std::max(guide.above, guide.below);
}

size_t middle_layer(const Waveguide& guide) {
  check_waveguide(guide);
  return (guide.layers.size() - 1) / 2;
}

double middle_depth_mm(const Waveguide& guide, size_t layer) {
  check_layer(guide, layer);
  double depth = guide.layers[layer].thickness_mm / 2;
  for (size_t i = 0; i < layer; ++i) depth += guide.layers[i].thickness_mm;
  return depth;
}

Course course_of(const Waveguide& guide, size_t layer, double s) {
  check_layer(guide, layer);
  if (!(s >= 0 && s < guide.layers[layer].index))
    throw Error(Failure::Input, "a tangential index from 0 to below the layer's own", std::to_string(s),
                "n sin(theta) of the ray");
  Course course;
  course.highest = course.lowest = layer;
  while (course.highest > 0 && s < guide.layers[course.highest - 1].index) --course.highest;
  while (course.lowest + 1 < guide.layers.size() && s < guide.layers[course.lowest + 1].index)
    ++course.lowest;
  course.reaches_above = course.highest == 0;
  course.reaches_below = course.lowest + 1 == guide.layers.size();
  course.leaves_above = course.reaches_above && s < guide.above;
  course.leaves_below = course.reaches_below && s < guide.below;
  return course;
}

double hop_mm(const Waveguide& guide, const Course& course, double s) {
  double way = 0;
  for (size_t i = course.highest; i <= course.lowest; ++i) {
    const auto& [index, thickness] = guide.layers[i];
    way += 2 * thickness * s / std::sqrt((index - s) * (index + s));
  }
  return way;
}

std::vector<LayerGuidance> guidance(const Waveguide& guide, double n_edge) {
  check_waveguide(guide);
  std::vector<LayerGuidance> layers(guide.layers.size());
  double lowest_above = guide.layers.front().index;  // of the layers up to the touched face
  for (size_t i = 0; i < layers.size(); ++i) {
    LayerGuidance& l = layers[i];
    const double n = guide.layers[i].index;
    lowest_above = std::min(lowest_above, n);
    l.critical_above_rad = critical_angle_rad(n, guide.above);
    l.critical_below_rad = critical_angle_rad(n, guide.below);
    l.numerical_aperture = numerical_aperture(n, outside_index(guide));
    l.accepts = acceptance(n, outside_index(guide), n_edge);
    // Light turned back before an outside does not leave through it, however high that outside's index.
    double lowest_below = n;
    for (size_t j = i; j < layers.size(); ++j) lowest_below = std::min(lowest_below, guide.layers[j].index);
    l.guided_from = std::max(std::min(guide.above, lowest_above), std::min(guide.below, lowest_below));
    l.guided_to = n;
    l.touching_from = std::max(guide.above, std::min(guide.below, lowest_below));
    l.touching_to = lowest_above;
  }
  return layers;
}

}  // namespace palpate::optics
