// Files of point matching: point sets read from tables, and the results of a match.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "engine/base/facts.h"
#include "engine/numeric/matching/matching.h"

namespace palpate {

/// A CSV table with columns x,y or x,y,z among others, in any order, names in the first line. Throws
/// Error(Failure::Input) that names file and line: a column missing or named twice, a cell that is not a
/// finite number, a row of another length, fewer points than an affine map needs.
PointSet read_points(const std::filesystem::path& file);

struct MatchFiles {
  std::filesystem::path from, to;
};
/// Pairs of tables: columns `template` and `target`; names count from the list's own folder. Throws
/// Error(Failure::Input).
std::vector<MatchFiles> read_pairs(const std::filesystem::path& list);

/// Report of one pair.
Facts facts_of(const MatchFiles& files, const PointSet& from, const PointSet& to, const MatchResult& result);

/// Into `folder`: warped.csv (the template on the target, in the template's order; named
/// unreliable_warped.csv without a reliable match), partners.csv (template, target, probability; rows from 0,
/// target empty for nil), match.json (`report`). A file that an earlier run left under the other name is
/// removed. Returns the files' names as text. Throws Error(Failure::Output).
std::string write_match(const std::filesystem::path& folder, const MatchResult& result,
                        const json::Value& report);

}  // namespace palpate
