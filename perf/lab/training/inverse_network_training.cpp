// The network from observations to lumps learns from observations that the emulator makes: lumps of a sweep
// that no data set holds, in windows and with noise of all kinds, off by what the emulator is known to be
// off.
#include <algorithm>
#include <atomic>
#include <cmath>
#include <numeric>
#include <random>

#include "engine/lump/network/inverse_network.h"
#include "engine/lump/observation/fixed_pattern.h"
#include "engine/lump/observation/saturated_loads.h"
#include "engine/numeric/dense.h"
#include "perf/lab/dataset/sweep.h"
#include "perf/lab/training/steps.h"

namespace palpate::lump {
namespace {

using Eigen::MatrixXd;
using Eigen::MatrixXf;
using Eigen::VectorXd;

constexpr double kMadeFrom = 0.4, kMade = 0.15, kTaught = 0.25;  // shares of the training, for progress
constexpr std::array<double, 2> kNoise = {3e-4, 0.15};           // of the peak
constexpr std::array<double, 2> kTaughtPattern = {1e-4, 1e-2};   // of the peak
constexpr double kSaturated = 0.25;  // of the observations: a bump without its top
constexpr double kNear_mm = 0.25;    // of patches that the network has moved to their lumps already
constexpr double kEverywhere = 0.3;  // of the typical discrepancy
constexpr uint32_t kWayBumps = 4000;
constexpr double kPatchShift_mm = 0.5;  // of those

/// Lumps as the data sets have them.
Sweep sweep_of(const Model& model, uint64_t seed) {
  Sweep sweep;
  sweep.seed = seed;
  sweep.size_mm = {model.size_mm[0], model.size_mm[1]};
  sweep.depth_mm = {model.depth_mm[0], model.depth_mm[1]};
  sweep.stiffness_ratio = {model.ratio[0], model.ratio[1]};
  sweep.thickness_mm = {model.thickness_mm[0], model.thickness_mm[1]};
  sweep.block_mm = model.block_mm;
  sweep.offset_mm = model.offset_mm;
  sweep.floor_mm = model.floor_mm;
  sweep.centred_fraction = 0.3;
  sweep.no_lump_fraction = 0;
  sweep.shapes.clear();
  for (size_t s = 0; s < model.shapes.size(); ++s)
    if (model.shapes[s]) sweep.shapes.push_back(static_cast<InclusionShape>(s));
  return sweep;
}

Setting setting_of(const Model& model, const Case& what) {
  Setting setting;
  setting.thickness_mm = what.thickness_mm;
  setting.cell_mm = model.cell_mm;
  setting.x_mm = std::abs(what.lump->offset_mm[what.lump->along_y ? 1 : 0]);
  setting.y_mm = std::abs(what.lump->offset_mm[what.lump->along_y ? 0 : 1]);
  return setting;
}

Guess guess_of(const Case::Lump& lump) {
  return {lump.shape, std::log(lump.diameter_mm), std::log(lump.depth_mm), std::log(lump.stiffness_ratio)};
}

/// Factors of a bump to those of the same bump across the patch.
MatrixXd transposition(const Patch& patch) {
  const auto n = static_cast<Eigen::Index>(patch.side);
  MatrixXf turned(patch.fields.rows(), patch.fields.cols());
  for (Eigen::Index j = 0; j < n; ++j)
    for (Eigen::Index i = 0; i < n; ++i) turned.col(j * n + i) = patch.fields.col(i * n + j);
  return dense::product_nt(patch.fields, turned).cast<double>();
}

/// Moves a bump's factors by a little.
MatrixXd moved(const Patch& patch, const MatrixXd& factors, double u_mm, double v_mm) {
  const MatrixXd shift = u_mm * patch.along_x + v_mm * patch.along_y;
  const MatrixXd once = dense::product(shift, factors);
  return factors - once + 0.5 * dense::product(shift, once);
}

/// A simulated observation with its truth.
struct Made {
  PressedNodes nodes;
  Eigen::MatrixXd bump;  ///< of nodes.rest, as the emulators' mean has it
  Case what;
};

class ObservationMaker {
 public:
  ObservationMaker(const Model& model, uint64_t seed)
      : model_(model), sweep_(sweep_of(model, seed)), seed_(seed) {
    const dense::SymmetricEigen eigen = dense::symmetric_eigen(model.discrepancy);
    discrepancy_root_ = eigen.vectors * eigen.values.cwiseMax(0).cwiseSqrt().asDiagonal();
  }

