// Common parts of the measuring programs.
#pragma once

namespace palpate::perf {

/// Calls run(argc, argv) and returns what it does; of an exception one line on stderr, and the exit code of
/// an Error or 1.
int run_program(const char* name, int (*run)(int, char**), int argc, char** argv);

}  // namespace palpate::perf
