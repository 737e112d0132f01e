// Files of two fingers: pair.json, which says what was held by what, pairs.csv, one row a pair of frames or a
// frame without a partner, and the log of the gripper's opening.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "capture/pair/known_grip.h"
#include "capture/pair/pair_matcher.h"
#include "engine/grip/geometry.h"
#include "engine/grip/grip_quantities.h"

namespace palpate {

inline constexpr const char* kPairJson = "pair.json";
inline constexpr const char* kPairRows = "pairs.csv";

/// What pair.json says.
struct PairInfo {
  std::array<std::string, 2> inputs;  ///< that were measured
  double period_s = 0;                ///< of the slower finger, as frames were paired
  std::optional<GripFile> grip;
  bool complete = false;  ///< the run came to its end; until then nothing below is known
  SkewStatistics skew;    ///< written only
  std::array<uint64_t, 2> alone{};
};

/// True for a folder with the sessions of two fingers.
bool is_pair_session(const std::filesystem::path& folder);
std::filesystem::path finger_folder(const std::filesystem::path& folder, Side side);

void write_pair_info(const std::filesystem::path& folder, const PairInfo& info);
/// Throws Error(Failure::Input).
PairInfo read_pair_info(const std::filesystem::path& folder);

}  // namespace palpate
