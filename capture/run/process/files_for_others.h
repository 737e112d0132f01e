// Files in the formats of other programs, of one recording or of two fingers together.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "capture/hdf5/episode.h"
#include "capture/log/session_logs.h"
#include "capture/mcap/recording.h"

namespace palpate {

struct FilesForOthers {
  std::optional<McapFile> mcap;
  std::optional<EpisodeFile> episode;
  int64_t zero_ns = 0;  ///< of the times in them, since 1970; 0: their date is not known

  /// Both are whole. Throws Error(Failure::Output).
  void close() {
    if (mcap) mcap->close();
    if (episode) episode->commit();
  }
};

/// A log beside what is in them; `begun_ns`: what its times count from, since 1970; `root`: "/left" of two.
/// Throws Error(Failure::Output).
void add_log(const AlignedLog& log, FilesForOthers& files, int64_t begun_ns, const std::string& root = {});

}  // namespace palpate
