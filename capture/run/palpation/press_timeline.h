// A recorded press over time: the sensor's observations in the window, and the force of the gauge behind the
// plate.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "capture/run/input.h"
#include "capture/run/run_watch.h"
#include "capture/synthetic/tissue.h"
#include "palpate/frame.h"

namespace palpate {

/// One press of a scan as the table of places has it.
struct RecordedPress {
  std::string recording;                    ///< session, video, or synthetic:tissue?...
  std::array<double, 2> place_mm = {0, 0};  ///< of the window's middle from the block's
  std::string gauge;  ///< CSV of the force on the whole block (see capture/files/tables/gauge.h), or "truth"
};

/// The synthetic block that an input, or what a session was recorded from, shows; none for others.
std::optional<TissueOptions> tissue_behind(const MeasuredInput& input);

/// A press, measured frame by frame.
struct PressTimeline {
  MeasuredInput input;
  std::vector<double> time_s, light;  ///< light: the window's mean change of gray
  std::vector<double> force_N;        ///< on the whole block; NaN where the gauge does not say
  std::vector<uint64_t> sequence;
  Frame background;
};

/// Reads the recording once. Clocks of recording and gauge are brought together by the window's light;
/// `notes` hears by how much. `sensor`: empty, the recording's own. `seed`: of synthetic
/// recordings that name none. Throws Error(Failure::Sensor) on a sensor
/// that does not read pressure, Error(Failure::Input) without frames or on a gauge that does not belong to
/// it.
PressTimeline measure_press(uint64_t seed, const RecordedPress& press, const std::filesystem::path& sensor,
                            std::vector<std::string>& notes, const RunWatch& watch);
/// The same of an input that is known already; `press.recording` is its name.
PressTimeline measure_press(const RecordedPress& press, MeasuredInput input, std::vector<std::string>& notes,
                            const RunWatch& watch);

}  // namespace palpate
