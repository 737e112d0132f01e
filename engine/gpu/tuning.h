// Measured values of the constants in palpate/tuning.h, from `palpate tune`, kept in the user's cache folder.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>

#include "palpate/tuning.h"

struct VkPhysicalDeviceLimits;

namespace palpate {
namespace gpu {
class Context;
}

/// One of the constants: its name in files and tables, what it may be, and what is worth trying.
struct TuningField {
  const char* name;
  uint32_t Tuning::*value;
  uint32_t least;
  uint32_t most;
  uint32_t step;  ///< values are multiples of it
  std::span<const uint32_t> candidates;
};
std::span<const TuningField> tuning_fields();

/// What is sensible without a measurement, by the kind of device (processor or GPU).
Tuning default_tuning(const gpu::Context& context);
Tuning default_tuning(bool processor);

/// Throws Error(Failure::Usage) naming the constant that is out of its range or beyond the device's limits.
void validate(const Tuning& tuning, const VkPhysicalDeviceLimits& limits);

/// What a measurement holds for: this device under this driver with these kernels.
struct TuningKey {
  std::string device;
  uint32_t vendor_id = 0;
  uint32_t device_id = 0;
  uint32_t driver_version = 0;
  std::string pipeline_cache_uuid;  ///< 32 hexadecimal digits
  std::string kernels;              ///< fingerprint of the SPIR-V

  bool operator==(const TuningKey&) const = default;
};
TuningKey tuning_key(const gpu::Context& context);

struct CachedTuning {
  Tuning tuning;
  bool measured = false;  ///< false: nothing is cached for this device, `tuning` are its defaults
  std::string ignored;    ///< why a cache that is there was not used, one line; empty: nothing wrong with it
};

/// `tuning.json` in the cache folder; empty where the user has none.
std::filesystem::path tuning_file();

/// What was measured for the device, or its defaults. Never throws for what the file holds.
CachedTuning load_tuning(const gpu::Context& context, const std::filesystem::path& file);
inline CachedTuning load_tuning(const gpu::Context& context) {
  return load_tuning(context, tuning_file());
}

/// Puts the device's tuning beside those of other devices, in one step. A damaged file is replaced. Throws
/// Error(Failure::Output).
void save_tuning(const gpu::Context& context, const Tuning& tuning, const std::filesystem::path& file);

}  // namespace palpate
