#include "perf/lab/study/stages.h"

#include <algorithm>

#include "engine/lump/network/fit.h"
#include "engine/lump/network/model.h"

namespace palpate::lump {
namespace {

/// In the order of lump_features().
const std::vector<std::string>& feature_names() {
  static const std::vector<std::string> names = {"ln size, mm",
                                                 "ln depth, mm",
                                                 "ln stiffness ratio",
                                                 "(E_r - 1) / (E_r + 2)",
                                                 "size, mm",
                                                 "depth, mm",
                                                 "thickness, mm",
                                                 "tissue below, mm",
                                                 "(size / (size + depth))^2",
                                                 "|x| of the centre, mm",
                                                 "|y| of the centre, mm",
                                                 "load over modulus",
                                                 "cell of the grid, mm",
                                                 "ellipsoid, 0 or 1",
                                                 "upright cylinder, 0 or 1",
                                                 "lying cylinder, 0 or 1"};
  return names;
}

std::vector<uint32_t> widths_of(const SmallNetwork& network) {
  std::vector<uint32_t> widths = {network.inputs()};
  for (const SmallNetwork::Layer& layer : network.layers)
    widths.push_back(static_cast<uint32_t>(layer.weight.rows()));
  return widths;
}

Stage inverse_stage(const InverseNetwork& inverse, uint32_t shapes) {
  const std::string components = std::to_string(inverse.components.cols()),
                    open = std::to_string(InverseNetwork::kOpen);
  return {Stage::Kind::Network,
          "from a bump to its lump",
          {components + " ways in which bumps differ, weights over all loads",
           "how open noise leaves the first " + open, "size of the bump, thickness, mm",
           "|x| and |y|, mm; loads; noise"},
          widths_of(inverse.ensemble.front()),
          {"shape and how it lies",
           "of each of " + std::to_string(shapes) + " shapes: ln size, ln depth, ln E_r, with spreads",
           "shift of the centre, mm"},
          static_cast<uint32_t>(inverse.ensemble.size())};
}

}  // namespace

std::vector<Stage> lump_stages(const Model& model) {
  using Kind = Stage::Kind;
  const auto fields = static_cast<uint32_t>(model.patch.count());
  const auto patch = static_cast<uint32_t>(model.patch.fields.cols());
  const auto shapes = static_cast<uint32_t>(std::count(model.shapes.begin(), model.shapes.end(), true));
  const std::string factors = "factors of " + std::to_string(fields) + " fields";
  std::vector<Stage> stages;
  stages.push_back(
      {Kind::Given,
       "the reading",
       {},
       {},
       {"pressure maps, Pa", "force of each, N", "thickness, mm", "modulus of the tissue, Pa", "noise, Pa"}});
  stages.push_back({Kind::Formula,
                    "less the block alone",
                    {"thickness, mm", "load over modulus"},
                    {2, Base::kTerms, model.base.side * model.base.side},
                    {"pressure over modulus without a lump"}});
  stages.push_back({Kind::Formula,
                    "a patch around the bump",
                    {"what stands out, over modulus"},
                    {patch, fields},
                    {factors + " of each load"}});
  if (!model.inverse.ensemble.empty()) stages.push_back(inverse_stage(model.inverse, shapes));
  if (!model.ensemble.empty()) {
    Stage emulator{Kind::Network,
                   "from a lump to its bump",
                   feature_names(),
                   widths_of(model.ensemble.front()),
                   {factors + " over load"},
                   static_cast<uint32_t>(model.ensemble.size())};
    // A network of other inputs than those that have names here: by their number.
    if (emulator.inputs.size() != emulator.widths.front())
      emulator.inputs = {std::to_string(emulator.widths.front()) + " numbers of lump, block and load"};
    stages.push_back(std::move(emulator));
  }
  stages.push_back({Kind::Search,
                    "refined, where that is asked for",
                    {"both networks' answers and the patch"},
                    {fields, static_cast<uint32_t>(LumpVector::SizeAtCompileTime)},
                    {"ln size, ln depth, ln E_r, x, y of each of " + std::to_string(shapes) + " shapes"}});
  stages.push_back({Kind::Formula,
                    "weighed together",
                    {"misfits, over noise"},
                    {},
                    {"size, mm", "depth, mm", "stiffness ratio", "centre, mm", "shape, %",
                     "each with a 90 % interval", "or why there is none"}});
  return stages;
}

}  // namespace palpate::lump
