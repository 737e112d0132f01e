#include "capture/run/tactile_shapes.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "capture/open_source.h"
#include "capture/series.h"
#include "engine/gpu/context.h"
#include "engine/pipeline/surface/surface_sample.h"
#include "engine/pipeline/surface_map.h"
#include "palpate/error.h"

namespace palpate {
namespace {

constexpr float kLeastTrust = 0.5f;
/// A frame's force may be that far from the one asked for, of the peak.
constexpr double kNearForce = 0.03;

/// Calls `with(result)` for each frame until it says that it has seen enough.
template <typename With>
void each_frame(gpu::Context& context, const MeasuredInput& input, Outputs outputs, bool separate,
                const RunWatch& watch, const With& with) {
  const std::unique_ptr<Source> source = open_source(input.input, input.sensor);
  Pipeline pipeline(context, for_rectified_frames(input.sensor), source->format(),
                    {.outputs = outputs, .solver = SurfaceSolver::Best, .separate = separate});
  pipeline.set_background(load_background(input.input, input.sensor, *source));
  if (separate) look_ahead(input.input, input.sensor, pipeline, watch.stop);
  bool more = true;
  for (Frame frame; more && !watch.stopped() && source->next(frame);) {
    pipeline.submit(frame);
    const std::optional<Result> result = pipeline.wait();
    more = with(*result);
  }
}

/// While loading, up to the peak; separate pictures are presses of their own, in any order.
std::array<uint64_t, 2> frames_by_force(gpu::Context& context, const MeasuredInput& input,
                                        const ShapeRequest& request, bool separate, const RunWatch& watch) {
  struct Seen {
    uint64_t frame;
    double force_N;
  };
  std::vector<Seen> seen;
  each_frame(context, input, Output::Force, separate, watch, [&](const Result& result) {
    const Touch& t = result.touch;
    if (t.contact && std::isfinite(t.force_N.value) && t.force_N.validity != Validity::NotCalibrated)
      seen.push_back({t.sequence, t.force_N.value});
    return true;
  });
  if (seen.empty())
    throw Error(Failure::Input, "frames of a contact with a calibrated force in " + input.input, "none",
                "--frames A,B, or a sensor file with a force calibration");
  const auto peak = std::ranges::max_element(seen, {}, &Seen::force_N);
  const std::array<double, 2> wanted =
      request.forces_N.value_or(std::array<double, 2>{0.5 * peak->force_N, peak->force_N});
  std::array<uint64_t, 2> frames{};
  for (size_t i = 0; i < 2; ++i) {
    const auto end = separate ? seen.end() : peak + 1;
    const auto nearest = std::min_element(seen.begin(), end, [&](const Seen& a, const Seen& b) {
      return std::abs(a.force_N - wanted[i]) < std::abs(b.force_N - wanted[i]);
    });
    if (std::abs(nearest->force_N - wanted[i]) > kNearForce * peak->force_N)
      throw Error(Failure::Input,
                  "a frame at " + std::to_string(wanted[i]) + " N" + (separate ? "" : " while loading"),
                  "none nearer than " + std::to_string(nearest->force_N) + " N of a peak of " +
                      std::to_string(peak->force_N) + " N",
                  "other forces, or --frames A,B");
    frames[i] = nearest->frame;
  }
  return frames;
}

/// The part of the frame that its contacts lie in, a little more than it.
PixelRect contact_box(const Touch& touch, const FrameFormat& format) {
  if (touch.contacts.empty()) return {0, 0, format.width, format.height};
  uint32_t left = format.width, top = format.height, right = 0, bottom = 0;
  for (const ContactTouch& c : touch.contacts) {
    left = std::min(left, c.box.x), top = std::min(top, c.box.y);
    right = std::max(right, c.box.x + c.box.width), bottom = std::max(bottom, c.box.y + c.box.height);
  }
  const uint32_t margin = std::max(right - left, bottom - top) / 4 + 8;
  left -= std::min(left, margin), top -= std::min(top, margin);
  return {left, top, std::min(format.width, right + margin) - left,
          std::min(format.height, bottom + margin) - top};
}

}  // namespace

std::optional<double> TactileShapes::counted_growth() const {
  if (!(before.contact_mm2 > 0 && after.contact_mm2 > 0)) return std::nullopt;
  return after.contact_mm2 / before.contact_mm2 - 1;
}

TactileShapes read_shapes(gpu::Context& context, const MeasuredInput& input, const ShapeRequest& request,
                          const RunWatch& watch) {
  const std::unique_ptr<Source> source = open_source(input.input, input.sensor);
  if (source->live()) throw Error(Failure::Usage, "a recording", "a camera", "palpate record first");
  const bool separate = separate_presses(*source, request.one_sequence);
  const bool surface = wants(input.outputs, Output::Surface);
  const bool skin = input.sensor.skin.has_value() && !separate;
  if (!surface && input.sensor.skin && separate)
    throw Error(Failure::Usage, "frames that follow each other, for the skin's strain",
                "'" + input.input + "': pictures without a rate, each of them a press of its own",
                "--sequence where they do");
  if (!surface && !skin)
    throw Error(Failure::Usage, "a sensor that measures its surface or has a pattern on its skin", "neither",
                "a sensor file with \"reading\" or \"skin\"");
  const std::array<uint64_t, 2> frames =
      request.frames ? *request.frames : frames_by_force(context, input, request, separate, watch);
  if (frames[0] == frames[1])
    throw Error(Failure::Input, "two compressions", "one and the same frame, " + std::to_string(frames[0]),
                "other forces or frames");
  Outputs outputs = Output::Force | Output::Contacts;
  if (surface) outputs |= Output::Surface;
  if (skin) outputs |= Output::Skin;
  ControlOptions control = request.control;
  control.pitch_mm_per_px = input.sensor.pitch_mm_per_px;
  TactileShapes found;
  found.skin = skin;
  found.separate = separate;
  std::array<bool, 2> have{};
  each_frame(context, input, outputs, separate, watch, [&](const Result& result) {
    for (size_t i = 0; i < 2; ++i) {
      if (result.touch.sequence != frames[i]) continue;
      TactileShape& shape = i == 0 ? found.before : found.after;
      shape.touch = result.touch;
      have[i] = true;
      if (!surface) continue;
      const FrameFormat format{surface_of(result).width, surface_of(result).height, 1, 8};
      for (uint64_t draw = 0; draw < kDraws; ++draw) {
        // Each draws its own candidates: the same ones in both frames would look like points that stand
        // still. No two seeds share a draw.
        control.seed = 2 * kDraws * request.control.seed + 2 * draw + i;
        const CandidateGrid grid = control_candidates(contact_box(result.touch, format), control);
        const std::vector<float> depths =
            sample_depths(context, surface_of(result), result.touch.surface->depth_offset_mm, grid.places);
        ControlPoints chosen = choose_control_points(grid, depths, {}, control);
        shape.contact_mm2 += chosen.contact_mm2 / static_cast<double>(kDraws);
        shape.draws.push_back(shape_points(chosen, control.pitch_mm_per_px));
        if (draw == 0) shape.control = std::move(chosen);
      }
    }
    return !(have[0] && have[1]);
  });
  for (size_t i = 0; i < 2; ++i)
    if (!have[i] && !watch.stopped())
      throw Error(Failure::Input, "frame " + std::to_string(frames[i]) + " in " + input.input,
                  "no such frame", "numbers from the column 'frame' of palpate process");
  return found;
}

std::vector<MatchedPoint> skin_pairs(const TactileShapes& shapes, double pitch) {
  std::vector<MatchedPoint> pairs;
  const std::vector<SkinPoint>&a = shapes.before.touch.skin_points, &b = shapes.after.touch.skin_points;
  for (size_t i = 0; i < std::min(a.size(), b.size()); ++i) {
    if (a[i].correlation < kLeastTrust || b[i].correlation < kLeastTrust) continue;
    const auto at = [&](const SkinPoint& p) {
      return ShapePoint{pitch * double{p.rest_x_px + p.shift_x_px},
                        pitch * double{p.rest_y_px + p.shift_y_px}, 0};
    };
    const ShapePoint after = at(b[i]);
    const bool touched = std::ranges::any_of(shapes.after.touch.contacts, [&](const ContactTouch& c) {
      const double x = after.x_mm / pitch - c.box.x, y = after.y_mm / pitch - c.box.y;
      return x >= 0 && y >= 0 && x < c.box.width && y < c.box.height;
    });
    if (touched) pairs.push_back({at(a[i]), after, double{std::min(a[i].correlation, b[i].correlation)}});
  }
  return pairs;
}

}  // namespace palpate
