// Sessions on the command line: record, process, replay.

#include "tests/support/eventually.h"
#include "tests/support/json.h"
#include "tests/support/program_fixture.h"
#include "viz/render/desktop.h"

namespace palpate {
namespace {

class RecordProgram : public Program {
 protected:
  const std::string scene_ = "synthetic:slide?mode=lambert&size=160x120&rate=60";

  fs::path record(const std::vector<std::string>& more = {}) {
    const fs::path session = folder_ / "session";
    std::vector<std::string> arguments{"record", scene_, "--out", session, "--frames", "90"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const Ended ended = run(arguments);
    EXPECT_EQ(ended.exit_code, 0) << ended.err;
    return session;
  }
  Json as_recorded(const fs::path& session) {
    const Ended ended = run({"process", session, "--as-recorded", "--json", "--out", folder_ / "again"});
    EXPECT_EQ(ended.exit_code, 0) << ended.err;
    return parse_json(ended.out);
  }
};

TEST_F(RecordProgram, ASessionMeasuresAgainToTheLastDigit) {
  const fs::path session = record();
  for (const char* file : {"frames.mkv", "frames.csv", "session.json"})
    EXPECT_TRUE(fs::exists(session / file)) << file;
  const Table rows(slurp(session / "frames.csv"));
  rows.expect_whole();
  ASSERT_EQ(rows.rows.size(), 90u);
  for (size_t i = 0; i < rows.rows.size(); ++i) {
    EXPECT_EQ(rows.at(i, "frame"), std::to_string(i));
    EXPECT_EQ(rows.at(i, "measured"), "1");
  }
  const Json value = as_recorded(session);
  EXPECT_EQ(value["as_recorded"]["equal"], 90);
  EXPECT_EQ(value["as_recorded"]["different"], 0) << value["as_recorded"]["first_difference"];
}

TEST_F(RecordProgram, AChangedRowIsNoticed) {
  const fs::path session = record();
  std::string rows = slurp(session / "frames.csv");
  const Table table(rows);
  const std::string depth = table.at(60, "depth_max_mm");
  ASSERT_GT(depth.size(), 4u);
  std::string wrong = depth;
  wrong.back() = wrong.back() == '1' ? '2' : '1';
  rows.replace(rows.find(depth), depth.size(), wrong);
  spill(session / "frames.csv", rows);
  const Json value = as_recorded(session);
  EXPECT_EQ(value["as_recorded"]["different"], 1);
  EXPECT_TRUE(contains(value["as_recorded"]["first_difference"], "frame 60: depth_max_mm")) << value;
}

// Earlier versions wrote a shear of 0 for separate pictures, of which no table has shear.
TEST_F(RecordProgram, SeparatePicturesAreComparedInWhatTheyHave) {
  const fs::path pictures = folder_ / "pictures", session = folder_ / "session";
  ASSERT_EQ(run({"export", scene_, "--images", "png", "--frames", "30:34", "--out", pictures}).exit_code, 0);
  const Ended ended =
      run({"record", pictures / "images", "--sensor", pictures / "sensor.json", "--out", session});
  ASSERT_EQ(ended.exit_code, 0) << ended.err;
  EXPECT_EQ(parse_json(slurp(session / "session.json"))["measured"]["separate_pictures"], true);
  const std::string rows = slurp(session / "frames.csv");
  const auto changed = [&](const std::string& column) {
    const Table table(rows);
    std::string text = rows.substr(0, rows.find('\n') + 1);
    for (size_t i = 0; i < table.rows.size(); ++i) {
      for (const std::string& name : table.columns)
        text += (name == table.columns.front() ? "" : ",") + (name == column ? "0" : table.at(i, name));
      text += '\n';
    }
    spill(session / "frames.csv", text);
    return as_recorded(session)["as_recorded"]["different"];
  };
  EXPECT_EQ(changed("shear_x_N"), 0);
  EXPECT_EQ(changed("shift_x_mm"), 0);
  EXPECT_EQ(changed("peak_gray"), 4);
}

TEST_F(RecordProgram, ProcessingASessionIsProcessingWhatWasRecorded) {
  const fs::path session = record();
  ASSERT_EQ(run({"process", session, "--out", folder_ / "a"}).exit_code, 0);
  ASSERT_EQ(run({"process", scene_, "--frames", "90", "--out", folder_ / "b"}).exit_code, 0);
  const Table a(slurp(folder_ / "a" / "measurements.csv")), b(slurp(folder_ / "b" / "measurements.csv"));
  ASSERT_EQ(a.rows.size(), 90u);
  ASSERT_EQ(b.rows.size(), 90u);
  for (size_t i = 0; i < 90; ++i) {
    for (const std::string& column : a.columns) {
      if (column.rfind("shear", 0) == 0) continue;  // a session begins with a gap
      EXPECT_EQ(a.at(i, column), b.at(i, column)) << "frame " << i << ", " << column;
    }
  }
}

TEST_F(RecordProgram, PlayedAtARateAllFramesAreThereAndTheMeasuredOnesAgain) {
  const fs::path session = record({"--rate", "240"});
  const Json value = as_recorded(session);
  const Json json = parse_json(slurp(session / "session.json"));
  EXPECT_EQ(json["complete"], true);
  EXPECT_EQ(value["as_recorded"]["different"], 0) << value["as_recorded"]["first_difference"];
  EXPECT_GT(value["as_recorded"]["equal"], 0);  // how many were measured in time is the machine's affair
}

TEST_F(RecordProgram, RefusesWhatWouldLoseOrMeansNothing) {
  const fs::path session = record();
  expect_refusal({"record", scene_, "--out", session}, 7, {session, "session"});
  EXPECT_EQ(Table(slurp(session / "frames.csv")).rows.size(), 90u);
  expect_refusal({"record", "--out", folder_ / "new"}, 2, {"--camera"});
  expect_refusal({"record", "--camera", "/dev/video97", "--out", folder_ / "new"}, 5, {"/dev/video97"});
  expect_refusal({"process", scene_, "--as-recorded", "--out", folder_ / "out"}, 2,
                 {"--as-recorded", "session"});
}

TEST_F(RecordProgram, CtrlCEndsARecordingThatIsWhole) {
  const fs::path session = folder_ / "session";
  const pid_t child = start(
      {"record", "synthetic:slide?mode=lambert&size=160x120&repeat=0", "--rate", "120", "--out", session});
  ASSERT_TRUE(eventually(
      [&] { return fs::exists(session / "frames.csv") && fs::file_size(session / "frames.csv") >= 6000; }));
  kill(child, SIGINT);
  const Ended ended = finish(child);
  EXPECT_EQ(ended.exit_code, 130) << ended.err;
  EXPECT_EQ(parse_json(slurp(session / "session.json"))["complete"], true);
  EXPECT_EQ(as_recorded(session)["as_recorded"]["different"], 0);
}

TEST_F(RecordProgram, KilledItKeepsWhatItHad) {
  const fs::path session = folder_ / "session";
  const pid_t child = start(
      {"record", "synthetic:slide?mode=lambert&size=160x120&repeat=0", "--rate", "120", "--out", session});
  ASSERT_TRUE(eventually(
      [&] { return fs::exists(session / "frames.mkv") && fs::file_size(session / "frames.mkv") >= 200000; }));
  kill(child, SIGKILL);
  EXPECT_EQ(finish(child).exit_code, 1000 + SIGKILL);
  const Ended processed = run({"process", session, "--json", "--out", folder_ / "out"});
  EXPECT_EQ(processed.exit_code, 0) << processed.err;
  const Json value = parse_json(processed.out);
  EXPECT_GT(value["frames"], 5);
  EXPECT_TRUE(value.contains("warning")) << value;
}

TEST_F(RecordProgram, AFullDiskEndsTheRecordingAndSaysSo) {
  const fs::path session = folder_ / "session";
  Surroundings full;
  full.largest_file_bytes = 200'000;
  const Ended ended = run({"record", scene_, "--out", session, "--json"}, full);
  EXPECT_EQ(ended.exit_code, 7) << ended.err;
  const Json value = parse_json(ended.out);
  EXPECT_EQ(value["complete"], false);
  EXPECT_FALSE(value["sessions"][0]["error"].get<std::string>().empty());
  const Ended processed = run({"process", session, "--json", "--out", folder_ / "out"});
  EXPECT_EQ(processed.exit_code, 0) << processed.err;
  EXPECT_GT(parse_json(processed.out)["frames"], 5);
}

TEST_F(RecordProgram, LiveRecordsAndReplayShows) {
  if (!viz::display_available()) GTEST_SKIP() << "no display";
  const Ended live =
      run({"live", scene_, "--frames", "80", "--close", "--out", folder_ / "live", "--record", "--json"});
  ASSERT_EQ(live.exit_code, 0) << live.err;
  const Json value = parse_json(live.out);
  ASSERT_EQ(value["sessions"].size(), 1u);
  const Json& recorded = value["sessions"][0];
  EXPECT_EQ(recorded["recorded"].get<int>() + recorded["dropped"].get<int>(), 80);
  EXPECT_EQ(Table(slurp(folder_ / "live" / "latency.csv")).rows.size(), value["processed"].get<size_t>());
  const fs::path session = recorded["folder"].get<std::string>();
  EXPECT_EQ(as_recorded(session)["as_recorded"]["different"], 0);

  const Ended replay = run({"replay", session, "--speed", "4", "--close", "--json"});
  EXPECT_EQ(replay.exit_code, 0) << replay.err;
  EXPECT_EQ(parse_json(replay.out)["captured"], recorded["written"]);
  EXPECT_GT(parse_json(replay.out)["shown"], 0);
  expect_refusal({"replay", scene_}, 3, {"recording", scene_});
  expect_refusal({"replay", session, "--from", "1000"}, 2, {"--from"});
}

}  // namespace
}  // namespace palpate
