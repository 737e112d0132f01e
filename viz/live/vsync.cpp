#include "viz/live/vsync.h"

namespace palpate::viz {

const char* to_string(Vsync vsync) {
  switch (vsync) {
    case Vsync::On:
      return "on";
    case Vsync::Mailbox:
      return "mailbox";
    default:
      return "off";
  }
}

}  // namespace palpate::viz
