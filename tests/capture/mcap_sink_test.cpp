// The MCAP file of live data: what its disk has no time for is dropped and counted, and nobody waits.
#include "capture/mcap/sink.h"

#include <fcntl.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <csignal>
#include <thread>

#include "tests/support/eventually.h"
#include "tests/support/test_folder.h"

namespace palpate {
namespace {

constexpr FrameFormat kFormat{400, 300, 1, 8};

Frame noise(uint64_t sequence) {
  Frame frame;
  frame.reshape(kFormat);
  std::mt19937 random(static_cast<uint32_t>(sequence));
  for (uint8_t& byte : frame.bytes) byte = static_cast<uint8_t>(random());
  frame.sequence = sequence;
  return frame;
}

Result touch_of(const Frame& frame) {
  Result result;
  result.touch.sequence = frame.sequence;
  return result;
}

McapOptions bare() {
  McapOptions options;
  options.sensor.pitch_mm_per_px = std::numeric_limits<double>::quiet_NaN();
  options.outputs = Output::Force;
  return options;
}

TEST(McapSinkTest, ADiskThatStandsStillStopsNobody) {
  const std::filesystem::path folder = test_folder("mcap");
  const std::filesystem::path pipe = folder / kMcapFile;
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  const int reader = open(pipe.c_str(), O_RDONLY | O_NONBLOCK);  // takes nothing as yet
  ASSERT_GE(reader, 0);
  constexpr uint64_t kFrames = 60;
  const size_t each = kFormat.frame_bytes() + 4 * size_t{kFormat.width} * kFormat.height;
  McapSink sink(folder, bare(), {.queue_bytes = 3 * each});
  for (uint64_t n = 0; n < kFrames; ++n) sink.add(noise(n), touch_of(noise(n)));
  EXPECT_GE(sink.status().dropped, kFrames - 40);  // a chunk holds nine frames, the pipe less than one
  std::atomic<bool> done{false};
  std::thread drain([&] {
    std::vector<char> bytes(1 << 16);
    while (!done || read(reader, bytes.data(), bytes.size()) > 0)
      if (read(reader, bytes.data(), bytes.size()) <= 0) usleep(1000);
  });
  const McapStatus status = sink.close();
  done = true;
  drain.join();
  close(reader);
  EXPECT_EQ(status.error, "");
  EXPECT_EQ(status.written + status.dropped, kFrames);
  EXPECT_GE(status.written, 3u);
  std::filesystem::remove_all(folder);
}

TEST(McapSinkTest, WaitsForRoomWhereNoFrameMayBeLost) {
  const std::filesystem::path folder = test_folder("mcap");
  McapSink sink(folder, bare(), {.queue_bytes = 1, .wait_unless = [] { return false; }});
  for (uint64_t n = 0; n < 50; ++n) sink.add(noise(n), touch_of(noise(n)));
  const McapStatus status = sink.close();
  EXPECT_EQ(status.error, "");
  EXPECT_EQ(status.written, 50u);
  EXPECT_EQ(status.dropped, 0u);
  EXPECT_EQ(status.bytes, std::filesystem::file_size(folder / kMcapFile));
  EXPECT_TRUE(std::filesystem::exists(folder / kMcapYaml));
  std::filesystem::remove_all(folder);
}

TEST(McapSinkTest, AFileThatMayGrowNoMoreEndsAlone) {
  const std::filesystem::path folder = test_folder("mcap");
  constexpr rlim_t kMost = 3'000'000;
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  const rlimit small{kMost, before.rlim_max};
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &small), 0);
  McapSink sink(folder, bare());
  uint64_t offered = 0;
  EXPECT_TRUE(eventually([&] {
    const Frame frame = noise(offered++);
    sink.add(frame, touch_of(frame));
    return !sink.status().error.empty();
  }));
  const McapStatus status = sink.close();
  setrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, handler);
  EXPECT_NE(status.error.find("file too large"), std::string::npos) << status.error;
  EXPECT_EQ(status.written + status.dropped, offered);
  // What did not fit in whole was taken back.
  EXPECT_EQ(std::filesystem::file_size(folder / kMcapFile), status.bytes);
  EXPECT_GT(status.bytes, kMost / 2);
  EXPECT_FALSE(std::filesystem::exists(folder / kMcapYaml));
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace palpate
