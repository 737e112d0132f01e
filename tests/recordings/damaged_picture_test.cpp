// No frame of a real recording is taken for a damaged picture; the same frames spoilt on purpose are.
#include <gtest/gtest.h>

#include <filesystem>
#include <optional>

#include "capture/open_source.h"
#include "capture/run/input.h"
#include "engine/measure/picture/picture_check.h"
#include "tests/support/recordings.h"

namespace palpate {
namespace {

enum class Damage { Rolled, Green, ColoursExchanged };

/// Rolled to the right by a quarter of its width, partly green, or red and blue exchanged.
Frame spoilt(const Frame& frame, Damage how) {
  Frame made = frame;
  const FrameFormat& f = frame.format;
  for (uint32_t c = 0; c < f.channels; ++c)
    for (uint32_t y = 0; y < f.height; ++y)
      for (uint32_t x = 0; x < f.width; ++x) {
        if (how == Damage::Rolled) made.set(c, x, y, frame.at(c, (x + f.width - f.width / 4) % f.width, y));
        if (how == Damage::Green && y > f.height / 2) made.set(c, x, y, c == 1 ? 135 : 0);
        if (how == Damage::ColoursExchanged) made.set(c, x, y, frame.at(2 - c, x, y));
      }
  return made;
}

TEST(Recordings, NoFrameOfASharedClipIsTakenForADamagedPicture) {
  const std::filesystem::path data = recordings_folder();
  if (!std::filesystem::exists(data)) GTEST_SKIP() << "no shared data";
  uint64_t frames = 0, alarms = 0, rolled = 0, green = 0, made = 0, exchanged = 0, coloured = 0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(data)) {
    const std::filesystem::path& file = entry.path();
    if (file.extension() != ".avi" || file.string().find("/field/") != std::string::npos) continue;
    const Sensor sensor = bare_sensor(file.string());
    const auto source = open_source(file.string(), sensor);
    std::optional<PictureCheck> check;
    Frame frame;
    for (int i = 0; i < 150 && source->next(frame); ++i) {
      if (!check) {
        check.emplace(frame.format, sensor.saturation_gray);
        check->set_reference(frame);
      }
      const PictureFault fault = check->look_at(frame);
      alarms += fault != PictureFault::None;
      if (fault != PictureFault::None)
        ADD_FAILURE() << file << " frame " << frame.sequence << ": " << to_string(fault);
      if (frame.format.channels == 3 && i % 12 == 0) {
        ++coloured;
        exchanged += check->look_at(spoilt(frame, Damage::ColoursExchanged)) == PictureFault::ColourOrder;
      }
      if (++frames % 40 == 0 && file.string().find("wedge") != std::string::npos) {
        ++made;
        rolled += check->look_at(spoilt(frame, Damage::Rolled)) != PictureFault::None;
        green += check->look_at(spoilt(frame, Damage::Green)) == PictureFault::OneColour;
      }
    }
  }
  EXPECT_GT(frames, 1500u);
  EXPECT_EQ(alarms, 0u);
  EXPECT_GT(made, 30u);
  EXPECT_EQ(green, made);
  EXPECT_GE(rolled, made - made / 20);
  EXPECT_GT(coloured, 100u);
  // The drag of a marked gel leaves too little of its colours.
  EXPECT_GE(exchanged, coloured - coloured / 20);
  RecordProperty("frames", static_cast<int>(frames));
}

}  // namespace
}  // namespace palpate
