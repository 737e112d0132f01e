// Common options of the forward model's and the lump commands.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <string>

#include "engine/fem/scene.h"

namespace palpate {

/// "AxBxC" of an option. Throws Error(Failure::Usage) with `example` as what to try.
std::array<uint32_t, 3> parse_cells(const std::string& option, const std::string& text,
                                    const std::string& example);

/// sphere, ellipsoid, cylinder, lying.
const std::map<std::string, InclusionShape>& lump_shapes();

}  // namespace palpate
