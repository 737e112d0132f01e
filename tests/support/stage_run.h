// The contact and slope stages by themselves, on one frame, as the tests and the fuzzer run them.
#pragma once

#include <array>
#include <cstdint>
#include <random>
#include <utility>
#include <vector>

#include "engine/gpu/commands.h"
#include "engine/stages/frame/contact.h"
#include "engine/stages/surface/slope.h"

namespace palpate {

inline Frame uniform_frame(const FrameFormat& format, uint32_t value) {
  Frame frame;
  frame.reshape(format);
  for (uint32_t channel = 0; channel < format.channels; ++channel)
    for (uint32_t y = 0; y < format.height; ++y)
      for (uint32_t x = 0; x < format.width; ++x) frame.set(channel, x, y, value);
  return frame;
}

inline Frame random_frame(const FrameFormat& format, uint32_t low, uint32_t high, std::mt19937& random) {
  Frame frame;
  frame.reshape(format);
  std::uniform_int_distribution<uint32_t> value(low, high);
  for (uint32_t channel = 0; channel < format.channels; ++channel)
    for (uint32_t y = 0; y < format.height; ++y)
      for (uint32_t x = 0; x < format.width; ++x) frame.set(channel, x, y, value(random));
  return frame;
}

/// A frame and its background on the GPU.
struct FrameOnGpu {
  FrameOnGpu(gpu::Context& context, const FrameFormat& format)
      : frame(context, "frame", format), background(context, "background", format) {}
  void write(const Frame& image, const Frame& rest) {
    frame.write(image);
    background.write(rest);
  }
  void record(gpu::Commands& commands) const {
    frame.record(commands);
    background.record(commands);
    commands.barrier();
  }
  PaddedImage frame, background;
};

struct ContactAnswer {
  ContactMoments moments;
  std::vector<uint16_t> filtered;  ///< rows of `pitch` pixels; only where it was kept
  uint32_t pitch = 0;
  uint32_t units_per_gray = 0;
};

/// One format and sensor: the kernel is compiled once for any number of frames.
class ContactRun {
 public:
  ContactRun(gpu::Context& context, const FrameFormat& format, const Sensor& sensor, bool keep,
             const Tuning& tuning)
      : contact_(context, sensor, format, keep, tuning),
        images_(context, format),
        records_(context, "records", contact_.record_bytes(), gpu::Memory::Readback),
        filtered_(context, "filtered", contact_.filtered().bytes(), gpu::Memory::Readback),
        commands_(context),
        keep_(keep) {
    commands_.begin();
    images_.record(commands_);
    contact_.record(commands_, images_.frame, images_.background, records_);
    if (keep) commands_.copy(contact_.filtered(), filtered_, filtered_.bytes());
    commands_.host_barrier();
    commands_.end();
  }

  ContactAnswer operator()(const Frame& image, const Frame& rest) {
    images_.write(image, rest);
    commands_.submit();
    commands_.wait();
    records_.invalidate();
    filtered_.invalidate();
    ContactAnswer answer;
    answer.moments = contact_.sum(records_.as<const shared::ContactRecord>());
    if (keep_) {
      const auto words = filtered_.as<const uint16_t>();
      answer.filtered.assign(words.begin(), words.end());
    }
    answer.pitch = contact_.tiles_x() * contact_.tile_columns();
    answer.units_per_gray = contact_.filtered_units_per_gray();
    return answer;
  }

 private:
  Contact contact_;
  FrameOnGpu images_;
  gpu::DeviceBuffer records_, filtered_;
  gpu::Commands commands_;
  bool keep_;
};

}  // namespace palpate
