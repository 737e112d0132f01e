#include "capture/files/match_files.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <map>

#include "capture/files/csv_line.h"
#include "capture/files/output_file.h"
#include "engine/base/json.h"
#include "engine/base/text.h"
#include "palpate/error.h"

namespace palpate {
namespace {

namespace fs = std::filesystem;
using Json = json::Value;

constexpr uintmax_t kLargestFile_B = 64u << 20;
constexpr size_t kMostPoints = 20000;

struct Rows {
  std::vector<std::string> header;
  std::vector<std::pair<size_t, std::vector<std::string>>> rows;  // line number, cells
};

Rows read_rows(const fs::path& file, const std::string& wanted) {
  std::error_code error;
  const bool plain = fs::is_regular_file(file, error);
  std::ifstream in(file, std::ios::binary);
  if (!plain || !in)
    throw Error(Failure::Input, wanted, "no readable file '" + file.string() + "'", "another name");
  if (fs::file_size(file, error) > kLargestFile_B)
    throw Error(Failure::Input, wanted, "'" + file.string() + "' of more than 64 MiB", "fewer points");
  Rows table;
  std::string line;
  for (size_t number = 1; std::getline(in, line); ++number) {
    if (number == 1 && line.rfind("\xef\xbb\xbf", 0) == 0) line.erase(0, 3);
    if (trimmed(line).empty()) continue;
    std::vector<std::string> cells = csv_cells(line);
    if (table.header.empty()) {
      table.header = std::move(cells);
      continue;
    }
    if (cells.size() != table.header.size())
      throw Error(Failure::Input,
                  std::to_string(table.header.size()) + " cells in line " + std::to_string(number) + " of '" +
                      file.string() + "'",
                  std::to_string(cells.size()), "a row like the first line");
    table.rows.emplace_back(number, std::move(cells));
  }
  if (table.header.empty())
    throw Error(Failure::Input, wanted, "'" + file.string() + "', which is empty", "a table with a header");
  return table;
}

// Where a column stands; npos: nowhere.
size_t column_of(const Rows& table, const std::string& name, const fs::path& file) {
  const auto count = std::count(table.header.begin(), table.header.end(), name);
  if (count > 1)
    throw Error(Failure::Input, "one column '" + name + "' in '" + file.string() + "'", std::to_string(count),
                "one header");
  return count == 0 ? std::string::npos
                    : static_cast<size_t>(std::find(table.header.begin(), table.header.end(), name) -
                                          table.header.begin());
}

std::string short_text(const std::string& text) {
  return text.size() > 40 ? text.substr(0, 40) + "..." : text;
}

std::string number(double value) {
  const std::string line = palpate::text("%.12g", value);
  return line;
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
  const std::string name = "'" + file.string() + "'";
  const Rows table = read_rows(file, "a table of points, columns x,y or x,y,z");
  std::vector<size_t> columns;
  for (const char* axis : {"x", "y", "z"}) {
    const size_t at = column_of(table, axis, file);
    if (at != std::string::npos)
      columns.push_back(at);
    else if (*axis != 'z')
      throw Error(Failure::Input, std::string("a column '") + axis + "' in " + name, "none",
                  "a first line x,y or x,y,z");
  }
  PointSet set;
  set.axes = static_cast<uint32_t>(columns.size());
  for (const auto& [number, cells] : table.rows)
    for (const size_t column : columns) {
      const std::string& cell = cells[column];
      double value = 0;
      const auto [end, error] = std::from_chars(cell.data(), cell.data() + cell.size(), value);
      if (error != std::errc() || end != cell.data() + cell.size() || !std::isfinite(value))
        throw Error(Failure::Input,
                    "a finite number in line " + std::to_string(number) + " of " + name + ", column " +
                        table.header[column],
                    cell.empty() ? "an empty cell" : "'" + short_text(cell) + "'", "leaving that point out");
      set.coordinates.push_back(value);
    }
  if (set.size() < set.axes + 1 || set.size() > kMostPoints)
    throw Error(Failure::Input,
                std::to_string(set.axes + 1) + " to " + std::to_string(kMostPoints) + " points in " + name,
                std::to_string(set.size()), set.size() > kMostPoints ? "a thinned set" : "more points");
  return set;
}

std::vector<MatchFiles> read_pairs(const fs::path& list) {
  const Rows table = read_rows(list, "a list of pairs, columns template,target");
  const size_t from = column_of(table, "template", list), to = column_of(table, "target", list);
  if (from == std::string::npos || to == std::string::npos)
    throw Error(Failure::Input, "columns 'template' and 'target' in '" + list.string() + "'",
                "'" + short_text(table.header.front()) + "' ...", "a first line template,target");
  std::vector<MatchFiles> pairs;
  for (const auto& [number, cells] : table.rows)
    pairs.push_back({list.parent_path() / cells[from], list.parent_path() / cells[to]});
  if (pairs.empty())
    throw Error(Failure::Input, "pairs in '" + list.string() + "'", "none", "a line for each pair");
  return pairs;
}

Json to_json(const MatchFiles& files, const PointSet& from, const PointSet& to, const MatchResult& result) {
  Json attempts = Json::array();
  for (const MatchAttempt& a : result.attempts)
    attempts.push_back({{"start", to_string(a.start)},
                        {"turn_deg", a.turn_deg},
                        {"energy_nats", a.energy},
                        {"bending_nats", a.bending},
                        {"noise_sd_of_scale", a.noise_sd},
                        {"iterations", a.iterations},
                        {"converged", a.converged}});
  return {{"template", files.from.string()},
          {"target", files.to.string()},
          {"template_points", from.size()},
          {"target_points", to.size()},
          {"axes", from.axes},
          {"reliable", result.reliable()},
          {"verdict", to_string(result.verdict)},
          {"pairs", pairs_of(result)},
          {"noise_sd", result.noise_sd},
          {"noise_is_upper_bound", result.noise_below},
          {"target_outlier_share", result.target_outlier_fraction},
          {"template_nil_share", result.template_nil_fraction},
          {"evidence_nats_per_point", result.log_likelihood_gain},
          {"scale", result.scale},
          {"iterations", result.iterations},
          {"converged", result.converged},
          {"winner", result.winner},
          {"attempts", attempts}};
}

std::string to_text(const MatchFiles& files, const PointSet& from, const PointSet& to,
                    const MatchResult& result) {
  const std::string line = text(
      "  %zu template points, %zu target points, %zu pairs\n"
      "  noise %s%.4g (standard deviation per axis, target units; template's RMS radius %.4g)\n"
      "  without a partner: %.1f %% of the template, %.1f %% of the target\n"
      "  evidence %.3g nats a target point; %s start of %zu, %u iterations, %s\n",
      from.size(), to.size(), pairs_of(result), result.noise_below ? "below " : "", result.noise_sd,
      result.scale, 100 * result.template_nil_fraction, 100 * result.target_outlier_fraction,
      result.log_likelihood_gain, std::string(to_string(result.attempts[result.winner].start)).c_str(),
      result.attempts.size(), result.iterations, result.converged ? "converged" : "not converged");
  return files.from.string() + " on " + files.to.string() + ": " + std::string(to_string(result.verdict)) +
         "\n" + line;
}

std::string write_match(const fs::path& folder, const MatchFiles& files, const PointSet& from,
                        const PointSet& to, const MatchResult& result) {
  make_output_folder(folder);
  const fs::path good = folder / "warped.csv", bad = folder / "unreliable_warped.csv";
  const fs::path& warped = result.reliable() ? good : bad;
  std::error_code ignored;
  fs::remove(result.reliable() ? bad : good, ignored);
  write_whole(warped, points_csv(result.warped));
  write_whole(folder / "partners.csv", partners_csv(result));
  write_whole(folder / "match.json", to_json(files, from, to, result).dump(2) + "\n");
  return warped.string() + ", " + (folder / "partners.csv").string() + ", " +
         (folder / "match.json").string();
}

}  // namespace palpate
