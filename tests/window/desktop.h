// The program in a window on a display of its own, with real key presses and mouse movements (xdotool).
#pragma once

#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <map>
#include <optional>
#include <thread>

#include "tests/support/eventually.h"
#include "tests/support/json.h"
#include "tests/support/program_fixture.h"

namespace palpate {

/// A display that no other test draws on.
class Desktop {
 public:
  Desktop(uint32_t width, uint32_t height) {
    // A number of its own: the lowest free one may be taken by another test at the same moment.
    for (int attempt = 0; attempt < 5 && name_.empty(); ++attempt)
      start(width, height, 100 + (getpid() + 131 * attempt) % 900);
  }
  ~Desktop() {
    stop();
    std::error_code ignored;
    fs::remove_all(files_, ignored);
  }
  Desktop(const Desktop&) = delete;
  Desktop& operator=(const Desktop&) = delete;

  const std::string& name() const { return name_; }
  /// False where xdotool failed.
  bool tool(const std::string& words) const {
    return std::system(("DISPLAY=" + name_ + " xdotool " + words + " >/dev/null 2>&1").c_str()) == 0;
  }
  void key(const std::string& keys) const {
    EXPECT_TRUE(tool("key --delay 60 " + keys)) << keys;
    rest();
  }
  void click(int x, int y) const {
    EXPECT_TRUE(tool("mousemove " + std::to_string(x) + " " + std::to_string(y)));
    rest();
    EXPECT_TRUE(tool("mousedown 1"));
    rest();
    EXPECT_TRUE(tool("mouseup 1"));
    rest();
  }
  void drag(double x0, double y0, double x1, double y1) const {
    const auto move = [&](double x, double y) {
      EXPECT_TRUE(tool("mousemove " + std::to_string(std::lround(x)) + " " + std::to_string(std::lround(y))));
      rest();
    };
    move(x0, y0);
    EXPECT_TRUE(tool("mousedown 1"));
    rest();
    for (const double t : {0.25, 0.5, 0.75, 1.0}) move(x0 + t * (x1 - x0), y0 + t * (y1 - y0));
    EXPECT_TRUE(tool("mouseup 1"));
    rest();
  }
  static void rest() { std::this_thread::sleep_for(std::chrono::milliseconds(250)); }
  /// The brightest of red, green and blue at a place of the screen, 0 to 255; -1 before there is a screen.
  int brightness(double x, double y) const {
    // A screen dump of X (XWD): 25 numbers, big endian, then colours of 12 bytes, then rows of 4 bytes a
    // pixel.
    std::ifstream in(screen_file(), std::ios::binary);
    std::array<uint8_t, 100> head{};
    if (!in.read(reinterpret_cast<char*>(head.data()), head.size())) return -1;
    const auto number = [&](size_t i) {
      return uint32_t{head[4 * i]} << 24 | uint32_t{head[4 * i + 1]} << 16 | uint32_t{head[4 * i + 2]} << 8 |
             head[4 * i + 3];
    };
    constexpr size_t kHeader_bytes = 0, kRow_bytes = 12, kColours = 19;
    in.seekg(number(kHeader_bytes) + 12 * number(kColours) + std::lround(y) * number(kRow_bytes) +
             4 * std::lround(x));
    std::array<uint8_t, 4> pixel{};
    if (!in.read(reinterpret_cast<char*>(pixel.data()), pixel.size())) return -1;
    return std::max({pixel[0], pixel[1], pixel[2]});
  }

