#include "viz/commands/option_groups/look_options.h"
#include "viz/commands/support/options.h"

#include <algorithm>
#include <map>
#include <numbers>
#include <string>

namespace palpate {

void LookOptions::add(CommandLine& command) {
  command
      .add_option("--depth-range", range_mm_,
                  "Depth with the last colour of pictures, mm (default: follows the touch)")
      ->check(Check::range(1e-4, 100.0));
  command
      .add_option("--exaggeration", exaggeration_,
                  "Of depth in pictures, 1 is true to scale (default: follows the range)")
      ->check(Check::range(0.1, 1000.0));
  command
      .add_option("--view", view_deg_,
                  "Viewpoint of pictures: azimuth,elevation in degrees; 0,90 is straight above, negative "
                  "elevations look from inside the pad")
      ->delimiter(',')
      ->expected(2)
      ->check(Check::range(-180.0, 180.0));
  const std::map<std::string, viz::Quantity> quantities = {{"depth", viz::Quantity::Depth},
                                                           {"pressure", viz::Quantity::Pressure},
                                                           {"strain", viz::Quantity::Strain},
                                                           {"friction", viz::Quantity::Friction}};
  const std::map<std::string, viz::ColourMap> maps = {{"viridis", viz::ColourMap::Viridis},
                                                      {"cividis", viz::ColourMap::Cividis},
                                                      {"magma", viz::ColourMap::Magma}};
  command
      .add_option("--colours", quantity_,
                  "What colours of pictures show: depth (default), pressure (where the sensor reads it or "
                  "has a layer), strain, friction (shear over pressure; a layer and a skin)")
      ->transform(one_of(quantities));
  command.add_option("--colour-map", map_, "viridis (default), cividis or magma")->transform(one_of(maps));
  command
      .add_option(
          "--colour-range", colour_range_,
          "Pressure (MPa), strain or shear over pressure with the last colour (default: follows the touch; "
          "strain 0.05; the friction coefficient)")
      ->check(Check::range(1e-4, 10.0));
  command
      .add_option("--section", section_,
                  "Draw a section of the depth in pictures: x0,y0,x1,y1 as fractions of the frame")
      ->delimiter(',')
      ->expected(4)
      ->check(Check::range(0.0, 1.0));
  const std::map<std::string, viz::SkinStrain> strains = {{"off", viz::SkinStrain::Off},
                                                          {"stretch", viz::SkinStrain::Stretch},
                                                          {"shear", viz::SkinStrain::Shear}};
  command
      .add_option(
          "--skin-strain", skin_strain_,
          "Draw the strain of the skin in its plane over the raw image, where a pattern on it is followed: "
          "off (default), stretch (larger principal strain), shear")
      ->transform(one_of(strains));
  command.add_flag("--calibrations", calibrations_,
                   "Draw the sensor's calibrations over pictures, as key I does in the window: force and "
                   "shear as curves with the present touch on them");
  for (const char* name : {"--depth-range", "--exaggeration", "--view", "--colours", "--colour-map",
                           "--colour-range", "--section", "--skin-strain", "--calibrations"})
    command.get_option(name)->group("Look of pictures");
}

void LookOptions::apply(viz::PictureOptions& look) const {
  look.range_mm = range_mm_;
  look.exaggeration = exaggeration_;
  look.quantity = quantity_;
  look.map = map_;
  look.colour_range = colour_range_;
  look.calibrations = calibrations_;
  look.skin_strain = skin_strain_;
  if (!section_.empty()) look.section = viz::SectionLine{section_[0], section_[1], section_[2], section_[3]};
  if (view_deg_.empty()) return;
  constexpr double kDegree = std::numbers::pi / 180;
  look.camera.azimuth_rad = view_deg_[0] * kDegree;
  look.camera.elevation_rad =
      std::clamp(view_deg_[1] * kDegree, -viz::Camera::kMaxElevation_rad, viz::Camera::kMaxElevation_rad);
}

}  // namespace palpate
