#include "engine/fem/model.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace palpate::fem {
namespace {

constexpr int kMostContactRounds = 60;
constexpr double kContactResidual = 1e-4;  // while the contact is still sought

}  // namespace

ContactModel::ContactModel(const Scene& scene, const Options& options, WorkTeam& team)
    : scene_(scene),
      options_(options),
      quarter_(options.quarter && symmetric(scene)),
      grid_(voxelise(scene, quarter_)),
      above_(grid_.cells[2] - scene.cells[2]),
      fixed_(supports(scene, grid_, quarter_)),
      load_(3 * grid_.nodes()),
      displacement_(3 * grid_.nodes()),
      solver_(grid_, scene.poisson, options, team) {
  if (options_.residual == 0) options_.residual = scene.poisson > 0.497 ? 1e-8 : 1e-6;
}

/// Share of a node's cell-sized area that lies on the model's surface.
double ContactModel::rim_fraction(uint32_t i, uint32_t j) const {
  return (i == 0 || i == grid_.cells[0] ? 0.5 : 1) * (j == 0 || j == grid_.cells[1] ? 0.5 : 1);
}

/// From a ball that just touches down to the rest surface.
double ContactModel::gap_mm(uint32_t i, uint32_t j) const {
  const double x = i * grid_.size_x_mm - (quarter_ ? 0 : scene_.block_mm[0] / 2);
  const double y = j * grid_.size_y_mm - (quarter_ ? 0 : scene_.block_mm[1] / 2);
  const double radius = scene_.ball_radius_mm, r2 = x * x + y * y;
  return r2 < radius * radius ? r2 / (radius + std::sqrt(radius * radius - r2)) : HUGE_VAL;
}

bool ContactModel::solve(double residual, Result& result) {
  solver_.hold(fixed_);
  const SolveStatistics statistics = solver_.solve(load_, displacement_, residual, options_.most_iterations);
  result.iterations += statistics.iterations;
  ++result.rounds;
  result.residual = statistics.residual;
  result.converged = statistics.converged;
  result.solver = solver_.who();
  result.bytes = std::max(
      result.bytes, solver_.bytes() + (load_.size() + displacement_.size() + force_.size()) * sizeof(double));
  return statistics.converged;
}

// Lets go where the ball would pull and takes hold where it is in the tissue. True where something changed.
bool ContactModel::revise_contact(double way_mm) {
  solver_.forces(displacement_, force_);
  const size_t nodes = grid_.nodes();
  double scale = 0;
  for (size_t n = 0; n < surface_nodes(); ++n) scale = std::max(scale, std::abs(force_[2 * nodes + n]));
  bool changed = false;
  for (uint32_t j = 0; j <= grid_.cells[1]; ++j)
    for (uint32_t i = 0; i <= grid_.cells[0]; ++i) {
      const size_t n = grid_.node(i, j, 0), at = 2 * nodes + n;
      const double ball = way_mm - gap_mm(i, j);
      if ((fixed_[n] & kFixedZ) != 0) {
        if (force_[at] >= -1e-6 * scale) continue;
        fixed_[n] = static_cast<uint8_t>(fixed_[n] & ~kFixedZ);
      } else {
        if (!(displacement_[at] < ball - 1e-6 * way_mm)) continue;
        fixed_[n] |= kFixedZ;
        displacement_[at] = ball;
      }
      changed = true;
    }
  if (changed) solver_.release();
  return changed;
}

void ContactModel::press(double way_mm, Result& result) {
  const auto [nx, ny, nz] = grid_.cells;
  const size_t nodes = grid_.nodes();
  if (!by_ball()) {
    double depth = 0;
    const double whole = std::accumulate(grid_.size_z_mm.begin(), grid_.size_z_mm.end(), 0.0);
    for (uint32_t k = 0; k <= nz; ++k) {
      for (uint32_t j = 0; j <= ny; ++j)
        for (uint32_t i = 0; i <= nx; ++i) {
          const size_t n = grid_.node(i, j, k);
          displacement_[2 * nodes + n] = way_mm * (1 - depth / whole);
          // A pressure that presses about that far; measure() gets the exact distance.
          if (k == 0 && scene_.presser == Presser::Pressure)
            load_[2 * nodes + n] = way_mm / whole * grid_.size_x_mm * grid_.size_y_mm * rim_fraction(i, j);
        }
      if (k < nz) depth += grid_.size_z_mm[k];
    }
    way_mm_ = way_mm;
    solve(options_.residual, result);
    return;
  }
  const bool again = way_mm_ > 0;
  for (uint32_t j = 0; j <= ny; ++j)
    for (uint32_t i = 0; i <= nx; ++i) {
      const size_t n = grid_.node(i, j, 0);
      const double ball = way_mm - gap_mm(i, j);
      // Hertz's contact is as wide as the ball is at half its way.
      if (!again && ball >= way_mm / 2) fixed_[n] |= kFixedZ;
      if ((fixed_[n] & kFixedZ) != 0) displacement_[2 * nodes + n] = ball;
    }
  way_mm_ = way_mm;
  bool settled = false;
  for (int round = 0; round < kMostContactRounds; ++round) {
    if (!solve(settled ? options_.residual : std::max(options_.residual, kContactResidual), result)) return;
    const bool changed = revise_contact(way_mm);
    if (!changed && settled) return;
    settled = !changed;
  }
  result.converged = false;
}

