#include "capture/calibrate/photometric/frame_kinds.h"

#include <algorithm>
#include <cmath>

#include "engine/base/statistics.h"

namespace palpate {
namespace {

constexpr uint32_t kSide = 8;  // px
constexpr double kOverNoise = 8;
constexpr double kLeastLimit = 0.02;   // of full scale
constexpr double kMostUnlike = 0.004;  // fraction of means that may differ within one kind of frame
constexpr float kMostOver = 3;         // times that limit: no place may differ by more
constexpr double kLeastShare = 0.02;   // of all frames: a kind that is rarer is none
constexpr size_t kLeastFrames = 3;

}  // namespace

void FrameKinds::add(const Frame& frame) {
  const FrameFormat& f = frame.format;
  full_scale_ = f.max_gray();
  const uint32_t columns = f.width / kSide, rows = f.height / kSide;
  std::vector<float>& means = frames_.emplace_back();
  means.reserve(size_t{columns} * rows * f.channels);
  for (uint32_t c = 0; c < f.channels; ++c)
    for (uint32_t y = 0; y < rows; ++y)
      for (uint32_t x = 0; x < columns; ++x) {
        uint64_t sum = 0;
        for (uint32_t v = 0; v < kSide; ++v)
          for (uint32_t u = 0; u < kSide; ++u) sum += frame.at(c, x * kSide + u, y * kSide + v);
        means.push_back(static_cast<float>(sum) / (kSide * kSide));
      }
}

float FrameKinds::limit() const {
  // From one frame to the next most places know nothing of a touch.
  std::vector<float> steps;
  for (size_t i = 1; i < frames_.size(); ++i)
    for (size_t c = 0; c < frames_[i].size(); c += 7)
      steps.push_back(std::abs(frames_[i][c] - frames_[i - 1][c]));
  const double noise = steps.empty() ? 0 : double{median_in_place(steps)} / (0.6745 * std::sqrt(2.0));
  return static_cast<float>(std::max(kOverNoise * noise, kLeastLimit * full_scale_));
}

bool FrameKinds::alike(const std::vector<float>& a, const std::vector<float>& b, float limit) {
  std::vector<float> sample;
  for (size_t i = 0; i < a.size(); i += 5) sample.push_back(b[i] - a[i]);
  const float light = median_in_place(sample);
  const auto allowed = static_cast<size_t>(kMostUnlike * static_cast<double>(a.size()));
  size_t unlike = 0;
  for (size_t i = 0; i < a.size(); ++i) {
    const float difference = std::abs(b[i] - a[i] - light);
    unlike += difference > limit;
    if (unlike > allowed || difference > kMostOver * limit) return false;
  }
  return true;
}

std::vector<FrameKinds::Kind> FrameKinds::find() const {
  const float most = limit();
  const size_t n = frames_.size();
  std::vector<uint8_t> pairs(n * n);
  for (size_t i = 0; i < n; ++i)
    for (size_t j = i; j < n; ++j)
      pairs[i * n + j] = pairs[j * n + i] = i == j || alike(frames_[i], frames_[j], most);
  const size_t least =
      std::max(kLeastFrames, static_cast<size_t>(std::ceil(kLeastShare * static_cast<double>(n))));
  // The frame that most others are like takes them with it, then the next of those that are left.
  std::vector<uint8_t> free(n, 1);
  std::vector<Kind> kinds;
  while (true) {
    Kind largest;
    for (size_t i = 0; i < n; ++i) {
      if (!free[i]) continue;
      std::vector<size_t> members;
      for (size_t j = 0; j < n; ++j)
        if (free[j] && pairs[i * n + j]) members.push_back(j);
      if (members.size() > largest.members.size()) largest = {i, std::move(members)};
    }
    if (largest.members.size() < least) break;
    for (const size_t member : largest.members) free[member] = 0;
    kinds.push_back(std::move(largest));
  }
  std::ranges::sort(kinds, {}, [](const Kind& kind) { return kind.members.front(); });
  return kinds;
}

}  // namespace palpate
