#include "engine/pad/traction.h"

#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <utility>

#include "engine/pad/known_edges.h"
#include "engine/pad/layer_continuation.h"
#include "engine/pad/layer_convolution.h"
#include "engine/pad/masked_gradients.h"
#include "palpate/error.h"

namespace palpate {
namespace {

using Field = std::vector<double>;

constexpr uint32_t kRounds = 4;           // of pressure and shear, each for what the other one moves
constexpr double kSettled = 2e-3;         // change of force from one round to the next
constexpr double kErrorTolerance = 1e-2;  // a standard error to one part in a hundred
constexpr uint32_t kFreshGradient = 40;   // iterations after which rounding is swept out
constexpr double kRim = 1.25;             // of standard errors: pressure at the rim errs to one side only
constexpr double kHidden = 0.5;           // of what a cell of unknown depth may carry: a standard error
constexpr double kRectified = 4;          // errors of a cell's pressure that nothing may look like
constexpr double kUnseen = 2;             // errors of slopes over what is left of them, where tilts are free
constexpr double kBeyond = 0.4;           // of what presses beyond the border: a standard error
constexpr double kEven = 0.2;    // of the force of a contact over all of the border: a standard error
constexpr double kRising = 1.3;  // mean pressure at the border over that of the contact

}  // namespace

struct TractionSolver::Impl {
  Impl(const Pad& pad, const TractionGrid& on, const TractionOptions& with)
      : grid(on),
        options(with),
        kernel(pad, on.cell_mm),
        margin(LayerContinuation::margin_cells(kernel, on.width, on.height)),
        weights(traction_weights(pad.material, with)) {
    check_traction(grid, options);
    const double shear_MPa = pad.material.young_MPa / (2 * (1 + pad.material.poisson));
    shear_prior = std::pow(options.shift_sd_mm / shear_MPa, 2);
    const size_t n = size();
    for (Field* field :
         {&pressure, &depth, &scratch, &scratch2, &right, &gradient, &along, &image, &answer, &shear_depth})
      field->assign(n, 0);
    for (Field& field : error_solutions) field.assign(n, 0);
    for (Field& field : shear_errors) field.assign(2 * n, 0);
    allowed.assign(n, 1);
    active.assign(n, 0);
    known.assign(n, 1);
    result.pressure_MPa.assign(n, 0);
  }

  size_t size() const { return size_t{grid.width} * grid.height; }
  double x_mm(size_t cell) const {
    return (static_cast<double>(cell % grid.width) + 0.5 - 0.5 * grid.width) * grid.cell_mm;
  }
  double y_mm(size_t cell) const {
    const size_t row = cell / grid.width;
    return (static_cast<double>(row) + 0.5 - 0.5 * grid.height) * grid.cell_mm;
  }

  /// Minus the divergence of the gradient between known cells, 1 / mm^2. Of a contact that reaches the border
  /// too little of the surface is at rest to know its tilt.
  void laplacian(const Field& of, Field& out) const {
    known_laplacian(known, grid.width, grid.cell_mm, goes_on, of, out);
  }

  bool on_border(size_t cell) const {
    const size_t x = cell % grid.width, y = cell / grid.width;
    return x == 0 || y == 0 || x + 1 == grid.width || y + 1 == grid.height;
  }
  double covered_border_cells() const {
    double covered = 0;
    for (size_t i = 0; i < size(); ++i) covered += allowed[i] != 0 && on_border(i) ? 1 : 0;
    return covered;
  }

