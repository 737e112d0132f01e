// palpate optics led: position of an LED at the pad's edge, by ray tracing.
#include <algorithm>
#include <cmath>
#include <utility>

#include "engine/base/json.h"
#include "engine/base/text.h"
#include "engine/optics/ray_fan.h"
#include "palpate/error.h"
#include "viz/commands/optics/optics.h"
#include "viz/commands/support/options.h"

namespace palpate {
namespace {

using Json = json::Value;

struct Options {
  MediaOptions media;
  LampOptions lamp;
  std::optional<double> depth_mm;
  double length_mm = 30;
  int rays = 21;
};

double total_mm(const optics::Waveguide& guide) {
  double sum = 0;
  for (const optics::GuideLayer& layer : guide.layers) sum += layer.thickness_mm;
  return sum;
}

std::string or_dash(double value) {
  return std::isfinite(value) ? palpate::text("%.3f", value) : "-";
}

struct Place {
  optics::LampFractions fractions;
  optics::FirstMeetings meetings;
};
Json place_json(const Place& p, double depth_mm) {
  return {{"depth_mm", depth_mm},
          {"entering", p.fractions.entering},
          {"guided", p.fractions.guided},
          {"touching", p.fractions.touching},
          {"nearest_mm", p.meetings.nearest_mm},
          {"half_has_met_mm", p.meetings.distance_of(0.5, p.fractions.touching)},
          {"nine_tenths_have_met_mm", p.meetings.distance_of(0.9, p.fractions.touching)}};
}

Plot fan_plot(const optics::Waveguide& guide, const std::vector<optics::EdgeRay>& rays, const Place& place,
              double length_mm) {
  const double total = total_mm(guide), touching = place.fractions.touching;
  PlotPanel fan{"", "distance from the edge, mm", "depth below the touched face, mm"};
  fan.x_range = {{0, length_mm}};
  fan.key = "outside right top";
  PlotPanel met = fan;
  fan.y_range = {{-0.02 * total, total * 1.02}};
  fan.down = true;
  double depth = 0;
  for (size_t i = 0; i < guide.layers.size(); ++i) {
    const double bottom = depth + guide.layers[i].thickness_mm;
    PlotCurve& layer = fan.add(palpate::text("layer %zu, n = %g", i + 1, guide.layers[i].index),
                               {0, length_mm}, {depth, depth}, i % 2 ? 4 : 5, PlotCurve::Style::Band);
    layer.low = layer.y;
    layer.high = {bottom, bottom};
    depth = bottom;
  }
  constexpr size_t kColours[] = {0, 2, 1};
  const char* names[] = {"meets the touched face", "guided, never meets it", "leaves"};
  for (const optics::EdgeRay& ray : rays) {
    const auto fate = static_cast<size_t>(ray.fate);
    fan.add(std::exchange(names[fate], ""), ray.x_mm, ray.depth_mm, kColours[fate]).width = 1;
  }
  met.y_label = "fraction that has met the face";
  met.y_range = {{0, std::max(1.08 * touching, 0.01)}};
  met.add("light", place.meetings.distance_mm, place.meetings.fraction);
  met.add_line("all of it", {0, touching}, {length_mm, touching});
  return {palpate::text("%.3g %% of the LED's light is guided and meets the touched face", 100 * touching),
          {fan, met},
          1,
          1100,
          760};
}

Report led(const Common& common, const Options& options) {
  const optics::Waveguide guide = guide_of(options.media, true);
  optics::EdgeLamp lamp = lamp_of(options.lamp, guide);
  const double depth = options.depth_mm.value_or(optics::middle_depth_mm(guide, lamp.layer));
  if (options.depth_mm) {
    const size_t layer = optics::layer_at(guide, depth);
    if (options.lamp.layer && layer != lamp.layer)
      throw Error(Failure::Usage, "--depth-mm in the layer of --led-layer",
                  palpate::text("%g mm is in layer %zu", depth, layer + 1), "one of the two");
    lamp.layer = layer;
  }
  const auto place_at = [&](size_t layer, double depth_mm) {
    optics::EdgeLamp here = lamp;
    here.layer = layer;
    return Place{optics::lamp_fractions(guide, here),
                 optics::first_meetings(guide, here, depth_mm, options.length_mm)};
  };
  const Place place = place_at(lamp.layer, depth);
  std::vector<optics::EdgeRay> rays;
  const double widest = std::min(lamp.half_angle_rad, radians(89));
  for (int i = 0; i < options.rays; ++i) {
    const double angle = options.rays == 1 ? 0 : widest * (2.0 * i / (options.rays - 1) - 1);
    rays.push_back(optics::trace_ray(guide, lamp, depth, angle, options.length_mm));
  }

  std::string text = palpate::text(
      "an LED (cos^%.3g, up to %g deg) at the edge of layer %zu, %.4g mm below the touched face, n = %g "
      "between\n\n"
      "LED at layer   depth, mm    enters    guided   meets face   first at, mm   half by, mm   90 %% by, "
      "mm\n",
      lamp.order, degrees(lamp.half_angle_rad), lamp.layer + 1, depth, lamp.edge_index);
  const auto row = [&](const std::string& name, double depth_mm, const Place& p) {
    text += palpate::text("%-13s %10.4g %9.5f %9.5f %12.5f %14s %13s %13s\n", name.c_str(), depth_mm,
                          p.fractions.entering, p.fractions.guided, p.fractions.touching,
                          or_dash(p.meetings.nearest_mm).c_str(),
                          or_dash(p.meetings.distance_of(0.5, p.fractions.touching)).c_str(),
                          or_dash(p.meetings.distance_of(0.9, p.fractions.touching)).c_str());
  };
  row("chosen", depth, place);
  Json places = Json::array();
  for (size_t i = 0; i < guide.layers.size(); ++i) {
    const Place other = place_at(i, optics::middle_depth_mm(guide, i));
    row(palpate::text("middle of %zu", i + 1), optics::middle_depth_mm(guide, i), other);
    places.push_back(place_json(other, optics::middle_depth_mm(guide, i)));
  }
  text += palpate::text(
      "\nnearer than \"first at\" the face gets no guided light in the LED's plane: let the pad begin "
      "that far from what is\nmeasured. -: not within %g mm\n",
      options.length_mm);
  std::string ray_csv = "angle_deg,n_sin,fate,entering,first_mm,hop_mm\n";
  Json ray_list = Json::array();
  for (const optics::EdgeRay& ray : rays) {
    const std::string first = std::isfinite(ray.first_mm) ? palpate::text("%.9g", ray.first_mm) : "";
    ray_csv += palpate::text("%.9g,%.9g,%s,%.9g,%s,%.9g\n", degrees(ray.angle_rad), ray.tangential_index,
                             to_string(ray.fate), ray.entering, first.c_str(), ray.hop_mm);
    ray_list.push_back({{"angle_deg", degrees(ray.angle_rad)},
                        {"n_sin", ray.tangential_index},
                        {"fate", to_string(ray.fate)},
                        {"entering", ray.entering},
                        {"first_mm", ray.first_mm},
                        {"hop_mm", ray.hop_mm}});
  }
  const Json value = {{"led", to_json(lamp)},
                      {"length_mm", options.length_mm},
                      {"place", place_json(place, depth)},
                      {"middle_of_layers", places},
                      {"rays", ray_list}};
  if (!common.out.empty())
    text += "\n" + write_results(common, "led", ray_csv, fan_plot(guide, rays, place, options.length_mm));
  return {text, value};
}

}  // namespace

void add_optics_led(CommandLine& group, Common& common, Command& chosen) {
  CommandLine* command = group.add_subcommand(
      "led", "Where an LED's rays go from the edge: what is trapped, and where it first meets the face");
  auto options = std::make_shared<Options>();
  add_media(*command, options->media, true);
  add_lamp(*command, options->lamp);
  command->add_option("--depth-mm", options->depth_mm,
                      "The LED's depth below the touched face, mm (default: the middle of its layer)");
  command->add_option("--length-mm", options->length_mm, "Length of the pad from this edge, mm")
      ->capture_default_str();
  command->add_setting("--rays", options->rays, Check::range(1, 500), "Rays drawn, evenly spread in angle");
  command->add_option("--out", common.out, "Folder for led.csv, .png, .svg and .pdf");
  add_common(*command, common,
             "  palpate optics led --indices 1,1.39,1.40,1.41,1 --thickness-mm 2,2,2 --out out/pad\n"
             "  palpate optics led --indices 1,1.41,1 --thickness-mm 6 --depth-mm 1 --edge-index 1.41\n");
  command->runs(chosen, [&common, options] { return led(common, *options); });
}

}  // namespace palpate
