// The help: mouse movements and keys with what they do.
#pragma once

#include <vulkan/vulkan.h>

#include <string>
#include <vector>

#include "viz/render/window.h"

namespace palpate::viz {

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

/// Over the middle of the whole picture; `open` becomes false where the person closes it.
void help_window(VkExtent2D extent, float scale, const std::vector<KeyHelp>& lines, bool& open);

}  // namespace palpate::viz
