// grip.json: where the pads are in the gripper, and how far it is open.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "engine/base/json.h"
#include "engine/grip/grip.h"

namespace palpate {

/// Where the opening comes from.
struct OpeningSource {
  std::optional<double> fixed_mm;  ///< the same all the time
  std::filesystem::path log;       ///< CSV with the columns time_s and `column`; empty: none
  std::string column = "opening_mm";
  double sd_mm = 0;  ///< standard error
};

struct GripFile {
  GripGeometry geometry;
  OpeningSource opening;
};

/// Reads the text of a grip.json; `where` names it in messages, and a log is looked for beside it. Rotations
/// must be proper, and the pads must face each other. Throws Error(Failure::Input).
GripFile grip_from_text(const std::string& text, const std::filesystem::path& where);
GripFile load_grip(const std::filesystem::path& file);
json::Value to_json(const GripFile& grip);

}  // namespace palpate
