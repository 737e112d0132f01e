#include "capture/live/mailbox.h"

#include <gtest/gtest.h>

#include <atomic>
#include <memory>
#include <thread>

namespace palpate {
namespace {

using namespace std::chrono_literals;

TEST(Mailbox, NewestWinsAndTheDisplacedComesBack) {
  Mailbox<int> box;
  EXPECT_FALSE(box.put(1).has_value());
  EXPECT_EQ(box.put(2), 1);
  EXPECT_EQ(box.put(3), 2);
  EXPECT_EQ(box.take(0us), 3);
  EXPECT_EQ(box.take(0us), std::nullopt);
  EXPECT_EQ(box.displaced(), 2u);
}

TEST(Mailbox, TakesWhatWasThereBeforeClosing) {
  Mailbox<std::unique_ptr<int>> box;
  box.put(std::make_unique<int>(7));
  box.close();
  EXPECT_FALSE(box.finished());
  const auto late = box.put(std::make_unique<int>(8));
  ASSERT_TRUE(late.has_value()) << "an item put after closing must come back to its owner";
  EXPECT_EQ(**late, 8);
  const auto item = box.take(0us);
  ASSERT_TRUE(item.has_value());
  EXPECT_EQ(**item, 7);
  EXPECT_TRUE(box.finished());
  EXPECT_EQ(box.displaced(), 0u);
}

TEST(Mailbox, ClosingWakesAWaitingTaker) {
  Mailbox<int> box;
  std::atomic<bool> woke{false};
  std::thread taker([&] {
    EXPECT_EQ(box.take(std::chrono::minutes(10)), std::nullopt);
    woke = true;
  });
  std::this_thread::sleep_for(20ms);
  EXPECT_FALSE(woke);
  box.close();
  taker.join();
  EXPECT_TRUE(woke);
}

TEST(Mailbox, EveryItemIsTakenOrDisplacedExactlyOnce) {
  constexpr int kItems = 20000;
  Mailbox<int> box;
  int64_t displaced_sum = 0, taken_sum = 0;
  uint64_t displaced = 0, taken = 0;
  std::thread giver([&] {
    for (int i = 1; i <= kItems; ++i) {
      if (const auto old = box.put(i)) {
        displaced_sum += *old;
        ++displaced;
      }
      if (i % 16 == 0) std::this_thread::yield();
    }
    box.close();
  });
  int last = 0;
  while (!box.finished()) {
    if (const auto item = box.take(1ms)) {
      EXPECT_GT(*item, last) << "items must come in order";
      last = *item;
      taken_sum += *item;
      ++taken;
    }
  }
  giver.join();
  EXPECT_EQ(displaced, box.displaced());
  EXPECT_EQ(displaced + taken, static_cast<uint64_t>(kItems));
  EXPECT_EQ(displaced_sum + taken_sum, int64_t{kItems} * (kItems + 1) / 2);
  EXPECT_EQ(last, kItems) << "the newest item is never lost";
}

}  // namespace
}  // namespace palpate
