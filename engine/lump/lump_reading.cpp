#include "engine/lump/lump_reading.h"

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

}  // namespace palpate
