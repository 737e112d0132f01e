// View of the list of sources: shown when `palpate` is started without a command.
#pragma once

#include <array>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "viz/panels/actions/help.h"
#include "viz/panels/form_window.h"
#include "viz/panels/settings.h"
#include "viz/panels/start/camera_look.h"
#include "viz/panels/start/card_grid.h"
#include "viz/panels/start/start_list.h"
#include "viz/render/window.h"

namespace palpate::viz {

struct Choice {
  std::string input;   ///< as open_source takes it
  std::string sensor;  ///< sensor file; empty: none
  std::string typed;   ///< where the source was typed: that text
  bool setup = false;  ///< instead: the form for a sensor of one's own, with `typed`
};

/// Error of the last choice.
struct StartTrouble {
  std::string message;  ///< one line; empty: nothing
  Choice choice;
};

/// All keys of the list, in the order of its help.
const std::vector<KeyHelp>& start_key_help();

/// Main thread. One at a time, and none while a Scene draws into the same window.
class StartView {
 public:
  /// `settings` gives the recent sources and takes the text's size. `folder`: where sessions and snapshots
  /// will go.
  StartView(gpu::Context& context, Window& window, Settings& settings, const StartTrouble& trouble,
            std::string folder);

  /// Until the user has chosen; none where the window was closed or `interrupted` says so.
  std::optional<Choice> choose(const std::function<bool()>& interrupted);
  /// Shows that `what` is being opened until `done`; false where the person gave up (Escape).
  bool wait(const std::string& what, const std::function<bool()>& done);

 private:
  void describe();
  void describe_sources(float scale);
  void describe_sensors(float scale);
  void describe_foot(float scale);
  void handle_keys();
  void step(int right, int down);
  void open_selected();
  void switch_look();
  void follow_look();
  void open_text();
  void take_drops();
  void choose_sensor(const std::string& file);
  void load_thumbnails();

  Window& window_;
  Settings& settings_;
  FormWindow page_;
  StartList list_;
  CameraLook look_;
  CardGrid grid_;
  std::vector<size_t> cards_;  ///< for each card its place in list_.sources()
  /// By group and input its place among the page's pictures.
  std::map<std::pair<SourceEntry::Group, std::string>, size_t> thumbnail_of_;
  std::string message_;
  bool trouble_ = false;  ///< the message is about something that went wrong
  std::string folder_;
  size_t source_ = 0;        ///< selected, in list_.sources()
  size_t sensor_ = 0;        ///< selected, in list_.sensors()
  bool in_sensors_ = false;  ///< the arrows move in the sensor files
  bool settled_ = false;     ///< the person has moved the selection
  bool scroll_ = true;       ///< to the selection
  std::array<char, 512> typed_{};
  bool wants_text_ = false;  ///< the next picture begins typing
  bool help_ = false;
  std::optional<Choice> chosen_;
};

}  // namespace palpate::viz
