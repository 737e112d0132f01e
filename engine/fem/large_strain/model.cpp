#include "engine/fem/large_strain/model.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "palpate/error.h"

namespace palpate::fem {
namespace {

constexpr uint32_t kMostNewtonRounds = 15, kMostRubbedRounds = 100;  // without and with friction
constexpr uint32_t kMostGradients = 400;                             // iterations within one of them
constexpr uint32_t kMostWorse = 3;            // rounds that left more out of balance than they found
constexpr double kLeastVolumeRatio = 0.05;    // below it an element is as good as inverted
constexpr double kCorrectionFraction = 0.01;  // of the forces out of balance, left by a correction
// The rest state's multigrid is blind to how a press turns the directions in which volume is kept: held less
// tightly than the tissue holds it, those cost half the iterations. And what it is blind to, more smoothing
// does not mend.
constexpr double kPreconditionedPoisson = 0.4;
constexpr Smoothing kQuick = {4, 6};
constexpr double kChangeFraction = 5e-5;  // the same of a derivative

constexpr double kHardlyBetter = 0.7;  // of what was out of balance, left by a round
constexpr double kPressAgain = 0.05;   // of it, when the plate's pressure is taken anew
constexpr uint32_t kGentleRounds = 3;  // at first, twice as many each time

/// Where friction holds a node by a spring and lets it slide beyond, Newton's search jumps to and fro. After
/// a round that gains little a few go on gently (PlateFriction::form_tangent()).
struct RubbedSearch {
  double pressed = 0;  ///< out of balance when the plate's pressure was last taken
  uint32_t gentle = 0, rounds = kGentleRounds;

