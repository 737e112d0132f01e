// Memory of a frame: allocated at start-up, none per frame. Counts the calls of operator new on the thread
// that submits, collects and follows.
#include <gtest/gtest.h>

#include <cstdlib>
#include <new>
#include <optional>
#include <string>
#include <vector>

#include "capture/synthetic/synthetic.h"
#include "engine/gpu/context.h"
#include "palpate/pipeline.h"

namespace {
thread_local uint64_t allocations = 0;

void* allocate(std::size_t bytes) {
  ++allocations;
  if (void* memory = std::malloc(bytes > 0 ? bytes : 1)) return memory;
  throw std::bad_alloc();
}

void* allocate(std::size_t bytes, std::align_val_t alignment) {
  ++allocations;
  const auto step = static_cast<std::size_t>(alignment);
  if (void* memory = std::aligned_alloc(step, (bytes + step - 1) / step * step)) return memory;
  throw std::bad_alloc();
}
}  // namespace

// The forms without exceptions and for arrays call these.
void* operator new(std::size_t bytes) {
  return allocate(bytes);
}
void* operator new(std::size_t bytes, std::align_val_t alignment) {
  return allocate(bytes, alignment);
}
void operator delete(void* memory) noexcept {
  std::free(memory);
}
void operator delete(void* memory, std::size_t) noexcept {
  std::free(memory);
}
void operator delete(void* memory, std::align_val_t) noexcept {
  std::free(memory);
}
void operator delete(void* memory, std::size_t, std::align_val_t) noexcept {
  std::free(memory);
}

namespace palpate {
namespace {

struct Case {
  const char* input;
  PipelineOptions options;
  uint64_t frames = 1000;
  std::optional<PadOutline> pad = {};
};

// The same frames again and again: contacts come and go in every round.
void expect_no_allocation(const Case& c) {
  SCOPED_TRACE(c.input);
  // Without the validation layer, which allocates for itself.
  static gpu::Context context{gpu::ContextOptions{}};
  const SyntheticOptions scene = parse_synthetic(c.input);
  SyntheticSensor source(scene);
  std::vector<Frame> round(16);
  for (size_t k = 0; k < round.size(); ++k) ASSERT_TRUE(source.render(12 * k, round[k]));
  Sensor sensor = synthetic_sensor(scene);
  sensor.pad = c.pad;
  Pipeline pipeline(context, sensor, source.format(), c.options);
  pipeline.set_background(*source.own_background());

  uint64_t touched = 0, several = 0, followed = 0, deep = 0;
  const auto collect = [&](const Result& result) {
    touched += result.touch.contact;
    several += result.touch.contacts.size() > 1;
    followed += result.touch.skin && result.touch.skin->touching > 0;
    deep += result.touch.surface && result.touch.surface->depth_max_mm > 0;
  };
  const auto run = [&](uint64_t frames) {
    for (uint64_t i = 0; i < frames; ++i) {
      while (!pipeline.submit(round[i % round.size()])) collect(*pipeline.wait());
      if (const auto result = pipeline.poll()) collect(*result);
    }
    while (const auto result = pipeline.wait()) collect(*result);
  };
  run(3 * round.size());
  touched = several = followed = deep = 0;
  const uint64_t before = allocations;
  run(c.frames);
  EXPECT_EQ(allocations - before, 0u) << "in " << c.frames << " frames";
  EXPECT_GT(touched, c.frames / 4);
  if (wants(c.options.outputs, Output::Contacts)) {
    EXPECT_GT(several, c.frames / 8);
  }
  if (wants(c.options.outputs, Output::Skin)) {
    EXPECT_GT(followed, c.frames / 4);
  }
  if (wants(c.options.outputs, Output::Surface)) {
    EXPECT_GT(deep, c.frames / 4);
  }
}

TEST(Allocation, IsCounted) {
  const uint64_t before = allocations;
  std::vector<int> some(100);
  EXPECT_EQ(allocations - before, 1u) << some.size();
}

TEST(Allocation, NoneInAFrameWithContactsSkinAndSurface) {
  constexpr Outputs kAll = Output::Force | Output::Surface | Output::Contacts | Output::Skin;
  expect_no_allocation({"synthetic:fingers?size=320x240&skin=markers&mode=gel", {.outputs = kAll}});
}

TEST(Allocation, NoneWhereOnlyPartOfTheFrameIsKnown) {
  expect_no_allocation({.input = "synthetic:press?size=240x180&mode=gel",
                        .options = {.outputs = Output::Force | Output::Surface},
                        .frames = 200,
                        .pad = PadEllipse{120, 90, 90, 70}});
}

}  // namespace
}  // namespace palpate
