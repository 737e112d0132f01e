// Lump estimates by the skin that lies on the blocks, and by the plate that presses them.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "engine/base/json.h"
#include "perf/lab/study/evaluation.h"

namespace palpate::lump {

/// Readings under skins of one thickness and ratio; of many different ones, those thinner or thicker than 2
/// mm and softer or stiffer than the tissue.
struct SkinRow {
  std::array<double, 2> skin_mm{}, ratio{};  ///< least and greatest; 0 and 1: no skin
  std::string plate;                         ///< "slides", "0.1" (its friction) or "sticks": one for all
  size_t lumps = 0, reported = 0;            ///< blocks with a lump; of them found, or their stiffness open
  size_t outside = 0, inconsistent = 0, no_lump = 0, other = 0;  ///< the rest, by verdict
  // Size, depth and ratio of those reported; NaN where there are none.
  std::array<double, 3> median{};  ///< of the relative errors' sizes
  std::array<double, 3> moved{};   ///< median of the relative errors themselves
  std::array<double, 3> held{};    ///< share of the intervals that hold the truth
  std::array<double, 3> width{};   ///< median of the intervals' upper over lower ends
  double young_moved = 0;          ///< median of the modulus' relative errors by the way; NaN: no way told
  size_t plain = 0, alarms = 0;    ///< blocks without a lump; of them with one reported
};

/// Without a skin first, then by thickness and ratio, then by plate, the one that slides first.
std::vector<SkinRow> skin_rows(const std::vector<Judged>& judged);

/// Tables for people and for programs; shares in percent in the first alone.
std::string skin_text(const std::vector<SkinRow>& rows);
std::string skin_csv(const std::vector<SkinRow>& rows);
json::Value skin_json(const std::vector<SkinRow>& rows);

}  // namespace palpate::lump
