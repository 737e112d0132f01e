#include "engine/gpu/tuning.h"

#include <unistd.h>
#include <vulkan/vulkan.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <fstream>
#include <optional>
#include <sstream>

#include "engine/base/json.h"
#include "engine/base/readable.h"
#include "engine/gpu/context.h"
#include "palpate/error.h"
#include "palpate/frame.h"
#include "shaders/fingerprint.h"
#include "shaders/shared/contact.h"

namespace palpate {
namespace {

using Json = json::Value;

constexpr int kTuningVersion = 1;

constexpr std::array<uint32_t, 6> kContactRows{0, 8, 16, 32, 48, 64};
constexpr std::array<uint32_t, 6> kKeepingRows{8, 16, 24, 32, 48, 64};
constexpr std::array<uint32_t, 4> kSlopeRows{8, 16, 24, 32};
constexpr std::array<uint32_t, 5> kStripRows{4, 8, 16, 24, 32};
constexpr std::array<uint32_t, 5> kWorkgroups{16, 32, 64, 128, 256};
constexpr std::array<uint32_t, 3> kBigTexels{4096, 16384, 65536};
constexpr std::array<uint32_t, 2> kForms{0, 1};
constexpr std::array<uint32_t, 4> kCoarsestCells{80, 160, 320, 640};

// Column and row sums of a contact tile fit their 16 bits up to kMaxTileRows. Slopes come from blocks of
// eight rows; two fine rows make a coarse one. Workgroups are whole numbers of the narrowest subgroups in
// use: on lavapipe the partial sums of others are lost.
constexpr std::array<TuningField, 14> kFields{{
    {"contact_tiles", &Tuning::contact_tiles, 0, 1, 1, kForms},
    {"contact_rows", &Tuning::contact_rows, 0, shared::kMaxTileRows, 2, kContactRows},
    {"contact_rows_keeping", &Tuning::contact_rows_keeping, 2, shared::kMaxTileRows, 2, kKeepingRows},
    {"contact_workgroup", &Tuning::contact_workgroup, 8, 1024, 8, kWorkgroups},
    {"slope_tiles", &Tuning::slope_tiles, 0, 1, 1, kForms},
    {"slope_rows", &Tuning::slope_rows, 8, 64, 8, kSlopeRows},
    {"slope_workgroup", &Tuning::slope_workgroup, 8, 1024, 8, kWorkgroups},
    {"surface_rows_big", &Tuning::surface_rows_big, 2, 128, 2, kStripRows},
    {"surface_rows_small", &Tuning::surface_rows_small, 2, 128, 2, kStripRows},
    {"surface_big_texels", &Tuning::surface_big_texels, 1024, 1u << 20, 1, kBigTexels},
    {"surface_workgroup", &Tuning::surface_workgroup, 8, 1024, 8, kWorkgroups},
    {"surface_tiles", &Tuning::surface_tiles, 0, 1, 1, kForms},
    {"coarsest_cells", &Tuning::coarsest_cells, 16, 1024, 1, kCoarsestCells},
    {"rest_level_workgroup", &Tuning::rest_level_workgroup, 8, 1024, 8, kWorkgroups},
}};

[[noreturn]] void refuse(const std::string& wanted, const std::string& found) {
  throw Error(Failure::Usage, wanted, found, "palpate-lab tune --force");
}

Json to_json(const TuningKey& key) {
  return {{"device", key.device},
          {"vendor_id", key.vendor_id},
          {"device_id", key.device_id},
          {"driver_version", key.driver_version},
          {"pipeline_cache_uuid", key.pipeline_cache_uuid},
          {"kernels", key.kernels}};
}

TuningKey key_from(const Json& entry) {
  TuningKey key;
  entry.at("device").get_to(key.device);
  entry.at("vendor_id").get_to(key.vendor_id);
  entry.at("device_id").get_to(key.device_id);
  entry.at("driver_version").get_to(key.driver_version);
  entry.at("pipeline_cache_uuid").get_to(key.pipeline_cache_uuid);
  entry.at("kernels").get_to(key.kernels);
  return key;
}

/// The same device, whatever its driver and our kernels were then.
bool same_device(const TuningKey& a, const TuningKey& b) {
  return a.device == b.device && a.vendor_id == b.vendor_id && a.device_id == b.device_id;
}

/// The key of files that were written before it was renamed.
std::string former_name(const std::string& name) {
  return name == "rest_level_workgroup" ? "datum_workgroup" : name;
}

Tuning tuning_from(const Json& values) {
  Tuning tuning;
  for (const TuningField& field : kFields) {
    const auto& value = values.at(values.contains(field.name) ? field.name : former_name(field.name));
    if (!value.is_unsigned() || value.get<uint64_t>() > field.most)
      refuse(std::string(field.name) + " up to " + std::to_string(field.most), value.dump());
    tuning.*field.value = value.get<uint32_t>();
  }
  return tuning;
}

/// The entries of a cache file; throws what parsing throws, and Error where it is something else.
Json entries_of(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::ostringstream bytes;
  bytes << in.rdbuf();
  const Json whole = json::parse(bytes.str(), {.deepest = 16});
  if (!(whole.at("palpate_tuning") == kTuningVersion) || !whole.at("devices").is_array())
    refuse("a tuning file of version " + std::to_string(kTuningVersion), "another one");
  return whole.at("devices");
}

std::string one_line(std::string text) {
  std::replace(text.begin(), text.end(), '\n', ' ');
  return text;
}

}  // namespace

std::span<const TuningField> tuning_fields() {
  return kFields;
}

Tuning default_tuning(const gpu::Context& context) {
  return default_tuning(context.kernels().empty() ? context.is_software() : context.kernels() == "processor");
}

Tuning default_tuning(bool processor) {
  Tuning t;
  t.contact_workgroup = 32;
  t.slope_workgroup = t.rest_level_workgroup = 64;
  t.surface_workgroup = processor ? 64 : 256;
  t.coarsest_cells = 320;
  t.surface_big_texels = 16384;
  // Long strips waste less on their lead-in, short ones make more threads; stores of long strips fall out of
  // a processor's nearest cache.
  t.contact_rows = processor ? 0 : 8;
  t.contact_rows_keeping = processor ? 32 : 8;
  t.slope_rows = processor ? 32 : 8;
  t.contact_tiles = t.slope_tiles = t.surface_tiles = processor ? 0 : 1;
  t.surface_rows_big = processor ? 16 : 8;
  t.surface_rows_small = processor ? 16 : 8;
  return t;
}

void validate(const Tuning& tuning, const VkPhysicalDeviceLimits& limits) {
  const uint32_t most_invocations =
      std::min(limits.maxComputeWorkGroupInvocations, limits.maxComputeWorkGroupSize[0]);
  for (const TuningField& field : kFields) {
    const uint32_t value = tuning.*field.value;
    const bool workgroup = std::string(field.name).ends_with("_workgroup");
    const uint32_t most = workgroup ? std::min(field.most, most_invocations) : field.most;
    if (value < field.least || value > most || value % field.step != 0) {
      refuse(std::string(field.name) + " from " + std::to_string(field.least) + " to " +
                 std::to_string(most) + " in steps of " + std::to_string(field.step),
             std::to_string(value));
    }
  }
  // The largest frame must fit one dispatch: its invocations of one row each, over rows and workgroup. An
  // eighth more, for strips and rows that are not full.
  const auto fits = [&](const char* stage, uint64_t px, uint32_t rows, uint32_t workgroup) {
    const uint64_t invocations = kMaxPixels / px;
    if (uint64_t{rows} * workgroup * limits.maxComputeWorkGroupCount[0] < invocations + invocations / 8) {
      refuse(std::string(stage) + " rows times workgroup for frames of " + std::to_string(kMaxPixels) + " px",
             std::to_string(rows) + " rows in workgroups of " + std::to_string(workgroup));
    }
  };
  fits("contact", 16, tuning.contact_rows == 0 ? 32 : tuning.contact_rows, tuning.contact_workgroup);
  fits("contact", 16, tuning.contact_rows_keeping, tuning.contact_workgroup);
  fits("slope", 8, tuning.slope_rows, tuning.slope_workgroup);
  fits("surface", 4, tuning.surface_rows_big, tuning.surface_workgroup);
}

TuningKey tuning_key(const gpu::Context& context) {
  const VkPhysicalDeviceProperties& p = context.properties();
  TuningKey key{p.deviceName, p.vendorID, p.deviceID, p.driverVersion, {}, kKernelFingerprint};
  for (const uint8_t byte : p.pipelineCacheUUID) {
    constexpr char kHex[] = "0123456789abcdef";
    key.pipeline_cache_uuid += {kHex[byte >> 4], kHex[byte & 15]};
  }
  return key;
}

std::filesystem::path tuning_file() {
  const std::filesystem::path folder = gpu::cache_folder();
  return folder.empty() ? folder : folder / "tuning.json";
}

CachedTuning load_tuning(const gpu::Context& context, const std::filesystem::path& file) {
  CachedTuning cached{default_tuning(context), false, {}};
  std::error_code none;
  if (!context.kernels().empty()) return cached;
  if (file.empty() || !std::filesystem::exists(file, none)) return cached;
  const TuningKey key = tuning_key(context);
  try {
    for (const Json& entry : entries_of(file)) {
      const TuningKey found = key_from(entry);
      if (!same_device(found, key)) continue;
      if (found != key) {
        cached.ignored =
            file.string() + ": tuned with another driver or other kernels; palpate-lab tune measures anew";
        continue;
      }
      const Tuning tuning = tuning_from(entry.at("tuning"));
      validate(tuning, context.properties().limits);
      return {tuning, true, {}};
    }
  } catch (const std::exception& error) {
    cached.ignored = one_line(file.string() + ": damaged, ignored (" + error.what() + ")");
  }
  return cached;
}

void save_tuning(const gpu::Context& context, const Tuning& tuning, const std::filesystem::path& file) {
  validate(tuning, context.properties().limits);
  if (file.empty())
    throw Error(Failure::Output, "a cache folder for the tuning", "neither XDG_CACHE_HOME nor HOME is set",
                "setting one of them");
  const TuningKey key = tuning_key(context);
  Json devices = Json::array();
  try {
    for (const Json& entry : entries_of(file))
      if (!same_device(key_from(entry), key)) devices.push_back(entry);
  } catch (const std::exception&) {
    devices = Json::array();  // damaged, or there is none yet
  }
  Json entry = to_json(key);
  Json& values = entry["tuning"];
  for (const TuningField& field : kFields) values[field.name] = tuning.*field.value;
  devices.push_back(entry);
  const std::string text = Json{{"palpate_tuning", kTuningVersion}, {"devices", devices}}.dump(2) + "\n";

  std::error_code failed;
  std::filesystem::create_directories(file.parent_path(), failed);
  auto temporary = file;
  temporary += "." + std::to_string(getpid()) + ".tmp";
  const auto give_up = [&](const std::string& reason) {
    std::error_code ignored;
    std::filesystem::remove(temporary, ignored);
    throw Error(Failure::Output, "to write " + file.string(), reason, "another XDG_CACHE_HOME, or --dry-run");
  };
  {
    std::ofstream out(temporary, std::ios::binary);
    out << text;
    if (!out.flush()) give_up(system_words(errno));
  }
  std::filesystem::rename(temporary, file, failed);
  if (failed) give_up(system_words(failed));
}

}  // namespace palpate
