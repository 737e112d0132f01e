#include "viz/report/contact_figures.h"

#include <cmath>
#include <cstdio>
#include <limits>

#include "engine/base/text.h"
#include "engine/elasticity/hertz.h"
#include "engine/elasticity/modulus/indentation.h"

namespace palpate {
namespace {

constexpr double kLayers_MPa[] = {0.14, 0.08, 0.034};
constexpr double kPoisson = 0.4;
constexpr Material kSteel{200e3, 0.3};
constexpr double kSpacing_mm = 0.03;
constexpr double kForces_N[] = {0.5, 1, 1.5};
constexpr double kRadii_mm[] = {0.5, 1, 2.5, 5, 10};
constexpr double kModuli_MPa[] = {0.01, 0.03, 0.1, 1, 200e3};
constexpr double kBall_mm = 2.5;  // of the curves over the modulus

Material pad() {
  return {paper_series_modulus_MPa(kLayers_MPa), kPoisson};
}

PaperExample::Case solved(double force_N, double radius_mm, double modulus_MPa) {
  const IndenterContact c = hertz_contact(force_N, modulus_MPa, radius_mm);
  const PadIndenter sphere({{modulus_MPa, 0}}, {IndenterShape::Sphere, radius_mm});
  const double force_error = force_N / sphere.at_depth(c.indentation_mm).force_N - 1;
  return {force_N,
          radius_mm,
          modulus_MPa,
          c.radius_mm,
          c.pressure_max_MPa,
          c.indentation_mm,
          force_error,
          describe_warnings(c.warnings)};
}

/// The pressure summed over points on a line through the middle, MPa.
double line_sum(const IndenterContact& c) {
  double sum = 0;
  for (int i = -static_cast<int>(c.radius_mm / kSpacing_mm); i * kSpacing_mm <= c.radius_mm; ++i)
    sum += hertz_pressure_MPa(c, i * kSpacing_mm);
  return sum;
}

/// Over the whole area, times a point's own: newtons.
double area_sum_N(const IndenterContact& c) {
  const int reach = static_cast<int>(c.radius_mm / kSpacing_mm) + 1;
  double sum = 0;
  for (int y = -reach; y <= reach; ++y)
    for (int x = -reach; x <= reach; ++x) sum += hertz_pressure_MPa(c, kSpacing_mm * std::hypot(x, y));
  return sum * kSpacing_mm * kSpacing_mm;
}

}  // namespace

PaperExample paper_example() {
  PaperExample e;
  const double equal_mm[] = {1, 1, 1};
  e.paper_modulus_MPa = effective_modulus_MPa(pad(), kSteel);
  e.weighted_modulus_MPa =
      effective_modulus_MPa({series_modulus_MPa(kLayers_MPa, equal_mm), kPoisson}, kSteel);
  constexpr double kRounded_MPa = 0.0243;  // as the paper goes on with
  e.cases = {solved(2, 5, kRounded_MPa), solved(2, 2.5, kRounded_MPa), solved(0.02, 5, kRounded_MPa)};
  return e;
}

Figure figure7() {
  Figure f;
  f.header =
      "r_mm,pressure_MPa_0.5N,pressure_MPa_1N,pressure_MPa_1.5N,pressure_MPa_0.5mN,pressure_MPa_1mN,"
      "pressure_MPa_1.5mN";
  f.columns.resize(7);
  const double modulus = effective_modulus_MPa(pad(), kSteel);
  std::vector<IndenterContact> contacts;
  for (const double scale : {1.0, 1e-3})
    for (const double force : kForces_N) contacts.push_back(hertz_contact(scale * force, modulus, 1));
  const int reach = static_cast<int>(contacts[2].radius_mm / kSpacing_mm) + 2;
  for (int i = -reach; i <= reach; ++i) {
    f.columns[0].push_back(i * kSpacing_mm);
    for (size_t c = 0; c < contacts.size(); ++c)
      f.columns[c + 1].push_back(hertz_pressure_MPa(contacts[c], i * kSpacing_mm));
  }
  f.notes = text("contact radius %.3f", contacts[0].radius_mm) +
            text(" to %.3f mm under 0.5 to 1.5 N", contacts[2].radius_mm) +
            ": wider than the ball's own 1 mm, so that Hertz does not hold; under a thousandth of it (" +
            text("%.3f", contacts[3].radius_mm) + text(" to %.3f mm) it does", contacts[5].radius_mm);
  return f;
}

Plot figure7_plot(const Figure& f) {
  PlotPanel high{"Fig. 7: ball of 2 mm, Hertz as the paper has it (a exceeds the ball)",
                 "distance from the axis, mm", "pressure, kPa"};
  high.y_range = {{0, kPlotAuto}};
  PlotPanel low = high;
  low.title = "the same under a thousandth of the force, where Hertz holds";
  low.x_range = {{-0.5, 0.5}};
  for (size_t c = 0; c < 3; ++c) {
    high.add(text("%g N", kForces_N[c]), f.columns[0], plot_scaled(f.columns[c + 1], 1e3), c);
    low.add(text("%g mN", kForces_N[c]), f.columns[0], plot_scaled(f.columns[c + 4], 1e3), c,
            PlotCurve::Style::LinesAndPoints);
  }
  return {.panels = {high, low}, .across = 2, .width_px = 1200, .height_px = 480};
}

Figure figure8() {
  Figure f;
  f.header = "force_N";
  for (const double radius : kRadii_mm) f.header += text(",line_sum_MPa_R%gmm", radius);
  for (const double modulus : kModuli_MPa) f.header += text(",line_sum_MPa_E%gMPa", modulus);
  f.header += ",area_sum_N_R0.5mm,area_sum_N_R10mm";
  const size_t radii = std::size(kRadii_mm), moduli = std::size(kModuli_MPa);
  f.columns.resize(1 + radii + moduli + 2);
  const double rigid = effective_modulus_MPa(pad());
  double worst = 0;
  for (int i = 1; i <= 40; ++i) {
    const double force = 0.05 * i;
    f.columns[0].push_back(force);
    for (size_t k = 0; k < radii; ++k)
      f.columns[1 + k].push_back(line_sum(hertz_contact(force, rigid, kRadii_mm[k])));
    for (size_t k = 0; k < moduli; ++k)
      f.columns[1 + radii + k].push_back(
          line_sum(hertz_contact(force, effective_modulus_MPa(pad(), {kModuli_MPa[k], 0.3}), kBall_mm)));
    for (const size_t k : {size_t{0}, radii - 1}) {
      const double sum = area_sum_N(hertz_contact(force, rigid, kRadii_mm[k]));
      f.columns[1 + radii + moduli + (k ? 1 : 0)].push_back(sum);
      worst = std::max(worst, std::abs(sum / force - 1));
    }
  }
  f.notes = text(
      "summed over the area the pressure is the force whatever the indenter (within %.2g %% here): only "
      "the sum along a line depends on radius and modulus, as 3 F / (4 a) per point's spacing",
      100 * worst);
  return f;
}

Plot figure8_plot(const Figure& f) {
  PlotPanel radii{"Fig. 8: rigid balls of several radii", "normal force, N",
                  "sum of the profile along a line, MPa"};
  radii.key = "top left";
  radii.y_range = {{0, kPlotAuto}};
  PlotPanel moduli = radii, area = radii;
  moduli.title = text("R = %g mm, several moduli of the ball", kBall_mm);
  area.title = "summed over the area: the force itself";
  area.y_label = "sum times a point's area, N";
  const std::vector<double>& force_N = f.columns[0];
  auto column = f.columns.begin() + 1;
  for (const double radius : kRadii_mm)
    radii.add(text("R = %g mm", radius), force_N, *column++, radii.curves.size());
  for (const double modulus : kModuli_MPa)
    moduli.add(text("E = %g MPa", modulus), force_N, *column++, moduli.curves.size());
  area.add_line("the force", {0, 0}, {force_N.back(), force_N.back()});
  area.add("R = 0.5 mm", force_N, *column++, 0, PlotCurve::Style::Points).mark = 6;
  area.add("R = 10 mm", force_N, *column++, 1, PlotCurve::Style::Points).mark = 2;
  return {.panels = {radii, moduli, area}, .across = 3, .width_px = 1400, .height_px = 480};
}

}  // namespace palpate
