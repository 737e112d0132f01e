// A small network of fully connected layers: smooth functions of a few numbers, learnt from samples.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

namespace palpate {

/// tanh between layers, none after the last. Samples are columns.
struct SmallNetwork {
  struct Layer {
    Eigen::MatrixXf weight;  ///< outputs x inputs
    Eigen::VectorXf bias;
  };
  std::vector<Layer> layers;

  /// Random weights of the usual size, deterministic by seed. `sizes`: inputs, hidden ..., outputs.
  static SmallNetwork random(const std::vector<uint32_t>& sizes, uint64_t seed);

  uint32_t inputs() const { return static_cast<uint32_t>(layers.front().weight.cols()); }
  uint32_t outputs() const { return static_cast<uint32_t>(layers.back().weight.rows()); }

  Eigen::MatrixXf apply(const Eigen::MatrixXf& in) const;
  /// The same, and how the outputs change along directions of the inputs: `along[t]` inputs x samples each,
  /// `changes[t]` outputs x samples.
  Eigen::MatrixXf apply(const Eigen::MatrixXf& in, const std::vector<Eigen::MatrixXf>& along,
                        std::vector<Eigen::MatrixXf>& changes) const;
};

struct NetworkTraining {
  uint32_t rounds = 300;  ///< through all samples
  uint32_t batch = 128;
  double first_step = 4e-3, last_step = 1e-5;  ///< of Adam; falls as a cosine
  double decay = 0;                            ///< by which weights shrink, times the step
  uint64_t seed = 1;
  /// Told after each round, with the mean loss of its samples; false: stop here.
  std::function<bool(uint32_t round, double error)> done = {};
};

/// Loss, summed over a batch: `out` outputs x batch, of the samples with these numbers.
/// Sets `slope` (outputs x batch) to how the sum changes with each output.
using NetworkLoss = std::function<double(const Eigen::MatrixXf& out, std::span<const Eigen::Index> samples,
                                         Eigen::MatrixXf& slope)>;
/// By Adam. Samples beyond the last whole batch of a round wait for another round's order.
void train(SmallNetwork& network, const Eigen::MatrixXf& in, const NetworkLoss& loss,
           const NetworkTraining& how);
/// Least squares, sum over samples and outputs of (weight(output, sample) (network - wanted))^2.
void train(SmallNetwork& network, const Eigen::MatrixXf& in, const Eigen::MatrixXf& wanted,
           const Eigen::MatrixXf& weight, const NetworkTraining& how);

}  // namespace palpate
