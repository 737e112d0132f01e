// A recording with a gauge's table: another recording's, and one that begins touched, are refused.
#include "capture/calibrate/force/gauged_recording.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "capture/calibrate/force/force.h"
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
  GaugedRecording measured(const MeasuredInput& input, GaugeRequest request = {}) const {
    request.gauge = gauge();
    return measure_with_gauge(context(), input, request, {});
  }
  static GaugeRequest request_of(double rate_Hz, bool one_sequence = false) {
    GaugeRequest request;
    request.rate_Hz = rate_Hz;
    request.one_sequence = one_sequence;
    return request;
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

  /// Every `step`-th frame of the press, `from` on, as a folder of images with its table; the new input.
  void write_images(int from, int step) {
    const std::unique_ptr<Source> source = open_source(kPress, input_.sensor);
    const std::filesystem::path images = folder_ / "images";
    std::filesystem::create_directory(images);
    std::ofstream table(gauge());
    table << "frame,force_N\n";
    Frame frame;
    for (int i = 0, written = 0; source->next(frame); ++i) {
      if (i < from || (i - from) % step != 0) continue;
      std::vector<cv::Mat> planes;
      for (const uint32_t colour : {2u, 1u, 0u})
        planes.emplace_back(static_cast<int>(frame.format.height), static_cast<int>(frame.format.width),
                            CV_8UC1, frame.row(colour, 0));
      cv::Mat picture;
      cv::merge(planes, picture);
      ASSERT_TRUE(cv::imwrite((images / text("%06d.png", i)).string(), picture));
      table << written++ << ',' << source->truth(frame.sequence)->force_N << '\n';
    }
    input_.input = images.string();
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

TEST_F(GaugedRecordingTest, ARateThatIsNotUsedIsNoted) {
  write_table(kPress, 240);
  const GaugedRecording own = measured(input_, request_of(7));
  ASSERT_EQ(own.notes.size(), 1u);
  EXPECT_NE(own.notes[0].find("the rate of 7 frames/s is not used"), std::string::npos) << own.notes[0];
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

// As gauges are read: followed, below a frame, unless the table is to be taken as it is.
TEST_F(GaugedRecordingTest, ALateTableIsFollowed) {
  write_table(kPress, 240, 237);  // three frames late
  const GaugedRecording late = measured(input_);
  ASSERT_EQ(late.notes.size(), 1u);
  EXPECT_NE(late.notes[0].find("frames late"), std::string::npos) << late.notes[0];
  const double frame_s = late.frames[1].time_s - late.frames[0].time_s;
  EXPECT_NEAR(late.offset_s, -3 * frame_s, 0.5 * frame_s);
  GaugeRequest as_it_is;
  as_it_is.alignment = parse_alignment("none");
  const GaugedRecording taken = measured(input_, as_it_is);
  EXPECT_TRUE(taken.notes.empty());
  EXPECT_LT(worst(late), 0.3 * worst(taken));
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

/// Clocks are compared by what goes best with the force, whatever the force will be read by.
TEST_F(GaugedRecordingTest, ClocksAreComparedByTheBestSignal) {
  const std::string gel = "synthetic:palpation?size=96x72&mode=gel&rate=30";
  const std::unique_ptr<Source> source = open_source(gel, find_input(1, gel, {}).sensor);
  std::ofstream table(gauge());
  table << "time_s,force_N\n";
  for (uint64_t i = 0; i < source->frame_count().value_or(0); ++i)
    table << static_cast<double>(i) / 30 - 0.2 << ',' << source->truth(i)->force_N << '\n';
  table.close();
  MeasuredInput input = find_input(1, gel, {});
  for (const auto signal : {ForceSignal::Layer, ForceSignal::GraySum, ForceSignal::Area})
    EXPECT_TRUE(wants(force_outputs(input, signal), Output::Gradient));
  const MeasuredInput waveguide = find_input(1, "synthetic:press?size=96x72", {});
  EXPECT_FALSE(wants(force_outputs(waveguide, ForceSignal::Layer), Output::Gradient));
  input.outputs = force_outputs(input, ForceSignal::Layer);
  const GaugedRecording own = measured(input);
  ASSERT_TRUE(own.alignment);
  EXPECT_NEAR(own.alignment->offset_s, 0.2, 0.02);
  std::vector<double> time_s, gray, gradient, layer, gauge_s, force_N;
  for (const GaugedFrame& f : own.frames) {
    time_s.push_back(f.time_s);
    gray.push_back(f.touch.contact ? f.touch.gray_sum : 0);
    gradient.push_back(f.touch.gradient_sum.value_or(0));
    layer.push_back(f.touch.contact && f.touch.traction ? f.touch.traction->fz_N.value : 0);
    gauge_s.push_back(f.time_s - 0.2);
    force_N.push_back(source->truth(f.touch.sequence)->force_N);
  }
  const auto by = [&](const std::vector<double>& signal) {
    return find_in_time(time_s, signal, gauge_s, force_N).correlation;
  };
  const std::map<double, std::string> signals = {
      {by(gray), "gray sum"}, {by(gradient), "sum of gradients"}, {by(layer), "layer's force"}};
  EXPECT_EQ(own.clock_signal, signals.rbegin()->second);
  EXPECT_NEAR(own.alignment->correlation, signals.rbegin()->first, 0.01);
  EXPECT_NE(describe(own).find("with the " + own.clock_signal), std::string::npos) << describe(own);

  // A refusal names the recording.
  std::ofstream other(gauge());
  other << "time_s,force_N\n";
  for (int i = 0; i < 600; ++i) other << 0.02 * i << ',' << (i * 7919) % 101 << '\n';
  other.close();
  const std::string said = refusal(input);
  EXPECT_NE(said.find("goes with '" + own.input + "'"), std::string::npos) << said;
}

TEST_F(GaugedRecordingTest, ARecordingThatBeginsTouchedIsRefused) {
  // The press from its middle on, as images: their first frame stands for the untouched image.
  write_images(80, 1);
  const std::string said = refusal(input_);
  for (const char* word : {"untouched image", "in its first 1 frame", "begins untouched"})
    EXPECT_NE(said.find(word), std::string::npos) << word << " in: " << said;
}

TEST_F(GaugedRecordingTest, PicturesWithoutARateAreSeparatePresses) {
  write_images(0, 6);
  const GaugedRecording apart = measured(input_);
  EXPECT_TRUE(apart.separate);
  ASSERT_EQ(apart.notes.size(), 1u);
  EXPECT_NE(apart.notes[0].find("each is a press of its own"), std::string::npos) << apart.notes[0];
  for (const GaugedFrame& f : apart.frames) EXPECT_TRUE(std::isnan(f.touch.shift_x_px));
  const std::vector<ForceSample> presses = force_samples({apart}, false);
  ASSERT_GE(presses.size(), 5u);
  for (size_t i = 0; i < presses.size(); ++i) EXPECT_EQ(presses[i].press, i);
  for (const GaugeRequest& request : {request_of(10), request_of(0, true)}) {
    const GaugedRecording followed = measured(input_, request);
    EXPECT_FALSE(followed.separate);
    for (const ForceSample& sample : force_samples({followed}, false)) EXPECT_EQ(sample.press, 0u);
  }
  std::ofstream(gauge()) << "frame,fx_N,fy_N\n0,0,0\n1,0.5,0\n2,0,0\n3,0,0\n";
  try {
    GaugeRequest pull;
    pull.columns = GaugeColumns::Tangential;
    measured(input_, pull);
    ADD_FAILURE() << "nothing is pulled in pictures that do not follow each other";
  } catch (const Error& error) {
    EXPECT_EQ(error.failure(), Failure::Usage);
    EXPECT_NE(std::string(error.what()).find("; try --sequence"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace palpate
