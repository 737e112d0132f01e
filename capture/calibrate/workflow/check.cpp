#include "capture/calibrate/workflow/check.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "capture/calibrate/background.h"
#include "capture/calibrate/force/weighed_presses.h"
#include "capture/calibrate/photometric/ball_reading.h"
#include "capture/calibrate/photometric/pad_change.h"
#include "capture/calibrate/photometric/pad_match.h"
#include "capture/calibrate/untouched_recording.h"
#include "capture/calibrate/workflow/balls.h"
#include "capture/open_source.h"
#include "engine/base/json.h"
#include "engine/base/numbers.h"
#include "engine/base/shell_word.h"
#include "engine/base/text.h"
#include "engine/measure/picture/pad_flaws.h"
#include "engine/sensor/fit.h"
#include "palpate/error.h"
#include "palpate/sensor.h"

namespace palpate {
namespace {

using State = CheckRow::State;

constexpr double kNone = std::numeric_limits<double>::infinity();
constexpr double kBrightness = 100 * PadMatch::kBrightness, kColour = 100 * PadMatch::kColour;
constexpr double kForeign = 5;               // per cent of the pictures
constexpr double kAlike = 50;                // per cent of the picture, as LightTrust::kSureInliers
constexpr double kElsewhere_gray = 3;        // beyond one light
constexpr double kMarkers = 2;               // per cent of their spacing
constexpr double kGain = 0.15, kSigmas = 2;  // of a ball's depth
constexpr double kFewGain = 1;               // of fewer presses, whose places may be the worst
constexpr size_t kFew = 3;
constexpr double kSpecks = 1e-3;        // of the picture
constexpr uint64_t kMostPictures = 60;  // that the light is read from

CheckRow row(const char* name, double value, const char* unit, double least, double most, std::string what) {
  return {.name = name,
          .value = value,
          .unit = unit,
          .least = least,
          .most = most,
          .state = !std::isfinite(value)           ? State::NotJudged
                   : value < least || value > most ? State::Changed
                                                   : State::AsCalibrated,
          .what = std::move(what)};
}

CheckRow not_judged(const char* name, std::string what) {
  return row(name, kNaN, "", -kNone, kNone, std::move(what));
}

/// The pad at rest today, as a recording shows it.
struct Today {
  std::optional<UntouchedImage> rest;
  std::string why;              ///< there is none
  std::vector<PadLight> light;  ///< of pictures, against the calibration's untouched image
  double foreign = kNaN;        ///< share of the pictures that do not go with that image
  std::string others{};         ///< what is foreign in them
  std::optional<FlawSummary> flaws{};
};

class Check {
 public:
  Check(const CheckRequest& request, const RunWatch& watch)
      : request_(request), watch_(watch), sensor_(load_sensor(request.sensor)) {
    if (sensor_.background.kind == BackgroundKind::None)
      throw Error(Failure::Sensor, "a sensor that subtracts an untouched image, " + request.sensor.string(),
                  "background.source 'none'", "a check of the camera that takes the differences");
    if (request.ball.times_given() > 1)
      throw Error(Failure::Usage, "the ball's size once", "several of them",
                  "--ball-radius-mm or --ball-diameter-mm");
    if (request.weight_g.empty() && !request.out.empty())
      throw Error(Failure::Usage, "weights to mend " + request.sensor.string() + " by", "--out alone",
                  "--weight-g GRAMS of each press on a scale");
    for (const double weight_g : request.weight_g)
      if (!(weight_g > 0) || !std::isfinite(weight_g))
        throw Error(Failure::Usage, "weights > 0 g", text("%g", weight_g), "what the scale showed, in grams");
  }

  SensorCheck run(const std::function<gpu::Context&()>& device) {
    const std::unique_ptr<Source> source = open_source(request_.input, sensor_);
    if (source->live())
      throw Error(Failure::Input, "a recording to check " + request_.sensor.string() + " with", "a camera",
                  "palpate record first");
    format_ = source->format();
    if (background_origin(sensor_, *source) == BackgroundOrigin::File)
      calibrated_ = load_background(request_.input, sensor_, *source);
    look_at_pad(separate_presses(*source, false));
    if (!watch_.stopped()) judge_ball(device);
    if (!watch_.stopped()) judge_force(device);
    if (watch_.stopped()) return {.stopped = true};
    conclude();
    return std::move(check_);
  }

