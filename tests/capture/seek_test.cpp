// Jumps in recordings: the frame of a number is the one that reading in order gives.
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>

#include "capture/open_source.h"
#include "capture/video/module.h"
#include "tests/support/recordings.h"

namespace fs = std::filesystem;

namespace palpate {
namespace {

constexpr int kFilmed = 60;

class Seek : public ::testing::Test {
 protected:
  Seek() : folder_(fs::temp_directory_path() / ("palpate-seek-" + std::to_string(::getpid()))) {
    fs::create_directories(folder_);
  }
  ~Seek() override { fs::remove_all(folder_); }

  /// A disc that moves over noise: every frame is unlike the others.
  static cv::Mat picture(int frame) {
    cv::Mat image(96, 128, CV_8UC3);
    cv::RNG(static_cast<uint64_t>(frame) + 1).fill(image, cv::RNG::UNIFORM, 40, 90);
    cv::circle(image, {10 + 2 * frame, 48}, 9, {200, 220, 40}, cv::FILLED);
    return image;
  }

  std::string film(const std::string& name, const char* fourcc) const {
    const std::string file = (folder_ / name).string();
    cv::VideoWriter out(file, cv::CAP_FFMPEG,
                        cv::VideoWriter::fourcc(fourcc[0], fourcc[1], fourcc[2], fourcc[3]), 25, {128, 96});
    EXPECT_TRUE(out.isOpened()) << name;
    for (int i = 0; i < kFilmed; ++i) out.write(picture(i));
    return file;
  }

  /// As films of ours: pictures between two others are stored by their differences to both.
  std::string our_film() const {
    const fs::path file = folder_ / "ours.mp4";
    const auto out = video_module().encode(file, "ours.mp4", 128, 96, 25);
    cv::Mat rgb;
    for (int i = 0; i < kFilmed; ++i) {
      cv::cvtColor(picture(i), rgb, cv::COLOR_BGR2RGB);
      out->write({rgb.data, rgb.total() * 3});
    }
    out->close();
    return file.string();
  }

  static void expect_same(const std::string& input, const std::vector<uint64_t>& indices) {
    SCOPED_TRACE(input);
    Sensor sensor;
    sensor.pitch_mm_per_px = 0.1;
    std::vector<Frame> in_order;
    for (const auto source = open_source(input, sensor);;) {
      Frame frame;
      if (!source->next(frame)) break;
      in_order.push_back(std::move(frame));
    }
    ASSERT_GT(in_order.size(), 3u);
    const auto source = open_source(input, sensor);
    Frame frame;
    for (uint64_t index : indices) {
      index = std::min<uint64_t>(index, in_order.size() - 1);
      ASSERT_TRUE(source->seek(index)) << index;
      for (uint64_t i = index; i < std::min<uint64_t>(index + 3, in_order.size()); ++i) {
        ASSERT_TRUE(source->next(frame)) << i;
        EXPECT_EQ(frame.sequence, in_order[i].sequence);
        EXPECT_EQ(frame.time_ns, in_order[i].time_ns);
        EXPECT_EQ(frame.after_gap, i == index);
        const size_t bytes = frame.format.frame_bytes();
        EXPECT_TRUE(std::equal(frame.pixels(), frame.pixels() + bytes, in_order[i].pixels())) << i;
      }
    }
    EXPECT_FALSE(source->seek(in_order.size() + 100));
  }

  const std::vector<uint64_t> jumps_{17, 3, 58, 0, 59, 30, 31, 29, 0, 12};
  fs::path folder_;
};

TEST_F(Seek, VideosOfManyCodecs) {
  for (const auto& [name, fourcc] : {std::pair{"jpeg.avi", "MJPG"},
                                     {"png.avi", "MPNG"},
                                     {"part2.mp4", "mp4v"},
                                     {"part2.avi", "XVID"},
                                     {"lossless.mkv", "FFV1"},
                                     {"web.webm", "VP80"}})
    expect_same(film(name, fourcc), jumps_);
  expect_same(our_film(), jumps_);
}

TEST_F(Seek, FoldersOfImages) {
  const fs::path images = folder_ / "images";
  fs::create_directories(images);
  for (int i = 0; i < kFilmed; ++i)
    cv::imwrite((images / ("frame_" + std::to_string(i) + ".png")).string(), picture(i));
  expect_same(images.string(), jumps_);
}

TEST(Recordings, JumpsInSharedVideosAreExact) {
  const fs::path data = recordings_folder();
  if (!fs::exists(data)) GTEST_SKIP() << "no shared data";
  int videos = 0;
  for (const auto& entry : fs::recursive_directory_iterator(data)) {
    const std::string end = entry.path().extension();
    if ((end != ".mp4" && end != ".avi") || entry.file_size() > 20'000'000) continue;
    const auto video = video_module().decode(entry.path());
    ASSERT_TRUE(video) << entry.path();
    std::vector<double> sums;
    const auto sum = [&] {
      const BgrView view = video->picture().value();
      double total = 0;
      for (uint32_t y = 0; y < view.height; ++y)
        for (uint32_t x = 0; x < 3 * view.width; ++x)
          total += (1 + (x + 7 * y) % 13) * view.pixels[y * view.row_bytes + x];
      return total;
    };
    while (sums.size() < 150 && video->grab()) sums.push_back(sum());
    for (const uint64_t index : {sums.size() / 2, size_t{1}, sums.size() - 1, sums.size() / 3}) {
      ASSERT_TRUE(video->seek(index)) << entry.path();
      ASSERT_TRUE(video->grab());
      EXPECT_EQ(sum(), sums[index]) << entry.path() << " frame " << index;
    }
    ++videos;
  }
  EXPECT_GT(videos, 3);
}

}  // namespace
}  // namespace palpate
