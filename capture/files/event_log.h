// events.csv: marks set by the user, zeros taken in the window, and results of presses, beside the
// measurements.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace palpate::viz {

struct Event {
  uint64_t frame = 0;
  double time_s = 0;
  std::string kind;  ///< "mark", "zero", "zero ended" or "lump"
  /// For a mark, what was typed, else its number; for a zero, what was subtracted from then on; for a lump,
  /// result of a press.
  std::string text;
};

/// Label of the event in a chart: a mark's text, else its kind.
std::string label_of(const Event& event);

/// Appends a row to `folder`/events.csv, with a header (frame, time_s, event, text) where the file is new;
/// makes the folder. Throws Error(Failure::Output).
void append_event(const std::filesystem::path& folder, const Event& event);

/// Events of such a file, in its order; none where there is no such file. Lines that are no events are left
/// out: users may edit the file.
std::vector<Event> read_events(const std::filesystem::path& folder);

}  // namespace palpate::viz
