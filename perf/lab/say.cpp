#include "perf/lab/say.h"

#include <cstdio>

namespace palpate::perf {
namespace {

bool silent = false;

}  // namespace

void say(const std::string& text) {
  if (silent) return;
  std::fputs(text.c_str(), stdout);
  std::fflush(stdout);
}

void say_nothing() {
  silent = true;
}

}  // namespace palpate::perf
