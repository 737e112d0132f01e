// Vertical synchronisation: when a window shows a new picture.
#pragma once

#include <map>
#include <string>

namespace palpate::viz {

enum class Vsync : int { On, Mailbox, Off };  ///< FIFO; newest picture at each refresh; at once (may tear)
/// As the command line spells them.
inline const std::map<std::string, Vsync> kVsyncNames = {
    {"on", Vsync::On}, {"mailbox", Vsync::Mailbox}, {"off", Vsync::Off}};

}  // namespace palpate::viz
