// The server of live data with real clients on this machine: every topic, slow clients, who may connect.
#include <atomic>
#include <thread>

#include "capture/open_source.h"
#include "capture/run/input.h"
#include "capture/serve/server.h"
#include "capture/serve/token.h"
#include "palpate/error.h"
#include "tests/serve/live_client.h"
#include "tests/support/eventually.h"
#include "tests/support/gpu_fixture.h"
#include "tests/support/json.h"
#include "tests/support/session_fixture.h"

namespace palpate {
namespace {

/// Status and body of a plain request.
std::pair<int, std::string> get(uint16_t port, const std::string& target,
                                const std::string& host = "localhost", http::verb verb = http::verb::get) {
  net::io_context context;
  net::ip::tcp::socket socket(context);
  socket.connect({net::ip::make_address("127.0.0.1"), port});
  http::request<http::empty_body> request(verb, target, 11);
  request.set(http::field::host, host);
  http::write(socket, request);
  beast::flat_buffer buffer;
  http::response<http::string_body> answer;
  beast::error_code error;
  http::read(socket, buffer, answer, error);
  return {static_cast<int>(answer.result_int()), answer.body()};
}

/// A pad that is pressed, measured once and published as often as a test wants.
class ServerTest : public GpuTest {
 protected:
  void SetUp() override {
    GpuTest::SetUp();
    const MeasuredInput input = find_input(1, "synthetic:press?size=64x48", std::filesystem::path());
    sensor_ = input.sensor;
    const std::shared_ptr<Source> source = open_source(input.input, sensor_);
    outputs_ = Output::Force | Output::Surface;
    pipeline_.emplace(context(), sensor_, source->format(), PipelineOptions{.outputs = outputs_});
    pipeline_->set_background(*source->own_background());
    while (source->next(frame_) && !(result_.touch.force_N.value > 0.3)) {
      result_ = Result();
      result_ = pipeline_->process(frame_);
    }
    ASSERT_TRUE(result_.touch.force_N.valid());
    columns_ = MeasuredColumns::of(sensor_, outputs_);
    hub_.emplace(std::vector{LiveHub::Publisher{sensor_, outputs_, columns_, {}}});
    options_.port = 0;
    options_.page = "<p>page";
  }
  void TearDown() override {
    server_.reset();
    result_ = Result();
    pipeline_.reset();
    GpuTest::TearDown();
  }
  uint16_t serve() {
    server_.emplace(*hub_, options_, std::vector<ServedRequest>{{"/pad/zero", "palpate.Zero", "{}"}});
    return server_->port();
  }
  void publish() {
    ++result_.touch.sequence;
    hub_->publish(0, frame_, result_, result_.touch);
  }
  /// A call goes round and comes back: what was said before it is heard, what was sent before it has come.
  void go_round(Client& client) {
    client.call(1, 5, "{}");
    EXPECT_TRUE(eventually([&] {
      bool called = false;
      server_->carry_out([&](size_t, const std::string&) {
        called = true;
        return std::string("{}");
      });
      return called;
    }));
    while (client.next()[0] != 3) {
    }
  }
  /// Publishes until `work` is done, `most` frames at most.
  void publish_while(const std::function<void()>& work, const std::function<uint64_t()>& most = {}) {
    std::atomic<bool> done{false};
    std::thread publisher([&] {
      while (!done) {
        if (!most || result_.touch.sequence < most()) publish();
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
      }
    });
    work();
    done = true;
    publisher.join();
  }

