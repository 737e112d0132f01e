// The lump network that comes with the program, as bytes of the program.
#include <string>

#include "engine/lump/network/network.h"

asm(".section .rodata\n"
    ".balign 8\n"
    "palpate_lump_network:\n"
    ".incbin \"" PALPATE_LUMP_NETWORK
    "\"\n"
    "palpate_lump_network_end:\n"
    ".byte 0\n"
    ".previous\n");

extern "C" {
extern const char palpate_lump_network[];
extern const char palpate_lump_network_end[];
}

namespace palpate::lump {

const Network& Network::built_in() {
  static const Network network = parse(
      std::string(palpate_lump_network, static_cast<size_t>(palpate_lump_network_end - palpate_lump_network)),
      "the built-in network");
  return network;
}

}  // namespace palpate::lump
