// The smallest lump that limits of detection follow.
#pragma once

namespace palpate::lump {

/// Diameter down to which bumps are followed: below the model's smallest lump they fall with its volume.
inline constexpr double kLeastSeen_mm = 2;

}  // namespace palpate::lump