  /// Force and moments, N and N mm, of 1 MPa on a cell and on what goes on from it.
  struct Arm {
    double force, x_moment, y_moment;
  };
  Arm arm(size_t cell) const {
    const CarriedLoad load = beyond ? continuation->carried()[cell] : CarriedLoad{};
    const double area = grid.cell_mm * grid.cell_mm;
    return {area * load.cells, area * (y_mm(cell) * load.cells + grid.cell_mm * load.y_cells),
            -area * (x_mm(cell) * load.cells + grid.cell_mm * load.x_cells)};
  }
  std::array<double, 3> load_of(const Field& of) const {
    std::array<double, 3> sum{};
    for (size_t i = 0; i < size(); ++i) {
      const Arm a = arm(i);
      sum[0] += a.force * of[i];
      sum[1] += a.x_moment * of[i];
      sum[2] += a.y_moment * of[i];
    }
    return sum;
  }

  void depth_by_pressure(const Field& of, Field& out) {
    goes_on ? continuation->depth_by_pressure(of, out) : convolution->depth_by_pressure(of, out);
  }
  void pressure_by_depth(const Field& of, Field& out) {
    goes_on ? continuation->pressure_by_depth(of, out) : convolution->depth_by_pressure(of, out);
  }

  void normal_matrix(const Field& of, Field& out) {
    depth_by_pressure(of, scratch);
    laplacian(scratch, scratch2);
    pressure_by_depth(scratch2, out);
    for (size_t i = 0; i < of.size(); ++i) out[i] += weights.prior * of[i];
  }

  /// From where `pressure` is; `depth` is what it has to explain.
  void solve_pressure() {
    const size_t n = size();
    laplacian(depth, scratch2);
    pressure_by_depth(scratch2, right);
    double goal = 0, most = 0;
    for (size_t i = 0; i < n; ++i) {
      goal += allowed[i] != 0 ? right[i] * right[i] : 0;
      most = std::max(most, allowed[i] != 0 ? right[i] : 0);
    }
    result.residual = 0;
    result.converged = true;
    if (most <= 0) return std::fill(pressure.begin(), pressure.end(), 0.0);
    // A cell without pressure enters only where a step is cut; a trace of it in each lets them all begin.
    double sum = 0;
    for (size_t i = 0; i < n; ++i) sum += pressure[i] = allowed[i] != 0 ? pressure[i] : 0;
    if (sum == 0)
      for (size_t i = 0; i < n; ++i) pressure[i] = allowed[i] != 0 ? 1e-9 : 0;
    double before = 1, follow = 0;
    uint32_t fresh = 0;
    result.converged = false;
    for (uint32_t iteration = 0;; ++iteration) {
      if (fresh == 0) {
        normal_matrix(pressure, gradient);
        for (size_t i = 0; i < n; ++i) gradient[i] = right[i] - gradient[i];
      }
      double squares = 0, outside = 0;
      for (size_t i = 0; i < n; ++i) {
        active[i] = pressure[i] > 0 ? 1 : 0;
        if (active[i] != 0)
          squares += gradient[i] * gradient[i];
        else if (allowed[i] != 0 && gradient[i] > 0)
          outside += gradient[i] * gradient[i];
      }
      result.residual = std::sqrt((squares + outside) / goal);
      if (result.residual <= options.tolerance) {
        result.converged = true;
        return;
      }
      if (iteration == options.most_iterations) return;
      ++result.iterations;
      const double keep = follow * squares / before;
      before = squares;
      for (size_t i = 0; i < n; ++i) along[i] = active[i] != 0 ? gradient[i] + keep * along[i] : 0;
      normal_matrix(along, image);
      const double curvature = dot(along, image);
      double step = 0;
      for (size_t i = 0; i < n; ++i) step += active[i] != 0 ? gradient[i] * along[i] : 0;
      step = curvature > 0 ? step / curvature : 0;
      bool cut = squares == 0, entered = false;
      for (size_t i = 0; i < n; ++i) {
        if (active[i] == 0) continue;
        pressure[i] += step * along[i];
        if (pressure[i] > 0) continue;
        cut = true;
        pressure[i] = 0;
      }
      // Cells that wrongly carry nothing.
      const double into = step > 0 ? step : weights.first_step;
      for (size_t i = 0; i < n; ++i) {
        if (allowed[i] == 0 || pressure[i] > 0 || gradient[i] <= 0) continue;
        pressure[i] = into * gradient[i];
        entered = true;
      }
      follow = entered ? 0 : 1;
      fresh = cut || entered || fresh + 1 == kFreshGradient ? 0 : fresh + 1;
      if (fresh != 0)
        for (size_t i = 0; i < n; ++i) gradient[i] -= step * image[i];
    }
  }

