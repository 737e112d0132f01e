// Plot of a match of two point sets.
#pragma once

#include <filesystem>
#include <string>

#include "engine/numeric/matching/matching.h"

namespace palpate {

/// Into `folder`: match.png, .svg and .pdf. Adds ", FILE" of each to `written`, or warns.
void draw_match(const std::filesystem::path& folder, const PointSet& from, const PointSet& to,
                const MatchResult& result, std::string& written);

}  // namespace palpate
