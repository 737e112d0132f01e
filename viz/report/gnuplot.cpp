#include "viz/report/gnuplot.h"
#include "engine/base/readable.h"

#include <fcntl.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>

extern char** environ;  // NOLINT(readability-redundant-declaration): POSIX wants the program to declare it

namespace palpate {
namespace {

/// A file in memory that a child can write to or read from.
class MemoryFile {
 public:
  explicit MemoryFile(const char* name) : file_(memfd_create(name, MFD_CLOEXEC)) {}
  ~MemoryFile() {
    if (file_ >= 0) close(file_);
  }
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;

  int handle() const { return file_; }
  bool fill(const std::string& text) {
    return write(file_, text.data(), text.size()) == static_cast<ssize_t>(text.size()) &&
           lseek(file_, 0, SEEK_SET) == 0;
  }
  std::string content() const {
    std::string text(static_cast<size_t>(std::max<off_t>(lseek(file_, 0, SEEK_END), 0)), '\0');
    const ssize_t got = pread(file_, text.data(), text.size(), 0);
    text.resize(static_cast<size_t>(std::max<ssize_t>(got, 0)));
    return text;
  }

 private:
  int file_;
};

std::string one_line(std::string text) {
  std::replace_if(
      text.begin(), text.end(), [](char c) { return c == '\n' || c == '\r'; }, ' ');
  const size_t first = text.find_first_not_of(' ');
  return first == std::string::npos ? "" : text.substr(first, 200);
}

}  // namespace

Picture run_gnuplot(const std::string& script) {
  MemoryFile in("script"), out("picture"), err("messages");
  if (in.handle() < 0 || out.handle() < 0 || err.handle() < 0 || !in.fill(script))
    return {"", system_words(errno)};
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, in.handle(), STDIN_FILENO);
  posix_spawn_file_actions_adddup2(&actions, out.handle(), STDOUT_FILENO);
  posix_spawn_file_actions_adddup2(&actions, err.handle(), STDERR_FILENO);
  // A group of its own: Ctrl-C ends the measuring, not the drawing of what was measured.
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP);
  char program[] = "gnuplot", defaults[] = "-d", stdin_script[] = "-";
  char* const arguments[] = {program, defaults, stdin_script, nullptr};
  pid_t child = 0;
  const int spawned = posix_spawnp(&child, program, &actions, &attributes, arguments, environ);
  posix_spawnattr_destroy(&attributes);
  posix_spawn_file_actions_destroy(&actions);
  if (spawned == ENOENT) return {"", "gnuplot is not installed", true};
  if (spawned != 0) return {"", system_words(spawned)};
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  if (status != 0) return {"", "gnuplot failed: " + one_line(err.content())};
  Picture picture{out.content(), ""};
  if (picture.bytes.empty()) picture.error = "gnuplot drew nothing: " + one_line(err.content());
  return picture;
}

std::string gnuplot_quoted(const std::string& text) {
  std::string quoted = "'";
  for (const char c : text) {
    if (c == '\'') quoted += '\'';
    quoted += c == '\n' || c == '\r' ? ' ' : c;
  }
  return quoted + "'";
}

}  // namespace palpate
