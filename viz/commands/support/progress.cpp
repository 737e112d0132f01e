#include "viz/commands/support/progress.h"

#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdio>
#include <string>

#include "engine/base/clock.h"
#include "engine/base/text.h"
#include "viz/commands/support/common.h"

namespace palpate {
namespace {

volatile std::sig_atomic_t interrupt_flag = 0;

void on_signal(int) {
  interrupt_flag = 1;
}

}  // namespace

void catch_interrupts() {
  struct sigaction action {};
  action.sa_handler = on_signal;
  action.sa_flags = SA_RESETHAND | SA_RESTART;
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
}

bool interrupted() {
  return interrupt_flag != 0;
}

double now_s() {
  return static_cast<double>(monotonic_ns()) * 1e-9;
}

ProgressBar::ProgressBar(const Common& common, const char* label, uint64_t total)
    : label_(label),
      total_(total),
      shown_(!common.quiet && isatty(STDERR_FILENO)),
      start_ns_(monotonic_ns()) {}

ProgressBar::~ProgressBar() {
  if (shown_ && drawn_ns_ != 0) std::fputs("\r\x1b[K", stderr);
}

void ProgressBar::update(uint64_t done) {
  if (!shown_) return;
  constexpr int64_t kRedraw_ns = 100'000'000;
  const int64_t now = monotonic_ns();
  if (now - drawn_ns_ < kRedraw_ns && done != total_) return;
  drawn_ns_ = now;
  draw(done, now);
}

void ProgressBar::draw(uint64_t done, int64_t now) {
  winsize terminal{};
  const int columns =
      ioctl(STDERR_FILENO, TIOCGWINSZ, &terminal) == 0 && terminal.ws_col > 0 ? terminal.ws_col : 80;
  const double elapsed_s = static_cast<double>(now - start_ns_) * 1e-9;
  const double rate = elapsed_s > 0 ? static_cast<double>(done) / elapsed_s : 0;
  std::string line;
  if (total_ == 0) {
    line = text("%s %llu frames  %.0f/s", label_, static_cast<unsigned long long>(done), rate);
    std::fprintf(stderr, "\r\x1b[K%.*s", columns - 1, line.c_str());
    return;
  }
  const double left_s = rate > 0 ? static_cast<double>(total_ > done ? total_ - done : 0) / rate : 0;
  line = text("%llu/%llu  %.0f/s  %.0f s left", static_cast<unsigned long long>(done),
              static_cast<unsigned long long>(total_), rate, left_s);
  constexpr int kBar = 30;
  const int filled = static_cast<int>(static_cast<double>(kBar) *
                                      std::min(1.0, static_cast<double>(done) / static_cast<double>(total_)));
  const std::string bar =
      std::string(static_cast<size_t>(filled), '#') + std::string(static_cast<size_t>(kBar - filled), '.');
  std::fprintf(stderr, "\r\x1b[K%.*s", columns - 1, (std::string(label_) + " [" + bar + "] " + line).c_str());
}

}  // namespace palpate
