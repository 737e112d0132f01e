#include "capture/files/lump_maps.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <limits>

#include "capture/files/npy.h"
#include "capture/files/output_file.h"
#include "capture/files/tables/csv_table.h"
#include "engine/base/json.h"
#include "engine/base/statistics.h"
#include "palpate/error.h"

namespace palpate {
namespace {

constexpr size_t kMostNodes = 4096;  // along a side
constexpr const char* kObservationFile = "observation.json";
constexpr const char* kPressureFile = "pressure_Pa.npy";
constexpr const char* kObservationFormat = "palpate pressure observation 1";
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

void write_observation(const std::filesystem::path& folder, const lump::Observation& o) {
  std::vector<float> values;
  for (const PressureMap& map : o.pressure_Pa)
    values.insert(values.end(), map.values.begin(), map.values.end());
  const PressureMap& top = o.pressure_Pa.back();
  write_npy(folder / kPressureFile, values, {o.pressure_Pa.size(), top.height, top.width});
  json::Value about = {{"format", kObservationFormat}, {"force_N", o.force_N},
                       {"pitch_mm", top.pitch_mm},     {"window_mm", o.window_mm},
                       {"place_sd_mm", o.place_sd_mm}, {"noise_Pa", o.noise_Pa},
                       {"uneven_sd", o.uneven_sd},     {"saturated_share", o.saturated_fraction},
                       {"block_mm", o.block_mm},       {"young_Pa", o.young_Pa}};
  if (!o.press_mm.empty()) {
    about["press_mm"] = o.press_mm;
    about["press_sd_mm"] = o.press_sd_mm;
  }
  if (o.skin)
    about["skin"] = {{"thickness_mm", o.skin->thickness_mm},
                     {"stiffness_ratio", o.skin->stiffness_ratio},
                     {"thickness_sd", o.skin->thickness_sd},
                     {"ratio_sd", o.skin->ratio_sd}};
  if (o.plate)
    about["plate"] = {
        {"sticks", o.plate->sticks}, {"friction", o.plate->friction}, {"friction_sd", o.plate->friction_sd}};
  write_whole(folder / kObservationFile, std::string_view(about.dump(2) + "\n"));
}

lump::Observation read_observation(const std::filesystem::path& path) {
  const bool folder = std::filesystem::is_directory(path);
  const std::filesystem::path file = folder ? path / kObservationFile : path;
  const std::string wanted = "an observation that palpate lump estimate or scan kept with --out";
  const auto refuse = [&](const std::string& found) {
    throw Error(Failure::Input, wanted, found, "palpate lump estimate MAPS ... --out " + path.string());
  };
  if (!std::filesystem::exists(file)) refuse("no " + file.string());
  lump::Observation o;
  std::array<double, 2> pitch_mm{};
  try {
    std::ifstream in(file, std::ios::binary);
    const json::Value v = json::parse(std::string(std::istreambuf_iterator<char>(in), {}), {.deepest = 8});
    if (v.at("format").get<std::string>() != kObservationFormat) refuse("another format in " + file.string());
    v.at("force_N").get_to(o.force_N);
    v.at("pitch_mm").get_to(pitch_mm);
    v.at("window_mm").get_to(o.window_mm);
    v.at("place_sd_mm").get_to(o.place_sd_mm);
    v.at("noise_Pa").get_to(o.noise_Pa);
    v.at("uneven_sd").get_to(o.uneven_sd);
    v.at("saturated_share").get_to(o.saturated_fraction);
    v.at("block_mm").get_to(o.block_mm);
    v.at("young_Pa").get_to(o.young_Pa);
    if (v.contains("press_mm")) {
      v.at("press_mm").get_to(o.press_mm);
      v.at("press_sd_mm").get_to(o.press_sd_mm);
    }
    if (v.contains("skin")) {
      const json::Value& skin = v.at("skin");
      o.skin.emplace();
      skin.at("thickness_mm").get_to(o.skin->thickness_mm);
      skin.at("stiffness_ratio").get_to(o.skin->stiffness_ratio);
      skin.at("thickness_sd").get_to(o.skin->thickness_sd);
      skin.at("ratio_sd").get_to(o.skin->ratio_sd);
    }
    if (v.contains("plate")) {
      const json::Value& plate = v.at("plate");
      o.plate.emplace();
      plate.at("sticks").get_to(o.plate->sticks);
      plate.at("friction").get_to(o.plate->friction);
      plate.at("friction_sd").get_to(o.plate->friction_sd);
    }
  } catch (const json::Error& error) {
    refuse(file.string() + ": " + error.what());
  }
  const std::filesystem::path maps = file.parent_path() / kPressureFile;
  const NpyArray array = read_npy(maps);
  if (array.shape.size() != 3 || array.shape[0] != o.force_N.size() || array.shape[1] > kMostNodes ||
      array.shape[2] > kMostNodes || array.values.empty())
    refuse(describe_shape(array.shape) + " pressures in " + maps.string() + " for " +
           std::to_string(o.force_N.size()) + " forces");
  const size_t each = array.shape[1] * array.shape[2];
  for (size_t k = 0; k < o.force_N.size(); ++k) {
    const auto first = array.values.begin() + static_cast<std::ptrdiff_t>(k * each);
    PressureMap map;
    map.width = static_cast<uint32_t>(array.shape[2]);
    map.height = static_cast<uint32_t>(array.shape[1]);
    map.pitch_mm = pitch_mm;
    map.values.assign(first, first + static_cast<std::ptrdiff_t>(each));
    o.pressure_Pa.push_back(std::move(map));
  }
  return o;
}

}  // namespace palpate
