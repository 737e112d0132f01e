// A network's description of its own structure, and the picture drawn from it.
#include "perf/lab/study/stages.h"

#include <gtest/gtest.h>

#include "engine/lump/network/model.h"
#include "engine/lump/network/network.h"
#include "perf/lab/study/lump_network_figure.h"

namespace palpate {
namespace {

lump::Stage network_of(const std::vector<lump::Stage>& stages, const std::string& name) {
  for (const lump::Stage& stage : stages)
    if (stage.kind == lump::Stage::Kind::Network && stage.name == name) return stage;
  throw std::runtime_error("no network " + name);
}
constexpr const char* kEmulator = "from a lump to its bump";

TEST(LumpStages, AreTheModelsOwn) {
  const lump::Model& model = lump::Network::built_in().model();
  const lump::Stage stage = network_of(lump_stages(model), kEmulator);
  ASSERT_FALSE(model.ensemble.empty());
  EXPECT_EQ(stage.copies, model.ensemble.size());
  EXPECT_EQ(stage.widths.front(), model.ensemble[0].inputs());
  EXPECT_EQ(stage.widths.back(), model.ensemble[0].outputs());
  EXPECT_EQ(stage.widths.size(), model.ensemble[0].layers.size() + 1);
  EXPECT_EQ(stage.inputs.size(), static_cast<size_t>(lump::kFeatures));  // each has a name
  const lump::Stage reader = network_of(lump_stages(model), "from a bump to its lump");
  ASSERT_FALSE(model.inverse.ensemble.empty());
  EXPECT_EQ(reader.copies, model.inverse.ensemble.size());
  EXPECT_EQ(reader.widths.front(), model.inverse.ensemble[0].inputs());
  EXPECT_EQ(reader.widths.back(), model.inverse.ensemble[0].outputs());
}

TEST(LumpStages, OfAnotherModelAreOthers) {
  lump::Model model = lump::Network::built_in().model();
  model.ensemble.assign(3, SmallNetwork::random({5, 11, 7, 9, 2}, 1));
  const lump::Stage stage = network_of(lump_stages(model), kEmulator);
  EXPECT_EQ(stage.copies, 3u);
  EXPECT_EQ(stage.widths, (std::vector<uint32_t>{5, 11, 7, 9, 2}));
  EXPECT_EQ(stage.inputs.size(), 1u);  // names are of other inputs: distinguished by their number
  const std::string script = plot_script(network_figure(lump_stages(model), "nothing"), PlotKind::Svg);
  for (const char* word :
       {"11 tanh", "7 tanh", "9 tanh", "mean of 3 networks", "taught by presses of known lumps: nothing"})
    EXPECT_NE(script.find(word), std::string::npos) << word;
}

}  // namespace
}  // namespace palpate
