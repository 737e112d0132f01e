#include "viz/look_options.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <numbers>

namespace palpate {

void LookOptions::add(CLI::App& command) {
  command
      .add_option("--depth-range", range_mm_,
                  "Depth with the last colour of pictures, mm (default: follows the touch)")
      ->check(CLI::Range(1e-4, 100.0));
  command
      .add_option("--exaggeration", exaggeration_,
                  "Of depth in pictures, 1 is true to scale (default: follows the range)")
      ->check(CLI::Range(0.1, 1000.0));
  command
      .add_option("--view", view_deg_,
                  "Viewpoint of pictures: azimuth,elevation in degrees; 0,90 is straight above, negative "
                  "elevations look from inside the pad")
      ->delimiter(',')
      ->expected(2)
      ->check(CLI::Range(-180.0, 180.0));
}

void LookOptions::apply(viz::PictureOptions& look) const {
  look.range_mm = range_mm_;
  look.exaggeration = exaggeration_;
  if (view_deg_.empty()) return;
  constexpr double kDegree = std::numbers::pi / 180;
  look.camera.azimuth_rad = view_deg_[0] * kDegree;
  look.camera.elevation_rad =
      std::clamp(view_deg_[1] * kDegree, -viz::Camera::kMaxElevation_rad, viz::Camera::kMaxElevation_rad);
}

}  // namespace palpate
