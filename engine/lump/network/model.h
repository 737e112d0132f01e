// A lump network: the pressure without a lump, the shapes that bumps have, the network from a lump
// to its bump, and what was found about all three on cases that they had not seen.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "engine/lump/observation/observation.h"
#include "engine/numeric/mlp.h"
#include "engine/tissue/inclusion_shape.h"

namespace palpate::lump {

/// Pressure on a block without a lump, over Young's modulus: load times a polynomial of thickness and load at
/// each node of one quarter of the block.
struct Base {
  static constexpr int kTerms = 9;
  double pitch_mm = 1.25;
  uint32_t side = 17;       ///< nodes from the middle to the rim
  Eigen::MatrixXf factors;  ///< side^2 x kTerms
  double residual = 0;      ///< RMS of what it misses, fraction of the load

  static Eigen::Matrix<float, kTerms, 1> terms(double thickness_mm, double load);
  /// The quarter at a load (force over area and modulus), x fastest.
  Eigen::VectorXf quarter(double thickness_mm, double load) const;
  /// Value of a quarter's map at a place from the block's middle.
  double at(const Eigen::VectorXf& quarter, double x_mm, double y_mm) const;
};

/// Bumps around a lump's centre as sums of a few fields on a square patch.
struct Patch {
  double pitch_mm = 1;
  uint32_t side = 27;
  Eigen::MatrixXf fields;            ///< count x side^2, orthonormal rows; x fastest
  Eigen::MatrixXd along_x, along_y;  ///< the fields' slopes as sums of the fields, per mm
  /// Covariance of the fields' factors of smooth patterns: one of unit variance for each of
  /// kPatternLengths_mm, all together.
  Eigen::MatrixXd smooth_pattern;

  Eigen::Index count() const { return fields.rows(); }
  double reach_mm() const { return pitch_mm * (side - 1) / 2; }
  /// All fields at a place within reach from the centre.
  void at(double u_mm, double v_mm, float* values) const;
  /// Slopes and patterns, from the fields.
  void prepare();
};

/// Correlation lengths of what a calibration leaves of a sensor's own pattern, smooth over more than a node:
/// covariance exp(-r^2 / (2 length^2)).
inline constexpr std::array<double, 3> kPatternLengths_mm = {1.5, 3.5, 8};

/// One parameter of the lump that is estimated.
enum Parameter : uint8_t { kSize, kDepth, kRatio, kParameters };

/// Results on unseen observations of one number of loads and one noise.
struct Calibration {
  std::array<double, kParameters> inflation{1, 1, 1};  ///< of intervals, so that they hold 90 % of the truths
  double place_inflation = 1;
  double log_likelihood_ratio = 10;  ///< that one in 100 observations without a lump reaches
  double misfit = 1;                 ///< that three in 100 observations with a lump exceed, see Inference
  double rest = 2;                   ///< the same of what no sum of the patch's fields can be
  double plain_pattern = 0.01;  ///< that one in 100 observations without a lump exceeds, fraction of the peak
  // For people: relative errors of the values, and how often the shape was right.
  std::array<double, kParameters> median_error{};
  double shape_rate = 0;
  double temperature = 1;  ///< divides logarithms of likelihoods before hypotheses are weighed
};

/// Split normal distribution: two half-Gaussians of different width that meet at the mode.
struct SplitNormal {
  double middle = 0, below = 1, above = 1;  ///< standard deviations of the two halves

  /// Share of it up to a value.
  double cdf(double value) const;
};

/// The network from an observation's patch to its lump. A bump over all loads is a middle and a sum of a few
/// principal components to differ from it; their likeliest weights are what the network sees.
struct InverseNetwork {
  static constexpr Eigen::Index kOthers =
      9;  ///< further inputs: size, thickness, place, loads, noise, pattern
  /// The network also sees the posterior variance of this many first principal components.
  static constexpr Eigen::Index kOpen = 10;

