// Turns that bring a template onto itself.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace palpate {

/// Mean distance of warps that are not the same, over the template's RMS radius.
inline constexpr double kOtherWarp = 0.1;

/// Permutations by turns (with `reflections` by mirrors too) that bring the set, stretched to the same width
/// along all axes, onto itself to a fraction of its spacing: element i is the point that lies where point i
/// comes to. `most` of them at most, the identity not among them. `points`: points x axes.
std::vector<std::vector<Eigen::Index>> self_maps(const Eigen::MatrixXd& points, bool reflections,
                                                 size_t most);

}  // namespace palpate
