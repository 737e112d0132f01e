// The clock of both fingers' rows, for logs beside them.
#pragma once

#include <filesystem>
#include <optional>

#include "capture/log/log_clock.h"
#include "capture/pair/pair_matcher.h"

namespace palpate {

/// What is added to the times of a finger's session for those of `rows`, a pairs.csv, s; none: no row has a
/// frame of it. Throws Error(Failure::Input).
std::optional<double> pair_offset_s(const std::filesystem::path& session, const std::filesystem::path& rows,
                                    Side side);

/// The frames of the left session in `folder`, or of the right one where it has none, at the times of `rows`.
/// Throws Error(Failure::Input).
FrameClock pair_clock(const std::filesystem::path& folder, const std::filesystem::path& rows);

}  // namespace palpate
