// Settings of the server of live data, and what it has done.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace palpate {

inline constexpr uint16_t kServePort = 8765;

struct ServeOptions {
  /// Anything but a loopback address needs a token.
  std::string address = "127.0.0.1";
  uint16_t port = kServePort;  ///< 0: a free one
  std::string token;           ///< that clients must show; empty: none
  /// Pages of other hosts that may connect ("https://app.foxglove.dev"); that of the server itself always
  /// may.
  std::vector<std::string> origins;
  std::string name = "palpate";  ///< for people
  std::string page;              ///< HTML that GET / answers with
  /// A client whose connection takes nothing for so long is closed.
  double stall_s = 10;
};

struct ServeSummary {
  uint64_t clients = 0;  ///< WebSocket connections in all
  uint64_t connected = 0;
  uint64_t refused = 0;  ///< wrong token, origin or host, too many, or no HTTP
  uint64_t stalled = 0;  ///< closed since they did not read
  uint64_t sent = 0;     ///< messages of topics
  uint64_t dropped = 0;  ///< messages that a client had asked for and was too slow to get
  uint64_t bytes = 0;    ///< of what was sent
};

}  // namespace palpate
