// palpate optics contact: the light that different objects couple out of the pad, and their brightness.
#include <cmath>
#include <limits>

#include "capture/files/output_file.h"
#include "engine/base/json.h"
#include "engine/base/text.h"
#include "palpate/error.h"
#include "viz/commands/optics/optics.h"
#include "viz/commands/support/options.h"

namespace palpate {
namespace {

using Json = json::Value;

struct Options {
  MediaOptions media;
  LampOptions lamp;
  std::vector<double> contacts, extinction, albedo, gap_nm;
  double wavelength_nm = 630;
  double reference_index = 1.4, reference_extinction = 0, reference_albedo = 1;
  std::optional<double> reference_gray;
  double most_gray = 255;
};

/// One value for each contact: given for each, for all, or not at all.
std::vector<double> for_each(const std::vector<double>& given, size_t count, double otherwise,
                             const char* option) {
  if (given.empty()) return std::vector<double>(count, otherwise);
  if (given.size() == 1) return std::vector<double>(count, given.front());
  if (given.size() != count)
    throw Error(Failure::Usage, std::string("one ") + option + " for each of --contact, or one for all",
                std::to_string(count) + " contacts and " + std::to_string(given.size()) + " values",
                "lists of equal length");
  return given;
}

std::string name_of(const optics::FaceContact& c) {
  std::string name = palpate::text("n = %g", c.index.real());
  if (c.index.imag() != 0) name += palpate::text(" - %gi", -c.index.imag());
  if (c.gap_nm > 0) name += palpate::text(", gap %g nm", c.gap_nm);
  return name;
}

constexpr const char* kAssumptions[] = {
    "light is unpolarised, and lies along the guide as the LED's cone and the layers make it: none is "
    "scattered, absorbed or sent back by the far edge",
    "a contact takes what passes the interface at each meeting, and is so small that it meets undiminished "
    "light (compare its size with the way between meetings)",
    "of the light that enters an object the fraction `albedo` comes back diffusely; the camera sees the same "
    "part "
    "of it for every object",
    "gray is in proportion to light, and the reference was taken at the same place, LED current and "
    "exposure"};

/// The guide and its lamp, what touches it and what that is compared with.
struct Problem {
  optics::Waveguide guide;
  optics::EdgeLamp lamp;
  optics::LampFractions fractions;
  std::vector<optics::FaceContact> contacts;
  std::vector<double> albedo;
  optics::GrayReference reference;
  bool calibrated = false;            ///< gray levels, not only relative brightness
  double top = 0;                     ///< index of the touched layer
  double from_deg = 0, most_deg = 0;  ///< guided light meets the face at these
};

Problem problem_of(const Options& options) {
  Problem p;
  p.guide = guide_of(options.media, true);
  p.lamp = lamp_of(options.lamp, p.guide);
  const size_t count = options.contacts.size();
  const std::vector<double> extinction = for_each(options.extinction, count, 0, "--contact-extinction");
  p.albedo = for_each(options.albedo, count, 1, "--albedo");
  const std::vector<double> gap_nm = for_each(options.gap_nm, count, 0, "--gap-nm");
  for (size_t i = 0; i < count; ++i)
    p.contacts.push_back(
        {optics::optical_index(options.contacts[i], extinction[i]), gap_nm[i], options.wavelength_nm});
  p.fractions = optics::lamp_fractions(p.guide, p.lamp);
  if (!(p.fractions.touching > 0))
    throw Error(Failure::Input, "a waveguide whose light meets the touched face", "none that does",
                "an outside of lower index, or --led-layer 1");
  p.reference.light = optics::contact_light(
      p.guide, p.lamp, {optics::optical_index(options.reference_index, options.reference_extinction)});
  p.reference.albedo = options.reference_albedo;
  p.calibrated = options.reference_gray.has_value();
  p.reference.gray = p.calibrated ? *options.reference_gray : 1;
  p.reference.most_gray = p.calibrated ? options.most_gray : std::numeric_limits<double>::max();
  p.top = p.guide.layers.front().index;
  const optics::LayerGuidance band = optics::guidance(p.guide, p.lamp.edge_index)[p.lamp.layer];
  p.from_deg = degrees(std::asin(std::min(1.0, band.touching_from / p.top)));
  p.most_deg = degrees(std::asin(std::min(1.0, band.touching_to / p.top)));
  return p;
}

std::string heading(const Problem& p, const Options& options) {
  return palpate::text(
      "%.4f of the LED's light is guided and meets the face: %.3g of it per mm of the guide's length\n"
      "reference: n = %g, albedo %g%s\n\n"
      "contact                     albedo   leaves up to, deg   leaves per meeting   per mm    relative%s\n",
      p.fractions.touching, p.fractions.arriving_per_mm, options.reference_index, options.reference_albedo,
      p.calibrated ? palpate::text(", gray %g of at most %g", p.reference.gray, p.reference.most_gray).c_str()
                   : "",
      p.calibrated ? "       gray" : "");
}

/// Adds one contact's line to `text`; gives its values.
Json add_row(const Problem& p, size_t i, std::string& text) {
  const optics::FaceContact& contact = p.contacts[i];
  const optics::ContactLight light = optics::contact_light(p.guide, p.lamp, contact);
  const optics::PredictedGray gray = optics::predict_gray(p.reference, light, p.albedo[i]);
  const double relative = gray.unlimited / p.reference.gray;
  const double to_deg = degrees(std::asin(std::min(1.0, light.reached_to / p.top)));
  const bool leaves = light.leaving_per_mm > 0;
  text += palpate::text("%-26s %7.3g %19s %20.6f %8.2e %11.6f", name_of(contact).c_str(), p.albedo[i],
                        leaves ? palpate::text("%.3f", to_deg).c_str() : "nothing leaves", light.per_meeting,
                        light.leaving_per_mm, relative);
  if (p.calibrated) text += palpate::text("   %8.2f%s", gray.gray, gray.saturated ? " saturated" : "");
  text += "\n";
  Json row = {{"index", contact.index.real()},
              {"extinction", -contact.index.imag()},
              {"gap_nm", contact.gap_nm},
              {"albedo", p.albedo[i]},
              {"leaving_per_meeting", light.per_meeting},
              {"leaving_per_mm", light.leaving_per_mm},
              {"leaves_up_to_deg", leaves ? Json(to_deg) : Json(nullptr)},
              {"relative", relative}};
  if (p.calibrated) {
    row["gray"] = gray.gray;
    row["gray_without_saturation"] = gray.unlimited;
    row["saturated"] = gray.saturated;
  }
  return row;
}

Json add_assumptions(std::string& text) {
  Json assumed = Json::array();
  for (const char* assumption : kAssumptions) {
    text += std::string("- ") + assumption + "\n";
    assumed.push_back(assumption);
  }
  return assumed;
}

/// Transmission at each angle: a column of angles, one for each contact.
std::vector<std::vector<double>> angle_columns(const Problem& p) {
  std::vector<std::vector<double>> angles(1 + p.contacts.size());
  constexpr int kSteps = 400;
  for (int i = 0; i <= kSteps; ++i) {
    const double deg = p.from_deg + (90 - p.from_deg) * i / kSteps, s = p.top * std::sin(radians(deg));
    angles[0].push_back(deg);
    for (size_t c = 0; c < p.contacts.size(); ++c)
      angles[1 + c].push_back(i == kSteps ? 0 : optics::contact_transmittance(p.guide, p.contacts[c], s));
  }
  return angles;
}

/// Brightness against the contact's index: index, fraction that leaves, brightness.
std::vector<std::vector<double>> index_columns(const Problem& p) {
  std::vector<std::vector<double>> indices(3);
  constexpr int kSteps = 100;
  for (int i = 0; i <= kSteps; ++i) {
    const double n = 1 + 1.5 * i / static_cast<double>(kSteps);
    const optics::ContactLight light = optics::contact_light(p.guide, p.lamp, {optics::optical_index(n)});
    indices[0].push_back(n);
    indices[1].push_back(light.per_meeting);
    indices[2].push_back(optics::predict_gray(p.reference, light, 1).unlimited / p.reference.gray);
  }
  return indices;
}

std::string angle_header(const std::vector<optics::FaceContact>& contacts) {
  std::string header = "angle_deg";
  for (const optics::FaceContact& c : contacts) {
    std::string name = palpate::text(",transmittance_n%g", c.index.real());
    if (c.index.imag() != 0) name += palpate::text("_k%g", -c.index.imag());
    if (c.gap_nm > 0) name += palpate::text("_gap%gnm", c.gap_nm);
    header += name;
  }
  return header;
}

/// The index that shines most, in one sentence.
std::string brightest_words(const Problem& p, const std::vector<std::vector<double>>& indices) {
  const auto best = std::max_element(indices[2].begin(), indices[2].end());
  if (best == indices[2].end() || !(*best > 0)) return "No contact shines: no guided light leaves.";
  const double index = indices[0][static_cast<size_t>(best - indices[2].begin())];
  return palpate::text(
      "A contact of n = %.3g shines most, %.3g times the reference, by light from %.3g deg on", index, *best,
      p.from_deg);
}

/// Left: what passes at each angle; right: brightness against the contact's index.
Plot plot_of(const Problem& p, const std::vector<std::vector<double>>& angles,
             const std::vector<std::vector<double>>& indices) {
  PlotPanel leaves{"", "angle in the touched layer, deg (dashed: no light reaches the face beyond)",
                   "fraction that leaves at one meeting"};
  leaves.x_range = {{p.from_deg, 90}};
  leaves.y_range = {{0, 1.02}};
  leaves.key = "bottom left";
  for (size_t c = 0; c < p.contacts.size(); ++c)
    leaves.add(name_of(p.contacts[c]), angles[0], angles[c + 1], c);
  leaves.add_line("", {p.most_deg, 0}, {p.most_deg, 1.02});
  PlotPanel brightness{"", "index of the contact", "brightness, relative to the reference (albedo 1)"};
  brightness.x_range = {{1, 2.5}};
  brightness.y_range = {{0, kPlotAuto}};
  brightness.add("", indices[0], indices[2]);
  return {brightest_words(p, indices), {leaves, brightness}, 2, 1200, 520};
}

/// Writes tables and plots; says which.
std::string write_files(const Common& common, const Problem& p) {
  const std::vector<std::vector<double>> angles = angle_columns(p), indices = index_columns(p);
  const std::string written = write_results(common, "contact_light", csv_of(angle_header(p.contacts), angles),
                                            plot_of(p, angles, indices));
  const std::string file = (common.out / "contact_light_index.csv").string();
  write_whole(file, std::string_view(csv_of("index,leaving_per_meeting,relative", indices)));
  return written + ", " + file;
}

Report contact(const Common& common, const Options& options) {
  const Problem p = problem_of(options);
  std::string text = heading(p, options);
  Json rows = Json::array();
  for (size_t i = 0; i < p.contacts.size(); ++i) rows.push_back(add_row(p, i, text));
  text += palpate::text(
      "\nangles are from the normal in the touched layer; guided light meets the face from %.3f to %.3f "
      "deg\nassumed:\n",
      p.from_deg, p.most_deg);
  const Json assumed = add_assumptions(text);
  Json value = {{"led", to_json(p.lamp)},
                {"touching", p.fractions.touching},
                {"arriving_per_mm", p.fractions.arriving_per_mm},
                {"touching_deg", {p.from_deg, p.most_deg}},
                {"reference",
                 {{"index", options.reference_index},
                  {"albedo", options.reference_albedo},
                  {"gray", p.calibrated ? Json(p.reference.gray) : Json(nullptr)},
                  {"leaving_per_meeting", p.reference.light.per_meeting}}},
                {"contacts", rows},
                {"assumed", assumed}};
  if (!common.out.empty()) text += "\n" + write_files(common, p);
  return {text, value};
}

}  // namespace

void add_optics_contact(CommandLine& group, Common& common, Command& chosen) {
  CommandLine* command = group.add_subcommand(
      "contact", "How much light contacts let out, and how bright they look to the camera");
  auto options = std::make_shared<Options>();
  add_media(*command, options->media, true);
  add_lamp(*command, options->lamp);
  command
      ->add_option("--contact", options->contacts, "Indices of what touches (water 1.33, skin 1.38 to 1.45)")
      ->delimiter(',')
      ->required();
  command
      ->add_option("--contact-extinction", options->extinction,
                   "Their extinction coefficients k (metals, ink), each or one for all")
      ->delimiter(',');
  command
      ->add_option("--albedo", options->albedo,
                   "Albedo: fraction of the light they send back, 0 to 1, each or one for all")
      ->delimiter(',');
  command
      ->add_option("--gap-nm", options->gap_nm,
                   "Gap of the outside medium left below them, nm, each or one for all")
      ->delimiter(',');
  command->add_option("--wavelength-nm", options->wavelength_nm, "Wavelength, nm; matters with a gap")
      ->capture_default_str();
  command->add_option("--reference-index", options->reference_index, "Index of the reference contact")
      ->capture_default_str();
  command->add_option("--reference-extinction", options->reference_extinction, "Its extinction coefficient");
  command->add_option("--reference-albedo", options->reference_albedo, "Its albedo")->capture_default_str();
  command->add_option("--reference-gray", options->reference_gray,
                      "Its change of gray at the exposure in question; without it, brightness is relative");
  command->add_option("--most-gray", options->most_gray, "Largest change of gray the camera can show")
      ->capture_default_str();
  command->add_option("--out", common.out, "Folder for contact_light.csv, .png, .svg and .pdf");
  add_common(
      *command, common,
      "  palpate optics contact --indices 1,1.39,1.40,1.41,1 --thickness-mm 2 --contact 1.33,1.4,1.5\n"
      "  palpate optics contact --indices 1,1.41,1 --thickness-mm 6 --contact 1.33,1.4 --albedo 0.3,0.6 "
      "\\\n      --reference-index 1.4 --reference-albedo 0.8 --reference-gray 120 --json\n"
      "  palpate optics contact --indices 1,1.41,1 --thickness-mm 6 --contact 1.4 --gap-nm 100\n");
  command->runs(chosen, [&common, options] { return contact(common, *options); });
}

}  // namespace palpate
