// `palpate-lab forward` on the command line.
#include <algorithm>

#include "capture/files/npy.h"
#include "tests/lab/lab_program.h"
#include "tests/support/json.h"

namespace palpate {
namespace {

class ForwardCommand : public LabProgram {
 protected:
  Json answer(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), "forward");
    arguments.insert(arguments.end(), {"--json", "--quiet"});
    const Ended ended = run(arguments);
    EXPECT_EQ(ended.exit_code, 0) << ended.err;
    return parse_json(ended.out);
  }
};

TEST_F(ForwardCommand, PadProblemAndItsFiles) {
  const fs::path out = folder_ / "out";
  const Json value = answer({"--out", out.string()});
  EXPECT_TRUE(value["converged"]);
  EXPECT_NEAR(value["force_N"].get<double>(), 0.40105, 0.004);
  EXPECT_NEAR(value["center_stress_Pa"].get<double>(), 473.5, 4.7);
  EXPECT_TRUE(value["gaussian"]["found"]);
  EXPECT_NEAR(value["gaussian"]["center_mm"].get<double>(), 0, 0.01);
  EXPECT_GT(value["gaussian"]["amplitude_Pa"].get<double>(), 50);
  EXPECT_GT(value["gaussian"]["amplitude_sd_Pa"].get<double>(), 0);
  EXPECT_GT(value["tactile_image"]["brightest_change_gray"].get<double>(), 0.5);
  const NpyArray stress = read_npy(out / "stress_Pa.npy");
  EXPECT_EQ(stress.shape, (std::vector<size_t>{65, 65}));
  EXPECT_NEAR(double{stress.values[32 * 65 + 32]}, value["center_stress_Pa"].get<double>(), 0.01);
  EXPECT_EQ(read_npy(out / "tactile.npy").shape, (std::vector<size_t>{480, 640}));
  for (const char* name : {"deflection_mm.npy", "tactile.png", "profile.csv", "forward.json", "maps.png",
                           "maps.svg", "profile.png", "profile.svg"})
    EXPECT_GT(fs::file_size(out / name), 500u) << name;
}

TEST_F(ForwardCommand, DeviceFindsWhatTheProcessorFinds) {
  const std::vector<std::string> scene = {"--cells", "32x32x16", "--poisson", "0.45", "--solver"};
  const auto by = [&](const char* solver) {
    std::vector<std::string> arguments = scene;
    arguments.insert(arguments.end(), {solver, "--validation"});
    return answer(arguments);
  };
  const Json processor = by("processor"), device = by("device"), chosen = by("auto");
  EXPECT_EQ(processor["solver"], "processor");
  EXPECT_EQ(device["solver"].get<std::string>().find("processor"), std::string::npos) << device["solver"];
  EXPECT_EQ(chosen["solver"], "processor (device passed over: 4913 nodes, fewer than 60000)");
  for (const char* name : {"force_N", "center_stress_Pa", "core_strain"})
    EXPECT_NEAR(device[name].get<double>() / processor[name].get<double>(), 1, 1e-4) << name;
  expect_refusal({"forward", "--solver", "device", "--cells", "72x72x36", "--no-inclusion"}, 5,
                 {"wanted", "found", "try", "with 3000 unknowns, more than 1500"});
}

// Orderings from the model itself: bigger and stiffer inclusions have the larger a.
TEST_F(ForwardCommand, BiggerAndStifferShowMore) {
  const auto amplitude = [&](const char* size, const char* ratio) {
    return answer({"--size-mm", size, "--stiffness-ratio", ratio, "--force-N", "2", "--cells",
                   "32x32x16"})["gaussian"]["amplitude_Pa"]
        .get<double>();
  };
  const double middle = amplitude("8", "10");
  EXPECT_GT(amplitude("12", "10"), middle);
  EXPECT_GT(middle, amplitude("4", "10"));
  EXPECT_GT(middle, amplitude("8", "2"));
}

TEST_F(ForwardCommand, SweepTellsEveryInput) {
  const fs::path out = folder_ / "out";
  const Json rows = answer({"sweep", "--cells", "16x16x8", "--out", out.string()});
  for (const char* input : {"d", "h", "E_r", "s", "t", "l"})
    EXPECT_GE(std::count_if(rows.begin(), rows.end(), [&](const Json& row) { return row["input"] == input; }),
              3)
        << input;
  // Twice the press is twice the stress.
  std::map<double, double> by_press;
  for (const Json& row : rows)
    if (row["input"] == "l") by_press[row["value"].get<double>()] = row["center_stress_Pa"].get<double>();
  EXPECT_NEAR(by_press[2], 2 * by_press[1], 1e-3 * by_press[2]);
  const std::string csv = slurp(out / "sweep.csv");
  EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), static_cast<long>(rows.size()) + 1);
  EXPECT_TRUE(fs::exists(out / "sweep.png") && fs::exists(out / "sweep_profiles.svg"));
}

TEST_F(ForwardCommand, SaysNothingThatDidNotConverge) {
  // Nearly incompressible and very stiff, and asked for more digits than there are iterations for.
  const Ended ended = run({"forward", "--poisson", "0.4999", "--stiffness-ratio", "1e4", "--residual",
                           "1e-12", "--cells", "64x64x32", "--most-iterations", "20", "--json"});
  EXPECT_EQ(ended.exit_code, 1);
  const Json value = parse_json(ended.out);
  EXPECT_FALSE(value["converged"]);
  EXPECT_GT(value["residual"].get<double>(), 1e-12);
  EXPECT_FALSE(value.contains("force_N"));
}

TEST_F(ForwardCommand, AStiffSkinStiffensTheBlock) {
  const std::vector<std::string> coarse = {"--cells", "24x24x12"};
  std::vector<std::string> under = coarse;
  under.insert(under.end(), {"--skin-mm", "2", "--skin-ratio", "5"});
  const Json bare = answer(coarse), stiff = answer(under);
  EXPECT_FALSE(bare["scene"].contains("skin"));
  EXPECT_EQ(stiff["scene"]["skin"]["stiffness_ratio"].get<double>(), 5);
  EXPECT_EQ(stiff["scene"]["skin"]["thickness_mm"].get<double>(), 2);
  EXPECT_GT(stiff["force_N"].get<double>(), 1.05 * bare["force_N"].get<double>());
}

TEST_F(ForwardCommand, RefusesWhatMakesNoSense) {
  expect_refusal({"forward", "--poisson", "0.5"}, 2, {"Poisson"});
  expect_refusal({"forward", "--cells", "64x64"}, 2, {"--cells"});
  expect_refusal({"forward", "--cells", "62x62x31"}, 2, {"halved"});
  expect_refusal({"forward", "--depth-mm", "18"}, 2, {"base"});
  expect_refusal({"forward", "--presser", "ball"}, 2, {"radius"});
  expect_refusal({"forward", "--press-mm", "1", "--force-N", "1"}, 2, {"--force-N"});
  expect_refusal({"forward", "--skin-mm", "6"}, 2, {"below the skin"});
  expect_refusal({"forward", "--skin-ratio", "3"}, 2, {"--skin-ratio", "--skin-mm 2"});
  expect_refusal({"forward", "--pad", "2mm"}, 2, {"--pad"});
  expect_refusal({"forward", "--size-mm", "3", "4"}, 2, {"one size or three"});
  expect_refusal({"forward", "sweep", "--no-inclusion"}, 2, {"inclusion"});
  expect_refusal({"forward", "--sensor", "no_such_file.json"}, 4, {"no_such_file"});
}

}  // namespace
}  // namespace palpate
