#include "tests/pipeline/fuzz_cases.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <sstream>

#include "engine/numeric/poisson_dct.h"
#include "engine/pipeline/pipeline_access.h"
#include "engine/pipeline/specks.h"
#include "engine/stages/surface/surface.h"
#include "palpate/error.h"
#include "tests/pipeline/dice.h"
#include "tests/pipeline/fuzz_gel.h"
#include "tests/reference/contact.h"
#include "tests/reference/slope.h"
#include "tests/support/pipelines.h"
#include "tests/support/stage_run.h"

namespace palpate::fuzz {
namespace {

uint32_t side(Dice& dice, uint32_t most) {
  constexpr std::array<uint32_t, 16> kTelling = {1, 2, 3, 4, 5, 7, 8, 9, 15, 16, 17, 31, 32, 33, 64, 65};
  if (dice.one_in(2)) return std::min(dice.pick(kTelling), most);
  return dice.between(1, most);
}

uint32_t value_of(Pattern pattern, const FrameFormat& f, uint32_t x, uint32_t y, Dice& dice, uint32_t a,
                  uint32_t b) {
  const uint32_t top = f.max_gray();
  const double u = (x + 0.5) / f.width, v = (y + 0.5) / f.height;
  switch (pattern) {
    case Pattern::Black:
      return 0;
    case Pattern::White:
      return top;
    case Pattern::Gray:
      return a % (top + 1);
    case Pattern::Noise:
      return dice.below(top + 1);
    case Pattern::OnePixel:
      return x == a % f.width && y == b % f.height ? top : 0;
    case Pattern::Checker:
      return (x / (1 + a % 4) + y / (1 + a % 4)) % 2 ? top : 0;
    case Pattern::Stripes:
      return (a % 2 ? x : y) / (1 + b % 5) % 2 ? top : top / 3;
    case Pattern::Ramp:
      return static_cast<uint32_t>(top * (a % 2 ? u : v));
    case Pattern::Blob: {
      const double cx = (a % 97) / 97.0, cy = (b % 89) / 89.0, r2 = (u - cx) * (u - cx) + (v - cy) * (v - cy);
      return static_cast<uint32_t>(0.05 * top + 0.9 * top * std::exp(-r2 / 0.05));
    }
    case Pattern::Edge:
      return (a % 2 ? u : v) > (b % 101) / 101.0 ? top : 0;
  }
  return 0;
}

Frame draw(Pattern pattern, const FrameFormat& format, uint64_t seed) {
  Dice dice(seed);
  const uint32_t a = dice.below(1u << 30), b = dice.below(1u << 30);
  Frame frame;
  frame.reshape(format);
  for (uint32_t c = 0; c < format.channels; ++c)
    for (uint32_t y = 0; y < format.height; ++y)
      for (uint32_t x = 0; x < format.width; ++x)
        frame.set(c, x, y, value_of(pattern, format, x, y, dice, a + c, b));
  return frame;
}

Frame image_of(const Case& c, uint32_t i) {
  // The first image has the case's pattern, the next ones others: nothing may stay from the one before.
  const auto pattern = static_cast<Pattern>((static_cast<uint32_t>(c.image) + 3 * i) % kPatterns);
  return draw(
      c.stage == Stage::Slope && c.sensor.reading == SurfaceReading::Shading ? Pattern::Blob : pattern,
      c.format, c.seed * 31 + i);
}
Frame background_of(const Case& c) {
  return draw(c.background, c.format, c.seed * 31 + 17);
}

template <typename A, typename B>
std::string unequal(const char* what, const A& got, const B& wanted) {
  std::ostringstream out;
  out.precision(17);
  out << what << ": got " << got << ", wanted " << wanted;
  return out.str();
}

std::string compare(const ContactMoments& got, const ContactMoments& wanted) {
#define PALPATE_COMPARE(field) \
  if (got.field != wanted.field) return unequal(#field, got.field, wanted.field)
  PALPATE_COMPARE(area);
  PALPATE_COMPARE(gray);
  PALPATE_COMPARE(gray_x);
  PALPATE_COMPARE(gray_y);
  PALPATE_COMPARE(x);
  PALPATE_COMPARE(y);
  PALPATE_COMPARE(xx);
  PALPATE_COMPARE(xy);
  PALPATE_COMPARE(yy);
  PALPATE_COMPARE(peak);
  PALPATE_COMPARE(saturated);
#undef PALPATE_COMPARE
  return {};
}

std::string at(uint32_t image, uint32_t x, uint32_t y) {
  return "image " + std::to_string(image) + " at " + std::to_string(x) + ", " + std::to_string(y) + " ";
}

std::string contact_difference(gpu::Context& context, const Case& c) {
  ContactRun run(context, c.format, c.sensor, c.keep_filtered, c.tuning);
  const Frame rest = background_of(c);
  for (uint32_t i = 0; i < c.images; ++i) {
    const Frame image = image_of(c, i);
    const ContactAnswer answer = run(image, rest);
    if (const std::string where = compare(answer.moments, reference::moments(image, rest, c.sensor));
        !where.empty())
      return "image " + std::to_string(i) + " " + where;
    if (!c.keep_filtered) continue;
    const auto wanted = reference::filtered_change(image, rest, c.sensor.signal);
    for (uint32_t y = 0; y < c.format.height; ++y) {
      for (uint32_t x = 0; x < c.format.width; ++x) {
        const uint32_t want = wanted[size_t{y} * c.format.width + x] * answer.units_per_gray / 256;
        if (answer.filtered[size_t{y} * answer.pitch + x] != want)
          return at(i, x, y) + unequal("filtered", answer.filtered[size_t{y} * answer.pitch + x], want);
      }
    }
  }
  return {};
}

std::vector<float> read(const gpu::DeviceBuffer& from, const Grid& grid) {
  from.invalidate();
  const auto raw = from.as<const float>();
  std::vector<float> out;
  for (uint32_t y = 0; y < grid.height; ++y)
    for (uint32_t x = 0; x < grid.width; ++x) out.push_back(raw[size_t{y} * grid.pitch * 4 + x]);
  return out;
}

// Both kinds of slope stage: the one that fills pixels and cells of two by two of them, and the one for cells
// alone.
std::string slope_difference(gpu::Context& context, const Case& c) {
  const uint32_t w = c.format.width, h = c.format.height;
  const bool shading = c.sensor.reading == SurfaceReading::Shading;
  const Contact contact(context, c.sensor, c.format, shading, c.tuning);
  const Slope both(context, c.sensor, c.format, contact, RightSides::Pixels, c.tuning);
  const Slope cells_only(context, c.sensor, c.format, contact, RightSides::Cells, c.tuning);
  const Surface surface(context, w, h, Solve::Exact, c.tuning, true);
  FrameOnGpu images(context, c.format);
  const Grid grid = grid_for(w, h), half = coarser(grid);
  const gpu::DeviceBuffer records(context, "records", contact.record_bytes(), gpu::Memory::Readback);
  const gpu::DeviceBuffer pixels(context, "pixels", grid.bytes(), gpu::Memory::Readback);
  const gpu::DeviceBuffer cells(context, "cells", half.bytes(), gpu::Memory::Readback);
  const gpu::DeviceBuffer lone_cells(context, "cells alone", half.bytes(), gpu::Memory::Readback);
  const gpu::DeviceBuffer clipped(context, "clipped", both.clipped_bytes(), gpu::Memory::Readback);
  const gpu::DeviceBuffer lone_clipped(context, "clipped alone", both.clipped_bytes(), gpu::Memory::Readback);
  gpu::Commands commands(context);
  commands.begin();
  images.record(commands);
  contact.record(commands, images.frame, images.background, records);
  both.record(commands, images.frame, images.background, surface, clipped);
  commands.copy(surface.right_side().buffer, pixels, grid.bytes());
  commands.copy(surface.coarse_right_side().buffer, cells, half.bytes());
  commands.barrier();
  cells_only.record(commands, images.frame, images.background, surface, lone_clipped);
  commands.copy(surface.coarse_right_side().buffer, lone_cells, half.bytes());
  commands.host_barrier();
  commands.end();
  const Frame rest = background_of(c);
  for (uint32_t i = 0; i < c.images; ++i) {
    const Frame image = image_of(c, i);
    images.write(image, rest);
    commands.submit();
    commands.wait();
    const auto slopes = shading ? reference::shading_slopes(image, rest, c.sensor)
                                : reference::photometric_slopes(image, rest, c.sensor);
    const auto wanted = reference::right_side(slopes, w, h, c.sensor.pitch_mm_per_px);
    std::vector<double> sums(size_t{half.width} * half.height);
    double scale = 1e-9;
    for (size_t k = 0; k < wanted.size(); ++k) {
      scale = std::max(scale, std::abs(wanted[k]));
      sums[k / w / 2 * half.width + k % w / 2] += wanted[k];
    }
    const double tolerance = (shading ? 1e-3 : 1e-4) * scale;
    const auto compare_maps = [&](const char* what, const gpu::DeviceBuffer& from, const Grid& of,
                                  const std::vector<double>& want) {
      const std::vector<float> got = read(from, of);
      for (size_t k = 0; k < want.size(); ++k)
        if (!(std::abs(double{got[k]} - want[k]) <= tolerance))
          return at(i, static_cast<uint32_t>(k % of.width), static_cast<uint32_t>(k / of.width)) +
                 unequal(what, got[k], want[k]);
      return std::string();
    };
    for (const std::string& where : {compare_maps("right side", pixels, grid, wanted),
                                     compare_maps("right side of cells", cells, half, sums),
                                     compare_maps("right side of cells alone", lone_cells, half, sums)})
      if (!where.empty()) return where;
    for (const gpu::DeviceBuffer* from : {&clipped, &lone_clipped}) {
      const uint64_t got = both.clipped_px(from->as<const uint32_t>());
      if (got + slopes.on_the_edge < slopes.clipped || got > slopes.clipped + slopes.on_the_edge)
        return at(i, 0, 0) + unequal("clipped pixels", got, slopes.clipped);
    }
  }
  return {};
}

std::string surface_difference(gpu::Context& context, const Case& c) {
  const uint32_t w = c.format.width, h = c.format.height;
  Dice dice(c.seed);
  const double scale = std::pow(10.0, c.exponent);
  std::vector<float> g(size_t{2} * w * h);
  const Frame shape = draw(c.image, c.format, c.seed);
  for (size_t i = 0; i < g.size(); ++i) {
    const auto x = static_cast<uint32_t>(i / 2 % w), y = static_cast<uint32_t>(i / 2 / w);
    const double value = double(shape.at(0, x, y)) / c.format.max_gray() - 0.3;
    g[i] = static_cast<float>(scale * (i % 2 ? value * value : value));
  }
  const Heights exact = integrate_gradients(context, g, h, w, Solve::Exact);
  reference::Slopes slopes;
  for (size_t i = 0; i < g.size(); i += 2) {
    slopes.p.push_back(double{g[i]} / scale);
    slopes.q.push_back(double{g[i + 1]} / scale);
  }
  std::vector<double> wanted = reference::right_side(slopes, w, h, 1);
  PoissonDct(w, h).solve(wanted.data(), wanted.data(), w);
  const Heights got = integrate_gradients(context, g, h, w, c.solve);
  const auto [low, high] = std::minmax_element(wanted.begin(), wanted.end());
  // A field that nearly cancels leaves a surface of rounding: judged against the slopes then.
  const double range = std::max(*high - *low, 1e-3);
  // A solve that stops early flattens shapes as narrow as pixels: judged on smooth shapes only.
  const bool early = c.solve == Solve::Live;
  const bool smooth = c.image == Pattern::Ramp || c.image == Pattern::Blob || c.image == Pattern::Gray;
  const double tolerance = early ? (smooth ? 0.15 : 10.0) : c.solve == Solve::Converged ? 1e-3 : 1e-4;
  for (const auto& [values, limit] : {std::pair{&exact.values, 1e-4}, {&got.values, tolerance}}) {
    for (size_t i = 0; i < wanted.size(); ++i) {
      const double found = double{(*values)[i]} / scale;
      if (!(std::abs(found - wanted[i]) <= limit * range))
        return at(0, static_cast<uint32_t>(i % w), static_cast<uint32_t>(i / w)) +
               unequal("height", found, wanted[i]);
    }
  }
  for (const double number :
       {got.statistics.residual, got.statistics.inconsistency, got.statistics.peak_to_valley})
    if (!std::isfinite(number)) return "evidence that is no number";
  return {};
}

std::string pipeline_difference(gpu::Context& context, const Case& c) {
  PipelineOptions options;
  options.outputs =
      c.sensor.reading == SurfaceReading::None ? Output::Force : Output::Force | Output::Surface;
  options = solved(c.solve, options);
  options.slots = 2;
  options.fixed_light = true;  // noise has no light
  options.any_picture = true;  // and no picture
  Pipeline pipeline = PipelineAccess::tuned(context, c.sensor, c.format, options, c.tuning);
  const Frame untouched = background_of(c);
  pipeline.set_background(untouched);
  // A gel's specks are filled before anything is summed: their own test says with what.
  Specks specks(c.format, dead_gray(c.sensor));
  const bool fills = c.sensor.reading == SurfaceReading::Photometric;
  const Frame rest = fills ? specks.set_background(untouched) : untouched;
  for (uint32_t i = 0; i < c.images; ++i) {
    Frame image = image_of(c, i);
    image.sequence = i;
    if (!pipeline.submit(image)) return "a free slot was refused";
    const Result result = *pipeline.wait();
    const Touch& t = result.touch;
    const ContactMoments m = reference::moments(fills ? specks.fill(image) : image, rest, c.sensor);
    const std::string place = "image " + std::to_string(i) + " ";
    if (t.contact != (m.area > 0)) return place + unequal("contact", t.contact, m.area > 0);
    if (t.gray_sum != static_cast<double>(m.gray) / 256)
      return place + unequal("gray_sum", t.gray_sum, static_cast<double>(m.gray) / 256);
    if (t.area_px != m.area) return place + unequal("area_px", t.area_px, m.area);
    if (t.saturated_px != m.saturated) return place + unequal("saturated_px", t.saturated_px, m.saturated);
    if (t.peak_gray != m.peak / 256.0) return place + unequal("peak_gray", t.peak_gray, m.peak / 256.0);
    if (t.contact) {
      if (!(t.centroid_x_px >= 0 && t.centroid_x_px <= c.format.width - 1))
        return place + unequal("centroid_x_px", t.centroid_x_px, "inside");
      if (!(t.centroid_y_px >= 0 && t.centroid_y_px <= c.format.height - 1))
        return place + unequal("centroid_y_px", t.centroid_y_px, "inside");
      if (m.gray > 0) {
        const double x = c.format.width / 2 + static_cast<double>(m.gray_x) / static_cast<double>(m.gray);
        if (t.centroid_x_px != x) return place + unequal("centroid_x_px", t.centroid_x_px, x);
      }
      for (const double axis : {t.ellipse.major_mm, t.ellipse.minor_mm, t.ellipse.angle_rad})
        if (!std::isfinite(axis)) return place + unequal("ellipse", axis, "a number");
    }
    if (wants(options.outputs, Output::Surface)) {
      const std::vector<float> depth = depth_map(result);
      for (size_t k = 0; k < depth.size(); ++k)
        if (!std::isfinite(depth[k]))
          return at(i, static_cast<uint32_t>(k % c.format.width), static_cast<uint32_t>(k / c.format.width)) +
                 unequal("depth", depth[k], "a number");
      if (!std::isfinite(t.surface->depth_max_mm) || !std::isfinite(t.surface->depth_offset_mm))
        return place + unequal("depth_max_mm", t.surface->depth_max_mm, "a number");
    }
  }
  return {};
}

constexpr std::array<const char*, kPatterns> kPatternNames = {
    "black", "white", "gray", "noise", "one pixel", "checker", "stripes", "ramp", "blob", "edge"};

}  // namespace

Case make_case(uint64_t seed, const Tuning& defaults) {
  const uint32_t roll = Dice(seed ^ 0x9e3779b97f4a7c15ull).below(100);
  const Stage stage = roll < 70   ? Stage::Contact
                      : roll < 84 ? Stage::Slope
                      : roll < 93 ? Stage::Surface
                      : roll < 97 ? Stage::Pipeline
                                  : Stage::Gel;
  return make_case(seed, defaults, stage);
}

Case make_case(uint64_t seed, const Tuning& defaults, Stage stage) {
  Dice dice(seed);
  Case c;
  c.seed = seed;
  c.stage = stage;
  c.tuning = defaults;
  if (stage == Stage::Gel) {
    make_gel(c);
    return c;
  }
  const bool color = dice.one_in(4);
  const uint32_t most = c.stage == Stage::Contact ? 160 : 100;
  c.format = {side(dice, most), side(dice, most), color ? 3u : 1u,
              color             ? 8
              : dice.one_in(20) ? dice.between(8, 16)
                                : dice.pick(std::array{8u, 12u, 16u})};
  if (c.stage == Stage::Contact && dice.one_in(40)) c.format.width = dice.between(1000, 3000);
  if (c.stage == Stage::Contact && dice.one_in(40)) c.format.height = dice.between(1000, 3000);
  c.images = c.stage == Stage::Surface ? 1 : 4;
  c.image = static_cast<Pattern>(dice.below(kPatterns));
  c.background = static_cast<Pattern>(dice.one_in(2) ? 0 : dice.below(kPatterns));
  c.keep_filtered = !color && dice.one_in(3);
  // Kernels take longest to compile and are cached by the driver: mostly a few tile heights and depths, now
  // and then any.
  const bool any = dice.one_in(20);
  c.tuning.contact_rows =
      any ? 2 * dice.between(1, shared::kMaxTileRows / 2) : dice.pick(std::array{6u, 32u, 64u});
  c.tuning.contact_rows_keeping = c.tuning.contact_rows;
  c.tuning.contact_tiles = dice.one_in(3);
  c.tuning.slope_tiles = dice.one_in(3);
  c.tuning.surface_tiles = dice.one_in(3);
  c.tuning.contact_workgroup = any ? 8 * dice.between(1, 16) : 32;

  Sensor& s = c.sensor;
  const uint32_t top = c.format.max_gray();
  s.name = "fuzz";
  s.pitch_mm_per_px = 0.01 + 0.1 * dice.unit();
  s.channels = c.format.channels;
  s.bit_depth = c.format.bit_depth;
  s.signal = dice.pick(std::array{Signal::Brighter, Signal::Darker, Signal::Either});
  s.threshold_gray = std::floor(128 * top * dice.pick(std::array{0.0, 0.01, 0.3, 0.5, 0.9, 1.0})) / 128;
  s.saturation_gray = dice.pick(std::array{top, top / 2 + 1, 1u});
  if (c.stage != Stage::Contact && !(c.stage == Stage::Pipeline && dice.one_in(3))) {
    s.reading = color ? SurfaceReading::Photometric : SurfaceReading::Shading;
    s.shading = {(0.3 + 0.7 * dice.unit()) * top, 0.2 + dice.unit()};
    for (auto* weights : {&s.photometric.wx, &s.photometric.wy})
      for (auto& row : *weights)
        for (double& weight : row) weight = 4 * dice.unit() - 2;
    s.max_slope = dice.pick(std::array{0.5, 3.0, 10.0, 100.0});
    if (s.reading == SurfaceReading::Shading && c.stage == Stage::Slope) {
      c.background = Pattern::Black;
      s.signal = Signal::Brighter;
      s.max_slope = std::min(s.max_slope, 3.0);
      s.threshold_gray = std::floor(128 * 0.1 * top) / 128;
    }
  }
  c.solve = dice.pick(std::array{Solve::Live, Solve::Converged, Solve::Exact});
  c.exponent = dice.one_in(2) ? 0 : static_cast<int>(dice.between(0, 60)) - 30;
  return c;
}

std::string describe(const Case& c) {
  std::ostringstream out;
  out << to_string(c.stage) << " " << c.format.width << "x" << c.format.height << "x" << c.format.channels
      << " of " << c.format.bit_depth << " bits, " << kPatternNames[static_cast<size_t>(c.image)] << " on "
      << kPatternNames[static_cast<size_t>(c.background)] << ", " << c.images << " image"
      << (c.images == 1 ? "" : "s") << ", signal " << palpate::to_string(c.sensor.signal) << ", threshold "
      << c.sensor.threshold_gray << ", saturation " << c.sensor.saturation_gray << ", reading "
      << palpate::to_string(c.sensor.reading) << ", rows " << c.tuning.contact_rows << ", workgroup "
      << c.tuning.contact_workgroup << (c.tuning.contact_tiles ? ", contact in tiles" : "")
      << (c.tuning.slope_tiles ? ", slopes in tiles" : "")
      << (c.tuning.surface_tiles ? ", surface in tiles" : "") << (c.keep_filtered ? ", keeping" : "")
      << ", solver " << static_cast<int>(c.solve) << ", exponent " << c.exponent << ", seed " << c.seed;
  return out.str();
}

std::string difference(gpu::Context& context, const Case& c) {
  try {
    switch (c.stage) {
      case Stage::Contact:
        return contact_difference(context, c);
      case Stage::Slope:
        return slope_difference(context, c);
      case Stage::Surface:
        return surface_difference(context, c);
      case Stage::Pipeline:
        return pipeline_difference(context, c);
      case Stage::Gel:
        return gel_trouble(context, c);
    }
  } catch (const Error& error) {
    return std::string("refused: ") + error.what();
  }
  return {};
}

Case shrink(gpu::Context& context, const Case& failing) {
  Case best = failing;
  const auto keep_if_failing = [&](auto&& change) {
    Case smaller = best;
    change(smaller);
    if (describe(smaller) == describe(best) || difference(context, smaller).empty()) return false;
    best = smaller;
    return true;
  };
  for (bool shrunk = true; shrunk;) {
    shrunk = false;
    for (uint32_t FrameFormat::*length : {&FrameFormat::width, &FrameFormat::height}) {
      while (best.format.*length > 1 && keep_if_failing([&](Case& c) { c.format.*length /= 2; }))
        shrunk = true;
      while (best.format.*length > 1 && keep_if_failing([&](Case& c) { c.format.*length -= 1; }))
        shrunk = true;
    }
    shrunk |= keep_if_failing([](Case& c) { c.images = std::max(1u, c.images / 2); });
    shrunk |= keep_if_failing([](Case& c) { c.background = Pattern::Black; });
    shrunk |= keep_if_failing([](Case& c) { c.image = Pattern::White; });
    shrunk |= keep_if_failing([](Case& c) { c.keep_filtered = false; });
    shrunk |= keep_if_failing([](Case& c) { c.tuning.contact_workgroup = 32; });
    shrunk |= keep_if_failing([](Case& c) { c.tuning.contact_tiles = 0; });
    shrunk |= keep_if_failing([](Case& c) { c.tuning.slope_tiles = 0; });
    shrunk |= keep_if_failing([](Case& c) { c.tuning.surface_tiles = 0; });
    shrunk |= keep_if_failing([](Case& c) { c.tuning.contact_rows = c.tuning.contact_rows_keeping = 32; });
    shrunk |= keep_if_failing([](Case& c) { c.exponent = 0; });
  }
  return best;
}

}  // namespace palpate::fuzz
