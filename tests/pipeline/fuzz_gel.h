// A colour gel as it is used: specks and saturated pixels in the untouched image, lamps that drift, a camera
// that changes its exposure, and a press that has to be told from all that.
#pragma once

#include <string>

#include "tests/pipeline/fuzz_cases.h"

namespace palpate::fuzz {

/// The case's format and sensor; all else follows from its seed.
void make_gel(Case& c);

/// Empty where untouched frames show no contact and nothing saturated, and a press one contact where it is.
std::string gel_trouble(gpu::Context& context, const Case& c);

}  // namespace palpate::fuzz
