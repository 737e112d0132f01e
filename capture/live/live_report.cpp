#include "capture/live/live_report.h"

#include "capture/files/estimate_report.h"
#include "engine/base/text.h"

namespace palpate {
namespace {

using Json = json::Value;

unsigned long long printed(uint64_t value) {
  return value;
}

Json to_json(const Percentiles& p) {
  if (p.count == 0) return nullptr;
  return {{"frames", p.count}, {"p50_ms", p.p50_ms}, {"p95_ms", p.p95_ms}, {"p99_ms", p.p99_ms}};
}

std::string latency_line(const char* what, const Percentiles& p) {
  if (p.count == 0) return "";
  return text("  %-14s p50 %.1f ms, p95 %.1f ms, p99 %.1f ms\n", what, p.p50_ms, p.p95_ms, p.p99_ms);
}

Json to_json(const Recording::Written& session) {
  const SessionStatus& s = session.status;
  return {{"folder", session.folder.string()},
          {"recorded", s.recorded},
          {"written", s.written},
          {"dropped", s.dropped},
          {"measured", s.measured},
          {"written_bytes", s.written_bytes},
          {"error", s.error},
          {"logs", session.logs}};
}

std::string headline(const LiveReport& r) {
  const std::string line =
      text("%llu frames captured, %llu measured", printed(r.captured), printed(r.processed));
  if (r.shown > 0)
    return line +
           text(", %llu shown in %.1f s: %.1f pictures/s\n", printed(r.shown), r.seconds, r.shown_per_s);
  const double rate = r.seconds > 0 ? static_cast<double>(r.captured) / r.seconds : 0;
  return line + text(" in %.1f s: %.1f frames/s\n", r.seconds, rate);
}

void add_losses(const LiveReport& r, Facts& facts) {
  const CaptureCounts& c = r.camera;
  if (c.lost + c.damaged + c.gaps > 0)
    facts.say(text("camera: %llu frames lost, %llu damaged, away %llu times\n", printed(c.lost),
                   printed(c.damaged), printed(c.gaps)));
  facts.add(
      "device_losses", r.device_losses,
      r.device_losses > 0 ? text("the device was lost and opened anew %u times\n", r.device_losses) : "");
  facts.add("camera_lost", c.lost);
  facts.add("camera_damaged", c.damaged);
  facts.add("camera_gaps", c.gaps);
}

void add_latency(const LiveReport& r, Facts& facts) {
  const char* from = r.latency_from_exposure ? "latency from exposure (the driver's time stamp)\n"
                                             : "latency from delivery by the source\n";
  const bool any = r.to_measured.count > 0;
  facts.add("latency_from", r.latency_from_exposure ? "exposure" : "delivery", any ? from : "");
  facts.add("latency_to_measured", to_json(r.to_measured), latency_line("to measurement", r.to_measured));
  facts.add("latency_to_shown", to_json(r.to_shown), any ? latency_line("to display", r.to_shown) : "");
}

}  // namespace

Facts facts_of(const LiveReport& report, const std::vector<Recording::Written>& sessions) {
  Facts facts;
  facts.say(headline(report));
  facts.add("complete", !report.interrupted);
  facts.add("warning", report.warning, report.warning.empty() ? "" : "warning: " + report.warning + "\n");
  if (!report.flaws.empty()) facts.add("flaws", report.flaws, "WARNING: " + report.flaws + "\n");
  facts.add("seconds", report.seconds);
  facts.add("captured", report.captured);
  facts.add("processed", report.processed);
  facts.add("shown", report.shown);
  facts.add("shown_per_s", report.shown_per_s);
  facts.add("dropped_before_engine", report.dropped_before_engine);
  facts.add("dropped_before_display", report.dropped_before_display);
  add_losses(report, facts);
  facts.add("copies_per_frame", report.copies_per_frame);
  add_latency(report, facts);
  if (report.processed > 0)
    facts.say(text("pixels copied %.2g times a frame on their way to the engine\n", report.copies_per_frame));
  facts.add("draw_median_ms", report.draw_median_ms);
  for (const PressAnswer& press : report.presses) facts.say(describe(press) + "\n");
  Json written = Json::array();
  for (const Recording::Written& session : sessions) {
    written.push_back(to_json(session));
    facts.say("session " + describe(session) + "\n");
  }
  facts.add("sessions", written);
  if (!report.presses.empty()) facts.add("presses", to_json(report.presses));
  return facts;
}

std::string recording_error(const std::vector<Recording::Written>& sessions) {
  for (const Recording::Written& session : sessions)
    if (!session.status.error.empty()) return session.status.error;
  return "";
}

}  // namespace palpate
