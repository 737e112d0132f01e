#include "capture/live/latency.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>
#include <utility>
#include <vector>

#include "engine/base/text.h"
#include "palpate/error.h"

namespace palpate {
namespace {

constexpr double kShortest_ms = 1e-3;
const double kBinWidth = std::log(1.01);

}  // namespace

void Durations::add(double ms) {
  const double bin = ms > kShortest_ms ? std::floor(std::log(ms / kShortest_ms) / kBinWidth) : 0;
  ++bins_[static_cast<size_t>(std::min(bin, static_cast<double>(kBins - 1)))];
  ++count_;
}

Percentiles Durations::percentiles() const {
  Percentiles p{.count = count_};
  const auto at = [&](double fraction) {
    const double wanted = fraction * static_cast<double>(count_ - 1);
    uint64_t below = 0;
    for (size_t i = 0; i < kBins; ++i) {
      below += bins_[i];
      // The middle of the bin, on the scale that the bins are even on.
      if (static_cast<double>(below) > wanted)
        return kShortest_ms * std::exp(kBinWidth * (static_cast<double>(i) + 0.5));
    }
    return 0.0;
  };
  if (count_ > 0) p.p50_ms = at(0.5), p.p95_ms = at(0.95), p.p99_ms = at(0.99);
  return p;
}

void RecentDurations::add(double ms) {
  ms_.push_back(ms);
  if (ms_.size() > kRecent) ms_.pop_front();
}

Percentiles RecentDurations::percentiles() const {
  Percentiles p{.count = ms_.size()};
  if (ms_.empty()) return p;
  std::vector<double> sorted(ms_.begin(), ms_.end());
  std::sort(sorted.begin(), sorted.end());
  const auto at = [&](double fraction) {
    return sorted[static_cast<size_t>(fraction * static_cast<double>(sorted.size() - 1))];
  };
  p.p50_ms = at(0.5), p.p95_ms = at(0.95), p.p99_ms = at(0.99);
  return p;
}

LatencyLog::LatencyLog(const std::filesystem::path& file, std::function<void(const FrameTimes&)> on_times)
    : on_times_(std::move(on_times)) {
  if (file.empty()) return;
  file_.emplace(file);
  file_->append("frame,exposed_ns,delivered_ns,measured_ns,shown_ns,to_measured_ms,to_shown_ms");
}

void LatencyLog::add(const FrameTimes& t) {
  const std::lock_guard lock(mutex_);
  if (t.start_ns() == 0) return;
  from_exposure_ = from_exposure_ && t.exposed_ns != 0;
  measured_.add(t.to_measured_ms());
  if (t.shown_ns != 0) shown_.add(t.to_shown_ms());
  if (on_times_) on_times_(t);
  if (!file_ || refused_) return;
  const auto if_known = [](int64_t ns) { return ns != 0 ? std::to_string(ns) : std::string(); };
  std::string latencies = text("%.3f,", t.to_measured_ms());
  std::string row = std::to_string(t.sequence) + "," + if_known(t.exposed_ns) + "," +
                    if_known(t.delivered_ns) + "," + std::to_string(t.measured_ns) + "," +
                    if_known(t.shown_ns) + "," + latencies;
  if (t.shown_ns != 0) {
    latencies = text("%.3f", t.to_shown_ms());
    row += latencies;
  }
  try {
    file_->append(row);
  } catch (const Error&) {
    refused_ = std::current_exception();
  }
}

void LatencyLog::close() {
  const std::lock_guard lock(mutex_);
  if (refused_) std::rethrow_exception(refused_);
  if (file_) file_->close();
}

Percentiles LatencyLog::to_measured() const {
  const std::lock_guard lock(mutex_);
  return measured_.percentiles();
}

Percentiles LatencyLog::to_shown() const {
  const std::lock_guard lock(mutex_);
  return shown_.percentiles();
}

bool LatencyLog::from_exposure() const {
  const std::lock_guard lock(mutex_);
  return from_exposure_ && measured_.percentiles().count > 0;
}

}  // namespace palpate
