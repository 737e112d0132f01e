#include "engine/pipeline/specks.h"

#include <algorithm>
#include <cmath>

#include "shaders/shared/confidence.h"

namespace palpate {

Specks::Specks(const FrameFormat& format, std::optional<uint32_t> dead_gray)
    : format_(format), dead_gray_(dead_gray) {}

const Frame& Specks::set_background(const Frame& background) {
  find(background);
  if (specks_.empty()) return background;
  fill_into(background, background_);
  return background_;
}

const Frame& Specks::fill(const Frame& frame) {
  if (specks_.empty()) return frame;
  fill_into(frame, filled_);
  return filled_;
}

void Specks::find(const Frame& background) {
  const uint32_t width = format_.width, height = format_.height;
  std::vector<uint8_t> masked = flaws_;
  masked.resize(size_t{width} * height);
  bool any = !flaws_.empty();
  const uint32_t reach_px = flaws_.empty() ? kReach_px : std::max(kReach_px, width / 20);
  for (uint32_t y = 0; dead_gray_ && y < height; ++y)
    for (uint32_t x = 0; x < width; ++x) {
      uint32_t gray = 0;
      for (uint32_t c = 0; c < format_.channels; ++c) gray = std::max(gray, background.at(c, x, y));
      if (gray < *dead_gray_) continue;
      any = true;
      for (uint32_t v = y - std::min(y, 1u); v <= std::min(y + 1, height - 1); ++v)
        for (uint32_t u = x - std::min(x, 1u); u <= std::min(x + 1, width - 1); ++u)
          masked[size_t{v} * width + u] = 1;
    }
  specks_.clear();
  confidence_.reset();
  if (!any) return;
  auto confidence = std::make_shared<std::vector<uint16_t>>(masked.size(), uint16_t{shared::kFullConfidence});
  for (uint32_t i = 0; i < masked.size(); ++i) {
    if (masked[i] == 0) continue;
    const bool flaw = !flaws_.empty() && flaws_[i] != 0;
    (*confidence)[i] =
        static_cast<uint16_t>((flaw ? shared::kCovered : shared::kSaturated) << shared::kReasonShift);
    const uint32_t x = i % width, y = i / width;
    const uint32_t room[4] = {x, width - 1 - x, y, height - 1 - y};
    const int64_t step[4] = {-1, 1, -int64_t{width}, int64_t{width}};
    Speck speck{i, {i, i, i, i}, {}};
    float sum = 0;
    for (size_t way = 0; way < 4; ++way)
      for (uint32_t far = 1; far <= std::min(reach_px, room[way]); ++far) {
        const auto from = static_cast<uint32_t>(int64_t{i} + step[way] * far);
        if (masked[from] != 0) continue;
        speck.from[way] = from;
        sum += speck.weight[way] = 1 / static_cast<float>(far);
        break;
      }
    for (float& weight : speck.weight) weight /= std::max(sum, 1e-6f);
    if (sum > 0) specks_.push_back(speck);
  }
  confidence_ = std::move(confidence);
}

void Specks::fill_into(const Frame& frame, Frame& filled) const {
  if (filled.format != format_) filled.reshape(format_);
  std::copy_n(frame.pixels(), format_.frame_bytes(), filled.bytes.begin());
  const size_t plane = size_t{format_.width} * format_.height;
  for (uint32_t c = 0; c < format_.channels; ++c) {
    uint8_t* pixels = filled.bytes.data() + c * plane;
    for (const Speck& speck : specks_) {
      float value = 0;
      for (size_t way = 0; way < 4; ++way)
        value += speck.weight[way] * static_cast<float>(pixels[speck.from[way]]);
      pixels[speck.pixel] = static_cast<uint8_t>(std::lround(value));
    }
  }
}

}  // namespace palpate
