#include "capture/files/match_files.h"

#include <algorithm>
#include <cmath>

#include "capture/files/output_file.h"
#include "capture/files/tables/csv_table.h"
#include "engine/base/json.h"
#include "engine/base/text.h"
#include "palpate/error.h"

namespace palpate {
namespace {

namespace fs = std::filesystem;
using Json = json::Value;

constexpr size_t kMostPoints = 20000;

std::string number(double value) {
  const std::string line = palpate::text("%.12g", value);
  return line;
}

/// Columns x, y and, where there is one, z: bare, or all with the same unit, whatever it is.
std::vector<size_t> axes_of(const CsvTable& table) {
  const auto find = [&table](const std::string& axis, const std::string* unit) -> std::optional<size_t> {
    for (size_t i = 0; i < table.columns().size(); ++i) {
      const ColumnHeader header = column_header(table.columns()[i]);
      if (header.name == axis && (!unit || header.unit == *unit)) return i;
    }
    return std::nullopt;
  };
  std::vector<size_t> columns;
  const std::optional<size_t> bare = table.find("x"), x = bare ? bare : find("x", nullptr);
  if (!x) table.require({"x", "y"});  // says what is missing
  const std::string unit = column_header(table.columns()[*x]).unit;
  columns.push_back(*x);
  if (const auto y = find("y", &unit)) columns.push_back(*y);
  if (columns.size() < 2 && find("y", nullptr))
    throw Error(Failure::Input, "one unit for x and y in the first line of " + table.file().string(),
                printable(table.header_line()), "x_mm,y_mm or x,y");
  if (columns.size() < 2) table.require({unit.empty() ? "y" : "y_" + unit});
  if (const auto z = find("z", &unit)) columns.push_back(*z);
  return columns;
}

std::string points_csv(const PointSet& set) {
  std::string text = set.axes == 2 ? "x,y\n" : "x,y,z\n";
  for (size_t i = 0; i < set.size(); ++i)
    for (uint32_t c = 0; c < set.axes; ++c) text += number(set.at(i)[c]) + (c + 1 < set.axes ? "," : "\n");
  return text;
}

std::string partners_csv(const MatchResult& result) {
  std::string text = "template,target,probability\n";
  std::string row;
  for (size_t i = 0; i < result.partners.size(); ++i) {
    const Partner& partner = result.partners[i];
    const std::string target = partner.target ? std::to_string(*partner.target) : "";
    row = palpate::text("%zu,%s,", i, target.c_str());
    text += row;
    if (std::isfinite(partner.probability)) {
      row = palpate::text("%.4g", partner.probability);
      text += row;
    }
    text += "\n";
  }
  return text;
}

size_t pairs_of(const MatchResult& result) {
  return static_cast<size_t>(std::count_if(result.partners.begin(), result.partners.end(),
                                           [](const Partner& p) { return p.target.has_value(); }));
}

}  // namespace

PointSet read_points(const fs::path& file) {
  CsvTable table(file, "a table of points, columns x,y or x,y,z");
  const std::vector<size_t> columns = axes_of(table);
  PointSet set;
  set.axes = static_cast<uint32_t>(columns.size());
  while (set.size() <= kMostPoints && table.next())
    for (const size_t column : columns)
      set.coordinates.push_back(table.number(column, "leaving that point out"));
  const bool many = set.size() > kMostPoints;
  if (set.size() < set.axes + 1 || many)
    throw Error(
        Failure::Input,
        std::to_string(set.axes + 1) + " to " + std::to_string(kMostPoints) + " points in " + file.string(),
        many ? "more" : std::to_string(set.size()), many ? "a thinned set" : "more points");
  return set;
}

std::vector<MatchFiles> read_pairs(const fs::path& list) {
  CsvTable table(list, "a list of pairs, columns template,target");
  const std::vector<size_t> columns = table.require({"template", "target"});
  std::vector<MatchFiles> pairs;
  while (table.next())
    pairs.push_back(
        {list.parent_path() / table.cell(columns[0]), list.parent_path() / table.cell(columns[1])});
  if (pairs.empty()) throw Error(Failure::Input, "pairs in " + list.string(), "none", "a line for each pair");
  return pairs;
}

Facts facts_of(const MatchFiles& files, const PointSet& from, const PointSet& to, const MatchResult& result) {
  Facts facts;
  facts.say(files.from.string() + " on " + files.to.string() + ": " + std::string(to_string(result.verdict)) +
            "\n");
  facts.add("template", files.from.string());
  facts.add("target", files.to.string());
  facts.add("template_points", from.size());
  facts.add("target_points", to.size());
  facts.add("axes", from.axes);
  facts.add("reliable", result.reliable());
  facts.add("verdict", to_string(result.verdict));
  facts.add("pairs", pairs_of(result),
            text("  %zu template points, %zu target points, %zu pairs\n", from.size(), to.size(),
                 pairs_of(result)));
  facts.add("noise_sd", result.noise_sd,
            text("  noise %s%.4g (standard deviation per axis, target units; template's RMS radius %.4g)\n",
                 result.noise_below ? "below " : "", result.noise_sd, result.scale));
  facts.add("noise_is_upper_bound", result.noise_below);
  facts.add("target_outlier_share", result.target_outlier_fraction,
            text("  without a partner: %.1f %% of the template, %.1f %% of the target\n",
                 100 * result.template_nil_fraction, 100 * result.target_outlier_fraction));
  facts.add("template_nil_share", result.template_nil_fraction);
  facts.add("evidence_nats_per_point", result.log_likelihood_gain,
            text("  evidence %.3g nats a target point, posterior %.4g against other warps; %s start of %zu, "
                 "%u iterations, %s\n",
                 result.log_likelihood_gain, result.posterior,
                 std::string(to_string(result.attempts[result.winner].start)).c_str(), result.attempts.size(),
                 result.iterations, result.converged ? "converged" : "not converged"));
  facts.add("evidence_nats", result.evidence);
  facts.add("held_out_nats_per_point", result.held_out_gain);
  facts.add("posterior", result.posterior);
  facts.add("scale", result.scale);
  facts.add("iterations", result.iterations);
  facts.add("converged", result.converged);
  facts.add("winner", result.winner);
  Json attempts = Json::array();
  for (const MatchAttempt& a : result.attempts)
    attempts.push_back({{"start", to_string(a.start)},
                        {"turn_deg", a.turn_deg},
                        {"energy_nats", a.energy},
                        {"bending_nats", a.bending},
                        {"noise_sd_of_scale", a.noise_sd},
                        {"iterations", a.iterations},
                        {"converged", a.converged}});
  facts.add("attempts", attempts);
  return facts;
}

std::string write_match(const fs::path& folder, const MatchResult& result, const Json& report) {
  make_output_folder(folder);
  const fs::path good = folder / "warped.csv", bad = folder / "unreliable_warped.csv";
  const fs::path& warped = result.reliable() ? good : bad;
  std::error_code ignored;
  fs::remove(result.reliable() ? bad : good, ignored);
  write_whole(warped, points_csv(result.warped));
  write_whole(folder / "partners.csv", partners_csv(result));
  write_whole(folder / "match.json", report.dump(2) + "\n");
  return warped.string() + ", " + (folder / "partners.csv").string() + ", " +
         (folder / "match.json").string();
}

}  // namespace palpate
