// Padding of a frame that lies in memory of the host: where its rows are and where they go.
#ifndef PALPATE_SHARED_PAD_H
#define PALPATE_SHARED_PAD_H

#ifdef __cplusplus
#include <cstdint>
namespace palpate::shared {
using uint = uint32_t;
#endif

struct PadPush {
  uint offset;       // bytes from the buffer's beginning to the first pixel
  uint row_bytes;    // of a row's pixels, which follow each other without a gap
  uint rows;         // of all planes
  uint pitch;        // texels of 16 bytes from one padded row to the next
  uint pixel_bytes;  // 1 or 2
};

#ifdef __cplusplus
}  // namespace palpate::shared
#endif
#endif
