#include "engine/numeric/matching/match.h"

namespace palpate {

std::string_view to_string(MatchStart start) {
  switch (start) {
    case MatchStart::Context:
      return "context";
    case MatchStart::Near:
      return "near";
    case MatchStart::Plain:
      return "plain";
    case MatchStart::Turned:
      return "turned";
    case MatchStart::Local:
      return "local";
    case MatchStart::Slid:
      return "slid";
    case MatchStart::Unbent:
      return "unbent";
  }
  return "";
}

std::string_view to_string(MatchVerdict verdict) {
  switch (verdict) {
    case MatchVerdict::Reliable:
      return "reliable";
    case MatchVerdict::TooFewPoints:
      return "no reliable match: too few points";
    case MatchVerdict::TooVague:
      return "no reliable match: what the warp leaves is as large as unrelated points would leave";
    case MatchVerdict::TooFewFound:
      return "no reliable match: too few points have a partner";
    case MatchVerdict::NotSettled:
      return "no reliable match: the iteration did not settle";
    case MatchVerdict::Bent:
      return "no reliable match: the warp fits by its freedom to bend";
    case MatchVerdict::PartlyWrong:
      return "no reliable match: parts fit far closer than the warp leaves the rest";
    case MatchVerdict::Ambiguous:
      return "no reliable match: another warp explains the target nearly as well";
  }
  return "";
}

}  // namespace palpate
