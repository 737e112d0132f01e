// palpate setup in a window.
#pragma once

#include <filesystem>
#include <optional>

#include "viz/commands/command.h"
#include "viz/commands/workflow/sensor_setup.h"
#include "viz/panels/settings.h"
#include "viz/panels/setup_view.h"
#include "viz/panels/start/start_view.h"
#include "viz/render/window.h"

namespace palpate {

/// The form and what was made by it, kept while the person looks at something else.
class SetupWindow {
 public:
  /// `folder`: where sensor files are written unless another place is typed; may be empty.
  SetupWindow(const SetupInputs& known, const std::filesystem::path& sensor_file,
              std::filesystem::path folder);

  /// Until the person leaves the form: the recording and its sensor file where they want to look at them.
  std::optional<viz::Choice> fill_in(gpu::Context& context, viz::Window& window, viz::Settings& settings);

  /// Another recording, where one was typed.
  void take_recording(const std::string& typed);

 private:
  void open(viz::SetupView& view);
  void propose(viz::SetupView& view);
  void make(viz::SetupView& view);
  bool run(viz::SetupView& view, SensorSetup::Part part);
  void show_steps(viz::SetupView& view) const;
  SetupInputs inputs() const;

  SetupInputs known_;
  std::filesystem::path folder_;
  viz::SetupForm form_;
  std::optional<Frame> picture_;  ///< of the recording that is open
  std::optional<SensorSetup> made_;
};

/// The list of sources with the form in front.
Report setup_in_window(const Common& common, const SetupInputs& known);

}  // namespace palpate
