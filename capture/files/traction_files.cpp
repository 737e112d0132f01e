#include "capture/files/traction_files.h"

#include <algorithm>
#include <array>
#include <limits>
#include <vector>

#include "capture/files/depth/depth_mesh.h"
#include "capture/files/measured_tiff.h"
#include "capture/files/measurements.h"
#include "capture/files/npy.h"
#include "capture/files/output_file.h"
#include "palpate/error.h"

namespace palpate {
namespace {

constexpr float kNoNumber = std::numeric_limits<float>::quiet_NaN();

/// Pressure and shear of one cell, kPa.
std::array<float, 3> cell_at(const TractionMaps& maps, size_t cell) {
  if (maps.pressure_kPa.empty()) return {0, 0, 0};
  if (maps.shear_x_kPa.empty()) return {maps.pressure_kPa[cell], kNoNumber, kNoNumber};
  return {maps.pressure_kPa[cell], maps.shear_x_kPa[cell], maps.shear_y_kPa[cell]};
}

void write_tiff(const std::filesystem::path& file, const TractionMaps& maps, double cell_mm) {
  std::vector<float> values;
  for (size_t i = 0; i < size_t{maps.width} * maps.height; ++i) values.push_back(cell_at(maps, i)[0]);
  write_measured_tiff(file, {.width = maps.width,
                             .height = maps.height,
                             .pitch_mm = cell_mm,
                             .about = "pressure on the pad, unit kPa; cells",
                             .values = std::span(values),
                             .predicted = false});
}

}  // namespace

std::string_view extension(TractionFormat format) {
  switch (format) {
    case TractionFormat::Npy:
      return "npy";
    case TractionFormat::Tiff:
      return "tif";
    case TractionFormat::Ply:
      return "ply";
  }
  return "";
}

void write_traction(const std::filesystem::path& file, const TractionMaps& maps, const DepthView& depth,
                    TractionFormat format) {
  if (format == TractionFormat::Tiff) return write_tiff(file, maps, maps.cell_px * depth.pitch_mm_per_px);
  if (format == TractionFormat::Npy) {
    std::vector<float> values;
    for (size_t i = 0; i < size_t{maps.width} * maps.height; ++i)
      for (const float value : cell_at(maps, i)) values.push_back(value);
    return write_npy(file, values, {maps.height, maps.width, 3});
  }
  std::array<VertexValues, 4> values = {
      {{"pressure_kPa", {}}, {"shear_x_kPa", {}}, {"shear_y_kPa", {}}, {"shear_over_pressure", {}}}};
  const std::vector<float> ratios = friction_ratios(maps);
  for (uint32_t y = 0; y < depth.height; ++y)
    for (uint32_t x = 0; x < depth.width; ++x) {
      const uint32_t row = std::min(y / maps.cell_px, maps.height - 1);
      const uint32_t column = std::min(x / maps.cell_px, maps.width - 1);
      const size_t cell = size_t{row} * maps.width + column;
      const std::array<float, 3> at = cell_at(maps, cell);
      for (size_t i = 0; i < 3; ++i) values[i].values.push_back(at[i]);
      values[3].values.push_back(ratios.empty() ? kNoNumber : ratios[cell]);
    }
  write_ply(file, depth, values);
}

}  // namespace palpate