  Case lump(uint32_t number) const { return lump_case(sweep_, number); }
  std::mt19937_64 random(uint32_t number) const {
    std::seed_seq mixed{static_cast<uint32_t>(seed_), static_cast<uint32_t>(seed_ >> 32), number};
    return std::mt19937_64(mixed);
  }
  Made make(uint32_t number, std::mt19937_64& random) const;

 private:
  void choose_nodes(Made& made, std::mt19937_64& random) const;
  void add_pattern(PressedNodes& nodes, std::mt19937_64& random) const;
  std::vector<double> choose_loads(std::mt19937_64& random) const;

  const Model& model_;
  Sweep sweep_;
  uint64_t seed_;
  MatrixXd discrepancy_root_;
};

void ObservationMaker::choose_nodes(Made& made, std::mt19937_64& random) const {
  std::uniform_real_distribution<double> share(0, 1);
  const double pitch = model_.node_pitch_mm;
  std::array<double, 2> window = {40, 30}, middle = {0, 0};
  const double kind = share(random);
  if (kind > 0.75) {
    window = {24 + 16 * share(random), 18 + 22 * share(random)};
    // The lump's centre lies in the middle half of a small window.
    for (size_t c = 0; c < 2; ++c)
      middle[c] = made.what.lump->offset_mm[c] + (share(random) - 0.5) * window[c] / 2;
  } else if (kind > 0.5) {
    window = model_.block_mm;
  }
  const auto steps = [pitch](double length) { return std::floor((length / 2 - pitch / 2) / pitch); };
  for (double j = -steps(window[1]); j <= steps(window[1]); ++j)
    for (double i = -steps(window[0]); i <= steps(window[0]); ++i) {
      const double x = middle[0] + i * pitch, y = middle[1] + j * pitch;
      if (std::abs(x) > model_.block_mm[0] / 2 - pitch || std::abs(y) > model_.block_mm[1] / 2 - pitch)
        continue;
      made.nodes.x_mm.push_back(x);
      made.nodes.y_mm.push_back(y);
    }
}

std::vector<double> ObservationMaker::choose_loads(std::mt19937_64& random) const {
  std::uniform_real_distribution<double> share(0, 1);
  const auto [least, most] = model_.load;
  // Light presses too: of a press whose highest loads are saturated only the first ones are left.
  const double last = std::max(1.2 * least, most * (0.1 + 0.9 * share(random)));
  constexpr std::array<uint32_t, 8> kCounts = {1, 1, 2, 2, 3, 4, 4, 6};
  const uint32_t count = kCounts[random() % kCounts.size()];
  std::vector<double> loads;
  for (uint32_t k = 1; k <= count; ++k) {
    // Steps of the press are even, and forces rise faster than it; a little beside the even ones.
    const double at = (k == count ? 1 : (k - 0.4 + 0.8 * (share(random) - 0.5)) / count);
    const double load = last * at * (0.8 + 0.2 * at);
    if (load >= least) loads.push_back(load);
  }
  return loads;
}

/// The highest values of the highest load as a saturated sensor sees them: not at all.
void hide_top(Made& made, double fraction) {
  PressedNodes& nodes = made.nodes;
  const auto count = nodes.x_mm.size(),
             kept = count - static_cast<size_t>(fraction * static_cast<double>(count));
  std::vector<Eigen::Index> by_height(count);
  std::iota(by_height.begin(), by_height.end(), 0);
  const VectorXd highest = nodes.total.rightCols(1);
  std::sort(by_height.begin(), by_height.end(),
            [&](Eigen::Index a, Eigen::Index b) { return highest(a) < highest(b); });
  nodes.peak = highest(by_height[kept - 1]);
  nodes.noise_fraction = nodes.noise / nodes.peak;
  by_height.resize(kept);
  std::sort(by_height.begin(), by_height.end());
  for (size_t n = 0; n < kept; ++n) {
    nodes.x_mm[n] = nodes.x_mm[static_cast<size_t>(by_height[n])];
    nodes.y_mm[n] = nodes.y_mm[static_cast<size_t>(by_height[n])];
  }
  nodes.x_mm.resize(kept);
  nodes.y_mm.resize(kept);
  nodes.rest = nodes.rest(by_height, Eigen::all).eval();
  nodes.total = nodes.total(by_height, Eigen::all).eval();
  made.bump = made.bump(by_height, Eigen::all).eval();
}

/// Adds the same pattern to all loads.
void ObservationMaker::add_pattern(PressedNodes& nodes, std::mt19937_64& random) const {
  std::uniform_real_distribution<double> share(0, 1);
  const double size =
      nodes.peak * kTaughtPattern[0] * std::pow(kTaughtPattern[1] / kTaughtPattern[0], share(random));
  const PatternKind kind = any_pattern(random);
  const auto [left, right] = std::minmax_element(nodes.x_mm.begin(), nodes.x_mm.end());
  const auto [up, down] = std::minmax_element(nodes.y_mm.begin(), nodes.y_mm.end());
  const double pitch = model_.node_pitch_mm, x0 = *left, y0 = *up;
  const auto along = [pitch](double from, double to) {
    return static_cast<Eigen::Index>(std::lround((to - from) / pitch));
  };
  const Eigen::MatrixXd pattern =
      size * fixed_pattern(static_cast<uint32_t>(along(x0, *right) + 1),
                           static_cast<uint32_t>(along(y0, *down) + 1), pitch, kind.length_mm, random);
  for (Eigen::Index n = 0; n < nodes.total.rows(); ++n) {
    const auto i = static_cast<size_t>(n);
    const double here = pattern(along(y0, nodes.y_mm[i]), along(x0, nodes.x_mm[i]));
    for (Eigen::Index k = 0; k < nodes.total.cols(); ++k) {
      const double off = kind.gain ? here * nodes.total(n, k) / nodes.peak : here;
      nodes.rest(n, k) += off;
      nodes.total(n, k) += off;
    }
  }
}

Made ObservationMaker::make(uint32_t number, std::mt19937_64& random) const {
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> share(0, 1);
  Made made;
  made.what = lump(number);
  const Case::Lump& lump = *made.what.lump;
  choose_nodes(made, random);
  PressedNodes& nodes = made.nodes;
  nodes.loads = choose_loads(random);
  nodes.thickness_mm = made.what.thickness_mm;
  const auto count = static_cast<Eigen::Index>(nodes.x_mm.size()),
             loads = static_cast<Eigen::Index>(nodes.loads.size());
  PatchView view(model_, nodes, lump.offset_mm, lump.along_y);
  std::vector<MatrixXd> of_member;
  for (size_t m = 0; m < model_.ensemble.size(); ++m)
    of_member.push_back(bump_factors(model_, guess_of(lump), view.setting, nodes.loads, static_cast<int>(m)));
  MatrixXd mean = of_member.front();
  for (size_t m = 1; m < of_member.size(); ++m) mean += of_member[m];
  const auto ensemble = static_cast<double>(of_member.size());
  mean /= ensemble;
  // The mean is off where members differ, and a little everywhere.
  MatrixXd factors = mean;
  for (const MatrixXd& own : of_member)
    factors += model_.error_over_spread / std::sqrt(ensemble - 1) * normal(random) * (own - mean);
  const auto some = [&] {
    VectorXd values(factors.rows());
    for (double& value : values) value = normal(random);
    return values;
  };
  const VectorXd common = some();
  for (Eigen::Index k = 0; k < loads; ++k) {
    const VectorXd error = discrepancy_root_ * (std::sqrt(model_.load_correlation) * common +
                                                std::sqrt(1 - model_.load_correlation) * some());
    factors.col(k) += kEverywhere * mean.col(k).norm() * error;
  }
  nodes.rest = made.bump = MatrixXd::Zero(count, loads);
  nodes.total.resize(count, loads);
  const double reach = model_.patch.reach_mm();
  Eigen::VectorXf fields(model_.patch.count());
  for (Eigen::Index n = 0; n < count; ++n) {
    const auto [u, v] = view.to_patch(nodes.x_mm[static_cast<size_t>(n)], nodes.y_mm[static_cast<size_t>(n)]);
    if (std::abs(u) > reach || std::abs(v) > reach) continue;
    model_.patch.at(u, v, fields.data());
    nodes.rest.row(n) = fields.cast<double>().transpose() * factors;
    made.bump.row(n) = fields.cast<double>().transpose() * mean;
  }
  for (Eigen::Index k = 0; k < loads; ++k) {
    const Eigen::VectorXf quarter =
        model_.base.quarter(nodes.thickness_mm, nodes.loads[static_cast<size_t>(k)]);
    for (Eigen::Index n = 0; n < count; ++n) {
      const auto i = static_cast<size_t>(n);
      nodes.total(n, k) = nodes.rest(n, k) + model_.base.at(quarter, nodes.x_mm[i], nodes.y_mm[i]);
    }
  }
  nodes.noise_fraction = kNoise[0] * std::pow(kNoise[1] / kNoise[0], share(random));
  nodes.peak = nodes.total.rightCols(1).maxCoeff();
  nodes.noise = nodes.noise_fraction * nodes.peak;
  add_pattern(nodes, random);
  if (share(random) < kSaturated) hide_top(made, kMostSaturation * share(random));
  const double modulus = kModulusFraction * normal(random);
  for (Eigen::Index k = 0; k < loads; ++k) {
    const double scale = modulus + kGaugeFraction * normal(random);
    for (Eigen::Index n = 0; n < nodes.total.rows(); ++n) {
      const double off = scale * nodes.total(n, k) + nodes.noise * normal(random);
      nodes.rest(n, k) += off;
      nodes.total(n, k) += off;
    }
  }
  return made;
}

/// How bumps differ: fills loads, principal components and middle.
void find_components(InverseNetwork& inverse, const Model& model, const ObservationMaker& maker,
                     uint32_t components) {
  const auto [least, most] = model.load;
  inverse.loads = {least, least + (most - least) / 4, least + (most - least) * 0.6, most};
  const std::vector<double> loads(inverse.loads.begin(), inverse.loads.end());
  const Eigen::Index fields = model.patch.count(), rows = 4 * fields;
  const MatrixXd turn = transposition(model.patch);
  MatrixXd bumps(rows, kWayBumps);
  for (uint32_t i = 0; i < kWayBumps; ++i) {
    std::mt19937_64 random = maker.random(i);
    std::uniform_real_distribution<double> any(-kPatchShift_mm, kPatchShift_mm);
    const Case what = maker.lump(i);
    MatrixXd factors = bump_factors(model, guess_of(*what.lump), setting_of(model, what), loads, -1);
    const double u = any(random), v = any(random);
    factors = moved(model.patch, factors, u, v);
    if (i % 2 == 1) factors = dense::product(turn, factors);
    for (Eigen::Index q = 0; q < 4; ++q)
      bumps.col(i).segment(q * fields, fields) = factors.col(q) / loads[static_cast<size_t>(q)];
    // Faint bumps have their own principal components, which must not drown in those of large ones.
    bumps.col(i) /= std::sqrt(std::max(1e-12, bumps.col(i).norm()));
  }
  const VectorXd middle = bumps.rowwise().mean();
  bumps.colwise() -= middle;
  const MatrixXd covariance = dense::product_nt(bumps, bumps) / static_cast<double>(kWayBumps);
  const dense::SymmetricEigen eigen = dense::symmetric_eigen(covariance);
  const Eigen::Index kept = std::min<Eigen::Index>(components, rows);
  inverse.components = (eigen.vectors.rightCols(kept).rowwise().reverse() *
                        eigen.values.tail(kept).reverse().cwiseMax(1e-20).cwiseSqrt().asDiagonal())
                           .cast<float>();
  inverse.middle = middle.cast<float>();
}

/// Training example made of a simulated observation.
struct Lesson {
  Eigen::Index output = 0;  ///< class, see reader_output
  size_t shape = 0;
  std::array<float, kParameters> logs{};  ///< scaled
  std::array<float, 2> shift_mm{};
};

/// Loss of -log of a bell at `off` from its middle, with slopes.
double bell_loss(float off, float log_below, float log_above, float* slopes) {
  const float below = std::exp(log_below), above = std::exp(log_above), half = off < 0 ? below : above;
  const float z = off / half;
  slopes[0] = -z / half;
  slopes[1] = below / (below + above) - (off < 0 ? z * z : 0);
  slopes[2] = above / (below + above) - (off < 0 ? 0 : z * z);
  return static_cast<double>(std::log(below + above) + 0.5F * z * z);
}

double lesson_loss(const Lesson& lesson, const Eigen::Ref<const Eigen::VectorXf>& out,
                   Eigen::Ref<Eigen::VectorXf> slope) {
  namespace at = reader_output;
  slope.setZero();
  const auto classes = out.head(at::kClasses);
  const float most = classes.maxCoeff();
  Eigen::Array<float, at::kClasses, 1> probability = (classes.array() - most).exp();
  probability /= probability.sum();
  slope.head(at::kClasses) = probability;
  slope(lesson.output) -= 1;
  double loss = -std::log(std::max(1e-12, static_cast<double>(probability(lesson.output))));
  for (size_t p = 0; p < kParameters; ++p) {
    const auto first = at::kBells + 3 * static_cast<Eigen::Index>(kParameters * lesson.shape + p);
    loss += bell_loss(lesson.logs[p] - out(first), out(first + 1), out(first + 2), &slope(first));
  }
  for (size_t axis = 0; axis < 2; ++axis) {
    const auto place = at::kShift + static_cast<Eigen::Index>(axis);
    const float sd = std::exp(out(place + 2)), z = (lesson.shift_mm[axis] - out(place)) / sd;
    slope(place) = -z / sd;
    slope(place + 2) = 1 - z * z;
    loss += static_cast<double>(out(place + 2) + 0.5F * z * z);
  }
  // One surprise must not turn everything over.
  const float norm = slope.norm();
  constexpr float kLargest = 30;
  if (norm > kLargest) slope *= kLargest / norm;
  return loss;
}

/// Scales of the logarithms of a lump's parameters: those of their ranges.
void scale_parameters(InverseNetwork& inverse, const Model& model) {
  const std::array<std::array<double, 2>, kParameters> ranges = {model.size_mm, model.depth_mm, model.ratio};
  for (size_t p = 0; p < kParameters; ++p) {
    inverse.mean[p] = 0.5 * (std::log(ranges[p][0]) + std::log(ranges[p][1]));
    inverse.scale[p] = std::max(0.05, (std::log(ranges[p][1]) - std::log(ranges[p][0])) / std::sqrt(12.0));
  }
}

/// An observation's features, and what they teach.
Lesson make_lesson(const Model& model, const ObservationMaker& maker, uint32_t number,
                   Eigen::Ref<Eigen::VectorXf> features) {
  std::mt19937_64 random = maker.random(number);
  std::normal_distribution<double> normal;
  const Made made = maker.make(number, random);
  const Case::Lump& lump = *made.what.lump;
  const bool round = lump.shape == InclusionShape::Sphere || lump.shape == InclusionShape::Cylinder;
  std::array<double, 2> place = lump.offset_mm;
  bool across = random() % 3 == 0;
  if (random() % 2 == 0) {
    place = find_bump(model, made.nodes);
  } else {
    for (double& along : place) along += kNear_mm * normal(random);
  }
  const PatchView view(model, made.nodes, place, round ? across : lump.along_y != across);
  PatchObservation patch(model, made.nodes, view);
  PressedNodes known = made.nodes;
  known.rest = made.bump;
  patch.set_pattern(pattern_sizes(patch.errors, made.nodes,
                                  patch.errors.observation() -
                                      patch.errors.of_right(sum_patch(model.patch, known, view).right))
                        .front()
                        .pattern);
  features = network_features(model, made.nodes, patch);
  Lesson lesson;
  lesson.shape = static_cast<size_t>(lump.shape);
  lesson.output = static_cast<Eigen::Index>(lesson.shape);
  if (!round && across) lesson.output = lump.shape == InclusionShape::Ellipsoid ? 4 : 5;
  const Guess guess = guess_of(lump);
  const std::array<double, kParameters> logs = {guess.log_size, guess.log_depth, guess.log_ratio};
  for (size_t p = 0; p < kParameters; ++p)
    lesson.logs[p] = static_cast<float>((logs[p] - model.inverse.mean[p]) / model.inverse.scale[p]);
  const auto shift = view.to_patch(lump.offset_mm[0], lump.offset_mm[1]);
  lesson.shift_mm = {static_cast<float>(shift[0]), static_cast<float>(shift[1])};
  return lesson;
}

struct Lessons {
  MatrixXf features;  ///< a column each
  std::vector<Lesson> lessons;
};

Lessons make_lessons(const Model& model, const ObservationMaker& maker, const TrainingOptions& options) {
  const uint32_t count = options.observations;
  Lessons made{
      MatrixXf(model.inverse.components.cols() + InverseNetwork::kOthers + InverseNetwork::kOpen, count),
      std::vector<Lesson>(count)};
  std::atomic<bool> stop = false;
  std::atomic<uint32_t> made_count = 0;
  in_parallel(options.threads, count, [&](size_t i) {
    if (stop) return;
    made.lessons[i] = make_lesson(model, maker, static_cast<uint32_t>(kWayBumps + i),
                                  made.features.col(static_cast<Eigen::Index>(i)));
    if (++made_count % 1000 == 0 && options.progress &&
        !options.progress("making readings", kMadeFrom + kMade * made_count / count))
      stop = true;
  });
  if (stop) throw Stopped();
  return made;
}

/// Features to mean 0 and unit variance.
void scale_features(InverseNetwork& inverse, MatrixXf& in) {
  inverse.in_mean = in.rowwise().mean();
  inverse.in_scale = (in.colwise() - inverse.in_mean).array().square().rowwise().mean().sqrt();
  for (float& scale : inverse.in_scale) scale = scale > 1e-6F ? 1 / scale : 0;
  in = inverse.in_scale.asDiagonal() * (in.colwise() - inverse.in_mean);
}

/// Trains the members side by side; gives their last errors' mean.
double train_ensemble(InverseNetwork& inverse, const Lessons& made, const TrainingOptions& options) {
  const MatrixXf& in = made.features;
  const NetworkLoss loss = [&made](const MatrixXf& out, std::span<const Eigen::Index> samples,
                                   MatrixXf& slope) {
    slope.resize(out.rows(), out.cols());
    double sum = 0;
    for (Eigen::Index b = 0; b < out.cols(); ++b)
      sum += lesson_loss(made.lessons[static_cast<size_t>(samples[static_cast<size_t>(b)])], out.col(b),
                         slope.col(b));
    return sum;
  };
  inverse.ensemble.resize(options.readers);
  std::atomic<bool> stop = false;
  std::atomic<uint32_t> rounds = 0;
  std::vector<double> last(options.readers);
  in_parallel(options.threads, options.readers, [&](size_t member) {
    SmallNetwork network =
        SmallNetwork::random({static_cast<uint32_t>(in.rows()), options.reader_hidden, options.reader_hidden,
                              static_cast<uint32_t>(reader_output::kCount)},
                             options.seed * 1000 + 500 + member);
    // Starts by saying nothing.
    network.layers.back().weight *= 0.1F;
    NetworkTraining how;
    how.rounds = options.reader_rounds;
    how.batch = 256;
    how.first_step = 2e-3;
    how.last_step = 1e-6;
    how.seed = options.seed * 7919 + 500 + member;
    how.done = [&](uint32_t, double error) {
      last[member] = error;
      const double fraction = ++rounds / (static_cast<double>(options.readers) * options.reader_rounds);
      if (options.progress &&
          !options.progress("teaching the reader", kMadeFrom + kMade + kTaught * fraction))
        stop = true;
      return !stop;
    };
    train(network, in, loss, how);
    inverse.ensemble[member] = std::move(network);
  });
  if (stop) throw Stopped();
  return std::accumulate(last.begin(), last.end(), 0.0) / options.readers;
}

}  // namespace

double train_inverse_network(Model& model, const TrainingOptions& options) {
  InverseNetwork& inverse = model.inverse;
  inverse = {};
  const ObservationMaker maker(model, options.seed ^ 0x5eed0f7ead127ULL);
  find_components(inverse, model, maker, options.components);
  scale_parameters(inverse, model);
  Lessons made = make_lessons(model, maker, options);
  scale_features(inverse, made.features);
  return train_ensemble(inverse, made, options);
}

}  // namespace palpate::lump
