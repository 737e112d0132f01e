// What a profile shows, each in one sentence: the first line of its report, the titles of its plots.
#pragma once

#include <string>
#include <vector>

#include "perf/profile/profile.h"

namespace palpate::perf {

/// In the order in which they were measured.
std::vector<std::string> readings_of(const Profile& profile);

/// The largest frames of each reading that reach 30 a second: "up to" where larger ones were measured and do
/// not, else "at", as larger ones were not tried.
std::string headline(const Profile& profile);
/// Of the largest frame of a reading: the stage that takes most of it.
std::string slowest_stage(const Profile& profile, const std::string& reading);
/// Of the largest frame of a reading: the time within which 99 of 100 are done.
std::string usual_latency(const Profile& profile, const std::string& reading);
/// The largest share of the measured ceiling that a stage reaches.
std::string best_bandwidth(const Profile& profile, const std::string& reading);

}  // namespace palpate::perf
