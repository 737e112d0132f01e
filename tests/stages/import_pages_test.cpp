// Frames read in place from memory that a camera driver maps: padded as the processor does it, to the last
// bit; imported once; given back when the frame is finished and not earlier; never read through an import of
// pages that have gone.
#include "engine/stages/frame/import_pages.h"

#include <thread>

#include "capture/synthetic/synthetic.h"
#include "engine/gpu/commands.h"
#include "engine/pipeline/pipeline_access.h"
#include "palpate/pipeline.h"
#include "tests/support/gpu_fixture.h"
#include "tests/support/leased_memory.h"
#include "tests/support/pipelines.h"
#include "tests/support/stage_run.h"

namespace palpate {
namespace {

constexpr size_t kPage = 4096;

class PadTest : public GpuTest {
 protected:
  void SetUp() override {
    GpuTest::SetUp();
    if (context().host_import_alignment() == 0)
      GTEST_SKIP() << context().report().name << " imports no host memory";
  }

  static std::vector<uint8_t> read(const PaddedImage& image, bool staged) {
    const gpu::DeviceBuffer down(context(), "readback", image.buffer().bytes(), gpu::Memory::Readback);
    gpu::Commands commands(context());
    commands.begin();
    if (staged) image.record(commands);
    commands.barrier();
    commands.copy(image.buffer(), down, down.bytes());
    commands.host_barrier();
    commands.end();
    commands.submit();
    commands.wait();
    down.invalidate();
    const auto bytes = down.as<const uint8_t>();
    return {bytes.begin(), bytes.end()};
  }

  static std::vector<uint8_t> copied(const Frame& frame) {
    PaddedImage image(context(), "copied", frame.format);
    image.write(frame);
    return read(image, true);
  }

