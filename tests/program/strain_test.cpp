// `palpate strain` on the command line.
#include <algorithm>
#include <cmath>

#include "tests/support/json.h"
#include "tests/support/program_fixture.h"

namespace palpate {
namespace {

class StrainCommand : public Program {
 protected:
  Json answer(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), "strain");
    arguments.insert(arguments.end(), {"--json", "--quiet"});
    const Ended ended = run(arguments);
    EXPECT_EQ(ended.exit_code, 0) << ended.err;
    return ended.exit_code == 0 ? parse_json(ended.out) : Json();
  }
};

// A ball's contact has grown between half of the peak's force and the peak by what its own pixels say.
TEST_F(StrainCommand, GrowthOfAContactAndItsFiles) {
  const fs::path out = folder_ / "out";
  const Json value = answer({"synthetic:press?size=320x240", "--validation", "--out", out.string()});
  ASSERT_TRUE(value["reason"].is_null()) << value;
  EXPECT_EQ(value["points"], "shape, matched");
  EXPECT_GT(value["pairs"].get<int>(), 150);
  const double peak = value["after"]["force_N"];
  EXPECT_NEAR(value["before"]["force_N"].get<double>(), peak / 2, 0.03 * peak);
  const double grown =
      value["after"]["contact_mm2"].get<double>() / value["before"]["contact_mm2"].get<double>() - 1;
  const double sd = value["strain_sd"]["area"];
  EXPECT_GT(grown, 0.1);
  EXPECT_NEAR(value["strain"]["area"].get<double>(), grown, 4 * sd);
  EXPECT_LT(sd, 0.1 * grown);
  EXPECT_LT(value["axial"].get<double>(), 0);
  for (const char* name :
       {"pairs.csv", "strain.json", "points.png", "points.svg", "strain.png", "strain.svg"})
    EXPECT_GT(fs::file_size(out / name), 500u) << name;
}

// The skin's points are followed: a pad that is twisted does not stretch.
TEST_F(StrainCommand, SkinThatTurnsIsNotStrained) {
  const Json value = answer({"synthetic:twist?skin=markers&size=320x240", "--frames", "40,80"});
  ASSERT_TRUE(value["reason"].is_null()) << value;
  EXPECT_EQ(value["points"], "skin, followed");
  for (const char* part : {"xx", "yy", "xy"})
    EXPECT_NEAR(value["strain"][part].get<double>(), 0, 4 * value["strain_sd"][part].get<double>()) << part;
}

TEST_F(StrainCommand, RefusesWhatMakesNoSense) {
  const std::string press = "synthetic:press?size=320x240";
  expect_refusal({"strain", press, "--frames", "3,3"}, 3, {"two compressions"});
  expect_refusal({"strain", press, "--frames", "3,100000"}, 3, {"no such frame"});
  expect_refusal({"strain", press, "--forces-N", "0.5,77"}, 3, {"77"});
  expect_refusal({"strain", "synthetic:still?size=320x240"}, 3, {"calibrated force"});
  expect_refusal({"strain", press, "--points", "7"}, 2, {"--points"});
  // A frame without contact is no mistake: it has no strain.
  const Json value = answer({press, "--frames", "0,100"});
  EXPECT_NE(value["reason"].get<std::string>().find("first compression"), std::string::npos) << value;
}

}  // namespace
}  // namespace palpate
