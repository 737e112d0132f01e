#include "capture/files/frame_range.h"

#include <algorithm>
#include <charconv>
#include <optional>
#include <vector>

#include "palpate/error.h"

namespace palpate {

FrameRange parse_frame_range(const std::string& text) {
  const auto refuse = [&](const char* found) {
    return Error(Failure::Usage, "frames as FIRST:END:STEP", "'" + text + "', " + found,
                 "10:50 for frames 10 to 49, 10:50:2 for every other of them, or 7 for one");
  };
  std::vector<std::optional<uint64_t>> parts(1);
  const char* at = text.data();
  const char* const end = at + text.size();
  while (at != end) {
    if (*at == ':') {
      parts.emplace_back();
      ++at;
      continue;
    }
    uint64_t value = 0;
    const auto [rest, code] = std::from_chars(at, end, value);
    if (code != std::errc() || (rest != end && *rest != ':'))
      throw refuse("which is not made of whole numbers");
    parts.back() = value;
    at = rest;
  }
  if (parts.size() > 3 || text.empty()) throw refuse("which is none");
  FrameRange range;
  range.first = parts[0].value_or(range.first);
  range.end = parts.size() == 1 ? range.first + 1 : parts[1].value_or(range.end);
  if (parts.size() == 3) range.step = parts[2].value_or(range.step);
  if (range.step == 0) throw refuse("a step of 0");
  if (range.first >= range.end) throw refuse("which holds no frame");
  return range;
}

std::string to_string(const FrameRange& range) {
  if (range == FrameRange{}) return "";
  std::string text = std::to_string(range.first) + ":";
  if (range.end != UINT64_MAX) text += std::to_string(range.end);
  if (range.step != 1) text += ":" + std::to_string(range.step);
  return text;
}

bool seek_frame(Source& source, uint64_t sequence) {
  const std::optional<uint64_t> count = source.frame_count();
  if (!count || !source.seek(0)) return false;
  Frame frame;
  if (source.seek(sequence) && source.next(frame) && frame.sequence == sequence)
    return source.seek(sequence);  // no frame before it is missing
  // The first index whose frame has that number or a later one.
  uint64_t low = 0, high = *count;
  while (low < high) {
    const uint64_t middle = low + (high - low) / 2;
    if (source.seek(middle) && source.next(frame) && frame.sequence < sequence)
      low = middle + 1;
    else
      high = middle;
  }
  if (!source.seek(std::min(low, *count - 1))) source.seek(0);
  return true;
}

}  // namespace palpate
