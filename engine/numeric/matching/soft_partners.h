// Soft partners by distance: how close each template point is to each target point, shared out so that no
// point is given twice.
#pragma once

#include <Eigen/Core>

namespace palpate {

/// exp(-squared distance / (2 variance) + likeness), n x m. `variance`: of each template point; an empty
/// likeness is none.
void set_closeness(const Eigen::MatrixXd& from, const Eigen::MatrixXf& to, const Eigen::VectorXd& variance,
                   const Eigen::MatrixXf& likeness, Eigen::MatrixXf& result);

/// The nil partners make the sets differ in what they share out: rows and columns each add up to 1 with their
/// nil. Sinkhorn's iteration, warm from the last one.
void balance(float column_nil, float row_nil, Eigen::VectorXf& row_factor, Eigen::MatrixXf& p);

}  // namespace palpate
