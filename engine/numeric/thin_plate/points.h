// Preparation of a spline's points before anything is solved: near-coincident ones merged, all centred,
// scaled and reduced to the axes that they determine.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace palpate {

/// Points' own coordinates: t = axes * (x - centre), `rank` rows that also scale.
template <size_t D>
struct PlateFrame {
  std::array<double, D> centre{};
  std::array<std::array<double, D>, D> axes{};
  uint32_t rank = 0;
};

constexpr size_t kNoGroup = static_cast<size_t>(-1);

/// Which group each point belongs to, in order of first appearance; kNoGroup where the weight is 0. Two
/// points of a group are within 2 `fraction` of the usual spacing of each other, that of the nearer half of
/// the points if they were spread evenly over their disc or ball.
template <size_t D>
std::vector<size_t> merge_points(std::span<const std::array<double, D>> points,
                                 std::span<const double> weights, double fraction);

/// Weighted means of `groups` groups.
template <size_t D>
std::vector<std::array<double, D>> group_means(std::span<const std::array<double, D>> points,
                                               std::span<const size_t> group, std::span<const double> weights,
                                               size_t groups);

/// Centre, scale and axes of the points; `flatness`: least over widest spread along principal axes.
template <size_t D>
PlateFrame<D> plate_frame(std::span<const std::array<double, D>> points, double flat_fraction,
                          double& flatness);

/// In own coordinates: rank x points.
template <size_t D>
std::vector<double> to_own(const PlateFrame<D>& frame, std::span<const std::array<double, D>> points);

}  // namespace palpate
