#include "perf/profile/growth.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace palpate::perf {
namespace {

struct Series {
  std::string reading;
  std::string stage;
  std::vector<double> pixels = {};
  std::vector<double> time_ms = {};
};

Series& series_for(std::vector<Series>& all, const std::string& reading, const std::string& stage) {
  const auto found = std::find_if(all.begin(), all.end(),
                                  [&](const Series& s) { return s.reading == reading && s.stage == stage; });
  return found == all.end() ? all.emplace_back(Series{reading, stage}) : *found;
}

void add_growth(std::vector<Growth>& growth, const Series& series, uint64_t from_px, size_t least) {
  std::vector<double> x, y;
  for (size_t i = 0; i < series.pixels.size(); ++i) {
    if (series.pixels[i] < static_cast<double>(from_px) || series.time_ms[i] <= 0) continue;
    x.push_back(series.pixels[i]);
    y.push_back(series.time_ms[i]);
  }
  if (x.size() < least) return;
  const PowerFit fit = fit_power(x, y);
  growth.push_back({series.reading, series.stage, fit.exponent, fit.standard_error, from_px,
                    static_cast<uint32_t>(x.size())});
}

}  // namespace

PowerFit fit_power(std::span<const double> x, std::span<const double> y) {
  const auto n = static_cast<Eigen::Index>(x.size());
  const auto positive = [](double v) { return v > 0 && std::isfinite(v); };
  if (x.size() != y.size() || n < 2 || !std::all_of(x.begin(), x.end(), positive) ||
      !std::all_of(y.begin(), y.end(), positive) ||
      std::all_of(x.begin(), x.end(), [&](double v) { return v == x.front(); }))
    throw std::invalid_argument("a power law needs two different, positive points");
  const Eigen::VectorXd log_x = Eigen::Map<const Eigen::VectorXd>(x.data(), n).array().log();
  const Eigen::VectorXd log_y = Eigen::Map<const Eigen::VectorXd>(y.data(), n).array().log();
  Eigen::MatrixX2d design(n, 2);
  design.col(0).setOnes();
  design.col(1) = log_x.array() - log_x.mean();  // about the mean, where the two unknowns do not mix
  const Eigen::Vector2d fit = design.colPivHouseholderQr().solve(log_y);
  const double left_over = (log_y - design * fit).squaredNorm();
  const double freedom = static_cast<double>(n - 2);
  const double error = freedom > 0 ? std::sqrt(left_over / freedom / design.col(1).squaredNorm()) : 0;
  return {fit[1], error, std::exp(fit[0] - fit[1] * log_x.mean())};
}

std::vector<Growth> growth_of(const std::vector<SizeFigure>& sizes) {
  std::vector<Series> all;
  for (const SizeFigure& size : sizes) {
    const auto add = [&](const std::string& stage, double time_ms) {
      Series& series = series_for(all, size.reading, stage);
      series.pixels.push_back(static_cast<double>(size.pixels()));
      series.time_ms.push_back(time_ms);
    };
    add("frame", size.latency.median_ms);
    for (const StageFigure& stage : size.stages) add(stage.stage, stage.time.median_ms);
  }
  std::vector<Growth> growth;
  for (const Series& series : all) {
    if (series.pixels.size() < 2 || series.pixels.front() == series.pixels.back()) continue;
    add_growth(growth, series, 0, 2);
    add_growth(growth, series, kLargeFrame_px, 3);
  }
  return growth;
}

}  // namespace palpate::perf
