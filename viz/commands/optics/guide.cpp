// palpate optics critical and trapped: the angles at which a pad traps light, and the fraction of an LED's
// light.
#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/base/json.h"
#include "engine/base/text.h"
#include "palpate/error.h"
#include "viz/commands/optics/optics.h"
#include "viz/commands/support/options.h"

namespace palpate {
namespace {

using Json = json::Value;

struct CriticalOptions {
  MediaOptions media;
  std::optional<double> edge_index;
};

struct TrappedOptions {
  MediaOptions media;
  LampOptions lamp;
  std::string vary;
};

Json angle_json(const std::optional<double>& rad) {
  return rad ? Json(degrees(*rad)) : Json(nullptr);
}
std::string angle_text(const std::optional<double>& rad) {
  return rad ? palpate::text("%.6f", degrees(*rad)) : "none";
}
Json range_json(double from, double to) {
  return from < to ? Json{from, to} : Json(nullptr);
}
std::string range_text(double from, double to) {
  return from < to ? palpate::text("%.4g to %.4g", from, to) : "none";
}
/// From the normal, in the layer itself.
Json angles_json(double from, double to, double index) {
  return from < to ? Json{degrees(std::asin(from / index)), degrees(std::asin(std::min(1.0, to / index)))}
                   : Json(nullptr);
}

Report critical(const CriticalOptions& options) {
  const optics::Waveguide guide = guide_of(options.media, false);
  const double edge = options.edge_index.value_or(optics::outside_index(guide));
  const std::vector<optics::LayerGuidance> found = optics::guidance(guide, edge);
  std::string text = palpate::text(
      "n = %g outside of the touched face, %g towards the camera, %g at the edge\n\n"
      "layer      n   critical angle, deg           NA     accepts, deg   guided n sin      meets the face\n"
      "                above       below                 from the edge\n",
      guide.above, guide.below, edge);
  Json layers = Json::array();
  bool unreached = false;
  for (size_t i = 0; i < found.size(); ++i) {
    const optics::LayerGuidance& l = found[i];
    const double n = guide.layers[i].index;
    unreached = unreached || l.touching_to < l.guided_to;
    text += palpate::text("%5zu %6.4g %11s %11s %11.6f %12.6f%s   %-15s   %s\n", i + 1, n,
                          angle_text(l.critical_above_rad).c_str(), angle_text(l.critical_below_rad).c_str(),
                          l.numerical_aperture, degrees(l.accepts.half_angle_rad), l.accepts.all ? "*" : " ",
                          range_text(l.guided_from, l.guided_to).c_str(),
                          range_text(l.touching_from, l.touching_to).c_str());
    layers.push_back({{"index", n},
                      {"critical_angle_above_deg", angle_json(l.critical_above_rad)},
                      {"critical_angle_below_deg", angle_json(l.critical_below_rad)},
                      {"numerical_aperture", l.numerical_aperture},
                      {"acceptance_half_angle_deg", degrees(l.accepts.half_angle_rad)},
                      {"accepts_all", l.accepts.all},
                      {"guided_n_sin", range_json(l.guided_from, l.guided_to)},
                      {"guided_deg", angles_json(l.guided_from, l.guided_to, n)},
                      {"touching_n_sin", range_json(l.touching_from, l.touching_to)},
                      {"touching_deg", angles_json(l.touching_from, l.touching_to, n)}});
  }
  text += "\nlight is kept in beyond the critical angle (from the normal) of the outside that it reaches\n";
  if (std::any_of(found.begin(), found.end(), [](const optics::LayerGuidance& l) { return l.accepts.all; }))
    text += "* NA is at least the index at the edge: whatever enters is kept in\n";
  if (unreached)
    text +=
        "some guided light turns back at a layer of lower index before the touched face: no contact shows "
        "it\n";
  const Json value = {
      {"above_index", guide.above}, {"below_index", guide.below}, {"edge_index", edge}, {"layers", layers}};
  return {text, value};
}

Json fractions_json(const optics::LampFractions& s) {
  return {{"entering", s.entering},
          {"guided", s.guided},
          {"touching", s.touching},
          {"guided_of_entering", s.entering > 0 ? Json(s.guided / s.entering) : Json(nullptr)}};
}

struct Range {
  size_t layer = 0;
  double from = 1, to = 1;
};
Range parse_vary(const std::string& text, const optics::Waveguide& guide, const optics::EdgeLamp& lamp) {
  if (text.empty()) return {lamp.layer, 1, 1.7};
  Range range;
  unsigned layer = 0;
  int used = 0;
  const bool read = std::sscanf(text.c_str(), "%u:%lf:%lf%n", &layer, &range.from, &range.to, &used) == 3 &&
                    static_cast<size_t>(used) == text.size();
  if (!read || layer < 1 || layer > guide.layers.size() || !(range.from >= 1) || !(range.to <= 10) ||
      !(range.from < range.to))
    throw Error(Failure::Usage, "--vary LAYER:FROM:TO, a layer that there is and two indices from 1 to 10",
                "'" + text + "'", "--vary 2:1.3:1.6");
  range.layer = layer - 1;
  return range;
}

Report trapped(const Common& common, const TrappedOptions& options) {
  const optics::Waveguide guide = guide_of(options.media, false);
  const optics::EdgeLamp lamp = lamp_of(options.lamp, guide);
  const Range range = parse_vary(options.vary, guide, lamp);
  std::string text = palpate::text(
      "an LED (cos^%.3g, up to %g deg) at the edge, n = %g between; fractions of its light\n\n"
      "lit layer      n     enters     guided   meets the face\n",
      lamp.order, degrees(lamp.half_angle_rad), lamp.edge_index);
  Json layers = Json::array();
  for (size_t i = 0; i < guide.layers.size(); ++i) {
    optics::EdgeLamp here = lamp;
    here.layer = i;
    const optics::LampFractions s = optics::lamp_fractions(guide, here);
    text += palpate::text("%9zu%s %5.4g %10.6f %10.6f %10.6f\n", i + 1, i == lamp.layer ? "*" : " ",
                          guide.layers[i].index, s.entering, s.guided, s.touching);
    Json row = fractions_json(s);
    row["index"] = guide.layers[i].index;
    layers.push_back(row);
  }
  text += "* chosen by --led-layer, or the middle one\n";

  constexpr int kSteps = 140;
  std::vector<std::vector<double>> curve(4);
  for (int i = 0; i <= kSteps; ++i) {
    optics::Waveguide varied = guide;
    const double n = range.from + (range.to - range.from) * i / kSteps;
    varied.layers[range.layer].index = n;
    const optics::LampFractions s = optics::lamp_fractions(varied, lamp);
    const double cells[] = {n, s.entering, s.guided, s.touching};
    for (size_t c = 0; c < curve.size(); ++c) curve[c].push_back(cells[c]);
  }
  const auto best = std::max_element(curve[3].begin(), curve[3].end()) - curve[3].begin();
  text += palpate::text(
      "\nwith n of layer %zu from %g to %g, most light meets the face at n = %.4g: %.4f of the LED's\n",
      range.layer + 1, range.from, range.to, curve[0][static_cast<size_t>(best)],
      curve[3][static_cast<size_t>(best)]);
  const Json value = {
      {"led", to_json(lamp)},
      {"led_layer_shares", fractions_json(optics::lamp_fractions(guide, lamp))},
      {"layers", layers},
      {"varied_layer", range.layer + 1},
      {"best_index", curve[0][static_cast<size_t>(best)]},
      {"best_touching", curve[3][static_cast<size_t>(best)]},
      {"curve", {{"index", curve[0]}, {"entering", curve[1]}, {"guided", curve[2]}, {"touching", curve[3]}}}};
  if (common.out.empty()) return {text, value};
  const double own = guide.layers[range.layer].index;
  PlotPanel panel{
      palpate::text("With layer %zu at n = %.4g most light meets the touched face: %.3g %% of the LED's",
                    range.layer + 1, curve[0][static_cast<size_t>(best)],
                    100 * curve[3][static_cast<size_t>(best)]),
      palpate::text("index of layer %zu (dashed: as it is)", range.layer + 1), "fraction of the LED's light"};
  panel.x_range = {{range.from, range.to}};
  panel.y_range = {{0, 1.02}};
  panel.key = "outside top center horizontal";
  panel.add("enters", curve[0], curve[1], kPlotGray);
  panel.add("guided", curve[0], curve[2]);
  panel.add("meets the touched face", curve[0], curve[3], 1);
  panel.add_line("", {own, 0}, {own, 1.02});
  text += "\n" + write_results(common, "trapped", csv_of("index,entering,guided,touching", curve),
                               {.panels = {panel}, .width_px = 900, .height_px = 560});
  return {text, value};
}

}  // namespace

void add_optics_critical(CommandLine& group, Common& common, Command& chosen) {
  CommandLine* command =
      group.add_subcommand("critical", "Critical angles, numerical aperture and acceptance of each layer");
  auto options = std::make_shared<CriticalOptions>();
  add_media(*command, options->media, false);
  command->add_option("--edge-index", options->edge_index,
                      "Index that light enters the edge from (default: the larger outside)");
  add_common(*command, common,
             "  palpate optics critical --indices 1,1.39,1.40,1.41,1\n"
             "  palpate optics critical --indices 1.33,1.40,1.52,1 --json    # wet, on glass\n");
  command->runs(chosen, [options] { return critical(*options); });
}

void add_optics_trapped(CommandLine& group, Common& common, Command& chosen) {
  CommandLine* command =
      group.add_subcommand("trapped", "How much of an LED's light the layers trap, against their indices");
  auto options = std::make_shared<TrappedOptions>();
  add_media(*command, options->media, false);
  add_lamp(*command, options->lamp);
  command->add_option("--vary", options->vary,
                      "LAYER:FROM:TO, the layer whose index is varied (default: the lit one, 1 to 1.7)");
  command->add_option("--out", common.out, "Folder for trapped.csv, .png, .svg and .pdf");
  add_common(*command, common,
             "  palpate optics trapped --indices 1,1.39,1.40,1.41,1 --out out/pad\n"
             "  palpate optics trapped --indices 1,1.39,1.40,1.41,1 --led-layer 1 --vary 3:1.3:1.6\n"
             "  palpate optics trapped --indices 1,1.41,1 --edge-index 1.41 --led-half-intensity-deg 30\n");
  command->runs(chosen, [&common, options] { return trapped(common, *options); });
}

}  // namespace palpate
