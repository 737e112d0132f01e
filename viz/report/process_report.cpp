#include "viz/report/process_report.h"
#include "engine/base/text.h"

#include <cstdio>

namespace palpate {
namespace {

/// "1 frame", "2 frames".
std::string counted(uint64_t count, const char* what) {
  return std::to_string(count) + " " + what + (count == 1 ? "" : "s");
}

std::string table_of(const Comparison& c) {
  const Comparison::Counts& n = c.counts();
  std::string text = "measured - true        frames   mean error    RMS error      largest   full scale\n";
  std::string line;
  for (const auto& [name, words, errors] : c.compared()) {
    if (errors.count() == 0) continue;
    text += palpate::text("%-20s %8llu %12.4f %12.4f %12.4f ", words.c_str(),
                          static_cast<unsigned long long>(errors.count()), errors.mean(), errors.rms(),
                          errors.largest());
    text += errors.full_scale() > 0 ? palpate::text("%12.4f\n", errors.full_scale()) : "           -\n";
  }
  line =
      palpate::text("contact right in %llu of %llu frames", static_cast<unsigned long long>(n.contact_agrees),
                    static_cast<unsigned long long>(n.frames));
  text += line;
  if (n.contact_missed) {
    line = palpate::text("; %llu touches of up to %.4f N were too light to see",
                         static_cast<unsigned long long>(n.contact_missed), n.largest_missed_N);
    text += line;
  }
  if (n.contact_invented)
    text += "; " + std::to_string(n.contact_invented) + " frames without touch were taken for one";
  text += "\n";
  if (n.slip_judged) {
    text += "stick or slip right in " + std::to_string(n.slip_agrees) + " of " +
            std::to_string(n.slip_judged) + " frames\n";
  }
  if (n.flagged) {
    text += std::to_string(n.flagged) +
            " frames with a flagged force (out of range or saturated) are not in the force line\n";
  }
  if (n.depth_flagged) {
    text += std::to_string(n.depth_flagged) +
            " frames with a flagged depth (saturated, at the border or slopes clipped) are not in the depth "
            "lines\n";
  }
  return text;
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
  std::string words = palpate::text("largest %s %.4g %s", name, any.value, unit);
  if (any.validity == Validity::Valid) return words;
  words += std::string(" (") + to_string(any.validity);
  if (const std::optional<Estimate> valid = largest.valid())
    words += palpate::text("; the largest valid one %.4g %s", valid->value, unit);
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

}  // namespace

std::string describe(const ProcessSummary& s) {
  std::string text = headline(s);
  text += palpate::text("%s in %.2f s (%.1f frames/s)", counted(s.frames, "frame").c_str(), s.seconds,
                        s.seconds > 0 ? static_cast<double>(s.frames) / s.seconds : 0);
  text += s.complete ? "\n" : ", ended early: " + s.ended_by + "\n";
  if (!s.force_states.empty()) {
    if (s.overflow_frames)
      text += "too many regions to separate contacts in " + counted(s.overflow_frames, "frame") +
              ": a higher contact.threshold_gray would leave the noise out\n";
    for (const auto& [state, frames] : s.force_states)
      text += "force " + state + ": " + counted(frames, "frame") + "\n";
    if (s.saturated_frames) {
      text +=
          "touch saturates pixels in " + counted(s.saturated_frames, "frame") +
          ": where they may hide more than the interval, force and depth say so; lower the exposure or the "
          "light\n";
    }
  }
  for (const auto& [fault, frames] : s.spoilt_pictures)
    text +=
        "picture damaged, " + fault + ": " + counted(frames, "frame") + ", of which nothing is measured\n";
  if (s.repeated_frames && !s.comparison)
    text += counted(s.repeated_frames, "frame") + " equal to the frame before in every pixel\n";
  if (s.clipped_frames) {
    text += "slopes steeper than max_slope were clipped in " + counted(s.clipped_frames, "frame") +
            ": their depth is a lower bound\n";
  }
  if (s.light_changed_frames)
    text +=
        "light that changed by itself was taken out of " + counted(s.light_changed_frames, "frame") + "\n";
  if (s.light_unknown_frames)
    text += "light unknown in " + counted(s.light_unknown_frames, "frame") +
            ": too little of the picture is as in the untouched image (a touch that covers the gel, or the "
            "background of another unit); depth and force say so\n";
  if (s.weighted_frames)
    text += "unknown pixels left out of the surface in " + counted(s.weighted_frames, "frame") + "\n";
  if (s.island_frames) {
    text += "unknown pixels cut the surface into islands in " + counted(s.island_frames, "frame") +
            ": heights between them are not determined\n";
  }
  if (s.depth_clipped_px) {
    text += counted(s.depth_clipped_px, "pixel") + " outside the 16-bit depth range, clipped\n";
  }
  if (s.recorded) {
    text += counted(s.recorded->equal, "measurement") + " equal to the recorded one, to the last digit; " +
            std::to_string(s.recorded->different) + " different\n";
    if (s.recorded->different) text += "first difference in " + s.recorded->first_difference + "\n";
  }
  for (const PressAnswer& press : s.presses) text += describe(press) + "\n";
  if (s.separate && s.frames > 1)
    text +=
        "pictures without a rate are separate presses: nothing is followed from one to the next "
        "(--sequence or --rate for those of one sequence)\n";
  if (s.sources.size() > 1) text += "order of the pictures: " + order_of(s.sources) + "\n";
  if (s.untouched == BackgroundOrigin::FirstFrames)
    text += "untouched image: none given, the first frames were taken to be untouched (--background)\n";
  for (const std::string& warning : {s.warning, s.untouched_warning})
    if (!warning.empty()) text += "WARNING: " + warning + "\n";
  if (s.comparison) text += "\n" + table_of(*s.comparison);
  return text;
}

}  // namespace palpate
