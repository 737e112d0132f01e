// The help: mouse movements and keys with what they do.
#pragma once

#include <vulkan/vulkan.h>

#include <string>
#include <vector>

namespace palpate::viz {

/// One line of it.
struct KeyHelp {
  std::string keys;
  std::string what;
};

/// Over the middle of the whole picture; `open` becomes false where the person closes it.
void help_window(VkExtent2D extent, float scale, const std::vector<KeyHelp>& lines, bool& open);

}  // namespace palpate::viz
