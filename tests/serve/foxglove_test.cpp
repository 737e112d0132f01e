// Foxglove's protocol with one client, without a socket: what is offered, taken and refused.
#include <gtest/gtest.h>

#include <random>

#include "capture/serve/foxglove.h"
#include "tests/support/json.h"

namespace palpate {
namespace {

ServedOffer offer() {
  ServedOffer offer{
      .name = "pad", .session = "1", .topics = {}, .requests = {{"/pad/zero", "palpate.Zero", "{}"}}};
  offer.topics.push_back(
      {TopicKind::Depth, "/pad/depth", "cdr", "sensor_msgs/msg/Image", "ros2msg", "schema"});
  offer.topics.push_back({TopicKind::Touch, "/pad/touch", "json", "palpate.Touch", "jsonschema", "{}"});
  return offer;
}

std::vector<uint8_t> call(uint32_t service, uint32_t id, const std::string& encoding,
                          const std::string& json) {
  std::vector<uint8_t> bytes{2};
  const auto put = [&](uint32_t value) {
    for (int i = 0; i < 4; ++i) bytes.push_back(static_cast<uint8_t>(value >> 8 * i));
  };
  put(service);
  put(id);
  put(static_cast<uint32_t>(encoding.size()));
  bytes.insert(bytes.end(), encoding.begin(), encoding.end());
  bytes.insert(bytes.end(), json.begin(), json.end());
  return bytes;
}

TEST(FoxgloveProtocol, AnswersWhicheverNameIsOffered) {
  EXPECT_EQ(chosen_protocol("foxglove.websocket.v1"), "foxglove.websocket.v1");
  EXPECT_EQ(chosen_protocol("other, foxglove.sdk.v1 , foxglove.websocket.v1"), "foxglove.sdk.v1");
  EXPECT_EQ(chosen_protocol("foxglove.websocket.v2,"), "");
  EXPECT_EQ(chosen_protocol(""), "");
}

TEST(FoxgloveProtocol, OffersChannelsAndRequests) {
  const ServedOffer what = offer();
  const std::vector<std::string> texts = FoxgloveClient(what).greeting();
  ASSERT_EQ(texts.size(), 3u);
  const Json info = parse_json(texts[0]), channels = parse_json(texts[1]), services = parse_json(texts[2]);
  EXPECT_EQ(info["op"], "serverInfo");
  EXPECT_EQ(info["name"], "pad");
  EXPECT_EQ(channels["op"], "advertise");
  EXPECT_EQ(channels["channels"][0]["id"], 1);
  EXPECT_EQ(channels["channels"][1]["topic"], "/pad/touch");
  EXPECT_EQ(channels["channels"][0]["schemaEncoding"], "ros2msg");
  EXPECT_EQ(services["services"][0]["name"], "/pad/zero");
  EXPECT_EQ(services["services"][0]["request"]["encoding"], "json");
}

TEST(FoxgloveProtocol, KeepsSubscriptions) {
  const ServedOffer what = offer();
  FoxgloveClient client(what);
  const auto two = client.take_text(
      R"({"op":"subscribe","subscriptions":[{"id":7,"channelId":2},{"id":0,"channelId":1}]})");
  EXPECT_TRUE(two.subscriptions_changed);
  EXPECT_TRUE(two.texts.empty());
  EXPECT_EQ(client.subscriptions(), (std::map<uint32_t, uint32_t>{{0, 0}, {7, 1}}));
  EXPECT_EQ(client.take_text(R"({"op":"palpate.ready","subscriptions":[7,5]})").ready,
            std::vector<uint32_t>{7});
  EXPECT_FALSE(
      client.take_text(R"({"op":"subscribe","subscriptions":[{"id":7,"channelId":1}]})").texts.empty());
  EXPECT_TRUE(client.take_text(R"({"op":"unsubscribe","subscriptionIds":[7]})").subscriptions_changed);
  EXPECT_EQ(client.subscriptions().size(), 1u);
  std::string many = R"({"op":"subscribe","subscriptions":[)";
  for (int i = 10; i < 90; ++i)
    many += (i > 10 ? "," : "") + ("{\"id\":" + std::to_string(i)) + ",\"channelId\":1}";
  EXPECT_EQ(client.take_text(many + "]}").texts.size(), 17u);
  EXPECT_EQ(client.subscriptions().size(), FoxgloveClient::kMostSubscriptions);
}

TEST(FoxgloveProtocol, RefusesWithAStatus) {
  const ServedOffer what = offer();
  FoxgloveClient client(what);
  for (const char* text :
       {"", "[]", "7", "{", "{\"op\":3}", "{\"op\":\"advertise\"}", "{\"op\":\"subscribe\"}",
        R"({"op":"subscribe","subscriptions":[{}]})",
        R"({"op":"subscribe","subscriptions":[{"id":1,"channelId":3}]})",
        R"({"op":"subscribe","subscriptions":[{"id":1,"channelId":0}]})",
        R"({"op":"subscribe","subscriptions":[{"id":-1,"channelId":1}]})",
        R"({"op":"subscribe","subscriptions":[{"id":1.5,"channelId":1}]})",
        R"({"op":"subscribe","subscriptions":["x"]})", R"({"op":"unsubscribe","subscriptionIds":[1]})",
        "[[[[[[[[[[[[[[[[]]]]]]]]]]]]]]]]"}) {
    const auto answer = client.take_text(text);
    ASSERT_EQ(answer.texts.size(), 1u) << text;
    EXPECT_EQ(parse_json(answer.texts[0])["op"], "status") << text;
    EXPECT_FALSE(answer.subscriptions_changed) << text;
  }
}

TEST(FoxgloveProtocol, TakesCallsAndAnswersThem) {
  const ServedOffer what = offer();
  FoxgloveClient client(what);
  const auto answer = client.take_binary(call(1, 42, "json", "{\"on\":true}"));
  ASSERT_EQ(answer.calls.size(), 1u);
  EXPECT_EQ(answer.calls[0].service, 0u);
  EXPECT_EQ(answer.calls[0].id, 42u);
  EXPECT_EQ(answer.calls[0].argument, "{\"on\":true}");
  std::vector<uint8_t> wanted = call(1, 42, "json", "{}");
  wanted[0] = 3;
  EXPECT_EQ(call_answer(answer.calls[0], "{}"), wanted);
  for (const auto& [service, encoding] :
       {std::pair(2u, "json"), std::pair(0u, "json"), std::pair(1u, "cdr")}) {
    const auto refused = client.take_binary(call(service, 9, encoding, "{}"));
    ASSERT_EQ(refused.texts.size(), 1u);
    EXPECT_EQ(parse_json(refused.texts[0])["op"], "serviceCallFailure");
    EXPECT_EQ(parse_json(refused.texts[0])["callId"], 9);
  }
  std::vector<uint8_t> cut = call(1, 9, "json", "");
  cut[9] = 200;
  EXPECT_EQ(client.take_binary(cut).texts.size(), 1u);
}

TEST(FoxgloveProtocol, TakesAnyBytes) {
  const ServedOffer what = offer();
  std::mt19937 random(3);
  const std::string letters = "{}[]\":,0123456789.eE+-opsubcrinethadl \\u\n";
  for (int i = 0; i < 20000; ++i) {
    FoxgloveClient client(what);
    std::string text;
    std::vector<uint8_t> bytes;
    for (size_t n = random() % 60; n > 0; --n) {
      text += letters[random() % letters.size()];
      bytes.push_back(static_cast<uint8_t>(random() % 8 == 0 ? random() : random() % 4));
    }
    EXPECT_LE(client.take_text(text).calls.size(), 0u);
    EXPECT_LE(client.take_binary(bytes).texts.size(), 1u);
  }
}

TEST(FoxgloveProtocol, AMessageBeginsWithItsSubscriptionAndTime) {
  const std::array<uint8_t, 13> head = message_head(258, 0x0102030405060708);
  EXPECT_EQ(head, (std::array<uint8_t, 13>{1, 2, 1, 0, 0, 8, 7, 6, 5, 4, 3, 2, 1}));
}

}  // namespace
}  // namespace palpate
