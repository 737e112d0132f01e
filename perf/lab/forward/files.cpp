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
#include "viz/report/gnuplot.h"
#include "viz/report/plot_script.h"

namespace palpate {
namespace {

namespace fs = std::filesystem;

constexpr uint32_t kWidth_px = 640, kHeight_px = 480;

/// Pressure at a place from the surface's middle, linear between nodes; 0 off the block.
double pressure_MPa(const fem::Map& map, double x_mm, double y_mm) {
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

std::string matrix_lines(const fem::Map& map) {
  std::string lines;
  for (uint32_t j = 0; j < map.height; ++j) {
    for (uint32_t i = 0; i < map.width; ++i)
      lines += plot_number((i - (map.width - 1) / 2.0) * map.pitch_mm[0]) + " " +
               plot_number((j - (map.height - 1) / 2.0) * map.pitch_mm[1]) + " " +
               plot_number(static_cast<double>(map.at(i, j))) + "\n";
    lines += "\n";
  }
  return lines;
}

std::pair<double, double> ends_of(const fem::Map& map) {
  std::pair<double, double> ends{HUGE_VAL, -HUGE_VAL};
  for (uint32_t j = 0; j < map.height; ++j)
    for (uint32_t i = 0; i < map.width; ++i) {
      ends.first = std::min(ends.first, static_cast<double>(map.at(i, j)));
      ends.second = std::max(ends.second, static_cast<double>(map.at(i, j)));
    }
  return ends;
}

std::string maps_script(const ForwardOutcome& o) {
  const auto [least_Pa, most_Pa] = ends_of(o.result.stress_Pa);
  const auto [least_mm, most_mm] = ends_of(o.result.deflection_mm);
  const PlotUnit unit = plot_unit(most_Pa, "Pa");
  const bool rigid = most_mm - least_mm <= 1e-6 * std::abs(most_mm);
  const std::string deflection = rigid ? text("deflection of the surface: %.4g mm everywhere", most_mm)
                                       : "deflection of the surface, mm";
  std::string s = data_block("stress", matrix_lines(o.result.stress_Pa)) +
                  data_block("deflection", matrix_lines(o.result.deflection_mm));
  s += std::string("unset key\nset size ratio -1\nset xlabel 'x, mm'\nset ylabel 'y, mm'\nset tics out\n") +
       plot_palette() + "set autoscale fix\nset multiplot layout 1,2 title " + plot_words(headline(o)) +
       "\nset title 'stress on the surface, " + unit.name + "'\n" + plot_colour_bar(least_Pa, most_Pa) +
       "plot $stress using 1:2:" + unit.column(3) + " with image\n" + "set title " + plot_words(deflection) +
       "\n" + plot_colour_bar(least_mm, most_mm) +
       "set format cb '%.4g'\nplot $deflection using 1:2:3 with image\nunset multiplot\n";
  return s;
}

std::string profile_script(const ForwardOutcome& o) {
  std::string points, curve;
  double most_Pa = 0;
  for (size_t i = 0; i < o.profile.x_mm.size(); ++i) {
    points += plot_number(o.profile.x_mm[i]) + " " + plot_number(o.profile.value[i]) + "\n";
    most_Pa = std::max(most_Pa, o.profile.value[i]);
  }
  for (int i = -100; i <= 100; ++i) {
    const double x = 0.4 * o.scene.block_mm[0] * i / 100;
    curve += plot_number(x) + " " + plot_number(o.fit.at(x)) + "\n";
  }
  const PlotUnit unit = plot_unit(most_Pa, "Pa");
  std::string s = data_block("points", points) + data_block("curve", curve) + plot_look();
  s += "set title " + plot_words(headline(o)) + "\nset xlabel 'x, mm'\nset ylabel 'stress on the surface, " +
       unit.name + "'\nset key top right\nplot $points using 1:" + unit.column(2) +
       " with linespoints pt 7 ps 0.5 lc rgb '#0072b2' title 'model'";
  if (o.fit.found)
    s += ", $curve using 1:" + unit.column(2) + " with lines lw 2 lc rgb '#d55e00' title " +
         plot_words(text("Gaussian, s %.3g mm, R^2 %.4f", o.fit.width_mm, o.fit.r_squared));
  return s + "\n";
}

}  // namespace

std::string headline(const ForwardOutcome& o) {
  const std::string press = text("At %.3g N, %.3g mm deep, ", o.result.force_N, o.result.press_mm);
  if (!o.fit.found) return press + "no bump stands out of the profile";
  const PlotUnit unit = plot_unit(std::abs(o.fit.amplitude), "Pa");
  return press + text("the pressure has a bump of %.3g %s, %.3g mm wide at half height",
                      unit.factor * o.fit.amplitude, unit.name.c_str(), 2.3548 * std::abs(o.fit.width_mm));
}

TactileImage tactile_image(const fem::Map& stress, const Sensor* sensor) {
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
  const fem::Map& stress = o.result.stress_Pa;
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
  draw_scripts(maps_script(o), 1040, 460, folder / "maps", written);
  draw_scripts(profile_script(o), 820, 520, folder / "profile", written);
  return written;
}

}  // namespace palpate
