// palpate match on the command line.
#include <cmath>
#include <string>

#include "capture/synthetic/bent_points.h"
#include "tests/support/json.h"
#include "tests/support/program_fixture.h"

namespace palpate {
namespace {

class Match : public Program {
 protected:
  std::string write(const std::string& name, const PointSet& set) {
    std::string text = set.axes == 2 ? "id,y,x\n" : "x,y,z\n";
    for (size_t i = 0; i < set.size(); ++i) {
      const auto p = set.at(i);
      text += set.axes == 2
                  ? std::to_string(i) + "," + std::to_string(p[1]) + "," + std::to_string(p[0]) + "\n"
                  : std::to_string(p[0]) + "," + std::to_string(p[1]) + "," + std::to_string(p[2]) + "\n";
    }
    spill(folder_ / name, text);
    return folder_ / name;
  }
};

TEST_F(Match, WritesTheWarpedTemplateInItsOrderAndThePartners) {
  const BentPoints points = bent({.bend = 0.03, .outlier_ratio = 0.3, .seed = 2});
  const std::string from = write("from.csv", points.from), to = write("to.csv", points.to);
  const fs::path out = folder_ / "out";
  const Ended ended = run({"match", from, to, "--out", out, "--json"});
  ASSERT_EQ(ended.exit_code, 0) << ended.err;
  const auto json = parse_json(ended.out);
  EXPECT_TRUE(json["reliable"].get<bool>());
  EXPECT_EQ(json["pairs"], points.from.size());
  EXPECT_GT(json["evidence_nats_per_point"].get<double>(), 1);
  const Table warped(slurp(out / "warped.csv")), partners(slurp(out / "partners.csv"));
  ASSERT_EQ(warped.rows.size(), points.from.size());
  ASSERT_EQ(partners.rows.size(), points.from.size());
  PointSet brought{2, {}};
  for (size_t i = 0; i < points.from.size(); ++i) {
    brought.coordinates.push_back(std::stod(warped.at(i, "x")));
    brought.coordinates.push_back(std::stod(warped.at(i, "y")));
    EXPECT_EQ(partners.at(i, "target"), std::to_string(points.target_of_from[i])) << i;
  }
  EXPECT_LT(mean_miss(brought, points.truth), 0.002);
  EXPECT_TRUE(fs::exists(out / "match.json"));
}

TEST_F(Match, AListOfPairsNumbersItsFolders) {
  const BentPoints flat = bent({.seed = 3}), deep = bent({.axes = 3, .seed = 4});
  write("a.csv", flat.from), write("b.csv", flat.to), write("c.csv", deep.from), write("d.csv", deep.to);
  spill(folder_ / "list.csv", "template,target\na.csv,b.csv\nc.csv,d.csv\n");
  const Ended ended = run({"match", "--list", folder_ / "list.csv", "--out", folder_ / "out", "--json"});
  ASSERT_EQ(ended.exit_code, 0) << ended.err;
  const auto json = parse_json(ended.out);
  ASSERT_EQ(json.size(), 2u);
  EXPECT_EQ(json[1]["axes"], 3);
  EXPECT_TRUE(fs::exists(folder_ / "out/0001/warped.csv"));
  EXPECT_TRUE(fs::exists(folder_ / "out/0002/warped.csv"));
}

TEST_F(Match, ColumnsMayHaveTheirUnit) {
  const BentPoints points = bent({.seed = 3});
  const auto with_header = [&](const std::string& name, const PointSet& set, const std::string& header) {
    std::string text = header + "\n";
    for (size_t i = 0; i < set.size(); ++i)
      text += std::to_string(set.at(i)[0]) + "," + std::to_string(set.at(i)[1]) + ",7\n";
    spill(folder_ / name, text);
    return (folder_ / name).string();
  };
  const std::string from = with_header("from.csv", points.from, "x_mm,y_mm,z_score"),
                    to = with_header("to.csv", points.to, "X [mm],Y [mm],frame");
  const Ended ended = run({"match", from, to, "--json"});
  ASSERT_EQ(ended.exit_code, 0) << ended.err;
  EXPECT_TRUE(parse_json(ended.out)["reliable"].get<bool>());
  EXPECT_EQ(parse_json(ended.out)["axes"], 2);
  expect_refusal({"match", from, with_header("mixed.csv", points.to, "x_mm,y_um,n")}, 3,
                 {"one unit for x and y"});
  expect_refusal({"match", from, with_header("half.csv", points.to, "x_mm,depth_mm,n")}, 3,
                 {"column 'y_mm'"});
}

TEST_F(Match, AGridThatIsHardlyTurnedNeedsNoOtherTurns) {
  PointSet grid{2, {}}, pressed{2, {}};
  for (int row = 0; row < 9; ++row)
    for (int column = 0; column < 9; ++column) {
      const double x = column, y = row;
      grid.coordinates.insert(grid.coordinates.end(), {x, y});
      // Bent outwards around its middle.
      const double push = 0.06 * std::exp(-((x - 4) * (x - 4) + (y - 4) * (y - 4)) / 8);
      pressed.coordinates.insert(pressed.coordinates.end(), {x + push * (x - 4), y + push * (y - 4)});
    }
  const std::string from = write("grid.csv", grid), to = write("pressed.csv", pressed);
  const Ended any = run({"match", from, to});
  EXPECT_TRUE(contains(any.out, "--most-turn-deg")) << any.out;
  const Ended few = run({"match", from, to, "--most-turn-deg", "20", "--json"});
  ASSERT_EQ(few.exit_code, 0) << few.err;
  EXPECT_TRUE(parse_json(few.out)["reliable"].get<bool>()) << few.out;
  expect_refusal({"match", from, to, "--most-turn-deg", "200"}, 2, {"--most-turn-deg"});
}

TEST_F(Match, UnrelatedSetsAreSaidToBe) {
  const std::string from = write("from.csv", character(2));
  std::mt19937 random(5);
  PointSet strangers{2, {}};
  for (int k = 0; k < 200; ++k) strangers.coordinates.push_back(static_cast<double>(random() % 1000) / 1000);
  const Ended ended = run({"match", from, write("to.csv", strangers), "--out", folder_ / "out"});
  EXPECT_EQ(ended.exit_code, 0) << ended.err;
  EXPECT_TRUE(contains(ended.out, "no reliable match")) << ended.out;
  EXPECT_FALSE(fs::exists(folder_ / "out/warped.csv"));
  EXPECT_TRUE(fs::exists(folder_ / "out/unreliable_warped.csv"));
}

TEST_F(Match, NonsenseIsOneLine) {
  const std::string good = write("good.csv", character(2)), space = write("space.csv", character(3));
  const auto table = [&](const std::string& name, const std::string& text) {
    spill(folder_ / name, text);
    return (folder_ / name).string();
  };
  expect_refusal({"match", good}, 2, {"TEMPLATE.csv"});
  expect_refusal({"match", good, good, "--list", good}, 2, {"--list"});
  expect_refusal({"match", good, folder_ / "none.csv"}, 3, {"none.csv"});
  expect_refusal({"match", good, table("empty.csv", "")}, 3, {"empty"});
  expect_refusal({"match", good, table("head.csv", "x,y\n")}, 3, {"points", "found 0"});
  expect_refusal({"match", good, table("two.csv", "x,y\n1,2\n3,4\n")}, 3, {"points", "found 2"});
  expect_refusal({"match", good, table("column.csv", "x,z\n1,2\n3,4\n4,1\n")}, 3, {"column 'y'"});
  expect_refusal({"match", good, table("twice.csv", "x,y,x\n1,2,1\n3,4,3\n4,1,4\n")}, 3, {"one column 'x'"});
  expect_refusal({"match", good, table("nan.csv", "x,y\n1,2\n3,nan\n4,1\n")}, 3, {"line 3", "column 'y'"});
  expect_refusal({"match", good, table("short.csv", "x,y\n1,2\n3\n4,1\n")}, 3, {"line 3"});
  expect_refusal({"match", good, table("same.csv", "x,y\n1,2\n1,2\n1,2\n")}, 3, {"one place"});
  expect_refusal({"match", good, space}, 3, {"2 and 3"});
  expect_refusal({"match", "--list", good}, 3, {"'template' and 'target'"});
}

}  // namespace
}  // namespace palpate
