#include "capture/camera/camera_log.h"

#include <spdlog/spdlog.h>

#include "engine/base/clock.h"
#include "engine/base/text.h"

namespace palpate {

void CameraLog::say(const std::string& words) {
  const std::lock_guard lock(mutex_);
  state_ = words;
}

void CameraLog::interrupt(const std::string& words) {
  away_ = true;
  say(words);
}

void CameraLog::set_facts(std::vector<std::pair<std::string, std::string>> facts) {
  const std::lock_guard lock(mutex_);
  facts_ = std::move(facts);
}

void CameraLog::stamp(uint32_t number, int64_t stamp_ns, bool monotonic, int64_t delivered_ns, double rate_Hz,
                      Frame& frame) {
  frame.after_gap = away_;
  if (away_) counter_.restart(static_cast<double>(delivered_ns - delivered_ns_) * 1e-9, rate_Hz);
  const auto [sequence, lost] = counter_.next(number);
  const auto [time_ns, exposed_ns] = clock_.next(stamp_ns, monotonic, delivered_ns);
  frame.sequence = sequence;
  frame.time_ns = time_ns;
  frame.exposed_ns = exposed_ns;
  frame.delivered_ns = sign_ns_ = delivered_ns_ = delivered_ns;
  ++frames_;
  warn(rate_.add(sequence, time_ns));
  const std::lock_guard lock(mutex_);
  counts_.lost += lost;
  if (away_ && frames_ > 1) ++counts_.gaps;
  state_.clear();
  away_ = false;
}

void CameraLog::note_damage(uint32_t number, const std::string& what) {
  damage_ = what;
  const uint64_t lost = away_ ? 0 : counter_.next(number).lost;
  const std::lock_guard lock(mutex_);
  counts_.lost += lost;
  ++counts_.damaged;
}

void CameraLog::note_pixels(bool leased) {
  const std::lock_guard lock(mutex_);
  ++(leased ? leased_ : copied_);
}

void CameraLog::note_start() {
  sign_ns_ = monotonic_ns();
}

void CameraLog::note_promise(double rate_Hz, double exposure_s) {
  rate_.restart(rate_Hz);
  warn(exposure_warning(exposure_s, rate_Hz));
}

// A camera that comes back says what it said before.
void CameraLog::warn(const std::string& words) {
  if (words.empty()) return;
  const std::lock_guard lock(mutex_);
  if (warning_.find(words) != std::string::npos) return;
  spdlog::warn("{}", words);
  warning_ += (warning_.empty() ? "" : "; ") + words;
}

std::string CameraLog::warning() const {
  const std::lock_guard lock(mutex_);
  return warning_;
}

bool CameraLog::silent(int64_t timeout_ns) const {
  return monotonic_ns() - sign_ns_ > timeout_ns;
}

std::string CameraLog::words_of_silence(int64_t timeout_ns) {
  const std::string silence = text(" for %.4g s", static_cast<double>(timeout_ns) * 1e-9);
  std::string words =
      damage_.empty() ? "no frame" + silence : "no whole frame" + silence + " (" + damage_ + ")";
  damage_.clear();
  return words;
}

CaptureCounts CameraLog::counts() const {
  const std::lock_guard lock(mutex_);
  return counts_;
}

std::string CameraLog::state() const {
  const std::lock_guard lock(mutex_);
  return state_;
}

std::vector<std::pair<std::string, std::string>> CameraLog::details(const std::string& clock,
                                                                    const std::string& copies) const {
  const std::lock_guard lock(mutex_);
  auto list = facts_;
  if (!warning_.empty()) list.emplace_back("warning", warning_);
  list.emplace_back("clock", clock);
  list.emplace_back("copies per frame", copies);
  if (leased_ > 0 && copied_ > 0)
    list.emplace_back("copied frames", std::to_string(copied_) + " of " + std::to_string(copied_ + leased_) +
                                           ", since too many buffers were out");
  return list;
}

}  // namespace palpate
