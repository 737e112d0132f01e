// Fixture that runs the program: run as a process, judged by exit code, stdout, stderr and the files it
// leaves.
#pragma once

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/types.h>

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "tests/support/csv_table.h"
#include "tests/support/test_folder.h"
#include "tests/support/text_file.h"

namespace palpate {

namespace fs = std::filesystem;

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

  pid_t start(const std::vector<std::string>& arguments, const Surroundings& around = {});
  Ended finish(pid_t child);
  Ended run(const std::vector<std::string>& arguments, const Surroundings& around = {}) {
    return finish(start(arguments, around));
  }

  /// Fails with exactly this code, one line on stderr that begins with the program's name and holds each of
  /// `words`.
  void expect_refusal(const std::vector<std::string>& arguments, int exit_code,
                      const std::vector<std::string>& words, const Surroundings& around = {});
  /// A small recording with its sensor file in folder_/rec.
  fs::path recording(int frames = 30);

  fs::path folder_;
  fs::path program_ = PALPATE_PROGRAM;
};

/// palpate with a whole command in one string, as it is typed: words apart by blanks, '...' one word.
class TypedProgram : public Program {
 protected:
  /// Its exit code; stdout and stderr are files in folder_.
  int run(const std::string& typed) { return Program::run(words_of(typed)).exit_code; }
  std::string at(const std::string& name) const { return (folder_ / name).string(); }
  std::string text(const std::string& name) const { return slurp(folder_ / name); }

 private:
  static std::vector<std::string> words_of(const std::string& typed);
};

}  // namespace palpate
