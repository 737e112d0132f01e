#include "viz/render/format.h"

#include <imgui.h>

#include <cmath>

#include "capture/files/measurements.h"
#include "engine/base/text.h"

namespace palpate::viz {

std::string tick_text(double value, double step) {
  const int decimals = step >= 1 ? 0 : static_cast<int>(std::ceil(-std::log10(step) - 1e-9));
  return text("%.*f", decimals, std::abs(value) < 1e-9 ? 0.0 : value);
}

Verdict force_verdict(Validity validity) {
  switch (validity) {
    case Validity::Valid:
      return {"normal force, within calibration", Meaning::Valid};
    case Validity::NoContact:
      return {"nothing touches the pad", Meaning::Explains};
    case Validity::BelowRange:
      return {"normal force BELOW the calibrated range", Meaning::Doubtful};
    case Validity::AboveRange:
      return {"normal force ABOVE the calibrated range", Meaning::Doubtful};
    case Validity::Saturated:
      return {"SATURATED pixels: force is at least this", Meaning::Wrong};
    case Validity::AtBorder:
      return {"contact reaches the BORDER: force is at least this", Meaning::Doubtful};
    case Validity::Clipped:
      return {"slopes CLIPPED at max_slope: depth is too small", Meaning::Doubtful};
    case Validity::Extrapolated:
      return {"depth EXTRAPOLATED: calibration saw no such place or colour", Meaning::Doubtful};
    case Validity::OnsetUnseen:
      return {"contact began UNSEEN: shear counts from there", Meaning::Doubtful};
    case Validity::Apart:
      return {"unknown pixels cut the surface into ISLANDS", Meaning::Doubtful};
    case Validity::Covered:
      return {"markers COVER too much: the surface under them is not known", Meaning::Doubtful};
    case Validity::ShapeUnjudged:
      return {"calibrated on TOO FEW OBJECTS: another shape may read half", Meaning::Doubtful};
    case Validity::Unfit:
      return {"force calibration NOT FIT FOR USE: calibrate again", Meaning::Wrong};
    case Validity::TooDeep:
      return {"pressed TOO DEEP for a pad of this thickness", Meaning::Doubtful};
    case Validity::NotConverged:
      return {"the solve did NOT CONVERGE", Meaning::Wrong};
    case Validity::LightUnknown:
      return {"light UNKNOWN: too little is as in the untouched image", Meaning::Wrong};
    case Validity::NotFollowed:
      return {"separate pictures: not followed", Meaning::Explains};
    case Validity::Undetermined:
      return {"the surface does not show it", Meaning::Explains};
    case Validity::PictureDamaged:
      return {"picture DAMAGED on its way here: nothing is measured", Meaning::Wrong};
    default:
      return {"force not calibrated", Meaning::Explains};
  }
}

Verdict slip_verdict(Slip slip) {
  switch (slip) {
    case Slip::Stick:
      return {"sticks", Meaning::Chosen};
    case Slip::Incipient:
      return {"BEGINS TO SLIP: the rim slides", Meaning::Doubtful};
    case Slip::Slip:
      return {"SLIPS: force at the friction limit", Meaning::Slips};
    case Slip::NoContact:
      return {"no contact", Meaning::Explains};
    case Slip::PictureDamaged:
      return {"picture DAMAGED", Meaning::Wrong};
    default:
      return {"not calibrated", Meaning::Explains};
  }
}

bool saturation_matters(const Touch& t) {
  if (t.force_N.validity == Validity::Saturated) return true;
  if (t.surface && t.surface->validity == Validity::Saturated) return true;
  return t.saturated_px > 0 && t.force_N.validity == Validity::NotCalibrated && !t.surface;
}

bool saturation_matters(const ContactTouch& contact, const Touch& touch) {
  if (contact.force_N.validity == Validity::Saturated) return true;
  return contact.saturated_px > 0 && contact.force_N.validity == Validity::NotCalibrated &&
         saturation_matters(touch);
}

std::string depth_text(const SurfaceSummary& s) {
  std::string shown = text("%.3f", s.depth_max_mm);
  if (s.depth_sd_mm > 0) shown += text(" \xc2\xb1 %.3f", s.depth_sd_mm);
  shown += " mm";
  if (s.validity == Validity::Saturated) shown += ", saturated";
  if (s.validity == Validity::AtBorder) shown += ", at border";
  if (s.validity == Validity::Clipped) shown += ", slopes clipped";
  if (s.validity == Validity::TooDeep) shown += ", deeper than the pad";
  if (s.validity == Validity::AboveRange) shown += ", above range";
  if (s.validity == Validity::Apart) shown += ", on an island";
  if (s.validity == Validity::Covered) shown += ", covered by markers";
  if (s.validity == Validity::Extrapolated) shown += ", extrapolated";
  if (s.validity == Validity::LightUnknown) shown += ", light unknown";
  if (!s.rest_from_untouched) shown += " (no rest level)";
  return shown;
}

std::string time_text(double time_s) {
  if (time_s < 60) return text("%.1f s", time_s);
  const int minutes = static_cast<int>(time_s / 60);
  if (minutes < 60) return text("%d:%04.1f min", minutes, time_s - 60.0 * minutes);
  return text("%d:%02d:%04.1f h", minutes / 60, minutes % 60, time_s - 60.0 * minutes);
}

std::string shortened(const std::string& whole_text, float width) {
  std::string result = whole_text;
  for (size_t length = whole_text.size(); length > 0 && ImGui::CalcTextSize(result.c_str()).x > width;
       --length) {
    // Never within a character of several bytes.
    while (length > 1 && (static_cast<unsigned char>(whole_text[length - 1]) & 0xC0) == 0x80) --length;
    result = whole_text.substr(0, length - 1) + "...";
  }
  return result;
}

}  // namespace palpate::viz
