// The networks: what they learn from, and how far they are off on what they have not seen.
#include <algorithm>
#include <atomic>
#include <cmath>
#include <map>

#include "engine/base/statistics.h"
#include "engine/base/text.h"
#include "engine/lump/network/view.h"
#include "engine/numeric/dense.h"
#include "palpate/error.h"
#include "perf/lab/training/steps.h"

namespace palpate::lump {
namespace {

using Eigen::MatrixXd;
using Eigen::MatrixXf;

constexpr double kNetworkFraction = 0.34;  // of the training's time, for progress
constexpr size_t kPlainOfEachSize = 6;
constexpr double kFaint = 0.004;  // of the peak, RMS over the patch

/// One example in one of its views: a sample per load.
struct Seen {
  size_t example = 0;
  MatrixXf in;     ///< features x loads
  MatrixXd out;    ///< fields x loads, over load and amplitude
  MatrixXd whole;  ///< fields x loads
  double amplitude = 1;
  double peak = 0;  ///< of pressure over modulus, at the highest load
  std::vector<double> loads;
};

/// The model with the pressure without a lump as each size of cells has it, by that size.
std::map<double, Model> bases_by_cells(const Model& model, const Examples& all) {
  std::map<double, Model> models;
  for (const Example& e : all.examples) models.emplace(e.cell_mm, model);
  for (auto& [cell_mm, own] : models) {
    size_t plain = 0;
    for (const Example& e : all.examples) plain += !e.lump && e.cell_mm == cell_mm;
    if (plain < kPlainOfEachSize)
      throw Error(Failure::Input,
                  std::to_string(kPlainOfEachSize) + " blocks without a lump of cells of each size",
                  text("%zu of cells of %.3g mm", plain, cell_mm), "palpate-lab dataset with more cases");
    own.base =
        fit_base(model, all, [&, cell_mm = cell_mm](size_t i) { return all.examples[i].cell_mm == cell_mm; });
  }
  return models;
}

std::vector<Seen> learn_from(const Model& model, const Examples& all, uint32_t threads) {
  const std::map<double, Model> by_cells = bases_by_cells(model, all);
  std::vector<std::vector<Seen>> found(all.examples.size());
  in_parallel(threads, all.examples.size(), [&](size_t i) {
    const Example& e = all.examples[i];
    if (!e.lump) return;
    Estimate ignored;
    const Model& own = by_cells.at(e.cell_mm);
    const auto nodes = pressed_nodes(own, all.observations[i], ignored);
    if (!nodes) return;
    const bool round = e.shape == InclusionShape::Sphere || e.shape == InclusionShape::Cylinder;
    for (const bool swapped : {false, true}) {
      if (!round && swapped != e.along_y) continue;
      PatchView view(model, *nodes, e.offset_mm, swapped);
      view.setting.cell_mm = e.cell_mm;
      const PatchSums sums = sum_patch(model.patch, *nodes, view);
      MatrixXd gram = sums.gram;
      gram.diagonal().array() += 1e-6 * gram.diagonal().maxCoeff();
      Seen seen;
      seen.example = i;
      seen.whole = dense::Cholesky(gram).solve(sums.right);
      seen.out = seen.whole;
      seen.loads = nodes->loads;
      seen.peak = nodes->total.maxCoeff();
      seen.in.resize(kFeatures, seen.out.cols());
      const Guess guess{e.shape, std::log(e.size_mm), std::log(e.depth_mm), std::log(e.stiffness_ratio)};
      seen.amplitude = lump_amplitude(guess);
      for (Eigen::Index k = 0; k < seen.out.cols(); ++k) {
        const double load = nodes->loads[static_cast<size_t>(k)];
        seen.out.col(k) /= load * seen.amplitude;
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

/// A member's bumps of a sample, fields x loads; -1: the mean of all.
MatrixXd bumps_of(const Model& model, const Seen& s, int member) {
  const MatrixXf scaled = model.in_scale.asDiagonal() * (s.in.colwise() - model.in_mean);
  const size_t first = member < 0 ? 0 : static_cast<size_t>(member),
               last = member < 0 ? model.ensemble.size() : first + 1;
  MatrixXf sum = MatrixXf::Zero(s.out.rows(), s.out.cols());
  for (size_t m = first; m < last; ++m)
    sum += model.ensemble[m].apply(scaled) / static_cast<float>(last - first);
  MatrixXd bumps = ((model.out_scale.asDiagonal() * sum).colwise() + model.out_mean).cast<double>();
  for (Eigen::Index k = 0; k < bumps.cols(); ++k)
    bumps.col(k) *= s.amplitude * s.loads[static_cast<size_t>(k)];
  return bumps;
}

/// Squares of errors, relative to the bump.
struct ErrorSum {
  MatrixXd squares;
  double weights = 0, same = 0, cross = 0;

  /// Faint bumps, which noise hides anyway, count less.
  void add(const Seen& s, MatrixXd error, double faint) {
    for (Eigen::Index k = 0; k < error.cols(); ++k)
      error.col(k) /=
          std::hypot(s.whole.col(k).norm(), faint * s.loads[static_cast<size_t>(k)] / s.loads.back());
    if (squares.size() == 0) squares = MatrixXd::Zero(error.rows(), error.rows());
    squares += dense::product_nt(error, error);
    const auto loads = static_cast<double>(error.cols());
    weights += loads;
    if (error.cols() < 2) return;
    const MatrixXd products = dense::product_tn(error, error);
    same += products.trace() / loads;
    cross += (products.sum() - products.trace()) / (loads * (loads - 1));
  }
};

/// How far the mean of all is off on blocks that none has seen, and how that goes with how far they differ.
void judge_members(Model& model, const Examples& all, const std::vector<Seen>& seen, TrainingReport& report) {
  std::vector<double> sizes;
  sizes.reserve(seen.size());
  for (const Seen& s : seen) sizes.push_back(s.whole.rightCols(1).norm());
  const double faint = 0.2 * median(std::move(sizes));
  const auto area = static_cast<double>(model.patch.fields.cols());
  const auto of_peak = [area](const Seen& s, const MatrixXd& error) {
    return error.rightCols(1).squaredNorm() / (s.peak * s.peak * area);
  };
  struct Unseen {
    const Seen* seen;
    MatrixXd error;
    double fraction = 0;  ///< of the peak, RMS over the patch at the highest load
  };
  std::vector<Unseen> unseen;
  std::vector<double> log_ratios;
  double unseen_squares = 0, seen_squares = 0, trained = 0;
  for (const Seen& s : seen) {
    const MatrixXd mean = bumps_of(model, s, -1), error = mean - s.whole;
    if (!all.finest(s.example)) continue;
    if (!all.aside(s.example)) {
      seen_squares += of_peak(s, error);
      trained += 1;
      continue;
    }
    unseen_squares += of_peak(s, error);
    unseen.push_back({&s, error, std::sqrt(of_peak(s, error))});
    double spread = 0;
    for (size_t m = 0; m < model.ensemble.size(); ++m)
      spread += of_peak(s, bumps_of(model, s, static_cast<int>(m)) - mean) /
                static_cast<double>(model.ensemble.size() - 1);
    log_ratios.push_back(std::log(std::max(1e-300, of_peak(s, error)) / std::max(1e-300, spread)));
  }
  const auto aside = static_cast<double>(unseen.size());
  std::sort(unseen.begin(), unseen.end(),
            [](const Unseen& a, const Unseen& b) { return a.fraction < b.fraction; });
  report.mean_error = unseen[unseen.size() / 2].fraction;
  // A few blocks at the edges of what was trained are off by ten times what others are: they must not speak
  // for all.
  ErrorSum sum;
  for (const Unseen& u : unseen) {
    const double extreme = std::max(1.0, u.fraction / (3 * report.mean_error));
    sum.add(*u.seen, u.error / extreme, faint);
  }
  model.discrepancy = sum.squares / sum.weights;
  const dense::SymmetricEigen eigen = dense::symmetric_eigen(model.discrepancy);
  const double least = 0.05 * model.discrepancy.trace() / static_cast<double>(model.discrepancy.rows());
  model.discrepancy = dense::spectral(eigen.vectors, eigen.values.cwiseMax(least));
  model.load_correlation = sum.same > 0 ? std::clamp(sum.cross / sum.same, 0.0, 0.98) : 0;
  std::sort(log_ratios.begin(), log_ratios.end());
  model.error_over_spread = std::exp(0.5 * log_ratios[log_ratios.size() / 2]);
  for (size_t i = 0; i < all.examples.size(); ++i) report.kept_aside += all.examples[i].lump && all.aside(i);
  report.network_error = std::sqrt(unseen_squares / aside);
  report.network_error_seen = std::sqrt(seen_squares / trained);
  report.error_over_spread = model.error_over_spread;
}

}  // namespace

void train_ensemble(Model& model, const Examples& all, const TrainingOptions& options,
                    TrainingReport& report) {
  const std::vector<Seen> seen = learn_from(model, all, options.threads);
  Eigen::Index samples = 0;
  for (const Seen& s : seen)
    if (!all.aside(s.example)) samples += s.out.cols();
  const Eigen::Index fields = model.patch.count();
  MatrixXf in(kFeatures, samples), out(fields, samples), weight(fields, samples);
  Eigen::Index at = 0;
  for (const Seen& s : seen) {
    if (all.aside(s.example)) continue;
    for (Eigen::Index k = 0; k < s.out.cols(); ++k, ++at) {
      in.col(at) = s.in.col(k);
      out.col(at) = s.out.col(k).cast<float>();
      // Errors count as shares of the bump, which its lump is told by, down to what a good sensor's own
      // pattern hides.
      const double bump = s.whole.rightCols(1).norm() / static_cast<double>(model.patch.side);
      weight.col(at).setConstant(static_cast<float>(s.loads[static_cast<size_t>(k)] * s.amplitude /
                                                    std::hypot(bump, kFaint * s.peak)));
    }
  }
  model.in_mean = in.rowwise().mean();
  model.in_scale = ((in.colwise() - model.in_mean).array().square().rowwise().mean().sqrt());
  for (float& scale : model.in_scale) scale = scale > 1e-6F ? 1 / scale : 0;
  model.out_mean = out.rowwise().mean();
  model.out_scale = (out.colwise() - model.out_mean).array().square().rowwise().mean().sqrt().max(1e-9F);
  in = model.in_scale.asDiagonal() * (in.colwise() - model.in_mean);
  out = model.out_scale.cwiseInverse().asDiagonal() * (out.colwise() - model.out_mean);
  weight = model.out_scale.asDiagonal() * weight;
  // Unit mean square, so that the step suits any data.
  weight /= std::sqrt(weight.array().square().mean());

  model.ensemble.resize(options.ensemble);
  std::atomic<uint64_t> rounds_done = 0;
  std::atomic<bool> stop = false;
  in_parallel(options.threads, options.ensemble, [&](size_t member) {
    SmallNetwork network =
        SmallNetwork::random({kFeatures, options.hidden, options.hidden, static_cast<uint32_t>(fields)},
                             options.seed * 1000 + member);
    NetworkTraining how;
    how.rounds = options.rounds;
    how.decay = options.decay;
    how.seed = options.seed * 7919 + member;
    how.done = [&](uint32_t, double) {
      const double fraction =
          static_cast<double>(++rounds_done) / (options.rounds * static_cast<double>(options.ensemble));
      if (options.progress && !options.progress("teaching the network", 0.06 + kNetworkFraction * fraction))
        stop = true;
      return !stop;
    };
    train(network, in, out, weight, how);
    model.ensemble[member] = std::move(network);
  });
  if (stop) throw Stopped();

  judge_members(model, all, seen, report);
}

}  // namespace palpate::lump
