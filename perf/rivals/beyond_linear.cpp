#include "perf/rivals/beyond_linear.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "engine/base/text.h"
#include "engine/elasticity/layer.h"
#include "engine/elasticity/traction.h"
#include "engine/fem/large_strain/sphere_press.h"

namespace palpate::perf {
namespace {

constexpr double kDepths[] = {0.02, 0.1, 0.2, 0.33, 0.5, 0.66};
constexpr double kPoisson = 0.48;
constexpr int kCells = 24;

LayerContact linear_at(double poisson, double radius, double depth) {
  const Layer layer({1, poisson}, 1);
  double low = 0, high = 2 * std::sqrt(radius * depth);
  for (int i = 0; i < 50; ++i) {
    const double middle = 0.5 * (low + high);
    const double found = layer.press_sphere_to_radius(middle, radius).summary().indentation_mm;
    (found < depth ? low : high) = middle;
  }
  return layer.press_sphere_to_radius(low, radius);
}

std::vector<fem::PressedLayer> press(double poisson, double radius, std::span<const double> depths,
                                     int cells) {
  const double deepest = depths.back();
  fem::SphereOnLayer what{.poisson = poisson, .radius_mm = radius, .cell_mm = 1.0 / cells};
  // The sphere's own width at that depth, and no more than its half.
  what.reach_mm =
      1.1 * std::sqrt(2 * radius * std::min(deepest, radius) - std::pow(std::min(deepest, radius), 2));
  return fem::press_sphere(what, {depths.begin(), depths.end()});
}

/// What the traction solve makes of the surface, from the depth over each place as it lies.
double found_force(double poisson, const fem::PressedLayer& pressed) {
  constexpr double kCell = 0.06, kAround = 2.5;
  const auto along = 2 * static_cast<uint32_t>(std::ceil((pressed.contact_radius_mm + kAround) / kCell));
  const auto& surface = pressed.surface_mm;
  const auto depth_at = [&](double r) {
    size_t i = 1;
    while (i + 1 < surface.size() && surface[i][0] < r) ++i;
    const auto& [r0, d0] = surface[i - 1];
    const auto& [r1, d1] = surface[i];
    return d0 + (r - r0) / (r1 - r0) * (d1 - d0);
  };
  std::vector<float> depth(size_t{along} * along);
  std::vector<uint8_t> contact(depth.size());
  constexpr int kParts = 4;
  for (size_t i = 0; i < depth.size(); ++i) {
    const auto place = [&](size_t k, double part) {
      return (static_cast<double>(k) + part - along / 2.0) * kCell;
    };
    double sum = 0;
    for (int a = 0; a < kParts; ++a)
      for (int b = 0; b < kParts; ++b)
        sum +=
            depth_at(std::hypot(place(i % along, (a + 0.5) / kParts), place(i / along, (b + 0.5) / kParts)));
    depth[i] = static_cast<float>(sum / (kParts * kParts));
    const double r = std::hypot(place(i % along, 0.5), place(i / along, 0.5));
    contact[i] = r < pressed.contact_radius_mm + kCell ? 1 : 0;
  }
  TractionOptions options;
  options.slope_sd = 1e-3;
  options.errors = false;
  TractionSolver solver({1, poisson}, 1, {along, along, kCell}, options);
  return solver.solve({.depth_mm = depth, .contact = contact}).wrench.force_N[2];
}

}  // namespace

std::vector<BeyondLinear> beyond_linear(double poisson, double radius, std::span<const double> depths,
                                        int cells) {
  const auto fine = press(poisson, radius, depths, cells), coarse = press(poisson, radius, depths, cells / 2);
  std::vector<BeyondLinear> rows;
  for (size_t i = 0; i < std::min(fine.size(), coarse.size()); ++i) {
    const LayerContact linear = linear_at(poisson, radius, depths[i]);
    rows.push_back({.poisson = poisson,
                    .radius = radius,
                    .depth = depths[i],
                    .force = fine[i].force_N,
                    .force_error = std::abs(coarse[i].force_N / fine[i].force_N - 1),
                    .linear_force = linear.summary().force_N,
                    .contact_radius = fine[i].contact_radius_mm,
                    .linear_contact_radius = linear.summary().radius_mm,
                    .peak_ratio = fine[i].pressure_max_MPa / linear.summary().pressure_max_MPa,
                    .found_force = found_force(poisson, fine[i])});
  }
  return rows;
}

std::string beyond_linear_csv(std::span<const BeyondLinear> rows) {
  std::string csv =
      "poisson,radius,depth,force,force_error,linear_force,force_ratio,contact_radius,linear_contact_radius,"
      "peak_ratio,found_ratio\n";
  for (const BeyondLinear& r : rows)
    csv += text("%g,%g,%g,%.6g,%.2g,%.6g,%.4f,%.4f,%.4f,%.4f,%.4f\n", r.poisson, r.radius, r.depth, r.force,
                r.force_error, r.linear_force, r.force / r.linear_force, r.contact_radius,
                r.linear_contact_radius, r.peak_ratio, r.found_force / r.force);
  return csv;
}

std::vector<BeyondLinear> beyond_linear_study() {
  std::vector<BeyondLinear> rows;
  for (const double radius : {0.5, 1.0, 2.0, 4.0}) {
    const std::vector<BeyondLinear> some = beyond_linear(kPoisson, radius, kDepths, kCells);
    std::printf("%s", beyond_linear_csv(some).c_str());
    std::fflush(stdout);
    rows.insert(rows.end(), some.begin(), some.end());
  }
  return rows;
}

}  // namespace palpate::perf
