// Presses by hand in recordings: each press's loads as pressure maps, and the skin's relief at the highest.
#pragma once

#include <string>
#include <vector>

#include "capture/run/palpation/scan_recording.h"
#include "engine/palpation/hand/press_reader.h"

namespace palpate {

/// Finds the presses in the force over time of each recording (find_presses) and reads them, while they
/// load, at hand_load()'s forces below what nearly all have reached. `gauge`: CSV of the force on the whole
/// block, "truth", or empty: truth of synthetic blocks, else gauge.csv in the recording's folder or beside
/// it. `options.force_N`, where given, is the highest load. A press whose pad slides is read at places along
/// its way, each a press, brought to the scan's loads. `notes` hears what to know of the recordings. Throws
/// Error(Failure::Input) where there is no press, or fewer than two can be read, Error(Failure::Usage) on a
/// highest load that is none, and as check_hand() and read_presses() do; Stopped where a press is being read
/// while `watch` says to stop.
HandRecording read_hand_presses(const std::vector<std::string>& recordings, const std::string& gauge,
                                const RecordedOptions& options, std::vector<std::string>& notes,
                                const RunWatch& watch);

}  // namespace palpate
