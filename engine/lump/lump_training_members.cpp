// The networks: what they learn from, and how far they are off on what they have not seen.
#include <algorithm>
#include <atomic>
#include <cmath>

#include "engine/lump/lump_training_parts.h"
#include "engine/lump/lump_view.h"

namespace palpate {
namespace {

using Eigen::MatrixXd;
using Eigen::MatrixXf;

constexpr double kNetworkShare = 0.6;  // of the training's time, for progress

/// One example in one of its views: a sample per load.
struct Seen {
  size_t example = 0;
  MatrixXf in;      ///< features x loads
  MatrixXd out;     ///< fields x loads, over the load
  MatrixXd whole;   ///< fields x loads
  double peak = 0;  ///< of pressure over modulus, at the highest load
  std::vector<double> loads;
};

std::vector<Seen> learn_from(const LumpModel& model, const LumpExamples& all, uint32_t threads) {
  std::vector<std::vector<Seen>> found(all.examples.size());
  in_parallel(threads, all.examples.size(), [&](size_t i) {
    const LumpExample& e = all.examples[i];
    if (!e.lump) return;
    LumpEstimate ignored;
    const auto nodes = pressed_nodes(model, all.readings[i], ignored);
    if (!nodes) return;
    const bool round = e.shape == LumpShape::Sphere || e.shape == LumpShape::Cylinder;
    for (const bool swapped : {false, true}) {
      if (!round && swapped != e.along_y) continue;
      PatchView view(model, *nodes, e.offset_mm, swapped);
      view.setting.cell_mm = e.cell_mm;
      const PatchSums sums = sum_patch(model.patch, *nodes, view);
      MatrixXd gram = sums.gram;
      gram.diagonal().array() += 1e-6 * gram.diagonal().maxCoeff();
      Seen seen;
      seen.example = i;
      seen.whole = gram.llt().solve(sums.right);
      seen.out = seen.whole;
      seen.loads = nodes->loads;
      seen.peak = nodes->total.maxCoeff();
      seen.in.resize(kLumpFeatures, seen.out.cols());
      const LumpGuess guess{e.shape, std::log(e.size_mm), std::log(e.depth_mm), std::log(e.stiffness_ratio)};
      for (Eigen::Index k = 0; k < seen.out.cols(); ++k) {
        const double load = nodes->loads[static_cast<size_t>(k)];
        seen.out.col(k) /= load;
        seen.in.col(k) = lump_features(guess, view.setting, load).cast<float>();
      }
      found[i].push_back(std::move(seen));
    }
  });
  std::vector<Seen> flat;
  for (auto& views : found)
    for (Seen& seen : views) flat.push_back(std::move(seen));
  return flat;
}

}  // namespace

void train_members(LumpModel& model, const LumpExamples& all, const LumpTrainingOptions& options,
                   LumpTrainingReport& report) {
  const std::vector<Seen> seen = learn_from(model, all, options.threads);
  Eigen::Index samples = 0;
  for (const Seen& s : seen) samples += s.out.cols();
  const Eigen::Index fields = model.patch.count();
  MatrixXf in(kLumpFeatures, samples), out(fields, samples), weight(fields, samples);
  std::vector<size_t> example_of;
  Eigen::Index at = 0;
  for (const Seen& s : seen)
    for (Eigen::Index k = 0; k < s.out.cols(); ++k, ++at) {
      in.col(at) = s.in.col(k);
      out.col(at) = s.out.col(k).cast<float>();
      // Errors count as shares of the highest load's peak: so does a sensor's noise.
      weight.col(at).setConstant(static_cast<float>(s.loads[static_cast<size_t>(k)] / s.peak));
      example_of.push_back(s.example);
    }
  model.in_mean = in.rowwise().mean();
  model.in_scale = ((in.colwise() - model.in_mean).array().square().rowwise().mean().sqrt());
  for (float& scale : model.in_scale) scale = scale > 1e-6F ? 1 / scale : 0;
  model.out_mean = out.rowwise().mean();
  model.out_scale = (out.colwise() - model.out_mean).array().square().rowwise().mean().sqrt().max(1e-9F);
  in = model.in_scale.asDiagonal() * (in.colwise() - model.in_mean);
  out = model.out_scale.cwiseInverse().asDiagonal() * (out.colwise() - model.out_mean);
  weight = model.out_scale.asDiagonal() * weight;
  // Of one size on average, so that the step suits any data.
  weight /= std::sqrt(weight.array().square().mean());

  model.members.resize(options.members);
  std::atomic<uint64_t> rounds_done = 0;
  std::atomic<bool> stop = false;
  in_parallel(options.threads, options.members, [&](size_t member) {
    std::vector<Eigen::Index> taught;
    for (size_t s = 0; s < example_of.size(); ++s)
      if (fold_of(example_of[s], options.members) != member) taught.push_back(static_cast<Eigen::Index>(s));
    SmallNetwork network =
        SmallNetwork::random({kLumpFeatures, options.hidden, options.hidden, static_cast<uint32_t>(fields)},
                             options.seed * 1000 + member);
    NetworkTraining how;
    how.rounds = options.rounds;
    how.decay = options.decay;
    how.seed = options.seed * 7919 + member;
    how.done = [&](uint32_t, double) {
      const double share =
          static_cast<double>(++rounds_done) / (options.rounds * static_cast<double>(options.members));
      if (options.progress && !options.progress("teaching the network", 0.06 + kNetworkShare * share))
        stop = true;
      return !stop;
    };
    train(network, in(Eigen::all, taught), out(Eigen::all, taught), weight(Eigen::all, taught), how);
    model.members[member] = std::move(network);
  });
  if (stop) throw Stopped();

  // Errors on unseen cases, relative to the bump; faint bumps, which noise hides anyway, count less.
  std::vector<double> sizes;
  for (const Seen& s : seen) sizes.push_back(s.whole.rightCols(1).norm());
  std::nth_element(sizes.begin(), sizes.begin() + static_cast<std::ptrdiff_t>(sizes.size() / 2), sizes.end());
  const double faint = 0.2 * sizes[sizes.size() / 2];
  MatrixXd squares = MatrixXd::Zero(fields, fields);
  double weights = 0, same = 0, cross = 0;
  double unseen_squares = 0, seen_squares = 0, unseen_count = 0;
  const auto area = static_cast<double>(model.patch.fields.cols());
  for (const Seen& s : seen) {
    const LumpExample& e = all.examples[s.example];
    LumpSetting setting;
    setting.thickness_mm = e.block_mm[2];
    const size_t first = fold_of(s.example, options.members);
    const auto bump = [&](size_t member) {
      MatrixXd predicted(fields, s.out.cols());
      const MatrixXf scaled = model.in_scale.asDiagonal() * (s.in.colwise() - model.in_mean);
      predicted =
          ((model.out_scale.asDiagonal() * model.members[member].apply(scaled)).colwise() + model.out_mean)
              .cast<double>();
      for (Eigen::Index k = 0; k < predicted.cols(); ++k) predicted.col(k) *= s.loads[static_cast<size_t>(k)];
      return predicted;
    };
    MatrixXd error = bump(first) - s.whole;
    unseen_squares += error.rightCols(1).squaredNorm() / (s.peak * s.peak * area);
    seen_squares +=
        (bump((first + 1) % options.members) - s.whole).rightCols(1).squaredNorm() / (s.peak * s.peak * area);
    unseen_count += 1;
    for (Eigen::Index k = 0; k < error.cols(); ++k)
      error.col(k) /=
          std::hypot(s.whole.col(k).norm(), faint * s.loads[static_cast<size_t>(k)] / s.loads.back());
    squares += error * error.transpose();
    weights += static_cast<double>(error.cols());
    const MatrixXd products = error.transpose() * error;
    const auto loads = static_cast<double>(error.cols());
    if (error.cols() > 1) {
      same += products.trace() / loads;
      cross += (products.sum() - products.trace()) / (loads * (loads - 1));
    }
  }
  model.discrepancy = squares / weights;
  model.load_correlation = same > 0 ? std::clamp(cross / same, 0.0, 0.98) : 0;
  report.network_error = std::sqrt(unseen_squares / unseen_count);
  report.network_error_seen = std::sqrt(seen_squares / unseen_count);
}

}  // namespace palpate