  std::array<double, 4> loads{};  ///< of the principal components: force over area and modulus
  /// (loads x fields) x principal components, the bumps' factors over load at each of the loads, scaled so
  /// that bumps' weights are of unit variance; and their middle.
  Eigen::MatrixXf components;
  Eigen::VectorXf middle;
  Eigen::VectorXf in_mean, in_scale;
  std::array<double, kParameters> mean{}, scale{};  ///< of the logarithms, of the outputs
  std::vector<SmallNetwork> ensemble;               ///< the mean of their outputs is used
};

inline constexpr size_t kMethods = 2;

inline constexpr std::array<uint32_t, 3> kCalibrationLoads = {1, 2, 4};
inline constexpr std::array<double, 4> kCalibrationNoise = {0.0005, 0.003, 0.02,
                                                            0.1};  ///< shares of the peak

struct Model {
  std::array<double, 2> block_mm = {40, 40};
  double node_pitch_mm = 1.25;  ///< of observations
  // Ranges of the training set: low, high.
  std::array<double, 2> size_mm{}, depth_mm{}, ratio{}, thickness_mm{}, load{};
  double offset_mm = 0;
  double floor_mm = 1;  ///< least tissue below a lump
  double cell_mm = 1;   ///< of the grid to speak for: the finest of the training set
  std::array<bool, 4> shapes{};

  Base base;
  Patch patch;

  /// The emulator. In: see lump_features(). Out: the fields' factors over load and lump_amplitude(), scaled.
  /// The mean of all is used; each was not shown a part of the training set.
  std::vector<SmallNetwork> ensemble;
  Eigen::VectorXf in_mean, in_scale, out_mean, out_scale;

  /// Mean error of the emulator: squares of the fields' factors, where those of the bump add up to one.
  Eigen::MatrixXd discrepancy;
  double load_correlation = 0;   ///< of the discrepancy at one load with that at another
  double error_over_spread = 1;  ///< of the members' mean, over how far they differ

  InverseNetwork inverse;

  using CalibrationTable =
      std::array<std::array<Calibration, kCalibrationNoise.size()>, kCalibrationLoads.size()>;
  std::array<CalibrationTable, kMethods> calibration;  ///< by Method
  /// Factors of local_terms(), by Method and Parameter.
  std::array<std::array<std::array<double, 5>, kParameters>, kMethods> local{};
  double false_alarm_rate = 0.01;

  std::string made_from;  ///< one line for people: data, cases, seed, version
};

/// A lump as the network sees it; sizes as logarithms. `x_mm`, `y_mm`: of its centre, in the patch's axes.
struct Guess {
  InclusionShape shape = InclusionShape::Sphere;
  double log_size = 0, log_depth = 0, log_ratio = 0;
};
struct Setting {
  double thickness_mm = 20, x_mm = 0, y_mm = 0, cell_mm = 1;
};

inline constexpr int kFeatures = 16;
/// The network's inputs before scaling, and optionally how they change with log_size, log_depth, log_ratio.
Eigen::Matrix<double, kFeatures, 1> lump_features(const Guess& guess, const Setting& setting, double load,
                                                  Eigen::Matrix<double, kFeatures, 3>* changes = nullptr);

/// About how large a bump is over its load, by which the emulator's outputs are divided: stiff lumps, and
/// those that are large relative to their depth, show most. Optionally how its logarithm changes with the
/// three.
double lump_amplitude(const Guess& guess, std::array<double, 3>* changes = nullptr);

/// The fields' factors of the bump (pressure over modulus) at each load, count x loads, by one member (or the
/// mean of all: -1); `changes` (may be null) with the three logarithms.
Eigen::MatrixXd bump_factors(const Model& model, const Guess& guess, const Setting& setting,
                             const std::vector<double>& loads, int member,
                             std::array<Eigen::MatrixXd, 3>* changes = nullptr);

/// Further inputs of an interval's width: where in their ranges the estimates of size, depth and
/// ratio (logarithms) lie.
inline constexpr size_t kLocal = 5;
Eigen::Matrix<double, kLocal, 1> local_terms(const Model& model, const std::array<double, kParameters>& logs);
/// By which intervals there are wider than the table of calibration says.
double local_inflation(const Model& model, Method method, Parameter what,
                       const std::array<double, kParameters>& logs);

/// The calibration at a number of loads and a noise (fraction of the peak), between the tables' places.
Calibration calibration_at(const Model& model, Method method, size_t loads, double noise_fraction);

}  // namespace palpate::lump
