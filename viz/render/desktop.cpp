#include "viz/render/desktop.h"

#define GLFW_INCLUDE_NONE
#define GLFW_INCLUDE_VULKAN
#include <GLFW/glfw3.h>

#include "palpate/error.h"

namespace palpate::viz {

// GLFW lives as long as the process: the Vulkan instance may not outlive its connection to the display.
static bool start_glfw() {
  static const bool started = glfwInit() == GLFW_TRUE;
  return started;
}

std::string desktop_message() {
  const char* text = nullptr;
  if (glfwGetError(&text) == GLFW_NO_ERROR || !text) return "no display";
  return text;
}

bool display_available() {
  return start_glfw() && glfwVulkanSupported();
}

std::vector<const char*> window_extensions() {
  constexpr const char* kRemedy =
      "a desktop session, DISPLAY or WAYLAND_DISPLAY set, or palpate process, which needs no window";
  if (!start_glfw()) throw Error(Failure::Display, "a display for the window", desktop_message(), kRemedy);
  uint32_t count = 0;
  const char** names = glfwGetRequiredInstanceExtensions(&count);
  if (!names) throw Error(Failure::Display, "a display that Vulkan can draw to", desktop_message(), kRemedy);
  return {names, names + count};
}

}  // namespace palpate::viz
