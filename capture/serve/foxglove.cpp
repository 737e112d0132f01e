#include "capture/serve/foxglove.h"

#include <cstring>
#include <optional>

#include "engine/base/json.h"

namespace palpate {
namespace {

using Json = json::Value;

std::string dumped(const Json& json) {
  return json.dump(-1, json::Utf8::Replace);
}

template <typename T>
void put(uint8_t*& to, T value) {
  std::memcpy(to, &value, sizeof value);
  to += sizeof value;
}

uint32_t number_at(std::span<const uint8_t> bytes, size_t at) {
  uint32_t value = 0;
  std::memcpy(&value, bytes.data() + at, sizeof value);
  return value;
}

/// A number of a client: none where it is no whole number of 32 bits.
std::optional<uint32_t> number_of(const Json* value) {
  if (!value || !value->is_number()) return std::nullopt;
  const double number = value->number();
  if (!(number >= 0 && number <= 4294967295.0) ||
      number != static_cast<double>(static_cast<uint32_t>(number)))
    return std::nullopt;
  return static_cast<uint32_t>(number);
}

std::string shown(const std::string& text) {
  std::string line = "'" + text.substr(0, 60) + (text.size() > 60 ? "...'" : "'");
  for (char& c : line)
    if (c < ' ' || c > '~') c = '?';
  return line;
}

}  // namespace

std::string_view chosen_protocol(std::string_view offered) {
  while (!offered.empty()) {
    const size_t comma = offered.find(',');
    std::string_view one = offered.substr(0, comma);
    while (one.starts_with(' ')) one.remove_prefix(1);
    while (one.ends_with(' ')) one.remove_suffix(1);
    for (const std::string_view known : kFoxgloveProtocols)
      if (one == known) return known;
    if (comma == std::string_view::npos) break;
    offered.remove_prefix(comma + 1);
  }
  return {};
}

std::vector<std::string> FoxgloveClient::greeting() const {
  Json channels = Json::array(), services = Json::array();
  uint32_t id = 0;
  for (const Topic& topic : offer_.topics)
    channels.push_back({{"id", ++id},
                        {"topic", topic.name},
                        {"encoding", topic.encoding},
                        {"schemaName", topic.schema_name},
                        {"schemaEncoding", topic.schema_encoding},
                        {"schema", topic.schema}});
  id = 0;
  for (const ServedRequest& request : offer_.requests) {
    const auto definition = [&](const char* side, const std::string& schema) {
      return Json{{"encoding", "json"},
                  {"schemaName", request.type + "." + side},
                  {"schemaEncoding", "jsonschema"},
                  {"schema", schema}};
    };
    services.push_back({{"id", ++id},
                        {"name", request.name},
                        {"type", request.type},
                        {"request", definition("Request", request.argument)},
                        {"response", definition("Response", R"({"type":"object"})")}});
  }
  std::vector<std::string> texts;
  texts.push_back(dumped({{"op", "serverInfo"},
                          {"name", offer_.name},
                          {"capabilities", Json::array({"services"})},
                          {"supportedEncodings", Json::array({"json"})},
                          {"metadata", Json::object()},
                          {"sessionId", offer_.session}}));
  texts.push_back(dumped({{"op", "advertise"}, {"channels", channels}}));
  if (!offer_.requests.empty())
    texts.push_back(dumped({{"op", "advertiseServices"}, {"services", services}}));
  return texts;
}

FoxgloveClient::Answer FoxgloveClient::take_text(std::string_view text) {
  Answer answer;
  const auto refuse = [&](const std::string& why) {
    answer.texts.push_back(status_text(StatusLevel::Warning, why));
  };
  Json message;
  try {
    message = json::parse(text, {.deepest = 8});
  } catch (const json::Error& error) {
    refuse(std::string("wanted an object of JSON; found ") + error.what());
    return answer;
  }
  const Json* op = message.is_object() ? message.find("op") : nullptr;
  if (!op || !op->is_string()) {
    refuse("wanted an object with the key \"op\"; found none");
    return answer;
  }
  const auto list = [&](const char* key) -> const Json* {
    const Json* items = message.find(key);
    if (items && items->is_array()) return items;
    refuse("wanted a list \"" + std::string(key) + "\" for " + op->text());
    return nullptr;
  };
  if (op->text() == "subscribe") {
    const Json* items = list("subscriptions");
    for (size_t i = 0; items && i < items->size(); ++i) {
      const Json& item = items->begin()[i];
      const auto id = number_of(item.is_object() ? item.find("id") : nullptr);
      const auto channel = number_of(item.is_object() ? item.find("channelId") : nullptr);
      if (!id || !channel || *channel == 0 || *channel > offer_.topics.size())
        refuse("wanted a subscription to one of the channels 1 to " + std::to_string(offer_.topics.size()));
      else if (subscriptions_.contains(*id))
        refuse("subscription " + std::to_string(*id) + " exists already");
      else if (subscriptions_.size() == kMostSubscriptions)
        refuse("at most " + std::to_string(kMostSubscriptions) + " subscriptions");
      else
        answer.subscriptions_changed = subscriptions_.emplace(*id, *channel - 1).second;
    }
  } else if (op->text() == "unsubscribe") {
    const Json* items = list("subscriptionIds");
    for (size_t i = 0; items && i < items->size(); ++i) {
      const auto id = number_of(&items->begin()[i]);
      if (id && subscriptions_.erase(*id) > 0)
        answer.subscriptions_changed = true;
      else
        refuse("no such subscription");
    }
  } else if (op->text() == kReady) {
    const Json* items = list("subscriptions");
    for (size_t i = 0; items && i < items->size(); ++i)
      if (const auto id = number_of(&items->begin()[i]); id && subscriptions_.contains(*id))
        answer.ready.push_back(*id);
  } else {
    refuse("wanted subscribe or unsubscribe; found " + shown(op->text()));
  }
  return answer;
}

FoxgloveClient::Answer FoxgloveClient::take_binary(std::span<const uint8_t> bytes) {
  constexpr uint8_t kCall = 2;
  constexpr size_t kHead = 13;  // opcode, service, call, length of the encoding's name
  Answer answer;
  const auto refuse = [&](const std::string& why) {
    answer.texts.push_back(status_text(StatusLevel::Warning, why));
  };
  if (bytes.size() < kHead || bytes[0] != kCall) {
    refuse("wanted the call of a request");
    return answer;
  }
  FoxgloveCall call{number_at(bytes, 1), number_at(bytes, 5), {}};
  const uint32_t length = number_at(bytes, 9);
  if (length > bytes.size() - kHead) {
    refuse("wanted the call of a request; found one that is cut short");
    return answer;
  }
  const std::string encoding(reinterpret_cast<const char*>(bytes.data()) + kHead, length);
  const std::span<const uint8_t> rest = bytes.subspan(kHead + length);
  call.argument.assign(rest.begin(), rest.end());
  if (call.service == 0 || call.service > offer_.requests.size()) {
    answer.texts.push_back(call_failure(call, "no such request"));
    return answer;
  }
  if (encoding != "json") {
    answer.texts.push_back(call_failure(call, "wanted the encoding json; found " + shown(encoding)));
    return answer;
  }
  --call.service;
  answer.calls.push_back(std::move(call));
  return answer;
}

std::array<uint8_t, 13> message_head(uint32_t subscription, int64_t time_ns) {
  std::array<uint8_t, 13> head{};
  uint8_t* to = head.data();
  put(to, uint8_t{1});
  put(to, subscription);
  put(to, time_ns);
  return head;
}

std::vector<uint8_t> call_answer(const FoxgloveCall& call, std::string_view json) {
  constexpr std::string_view kJson = "json";
  std::vector<uint8_t> bytes(13 + kJson.size() + json.size());
  uint8_t* to = bytes.data();
  put(to, uint8_t{3});
  put(to, call.service + 1);
  put(to, call.id);
  put(to, static_cast<uint32_t>(kJson.size()));
  std::memcpy(to, kJson.data(), kJson.size());
  std::memcpy(to + kJson.size(), json.data(), json.size());
  return bytes;
}

std::string call_failure(const FoxgloveCall& call, const std::string& why) {
  return dumped(
      {{"op", "serviceCallFailure"}, {"serviceId", call.service}, {"callId", call.id}, {"message", why}});
}

std::string status_text(StatusLevel level, const std::string& message) {
  return dumped({{"op", "status"}, {"level", static_cast<int>(level)}, {"message", message}});
}

}  // namespace palpate
