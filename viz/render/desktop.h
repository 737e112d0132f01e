// The desktop that windows are opened on.
#pragma once

#include <string>
#include <vector>

namespace palpate::viz {

/// Is there a display that Vulkan can draw to?
bool display_available();
/// The desktop's last error message, e.g. right after display_available() found none.
std::string desktop_message();
/// Extensions that the Context of a window needs (ContextOptions::instance_extensions, with presentation =
/// true). Throws Error(Failure::Display) without a display.
std::vector<const char*> window_extensions();

}  // namespace palpate::viz