  static std::vector<uint8_t> in_place(const ImportPages& pad, const Frame& frame, const PageImport& import) {
    PaddedImage image(context(), "in place", frame.format);
    if (image.buffer().mapped()) std::ranges::fill(image.buffer().as<uint8_t>(), uint8_t{0xa5});
    gpu::Commands commands(context());
    commands.begin();
    pad.record(commands, frame, import, image);
    commands.end();
    commands.submit();
    commands.wait();
    return read(image, false);
  }
};

TEST_F(PadTest, EveryWidthAndPlaceIsPaddedAsByTheProcessor) {
  std::mt19937 random(11);
  size_t cases = 0;
  for (const auto& [bits, channels] : {std::pair{8u, 1u}, {8u, 3u}, {10u, 1u}, {16u, 1u}, {16u, 3u}}) {
    for (uint32_t width = 1; width <= 70; ++width) {
      const FrameFormat format{width, 1 + width % 5, channels, bits};
      const Frame image = random_frame(format, 0, format.max_gray(), random);
      const std::vector<uint8_t> wanted = copied(image);
      const auto pages = map_pages(3 * kPage);
      // Bytes around the pixels do not matter.
      std::memset(const_cast<uint8_t*>(pages->begin()), 0x5b, pages->bytes());
      ImportPages pad(context(), format);
      // At the pages' beginning and end, across two, and at bytes that are no pixel's or texel's.
      for (const size_t offset : {size_t{0}, size_t{1}, size_t{6}, size_t{16}, size_t{kPage - 3},
                                  pages->bytes() - format.frame_bytes()}) {
        SCOPED_TRACE(std::to_string(width) + " px, " + std::to_string(channels) + " x " +
                     std::to_string(bits) + " bits at byte " + std::to_string(offset));
        const Frame frame = lease(image, pages, offset);
        const PageImport* import = pad.find(frame);
        ASSERT_NE(import, nullptr);
        ASSERT_EQ(in_place(pad, frame, *import), wanted);
        ++cases;
      }
    }
  }
  EXPECT_EQ(cases, 5u * 70 * 6);
}

TEST_F(PadTest, LargeFramesArePaddedAsByTheProcessor) {
  std::mt19937 random(12);
  for (const FrameFormat format : {FrameFormat{640, 480, 1, 8}, FrameFormat{1392, 1042, 1, 16},
                                   FrameFormat{641, 479, 3, 8}, FrameFormat{3, 16384, 1, 8}}) {
    const Frame image = random_frame(format, 0, format.max_gray(), random);
    const auto pages = map_pages(format.frame_bytes() + 100);
    const Frame frame = lease(image, pages, 100);
    ImportPages pad(context(), format);
    const PageImport* import = pad.find(frame);
    ASSERT_NE(import, nullptr);
    EXPECT_EQ(in_place(pad, frame, *import), copied(image)) << format.width;
  }
}

TEST_F(PadTest, PagesAreImportedOnceAndWhatCannotBeIsRefused) {
  const FrameFormat format{40, 30, 1, 8};
  const Frame image = uniform_frame(format, 7);
  ImportPages pad(context(), format);
  EXPECT_EQ(pad.find(image), nullptr) << "not leased";
  const auto pages = map_pages(2 * kPage), others = map_pages(2 * kPage);
  Frame frame = lease(image, pages, 0);
  const PageImport* import = pad.find(frame);
  ASSERT_NE(import, nullptr);
  EXPECT_EQ(pad.find(lease(image, pages, 512)), import);
  EXPECT_NE(pad.find(lease(image, others, 0)), import);
  EXPECT_EQ(pad.find(frame), import);

  frame.pages = nullptr;
  EXPECT_EQ(pad.find(frame), nullptr) << "nobody says how long the pages stay";
  frame.pages = others;
  EXPECT_EQ(pad.find(frame), nullptr) << "pixels beside the pages";
  frame = lease(image, pages, 2 * kPage - format.frame_bytes());
  EXPECT_EQ(pad.find(frame), import);
  frame.leased = {pages->begin() + 2 * kPage - format.frame_bytes() + 1, [](const uint8_t*) {}};
  EXPECT_EQ(pad.find(frame), nullptr) << "pixels across the pages' end";

  // Pages that do not begin where the device can take them.
  const auto crooked = std::make_shared<MappedPages>(pages->begin() + 64, kPage, [] {});
  frame = lease(image, crooked, 0);
  EXPECT_EQ(pad.find(frame), nullptr);
  EXPECT_EQ(pad.find(frame), nullptr);
}

TEST_F(PadTest, ALengthIsThatOfItsWholePages) {
  const auto pages = map_pages(kPage + 1);
  EXPECT_EQ(pages->bytes(), 2 * kPage);
  EXPECT_EQ(MappedPages(pages->begin() + 10, kPage, {}).bytes(), 2 * kPage - 10);
}

TEST_F(PadTest, RoomForMorePagesComesWhenOthersGo) {
  const FrameFormat format{40, 30, 1, 8};
  const Frame image = uniform_frame(format, 7);
  ImportPages pad(context(), format);
  std::vector<std::shared_ptr<MappedPages>> all;
  for (size_t i = 0; i < ImportPages::kMostImports; ++i) {
    all.push_back(map_pages(kPage));
    EXPECT_NE(pad.find(lease(image, all.back(), 0)), nullptr) << i;
  }
  const auto one_more = map_pages(kPage);
  EXPECT_EQ(pad.find(lease(image, one_more, 0)), nullptr);
  all.erase(all.begin() + 5);
  EXPECT_NE(pad.find(lease(image, one_more, 0)), nullptr);
}

// A camera is unplugged and plugged in: the same address, other pages behind it.
TEST_F(PadTest, PagesMappedAnewAtTheSameAddressAreReadAnew) {
  const FrameFormat format{100, 50, 1, 8};
  std::mt19937 random(13);
  ImportPages pad(context(), format);
  std::atomic<int> unmapped = 0;
  auto pages = map_pages(2 * kPage, nullptr, &unmapped);
  auto* address = const_cast<uint8_t*>(pages->begin());
  for (int round = 1; round <= 20; ++round) {
    const Frame image = random_frame(format, 0, 255, random);
    {
      const Frame frame = lease(image, pages, 40);
      const PageImport* import = pad.find(frame);
      ASSERT_NE(import, nullptr);
      ASSERT_EQ(in_place(pad, frame, *import), copied(image)) << "round " << round;
    }
    pages.reset();
    ASSERT_EQ(unmapped, round) << "an import keeps no pages mapped";
    pages = map_pages(2 * kPage, address, &unmapped);
    ASSERT_EQ(pages->begin(), address);
  }
}

// The camera's thread lets go of its buffers while the engine's ends, or goes on to other pages.
TEST_F(PadTest, PagesAndTheirReaderMayGoAtTheSameTime) {
  const FrameFormat format{40, 30, 1, 8};
  const Frame image = uniform_frame(format, 7);
  std::atomic<int> unmapped = 0;
  constexpr int kRounds = 100;
  for (int round = 0; round < kRounds; ++round) {
    auto pad = std::make_unique<ImportPages>(context(), format);
    auto pages = map_pages(kPage, nullptr, &unmapped);
    pad->find(lease(image, pages, 0));
    const auto next = map_pages(kPage);
    std::thread camera([held = std::move(pages)]() mutable { held.reset(); });
    if (round % 2) {
      EXPECT_NE(pad->find(lease(image, next, 0)), nullptr);
    }
    pad.reset();
    camera.join();
  }
  EXPECT_EQ(unmapped, kRounds);
}

/// A pressed pad, its frames in memory of their own or leased.
class LeasedFrames : public PadTest {
 protected:
  explicit LeasedFrames(const std::string& scene = "synthetic:press?size=161x120&mode=gel")
      : options_(parse_synthetic(scene)),
        source_(options_),
        sensor_(synthetic_sensor(options_)),
        background_(*source_.own_background()) {}

