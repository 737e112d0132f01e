// A client of the server of live data, for tests.
#pragma once

#include <array>
#include <boost/asio/connect.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <cstdint>
#include <cstring>
#include <functional>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "tests/support/json.h"

namespace palpate {

namespace net = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;

struct Shown {
  std::string token{}, origin{}, host = "localhost", protocol = "foxglove.websocket.v1";
  int receive_B = 0;  ///< of the socket; 0: as the system does
};

/// A client that waits for what it wants.
class Client {
 public:
  Client(uint16_t port, const Shown& shown = {}) : ws_(context_) {
    net::ip::tcp::socket& socket = ws_.next_layer();
    socket.open(net::ip::tcp::v4());
    if (shown.receive_B > 0) socket.set_option(net::socket_base::receive_buffer_size(shown.receive_B));
    socket.connect({net::ip::make_address("127.0.0.1"), port});
    ws_.set_option(websocket::stream_base::decorator([shown](websocket::request_type& request) {
      if (!shown.protocol.empty()) request.set(http::field::sec_websocket_protocol, shown.protocol);
      if (!shown.origin.empty()) request.set(http::field::origin, shown.origin);
    }));
    ws_.handshake(answer_, shown.host, "/" + (shown.token.empty() ? "" : "?token=" + shown.token));
  }

  std::string protocol() const { return std::string(answer_[http::field::sec_websocket_protocol]); }
  void say(const Json& json) {
    ws_.binary(false);
    ws_.write(net::buffer(json.dump()));
  }
  void call(uint32_t service, uint32_t id, const std::string& json) {
    std::string bytes = "\2";
    for (const uint32_t value : {service, id, 4u})
      bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
    ws_.binary(true);
    ws_.write(net::buffer(bytes + "json" + json));
  }
  /// The next message; texts are JSON with "op", others bytes.
  std::string next() {
    in_.clear();
    ws_.read(in_);
    return beast::buffers_to_string(in_.data());
  }
  bool is_text() const { return ws_.got_text(); }
  Json next_text() {
    while (true) {
      const std::string text = next();
      if (is_text()) return parse_json(text);
    }
  }
  /// Messages until each of `subscriptions` has one: subscription to payload.
  std::map<uint32_t, std::string> each(std::set<uint32_t> subscriptions) {
    std::map<uint32_t, std::string> found;
    while (!subscriptions.empty()) {
      const std::string bytes = next();
      if (is_text()) continue;
      uint32_t id = 0;
      std::memcpy(&id, bytes.data() + 1, sizeof id);
      if (subscriptions.erase(id) > 0) found[id] = bytes.substr(13);
    }
    return found;
  }
  /// Channels by their topic, after the greeting.
  std::map<std::string, uint32_t> greet() {
    std::map<std::string, uint32_t> channels;
    while (channels.empty()) {
      const Json message = next_text();
      if (message["op"] != "advertise") continue;
      for (const auto& channel : message["channels"]) channels[channel["topic"]] = channel["id"];
    }
    return channels;
  }
  void subscribe(const std::vector<uint32_t>& channels) {
    Json list = Json::array();
    for (const uint32_t channel : channels) list.push_back({{"id", channel}, {"channelId", channel}});
    say({{"op", "subscribe"}, {"subscriptions", list}});
  }
  websocket::stream<net::ip::tcp::socket>& stream() { return ws_; }

 private:
  net::io_context context_;
  websocket::stream<net::ip::tcp::socket> ws_;
  websocket::response_type answer_;
  beast::flat_buffer in_;
};

/// A client that takes what it asked for, and counts it.
class CountingClient {
 public:
  /// Once this returns the server has heard of its wishes, since a call behind them was answered.
  CountingClient(uint16_t port, const std::vector<std::string>& topics, int receive_B = 0)
      : client_(port, {.receive_B = receive_B}), channels_(client_.greet()) {
    std::vector<uint32_t> wanted;
    for (const std::string& topic : topics) {
      wanted.push_back(channels_.at(topic));
      topic_of_[wanted.back()] = topic;
    }
    client_.subscribe(wanted);
    call();
  }
  /// Takes everything up to the answer of a call.
  void call() {
    client_.call(1, ++calls_, "{}");
    while (take() != 3) {
    }
  }
  /// Gets one message of a topic, and no more until it says so again.
  void ready(const std::string& topic) {
    client_.say({{"op", "palpate.ready"}, {"subscriptions", {channels_.at(topic)}}});
  }
  void unsubscribe(const std::string& topic) {
    client_.say({{"op", "unsubscribe"}, {"subscriptionIds", {channels_.at(topic)}}});
  }
  /// Takes one message; its opcode, 0 for a text.
  uint8_t take() {
    const std::string bytes = client_.next();
    if (client_.is_text()) {
      const Json text = parse_json(bytes);
      if (text["op"] == "status") told_ = std::stoull(text["message"].get<std::string>());
      return 0;
    }
    if (bytes[0] != 1) return static_cast<uint8_t>(bytes[0]);
    uint32_t id = 0;
    std::memcpy(&id, bytes.data() + 1, sizeof id);
    const std::string& topic = topic_of_.at(id);
    ++received_[topic];
    ++all_;
    if (topic.ends_with("/touch")) frame_[topic] = parse_json(bytes.substr(13))["frame"];
    return 1;
  }
  /// Takes messages until a touch of this frame has come of both topics.
  void take_until(uint64_t frame, const std::array<std::string, 2>& touches,
                  const std::function<void()>& taken) {
    while (frame_[touches[0]] != frame || frame_[touches[1]] != frame) {
      take();
      taken();
    }
  }
  uint64_t received(const std::string& topic) { return received_[topic]; }
  uint64_t all() const { return all_; }
  uint64_t told() const { return told_; }  ///< messages dropped, as the server said last

 private:
  Client client_;
  std::map<std::string, uint32_t> channels_;
  uint32_t calls_ = 0;
  std::map<uint32_t, std::string> topic_of_;
  std::map<std::string, uint64_t> received_, frame_;
  uint64_t all_ = 0, told_ = 0;
};

}  // namespace palpate
