#include "capture/serve/hub.h"

#include <stdexcept>
#include <utility>

namespace palpate {
namespace {

constexpr size_t kMostTopics = 64;

MessageBytes bytes_of(const std::string& text) {
  return {text.begin(), text.end()};
}

}  // namespace

size_t LiveHub::kept_of(TopicKind kind) {
  return is_picture(kind) ? 1 : kind == TopicKind::Events ? 1000 : 120;
}

LiveHub::LiveHub(std::vector<Publisher> publishers)
    : publishers_(std::move(publishers)), wall_(wall_clock()) {
  for (size_t i = 0; i < publishers_.size(); ++i) {
    const Publisher& p = publishers_[i];
    for (Topic& topic : topics_of(p.sensor, p.outputs, p.columns, p.side)) {
      topics_.push_back(std::move(topic));
      publisher_of_.push_back(i);
    }
  }
  if (publishers_.size() > 1) {
    topics_.push_back(grip_topic());
    publisher_of_.push_back(publishers_.size());
  }
  if (topics_.size() > kMostTopics) throw std::logic_error("more topics than can be served");
  kept_.resize(topics_.size());
  passed_ = std::make_unique<std::atomic<uint64_t>[]>(topics_.size());
}

int64_t LiveHub::date_of(int64_t host_ns) const {
  return (host_ns != 0 ? host_ns : monotonic_ns()) + wall_.ahead_ns;
}

void LiveHub::publish(size_t publisher, const Frame& frame, const Result& result, const Touch& touch,
                      bool zeroed) {
  const Publisher& p = publishers_[publisher];
  const bool measured = touch.surface && touch.picture == PictureFault::None;
  const uint64_t wanted = wanted_.load(std::memory_order_relaxed);
  std::optional<MessageHeader> header;  // of all messages of this frame
  for (size_t topic = 0; topic < topics_.size(); ++topic) {
    const TopicKind kind = topics_[topic].kind;
    if (publisher_of_[topic] != publisher || kind == TopicKind::Events) continue;
    const bool surface = kind == TopicKind::Depth || kind == TopicKind::Preview || kind == TopicKind::Cloud;
    if (surface && !measured) continue;
    if (is_picture(kind)) ++passed_[topic];
    if ((wanted >> topic & 1) == 0) continue;
    if (!header)
      header = MessageHeader{date_of(frame.exposed_ns != 0 ? frame.exposed_ns : frame.delivered_ns),
                             topic_name(p.sensor.name)};
    MessageBytes bytes;
    switch (kind) {
      case TopicKind::Image:
        write_image(bytes, *header, frame);
        break;
      case TopicKind::Compressed:
        write_compressed(bytes, *header, frame);
        break;
      case TopicKind::Depth:
      case TopicKind::Preview:
      case TopicKind::Cloud: {
        const auto write = kind == TopicKind::Depth     ? write_depth_image
                           : kind == TopicKind::Preview ? write_depth_preview
                                                        : write_cloud;
        write(bytes, *header, *depth_map_of(result, touch, frame.format, p.sensor.pitch_mm_per_px));
        break;
      }
      case TopicKind::Wrench: {
        const std::optional<MessageWrench> wrench = wrench_of(touch);
        if (!wrench) continue;
        write_wrench(bytes, *header, *wrench);
        break;
      }
      case TopicKind::Touch:
        bytes = bytes_of(touch_json(touch, p.columns, header->time_ns, zeroed));
        break;
      case TopicKind::Events:
      case TopicKind::Grip:
        continue;
    }
    put(topic, is_picture(kind) ? passed(topic) : ++passed_[topic], header->time_ns, std::move(bytes));
  }
  if (header && news_) news_();
}

void LiveHub::publish_event(size_t publisher, const EventMessage& event) {
  const int64_t now_ns = monotonic_ns() + wall_.ahead_ns;
  for (size_t topic = 0; topic < topics_.size(); ++topic)
    if (publisher_of_[topic] == publisher && topics_[topic].kind == TopicKind::Events)
      put(topic, ++passed_[topic], now_ns, bytes_of(event_json(event, now_ns)));
  if (news_) news_();
}

void LiveHub::publish_grip(const GripFrame& frame, int64_t host_ns, bool zeroed) {
  const size_t topic = topics_.size() - 1;
  if ((wanted_.load(std::memory_order_relaxed) >> topic & 1) == 0) return;
  const int64_t time_ns = date_of(host_ns);
  put(topic, ++passed_[topic], time_ns, bytes_of(grip_json(frame, time_ns, zeroed)));
  if (news_) news_();
}

void LiveHub::put(size_t topic, uint64_t number, int64_t time_ns, MessageBytes bytes) {
  LiveMessagePtr old;  // its memory goes back without the lock
  const std::lock_guard lock(mutex_);
  std::deque<LiveMessagePtr>& kept = kept_[topic];
  kept.push_back(std::make_shared<LiveMessage>(LiveMessage{number, time_ns, std::move(bytes)}));
  if (kept.size() <= kept_of(topics_[topic].kind)) return;
  old = std::move(kept.front());
  kept.pop_front();
}

LiveMessagePtr LiveHub::next(size_t topic, uint64_t after) const {
  const std::lock_guard lock(mutex_);
  for (const LiveMessagePtr& message : kept_[topic])
    if (message->number > after) return message;
  return nullptr;
}

uint64_t LiveHub::newest(size_t topic) const {
  const std::lock_guard lock(mutex_);
  return kept_[topic].empty() ? 0 : kept_[topic].back()->number;
}

}  // namespace palpate
