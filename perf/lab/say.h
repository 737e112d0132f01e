// Output of a benchmark while it runs, since it takes minutes.
#pragma once

#include <string>

namespace palpate::perf {

/// Writes text to stdout at once, unless a JSON value alone belongs there.
void say(const std::string& text);
/// From here on say() writes nothing.
void say_nothing();

}  // namespace palpate::perf
