// Which of a frame's places lie on the pad, as far as its outline says; without one all do.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "palpate/frame.h"
#include "palpate/outline.h"

namespace palpate {

/// From `from` to before `to`.
struct PadRun {
  uint32_t from = 0, to = 0;
  uint32_t length() const { return to - from; }
};

/// A part is `part` px of a row, a band is `band_rows` rows; what would go beyond the frame is left out.
struct PadPlaces {
  PadPlaces(const FrameFormat& format, const std::optional<PadOutline>& pad, uint32_t part, uint32_t bands,
            uint32_t band_rows);

  /// Whether all pixels of part `i` in rows `y` to `y` + `rows` are pad.
  bool has(uint32_t i, uint32_t y, uint32_t rows) const;

  uint32_t parts;
  std::vector<bool> in;              ///< row, part: all its pixels are pad
  std::vector<PadRun> parts_of_row;  ///< longest stretch of parts
  std::vector<PadRun> rows_of_part;  ///< longest stretch of rows
  std::vector<PadRun> columns;       ///< of each band: longest stretch of columns that are pad all down it
};

}  // namespace palpate
