// palpate modulus on the command line.

#include <cmath>
#include <tuple>

#include "engine/base/text.h"
#include "tests/support/json.h"
#include "tests/support/program_fixture.h"

namespace palpate {
namespace {

class ModulusCommand : public Program {};

TEST_F(ModulusCommand, TableOfPresses) {
  // Hertz on a deep pad as hard as the sample: E* = 2/3 of it each, 2/3 / 2 together.
  std::string table = "# presses\nforce_N,radius_mm,radius_sd_mm,note\n";
  for (const double force : {0.001, 0.002, 0.003, 0.004}) {
    const double modulus = 0.1 / 0.75 / 2, radius = std::cbrt(3 * force * 8 / (4 * modulus));
    table += std::to_string(force) + "," + std::to_string(radius) + ",0.002,\n";
  }
  spill(folder_ / "presses.csv", table);
  const Ended r = run({"modulus", "--frames", (folder_ / "presses.csv").string(), "--sample", "sphere,16mm",
                       "--pad-kPa", "100", "--json", "--out", (folder_ / "out").string()});
  ASSERT_EQ(r.exit_code, 0) << r.err;
  const Json value = parse_json(r.out);
  EXPECT_EQ(value["state"], "valid");
  EXPECT_NEAR(value["young_MPa"].get<double>(), 0.1, 0.003);
  EXPECT_LT(value["low_MPa"].get<double>(), 0.1);
  EXPECT_GT(value["high_MPa"].get<double>(), 0.1);
  EXPECT_EQ(value["ways"].size(), 4u);
  for (const char* file : {"modulus.csv", "presses.csv", "points.csv", "modulus.json", "modulus.png",
                           "modulus.svg", "residuals.png", "residuals.svg"})
    EXPECT_GT(fs::file_size(folder_ / "out" / file), 100u) << file;
}

TEST_F(ModulusCommand, OtherUnitsAreConvertedAndUnreadColumnsNamed) {
  std::string table = "force_mN,radius_um,radius_sd_um,colour\n";
  for (const double force : {0.001, 0.002, 0.003, 0.004}) {
    const double modulus = 0.1 / 0.75 / 2, radius = std::cbrt(3 * force * 8 / (4 * modulus));
    table += std::to_string(1e3 * force) + "," + std::to_string(1e3 * radius) + ",2,red\n";
  }
  spill(folder_ / "presses.csv", table);
  const std::vector<std::string> line{"modulus",  "--frames",    (folder_ / "presses.csv").string(),
                                      "--sample", "sphere,16mm", "--pad-kPa",
                                      "100"};
  const Ended r = run(line);
  ASSERT_EQ(r.exit_code, 0) << r.err;
  for (const char* part :
       {"'radius_um' is read in um (0.001 mm each)", "'force_mN' is read in mN", "'colour'"})
    EXPECT_NE(r.out.find(part), std::string::npos) << part << "\n" << r.out;
  std::vector<std::string> as_json = line;
  as_json.push_back("--json");
  EXPECT_NEAR(parse_json(run(as_json).out)["young_MPa"].get<double>(), 0.1, 0.003);
  spill(folder_ / "presses.csv", "force_N,radius\n1,2\n2,3\n");
  expect_refusal(line, 3, {"a unit (mm, um", "column 'radius'"});
}

TEST_F(ModulusCommand, TheStagesZeroIsAnUnknownAndItsDirectionIsFound) {
  // A cube of 103 kPa, as its simulation has it, with a stage that is at 0 or at 5 mm at first touch, or
  // that counts down from 12 mm.
  std::vector<double> young_MPa;
  for (const auto& [zero_mm, sign] : {std::pair{0.0, 1}, {5.0, 1}, {12.0, -1}}) {
    std::string table =
        "force_N,force_sd_N,radius_mm,radius_sd_mm,depth_mm,mean_depth_mm,approach_mm,approach_sd_mm\n";
    for (const auto& [force, radius, depth, mean, approach] :
         {std::tuple{0.5983, 5.8513, 0.07193, 0.05865, 0.6465},
          {0.7998, 5.9099, 0.09374, 0.07664, 0.8604},
          {1.0010, 5.9711, 0.11464, 0.09378, 1.0609}})
      table += palpate::text("%g,0.0045,%g,0.0026,%g,%g,%g,0.005\n", force, radius, depth, mean,
                             zero_mm + sign * approach);
    spill(folder_ / "presses.csv", table);
    const Ended r = run({"modulus", "--frames", (folder_ / "presses.csv").string(), "--sample", "cube,10mm",
                         "--pad-kPa", "200", "--pad-thickness-mm", "6", "--json"});
    ASSERT_EQ(r.exit_code, 0) << r.err;
    const Json found = parse_json(r.out);
    ASSERT_TRUE(found["young_MPa"].is_number()) << r.out;
    young_MPa.push_back(found["young_MPa"].get<double>());
    EXPECT_EQ(contains(found["notes"].dump(), "its sign is turned"), sign < 0) << r.out;
  }
  EXPECT_NEAR(young_MPa[0], 0.103, 0.05 * 0.103);
  EXPECT_NEAR(young_MPa[1], young_MPa[0], 1e-4);
  EXPECT_NEAR(young_MPa[2], young_MPa[0], 1e-4);
}

TEST_F(ModulusCommand, SimulatedSampleIsFound) {
  const Ended r =
      run({"modulus", "--simulate", "103", "--sample", "cube,10mm", "--forces", "0.8,1.0", "--json"});
  ASSERT_EQ(r.exit_code, 0) << r.err;
  const Json value = parse_json(r.out);
  EXPECT_EQ(value["state"], "valid");
  EXPECT_NEAR(value["young_MPa"].get<double>(), 0.103, 0.05 * 0.103);
}

TEST_F(ModulusCommand, RigidPressesOfARecordingAreNoModulus) {
  const Ended r = run({"modulus", "synthetic:press?seed=3", "--sample", "dome,16mm", "--json"});
  ASSERT_EQ(r.exit_code, 0) << r.err;
  const Json value = parse_json(r.out);
  EXPECT_EQ(value["state"], "pad limited") << r.out;
  EXPECT_TRUE(value["young_MPa"].is_null());
  EXPECT_GT(value["low_MPa"].get<double>(), 0.5);
}

// The scene presses a paraboloid: taken for a ball each way fits, and they contradict each other.
TEST_F(ModulusCommand, AWrongShapeIsNoModulus) {
  const Ended r = run({"modulus", "synthetic:press?seed=3", "--sample", "sphere,16mm", "--json"});
  ASSERT_EQ(r.exit_code, 0) << r.err;
  const Json value = parse_json(r.out);
  EXPECT_EQ(value["state"], "does not fit") << r.out;
  EXPECT_NE(value.dump().find("contradict each other"), std::string::npos) << r.out;
}

// Depths that are half of what force and radius ask for: each way that leaves one of them out fits.
TEST_F(ModulusCommand, NoHeadlineThatItsJointFitRejects) {
  const std::string head = "force_N,force_sd_N,radius_mm,radius_sd_mm,depth_mm,depth_sd_mm\n";
  std::string table = head;
  const double modulus = 1 / (0.75 / 0.03 + 0.75 / 0.2);
  for (const double force : {0.0005, 0.001, 0.0015, 0.002, 0.003, 0.004}) {
    const double radius = std::cbrt(3 * force * 8 / (4 * modulus)), pad = 0.03 / 0.23;
    table += std::to_string(force) + ",0.00001," + std::to_string(radius) + ",0.002," +
             std::to_string(0.5 * pad * radius * radius / 8) + ",0.0003\n";
  }
  spill(folder_ / "presses.csv", table);
  const std::vector<std::string> command = {"modulus",  "--frames",    folder_ / "presses.csv",
                                            "--sample", "sphere,16mm", "--pad-kPa",
                                            "200",      "--out",       folder_ / "out"};
  const Ended text = run(command);
  ASSERT_EQ(text.exit_code, 0) << text.err;
  const std::string headline = text.out.substr(0, text.out.find('\n'));
  EXPECT_TRUE(contains(headline, "no value")) << text.out;
  EXPECT_FALSE(contains(headline, "kPa")) << text.out;
  const Json value = parse_json(slurp(folder_ / "out/modulus.json"));
  EXPECT_EQ(value["state"], "does not fit") << text.out;
  for (const char* number : {"young_MPa", "low_MPa", "high_MPa"})
    EXPECT_TRUE(value[number].is_null()) << number;
  EXPECT_NE(value.dump().find("\"valid\""), std::string::npos)
      << "no way fits by itself: the test says nothing";
}

TEST_F(ModulusCommand, NonsenseIsRefusedInOneLine) {
  spill(folder_ / "bad.csv", "force_N,radius_mm\n1,two\n");
  spill(folder_ / "none.csv", "radius_mm\n1\n");
  const std::string bad = (folder_ / "bad.csv").string(), none = (folder_ / "none.csv").string();
  const std::vector<std::pair<std::vector<std::string>, int>> cases = {
      {{"modulus"}, 2},
      {{"modulus", "--simulate", "100"}, 2},
      {{"modulus", "--simulate", "100", "--sample", "pyramid,4mm"}, 2},
      {{"modulus", "--simulate", "100", "--sample", "cube,10"}, 2},
      {{"modulus", "--frames", bad, "--simulate", "100", "--sample", "cube,10mm"}, 2},
      {{"modulus", "--frames", bad, "--sample", "cube,10mm"}, 3},
      {{"modulus", "--frames", none, "--sample", "cube,10mm"}, 3},
      {{"modulus", "--frames", bad + "x", "--sample", "cube,10mm"}, 3},
      {{"modulus", "--simulate", "1", "--sample", "sphere,16mm", "--forces", "2"}, 3},
      {{"modulus", "--simulate", "100", "--sample", "cube,-3mm"}, 3}};
  for (const auto& [arguments, code] : cases) {
    const Ended r = run(arguments);
    EXPECT_EQ(r.exit_code, code) << arguments.back() << ": " << r.err;
    EXPECT_FALSE(r.err.empty());
  }
}

}  // namespace
}  // namespace palpate
