// Stiffness of real objects between two fingers, one of them a gel sensor, with the gripper's width: in the
// order that is known. The recordings are not part of the repository; the test says loudly when it is
// skipped.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include "capture/files/measurements.h"
#include "capture/files/output_file.h"
#include "capture/files/tables/csv_table.h"
#include "capture/pair/pair_session.h"
#include "tests/recordings/wedge_clips.h"
#include "tests/support/test_folder.h"

namespace palpate {
namespace {

class GripRecordings : public WedgeClips {
 protected:
  GripRecordings() : WedgeClips("STIFFNESS OF REAL OBJECTS NOT CHECKED") {}
  void TearDown() override { std::filesystem::remove_all(folder_); }

  /// A log of the gripper's width beside a grip.json that names it.
  std::filesystem::path grip_of(const std::string& clip) const {
    constexpr double kRate_Hz = 30;
    CsvTable widths(WedgeClips::folder() / (clip + ".csv"), "widths of a gripper");
    const std::vector<size_t> columns = widths.require({"frame", "gripper_width_mm"});
    std::string log = "time_s,opening_mm\n";
    while (widths.next())
      log +=
          shortest(widths.number(columns[0]) / kRate_Hz) + "," + shortest(widths.number(columns[1])) + "\n";
    write_whole(folder_ / (clip + "_opening.csv"), log);
    write_whole(folder_ / (clip + ".json"), R"({"left": {"rotation": [[0, 0, -1], [1, 0, 0], [0, -1, 0]]},
      "right": {"rotation": [[0, 0, 1], [1, 0, 0], [0, 1, 0]]},
      "opening": {"log": ")" + clip + R"(_opening.csv", "sd_mm": 0.05}})");
    return folder_ / (clip + ".json");
  }
  /// The last stiffness while the object is pressed: one finger was seen, and stands for both.
  Grip pressed(const std::string& clip, const Sensor& sensor) const {
    PairRequest request;
    for (RunSettings& finger : request.fingers) {
      finger.input = (WedgeClips::folder() / (clip + ".avi")).string();
      finger.given_sensor = sensor;
    }
    request.grip = grip_of(clip);
    request.out = folder_ / clip;
    Grip hardest;
    request.on_row = [&hardest](const GripFrame& row) {
      if (row.grip && row.grip->force_N.value > hardest.force_N.value) hardest = *row.grip;
    };
    record_pair([]() -> gpu::Context& { return context(); }, request, {});
    return hardest;
  }

  std::filesystem::path folder_ = test_folder("grip_recordings");
};

TEST_F(GripRecordings, StiffnessIsInTheKnownOrder) {
  // Force by other presses of four of the objects; the orange ball is in none of them.
  std::vector<GaugedRecording> taught;
  for (const char* object : {"golf_ball", "purple_ball_hardest", "green_ball_softer", "foam_brick"})
    taught.push_back(measured(std::string(object) + "_1"));
  Sensor sensor = load_sensor(shipped_sensor("gelsight_wedge"));
  sensor.force = calibrate_force(std::move(taught), {}, true).choice.calibration;
  Estimate before{100, 0, Validity::Valid};
  for (const char* object :
       {"golf_ball", "purple_ball_hardest", "green_ball_softer", "orange_ball_softest", "foam_brick"}) {
    const Grip grip = pressed(std::string(object) + "_2", sensor);
    const Estimate& stiffness = grip.stiffness_N_per_mm;
    std::printf("%-22s %5.2f +- %.2f N/mm (%s) at %4.1f N, %5.2f mm thick\n", object, stiffness.value,
                stiffness.standard_error, to_string(grip.stiffness), grip.force_N.value,
                grip.thickness_mm.value);
    EXPECT_GT(stiffness.value, 0) << object;
    // Green and orange cannot be told apart, by their errors; the others can.
    const double apart_sd = std::hypot(stiffness.standard_error, before.standard_error);
    const double least_sd = object == std::string("orange_ball_softest") ? -1 : 1;
    EXPECT_GT(before.value - stiffness.value, least_sd * apart_sd)
        << object << ": softer than the one before";
    before = stiffness;
    // These presses reach the border, where forces are in doubt; and so is what hangs on them.
    EXPECT_EQ(grip.stiffness, grip.force_N.valid() ? StiffnessState::Known : StiffnessState::ForceInDoubt)
        << object;
  }
}

}  // namespace
}  // namespace palpate
