// List of sources: recent ones, cameras of this machine, simulated touches; and the sensor files for them.
#pragma once

#include <atomic>
#include <filesystem>
#include <future>
#include <string>
#include <utility>
#include <vector>

#include "viz/panels/settings.h"
#include "viz/render/render_target.h"

namespace palpate::viz {

/// One line of the list.
struct SourceEntry {
  enum class Group { Recent, Cameras, Synthetic } group = Group::Recent;
  std::string input;       ///< as open_source takes it; empty: a remark that cannot be opened
  std::string name;        ///< what a person reads first
  std::string detail;      ///< and below it
  std::string sensor;      ///< sensor file that was used with it; empty: none
  bool missing = false;    ///< a recording that is no longer where it was
  std::string whole = {};  ///< all that is known, where there is room for it
  std::string still = {};  ///< of a camera: the recent source whose picture it sent last; empty: none

  /// Whether the arrows stop here.
  bool can_be_chosen() const { return !input.empty(); }
};

/// A sensor file that can be chosen.
struct SensorEntry {
  std::string file;    ///< empty: none, what the source brings itself
  std::string name;    ///< the sensor's own
  std::string detail;  ///< the file, or why it cannot be used
  bool usable = true;
  bool shipped = false;  ///< comes with the program
};

class StartList {
 public:
  /// Looks for cameras and sensor files on threads of their own: those that `settings` remembers, and those
  /// in the working folder.
  explicit StartList(const Settings& settings);
  ~StartList() { ends_ = true; }

  /// Looks again.
  void refresh(const Settings& settings);
  /// Takes over what the threads found meanwhile; true where something changed.
  bool update();

  const std::vector<SourceEntry>& sources() const { return sources_; }
  const std::vector<SensorEntry>& sensors() const { return sensors_; }
  /// Pictures of simulated touches by their input, once they are made.
  const std::vector<std::pair<std::string, RgbImage>>& simulated() const { return simulated_; }
  bool looking() const { return cameras_.valid() || files_.valid() || pictures_.valid(); }
  /// The sensor file that the source would be opened with if `sensor` is the one that is chosen, and why.
  std::string opened_with(size_t source, size_t sensor) const;

  /// Cameras as they were found, each with what it was opened with last, and its picture of then.
  static void remember_last_use(std::vector<SourceEntry>& cameras,
                                const std::vector<Settings::Recent>& recent);
  /// A source that the user typed or dropped: a session, a recording, camera:..., synthetic:...
  static SourceEntry from_text(const std::string& text);
  /// Whether `text` is the place of a sensor file, not of something to look at.
  static bool is_sensor_file(const std::string& text);
  /// Adds a sensor file; returns its place in sensors().
  size_t add_sensor(const std::filesystem::path& file);

 private:
  void collect(const Settings& settings);

  std::vector<Settings::Recent> recent_;
  std::vector<SourceEntry> sources_;
  std::vector<SensorEntry> sensors_;
  std::future<std::vector<SourceEntry>> cameras_;
  std::future<std::vector<SensorEntry>> files_;
  std::vector<std::pair<std::string, RgbImage>> simulated_;
  std::atomic<bool> ends_{false};  ///< no further picture is wanted
  std::future<std::vector<std::pair<std::string, RgbImage>>> pictures_;
};

/// A message as it is said in the window, where nobody has given options: by the names of what is seen there.
std::string in_the_window(std::string message);

}  // namespace palpate::viz
