#include "capture/serve/served_client.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "engine/base/json.h"

namespace palpate {
namespace {

constexpr size_t kMostTexts = 256;
constexpr double kMostPerSecond = 200;
constexpr std::chrono::seconds kSilent{30};

}  // namespace

void ServerState::update_wishes() {
  uint64_t topics = 0;
  for (const ServedClient* client : clients) topics |= client->ready();
  hub.want(topics);
}

ServedClient::ServedClient(net::ip::tcp::socket socket, ServerState& state)
    : state_(state),
      ws_(std::move(socket)),
      stalled_(ws_.get_executor()),
      due_(ws_.get_executor()),
      protocol_(state.offer) {
  allowance_ = kMostPerSecond;
  allowance_at_ = std::chrono::steady_clock::now();
}

ServedClient::~ServedClient() {
  if (!greeted_) return;
  state_.clients.erase(this);
  state_.update_wishes();
  const std::lock_guard lock(state_.mutex);
  --state_.summary.connected;
}

void ServedClient::accept(const HttpRequest& request) {
  const std::string chosen(protocol_of(request));
  // One that answers no ping is gone; one that does not read is given its own time.
  const auto silent = std::max(kSilent, std::chrono::seconds(std::llround(2 * state_.options.stall_s)));
  ws_.set_option(websocket::stream_base::timeout{kForRequest, silent, true});
  ws_.set_option(websocket::stream_base::decorator([chosen](websocket::response_type& answer) {
    if (!chosen.empty()) answer.set(http::field::sec_websocket_protocol, chosen);
  }));
  ws_.read_message_max(FoxgloveClient::kLongestMessage_B);
  ws_.auto_fragment(false);
  ws_.async_accept(request, [self = shared_from_this()](beast::error_code error) {
    if (!error) self->greet();
  });
}

void ServedClient::pump() {
  if (writing_ || closing_ || !greeted_) return;
  if (!texts_.empty()) {
    ws_.binary(texts_.front().binary);
    return write(net::buffer(texts_.front().bytes), [this] { texts_.pop_front(); });
  }
  for (size_t i = 0; i < turns_.size(); ++i) {
    Turn& turn = turns_[(next_turn_ + i) % turns_.size()];
    if (turn.waits || turn.rests) continue;
    message_ = state_.hub.next(turn.topic, turn.sent);
    if (!message_) continue;
    next_turn_ = (next_turn_ + i + 1) % turns_.size();
    if (message_->number > turn.sent + 1) dropped(message_->number - turn.sent - 1);
    turn.sent = message_->number;
    turn.waits = turn.paced;
    rest(turn);
    head_ = message_head(turn.subscription, message_->time_ns);
    ws_.binary(true);
    const std::array<net::const_buffer, 2> buffers = {net::buffer(head_), net::buffer(message_->bytes)};
    return write(buffers, [this] {
      message_.reset();
      state_.count(&ServeSummary::sent);
    });
  }
}

uint64_t ServedClient::ready() const {
  uint64_t topics = 0;
  for (const Turn& turn : turns_) {
    if (turn.waits || turn.rests) continue;
    if (!is_picture(state_.offer.topics[turn.topic].kind) || state_.hub.newest(turn.topic) <= turn.sent)
      topics |= uint64_t{1} << turn.topic;
  }
  return topics;
}

void ServedClient::end(websocket::close_code code, const char* why) {
  if (std::exchange(closing_, true)) return;
  if (writing_ || code == websocket::close_code::none) return cut();
  ws_.async_close({code, why}, [self = shared_from_this()](beast::error_code) { self->cut(); });
}

void ServedClient::greet() {
  greeted_ = true;
  state_.clients.insert(this);
  {
    const std::lock_guard lock(state_.mutex);
    ++state_.summary.clients;
    ++state_.summary.connected;
  }
  for (std::string& text : protocol_.greeting()) say(std::move(text));
  read();
}

void ServedClient::read() {
  ws_.async_read(in_, [self = shared_from_this()](beast::error_code error, size_t) {
    if (error || self->closing_) return self->cut();
    if (!self->allowed()) return self->end(websocket::close_code::policy_error, "too many messages");
    const auto bytes = static_cast<const uint8_t*>(self->in_.data().data());
    self->take({bytes, self->in_.size()});
    self->in_.consume(self->in_.size());
    self->read();
  });
}

bool ServedClient::allowed() {
  const auto now = std::chrono::steady_clock::now();
  allowance_ =
      std::min(kMostPerSecond,
               allowance_ + kMostPerSecond * std::chrono::duration<double>(now - allowance_at_).count());
  allowance_at_ = now;
  if (allowance_ < 1) return false;
  allowance_ -= 1;
  return true;
}

void ServedClient::take(std::span<const uint8_t> bytes) {
  FoxgloveClient::Answer answer =
      ws_.got_text() ? protocol_.take_text({reinterpret_cast<const char*>(bytes.data()), bytes.size()})
                     : protocol_.take_binary(bytes);
  for (std::string& text : answer.texts) say(std::move(text));
  for (FoxgloveCall& call : answer.calls) {
    if (call.service + 1 == state_.offer.requests.size()) {
      take_view(call);
      continue;
    }
    const std::lock_guard lock(state_.mutex);
    state_.calls.push_back({weak_from_this(), std::move(call)});
  }
  for (const uint32_t id : answer.ready) {
    const auto turn = std::ranges::find_if(turns_, [&](const Turn& t) { return t.subscription == id; });
    // What went by meanwhile was not wanted.
    if (turn->waits) turn->sent = state_.hub.passed(turn->topic);
    turn->paced = true;
    turn->waits = false;
  }
  if (!answer.ready.empty()) {
    state_.update_wishes();
    pump();
  }
  if (!answer.subscriptions_changed) return;
  std::vector<Turn> turns;
  for (const auto& [id, topic] : protocol_.subscriptions()) {
    const auto before =
        std::ranges::find_if(turns_, [&, id = id](const Turn& t) { return t.subscription == id; });
    // What was there before somebody asked is not owed to them.
    turns.push_back(before != turns_.end()
                        ? *before
                        : Turn{.subscription = id, .topic = topic, .sent = state_.hub.passed(topic)});
  }
  turns_ = std::move(turns);
  next_turn_ = 0;
  state_.update_wishes();
  pump();
}

void ServedClient::take_view(const FoxgloveCall& call) {
  double rate_Hz = 0;
  try {
    const json::Value given = json::parse(call.argument.empty() ? "{}" : call.argument, {.deepest = 8});
    if (!given.is_object()) throw json::Error("no object");
    if (const json::Value* rate = given.find("rate_Hz")) {
      rate_Hz = rate->number();
      if (!(rate_Hz >= kSlowestView_Hz && rate_Hz <= kFastestView_Hz)) throw json::Error("out of bounds");
    }
  } catch (const json::Error& error) {
    return say(call_failure({call.service + 1, call.id, {}},
                            std::string("wanted {\"rate_Hz\": 0.1 to 120}, or {} for as many pictures as are "
                                        "taken; found ") +
                                error.what()));
  }
  apart_ = std::chrono::duration<double>(rate_Hz > 0 ? 1 / rate_Hz : 0);
  for (Turn& turn : turns_) turn.due = {};
  wake();
  say(call_answer(call, rate_Hz > 0 ? json::Value{{"rate_Hz", rate_Hz}}.dump() : "{}"));
}

/// The next is due on a grid, so that the rate is kept whenever pictures come.
void ServedClient::rest(Turn& turn) {
  if (apart_.count() == 0 || !is_picture(state_.offer.topics[turn.topic].kind)) return;
  const auto now = std::chrono::steady_clock::now();
  const auto apart = std::chrono::duration_cast<std::chrono::steady_clock::duration>(apart_);
  turn.due = std::max(turn.due, now - apart) + apart;
  if (turn.due <= now) turn.due = now + apart;
  turn.rests = true;
  wake();
}

/// Ends the rest of pictures that are due, and comes again for the others.
void ServedClient::wake() {
  const auto now = std::chrono::steady_clock::now();
  auto next = std::chrono::steady_clock::time_point::max();
  bool any = false;
  for (Turn& turn : turns_) {
    if (!turn.rests) continue;
    if (turn.due > now) {
      next = std::min(next, turn.due);
      continue;
    }
    turn.rests = false;
    turn.sent = state_.hub.passed(turn.topic);  // what went by meanwhile was not wanted
    any = true;
  }
  due_.cancel();
  if (next != std::chrono::steady_clock::time_point::max()) {
    due_.expires_at(next);
    due_.async_wait([weak = weak_from_this()](beast::error_code error) {
      if (const auto self = weak.lock(); self && !error && !self->closing_) self->wake();
    });
  }
  if (any) state_.update_wishes();
}

void ServedClient::put(Text text) {
  if (texts_.size() == kMostTexts) return end(websocket::close_code::policy_error, "answers are not read");
  texts_.push_back(std::move(text));
  pump();
}

template <typename Buffers, typename Done>
void ServedClient::write(const Buffers& buffers, Done done) {
  writing_ = true;
  const uint64_t bytes = net::buffer_size(buffers);
  stalled_.expires_after(std::chrono::duration_cast<std::chrono::milliseconds>(
      std::chrono::duration<double>(state_.options.stall_s)));
  stalled_.async_wait([weak = weak_from_this()](beast::error_code error) {
    const auto self = weak.lock();
    // It may have run out just before its write ended: then the time of the next one is not over.
    if (error || !self || !self->writing_ || self->stalled_.expiry() > std::chrono::steady_clock::now())
      return;
    self->state_.count(&ServeSummary::stalled);
    for (const Turn& turn : self->turns_) self->dropped(self->state_.hub.passed(turn.topic) - turn.sent);
    if (self->message_) self->dropped(1);
    self->cut();
  });
  ws_.async_write(buffers, [self = shared_from_this(), done, bytes](beast::error_code error, size_t) {
    self->writing_ = false;
    self->stalled_.cancel();
    if (error || self->closing_) return self->cut();
    done();
    self->state_.count(&ServeSummary::bytes, bytes);
    self->tell_drops();
    self->pump();
    self->state_.update_wishes();
  });
}

void ServedClient::dropped(uint64_t count) {
  drops_ += count;
  state_.count(&ServeSummary::dropped, count);
}

void ServedClient::tell_drops() {
  const auto now = std::chrono::steady_clock::now();
  if (drops_ == drops_told_ || now - drops_told_at_ < std::chrono::seconds(1)) return;
  drops_told_at_ = now;
  drops_told_ = drops_;
  texts_.push_back(
      {bytes_of(status_text(StatusLevel::Warning, std::to_string(drops_) +
                                                      " messages dropped: this client reads slower "
                                                      "than they come; the newest go on")),
       false});
}

void ServedClient::cut() {
  closing_ = true;
  stalled_.cancel();
  due_.cancel();
  beast::error_code ignored;
  beast::get_lowest_layer(ws_).socket().close(ignored);
}

}  // namespace palpate
