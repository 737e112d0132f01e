// `palpate serve` with the client of the protocol's makers (tests/clients), and what it refuses.
#include <sys/wait.h>

#include <csignal>
#include <future>

#include "tests/support/clients.h"
#include "tests/support/eventually.h"
#include "tests/support/free_port.h"
#include "tests/support/json.h"
#include "tests/support/program_fixture.h"

namespace palpate {
namespace {

TEST_F(Program, ServesWhatItWritesToTheProtocolsOwnClient) {
  if (clients_folder().empty())
    GTEST_SKIP() << "NOT CHECKED: npm brings no client of Foxglove's protocol here";
  const std::string port = free_port();
  const fs::path out = folder_ / "out", answer = folder_ / "answer.json";
  const pid_t server = start({"serve", "synthetic:palpation?size=160x120&rate=30&repeat=0", "--seconds", "8",
                              "--port", port, "--out", out, "--json"});
  const std::string command = "node '" + (clients_folder() / "live.mjs").string() + "' " + port + " '" +
                              (out / "measurements.csv").string() + "' >'" + answer.string() + "'";
  EXPECT_EQ(std::system(command.c_str()), 0) << slurp(answer);
  const Ended ended = finish(server);
  EXPECT_EQ(ended.exit_code, 0) << ended.err;
  EXPECT_TRUE(contains(ended.err, "serving at http://localhost:" + port + "/")) << ended.err;
  const Json found = parse_json(slurp(answer));
  EXPECT_EQ(found["topics"].size(), 8u) << found;
  for (const auto& [topic, messages] : found["topics"].items()) EXPECT_GT(messages, 0) << topic;
  EXPECT_GT(found["touches"], 20);
  EXPECT_GT(found["cells"], 1000);
  EXPECT_EQ(found["services"].size(), 5u);
  EXPECT_EQ(found["events"][0]["event"], "mark");
  EXPECT_EQ(found["events"][0]["text"], "here");
  EXPECT_TRUE(contains(found["answers"]["4"], "a session to stop")) << found["answers"];
  EXPECT_TRUE(contains(slurp(out / "events.csv"), "mark,here"));
  const Json report = parse_json(ended.out);
  EXPECT_EQ(report["served"]["clients"], 1);
  EXPECT_GT(report["served"]["messages"], 100);
}

/// Both fingers' touches and each pair's row are what the session has, as the protocol's own client reads
/// them.
void expect_served_pair(const fs::path& program_folder, const fs::path& out, const std::string& port) {
  const fs::path answer = program_folder / "answer.json";
  const std::string command = "node '" + (clients_folder() / "live.mjs").string() + "' " + port + " '" +
                              out.string() + "' pair >'" + answer.string() + "'";
  EXPECT_EQ(std::system(command.c_str()), 0) << slurp(answer);
  const Json found = parse_json(slurp(answer));
  EXPECT_EQ(found["topics"].size(), 17u) << found;
  for (const auto& [topic, messages] : found["topics"].items()) EXPECT_GT(messages, 0) << topic;
  EXPECT_GT(found["grips"], 60);
  EXPECT_GT(found["cells"], 3000);
  EXPECT_GE(found["zeros"], 1);
  EXPECT_LE(found["zeros"], 2);  // rounded
  std::vector<std::string> services = found["services"];
  EXPECT_EQ(services,
            (std::vector<std::string>{"/grip/zero", "/grip/mark", "/grip/start", "/grip/stop", "/view"}));
  for (const auto& [call, said] : found["answers"].items()) EXPECT_TRUE(said.is_object()) << said;
}

TEST_F(Program, ServesTwoFingersAndTheirGrip) {
  if (clients_folder().empty())
    GTEST_SKIP() << "NOT CHECKED: npm brings no client of Foxglove's protocol here";
  const auto finger = [](const std::string& side) {
    return "synthetic:grip?size=160x120&weight_N=0.6&skew_ms=5&repeat=0&side=" + side;
  };
  const std::string port = free_port();
  const std::vector<std::string> both = {"--left", finger("left"), "--right", finger("right"), "--seconds",
                                         "6",      "--port",       port,      "--json"};
  for (const std::vector<std::string>& command :
       {std::vector<std::string>{"serve", "--record"}, {"record", "--serve"}}) {
    SCOPED_TRACE(command.front());
    const fs::path out = folder_ / command.front();
    std::vector<std::string> arguments = command;
    arguments.insert(arguments.end(), both.begin(), both.end());
    arguments.insert(arguments.end(), {"--out", out.string()});
    const pid_t server = start(arguments);
    expect_served_pair(folder_, out, port);
    const Ended ended = finish(server);
    EXPECT_EQ(ended.exit_code, 0) << ended.err;
    const Json report = parse_json(ended.out);
    EXPECT_EQ(report["served"]["clients"], 1);
    EXPECT_GT(report["rows"], 60);
    fs::path session = out;
    if (!fs::exists(session / "pairs.csv")) session = fs::directory_iterator(out)->path();
    for (const char* side : {"left", "right"})
      EXPECT_TRUE(contains(slurp(session / side / "events.csv"), "mark,here")) << side;
  }
}

TEST_F(Program, ServesWhatItProcesses) {
  if (clients_folder().empty())
    GTEST_SKIP() << "NOT CHECKED: npm brings no client of Foxglove's protocol here";
  const std::string port = free_port();
  const fs::path out = folder_ / "out", answer = folder_ / "answer.json";
  const pid_t server = start({"process", "synthetic:palpation?size=160x120&repeat=0", "--serve", "--port",
                              port, "--out", out, "--json"});
  const std::string command = "node '" + (clients_folder() / "live.mjs").string() + "' " + port + " '" +
                              (out / "measurements.csv").string() + "' >'" + answer.string() + "'";
  std::future<int> client = std::async(std::launch::async, [&] { return std::system(command.c_str()); });
  // The client marks after a while; it is told of the end, and compares then.
  EXPECT_TRUE(eventually([&] { return fs::exists(out / "events.csv"); }));
  kill(server, SIGINT);
  const Ended ended = finish(server);
  EXPECT_EQ(ended.exit_code, 130) << ended.err;
  EXPECT_EQ(client.get(), 0) << slurp(answer);
  const Json found = parse_json(slurp(answer));
  EXPECT_GT(found["touches"], 3);
  EXPECT_EQ(found["code"], 1001) << found;
  EXPECT_EQ(parse_json(ended.out)["served"]["clients"], 1);
}

/// The exit code of browser.mjs, 2 where it cannot run.
int show_page(const fs::path& program, const fs::path& folder, const std::string& kind) {
  const char* chromium = "/usr/bin/chromium";
  if (clients_folder().empty() || !fs::exists(chromium)) return 2;
  const fs::path answer = folder / "answer.json";
  const std::string command = "node '" + (clients_folder() / "browser.mjs").string() + "' '" +
                              program.string() + "' " + chromium + " " + free_port() + " '" +
                              folder.string() + "' " + kind + " >'" + answer.string() + "'";
  const int status = WEXITSTATUS(std::system(command.c_str()));
  EXPECT_TRUE(status == 0 || status == 2) << slurp(answer);
  return status;
}

TEST_F(Program, ServesAPageThatDrawsAndComesBack) {
  if (show_page(program_, folder_, "") == 2)
    GTEST_SKIP() << "NOT CHECKED: Chromium does not start here, or npm brings no WebSocket";
}

TEST_F(Program, ServesAPageOfTwoFingers) {
  if (show_page(program_, folder_, "pair") == 2)
    GTEST_SKIP() << "NOT CHECKED: Chromium does not start here, or npm brings no WebSocket";
}

TEST_F(Program, ServesNobodyWhoMayNotConnect) {
  expect_refusal({"serve", "--address", "0.0.0.0", "--frames", "1"}, 2,
                 {"a token, to serve others", "--token"});
  expect_refusal({"serve", "--address", "nowhere", "--frames", "1"}, 2, {"an address of this machine"});
  expect_refusal({"serve", "--token", "short", "--frames", "1"}, 2, {"a token of at least 16 letters"});
  expect_refusal({"serve", "--port", "70000"}, 2, {"--port"});
  expect_refusal({"serve", "--record"}, 2, {"--out DIR"});
  expect_refusal({"serve", "--left", "a"}, 2, {"none on the right"});
  expect_refusal({"serve", "--left", "a", "--right", "b", "--loop"}, 2, {"one finger for --loop"});
}

}  // namespace
}  // namespace palpate
