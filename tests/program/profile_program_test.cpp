// palpate profile as a program: files that are not profiles, comparisons, folders, bad command lines.
#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include <functional>
#include <string>
#include <vector>

#include "perf/profile/profile.h"
#include "perf/profile/report/files.h"
#include "tests/program/made_up_profile.h"
#include "tests/support/eventually.h"
#include "tests/support/json.h"
#include "tests/support/program_fixture.h"

namespace palpate::perf {
namespace {

class ProfileProgram : public Program {
 protected:
  fs::path file(const std::string& name, const std::string& text) {
    spill(folder_ / name, text);
    return folder_ / name;
  }
};

TEST_F(ProfileProgram, RefusesFilesThatAreNoProfiles) {
  const std::string good = file_text(made_up("A", 2));
  const fs::path a = file("a.json", good);
  const auto changed = [&](const std::string& name, const std::function<void(Json&)>& change) {
    Json value = parse_json(good);
    change(value);
    return file(name, value.dump());
  };
  const auto refuse = [&](const fs::path& b, const std::vector<std::string>& words) {
    expect_refusal({"profile", "--compare", a, b}, 3, words);
  };
  refuse(folder_ / "none.json", {"none.json", "no such file"});
  refuse(folder_, {"no such file"});
  refuse(file("cut.json", good.substr(0, good.size() / 2)), {"cut.json", "damaged JSON, an error at line"});
  refuse(file("empty.json", ""), {"damaged JSON"});
  std::string nan = good;
  nan.replace(nan.find("\"GB_per_s\": "), 14, "\"GB_per_s\": NaN");
  refuse(file("nan.json", nan), {"damaged JSON, an error at line"});
  refuse(file("other.json", "{\"devices\": []}"), {"JSON of another kind"});
  refuse(file("list.json", "[1, 2]"), {"JSON of another kind"});
  refuse(changed("version.json", [](Json& v) { v["palpate_profile"] = 99; }), {"version 99"});
  refuse(changed("null.json", [](Json& v) { v["sizes"][0]["latency"]["median_ms"] = nullptr; }),
         {"null at /sizes/0/latency/median_ms"});
  refuse(changed("negative.json", [](Json& v) { v["sizes"][1]["cpu_ms"] = -1.5; }),
         {"-1.5 at /sizes/1/cpu_ms"});
  refuse(changed("missing.json", [](Json& v) { v["machine"].erase("driver"); }), {"'driver' not found"});
  refuse(changed("text.json", [](Json& v) { v["sizes"][0]["width_px"] = "wide"; }), {"must be whole number"});
  refuse(changed("zero.json", [](Json& v) { v["sizes"][0]["width_px"] = 0; }), {"no size"});
}

TEST_F(ProfileProgram, ComparesFiles) {
  const fs::path a = file("a.json", file_text(made_up("A", 2))),
                 b = file("b.json", file_text(made_up("B", 3))),
                 c = file("c.json", file_text(made_up("C", 8)));
  const Ended ended = run({"profile", "--compare", a, b, c, "--out", folder_ / "out"});
  EXPECT_EQ(ended.exit_code, 0) << ended.err;
  EXPECT_TRUE(contains(ended.out, "1.50 times as long on B"));
  EXPECT_TRUE(contains(ended.out, "4.00 times as long on C"));
  expect_self_contained(slurp(folder_ / "out" / "compare.html"));
  const palpate::Table table(slurp(folder_ / "out" / "compare.csv"));
  table.expect_whole();
  EXPECT_EQ(table.at(1, "ratio_to_a"), "1.5");
  const Json json = parse_json(run({"profile", "--compare", a, b, "--json"}).out);
  EXPECT_NEAR(json.at("machines").at(1).at("frame_ratio"), 1.5, 1e-9);
}

TEST_F(ProfileProgram, WritesAFolderEvenWithoutGnuplot) {
  const fs::path out = folder_ / "out";
  fs::create_directories(folder_ / "no-programs");
  Surroundings around;
  around.environment["PATH"] = folder_ / "no-programs";
  const Ended ended =
      run({"profile", "--quick", "--sizes", "64x48", "--budget", "1", "--out", out, "--json"}, around);
  EXPECT_EQ(ended.exit_code, 0) << ended.err;
  EXPECT_TRUE(contains(ended.err, "gnuplot is not installed")) << ended.err;
  EXPECT_EQ(parse_json(ended.out), parse_json(slurp(out / "profile.json")));
  EXPECT_TRUE(load_profile(out / "profile.json").complete);
  for (const char* name :
       {"frames.csv", "stages.csv", "solvers.csv", "outputs.csv", "ceiling.csv", "latency.csv", "live.csv"})
    EXPECT_FALSE(palpate::Table(slurp(out / name)).rows.empty()) << name;
  const std::string html = slurp(out / "report.html");
  expect_self_contained(html);
  EXPECT_TRUE(contains(html, "No plots"));
  for (const auto& entry : fs::directory_iterator(out))
    EXPECT_FALSE(contains(entry.path().filename().string(), "partial")) << entry.path();
}

TEST_F(ProfileProgram, CtrlCKeepsWhatIsFinished) {
  const fs::path out = folder_ / "out";
  const pid_t child =
      start({"profile", "--out", out, "--budget", "600", "--sizes", "64x48,640x480", "--quiet"});
  ASSERT_TRUE(eventually([&] { return fs::exists(out / "profile.json"); }));
  kill(child, SIGINT);
  const Ended ended = finish(child);
  EXPECT_EQ(ended.exit_code, 130) << ended.err;
  const Profile profile = load_profile(out / "profile.json");
  EXPECT_FALSE(profile.complete);
  EXPECT_GT(profile.ceiling.GB_per_s, 0);
  EXPECT_TRUE(contains(slurp(out / "report.html"), "ended before it was complete"));
}

TEST_F(ProfileProgram, RefusesBadCommandLines) {
  expect_refusal({"profile"}, 2, {"--out"});
  const std::string out = folder_ / "out";
  expect_refusal({"profile", "--out", out, "--sizes", "640"}, 2, {"'640'"});
  expect_refusal({"profile", "--out", out, "--sizes", "640x480,0x5"}, 2, {"'0x5'"});
  expect_refusal({"profile", "--out", out, "--sizes", "20000x10"}, 2, {"20000x10"});
  expect_refusal({"profile", "--out", out, "--budget", "0"}, 2, {"--budget"});
  expect_refusal({"profile", "--compare", "a.json"}, 2, {"--compare"});
  expect_refusal({"profile", "--compare", "a.json", "b.json", "--quick"}, 2, {"--compare"});
  expect_refusal({"profile", "--out", out, "--all-devices", "--device", "0"}, 2, {"--device"});
  expect_refusal({"profile", "--out", out, "--device", "no such thing"}, 5, {"no such thing"});
  EXPECT_FALSE(fs::exists(out));
}

}  // namespace
}  // namespace palpate::perf
