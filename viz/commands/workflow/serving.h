// Serving of one live run: what it sends, and what clients ask of it.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "capture/live/live_options.h"
#include "capture/live/recorder.h"
#include "capture/serve/server.h"
#include "engine/base/facts.h"
#include "viz/live/tare.h"

namespace palpate {

/// Requests of clients (each with JSON, {} where nothing is said) under the sensor's name:
/// - zero: {"on": true}; force and shear that are sent are less than what they are now, until {"on": false}
/// - mark: {"text": "..."}; an event, also in events.csv
/// - start, stop: a session, where there is a folder for one; start answers with its name
class Serving {
 public:
  /// `notes`: folder of events while nothing is recorded; empty: none. Throws as LiveServer does.
  Serving(ServeOptions options, const LiveHub::Publisher& sensor, std::filesystem::path notes);
  ~Serving();
  Serving(const Serving&) = delete;
  Serving& operator=(const Serving&) = delete;

  /// Serves the run of these options from its start on; both outlive the run. `recording` may be null.
  void attach(LiveOptions& options, Recording* recording);
  /// Where, in a line for people, with a warning for those who serve others than this machine.
  std::string where() const;
  /// Ends; a line and the numbers of what was served.
  Facts finish();

 private:
  std::string handle(size_t request, const std::string& argument);
  std::string zero(bool on);
  std::string mark(const std::string& text);
  void event(const std::string& kind, const std::string& text);

  LiveHub hub_;
  std::optional<LiveServer> server_;
  std::filesystem::path notes_;
  bool open_ = false;  ///< to other machines
  Recording* recording_ = nullptr;
  viz::Tare tare_;
  std::optional<Touch> newest_;  ///< as measured, without its lists
};

}  // namespace palpate