  Frame image(uint64_t k) {
    Frame frame;
    if (!source_.render(k, frame)) throw std::runtime_error("past the end");
    return frame;
  }
  Pipeline pipeline(PipelineOptions options) {
    Pipeline made(context(), sensor_, source_.format(), options);
    made.set_background(background_);
    return made;
  }
  size_t frame_bytes() const { return source_.format().frame_bytes(); }

  SyntheticOptions options_;
  SyntheticSensor source_;
  Sensor sensor_;
  Frame background_;
};

TEST_F(LeasedFrames, AreMeasuredLikeCopies) {
  PipelineOptions options;
  options.slots = 1;
  options.upload = Upload::Copy;
  Pipeline copying = pipeline(options);
  options.upload = Upload::Import;
  Pipeline importing = pipeline(options);
  std::array<std::shared_ptr<MappedPages>, 3> ring;
  for (auto& pages : ring) pages = map_pages(frame_bytes() + kPage);
  for (uint64_t k = 0; k < 30; ++k) {
    const Frame plain = image(k);
    const Frame leased = lease(plain, ring[k % ring.size()], 33 * (k % 4));
    ASSERT_TRUE(copying.submit(plain) && importing.submit(leased));
    const Result a = *copying.wait(), b = *importing.wait();
    EXPECT_EQ(a.copies, 1u);
    EXPECT_EQ(b.copies, 0u);
    EXPECT_EQ(a.touch.gray_sum, b.touch.gray_sum);
    EXPECT_EQ(a.touch.force_N.value, b.touch.force_N.value);
    EXPECT_EQ(depth_map(a), depth_map(b)) << "frame " << k;
    EXPECT_EQ(PipelineAccess::times(importing, b).front().name, "upload");
  }
  // Frames that are not leased go the other way, in between too.
  const Frame plain = image(3);
  ASSERT_TRUE(importing.submit(plain));
  const Result result = *importing.wait();
  EXPECT_EQ(result.copies, 1u);
}

TEST_F(LeasedFrames, AreGivenBackWhenTheyAreFinishedAndNotEarlier) {
  PipelineOptions options;
  options.slots = 3;
  options.upload = Upload::Import;
  std::atomic<int> returned = 0;
  std::vector<std::shared_ptr<MappedPages>> ring;
  for (int i = 0; i < 4; ++i) ring.push_back(map_pages(frame_bytes()));
  {
    Pipeline importing = pipeline(options);
    for (size_t i = 0; i < 3; ++i) ASSERT_TRUE(importing.submit(lease(image(i), ring[i], 0, &returned)));
    EXPECT_EQ(returned, 0) << "three frames are in flight";
    {
      const Frame fourth = lease(image(3), ring[3], 0, &returned);
      EXPECT_FALSE(importing.submit(fourth)) << "no free slot";
    }
    EXPECT_EQ(returned, 1) << "what is refused is not kept";
    for (int i = 1; i <= 2; ++i) {
      const Result result = *importing.wait();
      EXPECT_EQ(returned, 1 + i) << "back before its result is released";
    }
    EXPECT_EQ(ring[2].use_count(), 2) << "the frame in flight holds its pages";
  }
  EXPECT_EQ(returned, 4) << "a pipeline that ends gives back what it had in flight";
  for (const auto& pages : ring) EXPECT_EQ(pages.use_count(), 1);
}

TEST_F(LeasedFrames, ThatAreCopiedAreNotKept) {
  PipelineOptions options;
  options.upload = Upload::Copy;
  Pipeline copying = pipeline(options);
  std::atomic<int> returned = 0;
  const auto pages = map_pages(frame_bytes());
  ASSERT_TRUE(copying.submit(lease(image(0), pages, 0, &returned)));
  EXPECT_EQ(returned, 1) << "in flight, and its buffer is the driver's again";
  EXPECT_EQ(pages.use_count(), 1);
  const Result result = *copying.wait();
  EXPECT_EQ(result.copies, 1u);
}

// The source's memory may be written as soon as the lease is back: nothing of the next frame shows in the
// last.
TEST_F(LeasedFrames, ReuseOfABufferHarmsNoFrame) {
  PipelineOptions options;
  options.upload = Upload::Import;
  Pipeline importing = pipeline(options);
  options.upload = Upload::Copy;
  Pipeline copying = pipeline(options);
  const auto pages = map_pages(frame_bytes());
  for (uint64_t k = 0; k < 20; ++k) {
    const Frame plain = image(k);
    std::atomic<int> returned = 0;
    ASSERT_TRUE(importing.submit(lease(plain, pages, 0, &returned)));
    std::optional<Result> result;
    while (!(result = importing.poll())) EXPECT_EQ(returned, 0);
    EXPECT_EQ(returned, 1);
    std::memset(const_cast<uint8_t*>(pages->begin()), 255, pages->bytes());
    const std::vector<float> depth = depth_map(*result);
    ASSERT_TRUE(copying.submit(plain));
    const Result wanted = *copying.wait();
    EXPECT_EQ(depth, depth_map(wanted));
  }
}

}  // namespace
}  // namespace palpate
