// A device that is lost while clients look on: they stay, are told, and pictures come again.
#include <csignal>

#include "tests/serve/live_client.h"
#include "tests/support/eventually.h"
#include "tests/support/free_port.h"
#include "tests/support/program_fixture.h"

namespace palpate {
namespace {

TEST_F(Program, ClientsOutliveALostDevice) {
  const std::string port = free_port();
  const pid_t server =
      start({"serve", "synthetic:palpation?size=96x80&rate=60&repeat=0", "--port", port, "--json"},
            {.environment = {{"VK_LAYER_PATH", PALPATE_LAYER_DIR},
                             {"VK_INSTANCE_LAYERS", "VK_LAYER_PALPATE_failing"},
                             {"PALPATE_FAIL_CALL", "vkQueueSubmit2"},
                             {"PALPATE_FAIL_AT", "240"}}});
  std::optional<Client> client, stalled;
  ASSERT_TRUE(eventually([&] {
    try {
      client.emplace(static_cast<uint16_t>(std::stoi(port)));
      stalled.emplace(static_cast<uint16_t>(std::stoi(port)), Shown{.receive_B = 4096});
      return true;
    } catch (const beast::system_error&) {
      return false;  // it does not listen yet
    }
  }));
  std::map<std::string, uint32_t> channels;
  for (const auto& [topic, id] : client->greet()) channels[topic.substr(topic.rfind('/') + 1)] = id;
  client->subscribe({channels.at("touch"), channels.at("image"), channels.at("events")});
  stalled->greet();
  stalled->subscribe({channels.at("touch"), channels.at("image")});
  uint64_t lost = 0, touches = 0, pictures = 0;
  std::optional<uint64_t> frame;
  while (lost == 0 || touches < 60 || pictures < 20) {
    const std::string bytes = client->next();
    if (client->is_text()) continue;
    uint32_t id = 0;
    std::memcpy(&id, bytes.data() + 1, sizeof id);
    if (id == channels.at("events")) {
      lost += parse_json(bytes.substr(13))["event"] == "device lost";
    } else if (lost > 0) {
      ++(id == channels.at("touch") ? touches : pictures);
    }
    if (id != channels.at("touch")) continue;
    const uint64_t next = parse_json(bytes.substr(13))["frame"];
    EXPECT_TRUE(!frame || next > *frame) << next;
    frame = next;
  }
  EXPECT_EQ(lost, 1u);
  kill(server, SIGINT);
  const Ended ended = finish(server);
  EXPECT_TRUE(contains(ended.err, "opened anew")) << ended.err;
  const Json report = parse_json(ended.out);
  EXPECT_EQ(report["device_losses"], 1);
  EXPECT_EQ(report["served"]["clients"], 2);
  EXPECT_EQ(report["served"]["refused"], 0);
}

}  // namespace
}  // namespace palpate
