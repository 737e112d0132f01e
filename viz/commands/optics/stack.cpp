// palpate optics stack: reflectance, transmittance and absorptance of plane layers.
#include <cmath>
#include <limits>
#include <numbers>

#include "engine/base/json.h"
#include "engine/base/text.h"
#include "engine/optics/optical_stack.h"
#include "palpate/error.h"
#include "viz/commands/optics/optics.h"
#include "viz/commands/support/options.h"

namespace palpate {
namespace {

using Json = json::Value;

struct Options {
  MediaOptions media;
  double angle_deg = 0;
  double wavelength_nm = 630;
};

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

optics::OpticalStack stack_of(const Options& options) {
  const MediaOptions& media = options.media;
  const size_t count = media.indices.size();
  std::vector<double> extinction = media.extinction;
  if (extinction.empty()) extinction.assign(count, 0);
  if (extinction.size() != count)
    throw Error(Failure::Usage, "one --extinction for each of --indices, outsides included",
                std::to_string(count) + " indices and " + std::to_string(extinction.size()) + " extinctions",
                "0 for a medium that is clear");
  bool absorbs = false;
  for (size_t i = 1; i + 1 < count; ++i) absorbs = absorbs || extinction[i] != 0;
  const std::vector<double> thickness = layer_thickness(media, absorbs);
  optics::OpticalStack stack;
  stack.from = optics::optical_index(media.indices.front(), extinction.front());
  stack.to = optics::optical_index(media.indices.back(), extinction.back());
  for (size_t i = 0; i < thickness.size(); ++i)
    stack.layers.push_back({optics::optical_index(media.indices[i + 1], extinction[i + 1]), thickness[i]});
  stack.wavelength_nm = options.wavelength_nm;
  return stack;
}

/// s, p and their mean.
struct Fractions {
  optics::StackLight s, p, mean;
};
Fractions fractions_at(const optics::OpticalStack& stack, double angle_rad) {
  return {optics::stack_light(stack, angle_rad, optics::Polarisation::S),
          optics::stack_light(stack, angle_rad, optics::Polarisation::P),
          optics::unpolarised_light(stack, angle_rad)};
}

Json triple(double s, double p, double mean) {
  return {{"s", s}, {"p", p}, {"unpolarised", mean}};
}

/// Angle of the light's way in a layer, by its real parts; none beyond the critical angle of a clear layer.
double angle_in(optics::OpticalIndex index, double s) {
  const double along = optics::normal_index(index, s).real();
  return along > 0 || s == 0 ? std::atan2(s, along) : kNone;
}

Plot sweep_plot(const std::vector<std::vector<double>>& sweep, bool absorbs, const std::string& title) {
  PlotPanel panel{title, "angle of incidence, deg", "fraction of the light"};
  panel.x_range = {{0, 90}};
  panel.y_range = {{0, 1.02}};
  panel.key = "outside top center horizontal";
  panel.add("reflected", sweep[0], sweep[3]);
  panel.add("reflected, s", sweep[0], sweep[1], 5).dashed = true;
  panel.add("reflected, p", sweep[0], sweep[2], 3).dashed = true;
  panel.add("passed", sweep[0], sweep[6], 2);
  if (absorbs) panel.add("absorbed", sweep[0], sweep[9], 1);
  return {.panels = {panel}, .width_px = 900, .height_px = 620};
}

Report stack(const Common& common, const Options& options) {
  const optics::OpticalStack media = stack_of(options);
  const double angle = options.angle_deg == 90 ? std::numbers::pi / 2 : radians(options.angle_deg);
  const Fractions l = fractions_at(media, angle);
  const double s = optics::tangential_index(media, angle);
  const bool total = l.mean.reflectance == 1;

  Json layers = Json::array();
  std::string text = palpate::text("light at %g deg from n = %g onto %zu layer%s, n = %g behind; %g nm\n\n",
                                   options.angle_deg, media.from.real(), media.layers.size(),
                                   media.layers.size() == 1 ? "" : "s", media.to.real(), media.wavelength_nm);
  text += "fraction of the light       s              p    unpolarised\n";
  const auto row = [&](const char* name, double rs, double rp, double mean) {
    text += palpate::text("%-14s %14.9f %14.9f %14.9f\n", name, rs, rp, mean);
  };
  row("reflected", l.s.reflectance, l.p.reflectance, l.mean.reflectance);
  row("passed", l.s.transmittance, l.p.transmittance, l.mean.transmittance);
  row("absorbed", l.s.absorbed(), l.p.absorbed(), l.mean.absorbed());
  if (total) text += "total reflection: nothing passes\n";
  if (!media.layers.empty()) text += "\nlayer     n          k   thickness, mm   angle, deg       absorbed\n";
  bool absorbs = false;
  for (size_t i = 0; i < media.layers.size(); ++i) {
    const optics::OpticalLayer& layer = media.layers[i];
    const double inside = angle_in(layer.index, s), k = -layer.index.imag();
    absorbs = absorbs || k > 0;
    const bool thick = !options.media.thickness_mm.empty();
    text += palpate::text("%5zu %5.4g %10.4g %15s %12s %14.9f\n", i + 1, layer.index.real(), k,
                          thick ? palpate::text("%g", layer.thickness_mm).c_str() : "any",
                          std::isnan(inside) ? "turned back" : palpate::text("%.6f", degrees(inside)).c_str(),
                          l.mean.absorptance[i]);
    layers.push_back(
        {{"index", layer.index.real()},
         {"extinction", k},
         {"thickness_mm", thick ? Json(layer.thickness_mm) : Json(nullptr)},
         {"angle_deg", degrees(inside)},
         {"absorptance", triple(l.s.absorptance[i], l.p.absorptance[i], l.mean.absorptance[i])}});
  }
  const double sum = l.mean.reflectance + l.mean.transmittance + l.mean.absorbed();
  Json value = {{"angle_deg", options.angle_deg},
                {"wavelength_nm", media.wavelength_nm},
                {"from_index", media.from.real()},
                {"to_index", media.to.real()},
                {"to_extinction", -media.to.imag()},
                {"reflectance", triple(l.s.reflectance, l.p.reflectance, l.mean.reflectance)},
                {"transmittance", triple(l.s.transmittance, l.p.transmittance, l.mean.transmittance)},
                {"absorptance", triple(l.s.absorbed(), l.p.absorbed(), l.mean.absorbed())},
                {"balance_error", sum - 1},
                {"total_reflection", total},
                {"layers", layers}};

  if (!common.out.empty()) {
    std::vector<std::vector<double>> sweep(10);
    constexpr int kSteps = 900;
    for (int i = 0; i <= kSteps; ++i) {
      const double theta = std::numbers::pi / 2 * i / kSteps;
      const Fractions at = fractions_at(media, theta);
      const double cells[] = {90.0 * i / kSteps,     at.s.reflectance,   at.p.reflectance,
                              at.mean.reflectance,   at.s.transmittance, at.p.transmittance,
                              at.mean.transmittance, at.s.absorbed(),    at.p.absorbed(),
                              at.mean.absorbed()};
      for (size_t c = 0; c < sweep.size(); ++c) sweep[c].push_back(cells[c]);
    }
    const std::string csv = csv_of(
        "angle_deg,reflectance_s,reflectance_p,reflectance,transmittance_s,transmittance_p,transmittance,"
        "absorptance_s,absorptance_p,absorptance",
        sweep);
    const std::string title =
        palpate::text("At %.4g deg %.3g %% of the light is reflected, %.3g %% passes", options.angle_deg,
                      100 * l.mean.reflectance, 100 * l.mean.transmittance) +
        (absorbs ? palpate::text(", %.3g %% is absorbed", 100 * l.mean.absorbed()) : "");
    text += "\n" + write_results(common, "reflectance", csv, sweep_plot(sweep, absorbs, title));
  }
  return {text, value};
}

}  // namespace

void add_optics_stack(CommandLine& group, Common& common, Command& chosen) {
  CommandLine* command =
      group.add_subcommand("stack", "What layers reflect, transmit and absorb at an angle, by polarisation");
  auto options = std::make_shared<Options>();
  add_media(*command, options->media, true);
  command->get_option("--indices")
      ->description("Refractive indices: where the light comes from, layers, what is behind");
  command
      ->add_option("--extinction", options->media.extinction,
                   "Extinction coefficients k (N = n - ik), one for each index; the first must be 0")
      ->delimiter(',');
  command->add_option("--angle-deg", options->angle_deg, "Angle of incidence from the normal, 0 to 90 deg")
      ->capture_default_str();
  command->add_option("--wavelength-nm", options->wavelength_nm, "Wavelength in vacuum, nm")
      ->capture_default_str();
  command->add_option("--out", common.out, "Folder for reflectance.csv, .png, .svg and .pdf over all angles");
  add_common(
      *command, common,
      "  palpate optics stack --indices 1,1.39,1.40,1.41,1 --angle-deg 30 --json\n"
      "  palpate optics stack --indices 1.41,1.40,1.39,1 --angle-deg 45.2      # from inside\n"
      "  palpate optics stack --indices 1,1.4,1 --extinction 0,2e-6,0 --thickness-mm 6 --out out/pad\n");
  command->runs(chosen, [&common, options] { return stack(common, *options); });
}

}  // namespace palpate
