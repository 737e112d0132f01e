#include "tests/support/calculix.h"

#include <fstream>
#include <sstream>
#include <stdexcept>

#include "tests/support/json.h"

namespace palpate {
namespace {

const std::string kFolder = PALPATE_SOURCE_DIR "/tests/data/calculix/";

std::ifstream open_block(const std::string& file) {
  std::ifstream in(kFolder + file);
  if (!in) throw std::runtime_error("no " + kFolder + file);
  return in;
}

PressureMap read_map(const std::string& file, double side_mm) {
  std::ifstream in = open_block(file);
  PressureMap map;
  for (std::string line; std::getline(in, line); ++map.height) {
    std::istringstream cells(line);
    map.width = 0;
    for (std::string cell; std::getline(cells, cell, ','); ++map.width) map.values.push_back(std::stof(cell));
  }
  if (map.width < 3 || map.values.size() != size_t{map.width} * map.height)
    throw std::runtime_error(file + " is no map");
  map.pitch_mm = {side_mm / (map.width - 1), side_mm / (map.height - 1)};
  return map;
}

}  // namespace

CalculixCase calculix_case(const std::string& name) {
  std::ostringstream text;
  text << open_block(name + ".json").rdbuf();
  const Json truth = parse_json(text.str());
  CalculixCase what{name, {}, {}};
  const double side_mm = truth.at("side_mm").get<double>();
  what.scene.block_mm = {side_mm, side_mm, truth.at("thickness_mm").get<double>()};
  what.scene.young_Pa = truth.at("young_Pa").get<double>();
  what.scene.poisson = truth.at("poisson").get<double>();
  what.scene.inclusion.reset();
  const auto shape = truth.at("shape").get<std::string>();
  if (shape != "none") {
    fem::Inclusion lump;
    const double d_mm = truth.at("d_mm").get<double>();
    lump.shape = shape == "sphere"      ? InclusionShape::Sphere
                 : shape == "ellipsoid" ? InclusionShape::Ellipsoid
                                        : InclusionShape::Cylinder;
    lump.size_mm = {shape == "ellipsoid" ? 1.5 * d_mm : d_mm, d_mm, d_mm};
    lump.depth_mm = truth.at("depth_mm").get<double>();
    lump.stiffness_ratio = truth.at("ratio").get<double>();
    what.scene.inclusion = lump;
  }
  for (const Json& load : truth.at("loads"))
    what.loads.push_back({load.at("press_mm").get<double>(), load.at("force_N").get<double>(),
                          read_map(load.at("file").get<std::string>(), side_mm)});
  return what;
}

PressureMap without_rim(const PressureMap& map) {
  PressureMap inner;
  inner.width = map.width - 2;
  inner.height = map.height - 2;
  inner.pitch_mm = map.pitch_mm;
  for (uint32_t y = 1; y + 1 < map.height; ++y)
    for (uint32_t x = 1; x + 1 < map.width; ++x) inner.values.push_back(map.at(x, y));
  return inner;
}

}  // namespace palpate
