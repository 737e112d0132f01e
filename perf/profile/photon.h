// From photon to picture: what each thread does in a frame's time while a camera sets the pace.
#pragma once

#include <string>
#include <vector>

#include "perf/profile/live.h"
#include "perf/profile/profile.h"
#include "perf/profile/sampling.h"

namespace palpate::perf {

/// The steps of a frame, in their order; each part of a trace belongs to one.
inline constexpr const char* kPhotonSteps[] = {"capture", "submit",    "device", "finish",
                                               "draw",    "hand over", "record"};

/// The work of each thread, from a trace (TraceFile) of a live run: what remains of a span without those
/// within it, step by step. Throws json::Error on a text that is no trace.
std::vector<ThreadPart> thread_parts(const std::string& trace);

/// Three scenes, simulated beforehand into memory: a waveguide with force and contacts, a colour gel with its
/// surface, a gel with markers and its traction. Capture, engine, off-screen drawing and the recording of a
/// session run in threads of their own, as in the window; then the same without drawing and recording as fast
/// as every frame can be measured. Into `profile.photon`; what there is no time for is skipped.
void measure_photon(const gpu::ContextOptions& device, const MakeDrawer& drawer, double seconds,
                    const Watch& watch, Profile& profile);

}  // namespace palpate::perf
