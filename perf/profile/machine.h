// Which machine was measured: what a reader of the figures must know, and nothing that names its owner or
// paths.
#pragma once

#include "perf/profile/profile.h"

namespace palpate::gpu {
class Context;
}

namespace palpate::perf {

Machine describe_machine(const gpu::Context& context);

}  // namespace palpate::perf
