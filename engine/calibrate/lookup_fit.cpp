#include "engine/calibrate/lookup_fit.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <numbers>

#include "engine/sensor/lookup_depth.h"
#include "palpate/error.h"

namespace palpate {
namespace {
constexpr size_t kBins = 64;
constexpr size_t kLeastSamples = 200;
constexpr uint32_t kSectors = 8;
// Share of the depths' variance that the table explains, below which the change does not determine depth.
constexpr double kLeastExplainedDepth = 0.7;
}  // namespace

std::vector<double> filtered_change(const Frame& frame, const Frame& background, Signal signal) {
  const FrameFormat& f = frame.format;
  const int w = static_cast<int>(f.width), h = static_cast<int>(f.height);
  constexpr std::array<double, 5> kBinomial = {1.0 / 16, 4.0 / 16, 6.0 / 16, 4.0 / 16, 1.0 / 16};
  std::vector<double> change(size_t{f.width} * f.height), rows(change.size()), out(change.size());
  for (uint32_t y = 0; y < f.height; ++y)
    for (uint32_t x = 0; x < f.width; ++x) {
      const double d = static_cast<double>(frame.at(0, x, y)) - static_cast<double>(background.at(0, x, y));
      change[size_t{y} * f.width + x] = signal == Signal::Either   ? std::abs(d)
                                        : signal == Signal::Darker ? std::max(0.0, -d)
                                                                   : std::max(0.0, d);
    }
  const auto at = [&](const std::vector<double>& v, int x, int y) {
    return v[static_cast<size_t>(std::clamp(y, 0, h - 1)) * f.width +
             static_cast<size_t>(std::clamp(x, 0, w - 1))];
  };
  for (int y = 0; y < h; ++y)
    for (int x = 0; x < w; ++x)
      for (int k = -2; k <= 2; ++k)
        rows[static_cast<size_t>(y) * static_cast<size_t>(w) + static_cast<size_t>(x)] +=
            kBinomial[static_cast<size_t>(k + 2)] * at(change, x + k, y);
  for (int y = 0; y < h; ++y)
    for (int x = 0; x < w; ++x)
      for (int k = -2; k <= 2; ++k)
        out[static_cast<size_t>(y) * static_cast<size_t>(w) + static_cast<size_t>(x)] +=
            kBinomial[static_cast<size_t>(k + 2)] * at(rows, x, y + k);
  return out;
}

LookupFit::LookupFit(double pitch_mm_per_px) : pitch_mm_per_px_(pitch_mm_per_px) {}

void LookupFit::add_ball(const Frame& frame, const Frame& background, Signal signal, double cx_px,
                         double cy_px, double contact_radius_px, double ball_radius_mm,
                         const std::string& label, std::span<const uint8_t> mask) {
  const FrameFormat& f = frame.format;
  if (!(f == background.format) || f.channels != 1)
    throw Error(Failure::Input, "gray press and background images of one format", "other ones for " + label,
                "images of the same camera and sensor file");
  const double rim = contact_radius_px * pitch_mm_per_px_;
  if (!(contact_radius_px >= 4) || !(rim < ball_radius_mm))
    throw Error(Failure::Input, "a contact of 4 px or more that is smaller than its ball",
                "contact radius " + std::to_string(rim) + " mm on a ball of radius " +
                    std::to_string(ball_radius_mm) + " mm for " + label,
                "checking the pitch of the sensor file and the radii");
  const std::vector<double> gray = filtered_change(frame, background, signal);
  const double rim_depth = std::sqrt(ball_radius_mm * ball_radius_mm - rim * rim);
  Press press;
  press.label = label;
  for (uint32_t y = 0; y < f.height; ++y)
    for (uint32_t x = 0; x < f.width; ++x) {
      const double dx = x - cx_px, dy = y - cy_px, r = std::hypot(dx, dy);
      const size_t i = size_t{y} * f.width + x;
      if (r >= contact_radius_px || (!mask.empty() && mask[i])) continue;
      const uint32_t a = frame.at(0, x, y), b = background.at(0, x, y);
      if (a == 0 || b == 0 || a >= f.max_gray() || b >= f.max_gray()) continue;
      const double r_mm = r * pitch_mm_per_px_;
      const double turn = (std::atan2(dy, dx) / std::numbers::pi + 1) / 2 * kSectors;
      press.samples.push_back({gray[i], std::sqrt(ball_radius_mm * ball_radius_mm - r_mm * r_mm) - rim_depth,
                               static_cast<uint32_t>(turn) % 2});
    }
  presses_.push_back(std::move(press));
}

// Means of depth in bins of change that hold equally many samples, made monotone by pooling neighbours that
// are out of order, and drawn out to the largest change seen.
std::vector<std::array<double, 2>> LookupFit::table(const std::vector<Sample>& samples) const {
  std::vector<Sample> sorted = samples;
  std::sort(sorted.begin(), sorted.end(), [](const Sample& a, const Sample& b) { return a.gray < b.gray; });
  struct Pool {
    double gray, depth, weight;
  };
  const double low = sorted.front().gray, high = sorted.back().gray;
  // Bins of equal width in gray, so that the rare deepest pixels are not lost among the many flat ones.
  std::vector<Pool> bins(kBins, Pool{0, 0, 0}), pools;
  for (const Sample& s : sorted) {
    const double place = high > low ? (s.gray - low) / (high - low) : 0;
    Pool& bin = bins[std::min(kBins - 1, static_cast<size_t>(place * kBins))];
    bin.gray += s.gray;
    bin.depth += s.depth_mm;
    bin.weight += 1;
  }
  for (const Pool& bin : bins) {
    if (bin.weight < 1) continue;
    pools.push_back({bin.gray / bin.weight, bin.depth / bin.weight, bin.weight});
    while (pools.size() > 1 && pools.back().depth < pools[pools.size() - 2].depth) {
      const Pool b = pools.back();
      pools.pop_back();
      Pool& a = pools.back();
      const double weight = a.weight + b.weight;
      a = {(a.gray * a.weight + b.gray * b.weight) / weight,
           (a.depth * a.weight + b.depth * b.weight) / weight, weight};
    }
  }
  std::vector<std::array<double, 2>> points;
  if (pools.empty()) return points;
  // Down to depth 0 along the first slope, but not below no change.
  if (pools.size() > 1 && pools[0].depth > 0) {
    const double slope = (pools[1].depth - pools[0].depth) / (pools[1].gray - pools[0].gray);
    const double zero = slope > 0 ? pools[0].gray - pools[0].depth / slope : low;
    points.push_back({std::clamp(zero, 0.0, std::nextafter(pools[0].gray, 0.0)), 0});
  }
  for (const Pool& p : pools) points.push_back({p.gray, std::max(0.0, p.depth)});
  if (points.size() > 1 && high > points.back()[0] + 1e-6) {
    const auto& [gray, depth] = points.back();
    const auto& before = points[points.size() - 2];
    const double slope = (depth - before[1]) / (gray - before[0]);
    points.push_back({high, depth + slope * (high - gray)});
  }
  return points;
}

LookupFitResult LookupFit::solve() const {
  std::vector<Sample> all;
  for (const Press& p : presses_) all.insert(all.end(), p.samples.begin(), p.samples.end());
  if (all.size() < kLeastSamples)
    throw Error(Failure::Input, std::to_string(kLeastSamples) + " pixels of contact or more",
                std::to_string(all.size()) + " in " + std::to_string(presses_.size()) + " presses",
                "deeper presses of a ball");
  LookupFitResult result;
  result.by_press = presses_.size() > 1;
  double square = 0, cap_square = 0, pixels = 0;
  const auto judge = [&](const std::vector<Sample>& fitted, const std::vector<Sample>& judged,
                         HeldOutLookup& h, double& sum) {
    const LookupCalibration table_only{table(fitted), 0, {}};
    for (const Sample& s : judged) {
      const double error = lookup_depth_mm(table_only, s.gray) - s.depth_mm;
      sum += error * error;
      h.depth_error_mm += error;
      h.largest_depth_mm = std::max(h.largest_depth_mm, s.depth_mm);
      h.cap_rms_mm += s.depth_mm * s.depth_mm;
      h.contact_px += 1;
    }
  };
  for (size_t i = 0; i < presses_.size(); ++i) {
    HeldOutLookup h;
    h.label = presses_[i].label;
    double sum = 0;
    if (result.by_press) {
      std::vector<Sample> others;
      for (size_t j = 0; j < presses_.size(); ++j)
        if (j != i) others.insert(others.end(), presses_[j].samples.begin(), presses_[j].samples.end());
      if (!others.empty()) judge(others, presses_[i].samples, h, sum);
    } else {
      for (const uint32_t out : {0u, 1u}) {
        std::vector<Sample> in, judged;
        for (const Sample& s : presses_[i].samples) (s.group == out ? judged : in).push_back(s);
        if (!in.empty()) judge(in, judged, h, sum);
      }
    }
    const double n = std::max<double>(1, static_cast<double>(h.contact_px));
    square += sum;
    cap_square += h.cap_rms_mm;
    pixels += n;
    h.cap_rms_mm = std::sqrt(h.cap_rms_mm / n);
    h.depth_rmse_mm = std::sqrt(sum / n);
    h.depth_error_mm /= n;
    result.presses.push_back(std::move(h));
  }
  result.depth_rmse_mm = std::sqrt(square / pixels);
  result.cap_rms_mm = std::sqrt(cap_square / pixels);
  double mean = 0, spread = 0;
  for (const Sample& s : all) mean += s.depth_mm / static_cast<double>(all.size());
  for (const Sample& s : all)
    spread += (s.depth_mm - mean) * (s.depth_mm - mean) / static_cast<double>(all.size());
  const double explained = spread > 0 ? 1 - result.depth_rmse_mm * result.depth_rmse_mm / spread : 0;
  result.calibration.points = table(all);
  result.calibration.depth_sd_mm = result.depth_rmse_mm;
  if (!(explained >= kLeastExplainedDepth) || result.calibration.points.size() < 2)
    throw Error(Failure::Input, "a change of gray that predicts the depth of held-out pixels",
                std::to_string(static_cast<int>(std::lround(100 * std::max(0.0, explained)))) +
                    " % of the depths explained",
                "a gel whose gray grows with depth, and checked radius and pitch");
  return result;
}

}  // namespace palpate
