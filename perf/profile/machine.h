// Description of the measured machine, without its owner's name or paths.
#pragma once

#include "perf/profile/profile.h"

namespace palpate::gpu {
class Context;
}

namespace palpate::perf {

Machine describe_machine(const gpu::Context& context);

}  // namespace palpate::perf