 private:
  std::function<bool(uint64_t)> more(const char* what) const {
    return [this, progress = watch_.begin(what, 0)](uint64_t n) {
      progress(n);
      return !watch_.stopped();
    };
  }

  Today today(bool separate) const {
    Today day;
    const bool given = !request_.background.empty();
    const std::string input = given ? request_.background.string() : request_.input;
    std::vector<Frame> untouched;
    if (calibrated_ && !given) {
      const std::unique_ptr<Source> source = open_source(input, sensor_);
      const uint64_t every = source->frame_count().value_or(0) / kMostPictures + 1;
      const auto goes_on = more("comparing the light");
      Frame frame;
      PadMatch match(*calibrated_, sensor_);
      std::optional<PadFlaws> flaws;
      if (separate && shows_flaws(sensor_)) flaws.emplace(format_, true).set_background(*calibrated_);
      for (uint64_t n = 0; match.pictures() < kMostPictures && source->next(frame); ++n) {
        if (n % every != 0) continue;
        match.look_at(frame);
        if (flaws) flaws->look_at(frame);
        if (separate &&
            evident_touch_px(frame, *calibrated_, clear_threshold(sensor_.threshold_gray, format_)) == 0) {
          untouched.emplace_back().reshape(format_);
          std::copy_n(frame.pixels(), format_.frame_bytes(), untouched.back().bytes.data());
        }
        if (!goes_on(n)) return day;
      }
      day.light = match.lights();
      day.foreign = static_cast<double>(match.foreign()) / static_cast<double>(match.pictures());
      day.others = match.describe();
      if (flaws && flaws->judged()) day.flaws = flaws->summary();
    }
    if (separate && !given) {
      // Pictures of presses that are alike are no pad at rest.
      if (untouched.size() == 1) day.rest = untouched_picture(untouched.front(), sensor_);
      if (untouched.size() > 1) day.rest = untouched_image(untouched, sensor_, true);
      if (!day.rest) day.why = "no picture of the pad at rest in " + input + ": --background PICTURE";
      return day;
    }
    try {
      day.rest = find_untouched(input, sensor_, {}, more("looking for untouched frames")).image;
    } catch (const Error& error) {
      if (given || error.failure() != Failure::Input) throw;
      day.why = "no frames of the pad at rest in " + input + ": --background PICTURE";
    }
    if (day.rest && day.rest->mean.format != format_)
      throw Error(Failure::Input,
                  text("a --background of %u x %u px, as the recording", format_.width, format_.height),
                  text("%u x %u px", day.rest->mean.format.width, day.rest->mean.format.height),
                  "a picture by the same camera mode");
    return day;
  }

  void look_at_pad(bool separate) {
    const Today day = today(separate);
    if (watch_.stopped()) return;
    rest_seen_ = day.rest.has_value();
    judge_light(day);
    // Where most are foreign the light's rows say so.
    if (day.foreign < 0.5)
      add(row("pictures", 100 * day.foreign, "%", 0, kForeign,
              day.others.empty() ? "of the recording do not go with the untouched image" : day.others));
    judge_pattern(day);
    judge_flaws(day);
    judge_noise(day);
  }

  void judge_light(const Today& day) {
    if (!calibrated_) {
      const std::string why = "the sensor file names no untouched image: palpate calibrate background";
      for (const char* name : {"same pad", "brightness", "colours"}) add(not_judged(name, why));
      return;
    }
    const PadLight light =
        day.rest ? light_between(*calibrated_, day.rest->mean, sensor_) : light_of(day.light);
    add(row("same pad", 100 * light.share, "%", kAlike, kNone,
            "of the picture is that of the calibration under one light"));
    const bool known = 100 * light.share >= kAlike;
    add(row(
        "brightness", known ? 100 * light.brightness : kNaN, "%", -kBrightness, kBrightness,
        known ? "against the untouched image of the calibration" : "the pictures have too little in common"));
    if (format_.channels == 3)
      add(row("colours", known ? 100 * light.colour : kNaN, "%", 0, kColour,
              known ? text("red %+.1f, green %+.1f, blue %+.1f %%", 100 * light.change[0],
                           100 * light.change[1], 100 * light.change[2])
                    : "the pictures have too little in common"));
  }

