#include "capture/files/lump_maps.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "capture/files/npy.h"
#include "capture/files/tables/csv_table.h"
#include "engine/base/statistics.h"
#include "palpate/error.h"

namespace palpate {
namespace {

constexpr size_t kMostNodes = 4096;  // along a side
constexpr double kNotANumber = std::numeric_limits<double>::quiet_NaN();

PressureMap read_table(const std::filesystem::path& file) {
  const std::string wanted = "a table of pressures in Pa, as many numbers in each line";
  const auto refuse = [&](const std::string& found) {
    throw Error(Failure::Input, wanted, found + " in " + file.string(), "a .npy file or a table of numbers");
  };
  CsvTable table(file, wanted, {.header = false, .width = CsvWidth::Any});
  PressureMap map;
  std::string cut;  // the first line whose numbers seem to be cut at decimal commas
  bool points = false;
  while (table.next()) {
    if (cut.empty() && table.seems_cut()) cut = table.where();
    for (const std::string& cell : table.cells()) points = points || cell.find('.') != std::string::npos;
    const auto cells = static_cast<uint32_t>(table.cells().size());
    if (cells > kMostNodes) refuse("a line of more than 4096 numbers");
    if (map.height == 0) map.width = cells;
    if (cells != map.width)
      refuse("lines of " + std::to_string(map.width) + " and of " + std::to_string(cells) + " numbers");
    if (++map.height > kMostNodes) refuse("more than 4096 lines");
    for (uint32_t i = 0; i < cells; ++i)
      map.values.push_back(static_cast<float>(table.number_if_any(i).value_or(kNotANumber)));
  }
  if (map.height == 0) refuse("nothing");
  if (!cut.empty() && !points)
    throw Error(Failure::Input, wanted, cut + ", where decimal commas cut numbers in two",
                "decimal points, or semicolons between the numbers");
  return map;
}

}  // namespace

PressureMap read_pressure_map(const std::filesystem::path& file, double pitch_mm) {
  PressureMap map;
  if (file.extension() == ".npy") {
    NpyArray array = read_npy(file);
    if (array.shape.size() != 2 || array.shape[0] > kMostNodes || array.shape[1] > kMostNodes)
      throw Error(Failure::Input, "a map of height x width values",
                  describe_shape(array.shape) + " in " + file.string(), "one map a file");
    map.height = static_cast<uint32_t>(array.shape[0]);
    map.width = static_cast<uint32_t>(array.shape[1]);
    map.values = std::move(array.values);
  } else {
    map = read_table(file);
  }
  map.pitch_mm = {pitch_mm, pitch_mm};
  return map;
}

}  // namespace palpate
