// Ranges of frames as text, and the search for a frame in a recording that has lost some.
#include "capture/files/frame_range.h"

#include <gtest/gtest.h>

#include "palpate/error.h"

namespace palpate {
namespace {

TEST(FrameRange, IsReadAsPythonReadsSlices) {
  EXPECT_EQ(parse_frame_range("10:50:2"), (FrameRange{10, 50, 2}));
  EXPECT_EQ(parse_frame_range("10:50"), (FrameRange{10, 50, 1}));
  EXPECT_EQ(parse_frame_range("10:"), (FrameRange{10, UINT64_MAX, 1}));
  EXPECT_EQ(parse_frame_range(":50"), (FrameRange{0, 50, 1}));
  EXPECT_EQ(parse_frame_range("::3"), (FrameRange{0, UINT64_MAX, 3}));
  EXPECT_EQ(parse_frame_range(":"), FrameRange{});
  EXPECT_EQ(parse_frame_range("7"), (FrameRange{7, 8, 1}));
  for (const char* text : {"10:50:2", "10:50", "10:", "0:50", "0::3"})
    EXPECT_EQ(to_string(parse_frame_range(text)), text);
  EXPECT_EQ(to_string(FrameRange{}), "");
  for (const char* text : {"", "a", "1:b", "5:5", "6:5", "0:9:0", "1:2:3:4", "-1:3", " 1:2", "1 :2", "+1:2",
                           "18446744073709551615", "18446744073709551616:", "0x10:20", "1.5:2"}) {
    try {
      parse_frame_range(text);
      ADD_FAILURE() << "'" << text << "' is read";
    } catch (const Error& error) {
      EXPECT_EQ(error.failure(), Failure::Usage) << text;
    }
  }
}

TEST(FrameRange, HoldsFirstButNotEnd) {
  const FrameRange range{10, 20, 4};
  std::vector<uint64_t> held;
  for (uint64_t k = 0; k < 40; ++k)
    if (range.contains(k)) held.push_back(k);
  EXPECT_EQ(held, (std::vector<uint64_t>{10, 14, 18}));
}

/// Frames of these numbers; jumps by index, as a session does.
class Numbered : public Source {
 public:
  explicit Numbered(std::vector<uint64_t> numbers) : numbers_(std::move(numbers)) {}
  FrameFormat format() const override { return {}; }
  double rate_Hz() const override { return 0; }
  std::optional<uint64_t> frame_count() const override { return numbers_.size(); }
  bool next(Frame& frame) override {
    if (at_ >= numbers_.size()) return false;
    frame.sequence = numbers_[at_++];
    return true;
  }
  bool seek(uint64_t index) override {
    if (index >= numbers_.size()) return false;
    at_ = index;
    return true;
  }

 private:
  std::vector<uint64_t> numbers_;
  size_t at_ = 0;
};

TEST(FrameRange, TheFirstFrameFromANumberOnIsFound) {
  const std::vector<uint64_t> numbers = {500, 501, 502, 507, 508, 600, 601, 602, 650};
  for (uint64_t wanted = 490; wanted <= 650; ++wanted) {
    Numbered source(numbers);
    ASSERT_TRUE(seek_frame(source, wanted));
    Frame frame;
    ASSERT_TRUE(source.next(frame));
    EXPECT_EQ(frame.sequence, *std::lower_bound(numbers.begin(), numbers.end(), wanted)) << wanted;
  }
  Numbered none({});
  EXPECT_FALSE(seek_frame(none, 3));
  Numbered past({1, 2, 3});
  ASSERT_TRUE(seek_frame(past, 10));
  Frame frame;
  ASSERT_TRUE(past.next(frame));
  EXPECT_EQ(frame.sequence, 3u) << "the last one: none is so late";
}

}  // namespace
}  // namespace palpate