 private:
  std::string screen_file() const { return files_ + "/Xvfb_screen0"; }
  void start(uint32_t width, uint32_t height, int number) {
    int ends[2];
    if (pipe(ends) != 0) return;
    const std::string screen = std::to_string(width) + "x" + std::to_string(height) + "x24";
    const std::string name = ":" + std::to_string(number), ready = std::to_string(ends[1]);
    server_ = fork();
    if (server_ == 0) {
      close(ends[0]);
      dup2(open("/dev/null", O_WRONLY), STDERR_FILENO);
      execlp("Xvfb", "Xvfb", name.c_str(), "-displayfd", ready.c_str(), "-noreset", "-fbdir", files_.c_str(),
             "-screen", "0", screen.c_str(),
             nullptr);  // without a reset: it is deaf for a moment after its last client left
      _exit(127);
    }
    close(ends[1]);
    // To the end of its line: a server whose word nobody takes gives up.
    for (char said = 0; read(ends[0], &said, 1) == 1;) {
      if (said != '\n') continue;
      name_ = name;
      break;
    }
    close(ends[0]);
    if (!name_.empty() && eventually([&] { return tool("getdisplaygeometry"); })) return;
    stop();
  }
  void stop() {
    if (server_ > 0) {
      kill(server_, SIGTERM);
      waitpid(server_, nullptr, 0);
    }
    server_ = -1;
    name_.clear();
  }

  std::string name_;
  std::string files_ = test_folder("desktop");  ///< where the server keeps its screen
  pid_t server_ = -1;
};

class WindowTest : public Program {
 protected:
  void SetUp() override {
    Program::SetUp();
    if (std::system("command -v xdotool >/dev/null && command -v Xvfb >/dev/null") != 0)
      GTEST_SKIP() << "no xdotool or no Xvfb";
  }
  void TearDown() override {
    if (child_ > 0) {
      kill(child_, SIGKILL);
      waitpid(child_, nullptr, 0);
    }
    Program::TearDown();
  }
  fs::path config() const { return folder_ / "config" / "window.json"; }
  fs::path home() const { return folder_ / "home"; }

  /// `also`: of the environment, in addition to the display and places of its own.
  void open(const std::vector<std::string>& arguments, uint32_t width = 1280, uint32_t height = 800,
            std::map<std::string, std::string> also = {}) {
    desktop_.emplace(width, height);
    ASSERT_FALSE(desktop_->name().empty()) << "no Xvfb";
    fs::create_directories(home());
    also.merge(std::map<std::string, std::string>{{"DISPLAY", desktop_->name()},
                                                  {"WAYLAND_DISPLAY", ""},
                                                  {"HOME", home()},
                                                  {"PALPATE_CONFIG", config()}});
    child_ = start(arguments, {.environment = also});
  }
  static bool wait_for(const std::function<bool()>& what) {
    return eventually(what, std::chrono::milliseconds(100));
  }
  bool titled(const std::string& pattern) const {
    return wait_for([&] { return desktop_->tool("search --name '" + pattern + "'"); });
  }
  static bool exists(const fs::path& file) {
    return wait_for([&] { return fs::exists(file); });
  }
  /// Pictures come: a snapshot was asked for and written to `folder`.
  bool drawn(const fs::path& folder) const {
    return titled("palpate: ") && wait_for([&] {
             desktop_->key("s");
             return fs::exists(folder / "palpate-0001.csv");
           });
  }
  Ended quit(const std::string& key = "q") {
    desktop_->key(key);
    return ended();
  }
  /// Escape until it ends: while it works it does not heed keys.
  Ended leave() {
    return ended([this] { (void)desktop_->tool("key Escape"); });
  }
  /// Killed where it does not end: a failure, never a test that hangs.
  Ended ended(const std::function<void()>& meanwhile = {}) {
    siginfo_t state{};
    if (!wait_for([&] {
          if (meanwhile) meanwhile();
          state.si_pid = 0;
          return waitid(P_PID, static_cast<id_t>(child_), &state, WEXITED | WNOHANG | WNOWAIT) == 0 &&
                 state.si_pid == child_;
        })) {
      ADD_FAILURE() << "the program does not end";
      kill(child_, SIGKILL);
    }
    return finish(std::exchange(child_, -1));
  }
  Json remembered() const { return parse_json(slurp(config())); }

  std::optional<Desktop> desktop_;
  pid_t child_ = -1;
};

}  // namespace palpate
