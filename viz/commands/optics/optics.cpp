// palpate optics: a pad designed as a waveguide.
#include "viz/commands/optics/optics.h"

#include <cstdio>
#include <numbers>

#include "capture/files/output_file.h"
#include "engine/base/json.h"
#include "palpate/error.h"
#include "viz/commands/support/options.h"

namespace palpate {

void add_media(CommandLine& command, MediaOptions& media, bool thickness) {
  command
      .add_option("--indices", media.indices,
                  "Refractive indices: outside of the touched face, layers, outside towards the camera")
      ->delimiter(',')
      ->required();
  if (thickness)
    command
        .add_option("--thickness-mm", media.thickness_mm, "Thickness of the layers, mm: each, or one for all")
        ->delimiter(',');
}

std::vector<double> layer_thickness(const MediaOptions& media, bool needed) {
  const size_t given = media.indices.size();
  if (given < 2)
    throw Error(Failure::Usage, "at least two --indices", std::to_string(given),
                "--indices 1,1.39,1.40,1.41,1");
  const size_t layers = given - 2, found = media.thickness_mm.size();
  if (found == 0 && !needed) return std::vector<double>(layers, 1.0);
  if (found == 1) return std::vector<double>(layers, media.thickness_mm.front());
  if (found != layers)
    throw Error(
        Failure::Usage, "one --thickness-mm for each layer, or one for all",
        std::to_string(layers) + " layers between the outsides and " + std::to_string(found) + " thicknesses",
        "as many thicknesses as indices less two");
  return media.thickness_mm;
}

optics::Waveguide guide_of(const MediaOptions& media, bool needs_thickness) {
  const std::vector<double> thickness = layer_thickness(media, needs_thickness);
  optics::Waveguide guide;
  guide.above = media.indices.front();
  guide.below = media.indices.back();
  for (size_t i = 0; i < thickness.size(); ++i) guide.layers.push_back({media.indices[i + 1], thickness[i]});
  optics::check_waveguide(guide);
  return guide;
}

void add_lamp(CommandLine& command, LampOptions& lamp) {
  command.add_option("--led-layer", lamp.layer,
                     "The layer whose edge the LED lights, from 1 at the touched face (default: the middle)");
  command
      .add_option("--edge-index", lamp.edge_index,
                  "Index between LED and edge: 1 is air, the layer's own an LED that is cast in")
      ->capture_default_str();
  CommandOption* order = command.add_option(
      "--led-order", lamp.order, "The LED shines as cos^ORDER of the angle (default 1: Lambert's law)");
  command
      .add_option("--led-half-intensity-deg", lamp.half_intensity_deg,
                  "Instead: the angle off its axis at which half the intensity is left, deg")
      ->excludes(order);
  command.add_option("--led-half-angle-deg", lamp.half_angle_deg, "No light beyond this angle, deg")
      ->capture_default_str();
}

optics::EdgeLamp lamp_of(const LampOptions& options, const optics::Waveguide& guide) {
  optics::EdgeLamp lamp;
  const size_t layer = options.layer.value_or(optics::middle_layer(guide) + 1);
  if (layer < 1 || layer > guide.layers.size())
    throw Error(Failure::Usage, "--led-layer from 1 to " + std::to_string(guide.layers.size()),
                std::to_string(layer), "1 for the layer that is touched");
  lamp.layer = layer - 1;
  lamp.edge_index = options.edge_index;
  if (options.order) lamp.order = *options.order;
  if (options.half_intensity_deg)
    lamp.order = optics::order_from_half_intensity(radians(*options.half_intensity_deg));
  lamp.half_angle_rad = options.half_angle_deg == 90 ? std::numbers::pi / 2 : radians(options.half_angle_deg);
  optics::check_lamp(guide, lamp);
  return lamp;
}

json::Value to_json(const optics::EdgeLamp& lamp) {
  return {{"layer", lamp.layer + 1},
          {"edge_index", lamp.edge_index},
          {"order", lamp.order},
          {"half_angle_deg", degrees(lamp.half_angle_rad)}};
}

double degrees(double rad) {
  return rad * 180 / std::numbers::pi;
}

double radians(double deg) {
  return deg * std::numbers::pi / 180;
}

std::string write_results(const Common& common, const std::string& name, const std::string& csv,
                          const Plot& plot) {
  if (common.out.empty()) return {};
  make_output_folder(common.out);
  const std::string stem = (common.out / name).string();
  write_whole(stem + ".csv", std::string_view(csv));
  std::string written = "written: " + stem + ".csv";
  draw_plot(plot, stem, written);
  return written;
}

void add_optics(CommandLine& program, Common& common, Command& chosen) {
  CommandLine* group =
      program.add_subcommand("optics", "Design the pad as a waveguide: where its light goes");
  group->require_subcommand(1);
  group->footer(
      "Examples:\n"
      "  palpate optics stack --indices 1,1.39,1.40,1.41,1 --angle-deg 30\n"
      "  palpate optics led --indices 1,1.41,1 --thickness-mm 5\n"
      "  palpate help optics led\n");
  add_optics_stack(*group, common, chosen);
  add_optics_critical(*group, common, chosen);
  add_optics_trapped(*group, common, chosen);
  add_optics_contact(*group, common, chosen);
  add_optics_led(*group, common, chosen);
  add_optics_index(*group, common, chosen);
}

}  // namespace palpate
