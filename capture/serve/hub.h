// The newest messages of each topic, between the thread that measures or shows and the one that serves.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "capture/messages/ros_messages.h"
#include "capture/messages/topics.h"
#include "capture/messages/touch_json.h"
#include "engine/base/clock.h"
#include "palpate/pipeline.h"

namespace palpate {

/// One message for all clients that want it; it does not change.
struct LiveMessage {
  /// Of its topic, from 1; pictures count those too that were not made since nobody was ready.
  uint64_t number = 0;
  int64_t time_ns = 0;  ///< of exposure, CLOCK_REALTIME
  MessageBytes bytes;
};
using LiveMessagePtr = std::shared_ptr<const LiveMessage>;

/// Topics of one sensor or two. Nothing is made that nobody has asked for: where no client is ready for a
/// topic, publish() costs the reading of one number.
class LiveHub {
 public:
  /// How many messages of a topic wait for a client that reads slowly: pictures one, since only the newest
  /// counts; numbers a second's worth and more.
  static size_t kept_of(TopicKind kind);

  struct Publisher {
    Sensor sensor;
    Outputs outputs;
    MeasuredColumns columns;
    std::string side;  ///< "left" or "right"; empty: the only one
  };
  /// Of two publishers, with the grip's topic behind theirs; of one without.
  explicit LiveHub(std::vector<Publisher> publishers);

  const std::vector<Topic>& topics() const { return topics_; }

  /// Makes the messages that clients are ready for. `touch`: to be sent, which may differ from the result's
  /// by a zero. Threads: one for each publisher.
  void publish(size_t publisher, const Frame& frame, const Result& result, const Touch& touch,
               bool zeroed = false);
  void publish_event(size_t publisher, const EventMessage& event);
  /// `host_ns`: of exposure, CLOCK_MONOTONIC; 0: now. One thread at a time.
  void publish_grip(const GripFrame& frame, int64_t host_ns, bool zeroed = false);

  // For the server's thread.
  /// Called after each publication that may interest a client, from the publisher's thread. Before the first.
  void on_news(std::function<void()> news) { news_ = std::move(news); }
  /// Topics that a client is ready for, one bit each.
  void want(uint64_t topics) { wanted_.store(topics, std::memory_order_relaxed); }
  /// The oldest message of a topic that is newer than `after`; null: none.
  LiveMessagePtr next(size_t topic, uint64_t after) const;
  /// Number of the newest one that was made; 0: none yet.
  uint64_t newest(size_t topic) const;
  /// How many there were or could have been.
  uint64_t passed(size_t topic) const { return passed_[topic].load(std::memory_order_relaxed); }

 private:
  void put(size_t topic, uint64_t number, int64_t time_ns, MessageBytes bytes);
  int64_t date_of(int64_t host_ns) const;

  std::vector<Publisher> publishers_;
  std::vector<Topic> topics_;
  std::vector<size_t> publisher_of_;  ///< of each topic; of the grip's none of them
  WallClock wall_;
  std::function<void()> news_;
  std::atomic<uint64_t> wanted_{0};
  mutable std::mutex mutex_;
  std::vector<std::deque<LiveMessagePtr>> kept_;
  std::unique_ptr<std::atomic<uint64_t>[]> passed_;
};

}  // namespace palpate
