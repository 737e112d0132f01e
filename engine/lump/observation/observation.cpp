#include "engine/lump/observation/observation.h"

#include <algorithm>

namespace palpate {

const char* to_string(LumpVerdict verdict) {
  switch (verdict) {
    case LumpVerdict::Found:
      return "found";
    case LumpVerdict::StiffnessOpen:
      return "stiffness open";
    case LumpVerdict::NoLump:
      return "no lump";
    case LumpVerdict::OutsideTraining:
      return "outside training";
    case LumpVerdict::SeveralLumps:
      return "several lumps";
    case LumpVerdict::Saturated:
      return "saturated";
    case LumpVerdict::Unusable:
      return "unusable";
  }
  return "";
}

const char* verdict_words(LumpVerdict verdict) {
  switch (verdict) {
    case LumpVerdict::Found:
      return "a lump";
    case LumpVerdict::StiffnessOpen:
      return "a lump whose stiffness cannot be told";
    case LumpVerdict::NoLump:
      return "no lump";
    case LumpVerdict::OutsideTraining:
      return "unlike what the model was made for: no numbers";
    case LumpVerdict::SeveralLumps:
      return "more than one lump: no numbers of one alone";
    case LumpVerdict::Saturated:
      return "saturated where the pressure is highest: no numbers";
    case LumpVerdict::Unusable:
      return "not usable";
  }
  return "";
}

void widen(LumpValue& value, const LumpValue& other) {
  value.low = std::min(value.low, other.low);
  value.high = std::max(value.high, other.high);
}

void open_wide_ratio(LumpEstimate& estimate) {
  const LumpValue& ratio = estimate.stiffness_ratio;
  if (estimate.verdict != LumpVerdict::Found || ratio.high <= kOpenRatio * ratio.low) return;
  estimate.verdict = LumpVerdict::StiffnessOpen;
  estimate.reasons.emplace_back(
      "the stiffness ratio is not determined: its interval spans more than a factor of four");
}

}  // namespace palpate
