#include "tests/support/program_fixture.h"

#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <sstream>

namespace palpate {

pid_t Program::start(const std::vector<std::string>& arguments, const Surroundings& around) {
  const std::string out = around.stdout_file.empty() ? (folder_ / "stdout").string() : around.stdout_file;
  const std::string err = (folder_ / "stderr").string();
  std::vector<char*> argv;
  std::string program = program_;
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

Ended Program::finish(pid_t child) {
  int status = 0;
  waitpid(child, &status, 0);
  Ended ended;
  ended.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : 1000 + WTERMSIG(status);
  ended.out = slurp(folder_ / "stdout");
  ended.err = slurp(folder_ / "stderr");
  return ended;
}

void Program::expect_refusal(const std::vector<std::string>& arguments, int exit_code,
                             const std::vector<std::string>& words, const Surroundings& around) {
  const Ended ended = run(arguments, around);
  EXPECT_EQ(ended.exit_code, exit_code) << ended.err;
  EXPECT_EQ(ended.out, "");
  std::string line;
  std::istringstream lines(ended.err);
  int refusals = 0;
  std::string refusal;
  const std::string name = program_.filename().string() + ": ";
  while (std::getline(lines, line)) {
    EXPECT_EQ(line.rfind(name, 0), 0u) << "not ours: " << line;
    if (line.rfind(name + "device", 0) == 0) continue;  // the log says which device was chosen
    refusal = line;
    ++refusals;
  }
  EXPECT_EQ(refusals, 1) << ended.err;
  for (const std::string& word : words) EXPECT_TRUE(contains(refusal, word)) << refusal << " lacks " << word;
}

fs::path Program::recording(int frames) {
  const fs::path rec = folder_ / "rec";
  const Ended ended =
      run({"simulate", "palpation", "--out", rec, "--size", "160x120", "--frames", std::to_string(frames)});
  EXPECT_EQ(ended.exit_code, 0) << ended.err;
  return rec;
}

std::vector<std::string> TypedProgram::words_of(const std::string& typed) {
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

}  // namespace palpate
