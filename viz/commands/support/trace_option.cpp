#include "viz/commands/support/trace_option.h"

#include "viz/commands/support/options.h"

namespace palpate {

void TraceOption::add_to(CommandLine& command) {
  command.add_option("--trace", file_,
                     "Write what each thread does when, for chrome://tracing or ui.perfetto.dev");
}

void TraceOption::start(std::optional<TraceFile>& trace) const {
  name_trace_thread("main");
  if (!file_.empty()) trace.emplace(file_);
}

}  // namespace palpate
