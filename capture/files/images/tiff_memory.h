// TIFF file in memory, so that the file on the disk appears only when complete.
#pragma once

#include <tiffio.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace palpate {

struct CloseTiff {
  void operator()(TIFF* tiff) const { TIFFClose(tiff); }
};
using TiffPtr = std::unique_ptr<TIFF, CloseTiff>;

class TiffMemory {
 public:
  /// A new file, little endian, whose bytes are here once it is closed or flushed. Null where libtiff
  /// refuses.
  TiffPtr create();
  /// Reads `bytes`, which must live longer. Null where they are no TIFF.
  TiffPtr open(std::span<const uint8_t> bytes);
  std::vector<uint8_t> take() { return std::move(written_); }

 private:
  static tmsize_t read(thandle_t self, void* to, tmsize_t count);
  static tmsize_t write(thandle_t self, void* from, tmsize_t count);
  static toff_t seek(thandle_t self, toff_t offset, int whence);
  static toff_t size(thandle_t self);

  std::vector<uint8_t> written_;
  std::span<const uint8_t> there_;
  size_t place_ = 0;
};

}  // namespace palpate
