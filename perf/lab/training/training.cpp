#include "perf/lab/training/training.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <exception>
#include <mutex>
#include <random>
#include <thread>

#include "engine/base/text.h"
#include "engine/lump/observation/sensor_model.h"
#include "engine/numeric/dense.h"
#include "engine/tissue/map_sampling.h"
#include "palpate/error.h"
#include "perf/lab/training/steps.h"

namespace palpate::lump {
namespace {

constexpr size_t kFewestPlain = 6, kFewestLumps = 24, kFewestAside = 4;
constexpr double kShift_mm = 0.7;  // of copies that teach the fields how bumps move

void widen(std::array<double, 2>& range, double value) {
  range = {std::min(range[0], value), std::max(range[1], value)};
}

/// Ranges that the examples span.
void find_ranges(Model& model, const Examples& all) {
  constexpr std::array<double, 2> kNothing = {1e30, -1e30};
  model.size_mm = model.depth_mm = model.ratio = model.thickness_mm = model.load = kNothing;
  model.cell_mm = 1e30;
  model.floor_mm = 1e30;
  for (size_t i = 0; i < all.examples.size(); ++i) {
    if (all.told && all.aside(i)) continue;
    const Example& e = all.examples[i];
    widen(model.thickness_mm, e.block_mm[2]);
    for (const double load : loads_of(all.observations[i])) widen(model.load, load);
    model.cell_mm = std::min(model.cell_mm, e.cell_mm);
    if (!e.lump) continue;
    widen(model.size_mm, e.size_mm);
    widen(model.depth_mm, e.depth_mm);
    widen(model.ratio, e.stiffness_ratio);
    model.floor_mm = std::min(model.floor_mm, e.block_mm[2] - e.depth_mm - e.size_mm);
    for (const double offset : e.offset_mm) model.offset_mm = std::max(model.offset_mm, std::abs(offset));
    model.shapes[static_cast<size_t>(e.shape)] = true;
  }
  model.floor_mm = std::max(0.0, model.floor_mm);
}

[[noreturn]] void refuse(const std::string& wanted, const std::string& found) {
  throw Error(Failure::Input, wanted, found, "palpate-lab dataset with its own ranges, more cases, or both");
}

/// Examples of one square block, which the model gets where it has none yet. Counts them in the report.
Examples take_examples(const std::vector<Example>& examples, Model& model, bool unseen,
                       const TrainingOptions& options, TrainingReport& report) {
  Examples all;
  all.unseen = unseen;
  for (const Example& e : examples) {
    if (e.pressure_Pa.empty()) {
      ++report.left_out;
      continue;
    }
    if (e.plate_sticks || e.plate_friction > 0)
      refuse("examples under a plate that slides freely", "one that rubs or sticks");
    if (e.skin) refuse("examples of one tissue", text("a skin of %.3g mm", e.skin->thickness_mm));
    if (all.examples.empty() && !unseen) model.block_mm = {e.block_mm[0], e.block_mm[1]};
    if (e.block_mm[0] != model.block_mm[0] || e.block_mm[1] != model.block_mm[1] ||
        e.block_mm[0] != e.block_mm[1])
      refuse("examples of one square block, " + text("%.4g mm wide", model.block_mm[0]),
             text("%.4g x %.4g mm", e.block_mm[0], e.block_mm[1]));
    Example bare = e;
    bare.pressure_Pa.clear();
    all.told |= bare.aside;
    all.examples.push_back(std::move(bare));
    ++(e.lump ? report.lumps : report.no_lumps);
  }
  if (report.no_lumps < kFewestPlain || report.lumps < kFewestLumps)
    refuse(std::to_string(kFewestLumps) + " blocks with a lump or more, and " + std::to_string(kFewestPlain) +
               " without",
           std::to_string(report.lumps) + " and " + std::to_string(report.no_lumps));
  size_t aside = 0, plain = 0;
  all.finest_mm = all.examples.front().cell_mm;
  for (const Example& e : all.examples) all.finest_mm = std::min(all.finest_mm, e.cell_mm);
  for (size_t i = 0; i < all.examples.size(); ++i)
    if (all.examples[i].aside && !all.finest(i))
      refuse("blocks kept aside of the finest cells, " + text("%.3g mm", all.finest_mm),
             text("%.3g mm", all.examples[i].cell_mm));
  for (size_t i = 0; i < all.examples.size(); ++i) {
    aside += all.examples[i].lump && all.aside(i);
    plain += !all.examples[i].lump && all.finest(i);
  }
  if (plain < kFewestPlain)
    refuse(std::to_string(kFewestPlain) + " blocks of the finest grid without a lump", std::to_string(plain));
  if (aside < kFewestAside)
    refuse("enough blocks with a lump that " + std::to_string(kFewestAside) +
               " of them can be kept aside, one in four",
           std::to_string(aside) + " of " + std::to_string(report.lumps));
  all.observations.resize(all.examples.size());
  std::vector<size_t> usable;
  for (size_t i = 0; i < examples.size(); ++i)
    if (!examples[i].pressure_Pa.empty()) usable.push_back(i);
  in_parallel(options.threads, usable.size(), [&](size_t i) {
    const Example& e = examples[usable[i]];
    all.observations[i] =
        ideal_observation(e.pressure_Pa, e.force_N, e.block_mm, e.young_Pa, model.node_pitch_mm);
  });
  return all;
}

}  // namespace

void in_parallel(uint32_t threads, size_t count, const std::function<void(size_t)>& work) {
  if (threads == 0) threads = std::max(1U, std::thread::hardware_concurrency());
  std::atomic<size_t> next = 0;
  std::mutex guard;
  std::exception_ptr failure;
  const auto serve = [&] {
    for (size_t i = next++; i < count; i = next++) {
      try {
        work(i);
      } catch (...) {
        const std::scoped_lock lock(guard);
        failure = std::current_exception();
        next = count;
      }
    }
  };
  std::vector<std::jthread> team;
  for (uint32_t t = 1; t < threads && t < count; ++t) team.emplace_back(serve);
  serve();
  team.clear();
  if (failure) std::rethrow_exception(failure);
}

Base fit_base(const Model& model, const Examples& all, const std::function<bool(size_t)>& used) {
  Base base;
  base.pitch_mm = model.node_pitch_mm;
  base.side = (window_nodes(model.block_mm[0], model.node_pitch_mm) + 1) / 2;
  const auto n = static_cast<Eigen::Index>(base.side);
  std::vector<Eigen::VectorXd> rows, values;
  for (size_t i = 0; i < all.examples.size(); ++i) {
    if (all.examples[i].lump || !used(i)) continue;
    const Observation& observation = all.observations[i];
    const std::vector<double> loads = loads_of(observation);
    for (size_t k = 0; k < loads.size(); ++k) {
      const PressureMap& map = observation.pressure_Pa[k];
      const double load = loads[k];
      // All eight images of the quarter's node: the block looks the same from every side.
      Eigen::VectorXd value(n * n);
      const auto middle = static_cast<int>(base.side) - 1;
      for (int y = 0; y <= middle; ++y)
        for (int x = 0; x <= middle; ++x) {
          double sum = 0;
          for (const int sx : {-1, 1})
            for (const int sy : {-1, 1})
              sum += static_cast<double>(map.at(static_cast<uint32_t>(middle + sx * x),
                                                static_cast<uint32_t>(middle + sy * y))) +
                     static_cast<double>(map.at(static_cast<uint32_t>(middle + sx * y),
                                                static_cast<uint32_t>(middle + sy * x)));
          value(y * n + x) = sum / 8 / (observation.young_Pa * load);
        }
      rows.emplace_back(Base::terms(observation.block_mm[2], load).cast<double>());
      values.push_back(value);
    }
  }
  Eigen::MatrixXd left(static_cast<Eigen::Index>(rows.size()), Base::kTerms), right(left.rows(), n * n);
  for (size_t r = 0; r < rows.size(); ++r) {
    left.row(static_cast<Eigen::Index>(r)) = rows[r];
    right.row(static_cast<Eigen::Index>(r)) = values[r];
  }
  // A little weight on small factors: few blocks must not make terms of them that nothing asks for.
  Eigen::MatrixXd normal = dense::product_tn(left, left);
  normal.diagonal().array() += 1e-6 * static_cast<double>(left.rows());
  const Eigen::MatrixXd factors = dense::Ldlt(normal).solve(dense::product_tn(left, right));
  base.factors = factors.transpose().cast<float>();
  const Eigen::MatrixXd error = dense::product(left, factors) - right;
  const Eigen::Index inner = n - 1;  // without the rim's node
  double squares = 0;
  for (Eigen::Index y = 0; y < inner; ++y)
    for (Eigen::Index x = 0; x < inner; ++x) squares += error.col(y * n + x).squaredNorm();
  base.residual = std::sqrt(squares / static_cast<double>(inner * inner * error.rows()));
  return base;
}

Patch fit_patch(const Model& model, const Examples& all, uint32_t count, uint64_t seed, double& missed) {
  Patch patch;
  const auto n = static_cast<Eigen::Index>(patch.side);
  const double middle = static_cast<double>(n - 1) / 2;
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> any(-kShift_mm, kShift_mm);
  std::vector<Eigen::VectorXf> bumps;
  for (size_t i = 0; i < all.examples.size(); ++i) {
    const Example& e = all.examples[i];
    if (!e.lump || !all.finest(i) || all.aside(i)) continue;
    const Observation& observation = all.observations[i];
    const float peak = *std::max_element(observation.pressure_Pa.back().values.begin(),
                                         observation.pressure_Pa.back().values.end());
    const double sign_x = e.offset_mm[0] < 0 ? -1 : 1, sign_y = e.offset_mm[1] < 0 ? -1 : 1;
    const bool round = e.shape == InclusionShape::Sphere || e.shape == InclusionShape::Cylinder;
    // Neighbouring loads look alike: every second is enough.
    const std::vector<double> loads = loads_of(observation);
    for (size_t k = (loads.size() + 1) % 2; k < loads.size(); k += 2) {
      const Eigen::VectorXf quarter = model.base.quarter(observation.block_mm[2], loads[k]);
      for (const bool swapped : {false, true}) {
        if (!round && swapped != e.along_y) continue;
        for (const bool moved : {false, true}) {
          const double du = moved ? any(random) : 0, dv = moved ? any(random) : 0;
          Eigen::VectorXf bump(n * n);
          for (Eigen::Index b = 0; b < n; ++b)
            for (Eigen::Index a = 0; a < n; ++a) {
              double u = (static_cast<double>(a) - middle) * patch.pitch_mm + du,
                     v = (static_cast<double>(b) - middle) * patch.pitch_mm + dv;
              if (swapped) std::swap(u, v);
              const double x = e.offset_mm[0] + sign_x * u, y = e.offset_mm[1] + sign_y * v;
              const bool on =
                  std::abs(x) < model.block_mm[0] / 2 - 1 && std::abs(y) < model.block_mm[1] / 2 - 1;
              bump(b * n + a) =
                  on ? static_cast<float>((map_at(observation.pressure_Pa[k], x, y) -
                                           observation.young_Pa * model.base.at(quarter, x, y)) /
                                          static_cast<double>(peak))
                     : 0;
            }
          bumps.push_back(std::move(bump));
        }
      }
    }
  }
  Eigen::MatrixXf columns(n * n, static_cast<Eigen::Index>(bumps.size()));
  for (size_t i = 0; i < bumps.size(); ++i) columns.col(static_cast<Eigen::Index>(i)) = bumps[i];
  Eigen::MatrixXf products = Eigen::MatrixXf::Zero(n * n, n * n);
  dense::add_square(products, columns);
  const dense::SymmetricEigen eigen = dense::symmetric_eigen(products.cast<double>());
  count = std::min<uint32_t>(count, static_cast<uint32_t>(n * n));
  patch.fields = eigen.vectors.rightCols(count).rowwise().reverse().transpose().cast<float>();
  patch.prepare();
  missed =
      std::sqrt(std::max(0.0, eigen.values.head(n * n - count).sum()) / static_cast<double>(columns.size()));
  return patch;
}

Network train_lumps(const std::vector<Example>& examples, const TrainingOptions& options,
                    TrainingReport& report) {
  auto model = std::make_shared<Model>();
  const auto say = [&options](const char* what, double fraction) {
    if (options.progress && !options.progress(what, fraction)) throw Stopped();
  };
  if (options.ensemble < 2 || options.ensemble > 16 || options.hidden < 4 || options.hidden > 512 ||
      options.fields < 6 || options.fields > 200 || options.rounds < 1 || options.trials < 20)
    throw Error(Failure::Usage, "2 to 16 members, 4 to 512 hidden units, 6 to 200 fields, 20 trials or more",
                "others", "the defaults");
  if (options.observations < 1000 || options.observations > 10000000 || options.readers < 1 ||
      options.readers > 16 || options.reader_hidden < 4 || options.reader_hidden > 1024 ||
      options.reader_rounds < 1 || options.components < static_cast<uint32_t>(InverseNetwork::kOpen) ||
      options.components > 400)
    throw Error(Failure::Usage,
                "1000 to 10000000 observations, 1 to 16 networks of 4 to 1024 hidden units, 10 to 400 "
                "principal components",
                "others", "the defaults");
  say("reading", 0);
  Examples all = take_examples(examples, *model, false, options, report);
  find_ranges(*model, all);
  say("finding fields", 0.04);
  model->base = fit_base(*model, all, [&all](size_t i) { return all.finest(i); });
  report.base_error = model->base.residual;
  model->patch = fit_patch(*model, all, options.fields, options.seed, report.fields_error);
  train_ensemble(*model, all, options, report);
  report.inverse_loss = train_inverse_network(*model, options);
  calibrate(*model, all, options);
  model->made_from = options.made_from;
  say("done", 1);
  return Network(std::move(model));
}

Network recalibrate_lumps(const Network& network, const std::vector<Example>& examples,
                          const TrainingOptions& options, TrainingReport& report) {
  auto model = std::make_shared<Model>(network.model());
  const Examples all = take_examples(examples, *model, true, options, report);
  report.kept_aside = report.lumps;
  calibrate(*model, all, options);
  model->made_from = network.made_from() + "; calibrated on " + options.made_from;
  return Network(std::move(model));
}

}  // namespace palpate::lump
