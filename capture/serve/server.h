// The server of live data: a WebSocket that speaks Foxglove's protocol, and one page for browsers, on one
// port.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "capture/serve/foxglove.h"
#include "capture/serve/hub.h"
#include "capture/serve/serve_options.h"

namespace palpate {

std::string describe(const ServeSummary& summary);

/// Serves on a thread of its own. Bounds: 16 clients and 16 more connections that are no clients yet; 8 KiB
/// of a request's head, 10 s to send it; FoxgloveClient's of messages; 200 messages a second from a client,
/// which is closed where it sends more; one frame and the texts in hand to a client that does not read, 256
/// texts at most.
class LiveServer {
 public:
  static constexpr size_t kMostClients = 16;

  /// Listens when this returns. Behind `requests` clients may ask for "/view", the rate of their own
  /// pictures, which the server carries out. The hub outlives the server. Throws Error(Failure::Usage) for an
  /// address that needs a token and has none, Error(Failure::Input) where the port is taken.
  LiveServer(LiveHub& hub, ServeOptions options, std::vector<ServedRequest> requests);
  ~LiveServer();
  LiveServer(const LiveServer&) = delete;
  LiveServer& operator=(const LiveServer&) = delete;

  uint16_t port() const;
  /// What to open in a browser, with the token.
  std::string url() const;

  /// Carries out the calls that have come, on the caller's thread. `handle`: from the number of the request
  /// and its argument (JSON as it came) to an answer of JSON; an Error becomes the failure of the call.
  void carry_out(const std::function<std::string(size_t request, const std::string& argument)>& handle);

  ServeSummary summary() const;
  /// Closes all connections; nothing happens where it is stopped already.
  void stop();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace palpate
