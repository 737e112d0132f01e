// One WebSocket of the server of live data, and what all of its connections share. Boost's headers are heavy:
// only the server's own sources include this.
#pragma once

#include <array>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <chrono>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "capture/serve/foxglove.h"
#include "capture/serve/handshake.h"
#include "capture/serve/hub.h"
#include "capture/serve/serve_options.h"

namespace palpate {

namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
namespace net = boost::asio;

/// The request that the server answers itself, behind those of its owner: {"rate_Hz": 5}, pictures of each
/// topic a second at most to the client that asks; {}: as many as it takes.
inline constexpr double kSlowestView_Hz = 0.1, kFastestView_Hz = 120;
inline const ServedRequest kView = {
    "/view", "palpate.View",
    R"({"type":"object","properties":{"rate_Hz":{"type":"number","minimum":0.1,"maximum":120}}})"};

/// Time that a request may take to come, and its answer to go.
inline constexpr std::chrono::seconds kForRequest{10};

/// What connections share; all of it belongs to the server's thread, but for what says otherwise.
struct ServerState {
  LiveHub& hub;
  ServeOptions options;
  ServedOffer offer;
  bool loopback = true;
  std::set<class ServedClient*> clients;
  size_t waiting = 0;  ///< connections that are no clients yet

  struct Call {
    std::weak_ptr<ServedClient> client;
    FoxgloveCall call;
  };
  mutable std::mutex mutex;  ///< of what follows
  std::vector<Call> calls;
  ServeSummary summary;

  void count(uint64_t ServeSummary::*what, uint64_t more = 1) {
    const std::lock_guard lock(mutex);
    summary.*what += more;
  }
  void update_wishes();
};

/// One client: reads its wishes, writes one message at a time.
class ServedClient : public std::enable_shared_from_this<ServedClient> {
 public:
  ServedClient(net::ip::tcp::socket socket, ServerState& state);
  ~ServedClient();

  void accept(const HttpRequest& request);

  /// Writes the next message, where none is being written.
  void pump();

  void say(std::string text) { put({{text.begin(), text.end()}, false}); }
  void say(std::vector<uint8_t> bytes) { put({std::move(bytes), true}); }

  /// Topics that it is ready for, one bit each.
  uint64_t ready() const;

  void end(websocket::close_code code, const char* why);

 private:
  struct Text {
    std::vector<uint8_t> bytes;
    bool binary = false;
  };
  /// A subscription, and the last message that was sent for it.
  struct Turn {
    uint32_t subscription = 0;
    size_t topic = 0;
    uint64_t sent = 0;
    bool paced = false, waits = false;  ///< the client says when it is ready, and has not
    bool rests = false;                 ///< until the next is due, by the client's rate
    std::chrono::steady_clock::time_point due{};
  };

  void greet();
  void read();
  bool allowed();
  void take(std::span<const uint8_t> bytes);
  void put(Text text);
  template <typename Buffers, typename Done>
  void write(const Buffers& buffers, Done done);

  /// Carries out kView.
  void take_view(const FoxgloveCall& call);
  void rest(Turn& turn);
  void wake();

  void dropped(uint64_t count);

  /// Once a second at most, so that a slow client is not slower for it.
  void tell_drops();
  static std::vector<uint8_t> bytes_of(const std::string& text) { return {text.begin(), text.end()}; }

  void cut();

  ServerState& state_;
  websocket::stream<beast::tcp_stream> ws_;
  net::steady_timer stalled_, due_;
  std::chrono::duration<double> apart_{0};  ///< of pictures; 0: as many as are taken
  FoxgloveClient protocol_;
  beast::flat_buffer in_;
  std::deque<Text> texts_;
  std::vector<Turn> turns_;
  size_t next_turn_ = 0;
  LiveMessagePtr message_;
  std::array<uint8_t, 13> head_{};
  bool greeted_ = false, writing_ = false, closing_ = false;
  double allowance_ = 0;  ///< of messages that may come
  std::chrono::steady_clock::time_point allowance_at_;
  uint64_t drops_ = 0, drops_told_ = 0;
  std::chrono::steady_clock::time_point drops_told_at_{};
};

}  // namespace palpate
