// The forward model: what a block of tissue with a lump in it answers to a press. Elasticity on
// a regular grid, linear or at large strain; frictionless contact.
#pragma once

#include <functional>
#include <vector>

#include "engine/fem/scene.h"

namespace palpate::fem {

/// Solves the scene. Throws Error(Failure::Usage) naming the field that is out of range or does not fit (an
/// inclusion that leaves the block, a grid that is too coarse or cannot be halved).
Result solve(const Scene& scene, const Options& options = {});

/// Many scenes at once, each on one thread of the processor unless the options insist on the device,
/// `options.threads` of them at a time; answers in the scenes' order. `done` (may be empty) hears how many
/// are ready, from any thread.
std::vector<Result> solve(const std::vector<Scene>& scenes, const Options& options,
                          const std::function<void(size_t)>& done = {});

}  // namespace palpate::fem
