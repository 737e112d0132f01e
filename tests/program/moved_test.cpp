// Commands that palpate-lab has now: their old names answer in one line where they went.
#include "tests/support/json.h"
#include "tests/support/program_fixture.h"

namespace palpate {
namespace {

using MovedCommand = Program;

TEST_F(MovedCommand, SaysWhereItWent) {
  expect_refusal({"lump", "dataset", "train.h5", "--count", "3"}, 2, {"palpate-lab dataset --help"});
  expect_refusal({"lump", "info", "train.h5"}, 2, {"palpate-lab info"});
  expect_refusal({"lump", "train"}, 2, {"palpate-lab train"});
  expect_refusal({"lump", "evaluate", "held_out.h5"}, 2, {"palpate-lab evaluate lump"});
  expect_refusal({"lump", "figures"}, 2, {"palpate-lab figures"});
  expect_refusal({"lump", "stability"}, 2, {"palpate-lab stability"});
  expect_refusal({"evaluate"}, 2, {"palpate-lab evaluate --help"});
  for (const char* what : {"table", "match", "modulus", "force"})
    expect_refusal({"evaluate", what, "x"}, 2, {std::string("palpate-lab evaluate ") + what});
  expect_refusal({"forward", "--out", "x"}, 2, {"palpate-lab forward --help"});
  expect_refusal({"forward", "sweep"}, 2, {"palpate-lab forward sweep"});
  expect_refusal({"forward", "convergence"}, 2, {"palpate-lab forward convergence"});
  expect_refusal({"tune"}, 2, {"palpate-lab tune"});
  expect_refusal({"profile", "--compile", "vega10"}, 2, {"palpate-lab compile"});
  expect_refusal({"profile", "--out", "x", "--compile=vega10"}, 2, {"palpate-lab compile"});
  expect_refusal({"help", "lump", "train"}, 2, {"palpate-lab train"});
}

TEST_F(MovedCommand, SaysSoAsJson) {
  const Ended ended = run({"tune", "--json"});
  EXPECT_EQ(ended.exit_code, 2);
  const Json json = parse_json(ended.out);
  EXPECT_EQ(json["exit_code"], 2);
  EXPECT_TRUE(contains(json["error"].get<std::string>(), "palpate-lab tune"));
}

TEST_F(MovedCommand, OnlyTheCommandItself) {
  // Words that are values, and commands that stay.
  expect_refusal({"lump", "forward"}, 2, {"lump"});
  expect_refusal({"process", "tune", "--out", folder_ / "x"}, 3, {"tune"});
  expect_refusal({"profile"}, 2, {"--out DIR"});
}

}  // namespace
}  // namespace palpate
