#include "viz/live/rate.h"

namespace palpate::viz {

double Rate::update(uint64_t count, std::chrono::steady_clock::time_point now) {
  const auto span_s = [&] { return std::chrono::duration<double>(now - marks_.front().at).count(); };
  marks_.push_back({now, count});
  while (marks_.size() > 2 && span_s() > 2) marks_.pop_front();
  return span_s() > 0.2 ? static_cast<double>(count - marks_.front().count) / span_s() : 0;
}

}  // namespace palpate::viz
