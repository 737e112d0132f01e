// Methods that estimate a lump, as the help has them.
#pragma once

namespace palpate {

/// Values of --method, for its help.
inline constexpr const char* kLumpMethodHelp =
    "Who estimates: network, refined (its answer, refined by least squares; half as far off), direct (finite "
    "elements, up to half a minute)";

}  // namespace palpate
