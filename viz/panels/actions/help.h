// The help: mouse movements and keys with what they do.
#pragma once

#include <vulkan/vulkan.h>

#include <string>
#include <vector>

#include "viz/render/window.h"

namespace palpate::viz {

struct Action;
struct Circumstances;

/// One line of it.
struct KeyHelp {
  std::string keys;
  std::string what;
};

/// "Ctrl + Left".
std::string words_of(const KeyPress& chord);
/// Mouse and keys that do something now.
std::vector<KeyHelp> key_help(const Circumstances& now);
/// The same of a window that has these actions, and no charts that the mouse moves.
std::vector<KeyHelp> key_help(const Circumstances& now, bool (*has)(const Action&));

/// Over the middle of the whole picture; `open` becomes false where the person closes it.
void help_window(VkExtent2D extent, float scale, const std::vector<KeyHelp>& lines, bool& open);

}  // namespace palpate::viz
