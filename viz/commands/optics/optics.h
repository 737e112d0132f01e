// Common parts of the commands of `palpate optics`: names of media and lamps on the command line.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "engine/base/json.h"
#include "engine/optics/edge_light.h"
#include "viz/commands/command.h"
#include "viz/report/plot.h"

namespace palpate {

class CommandLine;

/// The media that light meets, and their layers.
struct MediaOptions {
  std::vector<double> indices, extinction, thickness_mm;
};
/// --indices, and --thickness-mm where `thickness` says so.
void add_media(CommandLine& command, MediaOptions& media, bool thickness);
/// Thicknesses of the layers: one for all, or one each. Throws Error(Failure::Usage) where their numbers do
/// not fit, or none is given although `needed`; then 1 mm each stands for "of no effect".
std::vector<double> layer_thickness(const MediaOptions& media, bool needed);
/// The media as a waveguide, first outside = touched side.
optics::Waveguide guide_of(const MediaOptions& media, bool needs_thickness);

struct LampOptions {
  std::optional<size_t> layer;  ///< from 1
  double edge_index = 1;
  std::optional<double> order, half_intensity_deg;
  double half_angle_deg = 90;
};
/// --led-layer, --edge-index, --led-order or --led-half-intensity-deg, --led-half-angle-deg.
void add_lamp(CommandLine& command, LampOptions& lamp);
optics::EdgeLamp lamp_of(const LampOptions& options, const optics::Waveguide& guide);
json::Value to_json(const optics::EdgeLamp& lamp);

double degrees(double rad);
double radians(double deg);

/// Files of a command that draws: NAME.csv, NAME.png, NAME.svg and NAME.pdf in `common.out`. Returns the line
/// that names what was written; empty without --out.
std::string write_results(const Common& common, const std::string& name, const std::string& csv,
                          const Plot& plot);

void add_optics_stack(CommandLine& group, Common& common, Command& chosen);
void add_optics_critical(CommandLine& group, Common& common, Command& chosen);
void add_optics_index(CommandLine& group, Common& common, Command& chosen);
void add_optics_trapped(CommandLine& group, Common& common, Command& chosen);
void add_optics_contact(CommandLine& group, Common& common, Command& chosen);
void add_optics_led(CommandLine& group, Common& common, Command& chosen);

}  // namespace palpate
