// session.json: description of a session.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "capture/session/session.h"
#include "engine/base/clock.h"

namespace palpate {

inline constexpr const char* kSessionJson = "session.json";
inline constexpr const char* kSessionFrames = "frames.mkv";
inline constexpr const char* kSessionRows = "frames.csv";
inline constexpr const char* kSessionBackground = "background.png";

/// When a session began.
struct SessionStart {
  std::string date;  ///< and time, ISO 8601
  WallClock clock;
};

/// Facts of a session that are known only at its end.
struct SessionEnd {
  bool complete = false;
  uint64_t frames = 0;
  uint64_t dropped = 0;
  uint64_t measured = 0;
  uint64_t unmatched = 0;
  uint64_t video_bytes = 0;
  std::string ended_by;  ///< why, where not complete
  std::optional<WallClock> clock;
};

struct SessionText {
  SessionInfo info;
  SessionEnd end;
  bool has_background = false;
  std::optional<WallClock> clock;  ///< at its start; sessions of older versions have none
};

std::string to_text(const SessionInfo& info, const SessionEnd& end, const SessionStart& start);
/// session.json of a session's folder as it stands; empty where it cannot be read.
std::string session_json(const std::filesystem::path& folder);
/// `where` names the text in messages. Keys that this version does not know are ignored, those it needs must
/// be there. Throws Error(Failure::Input), of a newer version too; Error(Failure::Sensor) for its sensor.
SessionText session_from_text(const std::string& text, const std::string& where);

}  // namespace palpate
