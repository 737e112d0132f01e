// The skin's pattern of a simulated twist followed by the skin stage and by OpenCV, frame by frame in turn.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "capture/synthetic/synthetic.h"
#include "engine/gpu/buffer.h"
#include "engine/gpu/commands.h"
#include "engine/stages/frame/skin.h"
#include "engine/stages/frame/upload.h"
#include "perf/lab/rivals/skin_rival.h"

namespace palpate::perf {

class SkinRun {
 public:
  /// `size`: as 640x480; `pattern`: markers or texture.
  SkinRun(gpu::Context& context, const std::string& size, const std::string& pattern);

  size_t points() const { return points_.size(); }
  /// The next frame, there and back: the skin never jumps. Upload, kernel and what it leaves.
  void follow();
  void rival_follow();
  /// RMS error of one component over a run through the frames, palpate's and OpenCV's, without what each of
  /// them has lost, px.
  std::array<double, 2> errors_px();

 private:
  static constexpr uint64_t kFirst = 45, kFrames = 40;
  static size_t place(size_t turn);

  SyntheticSensor source_;
  Frame untouched_;
  Skin stage_;
  std::vector<std::array<float, 2>> points_;
  std::unique_ptr<OpenCvSkin> rival_;
  std::vector<Frame> frames_;
  std::vector<PaddedImage> images_;
  std::vector<gpu::Commands> commands_;
  gpu::DeviceBuffer records_;
  const std::vector<std::array<float, 2>>* rival_places_ = nullptr;
  size_t turn_ = 0, rival_turn_ = 0;
};

}  // namespace palpate::perf
