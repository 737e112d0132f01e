#include "capture/calibrate/photometric/ball_verdict.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "engine/base/statistics.h"
#include "engine/base/text.h"
#include "engine/calibrate/ball/shading.h"
#include "palpate/error.h"

namespace palpate {
namespace {

constexpr double kSameRamp = 1.8;       // of two changes of colour: one ball, as presses.cpp takes it
constexpr size_t kLeastWide = 2;        // presses wider than the ball that contradict it
constexpr double kSameBallShare = 0.2;  // of all presses: so many of the same ball contradict it
// Darkening over that of the stated radius. Right radii: 0.5 and 1.1 on real gels, 1 in the simulator.
constexpr double kDoubled = 1.6, kMaybeDoubled = 1.25, kHalved = 0.35, kCannotBe = 10;
constexpr double kHalf = 0.49;      // of the stated radius: no contact is wider, so half of it can be right
constexpr double kGrayHalf = 0.45;  // the same for gray gels, which have no such shading
constexpr size_t kLeastJudged = 3, kEnoughJudged = 5;

const char* name_of(BallRefusal why) {
  switch (why) {
    case BallRefusal::None:
    case BallRefusal::Untouched:
      break;
    case BallRefusal::TooSmall:
      return "too small";
    case BallRefusal::AtBorder:
      return "at the frame's border";
    case BallRefusal::TooWide:
      return "wider than the ball";
    case BallRefusal::Covered:
      return "saturated or covered";
    case BallRefusal::MoreThanOne:
      return "not one ball";
    case BallRefusal::Unlike:
      return "unlike the others";
    case BallRefusal::Foreign:
      return "of another pad or light";
  }
  return "";
}

double wider_mm(const RefusedPress& press, const Sensor& sensor) {
  return press.ball.radius_px * sensor.pitch_mm_per_px;
}

/// The usual change of colour a pixel; 0 for gray gels.
double usual_ramp(const BallPresses& found) {
  std::vector<double> ramps;
  for (const BallPress& p : found.presses) ramps.push_back(p.ball.ramp_per_px);
  return median(ramps);
}

std::string share_text(double share) {
  return text("%.0f %%", 100 * share);
}

}  // namespace

PressSelection selection_of(const BallPresses& found) {
  PressSelection s;
  s.presses = found.presses.size();
  s.left_out = found.refused.size();
  s.pictures = found.frames_with_ball + s.left_out;
  for (const RefusedPress& r : found.refused) ++s.reasons[r.why];
  return s;
}

std::string describe(const PressSelection& s) {
  std::string line = text("%zu press%s", s.presses, s.presses == 1 ? "" : "es");
  if (s.left_out == 0) return line + ", none left out";
  line += text("; of %zu pictures of a press %zu left out (", s.pictures, s.left_out);
  std::string reasons;
  for (const auto& [why, count] : s.reasons)
    reasons += text("%s%zu %s", reasons.empty() ? "" : ", ", count, name_of(why));
  return line + reasons + ")";
}

json::Value to_json(const PressSelection& s) {
  json::Value reasons = json::Value::object();
  for (const auto& [why, count] : s.reasons) reasons[name_of(why)] = count;
  return {{"presses", s.presses},
          {"pictures_of_a_press", s.pictures},
          {"left_out", s.left_out},
          {"reasons", reasons}};
}

void refuse_contradictions(const BallPresses& found, const Sensor& sensor, const std::string& input) {
  const double ramp = usual_ramp(found);
  size_t wide = 0, same = 0, unlike = 0;
  double widest_mm = 0;
  PressedShape shape;
  for (const RefusedPress& r : found.refused) {
    unlike += r.why == BallRefusal::Unlike;
    if (r.why != BallRefusal::TooWide) continue;
    ++wide;
    widest_mm = std::max(widest_mm, wider_mm(r, sensor));
    shape = r.shape;
    const double ratio = ramp > 0 ? r.ball.ramp_per_px / ramp : 0;
    same += ratio < kSameRamp && ratio > 1 / kSameRamp;
  }
  const size_t fitting = found.frames_with_ball, all = fitting + wide;
  const auto share = [&](size_t of) {
    return static_cast<double>(of) / static_cast<double>(std::max<size_t>(all, 1));
  };
  const bool most = wide > 0 && 2 * wide >= all,
             same_ball = same >= kLeastWide && share(same) >= kSameBallShare;
  if (most || same_ball) {
    const char* name = name_of(shape.kind);
    const double shaded_mm = evidence_of(found, sensor, shape).shaded_radius_mm();
    const std::string by_shading =
        shaded_mm > widest_mm ? text("about %.2g mm by the shading, ", shaded_mm) : "";
    throw Error(
        Failure::Input,
        "contacts that fit " + describe(shape) + text(" at %.4g mm per px in ", sensor.pitch_mm_per_px) +
            input,
        text("%zu of %zu presses wider than the %s, up to %.3g mm radius: its radius or the scale is wrong",
             wide, all, name, widest_mm),
        text("the %s's radius (", name) + by_shading +
            text("above %.3g mm at this scale; %s takes a diameter), or the scale, below %.3g mm per px with "
                 "this %s",
                 widest_mm, shape.kind == PressedShape::Kind::Ball ? "--ball-diameter-mm" : "diameter=MM",
                 sensor.pitch_mm_per_px * shape.radius_mm / widest_mm, name));
  }
  if (unlike > 0 && 2 * unlike >= fitting + unlike)
    throw Error(Failure::Input, "presses of one ball in " + input,
                text("%zu of %zu that change the picture unlike the others", unlike, fitting + unlike),
                "presses of a single ball under one light");
}

double BallEvidence::shaded_radius_mm() const {
  return judged > 0 && shading > 0 ? radius_mm / std::sqrt(shading) : 0;
}

BallEvidence evidence_of(const BallPresses& found, const Sensor& sensor, const PressedShape& of) {
  BallEvidence e;
  e.shape = of;
  const bool balls = of.kind == PressedShape::Kind::Ball;
  std::vector<double> radii, shading;
  for (size_t i = 0; i < found.presses.size(); ++i) {
    const BallPress& p = found.presses[i];
    if (balls ? p.shape.kind != PressedShape::Kind::Ball : p.shape != of) continue;
    const double contact_mm = p.ball.radius_px * sensor.pitch_mm_per_px;
    e.least_contact_mm = radii.empty() ? contact_mm : std::min(e.least_contact_mm, contact_mm);
    e.widest_contact_mm = std::max(e.widest_contact_mm, contact_mm);
    e.widest_share = std::max(e.widest_share, contact_mm / p.shape.widest_mm());
    radii.push_back(p.shape.radius_mm);
    if (p.frame.format.channels != 3 || p.shape.kind == PressedShape::Kind::Cone) continue;
    if (const auto curvature = shaded_curvature_per_px2(p.frame, found.backgrounds[i], p.mask, p.ball))
      shading.push_back(*curvature * std::pow(p.shape.radius_mm / sensor.pitch_mm_per_px, 2));
  }
  e.radius_mm = median(radii);
  if (shading.size() < kLeastJudged) return e;
  e.judged = shading.size();
  e.shading = median(shading);
  const auto tenth = shading.begin() + static_cast<std::ptrdiff_t>(shading.size() / 10);
  std::ranges::nth_element(shading, tenth);
  e.least_shading = *tenth;
  std::vector<double> apart;
  apart.reserve(shading.size());
  for (const double s : shading) apart.push_back(std::abs(s - e.shading));
  // Standard error of a median of normal values: 1.25 times that of their mean.
  e.shading_sd = 1.25 * 1.4826 * median(apart) / std::sqrt(static_cast<double>(e.judged));
  return e;
}

BallDoubt doubt_of(const BallEvidence& e, const BallSize& size) {
  BallDoubt doubt;
  const char* name = name_of(e.shape.kind);
  const bool half_fits = e.widest_share < kHalf;
  const double low = e.shading - 2 * e.shading_sd, high = e.shading + 2 * e.shading_sd;
  // Presses may differ much by their place, and yet none read as little as under the right ball.
  const bool doubled = low > kDoubled ||
                       (e.judged >= kEnoughJudged && e.shading > kDoubled && e.least_shading > kMaybeDoubled);
  const std::string seen =
      e.judged > 0
          ? text("the pad darkens under the contacts as under a %s of about %.2g mm radius, not %.4g", name,
                 e.shaded_radius_mm(), e.radius_mm)
          : std::string();
  const std::string were =
      text("contacts reach %.0f %% of a %s of %.4g mm radius; were %.4g mm its diameter, %.0f %%",
           100 * e.widest_share, name, e.radius_mm, e.radius_mm, 200 * e.widest_share);
  if (e.judged > 0 && low > kCannotBe) {
    doubt = {BallDoubt::Kind::TooLarge, true, seen};
  } else if (e.judged > 0 && half_fits && doubled) {
    doubt = {BallDoubt::Kind::Diameter, size.unsaid_mm > 0, seen + ": is it the diameter? " + were};
  } else if (half_fits && e.judged > 0 && e.shading > kMaybeDoubled) {
    doubt = {BallDoubt::Kind::Diameter, false, text("the %s's radius or its diameter? ", name) + were};
  } else if (e.judged == 0 && e.widest_share < kGrayHalf && size.unsaid_mm > 0) {
    doubt = {BallDoubt::Kind::Diameter, false, "the ball's radius or its diameter? " + were};
  } else if (e.judged > 0 && !half_fits && low > kDoubled) {
    doubt = {BallDoubt::Kind::TooLarge, false, seen + ": is the radius or the scale wrong?"};
  } else if (e.judged > 0 && high < kHalved) {
    doubt = {BallDoubt::Kind::TooSmall, false, seen + ": is the radius or the scale wrong?"};
  }
  return doubt;
}

void refuse_doubtful(const BallDoubt& doubt, const BallEvidence& e, const BallSize& size,
                     const std::string& input) {
  if (!doubt.refused) return;
  std::string remedy = text("the %s's radius and the scale as they were measured", name_of(e.shape.kind));
  if (doubt.kind == BallDoubt::Kind::Diameter)
    remedy = text("--ball-diameter-mm %.4g, or --ball-radius-mm %.4g if that is the radius", size.unsaid_mm,
                  size.unsaid_mm);
  throw Error(Failure::Input,
              text("shading under the contacts that fits a %s of %.4g mm radius in ", name_of(e.shape.kind),
                   e.radius_mm) +
                  input,
              doubt.line, remedy);
}

std::string describe(const BallEvidence& e) {
  const char* name = name_of(e.shape.kind);
  std::string line = text("contacts of %.3g to %.3g mm %s on ", e.least_contact_mm, e.widest_contact_mm,
                          e.shape.round() ? "radius" : "half width");
  if (e.shape.kind == PressedShape::Kind::Cone) return line + describe(e.shape);
  line +=
      text("a %s of %.4g mm radius (up to %s of it)", name, e.radius_mm, share_text(e.widest_share).c_str());
  if (e.judged > 0)
    line += e.shading > 0
                ? text("; by shading alone a %s of about %.2g mm radius", name, e.shaded_radius_mm())
                : std::string("; their shading gives no radius");
  return line;
}

json::Value to_json(const BallEvidence& e) {
  if (e.shape.kind == PressedShape::Kind::Cone)
    return {{"shape", describe(e.shape)},
            {"least_contact_mm", e.least_contact_mm},
            {"widest_contact_mm", e.widest_contact_mm}};
  json::Value value = {{"radius_mm", e.radius_mm},
                       {"least_contact_mm", e.least_contact_mm},
                       {"widest_contact_mm", e.widest_contact_mm},
                       {"widest_share_of_radius", e.widest_share},
                       {"presses_judged_by_shading", e.judged}};
  if (e.shape.kind != PressedShape::Kind::Ball) value["shape"] = describe(e.shape);
  if (e.judged > 0) {
    value["shading_over_stated"] = e.shading;
    value["shading_over_stated_sd"] = e.shading_sd;
    value["radius_by_shading_mm"] = e.shading > 0 ? json::Value(e.shaded_radius_mm()) : json::Value(nullptr);
  }
  return value;
}

}  // namespace palpate