  void go_on(double open, double next) {
    if (gentle > 0) {
      --gentle;
    } else if (next > kHardlyBetter * open) {
      gentle = rounds;
      rounds *= 2;
    }
  }
};

const Scene& allowed(const Scene& scene) {
  Scene any_load = scene;
  any_load.press_mm = std::min(1.0, scene.block_mm[2] / 2);
  any_load.force_N.reset();
  check(any_load);
  if (scene.presser != Presser::Flat)
    throw Error(Failure::Usage, "the flat presser at large strain", "another one",
                "--presser flat, or small strain");
  if (scene.pad_slides)
    throw Error(Failure::Usage, "a bonded pad at large strain", "a sliding one",
                "a bonded pad, or small strain");
  return scene;
}

}  // namespace

LargeStrainModel::LargeStrainModel(const Scene& scene, const LargeStrainOptions& options, WorkTeam& team,
                                   std::optional<CellGrid> cells)
    : scene_(allowed(scene)),
      options_(options),
      quarter_(options.quarter && symmetric(scene)),
      team_(team),
      grid_(cells ? std::move(*cells) : voxelise(scene, quarter_)),
      above_(grid_.cells[2] - scene.cells[2]),
      fixed_(supports(scene, grid_, quarter_)),
      friction_(scene, grid_, fixed_),
      cells_(grid_, scene.poisson),
      multigrid_(grid_, std::min(scene.poisson, kPreconditionedPoisson), fixed_, team, kQuick),
      gradients_(3 * grid_.nodes(), team),
      displacement_(3 * grid_.nodes()),
      last_(displacement_),
      pressure_(grid_.cell_count()),
      last_pressure_(pressure_),
      force_(displacement_),
      residual_(displacement_) {}

uint64_t LargeStrainModel::bytes() const {
  return cells_.bytes() + multigrid_.bytes() + gradients_.bytes() + 5 * displacement_.size() * sizeof(double);
}

// residual_ = - inner forces where displacements are free. Returns its fraction of all forces.
double LargeStrainModel::out_of_balance(const std::vector<double>& displacement, std::vector<double>& force) {
  const double least = cells_.forces(displacement.data(), force.data(), grid_.young, team_);
  if (friction_) friction_.add_forces(displacement, force);
  const size_t nodes = grid_.nodes();
  double all = 0, open = 0;
  for (size_t c = 0; c < 3; ++c)
    for (size_t n = 0; n < nodes; ++n) {
      const size_t at = c * nodes + n;
      const bool held = (fixed_[n] >> c & 1) != 0;
      residual_[at] = held ? 0 : -force[at];
      (held ? all : open) += force[at] * force[at];
    }
  all_forces_ = std::sqrt(all);
  least_ = least;
  return least > kLeastVolumeRatio && all > 0 ? std::sqrt(open / all) : HUGE_VAL;
}

uint32_t LargeStrainModel::correct(double target_fraction, std::vector<double>& correction) {
  std::fill(correction.begin(), correction.end(), 0.0);
  const auto tangent = [this](const double* in, double* out) {
    cells_.apply(in, out, &fixed_, team_);
    if (friction_) friction_.add_changes(in, out);
  };
  return gradients_.run(
      tangent, [this](const float* in, float* out) { multigrid_.precondition(in, out); }, residual_,
      correction, target_fraction * gradients_.norm(residual_), kMostGradients, options_.stop);
}

/// How deep the plate is over a node of the top, where that has gone.
double LargeStrainModel::plate_mm(const std::vector<double>& displacement, size_t top_node,
                                  double press_mm) const {
  if (slope_[0] == 0 && slope_[1] == 0) return press_mm;
  const size_t row = grid_.cells[0] + 1, i = top_node % row, j = top_node / row;
  const double x = (static_cast<double>(i) - grid_.cells[0] / 2.0) * grid_.size_x_mm;
  const double y = (static_cast<double>(j) - grid_.cells[1] / 2.0) * grid_.size_y_mm;
  return press_mm + slope_[0] * (x + displacement[top_node]) +
         slope_[1] * (y + displacement[grid_.nodes() + top_node]);
}

// Nodes beside a smaller plate stay where they are.
void LargeStrainModel::put_under_plate(double press_mm, std::vector<double>& displacement) const {
  for (size_t n = 0; n < grid_.node(0, 0, 1); ++n)
    if ((fixed_[n] & kFixedZ) != 0) displacement[2 * grid_.nodes() + n] = plate_mm(displacement, n, press_mm);
}

bool LargeStrainModel::move_to(double press_mm, LargeStrainResult& result) {
  const size_t nodes = grid_.nodes();
  const auto [nx, ny, nz] = grid_.cells;
  std::vector<double> u = displacement_, pressure = pressure_;
  if (press_mm_ == 0) {
    const double whole = std::accumulate(grid_.size_z_mm.begin(), grid_.size_z_mm.end(), 0.0);
    double depth = 0;
    for (uint32_t k = 0; k <= nz; ++k) {
      for (size_t n = grid_.node(0, 0, k); n <= grid_.node(nx, ny, k); ++n)
        u[2 * nodes + n] = press_mm * (1 - depth / whole);
      if (k < nz) depth += grid_.size_z_mm[k];
    }
  } else {
    // On along the line from the last state, which takes the plate where it is wanted.
    const double way = (press_mm - press_mm_) / (press_mm_ - last_mm_);
    for (size_t n = 0; n < u.size(); ++n) u[n] += way * (displacement_[n] - last_[n]);
    put_under_plate(press_mm, u);
    for (size_t n = 0; n < pressure.size(); ++n) pressure[n] += way * (pressure_[n] - last_pressure_[n]);
  }
  return search(press_mm, u, pressure, result);
}

bool LargeStrainModel::move_near(PressedState guess, double press_mm, LargeStrainResult& result) {
  guess.scale(press_mm / guess.press_mm);
  std::vector<double>& u = guess.displacement;
  put_under_plate(press_mm, u);
  return search(press_mm, u, guess.pressure, result);
}

// The friction follows the plate's pressure, which Newton's search holds: what is then out of balance.
double LargeStrainModel::press_plate(const std::vector<double>& displacement, std::vector<double>& force) {
  friction_.press(force);
  return out_of_balance(displacement, force);
}

void LargeStrainModel::form_tangent(const std::vector<double>& displacement,
                                    const std::vector<double>& pressure, bool gentle) {
  cells_.form_tangent(displacement.data(), pressure, team_);
  if (friction_) friction_.form_tangent(displacement, gentle);
}

// Newton's search from displacements and pressures that it changes.
bool LargeStrainModel::search(double press_mm, std::vector<double>& u, std::vector<double>& pressure,
                              LargeStrainResult& result) {
  std::vector<double> force(u.size()), correction(u.size());
  const uint32_t most_rounds = friction_ ? kMostRubbedRounds : kMostNewtonRounds;
  double open = out_of_balance(u, force);
  if (friction_) open = press_plate(u, force);
  tangent_fresh_ = false;
  uint32_t worse = 0;
  RubbedSearch rubbed{open};
  for (uint32_t round = 0; open > options_.residual; ++round) {
    if (round == most_rounds || !std::isfinite(open) || worse == kMostWorse || stopped()) return false;
    form_tangent(u, pressure, rubbed.gentle > 0);
    ++result.newton_rounds;
    result.iterations += correct(std::max(kCorrectionFraction, 0.3 * options_.residual / open), correction);
    cells_.pressures(u.data(), correction.data(), pressure, team_);
    for (size_t n = 0; n < u.size(); ++n) u[n] += correction[n];
    const double next = out_of_balance(u, force);
    if (!friction_) {
      worse += next > open ? 1 : 0;
      open = next;
      continue;
    }
    rubbed.go_on(open, next);
    open = next;
    if (next > std::max(options_.residual, kPressAgain * rubbed.pressed)) continue;
    open = press_plate(u, force);
    rubbed = RubbedSearch{open};
  }
  // Far states make better lines than near ones.
  if (press_mm_ == 0 || std::abs(press_mm - press_mm_) > 0.2 * options_.step_mm) {
    last_.swap(displacement_);
    last_pressure_.swap(pressure_);
    last_mm_ = press_mm_;
  }
  displacement_.swap(u);
  pressure_.swap(pressure);
  press_mm_ = press_mm;
  state_residual_ = open;
  take_forces();
  return true;
}

// The tissue's own answer on its surface, whatever lies on it.
void LargeStrainModel::take_forces() {
  cells_.forces(displacement_.data(), force_.data(), grid_.young, team_, above_);
  force_N_ = surface_of(displacement_, force_).sum_N();
}

PressedSurface LargeStrainModel::surface_of(const std::vector<double>& displacement,
                                            const std::vector<double>& force) const {
  PressedSurface surface{
      scene_.cells[0] + 1, scene_.cells[1] + 1, {grid_.size_x_mm, grid_.size_y_mm}, {}, {}, {}, {}};
  const size_t nodes = grid_.nodes();
  const double to_N = scene_.young_Pa * 1e-6;
  const auto side = [&](uint32_t at, uint32_t cells) {
    return !quarter_ ? 1 : at * 2 == cells ? 0 : at * 2 > cells ? 1 : -1;
  };
  const auto model = [&](uint32_t at, uint32_t cells) {
    return !quarter_ ? at : at > cells / 2 ? at - cells / 2 : cells / 2 - at;
  };
  for (uint32_t y = 0; y < surface.height; ++y)
    for (uint32_t x = 0; x < surface.width; ++x) {
      const size_t n = grid_.node(model(x, scene_.cells[0]), model(y, scene_.cells[1]), above_);
      const int left = side(x, scene_.cells[0]), front = side(y, scene_.cells[1]);
      // A node on a plane of symmetry has but its half of the force.
      surface.force_N.push_back(force[2 * nodes + n] * to_N * (left == 0 ? 2 : 1) * (front == 0 ? 2 : 1));
      surface.x_mm.push_back(left * displacement[n]);
      surface.y_mm.push_back(front * displacement[nodes + n]);
      surface.z_mm.push_back(displacement[2 * nodes + n]);
    }
  return surface;
}

std::array<uint32_t, 2> LargeStrainModel::map_nodes() const {
  const auto [x, y] = options_.map_nodes;
  return {x == 0 ? scene_.cells[0] + 1 : x, y == 0 ? scene_.cells[1] + 1 : y};
}

PressedBlock LargeStrainModel::measure() const {
  PressedBlock block;
  block.press_mm = press_mm_;
  block.force_N = force_N_;
  const PressedSurface tissue = surface();
  block.pressure_Pa = true_pressure(tissue, map_nodes());
  block.deflection_mm.width = tissue.width;
  block.deflection_mm.height = tissue.height;
  block.deflection_mm.pitch_mm = tissue.pitch_mm;
  block.deflection_mm.values.assign(tissue.z_mm.begin(), tissue.z_mm.end());
  block.least_volume_ratio = least_;
  block.residual = state_residual_;
  return block;
}

// In: the change of fixed displacements, and in residual_ the forces that the free ones are to balance.
PressedSurface LargeStrainModel::change(std::vector<double>& displacement,
                                        const std::vector<double>& plus_force, LargeStrainResult& result) {
  std::vector<double> correction(displacement.size()), force(displacement.size());
  result.iterations += correct(kChangeFraction, correction);
  for (size_t n = 0; n < displacement.size(); ++n) displacement[n] += correction[n];
  // Tissue alone: the pad's part of the tangent at its surface is not wanted.
  const double small = 1e-4;
  std::vector<double> moved(displacement_);
  for (size_t n = 0; n < moved.size(); ++n) moved[n] += small * displacement[n];
  cells_.forces(moved.data(), force.data(), grid_.young, team_, above_);
  for (size_t n = 0; n < moved.size(); ++n) moved[n] = displacement_[n] - small * displacement[n];
  cells_.forces(moved.data(), correction.data(), grid_.young, team_, above_);
  for (size_t n = 0; n < force.size(); ++n)
    force[n] = (force[n] - correction[n]) / (2 * small) + plus_force[n];
  return surface_of(displacement, force);
}

PressedSurface LargeStrainModel::change_by_grids(const CellGrid& below, const CellGrid& above, double span,
                                                 LargeStrainResult& result) {
  if (!tangent_fresh_) form_tangent(displacement_, pressure_);
  tangent_fresh_ = true;
  std::vector<double> direct(displacement_.size()), displacement(displacement_.size());
  NeoHookeanCells(below, scene_.poisson)
      .forces(displacement_.data(), displacement.data(), below.young, team_);
  NeoHookeanCells(above, scene_.poisson).forces(displacement_.data(), direct.data(), above.young, team_);
  for (size_t n = 0; n < direct.size(); ++n) direct[n] = (direct[n] - displacement[n]) / span;
  std::fill(displacement.begin(), displacement.end(), 0.0);
  const size_t nodes = grid_.nodes();
  for (size_t n = 0; n < direct.size(); ++n)
    residual_[n] = (fixed_[n % nodes] >> (n / nodes) & 1) != 0 ? 0 : -direct[n];
  return change(displacement, direct, result);
}

PressedSurface LargeStrainModel::change_by_press(LargeStrainResult& result) {
  if (!tangent_fresh_) form_tangent(displacement_, pressure_);
  tangent_fresh_ = true;
  std::vector<double> displacement(displacement_.size());
  const size_t nodes = grid_.nodes();
  for (size_t n = 0; n < grid_.node(0, 0, 1); ++n)
    if ((fixed_[n] & kFixedZ) != 0) displacement[2 * nodes + n] = 1;
  cells_.apply(displacement.data(), residual_.data(), &fixed_, team_);
  for (double& r : residual_) r = -r;
  return change(displacement, std::vector<double>(displacement.size()), result);
}

}  // namespace palpate::fem
