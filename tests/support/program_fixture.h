// The program as its user meets it: run as a process, judged by exit code, stdout, stderr and the files it
// leaves.
#pragma once

#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "tests/support/test_folder.h"

namespace palpate {

namespace fs = std::filesystem;
inline std::string slurp(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

inline void spill(const fs::path& file, const std::string& text) {
  std::ofstream(file, std::ios::binary) << text;
}

inline bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

struct Ended {
  int exit_code = -1;  ///< 1000 + signal where a signal killed it
  std::string out;
  std::string err;
};

struct Surroundings {
  std::map<std::string, std::string> environment = {};  ///< set on top of ours; an empty value unsets
  rlim_t largest_file_bytes = RLIM_INFINITY;
  std::string stdout_file = {};  ///< where stdout goes instead of a captured file
};

/// A folder of its own for each test.
class Program : public testing::Test {
 protected:
  void SetUp() override { folder_ = test_folder("program"); }
  void TearDown() override {
    if (!HasFailure()) fs::remove_all(folder_);
  }

  pid_t start(const std::vector<std::string>& arguments, const Surroundings& around = {}) {
    const std::string out = around.stdout_file.empty() ? (folder_ / "stdout").string() : around.stdout_file;
    const std::string err = (folder_ / "stderr").string();
    std::vector<char*> argv;
    std::string program = PALPATE_PROGRAM;
    argv.push_back(program.data());
    std::vector<std::string> copies = arguments;
    for (std::string& a : copies) argv.push_back(a.data());
    argv.push_back(nullptr);
    const pid_t child = fork();
    if (child == 0) {
      setenv("PALPATE_CONFIG", "none", 1);  // what a person has set at the window is no business of tests
      for (const auto& [name, value] : around.environment) {
        value.empty() ? unsetenv(name.c_str()) : setenv(name.c_str(), value.c_str(), 1);
      }
      const int out_file = open(out.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0666);
      const int err_file = open(err.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0666);
      dup2(out_file, STDOUT_FILENO);
      dup2(err_file, STDERR_FILENO);
      if (around.largest_file_bytes != RLIM_INFINITY) {
        const rlimit limit{around.largest_file_bytes, around.largest_file_bytes};
        setrlimit(RLIMIT_FSIZE, &limit);
      }
      execv(argv[0], argv.data());
      _exit(127);
    }
    return child;
  }

  Ended finish(pid_t child) {
    int status = 0;
    waitpid(child, &status, 0);
    Ended ended;
    ended.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : 1000 + WTERMSIG(status);
    ended.out = slurp(folder_ / "stdout");
    ended.err = slurp(folder_ / "stderr");
    return ended;
  }

  Ended run(const std::vector<std::string>& arguments, const Surroundings& around = {}) {
    return finish(start(arguments, around));
  }

  /// Fails with exactly this code, one line on stderr that begins with the program's name and holds each of
  /// `words`.
  void expect_refusal(const std::vector<std::string>& arguments, int exit_code,
                      const std::vector<std::string>& words, const Surroundings& around = {}) {
    const Ended ended = run(arguments, around);
    EXPECT_EQ(ended.exit_code, exit_code) << ended.err;
    EXPECT_EQ(ended.out, "");
    std::string line;
    std::istringstream lines(ended.err);
    int refusals = 0;
    std::string refusal;
    while (std::getline(lines, line)) {
      EXPECT_EQ(line.rfind("palpate: ", 0), 0u) << "not ours: " << line;
      if (line.rfind("palpate: device", 0) == 0) continue;  // the log says which device was chosen
      refusal = line;
      ++refusals;
    }
    EXPECT_EQ(refusals, 1) << ended.err;
    for (const std::string& word : words)
      EXPECT_TRUE(contains(refusal, word)) << refusal << " lacks " << word;
  }

  /// A small recording with its sensor file in folder_/rec.
  fs::path recording(int frames = 30) {
    const fs::path rec = folder_ / "rec";
    const Ended ended =
        run({"simulate", "palpation", "--out", rec, "--size", "160x120", "--frames", std::to_string(frames)});
    EXPECT_EQ(ended.exit_code, 0) << ended.err;
    return rec;
  }

  fs::path folder_;
};

/// The same with a whole command in one string, as it is typed: words apart by blanks, '...' one word.
class TypedProgram : public Program {
 protected:
  /// Its exit code; stdout and stderr are files in folder_.
  int run(const std::string& typed) { return Program::run(words_of(typed)).exit_code; }
  std::string at(const std::string& name) const { return (folder_ / name).string(); }
  std::string text(const std::string& name) const { return slurp(folder_ / name); }

 private:
  static std::vector<std::string> words_of(const std::string& typed) {
    std::vector<std::string> words;
    bool inside = false, quoted = false;
    for (const char c : typed) {
      if (c == '\'') {
        quoted = !quoted;
      } else if (c == ' ' && !quoted) {
        inside = false;
        continue;
      }
      if (!inside) words.emplace_back();
      inside = true;
      if (c != '\'') words.back() += c;
    }
    return words;
  }
};

struct Table {
  std::vector<std::string> columns;
  std::vector<std::vector<std::string>> rows;

  explicit Table(const std::string& text) {
    std::istringstream lines(text);
    std::string line;
    while (std::getline(lines, line)) {
      std::vector<std::string> cells(1);
      for (const char c : line) {
        if (c == ',') {
          cells.emplace_back();
        } else {
          cells.back() += c;
        }
      }
      if (columns.empty()) {
        columns = cells;
      } else {
        rows.push_back(cells);
      }
    }
  }
  const std::string& at(size_t row, const std::string& column) const {
    static const std::string none = "no such column";
    for (size_t i = 0; i < columns.size(); ++i) {
      if (columns[i] == column) return rows.at(row).at(i);
    }
    ADD_FAILURE() << none << ": " << column;
    return none;
  }
  void expect_whole() const {
    for (const auto& row : rows) EXPECT_EQ(row.size(), columns.size());
  }
};

}  // namespace palpate
