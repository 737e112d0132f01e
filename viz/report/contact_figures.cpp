#include "viz/report/contact_figures.h"

#include <cmath>
#include <cstdio>
#include <limits>

#include "engine/base/text.h"
#include "engine/elasticity/hertz.h"
#include "engine/elasticity/modulus/indentation.h"
#include "viz/report/plot_script.h"

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

std::string figure7_script(const Figure& f, PlotKind kind) {
  std::string s =
      plot_head(kind, 1200, 480) + plot_block("d", f.columns) +
      "set multiplot layout 1,2\nset key top right samplen 2\nset xlabel 'distance from the axis, mm'\n"
      "set ylabel 'pressure, kPa'\nset yrange [0:*]\n"
      "set title 'Fig. 7: ball of 2 mm, Hertz as the paper has it (a exceeds the ball)'\nplot ";
  const char* names[] = {"0.5 N", "1 N", "1.5 N", "0.5 mN", "1 mN", "1.5 mN"};
  for (size_t c = 0; c < 3; ++c)
    s += std::string(c ? ", " : "") + "$d using 1:(1e3*$" + std::to_string(c + 2) +
         ") with lines lw 2 lc rgb '" + plot_colour(c) + "' title '" + names[c] + "'";
  s += "\nset title 'the same under a thousandth of the force, where Hertz holds'\nset xrange "
       "[-0.5:0.5]\nplot ";
  for (size_t c = 3; c < 6; ++c)
    s += std::string(c > 3 ? ", " : "") + "$d using 1:(1e3*$" + std::to_string(c + 2) +
         ") with linespoints pt 7 ps 0.4 lw 2 lc rgb '" + plot_colour(c - 3) + "' title '" + names[c] + "'";
  return s + "\nunset multiplot\n";
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

std::string figure8_script(const Figure& f, PlotKind kind) {
  const size_t radii = std::size(kRadii_mm), moduli = std::size(kModuli_MPa);
  std::string s =
      plot_head(kind, 1400, 480) + plot_block("d", f.columns) +
      "set multiplot layout 1,3\nset key top left samplen 2\nset xlabel 'normal force, N'\nset yrange "
      "[0:*]\nset ylabel 'sum of the profile along a line, MPa'\n"
      "set title 'Fig. 8: rigid balls of several radii'\nplot ";
  for (size_t k = 0; k < radii; ++k)
    s += std::string(k ? ", " : "") + "$d using 1:" + std::to_string(k + 2) + " with lines lw 2 lc rgb '" +
         plot_colour(k) + "' title '" + text("R = %g mm", kRadii_mm[k]) + "'";
  s += "\nset title '" + text("R = %g mm, several moduli of the ball", kBall_mm) + "'\nplot ";
  for (size_t k = 0; k < moduli; ++k)
    s += std::string(k ? ", " : "") + "$d using 1:" + std::to_string(k + 2 + radii) +
         " with lines lw 2 lc rgb '" + plot_colour(k) + "' title '" + text("E = %g MPa", kModuli_MPa[k]) +
         "'";
  const std::string first = std::to_string(2 + radii + moduli), second = std::to_string(3 + radii + moduli);
  s += "\nset title 'summed over the area: the force itself'\nset ylabel 'sum times a point''s area, N'\n"
       "plot x with lines lw 1 lc rgb '#888888' title 'the force', $d using 1:" +
       first + " with points pt 6 ps 0.8 lc rgb '#0072b2' title 'R = 0.5 mm', $d using 1:" + second +
       " with points pt 2 ps 0.6 lc rgb '#d55e00' title 'R = 10 mm'\nunset multiplot\n";
  return s;
}

}  // namespace palpate
