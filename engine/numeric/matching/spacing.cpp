#include "engine/numeric/matching/spacing.h"

#include <cmath>
#include <limits>
#include <vector>

#include "engine/base/statistics.h"

namespace palpate {

using Eigen::Index;
using Eigen::MatrixXd;

double median_spacing(const MatrixXd& points) {
  std::vector<double> nearest;
  for (Index i = 0; i < points.rows(); ++i) {
    Eigen::VectorXd d = (points.rowwise() - points.row(i)).rowwise().squaredNorm();
    d[i] = std::numeric_limits<double>::infinity();
    nearest.push_back(d.minCoeff());
  }
  return std::sqrt(median(std::move(nearest)));
}

}  // namespace palpate