  Sensor sensor_;
  Outputs outputs_{};
  MeasuredColumns columns_;
  std::optional<Pipeline> pipeline_;
  Frame frame_;
  Result result_;
  std::optional<LiveHub> hub_;
  ServeOptions options_;
  std::optional<LiveServer> server_;
};

TEST_F(ServerTest, EveryTopicComesAsItWasMeasured) {
  const uint16_t port = serve();
  Client client(port);
  EXPECT_EQ(client.protocol(), "foxglove.websocket.v1");
  const std::map<std::string, uint32_t> channels = client.greet();
  const std::string root = "/" + topic_name(sensor_.name) + "/";
  std::vector<uint32_t> wanted;
  for (const char* kind :
       {"image", "image/compressed", "depth", "depth/preview", "cloud", "wrench", "touch"}) {
    ASSERT_TRUE(channels.contains(root + kind)) << kind;
    wanted.push_back(channels.at(root + kind));
  }
  client.subscribe(wanted);
  std::map<uint32_t, std::string> found;
  publish_while([&] { found = client.each({wanted.begin(), wanted.end()}); });
  const Json touch = parse_json(found[channels.at(root + "touch")]);
  EXPECT_EQ(touch["force_N"]["value"].get<double>(), result_.touch.force_N.value);
  EXPECT_EQ(touch["force_N"]["standard_error"].get<double>(), result_.touch.force_N.standard_error);
  EXPECT_EQ(touch["force_N"]["unit"], "N");
  EXPECT_EQ(touch["force_N"]["state"], "valid");
  // The pixels and the depths are the last bytes of their messages.
  const std::string& image = found[channels.at(root + "image")];
  EXPECT_EQ(image.substr(image.size() - frame_.format.frame_bytes()),
            std::string(reinterpret_cast<const char*>(frame_.pixels()), frame_.format.frame_bytes()));
  const std::span<const float> depth_mm = result_.depth_mm();
  const std::string& depth = found[channels.at(root + "depth")];
  std::vector<float> metres(depth_mm.size());
  std::memcpy(metres.data(), depth.data() + depth.size() - 4 * metres.size(), 4 * metres.size());
  for (size_t i = 0; i < metres.size(); ++i) ASSERT_FLOAT_EQ(metres[i], 1e-3f * depth_mm[i]);
  const std::string& cloud = found[channels.at(root + "cloud")];
  std::vector<float> points(3 * depth_mm.size());
  std::memcpy(points.data(), cloud.data() + cloud.size() - 1 - 4 * points.size(), 4 * points.size());
  EXPECT_FLOAT_EQ(points[2], metres[0]);
  EXPECT_NEAR(points[3] - points[0], 1e-3 * sensor_.pitch_mm_per_px, 1e-9);
  const std::string& wrench = found[channels.at(root + "wrench")];
  double force[3];
  std::memcpy(force, wrench.data() + wrench.size() - 48, sizeof force);
  EXPECT_EQ(force[2], result_.touch.force_N.value);
}

TEST_F(ServerTest, TwoFingersAndTheirGripShareOneServer) {
  hub_.emplace(std::vector{LiveHub::Publisher{sensor_, outputs_, columns_, "left"},
                           LiveHub::Publisher{sensor_, outputs_, columns_, "right"}});
  Client client(serve());
  const std::map<std::string, uint32_t> channels = client.greet();
  EXPECT_EQ(channels.size(), 17u);
  const std::string name = topic_name(sensor_.name);
  const uint32_t left = channels.at("/left/" + name + "/touch"),
                 right = channels.at("/right/" + name + "/touch"), grip = channels.at("/grip");
  client.subscribe({left, right, grip});
  GripFrame frame{
      .time_ns = 250'000'000, .left = 7, .right = 9, .skew_ms = 1.5, .grip = Grip(), .opening_mm = {}};
  frame.grip->force_N = {1.25, 0.02, Validity::Valid};
  std::map<uint32_t, std::string> found;
  std::atomic<bool> done{false};
  std::thread publisher([&] {
    while (!done) {
      hub_->publish(0, frame_, result_, result_.touch);
      Touch other = result_.touch;
      other.force_N.value = 2;
      hub_->publish(1, frame_, result_, other);
      hub_->publish_grip(frame, 0);
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  });
  found = client.each({left, right, grip});
  done = true;
  publisher.join();
  EXPECT_EQ(parse_json(found[left])["force_N"]["value"].get<double>(), result_.touch.force_N.value);
  EXPECT_EQ(parse_json(found[right])["force_N"]["value"], 2);
  const Json row = parse_json(found[grip]);
  for (const MeasuredQuantity<GripFrame>& q : grip_quantities()) {
    ASSERT_TRUE(row.contains(q.name)) << q.name;
    if (q.unit && *q.unit) {
      EXPECT_EQ(row[q.name]["unit"], q.unit);
    }
  }
  EXPECT_EQ(row["left_frame"]["value"], 7);
  EXPECT_EQ(row["grip_force_N"],
            Json({{"value", 1.25}, {"unit", "N"}, {"standard_error", 0.02}, {"state", "valid"}}));
  EXPECT_TRUE(row["load_x_N"]["value"].is_null());
  EXPECT_FALSE(row.contains("zeroed"));
  // A frame alone says its number, and nothing of the object.
  frame.right.reset();
  frame.grip.reset();
  const Json alone = parse_json(grip_json(frame, 1));
  EXPECT_TRUE(alone["right_frame"]["value"].is_null());
  EXPECT_TRUE(alone["grip_force_N"]["value"].is_null());
}

TEST_F(ServerTest, NothingIsMadeThatNobodyWants) {
  const uint16_t port = serve();
  for (int i = 0; i < 10; ++i) publish();
  for (size_t topic = 0; topic < hub_->topics().size(); ++topic) EXPECT_EQ(hub_->newest(topic), 0u);
  Client client(port);
  const auto channels = client.greet();
  client.subscribe({channels.at("/" + topic_name(sensor_.name) + "/touch")});
  publish_while([&] { client.each({channels.at("/" + topic_name(sensor_.name) + "/touch")}); });
  for (size_t topic = 0; topic < hub_->topics().size(); ++topic)
    EXPECT_EQ(hub_->newest(topic) > 0, hub_->topics()[topic].kind == TopicKind::Touch);
}

TEST_F(ServerTest, AClientThatDoesNotReadLosesFramesAndNobodyElseDoes) {
  options_.stall_s = 1000;
  const uint16_t port = serve();
  const std::string root = "/" + topic_name(sensor_.name) + "/";
  Client stalled(port), reader(port);
  const auto channels = stalled.greet();
  reader.greet();
  stalled.subscribe({channels.at(root + "cloud"), channels.at(root + "touch")});
  reader.subscribe({channels.at(root + "touch")});
  go_round(reader);
  // No reader is so slow that it loses touches: fewer than are kept for it go on before it has them.
  const uint64_t first = result_.touch.sequence;
  std::atomic<uint64_t> last = 0;
  uint64_t lost = 0;
  const auto read = [&] {
    for (int i = 0; i < 3000; ++i) {
      const std::string bytes = reader.next();
      if (reader.is_text()) continue;
      const uint64_t frame = parse_json(bytes.substr(13))["frame"];
      if (last != 0) lost += frame - last - 1;
      last = frame;
    }
    last = UINT64_MAX / 2;
    // Only now the other one reads: what it was too slow for is gone, the newest goes on, and it is told.
    EXPECT_EQ(server_->summary().stalled, 0u);
    bool told = false;
    while (!told) {
      const std::string message = stalled.next();
      told = stalled.is_text() && contains(message, "messages dropped");
    }
    EXPECT_GT(server_->summary().dropped, 0u);
  };
  const uint64_t kept = LiveHub::kept_of(TopicKind::Touch);
  publish_while(read, [&] { return last == 0 ? first + kept : last + kept / 2; });
  EXPECT_EQ(lost, 0u);
}

TEST_F(ServerTest, AStalledClientIsClosed) {
  options_.stall_s = 0.05;
  const uint16_t port = serve();
  Client stalled(port);
  const auto channels = stalled.greet();
  stalled.subscribe({channels.at("/" + topic_name(sensor_.name) + "/cloud")});
  publish_while([&] { EXPECT_TRUE(eventually([&] { return server_->summary().stalled == 1; })); });
  EXPECT_TRUE(eventually([&] { return server_->summary().connected == 0; }));
}

TEST_F(ServerTest, AClientThatSaysWhenItIsReadyGetsOneMessageATime) {
  const uint16_t port = serve();
  Client client(port);
  const uint32_t depth = client.greet().at("/" + topic_name(sensor_.name) + "/depth");
  const auto sent = [&](uint64_t messages) {
    return eventually([&] { return server_->summary().sent >= messages; }) &&
           server_->summary().sent == messages;
  };
  client.subscribe({depth});
  client.say({{"op", "palpate.ready"}, {"subscriptions", {depth}}});
  go_round(client);
  publish_while([&] {
    client.each({depth});
    go_round(client);
    EXPECT_TRUE(sent(1));
    client.say({{"op", "palpate.ready"}, {"subscriptions", {depth}}});
    client.each({depth});
    go_round(client);
    EXPECT_TRUE(sent(2));
  });
}

TEST_F(ServerTest, AClientChoosesTheRateOfItsPictures) {
  const uint16_t port = serve();
  Client slow(port), fast(port);
  const auto channels = slow.greet();
  fast.greet();
  const uint32_t depth = channels.at("/" + topic_name(sensor_.name) + "/depth");
  constexpr double kRate_Hz = 4;
  constexpr int kPictures = 4;
  slow.call(2, 1, R"({"rate_Hz": 4})");
  std::string answer = slow.next();
  while (slow.is_text()) answer = slow.next();
  EXPECT_EQ(parse_json(answer.substr(17))["rate_Hz"], kRate_Hz);
  const auto begin = std::chrono::steady_clock::now();
  slow.subscribe({depth});
  fast.subscribe({depth});
  std::atomic<bool> done{false};
  int of_fast = 0;
  publish_while([&] {
    std::thread reader([&] {
      for (; !done; ++of_fast) fast.each({depth});
    });
    for (int i = 0; i < kPictures; ++i) slow.each({depth});
    done = true;
    reader.join();
  });
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
  EXPECT_GE(took.count(), (kPictures - 1) / kRate_Hz);
  EXPECT_GT(of_fast, kPictures);
  for (const char* nonsense :
       {R"({"rate_Hz": 0})", R"({"rate_Hz": 1e9})", R"({"rate_Hz": "fast"})", "[]", "{"}) {
    slow.call(2, 7, nonsense);
    Json failure = slow.next_text();
    while (failure["op"] != "serviceCallFailure") failure = slow.next_text();
    EXPECT_TRUE(contains(failure["message"], "0.1 to 120")) << failure;
    EXPECT_FALSE(contains(failure["message"], "\n")) << failure;
  }
  // As many as come again.
  slow.call(2, 8, "{}");
  for (answer = slow.next(); slow.is_text() || answer[0] != 3;) answer = slow.next();
  EXPECT_EQ(answer.substr(17), "{}");
}

TEST_F(ServerTest, CallsAreAnsweredOrFail) {
  const uint16_t port = serve();
  Client client(port);
  client.greet();
  client.call(1, 7, "{\"on\":true}");
  std::string argument;
  EXPECT_TRUE(eventually([&] {
    server_->carry_out([&](size_t, const std::string& given) {
      argument = given;
      return std::string("{\"on\":true}");
    });
    return !argument.empty();
  }));
  EXPECT_EQ(argument, "{\"on\":true}");
  std::string answer = client.next();
  while (client.is_text()) answer = client.next();
  EXPECT_EQ(answer.substr(17), "{\"on\":true}");
  client.call(1, 8, "{}");
  bool called = false;
  EXPECT_TRUE(eventually([&] {
    server_->carry_out([&](size_t, const std::string&) -> std::string {
      called = true;
      throw Error(Failure::Usage, "a touch", "none", "again");
    });
    return called;
  }));
  Json failure = client.next_text();
  while (failure["op"] != "serviceCallFailure") failure = client.next_text();
  EXPECT_EQ(failure["callId"], 8);
  EXPECT_TRUE(contains(failure["message"], "a touch"));
}

TEST_F(ServerTest, OnlyThisMachineAndThisPageMayConnect) {
  const uint16_t port = serve();
  const std::string own = "localhost:" + std::to_string(port);
  EXPECT_EQ(get(port, "/", own), (std::pair<int, std::string>{200, "<p>page"}));
  EXPECT_EQ(get(port, "/", "attacker.example").first, 403);
  EXPECT_EQ(get(port, "/", "localhost.attacker.example:80").first, 403);
  EXPECT_EQ(get(port, "/../../etc/passwd", own).first, 404);
  EXPECT_EQ(get(port, "/x", own).first, 404);
  EXPECT_EQ(get(port, "/", own, http::verb::post).first, 405);
  EXPECT_NO_THROW(Client(port, {.origin = "http://" + own, .host = own}));
  EXPECT_NO_THROW(Client(port, {.host = "[::1]:" + std::to_string(port)}));
  EXPECT_THROW(Client(port, {.origin = "http://attacker.example", .host = own}), beast::system_error);
  EXPECT_THROW(Client(port, {.origin = "null", .host = own}), beast::system_error);
  EXPECT_THROW(Client(port, {.host = "attacker.example"}), beast::system_error);
  EXPECT_EQ(server_->summary().refused, 6u);
  server_.reset();
  options_.origins = {"https://app.foxglove.dev"};
  const uint16_t again = serve();
  EXPECT_NO_THROW(Client(again, {.origin = "https://app.foxglove.dev"}));
  EXPECT_THROW(Client(again, {.origin = "https://app.foxglove.dev.attacker.example"}), beast::system_error);
}

TEST_F(ServerTest, OthersNeedTheToken) {
  options_.address = "0.0.0.0";
  EXPECT_EQ(refusal([&] { serve(); }).exit_code, static_cast<int>(Failure::Usage));
  options_.token = new_token();
  EXPECT_EQ(options_.token.size(), 32u);
  EXPECT_NE(options_.token, new_token());
  const uint16_t port = serve();
  EXPECT_TRUE(contains(server_->url(), "?token=" + options_.token));
  EXPECT_EQ(get(port, "/").first, 401);
  EXPECT_EQ(get(port, "/?token=" + options_.token).first, 200);
  EXPECT_EQ(get(port, "/?a=1&token=" + options_.token, "any.example").first, 200);
  EXPECT_EQ(get(port, "/?token=" + options_.token.substr(1)).first, 401);
  EXPECT_THROW(Client(port, {.token = "wrong"}), beast::system_error);
  EXPECT_NO_THROW(Client(port, {.token = options_.token}));
  EXPECT_TRUE(same_token("abc", "abc"));
  for (const char* other : {"", "ab", "abd", "abcd"}) EXPECT_FALSE(same_token(other, "abc")) << other;
}

TEST_F(ServerTest, ItIsBoundedAndEndsInOrder) {
  const uint16_t port = serve();
  EXPECT_TRUE(contains(refusal([&] {
                         ServeOptions same = options_;
                         same.port = port;
                         LiveServer second(*hub_, same, {});
                       }).line,
                       "a free port"));
  hub_->on_news([] {});
  std::vector<std::unique_ptr<Client>> clients;
  for (size_t i = 0; i < LiveServer::kMostClients; ++i) clients.push_back(std::make_unique<Client>(port));
  EXPECT_TRUE(eventually([&] { return server_->summary().connected == LiveServer::kMostClients; }));
  EXPECT_THROW(Client client(port), beast::system_error);
  // Messages that are too long, or too many, end the connection of who sends them.
  clients[0]->greet();
  EXPECT_THROW(
      {
        clients[0]->say(Json(std::string(100000, 'x')));
        while (true) clients[0]->next();
      },
      beast::system_error);
  EXPECT_THROW(
      {
        for (int i = 0; i < 100000; ++i)
          clients[1]->say({{"op", "palpate.ready"}, {"subscriptions", Json::array()}});
        while (true) clients[1]->next();
      },
      beast::system_error);
  EXPECT_TRUE(eventually([&] { return server_->summary().connected == LiveServer::kMostClients - 2; }));
  std::thread end([&] { server_->stop(); });
  try {
    while (true) clients[2]->next();
  } catch (const beast::system_error& error) {
    EXPECT_EQ(error.code(), websocket::error::closed) << error.what();
  }
  EXPECT_EQ(clients[2]->stream().reason().code, websocket::close_code::going_away);
  end.join();
}

}  // namespace
}  // namespace palpate
