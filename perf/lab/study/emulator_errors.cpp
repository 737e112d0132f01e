#include "perf/lab/study/emulator_errors.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>

#include "engine/base/statistics.h"
#include "engine/base/text.h"
#include "engine/lump/network/view.h"
#include "engine/lump/observation/sensor_model.h"
#include "engine/numeric/dense.h"
#include "engine/tissue/inclusion_shape.h"

namespace palpate::lump {
namespace {

double off_middle_mm(const Example& e) {
  return std::hypot(e.offset_mm[0], e.offset_mm[1]);
}

bool round(const Example& e) {
  return e.shape == InclusionShape::Sphere || e.shape == InclusionShape::Cylinder;
}

/// Kinds of lumps, a row each; a lump may be in several.
struct Kind {
  const char* name;
  std::function<bool(const Example&)> holds;
};

const std::array<Kind, 8>& kinds() {
  static const std::array<Kind, 8> all = {{
      {"no lump", [](const Example& e) { return !e.lump; }},
      {"all lumps", [](const Example& e) { return e.lump; }},
      {"middle of the ranges",
       [](const Example& e) {
         return e.lump && e.size_mm > 5.5 && e.size_mm < 10 && e.depth_mm > 2.5 && e.depth_mm < 6.5 &&
                e.stiffness_ratio > 2.5 && e.stiffness_ratio < 20 && off_middle_mm(e) < 1;
       }},
      {"stiff and shallow",
       [](const Example& e) { return e.lump && e.depth_mm < 2.8 && e.stiffness_ratio > 10; }},
      {"soft, mid-depth, round",
       [](const Example& e) {
         return e.lump && round(e) && e.size_mm > 6 && e.size_mm < 10 && e.depth_mm > 3.5 && e.depth_mm < 8 &&
                e.stiffness_ratio < 4;
       }},
      {"in the middle", [](const Example& e) { return e.lump && off_middle_mm(e) < 0.1; }},
      {"up to 6 mm aside",
       [](const Example& e) { return e.lump && off_middle_mm(e) >= 0.1 && off_middle_mm(e) < 6; }},
      {"farther aside", [](const Example& e) { return e.lump && off_middle_mm(e) >= 6; }},
  }};
  return all;
}

struct Row {
  const char* name;
  std::vector<double> fraction, of_bump;
};

std::vector<Row> rows_of(const std::vector<EmulatorError>& errors) {
  std::vector<Row> rows;
  for (const Kind& kind : kinds()) {
    Row row{kind.name, {}, {}};
    for (const EmulatorError& e : errors)
      if (kind.holds(e.truth)) {
        row.fraction.push_back(e.fraction);
        row.of_bump.push_back(e.of_bump);
      }
    if (!row.fraction.empty()) rows.push_back(std::move(row));
  }
  return rows;
}

double root_mean_square(const std::vector<double>& values) {
  double squares = 0;
  for (const double value : values) squares += value * value;
  return std::sqrt(squares / static_cast<double>(values.size()));
}

double nine_in_ten(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[static_cast<size_t>(std::lround(0.9 * static_cast<double>(values.size() - 1)))];
}

/// The nodes' last load, of those within the patch.
Eigen::VectorXd within(const Model& model, const PressedNodes& nodes, const PatchView& view) {
  const double reach = model.patch.reach_mm() + 1e-6;
  std::vector<Eigen::Index> inside;
  for (size_t n = 0; n < nodes.x_mm.size(); ++n) {
    const auto [u, v] = view.to_patch(nodes.x_mm[n], nodes.y_mm[n]);
    if (std::abs(u) <= reach && std::abs(v) <= reach) inside.push_back(static_cast<Eigen::Index>(n));
  }
  return nodes.rest(inside, nodes.rest.cols() - 1);
}

double rms(const Eigen::VectorXd& values) {
  return std::sqrt(values.squaredNorm() / static_cast<double>(std::max<Eigen::Index>(1, values.size())));
}

EmulatorError error_of(const Model& model, const Example& e, PressedNodes nodes) {
  EmulatorError error;
  error.truth = e;
  error.truth.pressure_Pa.clear();
  if (!e.lump) {
    error.fraction = rms(nodes.rest.rightCols(1)) / nodes.peak;
    return error;
  }
  const PatchView view(model, nodes, e.offset_mm, e.along_y);
  const double bump = rms(within(model, nodes, view)) / nodes.peak;
  const PatchSums sums = sum_patch(model.patch, nodes, view);
  Eigen::MatrixXd gram = sums.gram;
  gram.diagonal().array() += 1e-6 * gram.diagonal().maxCoeff();
  PressedNodes beyond = nodes;
  add_bump(model, view, -dense::Cholesky(gram).solve(sums.right), beyond);
  error.fields = rms(within(model, beyond, view)) / nodes.peak;
  const Guess guess{e.shape, std::log(e.size_mm), std::log(e.depth_mm), std::log(e.stiffness_ratio)};
  add_bump(model, view, -bump_factors(model, guess, view.setting, nodes.loads, -1), nodes);
  error.fraction = rms(within(model, nodes, view)) / nodes.peak;
  error.of_bump = bump > 0 ? error.fraction / bump : 0;
  return error;
}

}  // namespace

std::vector<EmulatorError> emulator_errors(const Network& network, const std::vector<Example>& examples) {
  const Model& model = network.model();
  std::vector<EmulatorError> errors;
  for (const Example& e : examples) {
    const Observation ideal =
        ideal_observation(e.pressure_Pa, e.force_N, e.block_mm, e.young_Pa, model.node_pitch_mm);
    Estimate trouble;
    if (auto nodes = pressed_nodes(model, ideal, trouble))
      errors.push_back(error_of(model, e, std::move(*nodes)));
  }
  return errors;
}

std::string emulator_errors_text(const std::vector<EmulatorError>& errors) {
  std::string table =
      "RMS over the patch at the highest load     % of the peak pressure        % of the bump\n"
      "                            blocks     RMS   median   nine in ten           median\n";
  for (const Row& row : rows_of(errors))
    table += text("%-26s %7zu %7.3f  %7.3f       %7.3f          %7.3g\n", row.name, row.fraction.size(),
                  100 * root_mean_square(row.fraction), 100 * median(row.fraction),
                  100 * nine_in_ten(row.fraction), 100 * median(row.of_bump));
  return table;
}

std::string emulator_errors_csv(const std::vector<EmulatorError>& errors) {
  std::string csv =
      "shape,size_mm,depth_mm,ratio,x_mm,y_mm,thickness_mm,error_of_peak,error_of_bump,fields_of_peak\n";
  for (const EmulatorError& e : errors)
    csv += text("%s,%.6g,%.6g,%.6g,%.6g,%.6g,%.6g,%.4g,%.4g,%.4g\n",
                e.truth.lump ? to_string(e.truth.shape) : "none", e.truth.size_mm, e.truth.depth_mm,
                e.truth.stiffness_ratio, e.truth.offset_mm[0], e.truth.offset_mm[1], e.truth.block_mm[2],
                e.fraction, e.of_bump, e.fields);
  return csv;
}

json::Value emulator_errors_json(const std::vector<EmulatorError>& errors) {
  json::Value rows = json::Value::array();
  for (const Row& row : rows_of(errors))
    rows.push_back({{"lumps", row.name},
                    {"blocks", row.fraction.size()},
                    {"rms_of_peak", root_mean_square(row.fraction)},
                    {"median_of_peak", median(row.fraction)},
                    {"nine_in_ten_of_peak", nine_in_ten(row.fraction)},
                    {"median_of_bump", median(row.of_bump)}});
  return {{"emulator", rows}};
}

}  // namespace palpate::lump
