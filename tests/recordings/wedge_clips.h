// Ten presses of real objects on a gel sensor with a gauge. They are not part of the repository; tests that
// want them say loudly when they are skipped.
#pragma once

#include <algorithm>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "capture/calibrate/force/force.h"
#include "tests/support/recordings.h"
#include "tests/support/thorough.h"

namespace palpate {

class WedgeClips : public RecordingsTest {
 protected:
  explicit WedgeClips(const char* unchecked) : RecordingsTest(unchecked, "gelsight_wedge_press") {}

  static std::filesystem::path folder() { return recordings_folder() / "gelsight_wedge_press"; }
  /// The clips of both days, where they are there; by default every `step`-th of each day.
  static std::vector<std::filesystem::path> both_days(size_t step = 1) {
    std::vector<std::filesystem::path> files;
    for (const std::filesystem::path& day : {folder(), folder() / "../gelsight_wedge_day2"}) {
      if (!std::filesystem::is_directory(day)) continue;
      std::vector<std::filesystem::path> of_day;
      for (const auto& entry : std::filesystem::directory_iterator(day))
        if (entry.path().extension() == ".avi") of_day.push_back(entry.path());
      std::ranges::sort(of_day);
      of_day = part_of(std::move(of_day), step);
      files.insert(files.end(), of_day.begin(), of_day.end());
    }
    return files;
  }
  static GaugedRecording measured(const std::string& clip) {
    MeasuredInput input{(folder() / (clip + ".avi")).string(),
                        load_sensor(shipped_sensor("gelsight_wedge")),
                        {},
                        Output::Force | Output::Gradient};
    // The gauge is read a frame or two late.
    return measure_with_gauge(context(), input,
                              {(folder() / (clip + ".csv")).string(), {}, parse_alignment("auto"), 0}, {});
  }
};

}  // namespace palpate