  /// Calibrations state the error over steep and gentle slopes alike. A wide contact is gentle, and what is
  /// left of its slopes says how gentle their errors are.
  double slope_sd() const {
    return beyond ? std::min(options.slope_sd, kUnseen * result.slope_rms) : options.slope_sd;
  }

  double error_patches() const { return std::max(1.0, std::pow(options.error_length_mm / grid.cell_mm, 2)); }

  /// The standard error of a sum of `of_cell` times pressure, over the cells that carry some.
  double pressure_error(const Field& of_cell, Field& solution) {
    double rest = 0;
    conjugate_gradients([this](const Field& of, Field& out) { normal_matrix(of, out); }, of_cell, active,
                        kErrorTolerance, options.most_iterations, memory, solution, rest);
    double sum = 0, pulled = 0;
    for (size_t i = 0; i < of_cell.size(); ++i) {
      if (active[i] == 0) continue;
      sum += of_cell[i] * solution[i];
      pulled += weights.prior * pressure[i] * solution[i];
    }
    // Long waves of a thin layer that keeps its volume hardly tilt its surface: there |p|^2 decides, and
    // pulls the pressure down.
    return std::hypot(kRim * slope_sd() * std::sqrt(std::max(0.0, sum) * error_patches()), pulled);
  }

  /// Cells of the contact whose depth is not known count as if they carried anything up to twice the mean
  /// pressure of the others; their moments as of one patch in their middle.
  void add_hidden() {
    const size_t n = size();
    double hidden = 0, seen = 0, sum = 0, x = 0, y = 0;
    for (size_t i = 0; i < n; ++i) {
      if (allowed[i] == 0) continue;
      if (known[i] == 0) {
        ++hidden;
        x += x_mm(i);
        y += y_mm(i);
      } else if (pressure[i] > 0) {
        ++seen;
        sum += pressure[i];
      }
    }
    if (hidden == 0 || seen == 0) return;
    const double force = kHidden * hidden * sum / seen * grid.cell_mm * grid.cell_mm;
    Wrench& wrench = result.wrench;
    wrench.force_sd_N[2] = std::hypot(wrench.force_sd_N[2], force);
    wrench.moment_sd_Nmm[0] = std::hypot(wrench.moment_sd_Nmm[0], force * y / hidden);
    wrench.moment_sd_Nmm[1] = std::hypot(wrench.moment_sd_Nmm[1], force * x / hidden);
  }

  /// The standard error of a cell's pressure by slopes' errors, on average over the grid; found once.
  double cell_error() {
    if (cell_sd > 0) return cell_sd;
    const size_t n = size();
    const std::vector<uint8_t> all(n, 1);
    std::mt19937 random(1);
    // The mean of an inverse's diagonal, by signs at random.
    for (double& sign : right) sign = random() % 2 == 0 ? 1 : -1;
    Field solution(n);
    double rest = 0;
    conjugate_gradients([this](const Field& of, Field& out) { normal_matrix(of, out); }, right, all,
                        kErrorTolerance, options.most_iterations, memory, solution, rest);
    cell_sd = options.slope_sd * std::sqrt(std::max(0.0, dot(right, solution)) / static_cast<double>(n));
    return cell_sd;
  }

