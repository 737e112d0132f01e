#include "capture/run/process/processing.h"

#include "capture/files/estimate_report.h"
#include "engine/base/text.h"
#include "engine/gpu/context.h"

namespace palpate {
namespace {

const char* to_string(BackgroundOrigin origin) {
  switch (origin) {
    case BackgroundOrigin::None:
      return "none";
    case BackgroundOrigin::File:
      return "given";
    case BackgroundOrigin::Recording:
      return "the recording's own";
    case BackgroundOrigin::FirstFrames:
      return "first frames, taken to be untouched";
  }
  return "?";
}

unsigned long long whole(uint64_t count) {
  return count;
}

/// "1 frame", "2 frames".
std::string counted(uint64_t count, const char* what) {
  return std::to_string(count) + " " + what + (count == 1 ? "" : "s");
}

/// Errors of each quantity, and how often contact and slip were right.
Facts facts_of(const Comparison& c) {
  const Comparison::Counts& n = c.counts();
  Facts facts;
  facts.say("measured - true        frames   mean error    RMS error      largest   full scale\n");
  facts.add("frames", n.frames);
  facts.add("contact_agrees", n.contact_agrees);
  facts.add("contact_missed", n.contact_missed);
  facts.add("contact_missed_largest_N", n.largest_missed_N);
  facts.add("contact_invented", n.contact_invented);
  facts.add("force_flagged", n.flagged);
  facts.add("depth_flagged", n.depth_flagged);
  facts.add("slip_judged", n.slip_judged);
  facts.add("slip_agrees", n.slip_agrees);
  for (const auto& [name, words, errors] : c.compared()) {
    if (errors.count() == 0) continue;
    facts.add(name,
              {{"frames", errors.count()},
               {"mean_error", errors.mean()},
               {"rms_error", errors.rms()},
               {"largest_error", errors.largest()},
               {"full_scale", errors.full_scale()}},
              text("%-20s %8llu %12.4f %12.4f %12.4f ", words.c_str(), whole(errors.count()), errors.mean(),
                   errors.rms(), errors.largest()) +
                  (errors.full_scale() > 0 ? text("%12.4f\n", errors.full_scale()) : "           -\n"));
  }
  facts.say(text("contact right in %llu of %llu frames", whole(n.contact_agrees), whole(n.frames)));
  if (n.contact_missed)
    facts.say(text("; %llu touches of up to %.4f N were too light to see", whole(n.contact_missed),
                   n.largest_missed_N));
  if (n.contact_invented)
    facts.say(text("; %llu frames without touch were taken for one", whole(n.contact_invented)));
  facts.say("\n");
  if (n.slip_judged)
    facts.say(
        text("stick or slip right in %llu of %llu frames\n", whole(n.slip_agrees), whole(n.slip_judged)));
  if (n.flagged)
    facts.say(text("%llu frames with a flagged force (out of range or saturated) are not in the force line\n",
                   whole(n.flagged)));
  if (n.depth_flagged)
    facts.say(text(
        "%llu frames with a flagged depth (saturated, at the border, slopes clipped or extrapolated) are not "
        "in the depth lines\n",
        whole(n.depth_flagged)));
  return facts;
}

/// The first files and the last, as they were measured.
std::string order_of(const std::vector<std::string>& files) {
  constexpr size_t kFirst = 4;
  std::string text;
  for (size_t i = 0; i < files.size(); ++i) {
    if (files.size() > kFirst + 2 && i >= kFirst && i + 1 < files.size()) continue;
    if (i > 0) text += ", ";
    if (files.size() > kFirst + 2 && i + 1 == files.size()) text += "..., ";
    text += files[i];
  }
  return text;
}

/// A number and what it is worth in one breath.
std::string largest_of(const char* name, const Largest& largest, const char* unit) {
  const Estimate& any = *largest.any();
  std::string words = text("largest %s %.4g %s", name, any.value, unit);
  if (any.validity == Validity::Valid) return words;
  words += std::string(" (") + to_string(any.validity);
  if (const std::optional<Estimate> valid = largest.valid())
    words += text("; the largest valid one %.4g %s", valid->value, unit);
  return words + ")";
}

/// Each picture is a press of its own.
std::string pictures_line(const ProcessSummary& s) {
  std::string line = counted(s.frames, "separate picture");
  if (!s.force_states.empty()) line += ", " + std::to_string(s.contact_frames) + " of them touched";
  if (s.most_contacts > 1) line += "; up to " + std::to_string(s.most_contacts) + " contacts in one";
  return line;
}

/// The answer in one line.
std::string headline(const ProcessSummary& s) {
  std::string line;
  if (s.separate) {
    line = pictures_line(s);
  } else if (!s.force_states.empty()) {
    line = (s.touches == 1 ? "1 touch" : std::to_string(s.touches) + " touches") + ", in " +
           counted(s.contact_frames, "frame");
    if (s.slip_frames) line += ", slipping in " + std::to_string(s.slip_frames);
    if (s.most_contacts > 1)
      line += "; up to " + std::to_string(s.most_contacts) + " contacts at once, " +
              counted(s.contact_ids, "contact id") + " in all";
  }
  const auto add = [&line](const std::string& words) { line += (line.empty() ? "" : "; ") + words; };
  if (s.force_N.any()) add(largest_of("force", s.force_N, "N"));
  if (s.depth_mm.any()) add(largest_of("depth", s.depth_mm, "mm"));
  return line.empty() ? line : line + "\n";
}

/// "largest_force_N", its error and its state; of a doubtful one the largest valid one as well.
void add_largest(const char* quantity, const Largest& largest, Facts& facts) {
  if (!largest.any()) return;
  const LargestNames names = largest_names(quantity);
  facts.add("largest_" + names.value, largest.any()->value);
  if (largest.any()->standard_error > 0) facts.add("largest_" + names.error, largest.any()->standard_error);
  facts.add("largest_" + names.state, to_string(largest.any()->validity));
  if (const std::optional<Estimate> valid = largest.valid())
    facts.add("largest_valid_" + names.value, valid->value);
}

/// How often something touched, and what its force is worth.
void add_touches(const ProcessSummary& s, bool contacts, Facts& facts) {
  facts.add("touches", s.touches);
  facts.add("contact_frames", s.contact_frames);
  facts.add("slip_frames", s.slip_frames);
  if (contacts) {
    facts.add("most_contacts", s.most_contacts);
    facts.add("contact_ids", s.contact_ids);
    facts.add("overflow_frames", s.overflow_frames);
  }
  if (s.overflow_frames)
    facts.say("too many regions to separate contacts in " + counted(s.overflow_frames, "frame") +
              ": a higher contact.threshold_gray would leave the noise out\n");
  std::string states;
  for (const auto& [state, frames] : s.force_states)
    states += "force " + state + ": " + counted(frames, "frame") + "\n";
  facts.add("saturated_frames", s.saturated_frames);
  facts.add("force_states", s.force_states, states);
  if (s.saturated_frames)
    facts.say(
        "touch saturates pixels in " + counted(s.saturated_frames, "frame") +
        ": where they may hide more than the interval, force and depth say so; lower the exposure or the "
        "light\n");
}

/// A count, with a line only where it is not 0.
void add_count(const char* key, uint64_t count, const std::string& line, Facts& facts) {
  facts.add(key, count, count == 0 ? "" : line + "\n");
}

/// Limits of the surface.
void add_surface(const ProcessSummary& s, const ProcessRequest& request, Facts& facts) {
  if (s.depth_mm.any()) {
    add_largest("depth_max_mm", s.depth_mm, facts);
    add_count("clipped_frames", s.clipped_frames,
              "slopes steeper than max_slope were clipped in " + counted(s.clipped_frames, "frame") +
                  ": their depth is a lower bound",
              facts);
    add_count("extrapolated_frames", s.extrapolated_frames,
              "depth is extrapolated in " + counted(s.extrapolated_frames, "frame") +
                  ": at places or of colours that its calibration never saw",
              facts);
  }
  if (wants(request.outputs, Output::Confidence) || s.weighted_frames) {
    add_count("weighted_frames", s.weighted_frames,
              "unknown pixels left out of the surface in " + counted(s.weighted_frames, "frame"), facts);
    add_count("island_frames", s.island_frames,
              "unknown pixels cut the surface into islands in " + counted(s.island_frames, "frame") +
                  ": heights between them are not determined",
              facts);
  }
  if (s.light_changed_frames || s.light_unknown_frames) {
    add_count("light_changed_frames", s.light_changed_frames,
              "light that changed by itself was taken out of " + counted(s.light_changed_frames, "frame"),
              facts);
    add_count(
        "light_unknown_frames", s.light_unknown_frames,
        "light unknown in " + counted(s.light_unknown_frames, "frame") +
            ": too little of the picture is as in the untouched image (a touch that covers the gel, or "
            "the background of another unit), or printed markers are under another light than in it (fixed "
            "exposure and white balance, or a new --background); depth and force say so",
        facts);
  }
  if (!request.depth.empty())
    add_count("depth_clipped_px", s.depth_clipped_px,
              counted(s.depth_clipped_px, "pixel") + " outside the 16-bit depth range, clipped", facts);
}

/// Pictures that are not whole.
void add_pictures(const ProcessSummary& s, Facts& facts) {
  if (s.damaged_frames) facts.add("damaged_frames", s.damaged_frames);
  if (!s.spoilt_pictures.empty()) {
    std::string lines;
    for (const auto& [fault, frames] : s.spoilt_pictures)
      lines +=
          "picture damaged, " + fault + ": " + counted(frames, "frame") + ", of which nothing is measured\n";
    facts.add("damaged_pictures", s.spoilt_pictures, lines);
  }
  if (s.repeated_frames)
    facts.add("repeated_frames", s.repeated_frames,
              s.comparison
                  ? ""
                  : counted(s.repeated_frames, "frame") + " equal to the frame before in every pixel\n");
}

std::string recorded_text(const RecordedCheck& recorded) {
  std::string line = counted(recorded.equal, "measurement") +
                     " equal to the recorded one, to the last digit; " + std::to_string(recorded.different) +
                     " different\n";
  if (recorded.different) line += "first difference in " + recorded.first_difference + "\n";
  return line;
}

/// Where the frames came from.
void add_sources(const ProcessSummary& s, Facts& facts) {
  if (s.separate && s.frames > 1)
    facts.say(
        "pictures without a rate are separate presses: nothing is followed from one to the next "
        "(--sequence or --rate for those of one sequence)\n");
  const auto warn = [&facts](const char* key, const std::string& warning) {
    if (!warning.empty()) facts.add(key, warning, "WARNING: " + warning + "\n");
  };
  warn("warning", s.warning);
  if (!s.sources.empty())
    facts.add("sources", s.sources,
              s.sources.size() > 1 ? "order of the pictures: " + order_of(s.sources) + "\n" : "");
  facts.add("untouched_image", to_string(s.untouched),
            s.untouched == BackgroundOrigin::FirstFrames
                ? "untouched image: none given, the first frames were taken to be untouched (--background)\n"
                : "");
  for (const std::string& log : s.logs) facts.say("log " + log + "\n");
  if (!s.logs.empty()) facts.add("logs", s.logs);
  warn("untouched_warning", s.untouched_warning);
  add_count("flaw_px", s.flaws.px, "WARNING: " + s.flaws.describe(), facts);
  if (s.flaws.px > 0) facts.add("flaws", s.flaws.describe());
}

}  // namespace

Facts facts_of(const ProcessSummary& s, const ProcessRequest& request, const Sensor& sensor,
               const gpu::Context& context) {
  Facts facts;
  const double rate = s.seconds > 0 ? static_cast<double>(s.frames) / s.seconds : 0;
  facts.add("input", request.input);
  facts.add("sensor", sensor.name);
  facts.add("device", context.report().name);
  facts.add("solver", to_string(s.solver));
  facts.add("solved_by", s.solved_by == SolveBy::Host ? "host" : "device");
  facts.add("complete", s.complete, headline(s));
  if (!s.complete) facts.add("ended_by", s.ended_by);
  if (const std::string range = to_string(request.range); !range.empty()) facts.add("range", range);
  facts.add("frames", s.frames,
            text("%s in %.2f s (%.1f frames/s)", counted(s.frames, "frame").c_str(), s.seconds, rate) +
                (s.complete ? "\n" : ", ended early: " + s.ended_by + "\n"));
  add_pictures(s, facts);
  facts.add("seconds", s.seconds);
  facts.add("frames_per_s", rate);
  if (!s.force_states.empty()) add_touches(s, wants(request.outputs, Output::Contacts), facts);
  if (s.separate) facts.add("separate_pictures", true);
  add_largest("force_N", s.force_N, facts);
  if (!s.presses.empty()) {
    std::string lines;
    for (const PressAnswer& press : s.presses) lines += describe(press) + "\n";
    facts.add("presses", to_json(s.presses), lines);
  }
  add_surface(s, request, facts);
  if (s.recorded)
    facts.add("as_recorded",
              {{"equal", s.recorded->equal},
               {"different", s.recorded->different},
               {"first_difference", s.recorded->first_difference}},
              recorded_text(*s.recorded));
  add_sources(s, facts);
  if (s.comparison) {
    const Facts compared = facts_of(*s.comparison);
    facts.add("measured_minus_true", compared.json, "\n" + compared.text);
  }
  return facts;
}

}  // namespace palpate
