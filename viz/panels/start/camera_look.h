// A look through a camera before it is opened: small live pictures for its card, only where a person asks.
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "capture/source.h"
#include "viz/render/render_target.h"

namespace palpate::viz {

/// One camera at a time, on a thread of its own. Main thread only.
class CameraLook {
 public:
  using Open = std::function<std::unique_ptr<Source>(const std::string& input)>;
  explicit CameraLook(Open open) : open_(std::move(open)) {}
  ~CameraLook() { stop(); }
  CameraLook(const CameraLook&) = delete;
  CameraLook& operator=(const CameraLook&) = delete;

  /// Opens it and shows what it sees until `stop`; the one before is closed first.
  void start(const std::string& input);
  /// The camera is closed when this returns.
  void stop();
  /// The one that is looked through; empty: none.
  const std::string& input() const { return input_; }

  /// Takes over what the camera has sent meanwhile; true where it is new.
  bool update();
  /// At most kThumbnailWidth x kThumbnailHeight, framed; none before the first has come.
  const std::optional<RgbImage>& picture() const { return picture_; }
  /// Why no picture comes, one line; empty while it may.
  const std::string& trouble() const { return trouble_; }

 private:
  void run(const std::string& input);

  Open open_;
  std::string input_;
  std::optional<RgbImage> picture_;
  std::string trouble_;
  std::atomic<bool> ends_{false};
  std::mutex mutex_;  ///< of what follows
  std::optional<RgbImage> newest_;
  std::optional<std::string> failure_;
  std::thread thread_;
};

}  // namespace palpate::viz
