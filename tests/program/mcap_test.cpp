// `palpate export --mcap`, read by the libraries of the format's makers (tests/clients) and compared with the
// session to the last digit.
#include <csignal>
#include <cstdlib>

#include "capture/files/event_log.h"
#include "tests/support/clients.h"
#include "tests/support/eventually.h"
#include "tests/support/json.h"
#include "tests/support/program_fixture.h"

namespace palpate {
namespace {

class McapFile : public Program {
 protected:
  void SetUp() override {
    Program::SetUp();
    if (clients_folder().empty()) GTEST_SKIP() << "NOT CHECKED: npm brings no reader of MCAP here";
  }
  /// What the reader says of a file.
  Json read(const fs::path& file, const std::string& arguments) {
    const fs::path answer = folder_ / "answer.json";
    const std::string command = "node '" + (clients_folder() / "mcap.mjs").string() + "' '" + file.string() +
                                "' " + arguments + " >'" + answer.string() + "'";
    EXPECT_EQ(std::system(command.c_str()), 0) << slurp(answer);
    return parse_json(slurp(answer));
  }
  fs::path session(const std::string& scene, const std::vector<std::string>& more = {}) {
    const fs::path at = folder_ / "session";
    std::vector<std::string> arguments = {"record", "synthetic:" + scene, "--out", at, "--frames", "40"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const Ended ended = Program::run(arguments);
    EXPECT_EQ(ended.exit_code, 0) << ended.err;
    return at;
  }
};

TEST_F(McapFile, SaysWhatTheSessionSays) {
  const fs::path from =
      session("press?mode=gel&size=320x240&skin=texture", {"--outputs", "surface,skin,traction"});
  viz::append_event(from, {.frame = 7, .time_s = 0.25, .kind = "mark", .text = "a, \"b\""});
  viz::append_event(from, {.frame = 400, .time_s = 9, .kind = "mark", .text = "behind the end"});
  const fs::path out = folder_ / "out";
  ASSERT_EQ(run({"export", from, "--out", out, "--mcap", "--cloud", "--csv"}).exit_code, 0);
  const Json all = read(out / "recording.mcap", "'" + (from / "frames.csv").string() + "' --exact");
  EXPECT_EQ(all.at("profile"), "ros2");
  EXPECT_EQ(all.at("attachments"), (std::vector<std::string>{"sensor.json", "session.json"}));
  EXPECT_GT(all.at("cells"), 40 * 20);
  std::map<std::string, int> messages;
  std::string sensor;
  for (const auto& [topic, found] : all.at("topics").items()) {
    const size_t slash = topic.find('/', 1);
    sensor = topic.substr(1, slash - 1);
    messages[topic.substr(slash + 1)] = found.at("messages");
  }
  for (const char* each : {"image", "depth", "cloud", "touch"}) EXPECT_EQ(messages[each], 40) << each;
  EXPECT_EQ(messages["events"], 2);
  EXPECT_GT(messages["wrench"], 0);
  EXPECT_LT(messages["wrench"], 40);  // not before something touches
  const std::string yaml = slurp(out / "metadata.yaml");
  EXPECT_NE(yaml.find("name: /" + sensor + "/wrench\n"), std::string::npos) << yaml;
  EXPECT_NE(yaml.find("message_count: " + std::to_string(120 + messages["wrench"]) + "\n"),
            std::string::npos);
  EXPECT_EQ(yaml.find("touch"), std::string::npos);  // rosbag2 plays its own messages only
}

TEST_F(McapFile, HoldsTwoFingersAndTheirRows) {
  const fs::path from = folder_ / "grip", out = folder_ / "out";
  const auto finger = [](const char* side) {
    return std::string("synthetic:grip?size=160x120&weight_N=0.6&skew_ms=5&side=") + side;
  };
  ASSERT_EQ(
      run({"record", "--left", finger("left"), "--right", finger("right"), "--frames", "60", "--out", from})
          .exit_code,
      0);
  ASSERT_EQ(run({"export", from, "--out", out, "--mcap"}).exit_code, 0);
  for (const std::string side : {"left", "right"}) {
    const Json all = read(out / "recording.mcap",
                          "'" + (from / side / "frames.csv").string() + "' --exact --of /" + side + "/");
    EXPECT_EQ(all.at("topics").at("/" + side + "/synthetic_waveguide/touch").at("messages"), 60);
    EXPECT_EQ(all["topics"].at("/" + side + "/synthetic_waveguide/image").at("messages"), 60);
    EXPECT_EQ(all["topics"].at("/pair").at("messages"), 60);
    EXPECT_GT(all.at("cells"), 60 * 10);
  }
  const std::string yaml = slurp(out / "metadata.yaml");
  EXPECT_NE(yaml.find("name: /left/synthetic_waveguide/wrench\n"), std::string::npos) << yaml;
  expect_refusal({"export", from, "--out", out, "--csv"}, 2, {"two fingers", "left"});
}

TEST_F(McapFile, IsWrittenWhileRecording) {
  const fs::path from = session("press?mode=gel&size=160x120", {"--mcap", "--json"});
  const Json said = parse_json(slurp(folder_ / "stdout"));
  EXPECT_EQ(said.at("mcap").at("written"), 40);
  EXPECT_EQ(said["mcap"].at("dropped"), 0);
  EXPECT_EQ(said["mcap"].at("bytes"), fs::file_size(from / "recording.mcap"));
  const Json all = read(from / "recording.mcap", "'" + (from / "frames.csv").string() + "' --exact");
  EXPECT_EQ(all.at("topics").at("/synthetic_gel/touch").at("messages"), 40);
  EXPECT_EQ(all["topics"].at("/synthetic_gel/depth").at("messages"), 40);
  EXPECT_LT(std::stol(all.at("metadata").at("clock_error_ns").get<std::string>()), 1'000'000'000);
  EXPECT_EQ(run({"process", from, "--out", folder_ / "again", "--as-recorded"}).exit_code, 0);
}

TEST_F(McapFile, IsReadAfterAKill) {
  const fs::path at = folder_ / "session" / "recording.mcap";
  const pid_t child = start({"record", "synthetic:press?mode=gel&size=320x240&repeat=0", "--rate", "30",
                             "--mcap", "--out", at.parent_path()});
  EXPECT_TRUE(eventually([&] { return fs::exists(at) && fs::file_size(at) > 3'000'000; }));
  kill(child, SIGKILL);
  EXPECT_EQ(finish(child).exit_code, 1000 + SIGKILL);
  EXPECT_GE(read(at, "--cut 3").at("chunks"), 2);
}

TEST_F(McapFile, IsReadUpToItsLastWholeChunkWhereverItIsCut) {
  // Frames that fill a chunk each.
  const fs::path from = session("press?mode=gel&size=320x240");
  const fs::path out = folder_ / "out";
  ASSERT_EQ(run({"export", from, "--out", out, "--mcap", "--cloud", "--frames", "0:5"}).exit_code, 0);
  const Json cut = read(out / "recording.mcap", "--cut 12");
  EXPECT_GE(cut.at("chunks"), 5);
  EXPECT_GE(cut.at("cuts"), 27);
}

TEST_F(McapFile, HoldsPicturesWithoutTimesAndThoseThatAreUncalibrated) {
  const fs::path rec = recording(5), out = folder_ / "out";
  const fs::path pictures = rec / "frames";
  ASSERT_TRUE(fs::is_directory(pictures));
  ASSERT_EQ(run({"export", pictures, "--out", out, "--mcap", "--csv"}).exit_code, 0);
  const Json all = read(out / "recording.mcap", "'" + (out / "measurements.csv").string() + "'");
  EXPECT_EQ(all.at("metadata").at("stamps"), "pictures without times, 0.1 s apart");
  EXPECT_FALSE(all.at("metadata").contains("mm_per_px"));
}

TEST_F(Program, AnMcapFileThatDoesNotFitOnTheDiskIsOneLine) {
  expect_refusal({"export", "synthetic:press?mode=gel&size=160x120", "--out", folder_ / "out", "--mcap"}, 7,
                 {"recording.mcap", "file too large"}, {.largest_file_bytes = 300000});
  EXPECT_FALSE(fs::exists(folder_ / "out" / "metadata.yaml"));
  expect_refusal({"export", "synthetic:press", "--out", folder_ / "out", "--cloud", "--csv"}, 2, {"--mcap"});
}

}  // namespace
}  // namespace palpate