  /// Where nothing says what touches, errors of slopes make pressure all over, since it is never negative:
  /// where the mean over a cell and its neighbours is no more than they make, it may all be nothing.
  void add_rectified() {
    const double least = kRectified * cell_error(), area = grid.cell_mm * grid.cell_mm;
    const uint32_t w = grid.width, h = grid.height;
    double force = 0, x_moment = 0, y_moment = 0;
    for (uint32_t y = 0; y < h; ++y)
      for (uint32_t x = 0; x < w; ++x) {
        const size_t i = size_t{y} * w + x;
        if (pressure[i] <= 0) continue;
        double sum = 0, cells = 0;
        for (uint32_t row = y - std::min(y, 1u); row < std::min(y + 2, h); ++row)
          for (uint32_t column = x - std::min(x, 1u); column < std::min(x + 2, w); ++column) {
            sum += pressure[size_t{row} * w + column];
            ++cells;
          }
        if (sum > least * cells) continue;
        force += pressure[i] * area;
        x_moment += y_mm(i) * pressure[i] * area;
        y_moment += x_mm(i) * pressure[i] * area;
      }
    Wrench& wrench = result.wrench;
    wrench.force_sd_N[2] = std::hypot(wrench.force_sd_N[2], force);
    wrench.moment_sd_Nmm[0] = std::hypot(wrench.moment_sd_Nmm[0], x_moment);
    wrench.moment_sd_Nmm[1] = std::hypot(wrench.moment_sd_Nmm[1], y_moment);
  }

  /// A face over all of the grid leaves no slopes: it may press with anything that the prior allows.
  void unseen_plate(double touched_mm2) {
    const double force_N = options.slope_sd / std::sqrt(weights.prior) * touched_mm2;
    Wrench& wrench = result.wrench;
    wrench.force_sd_N[2] = force_N;
    wrench.moment_sd_Nmm[0] = force_N * grid.height * grid.cell_mm / 2;
    wrench.moment_sd_Nmm[1] = force_N * grid.width * grid.cell_mm / 2;
  }

  /// Adds the error of what presses beyond the border. Where pressure still rises there, most of the contact
  /// may lie beyond, and as much again as was found is a standard error.
  void add_beyond() {
    double inside = 0, cells = 0, at_border = 0, border_cells = 0;
    std::array<double, 3> error = load_of(pressure);
    const double area = grid.cell_mm * grid.cell_mm;
    for (size_t i = 0; i < size(); ++i) {
      if (pressure[i] <= 0) continue;
      inside += pressure[i];
      ++cells;
      at_border += on_border(i) ? pressure[i] : 0;
      border_cells += on_border(i) ? 1 : 0;
    }
    if (at_border * cells < kRising * inside * border_cells) {
      for (size_t i = 0; i < size(); ++i) {
        error[0] -= area * pressure[i];
        error[1] -= area * y_mm(i) * pressure[i];
        error[2] += area * x_mm(i) * pressure[i];
      }
      for (double& one : error) one *= kBeyond;
    }
    Wrench& wrench = result.wrench;
    wrench.force_sd_N[2] = std::hypot(wrench.force_sd_N[2], error[0]);
    wrench.moment_sd_Nmm[0] = std::hypot(wrench.moment_sd_Nmm[0], error[1]);
    wrench.moment_sd_Nmm[1] = std::hypot(wrench.moment_sd_Nmm[1], error[2]);
    // Without a rim nothing anchors the pressure's level: an even one leaves no slopes.
    if (covered_border_cells() == 2.0 * (grid.width + grid.height) - 4)
      wrench.force_sd_N[2] = std::hypot(wrench.force_sd_N[2], kEven * wrench.force_N[2]);
  }

