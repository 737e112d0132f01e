#include "capture/run/modulus/modulus_frames.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "capture/files/images/images.h"
#include "capture/files/measurements.h"
#include "capture/files/tables/csv_table.h"
#include "capture/files/tables/units.h"
#include "capture/series.h"
#include "engine/base/numbers.h"
#include "engine/stages/surface/elastic.h"
#include "palpate/error.h"

namespace palpate {
namespace {

// Scatter of an edge from frame to frame on the simulated waveguide, and what light that is not quite even
// leaves.
constexpr double kFlatEdge_px = 0.06, kBallEdge_px = 0.12;
constexpr double kAreaEdge_px = 1;        // of a contact's radius by its area
constexpr double kDepthNoise_mm = 0.001;  // of a depth, and as a fraction of it
constexpr double kDepthFraction = 0.002;
constexpr double kCore = 0.8;     // of a flat contact's radius: inside of it also where it is a square
constexpr double kDarkest = 0.4;  // of half of a flat contact's light: what counts as outside of it
constexpr double kInnerRim = 0.3, kOuterRim = 0.96;  // of a ball's contact: where the line is laid

/// Change from the untouched image as touch makes it, through the sensor's filter.
cv::Mat change_of(const Frame& frame, const Frame& background, const Sensor& sensor) {
  cv::Mat image, rest, change;
  to_image(frame).convertTo(image, CV_32F);
  if (sensor.background.kind == BackgroundKind::None) {
    change = image;
  } else {
    to_image(background).convertTo(rest, CV_32F);
    change = sensor.signal == Signal::Darker ? cv::Mat(rest - image) : cv::Mat(image - rest);
  }
  const cv::Mat binomial = (cv::Mat_<float>(1, 5) << 1, 4, 6, 4, 1) / 16.0f;
  cv::sepFilter2D(change, change, CV_32F, binomial, binomial, {-1, -1}, 0, cv::BORDER_REPLICATE);
  return change;
}

double pressure_of(double gray, const ElasticCalibration& pad) {
  if (!(pad.limit_gray > 0)) return gray / pad.gray_per_MPa;
  const double fraction = std::min(gray, double{Elastic::largest_readable_gray(pad)}) / pad.limit_gray;
  return -std::log(1 - fraction) * pad.limit_gray / pad.gray_per_MPa;
}

// A frame's change, pixel by pixel.
struct ChangeMap {
  const std::vector<float>& gray;
  uint32_t width, height;

  double at(uint32_t x, uint32_t y) const { return double{gray[size_t{y} * width + x]}; }
};

// Spot of pixels that change by `least` or more.
struct Spot {
  double count = 0, mean_gray = 0;
  double x_px = 0, y_px = 0;
};

Spot spot_over(const ChangeMap& change, double least) {
  double n = 0, sum = 0, x_sum = 0, y_sum = 0;
  for (uint32_t y = 0; y < change.height; ++y)
    for (uint32_t x = 0; x < change.width; ++x) {
      const double g = change.at(x, y);
      if (g < least) continue;
      ++n;
      sum += g;
      x_sum += x;
      y_sum += y;
    }
  return {n, sum / n, x_sum / n, y_sum / n};
}

// A stiff face presses with its rim: its middle may carry half of the mean, and is inside all the same.
void find_flat_edge(const ChangeMap& change, const Sensor& sensor, Spot spot, ContactEdge& edge) {
  const double threshold = sensor.threshold_gray, pitch = sensor.pitch_mm_per_px;
  for (int i = 0; i < 4; ++i) spot = spot_over(change, std::max(spot.mean_gray / 4, threshold));
  edge.x_px = spot.x_px;
  edge.y_px = spot.y_px;
  edge.half_gray = std::max(spot.mean_gray / 2, threshold / 2);
  edge.core_px = kCore * std::sqrt(spot.count / kPi);
  // Pixels on the edge count by their fraction of the light: an edge along a row would else jump by a row.
  double area = 0;
  for (uint32_t y = 0; y < change.height; ++y)
    for (uint32_t x = 0; x < change.width; ++x)
      area += edge.in_core(x, y)
                  ? 1
                  : std::clamp((change.at(x, y) / edge.half_gray - kDarkest) / (2 - 2 * kDarkest), 0.0, 1.0);
  edge.radius_mm = std::sqrt(area / kPi) * pitch;
  edge.sd_mm = kFlatEdge_px * pitch;
}

// Change by distance from the middle, in rings one pixel wide.
struct Rings {
  std::vector<double> sum, number;