  void judge_pattern(const Today& day) {
    if (!calibrated_ || !day.rest) {
      const std::string why = calibrated_ ? day.why : "the sensor file names no untouched image";
      for (const char* name : {"pattern", "specks"}) add(not_judged(name, why));
      add(not_judged("scale", scale_text()));
      return;
    }
    const PadPattern pattern = pattern_between(*calibrated_, day.rest->mean, sensor_);
    const double most_px = kSpecks * format_.width * format_.height;
    CheckRow picture = row("pattern", pattern.elsewhere_gray, "gray", 0, kElsewhere_gray,
                           "a tenth of the untouched picture differs by more, beyond its light");
    if (pattern.fault != PictureFault::None) {
      picture.state = State::Changed;
      picture.what = std::string("the picture is not as the camera gave it: ") + to_string(pattern.fault);
    }
    add(std::move(picture));
    add(row("specks", static_cast<double>(pattern.specks_px), "px", 0, most_px,
            "of the untouched picture would be taken for a touch"));
    if (pattern.marker_scale > 0)
      add(row("scale", 100 * (pattern.marker_scale - 1), "%", -kMarkers, kMarkers,
              "spacing of the printed markers"));
    else
      add(not_judged("scale", scale_text()));
  }

  // The untouched image today shows them best; without one, pictures of presses together.
  void judge_flaws(const Today& day) {
    std::optional<FlawSummary> found = day.flaws;
    if (calibrated_ && day.rest && shows_flaws(sensor_)) {
      PadFlaws flaws(format_, false);
      flaws.set_background(*calibrated_);
      flaws.look_at(day.rest->mean);
      if (flaws.judged()) found = flaws.summary();
    }
    if (!found)
      return add(not_judged("flaws", !calibrated_            ? "the sensor file names no untouched image"
                                     : !shows_flaws(sensor_) ? "of gels without printed markers only"
                                                             : "too little of the pad is as calibrated"));
    const double most_px = kSpecks * format_.width * format_.height;
    add(row("flaws", static_cast<double>(found->px), "px", 0, most_px,
            found->px > 0 ? found->describe() : "thin places that the untouched image shows otherwise"));
  }

  std::string scale_text() const {
    return text(
        "%u x %u px as calibrated; mm per px show in printed markers and in a grid: palpate calibrate "
        "scale",
        format_.width, format_.height);
  }

  void judge_noise(const Today& day) {
    if (!day.rest || day.rest->used < 2) {
      add(not_judged("noise", day.rest ? "one picture shows no noise" : day.why));
      return;
    }
    add(row("noise", day.rest->largest_change_gray, "gray", 0, sensor_.threshold_gray,
            text("largest filtered change of %zu untouched frames; %.2f a pixel; the limit is the threshold",
                 day.rest->used, day.rest->noise_gray)));
  }

  void judge_ball(const std::function<gpu::Context&()>& device) {
    if (request_.ball.times_given() == 0) {
      add(not_judged("ball", "press one of known size: --ball-radius-mm RADIUS"));
      return;
    }
    if (sensor_.reading != SurfaceReading::Photometric && sensor_.reading != SurfaceReading::Lookup)
      throw Error(Failure::Sensor, "a surface by colour or by gray in " + request_.sensor.string(),
                  std::string("reading '") + to_string(sensor_.reading) + "'",
                  "no ball, or palpate calibrate photometric");
    if (!has_scale(sensor_))
      throw Error(Failure::Sensor, "pitch_mm_per_px in " + request_.sensor.string(), "none",
                  "no ball, or palpate calibrate scale");
    BallRequest balls;
    balls.input = request_.input;
    balls.background = request_.background;
    balls.ball = request_.ball;
    const Sensor reading = with_background(sensor_, balls);
    try {
      const BallPresses found = presses_of({{}, watch_}, balls, reading, true, 1);
      if (watch_.stopped()) return;
      const PressVerdict verdict = judge_presses(found, balls, reading);
      doubt_ = verdict.doubt;
      const BallReading read = read_balls(device(), reading, found);
      const double apart = std::max(read.presses < kFew ? kFewGain : kGain, kSigmas * read.gain_sd);
      add(row(
          "ball", read.presses > 0 ? read.gain : kNaN, "of its depth", 1 / (1 + apart), 1 + apart,
          text("read under %zu press%s of a ball of %.4g mm radius, error %.3g mm RMS of %.3g", read.presses,
               read.presses == 1 ? "" : "es", balls.ball.radius(), read.error_mm, read.cap_rms_mm)));
    } catch (const Error& error) {
      // A pad that has changed hides the ball; of one that has not this is the answer.
      const bool changed =
          std::ranges::any_of(check_.rows, [](const CheckRow& r) { return r.state == State::Changed; });
      if (error.failure() != Failure::Input || !changed) throw;
      add(not_judged("ball", error.what()));
    }
  }

