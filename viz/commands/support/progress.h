// Progress of a command: its bar, its clock, and a clean end on Ctrl-C.
#pragma once

#include <cstdint>

namespace palpate {

struct Common;

/// From here on Ctrl-C and SIGTERM only set a flag; a second one ends the program at once.
void catch_interrupts();
bool interrupted();

/// A progress bar on stderr, drawn only on a terminal and without --quiet.
class ProgressBar {
 public:
  /// `total` 0: unknown.
  ProgressBar(const Common& common, const char* label, uint64_t total);
  ~ProgressBar();
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;
  void update(uint64_t done);

 private:
  void draw(uint64_t done, int64_t now_ns);

  const char* label_;
  uint64_t total_;
  bool shown_;
  int64_t start_ns_;
  int64_t drawn_ns_ = 0;
};

/// Seconds on a clock that never jumps.
double now_s();

}  // namespace palpate
