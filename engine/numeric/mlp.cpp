#include "engine/numeric/mlp.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <random>

#include "engine/numeric/dense.h"

namespace palpate {
namespace {

using Eigen::MatrixXf;
using Eigen::VectorXf;
using Layer = SmallNetwork::Layer;

constexpr float kKeep = 0.9F, kKeepSquares = 0.999F;  // of Adam's means

struct Means {
  MatrixXf weight, weight_squares;
  VectorXf bias, bias_squares;
};

template <typename Values>
void adam(Values& values, const Values& slope, Values& mean, Values& squares, float step) {
  mean = kKeep * mean + (1 - kKeep) * slope;
  squares.array() = kKeepSquares * squares.array() + (1 - kKeepSquares) * slope.array().square();
  values.array() -= step * mean.array() / (squares.array().sqrt() + 1e-8F);
}

}  // namespace

SmallNetwork SmallNetwork::random(const std::vector<uint32_t>& sizes, uint64_t seed) {
  SmallNetwork network;
  std::mt19937_64 random(seed);
  for (size_t l = 0; l + 1 < sizes.size(); ++l) {
    std::normal_distribution<float> normal(0, 1 / std::sqrt(static_cast<float>(sizes[l])));
    Layer layer;
    layer.weight.resize(sizes[l + 1], sizes[l]);
    for (float& w : layer.weight.reshaped()) w = normal(random);
    layer.bias = VectorXf::Zero(sizes[l + 1]);
    if (l == 0)
      for (float& b : layer.bias) b = 0.5F * normal(random);
    network.layers.push_back(std::move(layer));
  }
  return network;
}

MatrixXf SmallNetwork::apply(const MatrixXf& in) const {
  MatrixXf values = in;
  for (size_t l = 0; l < layers.size(); ++l) {
    MatrixXf next = dense::product(layers[l].weight, values).colwise() + layers[l].bias;
    if (l + 1 < layers.size()) next = next.array().tanh();
    values.swap(next);
  }
  return values;
}

MatrixXf SmallNetwork::apply(const MatrixXf& in, const std::vector<MatrixXf>& along,
                             std::vector<MatrixXf>& changes) const {
  // One product for the values and all directions: they share the weights.
  const Eigen::Index samples = in.cols(), blocks = static_cast<Eigen::Index>(along.size()) + 1;
  MatrixXf values(in.rows(), samples * blocks);
  values.leftCols(samples) = in;
  for (Eigen::Index t = 1; t < blocks; ++t)
    values.middleCols(t * samples, samples) = along[static_cast<size_t>(t - 1)];
  for (size_t l = 0; l < layers.size(); ++l) {
    MatrixXf next = dense::product(layers[l].weight, values);
    next.leftCols(samples).colwise() += layers[l].bias;
    if (l + 1 < layers.size()) {
      next.leftCols(samples) = next.leftCols(samples).array().tanh();
      const Eigen::ArrayXXf slope = 1 - next.leftCols(samples).array().square();
      for (Eigen::Index t = 1; t < blocks; ++t) next.middleCols(t * samples, samples).array() *= slope;
    }
    values.swap(next);
  }
  changes.resize(along.size());
  for (Eigen::Index t = 1; t < blocks; ++t)
    changes[static_cast<size_t>(t - 1)] = values.middleCols(t * samples, samples);
  return values.leftCols(samples);
}

void train(SmallNetwork& network, const MatrixXf& in, const NetworkLoss& loss, const NetworkTraining& how) {
  const Eigen::Index samples = in.cols();
  const Eigen::Index batch = std::min<Eigen::Index>(how.batch, samples);
  std::vector<Eigen::Index> order(static_cast<size_t>(samples));
  std::iota(order.begin(), order.end(), 0);
  std::mt19937_64 random(how.seed);
  std::vector<Means> means;
  for (const Layer& layer : network.layers)
    means.push_back({MatrixXf::Zero(layer.weight.rows(), layer.weight.cols()),
                     MatrixXf::Zero(layer.weight.rows(), layer.weight.cols()),
                     VectorXf::Zero(layer.bias.size()), VectorXf::Zero(layer.bias.size())});
  const size_t depth = network.layers.size();
  std::vector<MatrixXf> values(depth + 1);
  MatrixXf slope;
  uint64_t steps = 0;
  for (uint32_t round = 0; round < how.rounds; ++round) {
    for (size_t i = order.size(); i > 1; --i) std::swap(order[i - 1], order[random() % i]);
    const double fraction = (round + 0.5) / how.rounds;
    const double step =
        how.last_step + (how.first_step - how.last_step) * 0.5 * (1 + std::cos(std::numbers::pi * fraction));
    double error = 0;
    for (Eigen::Index first = 0; first + batch <= samples; first += batch) {
      const std::span<const Eigen::Index> now(order.data() + first, static_cast<size_t>(batch));
      values[0].resize(in.rows(), batch);
      for (Eigen::Index b = 0; b < batch; ++b) values[0].col(b) = in.col(now[static_cast<size_t>(b)]);
      for (size_t l = 0; l < depth; ++l) {
        dense::product_into(values[l + 1], network.layers[l].weight, values[l]);
        values[l + 1].colwise() += network.layers[l].bias;
        if (l + 1 < depth) values[l + 1] = values[l + 1].array().tanh();
      }
      error += loss(values[depth], now, slope);
      slope /= static_cast<float>(batch);
      ++steps;
      // Adam's means start at zero and are too small at first.
      const double steady = std::sqrt(1 - std::pow(double{kKeepSquares}, static_cast<double>(steps))) /
                            (1 - std::pow(double{kKeep}, static_cast<double>(steps)));
      const auto paced = static_cast<float>(step * steady);
      for (size_t l = depth; l-- > 0;) {
        const MatrixXf of_weight = dense::product_nt(slope, values[l]);
        const VectorXf of_bias = slope.rowwise().sum();
        if (l > 0) {
          MatrixXf below = dense::product_tn(network.layers[l].weight, slope);
          below.array() *= 1 - values[l].array().square();
          slope.swap(below);
        }
        network.layers[l].weight *= static_cast<float>(1 - step * how.decay);
        adam(network.layers[l].weight, of_weight, means[l].weight, means[l].weight_squares, paced);
        adam(network.layers[l].bias, of_bias, means[l].bias, means[l].bias_squares, paced);
      }
    }
    const auto batches = static_cast<double>(samples / batch);
    if (how.done && !how.done(round, error / (batches * static_cast<double>(batch)))) return;
  }
}

void train(SmallNetwork& network, const MatrixXf& in, const MatrixXf& wanted, const MatrixXf& weight,
           const NetworkTraining& how) {
  const NetworkLoss squares = [&](const MatrixXf& out, std::span<const Eigen::Index> samples,
                                  MatrixXf& slope) {
    slope.resize(out.rows(), out.cols());
    double sum = 0;
    for (Eigen::Index b = 0; b < out.cols(); ++b) {
      const Eigen::Index sample = samples[static_cast<size_t>(b)];
      slope.col(b) = (out.col(b) - wanted.col(sample)).array() * weight.col(sample).array();
      sum += static_cast<double>(slope.col(b).squaredNorm());
      slope.col(b).array() *= weight.col(sample).array();
    }
    return sum;
  };
  train(network, in, squares, how);
}

}  // namespace palpate
