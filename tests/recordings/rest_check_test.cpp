// An untouched image that shows a touch is reported, and one that shows none is left alone, on recordings
// of real sensors.
#include "capture/run/rest_check.h"

#include <gtest/gtest.h>

#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include "capture/files/tables/gauge.h"
#include "capture/open_source.h"
#include "tests/recordings/wedge_clips.h"

namespace palpate {
namespace {

namespace fs = std::filesystem;

class RestCheckRecordings : public WedgeClips {
 protected:
  RestCheckRecordings() : WedgeClips("UNTOUCHED IMAGES NOT CHECKED ON REAL SENSORS") {}

  static Sensor sensor(const std::string& name) { return load_sensor(shipped_sensor(name)); }
  /// What is said of the frames of `input` from `first` on with that frame as untouched, or with `rest`.
  static std::string said(const std::string& input, const Sensor& sensor, size_t first,
                          const fs::path& rest = {}) {
    Sensor reading = sensor;
    reading.background.image = rest.string();
    const std::unique_ptr<Source> source = open_source(input, reading);
    Frame frame;
    for (size_t i = 0; i <= first; ++i)
      if (!source->next(frame)) return "too short";
    RestCheck check(rest.empty() ? frame : load_background(input, reading, *source), sensor);
    if (!rest.empty()) check.add(frame);
    while (source->next(frame)) check.add(frame);
    return check.warning();
  }
};

TEST_F(RestCheckRecordings, ClipsThatBeginUntouchedAreLeftAloneAndOthersAreTold) {
  const Sensor wedge = sensor("gelsight_wedge");
  size_t clips = 0, alone = 0, told = 0, released = 0;
  for (const fs::path& clip : both_days(3)) {
    ++clips;
    alone += said(clip.string(), wedge, 0).empty();
    // From the largest force on; the clip has to show the release.
    fs::path table = clip;
    const Gauge gauge = read_gauge(table.replace_extension(".csv"), GaugeColumns::Normal);
    const auto deepest = static_cast<size_t>(std::max_element(gauge.force_N.begin(), gauge.force_N.end()) -
                                             gauge.force_N.begin());
    const size_t after =
        static_cast<size_t>(std::count_if(gauge.force_N.begin() + static_cast<std::ptrdiff_t>(deepest),
                                          gauge.force_N.end(), [](double force_N) { return force_N < 0.3; }));
    if (after < 5) continue;
    ++released;
    const std::string warning = said(clip.string(), wedge, deepest);
    std::printf("%-28s %s\n", clip.stem().c_str(), warning.c_str());
    told += !warning.empty();
  }
  std::printf("%zu of %zu clips left alone; %zu of %zu that begin pressed told\n", alone, clips, told,
              released);
  EXPECT_EQ(alone, clips);
  EXPECT_GE(2 * told, released);  // soft objects move the light at the border, where a touch is not told
}

TEST_F(RestCheckRecordings, FoldersOfPressesNeedAnUntouchedPicture) {
  size_t pictures_taken = 0, told = 0;
  struct Set {
    const char *sensor, *folder, *rest;
  };
  for (const Set& set : {Set{"gelsight_sim2real", "gelsight-sim2real", "background_real.png"},
                         Set{"gelslim_balls", "gelslim-balls", "ref.jpg"}}) {
    const fs::path pictures = folder() / ".." / set.folder;
    if (!fs::is_directory(pictures)) continue;
    const Sensor gel = sensor(set.sensor);
    const std::string with = said(pictures.string(), gel, 0, pictures / set.rest);
    EXPECT_EQ(with, "") << set.folder;
    // The first picture of a press as untouched.
    for (const auto& entry : fs::directory_iterator(pictures)) {
      const std::string name = entry.path().filename().string();
      if (name == set.rest || entry.path().extension() == ".txt") continue;
      const std::string warning = said(pictures.string(), gel, 0, entry.path());
      std::printf("%-24s %s\n", name.c_str(), warning.c_str());
      ++pictures_taken;
      told += !warning.empty();
    }
  }
  std::printf("%zu of %zu pressed pictures told\n", told, pictures_taken);
  EXPECT_GE(static_cast<double>(told), 0.85 * static_cast<double>(pictures_taken));
}

}  // namespace
}  // namespace palpate
