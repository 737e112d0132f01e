// palpate optics index: the refractive index of a silicone from laser spots on a wall.
#include <cmath>

#include "capture/files/output_file.h"
#include "engine/base/json.h"
#include "engine/base/text.h"
#include "engine/optics/refractive_index.h"
#include "palpate/error.h"
#include "viz/commands/optics/optics.h"
#include "viz/commands/support/options.h"

namespace palpate {
namespace {

using Json = json::Value;

struct Options {
  std::vector<double> od, on, m1m2, nm2, sd;
  double n_air = 1.000271, n_air_sd = 0;
};

/// The k-th of the four uncertainties of measurement i: one for all, or one each of OD, ON, M1M2, NM2.
double sd_of(const Options& options, size_t k) {
  if (options.sd.empty()) return 0;
  if (options.sd.size() == 1) return options.sd.front();
  return options.sd[k];
}

Report index(const Common& common, const Options& options) {
  const size_t count = options.od.size();
  for (const auto& [name, list] : {std::pair<const char*, const std::vector<double>&>("--on-mm", options.on),
                                   {"--m1m2-mm", options.m1m2},
                                   {"--nm2-mm", options.nm2}})
    if (list.size() != count)
      throw Error(Failure::Usage, std::string("as many ") + name + " as --od-mm",
                  std::to_string(list.size()) + " and " + std::to_string(count), "lists of equal length");
  if (options.sd.size() > 1 && options.sd.size() != 4)
    throw Error(Failure::Usage, "one --sd-mm for all lengths, or four: of OD, ON, M1M2, NM2",
                std::to_string(options.sd.size()), "--sd-mm 0.5");
  std::vector<optics::MeasuredIndex> parts;
  Json rows = Json::array();
  std::string text =
      "   incidence, deg   refraction, deg       n        standard error   from OD    ON      M1M2     NM2\n";
  std::string csv = "od_mm,on_mm,m1m2_mm,nm2_mm,incidence_deg,refraction_deg,index,standard_error\n";
  for (size_t i = 0; i < count; ++i) {
    optics::LaserSpots spots;
    spots.od = {options.od[i], sd_of(options, 0)};
    spots.on = {options.on[i], sd_of(options, 1)};
    spots.m1m2 = {options.m1m2[i], sd_of(options, 2)};
    spots.nm2 = {options.nm2[i], sd_of(options, 3)};
    spots.n_air = options.n_air;
    spots.n_air_sd = options.n_air_sd;
    const optics::MeasuredIndex m = optics::index_from_spots(spots);
    parts.push_back(m);
    text += palpate::text("%17.4f %17.4f %11.6f %17.6f   %8.2g %8.2g %8.2g %8.2g\n", degrees(m.incidence_rad),
                          degrees(m.refraction_rad), m.index, m.standard_error, m.sd_od, m.sd_on, m.sd_m1m2,
                          m.sd_nm2);
    csv += palpate::text("%.9g,%.9g,%.9g,%.9g,%.9g,%.9g,%.9g,%.9g\n", spots.od.mm, spots.on.mm, spots.m1m2.mm,
                         spots.nm2.mm, degrees(m.incidence_rad), degrees(m.refraction_rad), m.index,
                         m.standard_error);
    rows.push_back(
        {{"incidence_deg", degrees(m.incidence_rad)},
         {"refraction_deg", degrees(m.refraction_rad)},
         {"index", m.index},
         {"standard_error", options.sd.empty() ? Json(nullptr) : Json(m.standard_error)},
         {"parts",
          {{"od", m.sd_od}, {"on", m.sd_on}, {"m1m2", m.sd_m1m2}, {"nm2", m.sd_nm2}, {"air", m.sd_air}}}});
  }
  const optics::CombinedIndex c = optics::combine(parts);
  const bool known = !options.sd.empty() || options.n_air_sd > 0, has_error = known || count > 1;
  if (has_error)
    text += palpate::text("\nn = %.6f +- %.6f (standard error)\n", c.index, c.standard_error);
  else
    text += palpate::text("\nn = %.6f; its uncertainty is not known: give that of the lengths as --sd-mm\n",
                          c.index);
  if (count > 1 && known)
    text += palpate::text(
        "chi^2 %.3g of %zu measurements%s\n", c.chi_square, count,
        c.widened ? ": they scatter more than their lengths' uncertainties say; the error is widened by "
                    "that"
                  : "");
  if (!known && count > 1) text += "the error is from the scatter alone\n";
  const Json value = {{"index", c.index},
                      {"standard_error", has_error ? Json(c.standard_error) : Json(nullptr)},
                      {"chi_square", known && count > 1 ? Json(c.chi_square) : Json(nullptr)},
                      {"widened", c.widened},
                      {"measurements", rows}};
  if (!common.out.empty()) {
    make_output_folder(common.out);
    const std::string file = (common.out / "index.csv").string();
    write_whole(file, std::string_view(csv));
    text += "written: " + file + "\n";
  }
  return {text, value};
}

}  // namespace

void add_optics_index(CommandLine& group, Common& common, Command& chosen) {
  CommandLine* command =
      group.add_subcommand("index", "Refractive index of a silicone from laser spots on a wall");
  auto options = std::make_shared<Options>();
  const auto list = [&](const char* name, std::vector<double>& values, const char* what) {
    command->add_option(name, values, what)->delimiter(',')->required();
  };
  list("--od-mm", options->od,
       "OD, mm: the tangent of the angle of incidence is OD / ON; a list for repeated measurements");
  list("--on-mm", options->on, "ON, mm");
  list("--m1m2-mm", options->m1m2,
       "Between the spots of the silicone's surface (M2) and of the glass (M1), mm");
  list("--nm2-mm", options->nm2, "From the bare glass's spot (N) to the silicone surface's (M2), mm");
  command
      ->add_option("--sd-mm", options->sd,
                   "Standard uncertainty of the lengths, mm: one, or of OD, ON, M1M2, NM2")
      ->delimiter(',');
  command->add_option("--air-index", options->n_air, "Index of the air")->capture_default_str();
  command->add_option("--air-index-sd", options->n_air_sd, "Its standard uncertainty");
  command->add_option("--out", common.out, "Folder for index.csv");
  add_common(*command, common,
             "  palpate optics index --od-mm 800 --on-mm 600 --m1m2-mm 10.3 --nm2-mm 20 --sd-mm 0.1\n"
             "  palpate optics index --od-mm 800,500 --on-mm 600,600 --m1m2-mm 10.3,12.3 --nm2-mm 20,20 \\\n"
             "      --sd-mm 0.5,0.5,0.1,0.1\n");
  command->runs(chosen, [&common, options] { return index(common, *options); });
}

}  // namespace palpate
