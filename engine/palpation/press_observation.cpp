#include "engine/palpation/press_observation.h"

#include <algorithm>
#include <cmath>

#include "engine/base/numbers.h"
#include "engine/stages/surface/elastic.h"

namespace palpate {
namespace {

constexpr size_t kMostAveraged = 12;  // averaged for one load
constexpr double kMostLimited = 0.02, kWholeCell = 0.9;

/// Pressure of a change of gray, Pa.
double pressure_Pa(const ElasticCalibration& pad, double gray) {
  const double pressure_MPa =
      pad.limit_gray > 0
          ? -pad.limit_gray / pad.gray_per_MPa *
                std::log(1 - std::min(gray, Elastic::largest_readable_gray(pad)) / pad.limit_gray)
          : gray / pad.gray_per_MPa;
  return 1e6 * pressure_MPa;
}

/// Nodes of a side and, for each of its pixels, the node it lies around (`nodes`: none).
std::vector<uint32_t> nodes_of(uint32_t pixels, double pixel_mm, double pitch_mm, uint32_t& nodes) {
  nodes = 2 * static_cast<uint32_t>(std::floor(pixels * pixel_mm / (2 * pitch_mm))) + 1;
  std::vector<uint32_t> node(pixels);
  for (uint32_t i = 0; i < pixels; ++i) {
    const long n = std::lround((i - (pixels - 1) / 2.0) * pixel_mm / pitch_mm + (nodes - 1) / 2.0);
    node[i] = n >= 0 && n < long{nodes} ? static_cast<uint32_t>(n) : nodes;
  }
  return node;
}

}  // namespace

void NodeSums::add(const NodeSums& other) {
  pressure_Pa.resize(other.pressure_Pa.size());
  limited.resize(other.limited.size());
  for (size_t i = 0; i < pressure_Pa.size(); ++i) {
    pressure_Pa[i] += other.pressure_Pa[i];
    limited[i] += other.limited[i];
  }
  window_Pa += other.window_Pa;
  frames += other.frames;
}

PressureNodes::PressureNodes(const Sensor& sensor, const Frame& background, double pitch_mm)
    : sensor_(sensor), background_(background), pitch_mm_(pitch_mm) {
  const FrameFormat& f = background.format;
  const std::vector<uint32_t> node_of_x = nodes_of(f.width, sensor.pitch_mm_per_px, pitch_mm, width_);
  node_of_y_ = nodes_of(f.height, sensor.pitch_mm_per_px, pitch_mm, height_);
  // Nodes of a row follow each other without gaps, after pixels that belong to none.
  for (uint32_t node = 0; node <= width_; ++node) {
    const auto in = [&](uint32_t n) { return n >= node && n < width_; };
    const auto first = std::find_if(node_of_x.begin(), node_of_x.end(), in);
    const auto last =
        std::find_if(node_of_x.rbegin(), node_of_x.rend(), [&](uint32_t n) { return n < width_; });
    first_x_.push_back(
        static_cast<uint32_t>((first == node_of_x.end() ? last.base() : first) - node_of_x.begin()));
  }
  const auto most = static_cast<int>(f.max_gray());
  for (int change = -most; change <= most; ++change)
    table_.push_back(
        static_cast<float>(pressure_Pa(sensor.elastic, sensor.signal == Signal::Darker ? -change : change)));
}

template <typename Pixel>
void PressureNodes::read_rows(const Frame& frame, NodeSums& sums) const {
  const FrameFormat& f = frame.format;
  const float* table = table_.data() + f.max_gray();
  const uint32_t limit = sensor_.saturation_gray;
  const auto sum_of = [&](const Pixel* now, const Pixel* rest, uint32_t from, uint32_t to,
                          uint32_t& limited) {
    float sum = 0;
    for (uint32_t x = from; x < to; ++x) {
      sum += table[static_cast<int>(now[x]) - static_cast<int>(rest[x])];
      limited += now[x] >= limit;
    }
    return static_cast<double>(sum);
  };
  for (uint32_t y = 0; y < f.height; ++y) {
    // Rows begin where a pixel may: 16 bit ones on even places of an aligned buffer.
    const auto* now = reinterpret_cast<const Pixel*>(frame.row(0, y));
    const auto* rest = reinterpret_cast<const Pixel*>(background_.row(0, y));
    uint32_t beside = 0;
    sums.window_Pa +=
        sum_of(now, rest, 0, first_x_.front(), beside) + sum_of(now, rest, first_x_.back(), f.width, beside);
    for (uint32_t i = 0; i < width_; ++i) {
      uint32_t limited = 0;
      const double sum = sum_of(now, rest, first_x_[i], first_x_[i + 1], limited);
      sums.window_Pa += sum;
      if (node_of_y_[y] >= height_) continue;
      const size_t n = size_t{node_of_y_[y]} * width_ + i;
      sums.pressure_Pa[n] += sum;
      sums.limited[n] += limited;
    }
  }
}

NodeSums PressureNodes::read(const Frame& frame) const {
  NodeSums sums;
  sums.frames = 1;
  sums.pressure_Pa.resize(size_t{width_} * height_);
  sums.limited.resize(sums.pressure_Pa.size());
  if (frame.format.bit_depth > 8)
    read_rows<uint16_t>(frame, sums);
  else
    read_rows<uint8_t>(frame, sums);
  return sums;
}

double PressureNodes::window_force_N(const NodeSums& sums) const {
  const double pixel_m2 = 1e-6 * sensor_.pitch_mm_per_px * sensor_.pitch_mm_per_px;
  return sums.frames > 0 ? sums.window_Pa * pixel_m2 / sums.frames : 0;
}

std::array<double, 2> PressureNodes::window_mm() const {
  return {background_.format.width * sensor_.pitch_mm_per_px,
          background_.format.height * sensor_.pitch_mm_per_px};
}

PressureMap PressureNodes::map(const NodeSums& sums, double& noise_Pa, double& limited_fraction) const {
  PressureMap map{width_, height_, {pitch_mm_, pitch_mm_}, {}};
  std::vector<uint32_t> rows(height_);
  for (const uint32_t node : node_of_y_)
    if (node < height_) ++rows[node];
  const double whole = std::pow(pitch_mm_ / sensor_.pitch_mm_per_px, 2);
  double peak_Pa = 0;
  size_t limited = 0, seen = 0;
  for (uint32_t j = 0; j < height_; ++j)
    for (uint32_t i = 0; i < width_; ++i) {
      const size_t n = size_t{j} * width_ + i;
      const double pixels = static_cast<double>(first_x_[i + 1] - first_x_[i]) * rows[j];
      const bool covered = pixels >= kWholeCell * whole;
      const bool good = covered && sums.limited[n] <= kMostLimited * pixels * sums.frames;
      limited += covered && !good;
      seen += covered;
      const double value = good ? sums.pressure_Pa[n] / (pixels * sums.frames) : kNaN;
      if (good) peak_Pa = std::max(peak_Pa, value);
      map.values.push_back(static_cast<float>(value));
    }
  limited_fraction = seen > 0 ? static_cast<double>(limited) / static_cast<double>(seen) : 1;
  // Error of the calibration, and rounding to gray levels that averaging does not remove.
  noise_Pa = std::hypot(relative_sd() * peak_Pa, 0.3 * Pa_per_gray());
  return map;
}

std::vector<size_t> frames_near(const std::vector<double>& force_N, double at_N, double highest_N) {
  size_t last = 0;
  double most = 0;
  for (size_t i = 0; i < force_N.size(); ++i)
    if (force_N[i] > most) most = force_N[last = i];
  // The hold at the highest force belongs to it.
  while (last + 1 < force_N.size() && force_N[last + 1] > (1 - kLoadWidth) * highest_N) ++last;
  std::vector<size_t> near;
  for (size_t i = 0; i <= last && i < force_N.size(); ++i)
    if (std::abs(force_N[i] - at_N) <= kLoadWidth * highest_N) near.push_back(i);
  std::stable_sort(near.begin(), near.end(), [&](size_t a, size_t b) {
    return std::abs(force_N[a] - at_N) < std::abs(force_N[b] - at_N);
  });
  if (near.size() > kMostAveraged) near.resize(kMostAveraged);
  return near;
}

std::vector<double> even_loads(double top_N, uint32_t count) {
  std::vector<double> loads_N;
  for (uint32_t k = 1; k <= count; ++k) loads_N.push_back(top_N * k / count);
  return loads_N;
}

lump::Observation press_observation(const PressureNodes& nodes, const std::vector<LoadSums>& loads,
                                    const BlockSetting& block) {
  lump::Observation r;
  r.block_mm = block.block_mm;
  r.young_Pa = block.young_Pa;
  r.window_mm = block.window_mm;
  r.uneven_sd = std::max(r.uneven_sd, nodes.relative_sd());
  for (const LoadSums& load : loads) {
    r.pressure_Pa.push_back(nodes.map(load.nodes, r.noise_Pa, r.saturated_fraction));
    r.force_N.push_back(load.force_N);
  }
  // The plate goes on beside the block.
  for (PressureMap& map : r.pressure_Pa)
    for (uint32_t j = 0; j < map.height; ++j)
      for (uint32_t i = 0; i < map.width; ++i) {
        const double pitch_mm = map.pitch_mm[0];
        const double x = block.window_mm[0] + (i - (map.width - 1) / 2.0) * pitch_mm,
                     y = block.window_mm[1] + (j - (map.height - 1) / 2.0) * pitch_mm;
        if (std::abs(x) + pitch_mm / 2 > block.block_mm[0] / 2 ||
            std::abs(y) + pitch_mm / 2 > block.block_mm[1] / 2)
          map.values[size_t{j} * map.width + i] = static_cast<float>(kNaN);
      }
  return r;
}

}  // namespace palpate
