// A live session's window: its title and size, and where its notes go.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "capture/files/event_log.h"
#include "viz/live/vsync.h"

namespace palpate::viz {

class Window;
struct Settings;

/// A live session as its window shows it.
struct WindowRun {
  std::string title = "palpate";
  uint32_t width = 1280;  ///< px of the window
  uint32_t height = 720;  ///< px
  Vsync vsync = Vsync::On;
  double replay_start_s = 0;  ///< time of a replay's first frame
  /// Folder of snapshots (palpate-NNNN.png and its companions) and events.csv while nothing is recorded, else
  /// they lie in the session that is being written; empty: there are none.
  std::filesystem::path notes;
  std::vector<Event> known_events;  ///< of a replay: what its events.csv holds
  Window* window = nullptr;         ///< shown in it; null: a window of its own
  Settings* settings = nullptr;     ///< how the view starts, and how it was left; null: defaults
  bool from_list = false;           ///< the person chose this source in the window
};

}  // namespace palpate::viz
