// Weighted least squares of slopes in double precision on the CPU: the exact solver of weighted surfaces, and
// what the GPU's answer is judged by. The same equations as engine/stages/surface/weighted_surface.h.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace palpate {

/// Faces between neighbours, from slopes at pixel centres: height differences and their weights.
/// Cell (x, y) keeps its right face in `across` and its lower one in `down`; those beyond the border have
/// weight 0.
struct WeightedFaces {
  uint32_t width = 0, height = 0;
  std::vector<double> across, down;  ///< differences, unit of the slopes times one px
  std::vector<double> across_weight, down_weight;
};

/// `gradients` is height x width x 2, `weights` height x width, at least 0. A face takes the smaller of its
/// two pixels' weights; its difference is the integral of the cubic through four pixels. Slopes of weight 0
/// are not read.
WeightedFaces weighted_faces(std::span<const float> gradients, std::span<const float> weights, uint32_t width,
                             uint32_t height);

/// Where a slope jumps (the rim of a pressed ball) samples at pixel centres do not show where between two of
/// them it does, and the heights beside would ring. There the two sides are joined by little: the face's
/// weight is taken times kKinkWeight, its difference is the mean of its two slopes, and the faces beside it
/// do not look across. A jump is where the slopes extrapolated from both sides differ by more than
/// kKinkFraction of the steepest slope and by eight times what is usual in the field, most along the line.
/// Smooth fields have none. Returns how many faces. `gradients` and `weights` as for weighted_faces.
uint64_t cut_kinks(WeightedFaces& faces, std::span<const float> gradients, std::span<const float> weights);
inline constexpr double kKinkWeight = 1e-3;
inline constexpr double kKinkFraction = 0.1;

/// Left and right side of the normal equations: A z, and b.
std::vector<double> apply(const WeightedFaces& faces, std::span<const double> z);
std::vector<double> right_side(const WeightedFaces& faces);

/// sqrt(sum w (dz - g)^2 / sum w g^2): the fraction of the slopes that heights z do not explain. 0 where all
/// slopes are 0.
double unexplained(const WeightedFaces& faces, std::span<const double> z);

struct WeightedSolution {
  std::vector<double> z;  ///< height x width
  double residual = 0;    ///< of the normal equations, relative RMS
  uint32_t iterations = 0;
  bool converged = false;
};

/// Conjugate gradients with one multigrid cycle as preconditioner, until the relative residual is below
/// `tolerance`.
WeightedSolution solve_weighted(const WeightedFaces& faces, double tolerance = 1e-10,
                                uint32_t most_iterations = 400);

}  // namespace palpate
