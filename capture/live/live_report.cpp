#include "capture/live/live_report.h"

#include <cstdio>

#include "capture/files/press_json.h"
#include "engine/base/json.h"
#include "engine/base/text.h"
#include "engine/gpu/context.h"

namespace palpate {
namespace {

using Json = json::Value;

unsigned long long whole(uint64_t value) {
  return value;
}

Json to_json(const Percentiles& p) {
  if (p.count == 0) return nullptr;
  return {{"frames", p.count}, {"p50_ms", p.p50_ms}, {"p95_ms", p.p95_ms}, {"p99_ms", p.p99_ms}};
}

std::string latency_line(const char* what, const Percentiles& p) {
  std::string line =
      palpate::text("  %-14s p50 %.1f ms, p95 %.1f ms, p99 %.1f ms\n", what, p.p50_ms, p.p95_ms, p.p99_ms);
  return p.count > 0 ? line : "";
}

}  // namespace

std::string describe(const LiveReport& report, const std::vector<Recording::Written>& sessions) {
  std::string line =
      palpate::text("%llu frames captured, %llu measured", whole(report.captured), whole(report.processed));
  std::string text = line;
  if (report.shown > 0) {
    line = palpate::text(", %llu shown in %.1f s: %.1f pictures/s", whole(report.shown), report.seconds,
                         report.shown_per_s);
  } else {
    line = palpate::text(" in %.1f s: %.1f frames/s", report.seconds,
                         report.seconds > 0 ? static_cast<double>(report.captured) / report.seconds : 0);
  }
  text += line;
  text += "\n";
  if (const CaptureCounts& c = report.camera; c.lost + c.damaged + c.gaps > 0) {
    line = palpate::text("camera: %llu frames lost, %llu damaged, away %llu times\n", whole(c.lost),
                         whole(c.damaged), whole(c.gaps));
    text += line;
  }
  if (report.device_losses > 0)
    text += palpate::text("the device was lost and opened anew %u times\n", report.device_losses);
  if (report.to_measured.count > 0) {
    text += report.latency_from_exposure ? "latency from exposure (the driver's time stamp)\n"
                                         : "latency from delivery by the source\n";
    text += latency_line("to measurement", report.to_measured);
    text += latency_line("to display", report.to_shown);
  }
  if (report.processed > 0) {
    line = palpate::text("pixels copied %.2g times a frame on their way to the engine\n",
                         report.copies_per_frame);
    text += line;
  }
  for (const PressAnswer& press : report.presses) text += describe(press) + "\n";
  for (const Recording::Written& session : sessions) text += "session " + describe(session) + "\n";
  return text;
}

Json to_json(const LiveReport& report, const std::vector<Recording::Written>& sessions) {
  Json value = {{"complete", !report.interrupted},
                {"seconds", report.seconds},
                {"captured", report.captured},
                {"processed", report.processed},
                {"shown", report.shown},
                {"shown_per_s", report.shown_per_s},
                {"dropped_before_engine", report.dropped_before_engine},
                {"dropped_before_display", report.dropped_before_display},
                {"device_losses", report.device_losses},
                {"camera_lost", report.camera.lost},
                {"camera_damaged", report.camera.damaged},
                {"camera_gaps", report.camera.gaps},
                {"copies_per_frame", report.copies_per_frame},
                {"latency_from", report.latency_from_exposure ? "exposure" : "delivery"},
                {"latency_to_measured", to_json(report.to_measured)},
                {"latency_to_shown", to_json(report.to_shown)},
                {"draw_median_ms", report.draw_median_ms},
                {"sessions", Json::array()}};
  if (!report.presses.empty()) value["presses"] = json::parse(to_json(report.presses));
  for (const Recording::Written& s : sessions) {
    value["sessions"].push_back({{"folder", s.folder.string()},
                                 {"recorded", s.status.recorded},
                                 {"written", s.status.written},
                                 {"dropped", s.status.dropped},
                                 {"measured", s.status.measured},
                                 {"written_bytes", s.status.written_bytes},
                                 {"error", s.status.error}});
  }
  return value;
}

std::string recording_error(const std::vector<Recording::Written>& sessions) {
  for (const Recording::Written& session : sessions)
    if (!session.status.error.empty()) return session.status.error;
  return "";
}

}  // namespace palpate