double ContactModel::core_strain() const {
  const auto [nx, ny, nz] = grid_.cells;
  double x = 0, y = 0, depth = scene_.block_mm[2] / 2;
  if (scene_.inclusion) {
    x = scene_.inclusion->offset_mm[0];
    y = scene_.inclusion->offset_mm[1];
    depth = scene_.inclusion->depth_mm + scene_.inclusion->size()[2] / 2;
  }
  const uint32_t layers = scene_.cells[2];
  const double pitch = scene_.block_mm[2] - plane_mm(scene_, layers - 1);
  const auto column = [](double at_mm, double size_mm, uint32_t most) {
    return static_cast<uint32_t>(std::clamp(std::lround(at_mm / size_mm), 0L, static_cast<long>(most)));
  };
  const uint32_t i = column(x + (quarter_ ? 0 : scene_.block_mm[0] / 2), grid_.size_x_mm, nx);
  const uint32_t j = column(y + (quarter_ ? 0 : scene_.block_mm[1] / 2), grid_.size_y_mm, ny);
  const auto down = [&](double z) {
    uint32_t k = 0;
    while (k + 1 < layers && plane_mm(scene_, k + 1) <= z) ++k;
    const double top = plane_mm(scene_, k), within = std::clamp(z, 0.0, scene_.block_mm[2]) - top;
    const double t = within / (plane_mm(scene_, k + 1) - top);
    const double* u = displacement_.data() + 2 * grid_.nodes();
    return (1 - t) * u[grid_.node(i, j, above_ + k)] + t * u[grid_.node(i, j, above_ + k + 1)];
  };
  return (down(depth + pitch) - down(depth - pitch)) / (2 * pitch);
}

void ContactModel::measure(double scale, Result& result) {
  const size_t nodes = grid_.nodes();
  const auto [nx, ny, nz] = grid_.cells;
  force_.resize(3 * nodes);
  // The tissue's own answer on its surface, whatever lies on it.
  solver_.stiffness().apply_layers(displacement_.data(), force_.data(), above_, nz);
  const double cell_mm2 = grid_.size_x_mm * grid_.size_y_mm;
  Map stress;
  stress.width = scene_.cells[0] + 1;
  stress.height = scene_.cells[1] + 1;
  stress.pitch_mm = {grid_.size_x_mm, grid_.size_y_mm};
  Map deflection = stress;
  double force = 0, mean_way = 0, contact_mm2 = 0, tension_mm2 = 0, pressed_mm2 = 0;
  for (uint32_t y = 0; y < stress.height; ++y)
    for (uint32_t x = 0; x < stress.width; ++x) {
      const auto model = [&](uint32_t at, uint32_t cells) {
        return !quarter_ ? at : at > cells / 2 ? at - cells / 2 : cells / 2 - at;
      };
      const uint32_t i = model(x, scene_.cells[0]), j = model(y, scene_.cells[1]);
      const double area = cell_mm2 * rim_fraction(i, j);
      const size_t at = 2 * nodes + grid_.node(i, j, above_);
      const double pressure = force_[at] / area * scene_.young_Pa * scale;
      // On the whole surface a node has a whole cell but at the block's rim.
      const double whole = cell_mm2 * (x == 0 || x + 1 == stress.width ? 0.5 : 1) *
                           (y == 0 || y + 1 == stress.height ? 0.5 : 1);
      stress.values.push_back(static_cast<float>(pressure));
      deflection.values.push_back(static_cast<float>(displacement_[at] * scale));
      force += pressure * whole * 1e-6;
      mean_way += displacement_[2 * nodes + grid_.node(i, j, 0)] * scale * whole;
      const bool pressed =
          scene_.presser == Presser::Pressure || (fixed_[grid_.node(i, j, 0)] & kFixedZ) != 0;
      pressed_mm2 += pressed ? whole : 0;
      tension_mm2 += pressed && pressure < 0 ? whole : 0;
      contact_mm2 += by_ball() && pressed ? whole : 0;
    }
  result.force_N = force;
  result.press_mm = scene_.presser == Presser::Pressure ? mean_way / (scene_.block_mm[0] * scene_.block_mm[1])
                                                        : way_mm_ * scale;
  result.center_stress_Pa = static_cast<double>(stress.at(scene_.cells[0] / 2, scene_.cells[1] / 2));
  result.contact_radius_mm = std::sqrt(contact_mm2 / M_PI);
  result.tension_fraction = pressed_mm2 > 0 ? tension_mm2 / pressed_mm2 : 0;
  result.core_strain = core_strain() * scale;
  result.stress_Pa = std::move(stress);
  result.deflection_mm = std::move(deflection);
}

}  // namespace palpate::fem
