// Random cases for the GPU's stages against plain loops on the CPU. A case is made from one number, describes
// itself, reports where the two differ, and shrinks to a smaller one that still differs. For fuzz_test.cpp (a
// few hundred) and palpate_fuzz (any number).
#pragma once

#include <cstdint>
#include <string>

#include "engine/gpu/tuning.h"
#include "engine/stages/surface/solve.h"
#include "palpate/frame.h"
#include "palpate/pipeline.h"
#include "palpate/sensor.h"

namespace palpate::fuzz {

enum class Stage { Contact, Slope, Surface, Pipeline, Gel };
constexpr const char* to_string(Stage stage) {
  constexpr const char* kNames[] = {"contact", "slope", "surface", "pipeline", "gel"};
  return kNames[static_cast<int>(stage)];
}

enum class Pattern { Black, White, Gray, Noise, OnePixel, Checker, Stripes, Ramp, Blob, Edge };
constexpr int kPatterns = 10;

struct Case {
  uint64_t seed = 0;
  Stage stage = Stage::Contact;
  FrameFormat format;
  Sensor sensor;
  Tuning tuning;
  bool keep_filtered = false;  ///< contact only
  uint32_t images = 1;         ///< one after the other through the same kernels
  Pattern image = Pattern::Noise;
  Pattern background = Pattern::Black;
  Solve solve = Solve::Live;  ///< surface and pipeline
  int exponent = 0;           ///< surface: gradients times ten to this power
};

Case make_case(uint64_t seed, const Tuning& defaults);
/// The same of one stage only.
Case make_case(uint64_t seed, const Tuning& defaults, Stage stage);
std::string describe(const Case& c);

/// Empty where GPU and CPU agree (Stage::Gel: where what is told of a gel is so); else the first place where
/// they do not.
std::string difference(gpu::Context& context, const Case& c);

/// The smallest case found that still differs.
Case shrink(gpu::Context& context, const Case& failing);

}  // namespace palpate::fuzz