  void measure(const TractionInput& input) {
    const size_t n = size();
    const double area = grid.cell_mm * grid.cell_mm;
    Wrench& wrench = result.wrench;
    wrench = {};
    result.at_border = input.goes_on;
    double touched_mm2 = 0;
    for (size_t i = 0; i < n; ++i) {
      const double p = pressure[i];
      active[i] = p > 0 ? 1 : 0;
      const bool touched = !input.contact.empty() && allowed[i] != 0;
      touched_mm2 += touched ? area : 0;
      if ((p > 0 || touched) && on_border(i)) result.at_border = true;
      result.pressure_MPa[i] = static_cast<float>(pressure[i]);
    }
    const std::array<double, 3> load = load_of(pressure);
    wrench.force_N[2] = load[0];
    wrench.moment_Nmm[0] = load[1];
    wrench.moment_Nmm[1] = load[2];
    if (input.pressure_MPa.empty()) find_residual();
    // Where the pressure is measured by itself, its errors are not those of slopes.
    if (options.errors && !input.depth_mm.empty() && wrench.force_N[2] > 0) {
      for (size_t i = 0; i < n; ++i) right[i] = arm(i).force;
      wrench.force_sd_N[2] = pressure_error(right, error_solutions[0]);
      for (size_t i = 0; i < n; ++i) right[i] = arm(i).x_moment;
      wrench.moment_sd_Nmm[0] = pressure_error(right, error_solutions[1]);
      for (size_t i = 0; i < n; ++i) right[i] = arm(i).y_moment;
      wrench.moment_sd_Nmm[1] = pressure_error(right, error_solutions[2]);
      add_hidden();
      if (input.contact.empty()) add_rectified();
      if (beyond) add_beyond();
    }
    if (options.errors && input.goes_on && wrench.force_N[2] == 0) unseen_plate(touched_mm2);
    if (!input.shift_x_mm.empty()) measure_shear();
  }

  void find_residual() {
    depth_by_pressure(pressure, answer);
    for (size_t i = 0; i < size(); ++i) scratch[i] = depth[i] - answer[i];
    laplacian(scratch, scratch2);
    const double edges = known_edges(known, grid.width);
    result.slope_rms = edges > 0 ? std::sqrt(std::max(0.0, dot(scratch, scratch2)) / (edges / 2)) : 0;
  }

  // Shear: both components one behind the other.
  void shear_matrix(const Field& of, Field& out) {
    const size_t n = size();
    split(of);
    convolution->shift_by_shear(half_x, half_y, move_x, move_y);
    for (size_t i = 0; i < n; ++i)
      if (shift_known[i] == 0) move_x[i] = move_y[i] = 0;
    convolution->shift_by_shear(move_x, move_y, half_x, half_y);
    for (size_t i = 0; i < n; ++i) {
      out[i] = half_x[i] + shear_prior * of[i];
      out[n + i] = half_y[i] + shear_prior * of[n + i];
    }
  }
  void split(const Field& both) {
    const auto middle = both.begin() + static_cast<std::ptrdiff_t>(size());
    half_x.assign(both.begin(), middle);
    half_y.assign(middle, both.end());
  }

  void solve_shear(const TractionInput& input) {
    const size_t n = size();
    const double least_MPa = kLeastPressureShare * *std::ranges::max_element(pressure);
    if (goes_on)
      continuation->shift_by_pressure(pressure, move_x, move_y);
    else
      convolution->shift_by_pressure(pressure, move_x, move_y);
    for (size_t i = 0; i < n; ++i) {
      const bool seen = shift_known[i] != 0;
      move_x[i] = seen ? double{input.shift_x_mm[i]} - move_x[i] : 0;
      move_y[i] = seen ? double{input.shift_y_mm[i]} - move_y[i] : 0;
      shear_free[i] = shear_free[n + i] = pressure[i] > 0 && pressure[i] >= least_MPa ? 1 : 0;
    }
    convolution->shift_by_shear(move_x, move_y, half_x, half_y);
    shear_right = half_x;
    shear_right.insert(shear_right.end(), half_y.begin(), half_y.end());
    double rest = 0;
    result.iterations +=
        conjugate_gradients([this](const Field& of, Field& out) { shear_matrix(of, out); }, shear_right,
                            shear_free, options.tolerance, options.most_iterations, memory, shear, rest);
    if (rest > options.tolerance) result.converged = false;
    split(shear);
    convolution->depth_by_shear(half_x, half_y, shear_depth);
  }

