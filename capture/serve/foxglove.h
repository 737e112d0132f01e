// The Foxglove WebSocket protocol, version 1, as a server speaks it with one client: bytes in, bytes and
// requests out; no sockets and no clock (https://github.com/foxglove/ws-protocol).
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "capture/messages/topics.h"

namespace palpate {

/// Names of the protocol that clients offer; the first that a client offers is the answer.
inline constexpr std::array<std::string_view, 2> kFoxgloveProtocols = {"foxglove.sdk.v1",
                                                                       "foxglove.websocket.v1"};
/// The one to answer a Sec-WebSocket-Protocol header with; empty: none fits.
std::string_view chosen_protocol(std::string_view offered);

/// A request that clients may call, with JSON of both sides.
struct ServedRequest {
  std::string name;      ///< "/pad/zero"
  std::string type;      ///< "palpate.Zero"
  std::string argument;  ///< schema of the request (JSON schema)
};

/// What a server offers. Channels and requests are numbered from 1 in this order.
struct ServedOffer {
  std::string name;     ///< of the server, for people
  std::string session;  ///< another one in each run of the program, so that clients see that it began anew
  std::vector<Topic> topics;
  std::vector<ServedRequest> requests;
};

struct FoxgloveCall {
  uint32_t service = 0;  ///< from 0, in ServedOffer::requests
  uint32_t id = 0;       ///< of this call, chosen by the client
  std::string argument;  ///< text of JSON, as it came
};

/// Beyond the protocol: {"op": "palpate.ready", "subscriptions": [1, 2]}. Once a client has said so, each of
/// these gets one message and no other until the client says it again. For browsers, which take what comes
/// and let it wait for the page.
inline constexpr std::string_view kReady = "palpate.ready";

class FoxgloveClient {
 public:
  static constexpr size_t kMostSubscriptions = 64;
  static constexpr size_t kLongestMessage_B = 64 << 10;  ///< of what a client sends

  /// The offer must outlive it.
  explicit FoxgloveClient(const ServedOffer& offer) : offer_(offer) {}

  /// Texts that are sent first, in this order.
  std::vector<std::string> greeting() const;

  /// What one message of a client leads to.
  struct Answer {
    std::vector<std::string> texts;
    std::vector<FoxgloveCall> calls;
    bool subscriptions_changed = false;
    std::vector<uint32_t> ready;  ///< subscriptions whose next message may be sent, see kReady
  };
  /// Never throws for what a client sends: what it cannot have is answered by a status.
  Answer take_text(std::string_view text);
  Answer take_binary(std::span<const uint8_t> bytes);

  /// Channel (from 0, in ServedOffer::topics) of each subscription.
  const std::map<uint32_t, uint32_t>& subscriptions() const { return subscriptions_; }

 private:
  const ServedOffer& offer_;
  std::map<uint32_t, uint32_t> subscriptions_;
};

/// Opcode, subscription and time before a message's payload.
std::array<uint8_t, 13> message_head(uint32_t subscription, int64_t time_ns);
/// Answer to a call with JSON.
std::vector<uint8_t> call_answer(const FoxgloveCall& call, std::string_view json);
std::string call_failure(const FoxgloveCall& call, const std::string& why);
enum class StatusLevel : uint8_t { Info, Warning, Error };
std::string status_text(StatusLevel level, const std::string& message);

}  // namespace palpate
