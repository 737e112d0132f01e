// A session measured once more exactly as it was when it was recorded, and the two compared.
#pragma once

#include <cstdint>
#include <string>

#include "capture/session/session.h"
#include "palpate/touch.h"

namespace palpate {

/// The frames of a session that were measured when it was recorded, in that order; live, some are not. A gap
/// before a frame that was not measured is one before the next that was.
class MeasuredFrames : public Source {
 public:
  explicit MeasuredFrames(Session& session) : session_(session) {}
  FrameFormat format() const override { return session_.format(); }
  double rate_Hz() const override { return session_.rate_Hz(); }
  bool pictures() const override { return session_.pictures(); }
  std::optional<uint64_t> frame_count() const override { return session_.measured_sequences().size(); }
  bool next(Frame& frame) override;
  std::string warning() const override { return session_.warning(); }
  std::optional<Frame> own_background() const override { return session_.own_background(); }
  CaptureCounts counts() const override { return session_.counts(); }

 private:
  Session& session_;
  bool gap_ = false;
};

/// Comparison of measurements with the recorded ones, as text with every digit.
struct RecordedCheck {
  uint64_t equal = 0;
  uint64_t different = 0;
  std::string first_difference;  ///< frame, column, both values; empty without one

  void add(const Session& session, const Touch& touch);
};

}  // namespace palpate
