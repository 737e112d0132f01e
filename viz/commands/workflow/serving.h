// Serving of one live run, of one finger or two: what it sends, and what clients ask of it.
#pragma once

#include <filesystem>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "capture/live/live_options.h"
#include "capture/live/recorder.h"
#include "capture/pair/pair_session.h"
#include "capture/run/process/processing.h"
#include "capture/serve/server.h"
#include "engine/base/facts.h"
#include "viz/live/tare.h"

namespace palpate {

/// Requests of clients (each with JSON, {} where nothing is said) under the sensor's name, or "/grip" for
/// both of two fingers:
/// - zero: {"on": true}; force and shear that are sent, and the forces of the grip, are less than what they
/// are
///   now, until {"on": false}
/// - mark: {"text": "..."}; an event, also in events.csv
/// - start, stop: a session, where there is a folder for one; start answers with its name
class Serving {
 public:
  /// `notes`: folder of events while nothing is recorded; empty: none. Throws as LiveServer does.
  Serving(ServeOptions options, const LiveHub::Publisher& sensor, std::filesystem::path notes);
  /// Serves the run of two fingers, which this outlives; each finger's events are in a folder of its own.
  Serving(ServeOptions options, const PairParts& parts, std::filesystem::path notes);
  ~Serving();
  Serving(const Serving&) = delete;
  Serving& operator=(const Serving&) = delete;

  /// Serves the run of these options from its start on; both outlive the run. `recording` may be null.
  void attach(LiveOptions& options, Recording* recording);
  /// Serves what is processed: the newest frame, 30 times a second at most, and less often where it would
  /// take more than 3 % of the thread that processes.
  void attach(ProcessRequest& request);
  /// Where, in a line for people, with a warning for those who serve others than this machine.
  std::string where() const;
  /// Ends; a line and the numbers of what was served.
  Facts finish();

 private:
  struct Finger {
    viz::Tare tare;
    std::optional<Touch> newest;  ///< as measured
  };
  /// The record switch of the run.
  struct Sessions {
    std::function<void()> start, stop;
    std::function<bool()> on;
    std::function<std::filesystem::path()> folder;  ///< of the newest
  };

  Serving(ServeOptions options, std::vector<LiveHub::Publisher> publishers, std::filesystem::path notes);
  template <typename Switch>
  void take(Switch* recording);
  void carry_out();
  /// Of a run of one finger or two: what is asked of its caller's thread.
  template <typename Options>
  void watch(Options& options);
  void show(size_t finger, const Frame& frame, const Result& result);
  void show(const GripFrame& frame, int64_t host_ns);
  std::string handle(size_t request, const std::string& argument);
  std::string zero(bool on);
  std::string mark(const std::string& text);
  /// Of each finger with its own frame; sent, and written where events are.
  void event(const std::string& kind, const std::function<std::string(const Finger&)>& text);
  void event(const std::string& kind, const std::string& text);

  LiveHub hub_;
  std::optional<LiveServer> server_;
  std::filesystem::path notes_;
  bool open_ = false;  ///< to other machines
  std::optional<Sessions> sessions_;
  std::optional<PairMeter> meter_;
  std::mutex mutex_;  ///< of what follows: each finger has its thread
  std::vector<Finger> fingers_;
  std::optional<Grip> grip_, grip_zero_;
};

}  // namespace palpate
