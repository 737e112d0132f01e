// Thin-plate splines against the textbook solution: the dense saddle system, solved and summed by Eigen.
#pragma once

#include <string>

namespace palpate::perf {

/// Error and run time of a spline, by points, kernel and lambda; noise of 0.002 on a smooth field over the
/// unit square or cube, 100 000 places evaluated, one core.
struct SplineStudy {
  std::string csv;
  std::string png;    ///< error against run time; empty where there is no gnuplot
  std::string words;  ///< a table for people
};

/// Medians of processor time over `repetitions` runs.
SplineStudy spline_study(int repetitions);

}  // namespace palpate::perf
