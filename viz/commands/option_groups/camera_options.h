// Options of a camera on the command line, composed into the one string that opens it.
#pragma once

#include <string>
#include <vector>

namespace palpate {

class CommandLine;

/// Requested settings of a camera; texts as capture/camera/camera_options.h reads them.
struct CameraChoice {
  std::vector<std::string> nodes;  ///< one, or left=NAME and right=NAME of two fingers
  std::string format;
  std::string size;
  std::string rate;
  std::string exposure;
  std::string gain;
  std::string white_balance;
  std::string trigger;
  std::string timeout;
  std::string buffers;
  std::vector<std::string> controls;  ///< NAME=VALUE

  /// Adds --camera, --format, --size, --fps, --exposure, --gain, --white-balance, --control,
  /// --trigger, --camera-timeout, --camera-buffers. The choice must outlive the parsing.
  void add_to(CommandLine& command);
  /// "camera:..." where --camera is given, else `input`. Throws Error(Failure::Usage) where both are, where
  /// options of a camera come without one, or a value makes no sense. An `input` that is a camera itself
  /// takes no options with it.
  std::string input(const std::string& input) const;
  /// "camera:..." of --camera SIDE=NAME, which names a camera by its port or serial number; empty: there is
  /// none. Throws Error(Failure::Usage) where a side is named twice, or something without a side beside it;
  /// Error(Failure::Device) where there is no such camera.
  std::string finger(const std::string& side) const;

 private:
  /// "camera:..." of this node, or, with an empty one, nothing where no option of a camera was given.
  std::string composed(const std::string& node) const;

  CommandLine* command_ = nullptr;
};

}  // namespace palpate