  void judge_force(const std::function<gpu::Context&()>& device) {
    if (request_.weight_g.empty()) {
      if (sensor_.force || sensor_.layer)
        add(not_judged("force", "press on a kitchen scale: --weight-g GRAMS"));
      return;
    }
    BallRequest rest;
    rest.background = request_.background;
    const Sensor reading = with_background(sensor_, rest);
    const std::vector<WeighedPress> presses =
        weighed_presses(device(), reading, request_.input, request_.weight_g, watch_);
    if (watch_.stopped()) return;
    const WeighedGain found = weigh(presses);
    const auto at_border = std::ranges::count_if(presses, &WeighedPress::at_border);
    mends_ = found.agree;
    CheckRow force =
        row("force", 1 / found.gain, "of the weight", 1 / found.limit, found.limit,
            text("%zu press%s on a scale: times %.3f +- %.3f; with the calibration's own error %.3f +- %.3f",
                 presses.size(), presses.size() == 1 ? "" : "es", found.gain, found.sd, found.mended,
                 found.mended_sd) +
                (at_border > 0 ? text("; %zd reach the border", at_border) : ""));
    if (!mends_) {
      force.state = State::Changed;
      force.what = text(
          "%zu presses on a scale disagree by more than their errors, %.2f to %.2f times what is read: a "
          "factor does not mend the force",
          presses.size(), found.least, found.most);
    }
    add(std::move(force));
    if (request_.out.empty() || !mends_) return;
    set_gain(sensor_, found, request_.input);
    save_sensor(sensor_, request_.out);
  }

  void add(CheckRow&& one) { check_.rows.push_back(std::move(one)); }

  bool changed(const char* name) const {
    return std::ranges::any_of(
        check_.rows, [&](const CheckRow& r) { return r.name == name && r.state == State::Changed; });
  }

  void again(const char* step, const std::string& words) {
    const std::string file = in_quotes(request_.sensor.string());
    check_.again.push_back({step, "palpate calibrate " + words + " --sensor " + file + " --out " + file});
  }

  /// A light or a pad that has changed takes with it what was read by them.
  void list_remedies() {
    if (changed("pictures")) return;  // nothing is to be made again by these
    const std::string rest = !request_.background.empty() ? in_quotes(request_.background.string())
                             : rest_seen_                 ? in_quotes(request_.input)
                                                          : std::string("PICTURE_AT_REST");
    const bool pad = changed("same pad") || changed("pattern"), scale = changed("scale");
    const bool light = pad || changed("brightness") || changed("colours");
    if (light || changed("specks") || changed("flaws") || changed("noise"))
      again("the untouched image", "background " + rest + (changed("noise") ? " --set-threshold" : ""));
    if (scale) again("the scale", "scale GRID_PICTURES --grid 9x7 --pattern dots --spacing-mm 2.5");
    if (light || scale || changed("ball")) {
      const double radius = request_.ball.radius();
      const std::string ball = (radius > 0 ? in_quotes(request_.input) : std::string("PRESSES")) +
                               " --ball-radius-mm " +
                               (radius > 0 ? text("%g", radius) : std::string("RADIUS"));
      if (sensor_.reading == SurfaceReading::Photometric) again("the surface", "photometric " + ball);
      if (sensor_.reading == SurfaceReading::Lookup) again("the surface", "lookup " + ball);
      if (sensor_.force) again("the force", "force PRESSES --gauge TABLE");
    } else if (changed("force") && !mends_) {
      again("the force", "force PRESSES --gauge TABLE");
    } else if (changed("force") && request_.out.empty()) {
      std::string weights;
      for (const double weight_g : request_.weight_g) weights += text(" --weight-g %g", weight_g);
      check_.again.push_back({"the force", "palpate check " + in_quotes(request_.sensor.string()) + " " +
                                               in_quotes(request_.input) + weights + " --out " +
                                               in_quotes(request_.sensor.string())});
    }
  }