  void measure_shear() {
    const size_t n = size();
    const double area = grid.cell_mm * grid.cell_mm;
    result.shear_x_MPa.resize(n);
    result.shear_y_MPa.resize(n);
    Wrench& wrench = result.wrench;
    for (size_t i = 0; i < n; ++i) {
      result.shear_x_MPa[i] = static_cast<float>(shear[i]);
      result.shear_y_MPa[i] = static_cast<float>(shear[n + i]);
      wrench.force_N[0] += area * shear[i];
      wrench.force_N[1] += area * shear[n + i];
      wrench.moment_Nmm[2] += area * (x_mm(i) * shear[n + i] - y_mm(i) * shear[i]);
    }
    if (!options.errors || wrench.force_N[2] <= 0) return;
    const auto error = [&](Field& solution) {
      double rest = 0, sum = 0;
      conjugate_gradients([this](const Field& of, Field& out) { shear_matrix(of, out); }, shear_right,
                          shear_free, kErrorTolerance, options.most_iterations, memory, solution, rest);
      for (size_t i = 0; i < 2 * n; ++i) sum += shear_free[i] != 0 ? shear_right[i] * solution[i] : 0;
      return options.shift_sd_mm * std::sqrt(std::max(0.0, sum) * error_patches());
    };
    std::fill(shear_right.begin(), shear_right.end(), 0);
    std::fill_n(shear_right.begin(), n, area);
    wrench.force_sd_N[0] = error(shear_errors[0]);
    std::fill_n(shear_right.begin(), n, 0);
    std::fill_n(shear_right.begin() + static_cast<std::ptrdiff_t>(n), n, area);
    wrench.force_sd_N[1] = error(shear_errors[1]);
    for (size_t i = 0; i < n; ++i) {
      shear_right[i] = -area * y_mm(i);
      shear_right[n + i] = area * x_mm(i);
    }
    wrench.moment_sd_Nmm[2] = error(shear_errors[2]);
  }

  void read(const TractionInput& input) {
    const size_t n = size();
    const auto fits = [n](size_t count) { return count == 0 || count == n; };
    const bool shift = !input.shift_x_mm.empty() || !input.shift_y_mm.empty();
    const bool given_pressure = !input.pressure_MPa.empty();
    if ((given_pressure ? input.pressure_MPa.size() : input.depth_mm.size()) != n ||
        !fits(input.contact.size()) || !fits(input.known.size()) || !fits(input.shift_x_mm.size()) ||
        !fits(input.shift_known.size()) || input.shift_x_mm.size() != input.shift_y_mm.size())
      throw Error(Failure::Input,
                  "maps of " + std::to_string(grid.width) + " x " + std::to_string(grid.height) + " cells",
                  std::to_string(input.depth_mm.size()) + " depths", "maps of the solver's grid");
    for (size_t i = 0; i < n; ++i) {
      known[i] = input.known.empty() || input.known[i] != 0 ? 1 : 0;
      allowed[i] = input.contact.empty() || input.contact[i] != 0 ? 1 : 0;
      given[i] = given_pressure  ? double{input.pressure_MPa[i]}
                 : known[i] != 0 ? double{input.depth_mm[i]}
                                 : 0;
      if (!std::isfinite(given[i]))
        throw Error(Failure::Input, "a depth of every cell that is known", "one that is not a number",
                    "leaving it out of `known`");
    }
    const bool solves = shift || !input.depth_mm.empty();
    if (solves && (!convolution || (shift && !convolution->has_shear())))
      convolution = std::make_unique<LayerConvolution>(kernel, grid.width, grid.height, shift);
    goes_on = input.goes_on && solves;
    if (goes_on && (!continuation || (shift && !continuation->has_shear())))
      continuation = std::make_unique<LayerContinuation>(kernel, grid.width, grid.height, margin, shift);
    beyond = goes_on && !input.depth_mm.empty();
    // A third of the border that the contact covers is right for half of a ball.
    if (goes_on) continuation->set_reach(std::min(static_cast<double>(margin), covered_border_cells() / 3));
    if (!shift) {
      std::fill(shear_depth.begin(), shear_depth.end(), 0);
      result.shear_x_MPa.clear();
      result.shear_y_MPa.clear();
      return;
    }
    shift_known.assign(n, 1);
    if (shear.size() != 2 * n) shear.assign(2 * n, 0);
    shear_free.resize(2 * n);
    for (size_t i = 0; i < n; ++i) {
      shift_known[i] = input.shift_known.empty() || input.shift_known[i] != 0 ? 1 : 0;
      if (shift_known[i] != 0 && !(std::isfinite(input.shift_x_mm[i]) && std::isfinite(input.shift_y_mm[i])))
        throw Error(Failure::Input, "a shift of every cell that is known", "one that is not a number",
                    "leaving it out of `shift_known`");
    }
  }

