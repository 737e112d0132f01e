// Two fingers on the command line: record and process.
#include <csignal>

#include "tests/support/eventually.h"
#include "tests/support/json.h"
#include "tests/support/program_fixture.h"

namespace palpate {
namespace {

class PairProgram : public Program {
 protected:
  static std::string finger(const std::string& side, const std::string& more = "") {
    return "synthetic:grip?size=160x120&weight_N=0.6&skew_ms=5" + more + "&side=" + side;
  }
  std::vector<std::string> record(const fs::path& out, const std::string& more = "") {
    return {"record", "--left", finger("left", more), "--right", finger("right", more), "--json",
            "--out",  out};
  }
};

TEST_F(PairProgram, RecordsAndMeasuresAgainTheSame) {
  const fs::path folder = folder_ / "grip", again = folder_ / "again";
  const Ended recorded = run(record(folder));
  ASSERT_EQ(recorded.exit_code, 0) << recorded.err;
  const Json value = parse_json(recorded.out);
  EXPECT_EQ(value["pairs"], 180);
  EXPECT_NEAR(value["skew_mean_ms"].get<double>(), 5, 1e-6);
  EXPECT_EQ(value["left"]["processed"], value["right"]["processed"]);
  const Ended measured = run({"process", folder, "--out", again, "--json"});
  ASSERT_EQ(measured.exit_code, 0) << measured.err;
  const std::string rows = slurp(folder / "pairs.csv");
  EXPECT_EQ(slurp(again / "pairs.csv"), rows);
  const Table table(rows);
  table.expect_whole();
  EXPECT_EQ(table.rows.size(), 180u);
  EXPECT_EQ(table.at(100, "grip_force_state"), "valid");
  EXPECT_NEAR(std::stod(table.at(100, "load_z_N")), -0.6, 0.03);
  // Each finger is a session of its own, which every command reads.
  const Ended left = run({"process", folder / "left", "--as-recorded", "--json", "--out", folder_ / "left"});
  EXPECT_EQ(left.exit_code, 0) << left.err;
  EXPECT_EQ(parse_json(left.out)["as_recorded"]["different"], 0);
  EXPECT_EQ(run(record(folder)).exit_code, 7);  // nothing is overwritten
}

TEST_F(PairProgram, ALogIsKeptBesideBoth) {
  std::ofstream(folder_ / "robot.csv") << "time_s,z_mm\n1,2\n2,3\n";
  std::vector<std::string> words = record(folder_ / "grip");
  words.insert(words.end(), {"--log", folder_ / "robot.csv", "--frames", "20"});
  const Ended ended = run(words);
  ASSERT_EQ(ended.exit_code, 0) << ended.err;
  EXPECT_EQ(parse_json(ended.out)["logs"].size(), 1u) << ended.out;
  EXPECT_TRUE(contains(slurp(folder_ / "grip" / "log" / "robot.lines"), "2,3"));
  EXPECT_FALSE(fs::exists(folder_ / "grip" / "left" / "log"));
}

TEST_F(PairProgram, SaysWhatIsMissing) {
  const auto refused = [&](std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), "record");
    arguments.insert(arguments.end(), {"--out", (folder_ / "x").string()});
    const Ended ended = run(arguments);
    EXPECT_EQ(ended.exit_code, 2) << ended.err;
    return ended.err;
  };
  EXPECT_TRUE(contains(refused({"--left", finger("left")}), "none on the right"));
  EXPECT_TRUE(contains(refused({finger("left"), "--left", "a", "--right", "b"}), "a third input"));
  EXPECT_TRUE(contains(refused({finger("left"), "--grip", "grip.json"}), "two fingers for --grip"));
  EXPECT_TRUE(contains(refused({"--camera", "left=1-1", "--camera", "/dev/video1"}), "a side for each"));
}

TEST_F(PairProgram, ACrashLeavesBothSessionsAndTheRows) {
  const fs::path folder = folder_ / "grip";
  std::vector<std::string> arguments = record(folder, "&repeat=0");
  const pid_t child = start(arguments);
  ASSERT_TRUE(eventually([&] {
    const std::string rows = fs::exists(folder / "pairs.csv") ? slurp(folder / "pairs.csv") : "";
    return std::count(rows.begin(), rows.end(), '\n') > 120;
  }));
  kill(child, SIGKILL);
  finish(child);
  const std::string rows = slurp(folder / "pairs.csv");
  EXPECT_EQ(rows.back(), '\n');
  const Ended measured = run({"process", folder, "--out", folder_ / "again", "--json"});
  ASSERT_EQ(measured.exit_code, 0) << measured.err;
  // What both sessions kept pairs as it did then: all rows but those of the end, where one side may be alone.
  const std::string again = slurp(folder_ / "again" / "pairs.csv");
  const Table before(rows), after(again);
  ASSERT_GT(after.rows.size(), 60u);
  for (size_t i = 0; i + 30 < std::min(before.rows.size(), after.rows.size()); ++i)
    for (const char* column : {"time_s", "left_frame", "right_frame", "grip_force_N", "load_z_N"})
      EXPECT_EQ(after.at(i, column), before.at(i, column)) << i;
}

// The log of the opening, which comes with the first row, is longer than 150 kB, the frames than 400 kB.
TEST_F(PairProgram, AFullDiskEndsBothSessionsAndKeepsWhatTheyHold) {
  for (const rlim_t most_B : {150'000, 400'000}) {
    const fs::path folder = folder_ / std::to_string(most_B);
    const Ended ended = run(record(folder, "&repeat=12"), {.largest_file_bytes = most_B});
    EXPECT_EQ(ended.exit_code, 7) << ended.err;
    const size_t said = ended.err.find("the recording ended early: ");
    ASSERT_NE(said, std::string::npos) << ended.err;
    const std::string line = ended.err.substr(said);
    EXPECT_TRUE(contains(line, "file too large")) << line;
    EXPECT_EQ(line.find('\n'), line.size() - 1) << line;
    const Json value = parse_json(ended.out);
    EXPECT_EQ(value["complete"], false);
    const Table rows(slurp(folder / "pairs.csv"));
    rows.expect_whole();
    EXPECT_EQ(value["rows"], rows.rows.size());
    const bool of_frames = most_B > 300'000;
    EXPECT_EQ(of_frames, !rows.rows.empty());
    const auto into = [&](const std::string& what) { return folder_ / (what + folder.filename().string()); };
    for (const char* side : {"left", "right"}) {
      const Ended one = run({"process", folder / side, "--as-recorded", "--json", "--out", into(side)});
      EXPECT_EQ(one.exit_code, 0) << one.err;
      const Json as_recorded = parse_json(one.out)["as_recorded"];
      EXPECT_EQ(as_recorded["different"], 0);
      // Each frame that the session holds has its row, and a few more may that it does not.
      EXPECT_GE(rows.rows.size(), of_frames ? as_recorded["equal"].get<size_t>() : 0);
    }
    const Ended again = run({"process", folder, "--json", "--out", into("again")});
    EXPECT_EQ(again.exit_code, 0) << again.err;
  }
}

}  // namespace
}  // namespace palpate
