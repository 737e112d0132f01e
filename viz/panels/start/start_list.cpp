#include "viz/panels/start/start_list.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <fstream>
#include <utility>

#include "capture/genicam/module.h"
#include "capture/open_source.h"
#include "capture/sensors/shipped_sensors.h"
#include "capture/synthetic/synthetic.h"
#include "capture/synthetic/tissue.h"
#include "capture/v4l2/device.h"
#include "palpate/error.h"
#include "palpate/sensor.h"
#include "viz/panels/start/thumbnails.h"
#include "viz/render/format.h"

namespace palpate::viz {
namespace {

namespace fs = std::filesystem;
using Group = SourceEntry::Group;

std::vector<SourceEntry> find_cameras() {
  std::vector<SourceEntry> found;
  std::string trouble;
  for (const v4l2::NodeReport& node : v4l2::list_nodes()) {
    if (node.capture) {
      const std::string busy = v4l2::holders_of(node.path);
      found.push_back({Group::Cameras,
                       "camera:" + node.path,
                       node.identity.card,
                       node.path + (busy.empty() ? "" : ", in use by " + busy),
                       {}});
    } else if (!node.trouble.empty()) {
      trouble = node.path + ": " + node.trouble;
    }
  }
  if (const genicam::Module* module = genicam::module_if_there())
    for (const genicam::Identity& camera : module->list(false))
      found.push_back({Group::Cameras,
                       "camera:genicam:" + camera.id,
                       camera.vendor + " " + camera.model,
                       camera.protocol + ", serial number " + camera.serial,
                       {}});
  if (found.empty())
    found.push_back({Group::Cameras,
                     "",
                     "no camera found",
                     trouble.empty() ? "plug one in, then Search again" : trouble,
                     {}});
  return found;
}

SensorEntry describe_sensor(const fs::path& file) {
  SensorEntry entry{file.string(), file.filename().string(), file.string(), true};
  try {
    const Sensor sensor = load_sensor(file);
    entry.name = sensor.name;
  } catch (const std::exception& e) {
    entry.usable = false;
    entry.detail = e.what();
  }
  return entry;
}

bool says_that_it_is_a_sensor(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  const std::string text{std::istreambuf_iterator<char>(in), {}};
  return text.find("\"palpate_sensor\"") != std::string::npos;
}

/// Files of the working folder that say of themselves that they are sensors.
std::vector<fs::path> sensor_files_here() {
  constexpr size_t kMost = 20;
  constexpr uintmax_t kLargest_bytes = 1 << 20;
  std::vector<fs::path> files;
  std::error_code code;
  const fs::path here = fs::current_path(code);
  if (code) return files;
  for (const fs::directory_entry& entry : fs::directory_iterator(here, code)) {
    if (entry.path().extension() != ".json" || !entry.is_regular_file(code)) continue;
    if (entry.file_size(code) > kLargest_bytes || code) continue;
    if (says_that_it_is_a_sensor(entry.path())) files.push_back(entry.path());
    if (files.size() == kMost) break;
  }
  std::sort(files.begin(), files.end());
  return files;
}

std::vector<SensorEntry> find_sensors(const std::vector<std::string>& remembered) {
  std::vector<SensorEntry> found;
  const auto add = [&](const fs::path& file, bool shipped = false) {
    const std::string name = file.lexically_normal().string();
    if (std::any_of(found.begin(), found.end(), [&](const SensorEntry& e) { return e.file == name; })) return;
    found.push_back(describe_sensor(name));
    found.back().shipped = shipped;
    if (shipped && found.back().usable) found.back().detail = "comes with palpate";
  };
  std::error_code code;
  for (const std::string& file : remembered)
    if (fs::exists(file, code)) add(file);
  for (const fs::path& file : sensor_files_here()) add(file);
  for (const fs::path& file : shipped_sensors()) add(file, true);
  return found;
}

/// The most useful entries come first.
struct SimulatedTouch {
  const char* scene;
  const char* options;
  const char* pad;
};
constexpr std::array<SimulatedTouch, 19> kSimulatedTouches{{
    {"palpation", "", "waveguide"},
    {"press", "mode=gel&", "gel"},
    {"press", "", "waveguide"},
    {"slide", "", "waveguide"},
    {"slide", "mode=gel&", "gel"},
    {"drag", "skin=texture&", "waveguide, textured"},
    {"drag", "mode=gel&skin=markers&", "gel, markers"},
    {"twist", "mode=gel&skin=markers&", "gel, markers"},
    {"pull", "", "waveguide"},
    {"fingers", "", "waveguide"},
    {"grip", "", "waveguide"},
    {"fingers", "mode=gel&", "gel"},
    {"palpation", "mode=gel&", "gel"},
    {"rig", "hysteresis=0.04&", "waveguide"},
    {"stick", "skin=texture&", "waveguide, textured"},
    {"flat", "", "waveguide"},
    {"flat", "mode=gel&", "gel"},
    {"still", "", "waveguide"},
    {"still", "mode=gel&", "gel"},
}};

template <typename T>
bool is_ready(const std::future<T>& future) {
  return future.valid() && future.wait_for(std::chrono::seconds(0)) == std::future_status::ready;
}

}  // namespace

StartList::StartList(const Settings& settings) {
  refresh(settings);
  std::vector<std::string> inputs;
  for (const SourceEntry& e : sources_)
    if (e.group == Group::Synthetic) inputs.push_back(e.input);
  pictures_ = std::async(std::launch::async, [this, inputs] {
    std::vector<std::pair<std::string, RgbImage>> pictures;
    for (const std::string& input : inputs)
      if (auto picture = ends_ ? std::nullopt : simulated_thumbnail(input))
        pictures.emplace_back(input, std::move(*picture));
    return pictures;
  });
}

void StartList::refresh(const Settings& settings) {
  collect(settings);
  // A look that is still going on is as good as a new one.
  if (!cameras_.valid()) cameras_ = std::async(std::launch::async, find_cameras);
  if (!files_.valid())
    files_ = std::async(std::launch::async, [files = settings.sensors] { return find_sensors(files); });
}

void StartList::collect(const Settings& settings) {
  std::vector<SourceEntry> cameras;
  for (const SourceEntry& e : sources_)
    if (e.group == Group::Cameras) cameras.push_back(e);
  if (cameras.empty()) cameras.push_back({Group::Cameras, "", "looking for cameras", "", {}});
  recent_ = settings.recent;
  sources_.clear();
  for (const Settings::Recent& r : settings.recent) {
    SourceEntry entry = from_text(r.input);
    entry.sensor = r.sensor;
    entry.group = Group::Recent;
    entry.whole = entry.detail + (r.sensor.empty() ? "" : "\nread with " + r.sensor);
    if (r.largest_N > 0 && !entry.missing) entry.detail = text("up to %.3g N", r.largest_N);
    sources_.push_back(entry);
  }
  if (settings.recent.empty())
    sources_.push_back({Group::Recent,
                        "",
                        "nothing yet",
                        "drop a recording, a session or a sensor file on this window, or type its path",
                        {}});
  sources_.insert(sources_.end(), cameras.begin(), cameras.end());
  const std::vector<std::pair<std::string, std::string>> scenes = synthetic_scenes();
  for (const SimulatedTouch& touch : kSimulatedTouches)
    for (const auto& [scene, what] : scenes)
      if (scene == touch.scene)
        sources_.push_back({Group::Synthetic,
                            "synthetic:" + scene + "?" + touch.options + "repeat=0",
                            scene,
                            touch.pad,
                            {},
                            false,
                            what});
  for (const auto& [keys, name, what] :
       {std::array{"path=hand&turn_deg=20", "textured dome",
                   "an object that a hand slides and turns on a gel"},
        {"shape=bead&path=roll&depth_mm=0.7", "bead", "rolls once round on a gel, and back"},
        {"shape=coin&turn_deg=35", "coin", "slides and turns on a gel"},
        {"shape=relief&path=hand&reach_mm=12&speed_mm_s=6&turn_deg=8", "relief",
         "a hand slides it over a gel: its map grows"}})
    sources_.push_back(
        {Group::Synthetic, std::string("synthetic:object?") + keys + "&repeat=0", name, what, {}});
  sources_.push_back({Group::Synthetic,
                      "synthetic:tissue?d=12&h=3&ratio=4&repeat=0",
                      "lump that is found",
                      kTissueScene,
                      {}});
  sources_.push_back({Group::Synthetic,
                      "synthetic:tissue?repeat=0",
                      "lump in doubt",
                      "smaller and deeper: its stiffness cannot be determined",
                      {}});
  sources_.push_back({Group::Synthetic,
                      "synthetic:tissue?hand=13&d=12&h=3&ratio=4&repeat=0",
                      "lump under a hand",
                      "a hand presses here and there, trembles and tilts the pad",
                      {}});
  for (SourceEntry& e : sources_)
    if (e.whole.empty()) e.whole = e.detail;
  if (sensors_.empty())
    sensors_.push_back({"", "the source's own", "without one: places in px, no depth, no force"});
}

bool StartList::update() {
  bool changed = false;
  if (is_ready(cameras_)) {
    std::erase_if(sources_, [](const SourceEntry& e) { return e.group == Group::Cameras; });
    std::vector<SourceEntry> found = cameras_.get();
    remember_last_use(found, recent_);
    const auto after = std::find_if(sources_.begin(), sources_.end(),
                                    [](const SourceEntry& e) { return e.group == Group::Synthetic; });
    for (SourceEntry& e : found) e.whole = e.detail;
    sources_.insert(after, found.begin(), found.end());
    changed = true;
  }
  if (is_ready(pictures_)) {
    simulated_ = pictures_.get();
    changed = true;
  }
  if (is_ready(files_)) {
    for (SensorEntry& e : files_.get())
      if (std::none_of(sensors_.begin(), sensors_.end(),
                       [&](const SensorEntry& s) { return s.file == e.file; }))
        sensors_.push_back(std::move(e));
    changed = true;
  }
  return changed;
}

std::string StartList::opened_with(size_t source, size_t sensor) const {
  const SourceEntry& e = sources_[source];
  if (!e.can_be_chosen()) return {};
  const std::string begin = "'" + e.name + "' opens with ";
  if (sensor < sensors_.size() && !sensors_[sensor].file.empty())
    return begin + "sensor '" + sensors_[sensor].name + "': chosen on the right";
  if (!e.sensor.empty()) return begin + fs::path(e.sensor).filename().string() + ": as it was opened last";
  if (e.input.starts_with("synthetic:")) return begin + "the sensor that is simulated";
  return begin + "the sensor that it holds itself; without one places are in px, with no depth and no force";
}

void StartList::remember_last_use(std::vector<SourceEntry>& cameras,
                                  const std::vector<Settings::Recent>& recent) {
  for (SourceEntry& camera : cameras)
    for (const Settings::Recent& r : recent)
      if (!camera.input.empty() && r.input.substr(0, r.input.find('?')) == camera.input) {
        camera.sensor = r.sensor;
        camera.still = r.input;
        break;  // the newest comes first
      }
}

SourceEntry StartList::from_text(const std::string& input) {
  SourceEntry entry;
  entry.input = input;
  if (!is_recording(input)) {
    entry.name = input.substr(0, input.find('?'));
    entry.detail = input.find('?') == std::string::npos ? "" : input.substr(input.find('?') + 1);
    return entry;
  }
  const fs::path path(input);
  const fs::path last = path.filename().empty() ? path.parent_path() : path;
  entry.name = last.filename().string();
  entry.detail = last.parent_path().string();
  std::error_code code;
  entry.missing = !fs::exists(path, code);
  if (entry.missing) entry.detail = "no longer there: " + entry.detail;
  return entry;
}

bool StartList::is_sensor_file(const std::string& text) {
  std::error_code code;
  const fs::path path(text);
  return path.extension() == ".json" && fs::is_regular_file(path, code);
}

size_t StartList::add_sensor(const fs::path& file) {
  std::error_code code;
  const fs::path whole = fs::absolute(file, code).lexically_normal();
  const std::string name = code ? file.string() : whole.string();
  for (size_t i = 0; i < sensors_.size(); ++i)
    if (sensors_[i].file == name) return i;
  sensors_.push_back(describe_sensor(name));
  return sensors_.size() - 1;
}

std::string in_the_window(std::string message) {
  constexpr std::array<std::pair<const char*, const char*>, 4> kNames{{
      {"which needs no --sensor", "chosen as 'the source's own'"},
      {"another --out folder", "another folder for recordings"},
      {"--sensor FILE of", "on the right the sensor file of"},
      {"(--background)", "(\"background\" in the sensor file)"},
  }};
  const auto replace = [&](const std::string& what, const std::string& by) {
    for (size_t at = message.find(what); at != std::string::npos; at = message.find(what, at + by.size()))
      message.replace(at, what.size(), by);
  };
  for (const auto& [option, name] : kNames) replace(option, name);
  replace(" --", " ");  // a camera's own are typed after its name: fps=30
  return message;
}

}  // namespace palpate::viz
