#include "viz/commands/support/trace_option.h"

#include <spdlog/spdlog.h>

#include "viz/commands/support/options.h"

namespace palpate {

void TraceOption::add_to(CommandLine& command) {
  command.add_option("--trace", file_,
                     "Write what each thread does when, for chrome://tracing or ui.perfetto.dev");
}

std::unique_ptr<TraceFile> TraceOption::start() const {
  name_trace_thread("main");
  if (file_.empty()) return nullptr;
  return std::make_unique<TraceFile>(file_, [](const std::string& line) { spdlog::warn("{}", line); });
}

}  // namespace palpate
