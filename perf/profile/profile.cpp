#include "perf/profile/profile.h"

#include <cmath>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>

#include "palpate/error.h"

namespace palpate::perf {

NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(Distribution, samples, min_ms, q25_ms, median_ms, q75_ms, p95_ms, p99_ms,
                                   max_ms)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(Histogram, edges_ms, counts)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(Machine, device, device_type, driver, vulkan, device_memory_bytes, cpu,
                                   cpu_threads, memory_bytes, system, compiler, palpate, libraries, date_utc)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(CeilingPoint, buffer_bytes, copy_GB_per_s, stream_GB_per_s)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(Ceiling, points, GB_per_s, clock, clock_ratio, submit_ms)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(StageFigure, stage, time, read_bytes, written_bytes, dispatches, GB_per_s,
                                   ceiling_fraction)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(SizeFigure, reading, width_px, height_px, latency, histogram, cpu_ms,
                                   frames_per_s, memory_bytes, setup_ms, stages)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(Growth, reading, stage, exponent, exponent_standard_error, from_px, sizes)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(SolverFigure, truth, width_px, height_px, solver, where,
                                   relative_rms_error, peak_to_valley_error, time, cpu_ms, on_front)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(OutputFigure, outputs, reading, width_px, height_px, touched_fraction,
                                   time, cpu_ms, cpu_ratio, cpu_ratio_q25, cpu_ratio_q75, memory_bytes)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(LiveFigure, reading, width_px, height_px, rate_Hz, frames,
                                   dropped_before_engine, dropped_before_display, to_measured, to_picture)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(Skipped, what, why)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(Profile, complete, budget_s, elapsed_s, machine, ceiling, sizes, growth,
                                   solvers, outputs, skipped)

namespace {

using Json = nlohmann::json;

[[noreturn]] void refuse(const std::filesystem::path& file, const std::string& found) {
  throw Error(Failure::Input, "a profile.json of `palpate profile` in '" + file.string() + "'", found,
              "the profile.json of a finished run, or profiling again");
}

/// Text of an nlohmann exception without its "[json.exception.type_error.302] ".
std::string plain(const Json::exception& error) {
  const std::string text = error.what();
  const size_t end = text.find("] ");
  return end == std::string::npos ? text : text.substr(end + 2);
}

/// Every number is finite, and none but exponents negative; what is not finite is written as null.
void check_numbers(const Json& value, const std::string& place, const std::filesystem::path& file) {
  if (value.is_structured()) {
    for (const auto& [key, child] : value.items())
      check_numbers(child, std::string(place).append("/").append(key), file);
  } else if (value.is_null()) {
    refuse(file, "null at " + place);
  } else if (value.is_number()) {
    const double number = value.get<double>();
    const bool may_be_negative = place.ends_with("/exponent");
    if (!std::isfinite(number) || (number < 0 && !may_be_negative))
      refuse(file, value.dump() + " at " + place);
  }
}

}  // namespace

std::string to_json(const Profile& profile) {
  Json value = profile;
  value["live"] = profile.live;
  value["palpate_profile"] = kProfileVersion;
  return value.dump(1, ' ', false, Json::error_handler_t::replace) + "\n";
}

Profile load_profile(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  if (!in || std::filesystem::is_directory(file)) refuse(file, "no such file, or one that cannot be read");
  return parse_profile({std::istreambuf_iterator<char>(in), {}}, file);
}

Profile parse_profile(const std::string& text, const std::filesystem::path& file) {
  try {
    const Json value = Json::parse(text);
    if (!value.is_object() || !value.contains("palpate_profile")) refuse(file, "JSON of another kind");
    const Json& version = value.at("palpate_profile");
    if (version != kProfileVersion)
      refuse(file,
             "version " + version.dump() + " where this program reads " + std::to_string(kProfileVersion));
    check_numbers(value, "", file);
    auto profile = value.get<Profile>();
    // An earlier version also wrote what a model said of cards that were not there.
    if (const std::string kind = value.at("machine").value("kind", "executed"); kind != "executed")
      refuse(file, "figures that are " + kind + ", not measured");
    if (value.contains("live")) profile.live = value.at("live").get<std::vector<LiveFigure>>();
    for (const SizeFigure& size : profile.sizes) {
      if (size.width_px == 0 || size.height_px == 0 || size.latency.median_ms <= 0)
        refuse(file, "a frame of no size or no time at /sizes");
    }
    return profile;
  } catch (const Json::parse_error& error) {
    refuse(file, "damaged JSON at byte " + std::to_string(error.byte));
  } catch (const Json::exception& error) {
    refuse(file, plain(error));
  }
}

std::string size_text(uint32_t width_px, uint32_t height_px) {
  return std::to_string(width_px) + " x " + std::to_string(height_px);
}

}  // namespace palpate::perf
