// --trace: each thread's spans as whole JSON, nested as they ran, also of a run that Ctrl-C or a kill ended.
#include <gtest/gtest.h>

#include <algorithm>
#include <csignal>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "tests/support/eventually.h"
#include "tests/support/json.h"
#include "tests/support/program_fixture.h"

namespace palpate {
namespace {

struct Span {
  std::string name;
  double begin_us = 0, end_us = 0;
};
using Spans = std::map<std::string, std::vector<Span>>;  ///< by thread

/// Every span of a thread lies within another one of it, or apart from it.
void expect_nested(const std::string& thread, std::vector<Span> spans) {
  constexpr double kRounding_us = 0.002;
  std::ranges::sort(spans, [](const Span& a, const Span& b) {
    return a.begin_us != b.begin_us ? a.begin_us < b.begin_us : a.end_us > b.end_us;
  });
  std::vector<Span> open;
  for (const Span& span : spans) {
    while (!open.empty() && open.back().end_us <= span.begin_us + kRounding_us) open.pop_back();
    if (!open.empty()) {
      EXPECT_LE(span.end_us, open.back().end_us + kRounding_us)
          << thread << ": " << span.name << " begins in " << open.back().name << " and outlasts it";
    }
    open.push_back(span);
  }
}

class TraceProgram : public Program {
 protected:
  static Spans read(const fs::path& file) {
    Spans spans;
    std::map<int, std::string> names;
    for (const Json& event : parse_json(slurp(file))) {
      const int thread = event.at("tid");
      if (event.at("ph") == "M") {
        names[thread] = event.at("args").at("name");
        continue;
      }
      EXPECT_EQ(event.at("ph"), "X");
      const double begin_us = event.at("ts"), long_us = event.at("dur");
      EXPECT_GE(begin_us, 0);
      EXPECT_GE(long_us, 0);
      spans[names.at(thread)].push_back({event.at("name"), begin_us, begin_us + long_us});
    }
    for (const auto& [thread, of] : spans) expect_nested(thread, of);
    return spans;
  }
  static size_t count_of(const std::string& text, const std::string& words) {
    size_t count = 0;
    for (size_t at = text.find(words); at != std::string::npos; at = text.find(words, at + 1)) ++count;
    return count;
  }
  static size_t count(const std::vector<Span>& spans, const std::string& name) {
    return static_cast<size_t>(std::ranges::count(spans, name, &Span::name));
  }
};

TEST_F(TraceProgram, HasEveryThreadAndFrame) {
  const fs::path file = folder_ / "trace.json";
  ASSERT_EQ(run({"process", "synthetic:press?size=96x80&mode=gel", "--frames", "12", "--out", folder_ / "out",
                 "--outputs", "force,contacts,surface", "--trace", file})
                .exit_code,
            0);
  Spans spans = read(file);
  std::set<std::string> threads;
  for (const auto& [thread, of] : spans) threads.insert(thread);
  EXPECT_EQ(threads, (std::set<std::string>{"capture", "engine", "main"}));
  EXPECT_GE(count(spans["capture"], "capture"), 12u);
  EXPECT_EQ(count(spans["main"], "write"), 12u);
  for (const char* name : {"begin frame", "light", "upload", "check picture", "submit", "device wait",
                           "finish", "rest correction", "deliver"})
    EXPECT_EQ(count(spans["engine"], name), 12u) << name;
}

TEST_F(TraceProgram, IsWholeAfterCtrlCAndAKill) {
  for (const int signal : {SIGINT, SIGKILL}) {
    const fs::path file = folder_ / ("trace" + std::to_string(signal) + ".json");
    const pid_t child =
        start({"record", "synthetic:press?size=96x80&mode=gel&repeat=0", "--rate", "30", "--out",
               folder_ / ("out" + std::to_string(signal)), "--outputs", "force", "--trace", file});
    ASSERT_TRUE(eventually([&] { return fs::exists(file) && fs::file_size(file) > 2000; }));
    kill(child, signal);
    const Ended ended = finish(child);
    EXPECT_EQ(ended.exit_code, signal == SIGINT ? 130 : 1000 + SIGKILL) << ended.err;
    EXPECT_GT(read(file)["engine"].size(), 3u);
  }
}

TEST_F(TraceProgram, ThatCannotBeWrittenIsOneLine) {
  expect_refusal({"process", "synthetic:press?size=96x80", "--frames", "2", "--out", folder_ / "out",
                  "--trace", folder_ / "none" / "trace.json"},
                 7, {"trace", "none", "folder"});
}

TEST_F(TraceProgram, FullDiskEndsTheTraceNotTheRun) {
  const fs::path file = folder_ / "trace.json";
  const auto measure = [&](const fs::path& out, const Surroundings& around = {}) {
    return run({"process", "synthetic:press?size=96x80", "--frames", "40", "--out", out, "--outputs", "force",
                "--trace", file},
               around);
  };
  ASSERT_EQ(measure(folder_ / "before").exit_code, 0);
  Surroundings around;
  around.largest_file_bytes = fs::file_size(folder_ / "before" / "measurements.csv") + 4096;
  ASSERT_LT(around.largest_file_bytes, fs::file_size(file));
  const Ended ended = measure(folder_ / "out", around);
  EXPECT_EQ(ended.exit_code, 0) << ended.err;
  EXPECT_EQ(count_of(ended.err, "to go on with the trace"), 1u) << ended.err;
  for (const char* word : {"trace.json", "File too large", "it ends early", "freeing disk space"})
    EXPECT_TRUE(contains(ended.err, word)) << ended.err << " lacks " << word;
  EXPECT_EQ(slurp(folder_ / "out" / "measurements.csv"), slurp(folder_ / "before" / "measurements.csv"));
  EXPECT_TRUE(parse_json(slurp(file)).is_array());
}

}  // namespace
}  // namespace palpate
