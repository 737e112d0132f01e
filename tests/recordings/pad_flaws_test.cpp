// Flaws of real gels: none where another clip of the day, or the sensor's own untouched picture, is the
// untouched image; and a scratch drawn on all of a sensor's presses is found.
#include "engine/measure/picture/pad_flaws.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "capture/calibrate/background.h"
#include "capture/open_source.h"
#include "tests/recordings/wedge_clips.h"

namespace palpate {
namespace {

namespace fs = std::filesystem;

class PadFlawsRecordings : public WedgeClips {
 protected:
  PadFlawsRecordings() : WedgeClips("FLAWS NOT LOOKED FOR ON REAL GELS") {}

  /// Flaws of presses; each is changed by `change` first.
  static PadFlaws of_presses(const fs::path& presses, const fs::path& background, Sensor sensor,
                             const std::function<void(Frame&)>& change = {}) {
    sensor.background.image = background.string();
    const std::unique_ptr<Source> source = open_source(presses.string(), sensor);
    PadFlaws flaws(source->format(), true);
    flaws.set_background(load_background(presses.string(), sensor, *source));
    Frame frame;
    while (source->next(frame)) {
      if (change) change(frame);
      flaws.look_at(frame);
    }
    return flaws;
  }
};

TEST_F(PadFlawsRecordings, NoneInClipsOfTheSameDay) {
  const Sensor wedge = load_sensor(shipped_sensor("gelsight_wedge"));
  size_t pairs = 0, judged = 0;
  const std::vector<fs::path> clips = both_days(3);
  for (const fs::path& rest : clips) {
    const Frame untouched = load_background(rest.string(), wedge, *open_source(rest.string(), wedge));
    for (const fs::path& clip : clips) {
      if (fs::weakly_canonical(clip.parent_path()) != fs::weakly_canonical(rest.parent_path())) continue;
      const std::unique_ptr<Source> source = open_source(clip.string(), wedge);
      PadFlaws flaws(source->format(), false);
      flaws.set_background(untouched);
      Frame frame;
      while (source->next(frame)) flaws.look_at(frame);
      EXPECT_EQ(flaws.summary().describe(), "") << clip << " by " << rest;
      ++pairs;
      judged += flaws.judged();
    }
  }
  std::printf("%zu pairs of clips, %zu whose first frame is untouched by the other\n", pairs, judged);
  EXPECT_GE(2 * judged, pairs);
}

TEST_F(PadFlawsRecordings, PressesShowAScratchAndNoneWhereThereIsNone) {
  const fs::path mini = folder() / "../gelsight_mini/pad_a", sim2real = folder() / "../gelsight-sim2real";
  struct Set {
    fs::path presses, background;
    Sensor sensor;
  };
  Sensor unknown;
  unknown.channels = 3;
  std::vector<Set> sets;
  if (fs::is_directory(mini))
    for (const char* ball : {"ball_6.31mm", "ball_9.5mm"})
      sets.push_back({mini / ball, mini / "background.png", unknown});
  if (fs::is_directory(sim2real))
    sets.push_back(
        {sim2real, sim2real / "background_real.png", load_sensor(shipped_sensor("gelsight_sim2real"))});
  for (const Set& set : sets) {
    const PadFlaws clean = of_presses(set.presses, set.background, set.sensor);
    EXPECT_TRUE(clean.judged());
    EXPECT_EQ(clean.summary().describe(), "") << set.presses;
    // Presses of Sim2Real change the light of most of the picture: what they hide is not found.
    if (set.presses == sim2real) continue;
    // Aslant near a corner, where most presses leave it alone.
    const auto share = [](double x, double y) {
      const double across = (x - y - 10) / std::sqrt(2.0), along = x + y;
      return along > 60 && along < 150 ? std::exp(-across * across / 1.5) : 0.0;
    };
    size_t width = 0;
    const PadFlaws scratched = of_presses(set.presses, set.background, set.sensor, [&](Frame& frame) {
      width = frame.format.width;
      for (uint32_t y = 0; y < frame.format.height; ++y)
        for (uint32_t x = 0; x < frame.format.width; ++x) {
          const auto by = static_cast<long>(std::lround(25 * share(x, y)));
          frame.set(0, x, y, static_cast<uint32_t>(std::max(long{frame.at(0, x, y)} - by, 0l)));
          frame.set(2, x, y, static_cast<uint32_t>(std::min(long{frame.at(2, x, y)} + by, 255l)));
        }
    });
    size_t all = 0, found = 0;
    const std::vector<uint8_t>& flaws = scratched.flaws();
    for (size_t i = 0; i < flaws.size(); ++i) {
      const bool on = share(static_cast<double>(i % width), static_cast<double>(i / width)) > 0.4;
      all += on;
      found += on && flaws[i] != 0;
    }
    std::printf("%s: %zu of %zu px of a scratch\n", set.presses.filename().c_str(), found, all);
    EXPECT_GT(static_cast<double>(found), 0.9 * static_cast<double>(all));
    EXPECT_GT(all, 0u);
  }
}

}  // namespace
}  // namespace palpate
