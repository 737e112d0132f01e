#include "perf/lab/study/stiffness_fit.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "engine/base/statistics.h"
#include "engine/base/text.h"
#include "palpate/error.h"

namespace palpate::lump {
namespace {

constexpr double kRobust =
    0.1;  // of the logarithm of what a lump adds: large, stiff, shallow lumps are far off
constexpr int kRobustRounds = 30;
constexpr size_t kParts = 10;
constexpr double kSolver = 0.001;  // error of a pressed block's force, share: what a lump adds is no surer

std::optional<Case::Lump> lump_of(const Example& e) {
  if (!e.lump) return std::nullopt;
  Case::Lump lump;
  lump.shape = e.shape;
  lump.along_y = e.along_y;
  lump.diameter_mm = e.size_mm;
  lump.depth_mm = e.depth_mm;
  lump.stiffness_ratio = e.stiffness_ratio;
  lump.offset_mm = e.offset_mm;
  return lump;
}

/// Each load of each block with a lump, or without one: its compression, and the logarithm of force over that
/// of a free column.
template <typename Take>
void each_load(const std::vector<Example>& examples, bool with_lump, const Take& take) {
  for (const Example& e : examples)
    for (size_t k = 0; e.lump == with_lump && k < e.force_N.size(); ++k) {
      const double compression = e.press_mm[k] / e.block_mm[2];
      const double load = e.force_N[k] / (1e-6 * e.block_mm[0] * e.block_mm[1] * e.young_Pa);
      take(e, compression, std::log(load / column_load(compression)));
    }
}

/// Least squares, in rounds: what lies more than `robust` from the fit counts less (0: all count alike).
template <size_t N>
std::array<double, N> least_squares(const std::vector<std::array<double, N>>& rows,
                                    const std::vector<double>& values, const std::vector<double>& weights,
                                    double robust, const char* of) {
  if (rows.size() < 2 * N)
    throw Error(Failure::Input, text("%zu loads or more of blocks ", 2 * N) + of, std::to_string(rows.size()),
                "palpate-lab dataset with more of them");
  using Row = Eigen::Matrix<double, N, 1>;
  Row best = Row::Zero();
  for (int round = 0; round < (robust > 0 ? kRobustRounds : 1); ++round) {
    Eigen::Matrix<double, N, N> normal = Eigen::Matrix<double, N, N>::Zero();
    Row right = Row::Zero();
    for (size_t i = 0; i < rows.size(); ++i) {
      const Eigen::Map<const Row> row(rows[i].data());
      const double off = round > 0 ? (row.dot(best) - values[i]) / robust : 0;
      const double weight = weights[i] / std::pow(1 + off * off, 2);
      normal += weight * row * row.transpose();
      right += weight * values[i] * row;
    }
    best = normal.ldlt().solve(right);
  }
  std::array<double, N> all;
  std::copy_n(best.data(), N, all.begin());
  return all;
}

double plain_of(const BlockStiffness& fit, const Example& e, double compression) {
  return std::log(fit.load(e.block_mm, std::nullopt, compression) / column_load(compression));
}

BlockStiffness fit_all(const std::vector<Example>& examples) {
  BlockStiffness fit;
  {
    std::vector<std::array<double, BlockStiffness::kPlainTerms>> rows;
    std::vector<double> values;
    each_load(examples, false, [&](const Example& e, double compression, double log) {
      rows.push_back(BlockStiffness::plain_terms(e.block_mm[2], compression));
      values.push_back(log);
    });
    fit.plain = least_squares<BlockStiffness::kPlainTerms>(rows, values, std::vector(rows.size(), 1.0), 0,
                                                           "without a lump");
  }
  std::vector<std::array<double, BlockStiffness::kLumpTerms>> rows;
  std::vector<double> values, weights;
  each_load(examples, true, [&](const Example& e, double compression, double log) {
    const double added = log - plain_of(fit, e, compression);
    if (added <= kSolver) return;
    const Case::Lump lump = *lump_of(e);
    rows.push_back(BlockStiffness::lump_terms(lump, e.block_mm[2], compression));
    values.push_back(std::log(added / BlockStiffness::dilute(lump, e.block_mm)));
    weights.push_back(std::pow(added, 2) / (std::pow(kSolver, 2) + std::pow(0.1 * added, 2)));
  });
  fit.lump = least_squares<BlockStiffness::kLumpTerms>(rows, values, weights, kRobust, "with a lump");
  return fit;
}

}  // namespace

BlockStiffness fit_stiffness(const std::vector<Example>& examples) {
  BlockStiffness fit = fit_all(examples);
  // Errors of each tenth by the fit of the others.
  double plain = 0, lump = 0;
  for (size_t part = 0; part < kParts; ++part) {
    std::vector<Example> others, judged;
    std::array<size_t, 2> next{};
    for (const Example& e : examples) (next[e.lump]++ % kParts == part ? judged : others).push_back(e);
    const StiffnessErrors errors = judge_stiffness(fit_all(others), judged);
    plain += errors.plain_rms * errors.plain_rms / kParts;
    lump += errors.lump_rms * errors.lump_rms / kParts;
  }
  fit.plain_sd = std::sqrt(plain);
  fit.lump_sd = std::sqrt(lump);
  return fit;
}

StiffnessErrors judge_stiffness(const BlockStiffness& fit, const std::vector<Example>& examples) {
  StiffnessErrors errors;
  for (const Example& e : examples) (e.lump ? errors.lumps : errors.plain) += 1;
  std::vector<double> plain, share, all, added;
  each_load(examples, false, [&](const Example& e, double compression, double log) {
    plain.push_back(plain_of(fit, e, compression) - log);
  });
  each_load(examples, true, [&](const Example& e, double compression, double log) {
    const double by_lump = fit.by_lump(*lump_of(e), e.block_mm, compression);
    all.push_back(plain_of(fit, e, compression) + by_lump - log);
    added.push_back(by_lump);
    if (by_lump > 10 * kSolver) share.push_back(all.back() / by_lump);
  });
  const auto rms = [](const std::vector<double>& values) {
    double sum = 0;
    for (const double v : values) sum += v * v;
    return values.empty() ? 0 : std::sqrt(sum / static_cast<double>(values.size()));
  };
  const auto worst = [](const std::vector<double>& values) {
    double most = 0;
    for (const double v : values) most = std::max(most, std::abs(v));
    return most;
  };
  errors.plain_rms = rms(plain);
  errors.plain_worst = worst(plain);
  errors.lump_rms = rms(share);
  errors.lump_worst = worst(share);
  errors.with_lump_rms = rms(all);
  errors.with_lump_worst = worst(all);
  errors.added_most = worst(added);
  errors.added_median = added.empty() ? 0 : median(std::move(added));
  return errors;
}

std::string stiffness_text(const StiffnessErrors& e) {
  return text(
      "force at a way of the plate, errors (RMS, worst):\n"
      "%5zu blocks without a lump: %.2f, %.2f %%\n"
      "%5zu with a lump:           %.2f, %.2f %%\n"
      "what a lump adds, %.2g %% in the median and %.2g %% at most, is off by %.0f %% of it (RMS; worst %.0f "
      "%%)\n",
      e.plain, 100 * e.plain_rms, 100 * e.plain_worst, e.lumps, 100 * e.with_lump_rms,
      100 * e.with_lump_worst, 100 * e.added_median, 100 * e.added_most, 100 * e.lump_rms,
      100 * e.lump_worst);
}

json::Value stiffness_json(const StiffnessErrors& e) {
  return {{"without_lump", e.plain},          {"with_lump", e.lumps},
          {"plain_rms", e.plain_rms},         {"plain_worst", e.plain_worst},
          {"with_lump_rms", e.with_lump_rms}, {"with_lump_worst", e.with_lump_worst},
          {"added_median", e.added_median},   {"added_most", e.added_most},
          {"added_rms_share", e.lump_rms},    {"added_worst_share", e.lump_worst}};
}

std::string stiffness_numbers(const BlockStiffness& fit) {
  const auto list = [](const auto& values) {
    std::string line;
    for (const double v : values) line += (line.empty() ? "{" : ", ") + text("%.6g", v);
    return line + "}";
  };
  return "// Made by palpate-lab evaluate stiffness --fit.\n" + list(fit.plain) + ",\n" + list(fit.lump) +
         ",\n" + text("%.3g, %.3g\n", fit.plain_sd, fit.lump_sd);
}

}  // namespace palpate::lump
