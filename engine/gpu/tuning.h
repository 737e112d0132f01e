// Constants of the kernels' structure that depend on the device, and their measured values, from
// `palpate-lab tune`, in the user's cache folder. No result depends on them beyond rounding, and the exact
// sums not at all.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>

struct VkPhysicalDeviceLimits;

namespace palpate {
namespace gpu {
class Context;
}

/// Two forms of the same kernels: strips, whose rows stream through an invocation's registers, and tiles,
/// which a workgroup shares; GPUs have few registers for each of their many invocations. Rows are those that
/// one invocation streams through; workgroups are invocations.
struct Tuning {
  uint32_t contact_tiles = 0;         ///< 1: contact is summed in tiles; its rows do not count then
  uint32_t contact_rows = 0;          ///< px; 0: of 32 to 64 the height that fetches the fewest rows
  uint32_t contact_rows_keeping = 0;  ///< px, where the filtered image is stored as well
  uint32_t contact_workgroup = 0;
  uint32_t slope_tiles = 0;  ///< 1: right sides are computed in tiles; what weights need is in strips of rows
  uint32_t slope_rows = 0;   ///< px
  uint32_t slope_workgroup = 0;
  uint32_t surface_rows_big = 0;    ///< cells, of levels with at least surface_big_texels
  uint32_t surface_rows_small = 0;  ///< cells, of the others
  uint32_t surface_big_texels = 0;  ///< of four cells
  uint32_t surface_workgroup = 0;
  uint32_t surface_tiles =
      0;  ///< 1: levels are solved in tiles; their rows, but for a few, do not count then
  uint32_t coarsest_cells = 0;  ///< most cells of the level that is solved directly
  uint32_t rest_level_workgroup = 0;

  bool operator==(const Tuning&) const = default;
};

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

/// Defaults without a measurement, by the kind of device (processor or GPU).
Tuning default_tuning(const gpu::Context& context);
Tuning default_tuning(bool processor);

/// Throws Error(Failure::Usage) naming the constant that is out of its range or beyond the device's limits.
void validate(const Tuning& tuning, const VkPhysicalDeviceLimits& limits);

/// Key of a measurement: this device under this driver with these kernels.
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

/// Constants measured for the device, or its defaults. Never throws for what the file holds.
CachedTuning load_tuning(const gpu::Context& context, const std::filesystem::path& file);
inline CachedTuning load_tuning(const gpu::Context& context) {
  return load_tuning(context, tuning_file());
}

/// Adds the device's tuning to those of other devices, in one step. A damaged file is replaced. Throws
/// Error(Failure::Output).
void save_tuning(const gpu::Context& context, const Tuning& tuning, const std::filesystem::path& file);

}  // namespace palpate
