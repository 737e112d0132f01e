// A recording beside the gauge's table: another recording's, and one that begins touched, are refused.
#include "capture/calibrate/gauged_recording.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "capture/open_source.h"
#include "engine/base/text.h"
#include "palpate/error.h"
#include "tests/support/gpu_fixture.h"
#include "tests/support/test_folder.h"

namespace palpate {
namespace {

class GaugedRecordingTest : public GpuTest {
 protected:
  ~GaugedRecordingTest() override { std::filesystem::remove_all(folder_); }
  static constexpr const char* kPress = "synthetic:press?size=96x72&mode=gel";

  /// Force of each frame of `input`; the table has one for each of `frames`, `from` on.
  void write_table(const std::string& input, size_t frames, size_t from = 0) {
    const std::unique_ptr<Source> source = open_source(input, find_input(1, input, {}).sensor);
    std::ofstream table(gauge());
    table << "frame,force_N\n";
    const uint64_t count = source->frame_count().value_or(0);
    for (size_t i = 0; i < frames; ++i)
      table << i << ',' << sign_ * source->truth((i + from) % count)->force_N + offset_N_ << '\n';
  }
  std::string gauge() const { return (folder_ / "gauge.csv").string(); }
  GaugedRecording measured(const MeasuredInput& input) const {
    GaugeRequest request;
    request.gauge = gauge();
    return measure_beside_gauge(context(), input, request, {});
  }
  std::string refusal(const MeasuredInput& input) const {
    try {
      measured(input);
    } catch (const Error& error) {
      EXPECT_EQ(error.failure(), Failure::Input);
      return error.what();
    }
    ADD_FAILURE() << "not refused";
    return {};
  }

  /// Largest difference of the readings from the truth.
  static double worst(const GaugedRecording& recording) {
    const std::unique_ptr<Source> source = open_source(kPress, find_input(1, kPress, {}).sensor);
    double most_N = 0;
    for (const GaugedFrame& f : recording.frames)
      most_N = std::max(most_N, std::abs(f.force_N - source->truth(f.touch.sequence)->force_N));
    return most_N;
  }

  double sign_ = 1, offset_N_ = 0;  // of the table
  std::filesystem::path folder_ = test_folder("gauged");
  MeasuredInput input_ = find_input(1, kPress, {});
};

TEST_F(GaugedRecordingTest, ItsOwnTableIsTaken) {
  write_table(kPress, 240);
  const GaugedRecording own = measured(input_);
  EXPECT_EQ(own.frames.size(), 240u);
  EXPECT_TRUE(own.notes.empty());
}

TEST_F(GaugedRecordingTest, AnOffsetIsTakenOff) {
  offset_N_ = 0.8;
  write_table(kPress, 240);
  const GaugedRecording untared = measured(input_);
  ASSERT_EQ(untared.notes.size(), 1u);
  EXPECT_NE(untared.notes[0].find("reads +0.8"), std::string::npos) << untared.notes[0];
  EXPECT_LT(worst(untared), 1e-3);
}

TEST_F(GaugedRecordingTest, TheOtherSignIsTurnedWhereItIsCertain) {
  sign_ = -1;
  offset_N_ = 0.1;
  write_table(kPress, 240);
  const GaugedRecording turned = measured(input_);
  EXPECT_EQ(turned.notes.size(), 2u);
  EXPECT_LT(worst(turned), 1e-3);
  // Above 0 all the time: another recording's table might read so.
  offset_N_ = 50;
  write_table(kPress, 240);
  EXPECT_NE(refusal(input_).find("falls where the touch grows"), std::string::npos) << refusal(input_);
}

TEST_F(GaugedRecordingTest, ALateTableIsTaken) {
  write_table(kPress, 240, 237);  // three frames late, as gauges are read
  EXPECT_EQ(measured(input_).frames.size(), 240u);
}

TEST_F(GaugedRecordingTest, AnotherLengthIsNotedOrRefused) {
  write_table(kPress, 242);
  const GaugedRecording longer = measured(input_);
  ASSERT_EQ(longer.notes.size(), 1u);
  EXPECT_NE(longer.notes[0].find("frame 241"), std::string::npos) << longer.notes[0];
  write_table(kPress, 300);
  const std::string said = refusal(input_);
  for (const char* word : {"frame 299", "ends at 239", "recorded with it"})
    EXPECT_NE(said.find(word), std::string::npos) << word << " in: " << said;
}

TEST_F(GaugedRecordingTest, AnotherRecordingsForceIsRefused) {
  write_table(kPress, 240, 120);
  EXPECT_NE(refusal(input_).find("does not follow the touch"), std::string::npos) << refusal(input_);
}

TEST_F(GaugedRecordingTest, AForceOfAnotherTimeIsRefused) {
  write_table(kPress, 240, 200);  // 40 frames late
  const std::string said = refusal(input_);
  EXPECT_NE(said.find("frames late"), std::string::npos) << said;
}

TEST_F(GaugedRecordingTest, ARecordingThatBeginsTouchedIsRefused) {
  // The press from its middle on, as images: their first frame stands for the untouched image.
  const std::unique_ptr<Source> source = open_source(kPress, input_.sensor);
  const std::filesystem::path images = folder_ / "images";
  std::filesystem::create_directory(images);
  std::ofstream table(gauge());
  table << "frame,force_N\n";
  Frame frame;
  for (int i = 0; source->next(frame); ++i) {
    if (i < 80) continue;
    std::vector<cv::Mat> planes;
    for (const uint32_t colour : {2u, 1u, 0u})
      planes.emplace_back(static_cast<int>(frame.format.height), static_cast<int>(frame.format.width),
                          CV_8UC1, frame.row(colour, 0));
    cv::Mat picture;
    cv::merge(planes, picture);
    ASSERT_TRUE(cv::imwrite((images / text("%06d.png", i)).string(), picture));
    table << i - 80 << ',' << source->truth(frame.sequence)->force_N << '\n';
  }
  table.close();
  input_.input = images.string();
  const std::string said = refusal(input_);
  for (const char* word : {"untouched image", "in its first 1 frame", "begins untouched"})
    EXPECT_NE(said.find(word), std::string::npos) << word << " in: " << said;
}

}  // namespace
}  // namespace palpate
