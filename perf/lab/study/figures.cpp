#include "perf/lab/study/figures.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "engine/base/text.h"
#include "engine/fem/solve.h"
#include "palpate/error.h"
#include "perf/lab/dataset/sweep.h"

namespace palpate::lump {
namespace {

constexpr double kBySize_N = 2, kByMaterial_N = 2.35;

fem::Scene phantom(const FigureOptions& o, double size_mm, double lump_Pa) {
  fem::Scene scene;
  scene.block_mm = {40, 40, 20};
  scene.young_Pa = o.tissue_Pa;
  scene.cells = o.cells;
  fem::Inclusion lump;
  lump.size_mm = {size_mm, size_mm, size_mm};
  lump.depth_mm = 5;
  lump.stiffness_ratio = lump_Pa / o.tissue_Pa;
  scene.inclusion = lump;
  return scene;
}

GaussianFit fit_inner(const Profile& profile, double length_mm) {
  const Profile inner = inner_part(profile, 0.4 * length_mm);
  return inner.x_mm.size() >= 6 ? fit_gaussian(inner) : GaussianFit{};
}

/// The loads as one press of one block.
std::vector<FigurePress> press(const std::string& name, const fem::Scene& scene,
                               const std::vector<double>& forces_N, const fem::PressSolver& solver) {
  std::vector<fem::PressLoad> loads;
  for (const double force_N : forces_N) loads.push_back({{}, force_N});
  fem::LargeStrainResult result = solver(scene, loads);
  std::vector<FigurePress> all;
  for (size_t i = 0; i < forces_N.size(); ++i) {
    FigurePress p;
    p.name = name;
    p.scene = scene;
    p.wanted_N = forces_N[i];
    p.last_force_N = result.last_force_N;
    p.good = i < result.loads.size();
    if (p.good) {
      p.press = std::move(result.loads[i]);
      p.profile = profile_along_x(p.press.pressure_Pa, bump_center_mm(p.press.pressure_Pa)[1]);
      p.fit = fit_inner(p.profile, scene.block_mm[0]);
    }
    all.push_back(std::move(p));
  }
  return all;
}

/// Sets the bump: the difference from the block without an inclusion.
void set_bump(FigurePress& p, const FigurePress& without) {
  if (!p.good || !without.good) return;
  const Profile base = profile_along_x(without.press.pressure_Pa, bump_center_mm(p.press.pressure_Pa)[1]);
  p.bump = p.profile;
  for (size_t i = 0; i < p.bump.value.size(); ++i) p.bump.value[i] -= base.value[i];
  p.bump_fit = fit_inner(p.bump, p.scene.block_mm[0]);
}

fem::Scene without_lump(fem::Scene scene) {
  scene.inclusion.reset();
  return scene;
}

void compare(const std::vector<FigureRow>& rows, std::vector<std::string>& broken) {
  for (size_t i = 0; i + 1 < rows.size(); ++i) {
    const FigurePress &a = rows[i].press, &b = rows[i + 1].press;
    const auto check = [&](const GaussianFit& more, const GaussianFit& less, const char* line) {
      if (!more.found || !less.found)
        broken.push_back(std::string("no Gaussian in the ") + line + " of " + (more.found ? b.name : a.name));
      else if (!(more.amplitude > less.amplitude))
        broken.push_back(a.name + " has no larger amplitude than " + b.name + " in the " + line);
    };
    if (!a.good || !b.good) {
      broken.push_back("the press on " + (a.good ? b.name : a.name) + " ended at " +
                       text("%.3g N", a.good ? b.last_force_N : a.last_force_N));
      continue;
    }
    check(a.fit, b.fit, "profile");
    check(a.bump_fit, b.bump_fit, "bump");
  }
}

constexpr InclusionShape kShapes[] = {InclusionShape::Sphere, InclusionShape::Ellipsoid,
                                      InclusionShape::Cylinder, InclusionShape::LyingCylinder};

struct Change {
  std::string input;
  double value;
  std::string name;
  fem::Scene scene;
};

std::vector<Change> changes(const fem::Scene& base) {
  std::vector<Change> all;
  const auto add = [&](const char* input, double value, std::string name, auto change) {
    fem::Scene scene = base;
    change(scene, *scene.inclusion);
    try {
      check(scene);
    } catch (const Error&) {
      return;  // does not fit the block
    }
    all.push_back({input, value, std::move(name), scene});
  };
  for (const double d : {4.0, 6.0, 8.0, 10.0, 12.0})
    add("d", d, text("%g mm", d), [&](fem::Scene&, fem::Inclusion& lump) { lump.size_mm = {d, d, d}; });
  for (const double h : {2.0, 3.0, 5.0, 7.0, 9.0})
    add("h", h, text("%g mm", h), [&](fem::Scene&, fem::Inclusion& lump) { lump.depth_mm = h; });
  for (const double ratio : {0.2, 1.5, 3.0, 10.0, 100.0})
    add("E_r", ratio, text("%g", ratio),
        [&](fem::Scene&, fem::Inclusion& lump) { lump.stiffness_ratio = ratio; });
  for (size_t i = 0; i < std::size(kShapes); ++i)
    add("s", static_cast<double>(i), to_string(kShapes[i]), [&](fem::Scene&, fem::Inclusion& lump) {
      lump.shape = kShapes[i];
      const double d = lump.size_mm[0];
      if (kShapes[i] == InclusionShape::Ellipsoid) lump.size_mm = {1.5 * d, d, d};
      if (kShapes[i] == InclusionShape::LyingCylinder) lump.size_mm = {2.5 * d, d, d};
    });
  for (const double t : {16.0, 18.0, 20.0, 24.0, 28.0})
    add("t", t, text("%g mm", t), [&](fem::Scene& scene, fem::Inclusion&) { scene.block_mm[2] = t; });
  return all;
}

}  // namespace

Figures make_figures(const FigureOptions& o, const fem::PressSolver& solver,
                     const std::function<void(uint64_t, uint64_t)>& done) {
  struct Line {
    std::string name;
    double size_mm, lump_Pa;
    PaperFit paper;
  };
  const std::vector<Line> sizes = {{"12 mm", 12, o.play_doh_Pa, {2323, 99.96}},
                                   {"8 mm", 8, o.play_doh_Pa, {137.06, 98.92}},
                                   {"4 mm", 4, o.play_doh_Pa, {77.07, 75.40}}};
  const std::vector<Line> materials = {{"rubber", 8, o.rubber_Pa, {175.20, 80.25}},
                                       {"Play-Doh", 8, o.play_doh_Pa, {81.62, 98.6}}};
  const uint64_t total = sizes.size() + materials.size() + 1;
  uint64_t ready = 0;
  const std::vector<FigurePress> bare =
      press("none", without_lump(phantom(o, 8, o.tissue_Pa)), {kBySize_N, kByMaterial_N}, solver);
  done(++ready, total);
  Figures figures;
  const auto make = [&](const std::vector<Line>& lines, double force_N, const FigurePress& without,
                        std::vector<FigureRow>& rows) {
    for (const Line& line : lines) {
      FigurePress p =
          std::move(press(line.name, phantom(o, line.size_mm, line.lump_Pa), {force_N}, solver)[0]);
      set_bump(p, without);
      rows.push_back({std::move(p), line.paper});
      done(++ready, total);
    }
  };
  make(sizes, kBySize_N, bare[0], figures.by_size);
  make(materials, kByMaterial_N, bare[1], figures.by_material);
  return figures;
}

std::vector<std::string> broken_orderings(const Figures& figures) {
  std::vector<std::string> broken;
  compare(figures.by_size, broken);
  compare(figures.by_material, broken);
  return broken;
}

std::vector<InputRow> vary_inputs(const FigureOptions& o, const fem::PressSolver& solver,
                                  const std::function<void(uint64_t, uint64_t)>& done) {
  const fem::Scene base = phantom(o, 8, o.play_doh_Pa);
  const std::vector<Change> all = changes(base);
  const uint64_t total = all.size() + 1;
  uint64_t ready = 0;
  std::vector<InputRow> rows;
  for (const Change& c : all) {
    rows.push_back({c.input, c.value, std::move(press(c.name, c.scene, {kBySize_N}, solver)[0]), {}});
    done(++ready, total);
  }
  const std::vector<double> forces_N = {0.25, 0.5, 1, 1.5, 2};
  fem::Scene slight = base;
  slight.press_mm.reset();
  slight.force_N = 1;
  const fem::Result linear = fem::solve(slight);
  for (FigurePress& p : press("", base, forces_N, solver)) {
    p.name = text("%g N", p.wanted_N);
    InputRow row{"l", p.wanted_N, std::move(p), {}};
    if (linear.converged) {
      Profile line = profile_along_x(linear.stress_Pa, bump_center_mm(linear.stress_Pa)[1]);
      for (double& value : line.value) value *= row.value;
      row.small_strain = std::move(line);
    }
    rows.push_back(std::move(row));
  }
  done(++ready, total);
  return rows;
}

}  // namespace palpate::lump
