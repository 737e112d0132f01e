// A lump from day to day: observations in folders, each estimated and compared with the first.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "engine/base/json.h"
#include "engine/lump/change/change.h"

namespace palpate {

/// A day as it was given, and its change from the first.
struct ComparedDay {
  std::string name;
  lump::Day day;
  lump::LumpChange change;  ///< of the first day: not set
};

/// Folders of `write_observation`, the first day first. Where days found their tissue by the way of the
/// plate, all are told one tissue. `network`: a file, or empty for the built-in one. Throws
/// Error(Failure::Usage) for fewer than two, Error(Failure::Input) for what is no observation.
std::vector<ComparedDay> compare_days(const std::vector<std::filesystem::path>& folders,
                                      lump::ErrorSources errors, const std::filesystem::path& network);

/// A change has intervals.
bool has_numbers(const lump::LumpChange& change);

/// An object with an array of days, each with its estimate and all but the first with its change.
json::Value days_json(const std::vector<ComparedDay>& days);

}  // namespace palpate
