#include "perf/lab/rivals/spline_rival.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <optional>
#include <random>
#include <vector>

#include "engine/base/text.h"
#include "engine/numeric/thin_plate/thin_plate.h"
#include "perf/measure.h"
#include "viz/report/gnuplot.h"
#include "viz/report/plot.h"

namespace palpate::perf {
namespace {

constexpr size_t kPlaces = 100'000;
constexpr double kNoise = 0.002;

template <size_t D>
using Places = std::vector<std::array<double, D>>;

template <size_t D>
Places<D> scattered(size_t n, unsigned seed, double low, double high) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> in(low, high);
  Places<D> places(n);
  for (auto& p : places)
    for (double& x : p) x = in(random);
  return places;
}
template <size_t D>
double field(const std::array<double, D>& p) {
  double away = 0;
  for (const double x : p) away += (x - 0.5) * (x - 0.5);
  return 0.1 * std::exp(-away / 0.125) + 0.05 * p[0] * p[1];
}

/// The system as the books have it, on the points as they stand, and sums in blocks of places.
template <typename Real, size_t D>
class DenseSpline {
 public:
  using Matrix = Eigen::Matrix<Real, Eigen::Dynamic, Eigen::Dynamic>;
  using Vector = Eigen::Matrix<Real, Eigen::Dynamic, 1>;

  DenseSpline(PlateKernel kernel, const Places<D>& points, const std::vector<double>& values, double lambda)
      : kernel_(kernel),
        n_(static_cast<Eigen::Index>(points.size())),
        at_(as_matrix(points, points.size(), 0)) {
    constexpr auto kTerms = static_cast<Eigen::Index>(D + 1);
    Matrix s = Matrix::Zero(n_ + kTerms, n_ + kTerms);
    Vector right = Vector::Zero(n_ + kTerms), column(n_);
    for (Eigen::Index j = 0; j < n_; ++j) {
      kernel_to(at_, at_.row(j), column);
      s.col(j).head(n_) = column;
      s(j, j) += static_cast<Real>(lambda);
      right[j] = static_cast<Real>(values[static_cast<size_t>(j)]);
    }
    s.col(n_).head(n_).setOnes();
    s.topRightCorner(n_, D) = at_;
    s.bottomLeftCorner(kTerms, n_) = s.topRightCorner(n_, kTerms).transpose();
    solution_ = s.partialPivLu().solve(right);
  }
  std::vector<double> values(const Places<D>& places) const {
    constexpr size_t kBlock = 512;
    std::vector<double> out;
    out.reserve(places.size());
    Vector column(kBlock), sum;
    for (size_t start = 0; start < places.size(); start += kBlock) {
      const size_t count = std::min(kBlock, places.size() - start);
      const Matrix at = as_matrix(places, count, start);
      column.resize(static_cast<Eigen::Index>(count));
      sum = at * solution_.tail(D);
      sum.array() += solution_[n_];
      for (Eigen::Index j = 0; j < n_; ++j) {
        kernel_to(at, at_.row(j), column);
        sum += solution_[j] * column;
      }
      for (const Real v : sum) out.push_back(static_cast<double>(v));
    }
    return out;
  }

 private:
  static Matrix as_matrix(const Places<D>& places, size_t count, size_t start) {
    Matrix m(count, D);
    for (size_t i = 0; i < count; ++i)
      for (size_t d = 0; d < D; ++d)
        m(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(d)) =
            static_cast<Real>(places[start + i][d]);
    return m;
  }
  template <typename Row>
  void kernel_to(const Matrix& at, const Row& point, Vector& out) const {
    out = (at.col(0).array() - point[0]).square();
    for (size_t d = 1; d < D; ++d)
      out.array() +=
          (at.col(static_cast<Eigen::Index>(d)).array() - point[static_cast<Eigen::Index>(d)]).square();
    if (kernel_ == PlateKernel::Log)
      out.array() *= (out.array() + Real(1e-30)).log();
    else if (kernel_ == PlateKernel::Linear)
      out.array() = -out.array().sqrt();
    else
      out.array() *= out.array().sqrt();
  }

  PlateKernel kernel_;
  Eigen::Index n_;
  Matrix at_;
  Vector solution_;
};

double rms_off(const std::vector<double>& a, const std::vector<double>& b) {
  double sum = 0;
  for (size_t i = 0; i < a.size(); ++i) sum += (a[i] - b[i]) * (a[i] - b[i]);
  return std::sqrt(sum / static_cast<double>(a.size()));
}
double median(std::vector<double> of) {
  std::sort(of.begin(), of.end());
  return of[of.size() / 2];
}

class Study {
 public:
  explicit Study(int repetitions) : repetitions_(repetitions) {
    result_.csv =
        "method,kernel,axes,points,offset,lambda,fit_cpu_ms,evaluate_cpu_ms,rms_error,freedom,condition\n";
  }

