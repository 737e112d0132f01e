#include "perf/profile/profile.h"

#include <cmath>
#include <fstream>
#include <iterator>
#include <tuple>

#include "palpate/error.h"

namespace palpate::perf {
namespace {

using Json = json::Value;

template <typename Struct, typename Value>
struct Field {
  const char* name;
  Value Struct::*member;
};
template <typename Struct, typename Value>
constexpr Field<Struct, Value> field(const char* name, Value Struct::*member) {
  return {name, member};
}

// Fields of each struct; their names are those of the file.
#define FIELD(name) field(#name, &S::name)
#define FIELDS(Struct, ...)                 \
  constexpr auto fields_of(const Struct*) { \
    using S = Struct;                       \
    return std::tuple{__VA_ARGS__};         \
  }
FIELDS(Distribution, FIELD(samples), FIELD(min_ms), FIELD(q25_ms), FIELD(median_ms), FIELD(q75_ms),
       FIELD(p95_ms), FIELD(p99_ms), FIELD(max_ms))
FIELDS(Histogram, FIELD(edges_ms), FIELD(counts))
FIELDS(Machine, FIELD(device), FIELD(device_type), FIELD(driver), FIELD(vulkan), FIELD(device_memory_bytes),
       FIELD(cpu), FIELD(cpu_threads), FIELD(memory_bytes), FIELD(system), FIELD(compiler), FIELD(palpate),
       FIELD(libraries), FIELD(date_utc))
FIELDS(CeilingPoint, FIELD(buffer_bytes), FIELD(copy_GB_per_s), FIELD(stream_GB_per_s))
FIELDS(Ceiling, FIELD(points), FIELD(GB_per_s), FIELD(clock), FIELD(clock_ratio), FIELD(submit_ms))
FIELDS(StageFigure, FIELD(stage), FIELD(time), FIELD(read_bytes), FIELD(written_bytes), FIELD(dispatches),
       FIELD(GB_per_s), FIELD(ceiling_fraction))
FIELDS(SizeFigure, FIELD(reading), FIELD(width_px), FIELD(height_px), FIELD(latency), FIELD(histogram),
       FIELD(cpu_ms), FIELD(frames_per_s), FIELD(memory_bytes), FIELD(setup_ms), FIELD(stages))
FIELDS(Growth, FIELD(reading), FIELD(stage), FIELD(exponent), FIELD(exponent_standard_error), FIELD(from_px),
       FIELD(sizes))
FIELDS(SolverFigure, FIELD(truth), FIELD(width_px), FIELD(height_px), FIELD(solver), FIELD(where),
       FIELD(relative_rms_error), FIELD(peak_to_valley_error), FIELD(time), FIELD(cpu_ms), FIELD(on_front))
FIELDS(OutputFigure, FIELD(outputs), FIELD(reading), FIELD(width_px), FIELD(height_px),
       FIELD(touched_fraction), FIELD(time), FIELD(cpu_ms), FIELD(cpu_ratio), FIELD(cpu_ratio_q25),
       FIELD(cpu_ratio_q75), FIELD(memory_bytes))
#define PACED                                                                                     \
  FIELD(width_px), FIELD(height_px), FIELD(rate_Hz), FIELD(frames), FIELD(dropped_before_engine), \
      FIELD(dropped_before_display), FIELD(to_measured), FIELD(to_picture)
FIELDS(LiveFigure, FIELD(reading), PACED)
FIELDS(RateFigure, FIELD(scene), PACED, FIELD(frames_per_s))
FIELDS(ThreadPart, FIELD(thread), FIELD(step), FIELD(part), FIELD(time), FIELD(ms_per_turn), FIELD(busy))
FIELDS(PhotonFigure, FIELD(scene), PACED, FIELD(waits_ms), FIELD(frames_per_s), FIELD(parts))
#undef PACED
FIELDS(Skipped, FIELD(what), FIELD(why))
FIELDS(Profile, FIELD(complete), FIELD(budget_s), FIELD(elapsed_s), FIELD(machine), FIELD(ceiling),
       FIELD(sizes), FIELD(growth), FIELD(solvers), FIELD(outputs), FIELD(skipped))
#undef FIELDS
#undef FIELD

template <typename T>
inline constexpr bool kIsList = false;
template <typename T>
inline constexpr bool kIsList<std::vector<T>> = true;

template <typename T>
Json written(const T& value) {
  if constexpr (requires { fields_of(&value); }) {
    Json json = Json::object();
    std::apply([&](const auto&... f) { ((json[f.name] = written(value.*f.member)), ...); },
               fields_of(&value));
    return json;
  } else if constexpr (kIsList<T>) {
    Json list = Json::array();
    for (const auto& one : value) list.push_back(written(one));
    return list;
  } else {
    return value;
  }
}

template <typename T>
void read(const Json& json, T& value) {
  if constexpr (requires { fields_of(&value); }) {
    std::apply([&](const auto&... f) { (read(json.at(f.name), value.*f.member), ...); }, fields_of(&value));
  } else if constexpr (kIsList<T>) {
    if (!json.is_array())
      throw json::Error("an array expected, " + json.dump(-1, json::Utf8::Replace) + " found");
    for (const Json& one : json) read(one, value.emplace_back());
  } else {
    json.get_to(value);
  }
}

/// `found` may quote keys and values of the file.
[[noreturn]] void refuse(const std::filesystem::path& file, std::string found) {
  constexpr size_t kLongest = 300;
  if (found.size() > kLongest) found.replace(kLongest, found.npos, "...");
  for (char& c : found)
    if (c < ' ' || c > '~') c = '?';
  throw Error(Failure::Input, "a profile.json of `palpate profile` in '" + file.string() + "'", found,
              "the profile.json of a finished run, or profiling again");
}

/// Every number is finite, and none but exponents negative; what is not finite is written as null.
void check_numbers(const Json& value, const std::string& place, const std::filesystem::path& file) {
  if (value.is_structured()) {
    for (size_t i = 0; i < value.size(); ++i)
      check_numbers(value.begin()[i], place + "/" + (value.is_object() ? value.keys()[i] : std::to_string(i)),
                    file);
  } else if (value.is_null()) {
    refuse(file, "null at " + place);
  } else if (value.is_number()) {
    const double number = value.number();
    const bool may_be_negative = place.ends_with("/exponent");
    if (!std::isfinite(number) || (number < 0 && !may_be_negative))
      refuse(file, value.dump() + " at " + place);
  }
}

}  // namespace

Json to_json(const Profile& profile) {
  Json value = written(profile);
  value["live"] = written(profile.live);
  value["rates"] = written(profile.rates);
  value["photon"] = written(profile.photon);
  value["palpate_profile"] = kProfileVersion;
  value.sort_keys();
  return value;
}

std::string file_text(const Profile& profile) {
  return to_json(profile).dump(1, json::Utf8::Replace) + "\n";
}

Profile load_profile(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  if (!in || std::filesystem::is_directory(file)) refuse(file, "no such file, or one that cannot be read");
  return parse_profile({std::istreambuf_iterator<char>(in), {}}, file);
}

Profile parse_profile(const std::string& text, const std::filesystem::path& file) {
  Json value;
  try {
    value = json::parse(text, {.deepest = 16});
  } catch (const json::Error& error) {
    refuse(file, std::string("damaged JSON, ") + error.what());
  }
  const Json* const version = value.find("palpate_profile");
  if (!version) refuse(file, "JSON of another kind");
  if (!(*version == Json(kProfileVersion)))
    refuse(file, "version " + version->dump(-1, json::Utf8::Replace) + " where this program reads " +
                     std::to_string(kProfileVersion));
  check_numbers(value, "", file);
  Profile profile;
  try {
    read(value, profile);
    if (const Json* live = value.find("live")) read(*live, profile.live);
    if (const Json* rates = value.find("rates")) read(*rates, profile.rates);
    if (const Json* photon = value.find("photon")) read(*photon, profile.photon);
  } catch (const json::Error& error) {
    refuse(file, error.what());
  }
  // An earlier version also wrote what a model said of cards that were not there.
  if (const Json* kind = value.at("machine").find("kind"); kind && !(*kind == Json("executed")))
    refuse(file, "figures that are " + kind->dump(-1, json::Utf8::Replace) + ", not measured");
  for (const SizeFigure& size : profile.sizes)
    if (size.width_px == 0 || size.height_px == 0 || size.latency.median_ms <= 0)
      refuse(file, "a frame of no size or no time at /sizes");
  return profile;
}

std::string size_text(uint32_t width_px, uint32_t height_px) {
  return std::to_string(width_px) + " x " + std::to_string(height_px);
}

}  // namespace palpate::perf
