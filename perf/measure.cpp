#include "perf/measure.h"

#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <sstream>

namespace palpate::perf {
namespace {

double cpu_now_ms() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  const auto ms = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) * 1e3 + static_cast<double>(t.tv_usec) * 1e-3;
  };
  return ms(usage.ru_utime) + ms(usage.ru_stime);
}

double quantile(std::vector<double> values, double q) {
  std::sort(values.begin(), values.end());
  return values[static_cast<size_t>(std::lround(q * static_cast<double>(values.size() - 1)))];
}

Summary summarise(const std::vector<Sample>& samples, double Sample::*field) {
  std::vector<double> values;
  values.reserve(samples.size());
  for (const Sample& s : samples) values.push_back(s.*field);
  return {quantile(values, 0.5), quantile(values, 0.95)};
}

Quartiles ratios(const std::vector<Sample>& a, const std::vector<Sample>& b, double Sample::*field) {
  std::vector<double> values;
  values.reserve(a.size());
  for (size_t i = 0; i < a.size(); ++i) values.push_back(a[i].*field / b[i].*field);
  return quartiles(values);
}

}  // namespace

Quartiles quartiles(const std::vector<double>& values) {
  return {quantile(values, 0.25), quantile(values, 0.5), quantile(values, 0.75)};
}

Sample time_runs(const std::function<void()>& run, int runs) {
  const double cpu = cpu_now_ms();
  const auto start = std::chrono::steady_clock::now();
  for (int i = 0; i < runs; ++i) run();
  const double wall =
      std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
  return {wall / runs, (cpu_now_ms() - cpu) / runs};
}

Pair compare(const std::string& work, const std::string& size, const Work& ours, const Work& rival,
             int repetitions, int inner) {
  ours.run();
  rival.run();
  std::vector<Sample> a, b;
  for (int i = 0; i < repetitions; ++i) {
    a.push_back(time_runs(ours.run, inner));
    b.push_back(time_runs(rival.run, inner));
  }
  const auto side = [](const Work& w, const std::vector<Sample>& s) {
    return Side{w.name, summarise(s, &Sample::wall_ms), summarise(s, &Sample::cpu_ms)};
  };
  const Quartiles wall = ratios(a, b, &Sample::wall_ms), cpu = ratios(a, b, &Sample::cpu_ms);
  return {work, size, side(ours, a), side(rival, b), wall.median, cpu.median, wall, cpu};
}

std::string csv_header() {
  return "work,size,ours,ours_wall_median_ms,ours_wall_p95_ms,ours_cpu_median_ms,rival,rival_wall_median_ms,"
         "rival_wall_p95_ms,"
         "rival_cpu_median_ms,wall_ratio,cpu_ratio\n";
}

std::string csv_row(const Pair& p) {
  std::ostringstream out;
  out.precision(4);
  out << p.work << ',' << p.size << ',' << p.ours.name << ',' << p.ours.wall_ms.median << ','
      << p.ours.wall_ms.p95 << ',' << p.ours.cpu_ms.median << ',' << p.rival.name << ','
      << p.rival.wall_ms.median << ',' << p.rival.wall_ms.p95 << ',' << p.rival.cpu_ms.median << ','
      << p.wall_ratio << ',' << p.cpu_ratio << '\n';
  return out.str();
}

}  // namespace palpate::perf