  template <size_t D>
  void run(PlateKernel kernel, const char* name, size_t n, double offset, std::optional<double> lambda,
           bool rivals) {
    Places<D> points = scattered<D>(n, 1, 0, 1), places = scattered<D>(kPlaces, 2, 0.05, 0.95);
    std::vector<double> values, truth;
    std::mt19937 random(3);
    std::normal_distribution<double> noise(0, kNoise);
    for (const auto& p : points) values.push_back(field<D>(p) + noise(random));
    for (const auto& p : places) truth.push_back(field<D>(p));
    for (auto* set : {&points, &places})
      for (auto& p : *set)
        for (double& x : p) x += offset;
    PlateOptions options;
    options.kernel = kernel;
    options.spread = false;  // the rivals do not compute it either
    std::optional<ThinPlateSpline<D>> ours;
    std::vector<double> got;
    Row row{"palpate", name, D, n, offset, lambda, {}, {}, 0, 0, 0};
    for (int k = 0; k < repetitions_; ++k) {
      row.fit_ms.push_back(
          time_runs([&] { ours = ThinPlate<D>(points, options).fit(values, 1, lambda); }, 1).cpu_ms);
      row.evaluate_ms.push_back(time_runs([&] { got = ours->values(places); }, 1).cpu_ms);
    }
    row.error = rms_off(got, truth);
    row.freedom = ours->statistics().freedom;
    row.condition = ours->statistics().condition;
    row.lambda = ours->statistics().lambda;
    add(row, lambda ? "palpate" : "palpate, lambda by the data");
    if (!rivals || !lambda) return;
    // Lambda means the same where the points are scaled as ours are: by the square of the scale, or its
    // power.
    const double scale = ours->frame().axes[0][0];
    const double power = kernel == PlateKernel::Log ? 2 : kernel == PlateKernel::Linear ? 1 : 3;
    const double theirs = *lambda / std::pow(scale, power);
    rival<double, D>("Eigen LU, double", kernel, name, points, places, values, truth, offset, *lambda,
                     theirs);
    rival<float, D>("Eigen LU, float", kernel, name, points, places, values, truth, offset, *lambda, theirs);
  }

  SplineStudy take() {
    PlotPanel panel{"", "fit and 100 000 evaluations, processor time, ms",
                    "RMS error of the field (noise 0.002)"};
    panel.log_x = panel.log_y = true;
    panel.key = "below maxcols 3";
    panel.y_range = {{1e-4, kPlotAuto}};
    panel.curves = std::move(series_);
    result_.png =
        run_gnuplot(plot_script({.panels = {panel}, .width_px = 1000, .height_px = 720}, PlotKind::Png))
            .bytes;
    return std::move(result_);
  }

 private:
  struct Row {
    std::string method, kernel;
    size_t axes = 0, points = 0;
    double offset = 0;
    std::optional<double> lambda;
    std::vector<double> fit_ms, evaluate_ms;
    double error = 0, freedom = 0, condition = 0;
  };

  template <typename Real, size_t D>
  void rival(const char* method, PlateKernel kernel, const char* name, const Places<D>& points,
             const Places<D>& places, const std::vector<double>& values, const std::vector<double>& truth,
             double offset, double lambda, double theirs) {
    Row row{method, name, D, points.size(), offset, lambda, {}, {}, 0, std::nan(""), std::nan("")};
    std::optional<DenseSpline<Real, D>> spline;
    std::vector<double> got;
    for (int k = 0; k < repetitions_; ++k) {
      row.fit_ms.push_back(time_runs([&] { spline.emplace(kernel, points, values, theirs); }, 1).cpu_ms);
      row.evaluate_ms.push_back(time_runs([&] { got = spline->values(places); }, 1).cpu_ms);
    }
    row.error = rms_off(got, truth);
    add(row, method);
  }

  void add(const Row& r, const std::string& series) {
    const double fit_ms = median(r.fit_ms), evaluate_ms = median(r.evaluate_ms);
    result_.csv +=
        text("\"%s\",%s,%zu,%zu,%g,%.4g,%.3f,%.3f,%.6g,%.4g,%.3g\n", series.c_str(), r.kernel.c_str(), r.axes,
             r.points, r.offset, r.lambda.value_or(0), fit_ms, evaluate_ms, r.error, r.freedom, r.condition);
    result_.words += text(
        "%-28s %-7s %zuD %4zu points  offset %-6g lambda %-9.3g fit %7.1f ms  evaluate %7.1f ms  "
        "error %.6f\n",
        series.c_str(), r.kernel.c_str(), r.axes, r.points, r.offset, r.lambda.value_or(0), fit_ms,
        evaluate_ms, r.error);
    if (r.offset != 0 || !std::isfinite(r.error)) return;  // far from the origin is another question
    const std::string title = series + ", " + r.kernel;
    auto at =
        std::find_if(series_.begin(), series_.end(), [&](const PlotCurve& c) { return c.title == title; });
    if (at == series_.end()) {
      // One colour for each kernel, one mark for each method.
      at = series_.insert(at, {.title = title, .style = PlotCurve::Style::Points, .size = 1.3});
      at->colour = r.kernel == "log" ? 0 : r.kernel == "linear" ? 1 : 2;
      at->mark = title.find("by the data") != std::string::npos ? 13
                 : title.find("double") != std::string::npos    ? 4
                 : title.find("float") != std::string::npos     ? 8
                                                                : 7;
    }
    at->add(fit_ms + evaluate_ms, r.error);
  }

  int repetitions_;
  SplineStudy result_;
  std::vector<PlotCurve> series_;
};

}  // namespace

SplineStudy spline_study(int repetitions) {
  Study study(repetitions);
  const std::array<std::optional<double>, 7> lambdas = {0.0, 1e-6, 1e-3, 1.0, 1e3, 1e12, std::nullopt};
  for (const size_t n : {100, 300, 1000, 2000})
    for (const std::optional<double>& lambda : lambdas) {
      const bool rivals = n < 2000 && (lambda == 0.0 || lambda == 1.0);
      study.run<2>(PlateKernel::Log, "log", n, 0, lambda, rivals);
      study.run<3>(PlateKernel::Linear, "linear", n, 0, lambda, rivals);
      study.run<3>(PlateKernel::Cubic, "cubic", n, 0, lambda, rivals);
    }
  for (const double offset : {1e4, 1e6}) study.run<2>(PlateKernel::Log, "log", 300, offset, 1.0, true);
  return study.take();
}

}  // namespace palpate::perf