  void conclude() {
    bool judged = false;
    std::string because;
    for (const CheckRow& r : check_.rows) {
      judged = judged || (r.state == State::AsCalibrated && r.name != "noise");
      if (r.state == State::Changed) because += (because.empty() ? "" : ", ") + describe_value(r);
    }
    list_remedies();
    check_.holds = because.empty() && judged;
    if (check_.holds) {
      for (const CheckRow& r : check_.rows)
        if (r.state == State::AsCalibrated) because += (because.empty() ? "" : ", ") + describe_value(r);
      check_.sentence = "as calibrated: " + because;
    } else if (!judged && because.empty()) {
      check_.sentence =
          "cannot be judged: the sensor file names no untouched image, and no ball was pressed; press one of "
          "known size: palpate check " +
          in_quotes(request_.sensor.string()) + " PRESSES --ball-radius-mm RADIUS";
    } else if (changed("pictures")) {
      const auto foreign = std::ranges::find(check_.rows, std::string("pictures"), &CheckRow::name);
      check_.sentence = "cannot be judged by this recording: " + foreign->what +
                        "; record this pad alone, as the camera gives it";
    } else {
      std::string steps, commands;
      for (const CheckRemedy& remedy : check_.again) {
        const bool last = &remedy == &check_.again.back();
        steps += (steps.empty() ? "" : last ? " and " : ", ") + remedy.step;
        commands += (commands.empty() ? "" : " && ") + remedy.command;
      }
      check_.sentence = check_.again.empty() ? "force mended (" + because + ")"
                                             : "needs " + steps + " again (" + because + "): " + commands;
    }
    report();
  }

  static std::string describe_value(const CheckRow& r) { return r.name + text(" %.3g ", r.value) + r.unit; }

  static std::string limits(const CheckRow& r) {
    if (!std::isfinite(r.value)) return "";
    if (!std::isfinite(r.most)) return text("%.3g or more", r.least);
    return r.least == 0 ? text("up to %.3g", r.most) : text("%.3g to %.3g", r.least, r.most);
  }

  void report() {
    json::Value rows = json::Value::array(), remedies = rows;
    std::string lines;
    for (const CheckRow& r : check_.rows) {
      const std::string value = std::isfinite(r.value) ? text("%.3g ", r.value) + r.unit : "";
      lines += text("%-11s %-18s %-15s %-14s %s\n", r.name.c_str(), value.c_str(), limits(r).c_str(),
                    to_string(r.state), r.what.c_str());
      rows.push_back({{"name", r.name},
                      {"value", r.value},
                      {"unit", r.unit},
                      {"least", r.least},
                      {"most", r.most},
                      {"state", to_string(r.state)},
                      {"what", r.what}});
    }
    for (const CheckRemedy& r : check_.again) remedies.push_back({{"step", r.step}, {"command", r.command}});
    check_.text =
        check_.sentence + "\n\n" + text("%-11s %-18s %-15s %-14s\n", "", "today", "limit", "state") + lines;
    if (!doubt_.empty()) check_.text += "WARNING: " + doubt_ + "\n";
    if (!request_.out.empty()) check_.text += "written: " + request_.out.string() + "\n";
    check_.text.pop_back();
    check_.json = {{"sensor", request_.sensor.string()},
                   {"recording", request_.input},
                   {"holds", check_.holds},
                   {"sentence", check_.sentence},
                   {"rows", rows},
                   {"again", remedies},
                   {"written", request_.out.string()},
                   {"doubt", doubt_}};
  }

  const CheckRequest& request_;
  const RunWatch& watch_;
  Sensor sensor_;
  FrameFormat format_;
  std::optional<Frame> calibrated_;
  bool rest_seen_ = false;  ///< the pad at rest today
  bool mends_ = true;       ///< weighed presses agree on a factor
  std::string doubt_;
  SensorCheck check_;
};

}  // namespace

const char* to_string(CheckRow::State state) {
  switch (state) {
    case State::AsCalibrated:
      return "as calibrated";
    case State::Changed:
      return "changed";
    case State::NotJudged:
      break;
  }
  return "not judged";
}

SensorCheck check_sensor(const CheckRequest& request, const std::function<gpu::Context&()>& device,
                         const RunWatch& watch) {
  return Check(request, watch).run(device);
}

}  // namespace palpate
