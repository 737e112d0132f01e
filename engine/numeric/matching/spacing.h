// How far the points of a set lie from each other.
#pragma once

#include <Eigen/Core>

namespace palpate {

/// Distance to the nearest other point, median.
double median_spacing(const Eigen::MatrixXd& points);

}  // namespace palpate