  const Traction& solve(const TractionInput& input) {
    given.resize(size());
    read(input);
    result.iterations = 0;
    const bool shift = !input.shift_x_mm.empty();
    if (!input.pressure_MPa.empty()) {
      result.residual = 0;
      result.converged = true;
      for (size_t i = 0; i < size(); ++i) pressure[i] = std::max(given[i], 0.0);
      if (shift) solve_shear(input);
      measure(input);
      return result;
    }
    double before = 0;
    for (uint32_t round = 0; round < (shift ? kRounds : 1); ++round) {
      for (size_t i = 0; i < size(); ++i) depth[i] = given[i] - shear_depth[i];
      solve_pressure();
      if (!shift) break;
      solve_shear(input);
      double sum = 0;
      for (const double p : pressure) sum += p;
      if (std::abs(sum - before) <= kSettled * sum) break;
      before = sum;
    }
    measure(input);
    return result;
  }

  TractionGrid grid;
  TractionOptions options;
  LayerKernel kernel;
  uint32_t margin;  ///< cells that a contact goes on for
  TractionWeights weights;
  double shear_prior = 0;  ///< square of what a MPa of shear is worth relative to the shift's error
  std::unique_ptr<LayerConvolution> convolution;
  std::unique_ptr<LayerContinuation> continuation;  ///< made where a contact is cut off
  bool goes_on = false;
  bool beyond = false;  ///< what goes on counts
  double cell_sd = 0;   ///< of cell_error(); 0: not found yet
  Traction result;

  Field given, pressure, depth, scratch, scratch2, right, gradient, along, image, answer, shear_depth;
  std::array<Field, 3> error_solutions, shear_errors;
  MaskedGradients memory;
  Field shear, shear_right, half_x, half_y, move_x, move_y;
  std::vector<uint8_t> allowed, active, known, shift_known, shear_free;
};

TractionSolver::TractionSolver(const Pad& pad, const TractionGrid& grid, const TractionOptions& options)
    : impl_(std::make_unique<Impl>(pad, grid, options)) {}
TractionSolver::~TractionSolver() = default;
TractionSolver::TractionSolver(TractionSolver&&) noexcept = default;

const TractionGrid& TractionSolver::grid() const {
  return impl_->grid;
}

const Traction& TractionSolver::solve(const TractionInput& input) {
  return impl_->solve(input);
}

void TractionSolver::forget() {
  std::fill(impl_->pressure.begin(), impl_->pressure.end(), 0.0);
  std::fill(impl_->shear.begin(), impl_->shear.end(), 0.0);
  std::fill(impl_->shear_depth.begin(), impl_->shear_depth.end(), 0.0);
}

}  // namespace palpate
