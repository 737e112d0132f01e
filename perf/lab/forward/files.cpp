// Pictures and files of a solved forward scene.
#include <algorithm>
#include <cmath>
#include <utility>

#include "capture/files/images/images.h"
#include "capture/files/npy.h"
#include "capture/files/output_file.h"
#include "capture/synthetic/optics.h"
#include "engine/base/json.h"
#include "engine/base/text.h"
#include "palpate/error.h"
#include "perf/lab/forward/forward.h"
#include "viz/report/plot_script.h"

namespace palpate {
namespace {

namespace fs = std::filesystem;

constexpr uint32_t kWidth_px = 640, kHeight_px = 480;

/// Pressure at a place from the surface's middle, linear between nodes; 0 off the block.
double pressure_MPa(const PressureMap& map, double x_mm, double y_mm) {
  const double i = x_mm / map.pitch_mm[0] + (map.width - 1) / 2.0;
  const double j = y_mm / map.pitch_mm[1] + (map.height - 1) / 2.0;
  if (!(i >= 0 && j >= 0 && i <= map.width - 1 && j <= map.height - 1)) return 0;
  const auto x = std::min(static_cast<uint32_t>(i), map.width - 2);
  const auto y = std::min(static_cast<uint32_t>(j), map.height - 2);
  const double s = i - x, t = j - y;
  const auto at = [&](uint32_t a, uint32_t b) { return static_cast<double>(map.at(a, b)); };
  return 1e-6 * ((1 - t) * ((1 - s) * at(x, y) + s * at(x + 1, y)) +
                 t * ((1 - s) * at(x, y + 1) + s * at(x + 1, y + 1)));
}

Plot maps_plot(const ForwardOutcome& o) {
  const PressureMap &stress = o.result.stress_Pa, &deflection = o.result.deflection_mm;
  const auto [least_mm, most_mm] = std::minmax_element(deflection.values.begin(), deflection.values.end());
  const double most = static_cast<double>(*most_mm);
  const PlotUnit unit = plot_unit(*std::max_element(stress.values.begin(), stress.values.end()), "Pa");
  const bool rigid = most - static_cast<double>(*least_mm) <= 1e-6 * std::abs(most);
  return {.title = headline(o),
          .panels = {{.title = "stress on the surface, " + unit.name,
                      .x_label = "x, mm",
                      .y_label = "y, mm",
                      .map = plot_map(stress, unit.factor)},
                     {.title = rigid ? text("deflection of the surface: %.4g mm everywhere", most)
                                     : "deflection of the surface, mm",
                      .x_label = "x, mm",
                      .y_label = "y, mm",
                      .map = plot_map(deflection)}},
          .across = 2,
          .width_px = 1040,
          .height_px = 460};
}

Plot profile_plot(const ForwardOutcome& o) {
  const std::vector<double>& stress_Pa = o.profile.value;
  const double most_Pa =
      stress_Pa.empty() ? 0 : std::max(0.0, *std::max_element(stress_Pa.begin(), stress_Pa.end()));
  const PlotUnit unit = plot_unit(most_Pa, "Pa");
  PlotPanel panel{.title = headline(o), .x_label = "x, mm", .y_label = "stress on the surface, " + unit.name};
  panel.curves.push_back({.title = "model",
                          .x = o.profile.x_mm,
                          .y = plot_scaled(stress_Pa, unit.factor),
                          .style = PlotCurve::Style::LinesAndPoints});
  if (o.fit.found) {
    PlotCurve curve = gaussian_curve(o.fit, 0.4 * o.scene.block_mm[0], unit.factor);
    curve.title = text("Gaussian, s %.3g mm, R^2 %.4f", o.fit.width_mm, o.fit.r_squared);
    curve.colour = 1;
    panel.curves.push_back(std::move(curve));
  }
  return {.panels = {panel}};
}

}  // namespace

PlotMap plot_map(const PressureMap& map, double factor) {
  PlotMap plot{map.width, map.height, map.pitch_mm[0], map.pitch_mm[1]};
  for (const float value : map.values) plot.values.push_back(factor * static_cast<double>(value));
  return plot;
}

PlotCurve gaussian_curve(const lump::GaussianFit& fit, double half_mm, double factor) {
  PlotCurve curve;
  for (int i = -100; i <= 100; ++i) {
    curve.x.push_back(half_mm * i / 100);
    curve.y.push_back(factor * fit.at(curve.x.back()));
  }
  return curve;
}

std::string headline(const ForwardOutcome& o) {
  const std::string press = text("At %.3g N, %.3g mm deep, ", o.result.force_N, o.result.press_mm);
  if (!o.fit.found) return press + "no bump stands out of the profile";
  const PlotUnit unit = plot_unit(std::abs(o.fit.amplitude), "Pa");
  return press + text("the pressure has a bump of %.3g %s, %.3g mm wide at half height",
                      unit.factor * o.fit.amplitude, unit.name.c_str(), 2.3548 * std::abs(o.fit.width_mm));
}

TactileImage tactile_image(const PressureMap& stress, const Sensor* sensor) {
  TactileImage image;
  image.width = kWidth_px;
  image.height = kHeight_px;
  double gray_per_MPa = optics::kGrayPerMPa;
  SyntheticOptions built_in;
  built_in.width = kWidth_px;
  built_in.height = kHeight_px;
  const optics::Field field(built_in);
  if (sensor == nullptr) {
    image.pitch_mm_per_px = optics::pitch_mm(built_in);
    image.source = "the built-in sensor";
  } else {
    const auto& force = sensor->force;
    if (!force || force->signal != ForceSignal::GraySum || force->model != ForceModel::Line ||
        !(force->c1_N_per_gray > 0) || !(sensor->pitch_mm_per_px > 0))
      throw Error(
          Failure::Sensor, "a sensor file with a scale and a straight force calibration of the gray sum",
          "\"" + sensor->name + "\" without one", "palpate calibrate force --model line --signal gray");
    image.pitch_mm_per_px = sensor->pitch_mm_per_px;
    if (sensor->size_px[0] > 0 && sensor->size_px[1] > 0) {
      image.width = sensor->size_px[0];
      image.height = sensor->size_px[1];
    }
    gray_per_MPa = image.pitch_mm_per_px * image.pitch_mm_per_px / force->c1_N_per_gray;
    image.source = sensor->name;
  }
  const double centre_x = (image.width - 1) / 2.0, centre_y = (image.height - 1) / 2.0;
  image.gray.reserve(size_t{image.width} * image.height);
  for (uint32_t y = 0; y < image.height; ++y)
    for (uint32_t x = 0; x < image.width; ++x) {
      const double x_mm = (x - centre_x) * image.pitch_mm_per_px,
                   y_mm = (y - centre_y) * image.pitch_mm_per_px;
      double light = gray_per_MPa * std::max(0.0, pressure_MPa(stress, x_mm, y_mm));
      double dark = 0;
      if (sensor == nullptr) {
        light *= field.touch(x_mm, y_mm);
        dark = field.stray_gray(x_mm, y_mm);
      }
      image.brightest_change = std::max(image.brightest_change, light);
      image.clipped_px += light + dark > 255;
      image.gray.push_back(static_cast<float>(light + dark));
    }
  return image;
}

std::string write_files(const ForwardOutcome& o, const TactileImage& image, const fs::path& folder) {
  make_output_folder(folder);
  const PressureMap& stress = o.result.stress_Pa;
  write_npy(folder / "stress_Pa.npy", stress.values, {stress.height, stress.width});
  write_npy(folder / "deflection_mm.npy", o.result.deflection_mm.values, {stress.height, stress.width});
  write_npy(folder / "tactile.npy", image.gray, {image.height, image.width});
  Frame frame;
  frame.reshape({image.width, image.height, 1, 8});
  for (size_t i = 0; i < image.gray.size(); ++i)
    frame.bytes[i] = static_cast<uint8_t>(std::clamp(std::lround(image.gray[i]), 0L, 255L));
  write_whole(folder / "tactile.png", encode_image(frame, ".png"));
  std::string rows = "x_mm,stress_Pa,gaussian_Pa\n";
  for (size_t i = 0; i < o.profile.x_mm.size(); ++i)
    rows += plot_number(o.profile.x_mm[i]) + "," + plot_number(o.profile.value[i]) + "," +
            (o.fit.found ? plot_number(o.fit.at(o.profile.x_mm[i])) : "") + "\n";
  write_whole(folder / "profile.csv", std::string_view(rows));
  write_whole(folder / "forward.json", std::string_view(to_json(o).dump(2) + "\n"));
  std::string written = (folder / "stress_Pa.npy").string() +
                        ", deflection_mm.npy, tactile.npy, tactile.png, "
                        "profile.csv, forward.json";
  draw_plot(maps_plot(o), folder / "maps", written);
  draw_plot(profile_plot(o), folder / "profile", written);
  return written;
}

}  // namespace palpate
