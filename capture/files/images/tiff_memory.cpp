#include "capture/files/images/tiff_memory.h"

#include <algorithm>
#include <cstring>

namespace palpate {
namespace {

int close_nothing(thandle_t) {
  return 0;
}

/// libtiff's own lines on stderr say nothing that our errors do not.
void silence() {
  TIFFSetErrorHandler(nullptr);
  TIFFSetWarningHandler(nullptr);
}

}  // namespace

tmsize_t TiffMemory::read(thandle_t self, void* to, tmsize_t count) {
  auto& memory = *static_cast<TiffMemory*>(self);
  const std::span<const uint8_t> all = memory.there_.empty() ? std::span(memory.written_) : memory.there_;
  const size_t left = all.size() - std::min(memory.place_, all.size());
  const size_t taken = std::min(left, static_cast<size_t>(count));
  if (taken) std::memcpy(to, all.data() + memory.place_, taken);
  memory.place_ += taken;
  return static_cast<tmsize_t>(taken);
}

tmsize_t TiffMemory::write(thandle_t self, void* from, tmsize_t count) {
  auto& memory = *static_cast<TiffMemory*>(self);
  const size_t end = memory.place_ + static_cast<size_t>(count);
  if (end > memory.written_.size()) memory.written_.resize(end);
  std::memcpy(memory.written_.data() + memory.place_, from, static_cast<size_t>(count));
  memory.place_ = end;
  return count;
}

toff_t TiffMemory::seek(thandle_t self, toff_t offset, int whence) {
  auto& memory = *static_cast<TiffMemory*>(self);
  const size_t base = whence == SEEK_SET ? 0 : whence == SEEK_CUR ? memory.place_ : size(self);
  return memory.place_ = base + offset;
}

toff_t TiffMemory::size(thandle_t self) {
  const auto& memory = *static_cast<TiffMemory*>(self);
  return memory.there_.empty() ? memory.written_.size() : memory.there_.size();
}

TiffPtr TiffMemory::create() {
  silence();
  written_.clear();
  there_ = {};
  place_ = 0;
  return TiffPtr(
      TIFFClientOpen("image", "wl", this, read, write, seek, close_nothing, size, nullptr, nullptr));
}

TiffPtr TiffMemory::open(std::span<const uint8_t> bytes) {
  silence();
  there_ = bytes;
  place_ = 0;
  return TiffPtr(
      TIFFClientOpen("image", "rm", this, read, write, seek, close_nothing, size, nullptr, nullptr));
}

}  // namespace palpate
