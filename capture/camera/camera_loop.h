// Loop of a camera's stream, whatever its kind: a stream that stalls is started again, a camera that was
// unplugged is opened anew once it is back.
#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "capture/camera/camera_log.h"
#include "palpate/frame.h"

namespace palpate {

class CameraLoop {
 public:
  enum class Event {
    Nothing,  ///< no frame for a while, or a damaged one
    Ready,    ///< a frame was filled
    Broken,   ///< the stream reports an error
    Gone,     ///< the camera is no longer there
  };

  /// `retry_ns`: between tries to open an absent camera.
  explicit CameraLoop(int64_t retry_ns) : pause_ns_(retry_ns) {}
  virtual ~CameraLoop() = default;

  /// Waits for a frame as long as it takes; false only when cancelled.
  bool next(Frame& frame);

  std::function<bool()> cancelled;
  CameraLog log;
  int64_t timeout_ns = 0;  ///< without a frame for so long the stream is started again

 protected:
  static constexpr int kWait_ms = 40;  // between looks at `cancelled`

  virtual bool is_open() const = 0;
  /// Waits up to kWait_ms.
  virtual Event take(Frame& frame) = 0;
  /// The camera is there, its stream is dead; false where it does not start.
  virtual bool restart() = 0;
  virtual void close() = 0;
  /// Opens the camera and starts its stream; false where it is not there. Otherwise returns true with what
  /// was not as before in `but`, empty where all was; throws Error(Failure::Device) where it is there and
  /// does not start, and is closed then.
  virtual bool reopen(std::string& but) = 0;

 private:
  bool waited();
  void start_again(const std::string& why);
  void let_go(const std::string& why);
  void come_back();

  int64_t pause_ns_, tried_ns_ = 0;
};

}  // namespace palpate
