#include "capture/calibrate/workflow/balls.h"

#include <algorithm>
#include <charconv>
#include <iterator>
#include <set>
#include <utility>

#include "capture/calibrate/background.h"
#include "capture/calibrate/photometric/ball_stretch.h"
#include "capture/calibrate/photometric/shape_text.h"
#include "engine/base/text.h"
#include "palpate/error.h"

namespace palpate {

namespace {

/// A recording and the radius of the ball pressed in it, from DIR=RADIUS_MM.
std::pair<std::string, PressedShape> other_ball(const std::string& entry) {
  const size_t at = entry.rfind('=');
  const std::string number = at == std::string::npos ? "" : entry.substr(at + 1);
  double radius_mm = 0;
  const auto [end, error] = std::from_chars(number.data(), number.data() + number.size(), radius_mm);
  if (at == 0 || number.empty() || error != std::errc() || end != number.data() + number.size() ||
      !(radius_mm >= 1e-3 && radius_mm <= 1000))
    throw Error(Failure::Usage, "presses of another ball as RECORDING=RADIUS_MM, 0.001 to 1000 mm",
                "'" + entry + "'", "--balls presses_5mm=2.5");
  return {entry.substr(0, at), PressedShape::ball(radius_mm)};
}

void append(BallPresses&& more, const std::string& from, BallPresses& found) {
  if (!(more.format == found.format))
    throw Error(Failure::Input, "recordings of one camera and sensor file",
                text("%u x %u px in ", more.format.width, more.format.height) + from +
                    text(" and %u x %u px", found.format.width, found.format.height),
                "presses of all balls in one camera mode");
  // Folders of presses often number them alike.
  const std::filesystem::path path(from);
  const std::string folder = (path.has_filename() ? path : path.parent_path()).filename().string();
  for (BallPress& press : more.presses) press.label = folder + "/" + press.label;
  for (RefusedPress& press : more.refused) press.label = folder + "/" + press.label;
  const auto move = [&](auto BallPresses::*part) {
    std::ranges::move(more.*part, std::back_inserter(found.*part));
  };
  move(&BallPresses::presses);
  move(&BallPresses::backgrounds);
  move(&BallPresses::refused);
  found.frames_with_ball += more.frames_with_ball;
  found.untouched += more.untouched;
  if (found.warning.empty()) found.warning = more.warning;
}

}  // namespace

void check_ball_options(const BallRequest& options) {
  for (const std::string& entry : options.other_balls) other_ball(entry);
  const int given = options.ball.times_given();
  int all = given + !options.balls.empty();
  for (const std::string& entry : options.shapes) all += !parse_shaped_recording(entry).recording;
  if (all == 1) return;
  throw Error(Failure::Usage,
              "the ball's size, once (--ball-radius-mm, --ball-diameter-mm or --ball-mm RADIUS), or another "
              "--shape, or a table of presses (--balls)",
              all == 0       ? "none of them"
              : given == all ? std::to_string(given) + " sizes"
                             : "several of them",
              "--ball-radius-mm RADIUS");
}

Sensor with_background(Sensor sensor, const BallRequest& options) {
  if (!options.background.empty())
    sensor.background.image = std::filesystem::absolute(options.background).string();
  return sensor;
}

BallPresses presses_of(const CalibrationRun& run, const BallRequest& options, const Sensor& sensor,
                       bool mask_markers, size_t least) {
  if (!options.balls.empty()) return read_presses(options.balls, options.input, sensor, mask_markers);
  PressSearch search;
  search.shape = PressedShape::ball(options.ball.radius());
  std::vector<std::pair<std::string, PressedShape>> further;
  further.reserve(options.other_balls.size() + options.shapes.size());
  for (const std::string& entry : options.other_balls) further.push_back(other_ball(entry));
  for (const std::string& entry : options.shapes) {
    const auto [recording, shape] = parse_shaped_recording(entry);
    if (recording)
      further.emplace_back(*recording, shape);
    else
      search.shape = shape;
  }
  search.mask_markers = mask_markers;
  search.every = options.every;
  const RunWatch::Progress progress = run.watch.begin("looking for the ball", 0);
  search.progress = [&](uint64_t done, uint64_t) {
    progress(done);
    return run.watch.stopped();
  };
  search.judge = [&](const BallPresses& found) { refuse_contradictions(found, sensor, options.input); };
  BallPresses found = find_presses(options.input, sensor, search, further.empty() ? least : 1);
  for (const auto& [recording, shape] : further) {
    if (run.watch.stopped()) break;
    search.shape = shape;
    search.judge = [&, &input = recording](const BallPresses& of) {
      refuse_contradictions(of, sensor, input);
    };
    append(find_presses(recording, sensor, search, 1), recording, found);
  }
  return found;
}

KeptSensor keep_sensor(Sensor& sensor, const std::filesystem::path& background, const CalibrationRun& run,
                       bool fresh) {
  if (run.out.empty()) {
    if (!background.empty()) sensor.background.image = std::filesystem::absolute(background).string();
    return {};
  }
  if (fresh) sensor.name = run.out.stem().string();
  KeptSensor kept;
  kept.background = keep_background(background, run.out, sensor).string();
  save_sensor(sensor, run.out);
  kept.line = "written: " + run.out.string() + (kept.background.empty() ? "" : " and " + kept.background);
  return kept;
}

PressVerdict judge_presses(const BallPresses& found, const BallRequest& options, const Sensor& sensor) {
  PressVerdict verdict{selection_of(found), {}, "", found.warning};
  std::set<PressedShape> shapes;
  for (const BallPress& press : found.presses)
    shapes.insert(press.shape.kind == PressedShape::Kind::Ball ? PressedShape{} : press.shape);
  const auto add = [&](const std::string& doubt) {
    if (!doubt.empty()) verdict.doubt += (verdict.doubt.empty() ? "" : "; ") + doubt;
  };
  for (const PressedShape& shape : shapes) {
    const BallEvidence& evidence = verdict.evidence.emplace_back(evidence_of(found, sensor, shape));
    const BallSize size = shape.kind == PressedShape::Kind::Ball ? options.ball : BallSize{};
    const BallDoubt doubt = doubt_of(evidence, size);
    refuse_doubtful(doubt, evidence, size, options.input);
    add(doubt.line);
  }
  const BallStretch stretch = stretch_of(found, sensor);
  if (stretch.evident())
    add(text(
        "the contacts are ellipses: a ball explains pictures about %.2f times as tall better (%.0f %% as "
        "much is left); pixels that are not square, or pictures scaled by other factors along x and y, "
        "make depth wrong",
        stretch.factor, 100 * stretch.left));
  if (verdict.selection.minority())
    add("the error is that of the lesser part of what was pressed: most was left out");
  return verdict;
}

std::string describe(const PressVerdict& verdict, const std::string& error) {
  std::string text = error + "\n" + describe(verdict.selection) + "\n";
  for (const BallEvidence& evidence : verdict.evidence) text += describe(evidence) + "\n";
  if (!verdict.doubt.empty()) text += "WARNING: " + verdict.doubt + "\n";
  if (!verdict.warning.empty()) text += "WARNING: " + verdict.warning + "\n";
  return text;
}

void add_verdict(const PressVerdict& verdict, const std::string& error, json::Value& report) {
  json::Value shapes = json::Value::array();
  report["verdict"] = error;
  report["selection"] = to_json(verdict.selection);
  report["selection_text"] = describe(verdict.selection);
  for (const BallEvidence& evidence : verdict.evidence)
    if (evidence.shape.kind == PressedShape::Kind::Ball)
      report["ball"] = to_json(evidence);
    else
      shapes.push_back(to_json(evidence));
  if (!shapes.empty()) report["shapes"] = shapes;
  report["doubt"] = verdict.doubt;
  report["warning"] = verdict.warning;
}

json::Value refused_json(const BallPresses& found) {
  json::Value refused = json::Value::array();
  for (const RefusedPress& r : found.refused) {
    json::Value one = {{"press", r.label}, {"reason", r.reason}};
    if (r.ball.radius_px > 0)
      one.update({{"center_x_px", r.ball.center_x_px},
                  {"center_y_px", r.ball.center_y_px},
                  {"contact_radius_px", r.ball.radius_px}});
    refused.push_back(std::move(one));
  }
  return refused;
}

std::string error_text(double depth_rmse_mm, double cap_rms_mm) {
  return text("%.3g mm RMS, %.2g %% of the caps (%.3g mm RMS)", depth_rmse_mm,
              cap_rms_mm > 0 ? 100 * depth_rmse_mm / cap_rms_mm : 0, cap_rms_mm);
}

}  // namespace palpate