  Rings(const ChangeMap& change, const ContactEdge& edge, double radius_px) {
    for (uint32_t y = 0; y < change.height; ++y)
      for (uint32_t x = 0; x < change.width; ++x) {
        const auto ring = static_cast<size_t>(std::hypot(x - edge.x_px, y - edge.y_px));
        if (ring > 2 * static_cast<size_t>(radius_px) + 8) continue;
        if (ring >= sum.size()) {
          sum.resize(ring + 1);
          number.resize(ring + 1);
        }
        sum[ring] += change.at(x, y);
        ++number[ring];
      }
  }
};

// Where the rings' squared pressure falls to zero, by a fit to those inside `radius`; none where the fit does
// not determine it. A parabola in the squared distance: thin pads bend the line.
std::optional<double> next_radius(const Rings& rings, double radius, const ElasticCalibration& pad,
                                  double longest_side) {
  cv::Matx33d normal = cv::Matx33d::zeros();
  cv::Vec3d right(0, 0, 0);
  double n = 0;
  for (size_t i = 0; i < rings.sum.size(); ++i) {
    const double r = (static_cast<double>(i) + 0.5) / radius;
    if (r < kInnerRim || r > kOuterRim || rings.number[i] == 0) continue;
    const double p = pressure_of(rings.sum[i] / rings.number[i], pad);
    const cv::Vec3d row(1, r * r, r * r * r * r);
    normal += rings.number[i] * row * row.t();
    right += rings.number[i] * p * p * row;
    n += rings.number[i];
  }
  if (!(n > 20)) return std::nullopt;
  const cv::Vec3d c = normal.solve(right, cv::DECOMP_CHOLESKY);
  const double root = c[1] * c[1] - 4 * c[0] * c[2];
  if (!(c[0] > 0) || !(root >= 0)) return std::nullopt;
  const double next = radius * std::sqrt(2 * c[0] / (-c[1] + std::sqrt(root)));
  if (!(next < longest_side)) return std::nullopt;
  return next;
}

void find_ball_edge(const ChangeMap& change, const Sensor& sensor, const Spot& spot, ContactEdge& edge) {
  double radius = std::sqrt(spot.count / kPi);
  const Rings rings(change, edge, radius);
  for (int round = 0; round < 12; ++round) {
    const std::optional<double> next = next_radius(
        rings, radius, sensor.elastic, static_cast<double>(std::max(change.width, change.height)));
    if (!next) return;
    if (std::abs(*next - radius) < 1e-3) break;
    radius = *next;
  }
  edge.radius_mm = radius * sensor.pitch_mm_per_px;
  edge.sd_mm = kBallEdge_px * sensor.pitch_mm_per_px;
}

}  // namespace

ContactEdge find_edge(const std::vector<float>& change, uint32_t width, uint32_t height, const Sensor& sensor,
                      bool flat) {
  const ChangeMap map{change, width, height};
  const Spot spot = spot_over(map, sensor.threshold_gray);
  ContactEdge edge;
  edge.x_px = spot.x_px;
  edge.y_px = spot.y_px;
  edge.radius_mm = kNaN;
  if (!(spot.count > 20)) return edge;
  if (flat)
    find_flat_edge(map, sensor, spot, edge);
  else
    find_ball_edge(map, sensor, spot, edge);
  return edge;
}

SampleReader::SampleReader(gpu::Context& context, const Sensor& sensor, const Frame& background,
                           const Sample& sample, const std::string& series)
    : sensor_(sensor),
      sample_(sample),
      background_(background),
      pipeline_(context, for_rectified_frames(sensor), background.format,
                {.outputs =
                     sensor.reading == SurfaceReading::None ? Output::Force : Output::Force | Output::Surface,
                 .solver = SurfaceSolver::Best,
                 .separate = !series.empty()}) {
  pipeline_.set_background(background);
  if (!series.empty()) look_ahead(series, sensor, pipeline_, {});
}

std::optional<PressFrame> SampleReader::read(const Frame& frame) {
  pipeline_.submit(frame);
  const std::optional<Result> result = pipeline_.wait();
  const Touch& t = result->touch;
  const std::span<const float> depth = result->depth_mm();
  why_not_ = !t.contact           ? kUntouched
             : t.at_border        ? "the contact reaches the border"
             : t.saturated_px > 0 ? "saturated pixels"
                                  : "";
  if (!why_not_.empty()) return std::nullopt;
  PressFrame p;
  p.force_N = std::max(0.0, t.force_N.value);
  // The part of the force's error that all frames share is the setup's.
  p.force_sd_N = sensor_.force ? sensor_.force->residual_sd_N : 0;
  const uint32_t width = frame.format.width, height = frame.format.height;
  const double pitch = sensor_.pitch_mm_per_px;
  std::vector<char> inside;
  if (sensor_.reading == SurfaceReading::Elastic) {
    const cv::Mat change = change_of(frame, background_, sensor_);
    const std::vector<float> gray(change.begin<float>(), change.end<float>());
    const ContactEdge edge = find_edge(gray, width, height, sensor_, sample_.flat());
    // Half of a face's light has to count as contact: else its dim parts are missing in force and edge.
    if (sample_.flat() && edge.half_gray < sensor_.threshold_gray) {
      why_not_ = "a face with less than twice the threshold's light: more exposure, or press harder";
      return std::nullopt;
    }
    if (std::isfinite(edge.radius_mm)) p.radius_mm = {edge.radius_mm, edge.sd_mm};
    if (sample_.flat())
      for (uint32_t y = 0; y < height; ++y)
        for (uint32_t x = 0; x < width; ++x)
          inside.push_back(edge.in_core(x, y) || double{gray[size_t{y} * width + x]} >= edge.half_gray);
  } else if (t.area_px > 0) {
    p.radius_mm = {std::sqrt(static_cast<double>(t.area_px) / kPi) * pitch, kAreaEdge_px * pitch};
  }
  if (t.surface) {
    const auto with_sd = [](double depth_mm) {
      return PressValue{depth_mm, std::hypot(kDepthNoise_mm, kDepthFraction * depth_mm)};
    };
    p.depth_mm = with_sd(t.surface->depth_max_mm);
    double sum = 0, n = 0;
    for (size_t i = 0; i < inside.size(); ++i) {
      if (!inside[i]) continue;
      sum += double{depth[i]};
      ++n;
    }
    if (n > 0) p.mean_depth_mm = with_sd(sum / n);
  }
  return p;
}

std::vector<PressFrame> read_press_table(const std::filesystem::path& file, std::vector<std::string>& notes) {
  CsvTable table(file, "a table of presses");
  std::vector<size_t> read;
  const auto column = [&](std::initializer_list<std::string_view> names, Quantity quantity) {
    std::optional<QuantityColumn> found = find_quantity(table, names, quantity);
    if (found) read.push_back(found->index);
    if (found && !found->note.empty()) notes.push_back(found->note);
    return found;
  };
  struct Reading {
    std::optional<QuantityColumn> value, sd;
  };
  const auto lengths = [&](std::string_view name, std::string_view name_sd) {
    return Reading{column({name}, Quantity::Length_mm), column({name_sd}, Quantity::Length_mm)};
  };
  const Reading force{column({"force", "fz", "normal_force", "load"}, Quantity::Force_N),
                      column({"force_sd"}, Quantity::Force_N)},
      area{column({"area"}, Quantity::Area_mm2), column({"area_sd"}, Quantity::Area_mm2)},
      radius = lengths("radius", "radius_sd"), depth = lengths("depth", "depth_sd"),
      mean_depth = lengths("mean_depth", "mean_depth_sd"), approach = lengths("approach", "approach_sd");
  if (!force.value)
    throw Error(Failure::Input, "a column force_N in '" + file.string() + "'", "none",
                "force_N, and radius_mm or area_mm2, depth_mm, mean_depth_mm, approach_mm");
  if (const std::string unread = unread_columns(table, read); !unread.empty()) notes.push_back(unread);
  std::vector<PressFrame> frames;
  while (table.next()) {
    const auto at = [&](const std::optional<QuantityColumn>& c) {
      return c ? c->factor * table.number_if_any(c->index).value_or(kNaN) : kNaN;
    };
    const auto reading = [&](const Reading& r) {
      const double sd = at(r.sd);
      return PressValue{at(r.value), sd == sd ? sd : 0};
    };
    PressFrame f;
    f.force_N = at(force.value);
    if (f.force_N != f.force_N)
      throw Error(Failure::Input, "a force in every row of '" + file.string() + "'", "an empty cell",
                  "rows without a force left out");
    f.force_sd_N = at(force.sd) == at(force.sd) ? at(force.sd) : 0;
    f.radius_mm = reading(radius);
    if (const double mm2 = at(area.value); !f.radius_mm.known() && mm2 >= 0) {
      const double sd = at(area.sd);
      f.radius_mm.value = std::sqrt(mm2 / kPi);
      if (sd == sd && mm2 > 0) f.radius_mm.sd = sd / (2 * kPi * f.radius_mm.value);
    }
    f.depth_mm = reading(depth);
    f.mean_depth_mm = reading(mean_depth);
    f.approach_mm = reading(approach);
    frames.push_back(f);
  }
  if (frames.empty())
    throw Error(Failure::Input, "presses in '" + file.string() + "'", "no rows", "a header line and rows");
  turn_stage(frames, notes);
  return frames;
}

void turn_stage(std::vector<PressFrame>& frames, std::vector<std::string>& notes) {
  constexpr double kOpposite = -0.8;  // correlation with the force
  double n = 0, x = 0, y = 0, xx = 0, yy = 0, xy = 0;
  for (const PressFrame& f : frames) {
    if (!f.approach_mm.known()) continue;
    const double a = f.approach_mm.value, b = f.force_N;
    n += 1, x += a, y += b, xx += a * a, yy += b * b, xy += a * b;
  }
  const double spread = n > 1 ? (xx - x * x / n) * (yy - y * y / n) : 0;
  if (!(spread > 0) || (xy - x * y / n) > kOpposite * std::sqrt(spread)) return;
  for (PressFrame& f : frames)
    if (f.approach_mm.known()) f.approach_mm.value = -f.approach_mm.value;
  notes.emplace_back("the stage counts down while the force rises: its sign is turned");
}

std::string press_table(const std::vector<PressFrame>& frames) {
  std::string text =
      "force_N,force_sd_N,radius_mm,radius_sd_mm,depth_mm,depth_sd_mm,mean_depth_mm,mean_depth_sd_mm,"
      "approach_mm,approach_sd_mm\n";
  for (const PressFrame& f : frames) {
    text += shortest(f.force_N) + "," + shortest(f.force_sd_N);
    for (const PressValue* r : {&f.radius_mm, &f.depth_mm, &f.mean_depth_mm, &f.approach_mm})
      text += r->known() ? "," + shortest(r->value) + "," + shortest(r->sd) : ",,";
    text += "\n";
  }
  return text;
}

std::vector<double> read_approach_table(const std::filesystem::path& file,
                                        const std::vector<uint64_t>& frames,
                                        std::vector<std::string>& notes) {
  CsvTable table(file, "a table of approaches, columns frame,approach_mm");
  const size_t frame = table.require({"frame"}).front();
  const std::optional<QuantityColumn> approach = find_quantity(table, {"approach"}, Quantity::Length_mm);
  if (!approach) table.require({"approach_mm"});  // says that it is not there
  if (!approach->note.empty()) notes.push_back(approach->note);
  std::vector<std::array<double, 2>> rows;  // frame, mm
  while (table.next())
    rows.push_back({table.number_if_any(frame).value_or(kNaN),
                    approach->factor * table.number_if_any(approach->index).value_or(kNaN)});
  std::vector<double> found;
  for (const uint64_t wanted : frames) {
    double value = kNaN;
    const auto at = static_cast<double>(wanted);
    for (size_t i = 0; i < rows.size(); ++i) {
      const auto [x, y] = rows[i];
      if (x == at) value = y;
      if (i == 0) continue;
      const auto [x0, y0] = rows[i - 1];
      if (x0 < at && at < x) value = y0 + (y - y0) * (at - x0) / (x - x0);
    }
    found.push_back(value);
  }
  return found;
}

}  // namespace palpate
