#include "capture/serve/server.h"

#include <atomic>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <chrono>
#include <mutex>
#include <thread>

#include "capture/serve/served_client.h"
#include "engine/base/clock.h"
#include "engine/base/json.h"
#include "engine/base/text.h"
#include "engine/base/trace.h"
#include "palpate/error.h"

namespace palpate {

using Tcp = net::ip::tcp;

namespace {

constexpr size_t kMostWaiting = 16;  // connections that are no clients yet

std::string session_name() {
  return utc_now() + "-" + std::to_string(monotonic_ns());
}

}  // namespace

/// A connection until it is a client: one request, one answer.
class Connection : public std::enable_shared_from_this<Connection> {
 public:
  Connection(Tcp::socket socket, ServerState& state) : state_(state), stream_(std::move(socket)) {
    ++state_.waiting;
    bound(parser_);
  }
  ~Connection() { --state_.waiting; }

  void run() {
    stream_.expires_after(kForRequest);
    http::async_read(stream_, in_, parser_, [self = shared_from_this()](beast::error_code error, size_t) {
      // Browsers open connections that they may not need.
      if (error == http::error::end_of_stream || error == beast::error::timeout) return;
      if (error) return self->state_.count(&ServeSummary::refused);
      self->answer();
    });
  }

 private:
  void answer() {
    const bool full = state_.clients.size() >= LiveServer::kMostClients;
    const Verdict verdict = judged(parser_.get(), state_.options, state_.loopback, full);
    switch (verdict.kind) {
      case Verdict::Kind::Client:
        stream_.expires_never();
        return std::make_shared<ServedClient>(stream_.release_socket(), state_)->accept(parser_.get());
      case Verdict::Kind::Page:
        return send(verdict.status, "text/html; charset=utf-8", state_.options.page);
      case Verdict::Kind::Refused:
        state_.count(&ServeSummary::refused);
        break;
      case Verdict::Kind::Nothing:
        break;
    }
    send(verdict.status, "text/plain; charset=utf-8", verdict.why);
  }

  void send(http::status status, const char* type, const std::string& text) {
    answer_.result(status);
    answer_.version(parser_.get().version());
    answer_.keep_alive(false);
    answer_.set(http::field::content_type, type);
    answer_.set(http::field::cache_control, "no-store");
    answer_.set("X-Content-Type-Options", "nosniff");
    answer_.set("Referrer-Policy", "no-referrer");
    answer_.set(
        "Content-Security-Policy",
        "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data: blob:; "
        "connect-src ws: wss:; frame-ancestors 'none'");
    answer_.body() = text;
    answer_.prepare_payload();
    stream_.expires_after(kForRequest);
    http::async_write(stream_, answer_, [self = shared_from_this()](beast::error_code, size_t) {
      beast::error_code ignored;
      self->stream_.socket().shutdown(Tcp::socket::shutdown_send, ignored);
    });
  }

  ServerState& state_;
  beast::tcp_stream stream_;
  beast::flat_buffer in_{kMostHead_B + 1024};
  RequestParser parser_;
  http::response<http::string_body> answer_;
};

struct LiveServer::Impl {
  ServerState state;
  net::io_context context{1};  // what waits in it belongs to the state
  Tcp::acceptor acceptor{context};
  std::atomic<bool> posted{false}, stopping{false};
  std::thread thread;

  Impl(LiveHub& hub, ServeOptions options, std::vector<ServedRequest> requests)
      : state{.hub = hub,
              .options = std::move(options),
              .offer = {},
              .clients = {},
              .mutex = {},
              .calls = {},
              .summary = {}} {
    requests.push_back(kView);
    state.offer = {state.options.name, session_name(), hub.topics(), std::move(requests)};
  }
  void listen();
  void accept();
  void finish(int tries);
};

void LiveServer::Impl::listen() {
  beast::error_code error;
  const net::ip::address address = net::ip::make_address(state.options.address, error);
  if (error)
    throw Error(Failure::Usage, "an address of this machine to serve on", "'" + state.options.address + "'",
                "127.0.0.1, or 0.0.0.0 with a token");
  state.loopback = address.is_loopback();
  if (!state.loopback && state.options.token.empty())
    throw Error(Failure::Usage, "a token, to serve others than this machine", "none", "--token");
  const Tcp::endpoint at(address, state.options.port);
  const auto check = [&] {
    if (!error) return;
    throw Error(Failure::Input, "a free port to serve on",
                state.options.address + ":" + std::to_string(state.options.port) + ": " + error.message(),
                "another one, --port " + std::to_string(state.options.port + 1));
  };
  acceptor.open(at.protocol(), error);
  check();
  acceptor.set_option(net::socket_base::reuse_address(true), error);
  acceptor.bind(at, error);
  check();
  acceptor.listen(static_cast<int>(kMostWaiting), error);
  check();
}

void LiveServer::Impl::accept() {
  acceptor.async_accept([this](beast::error_code error, Tcp::socket socket) {
    if (error == net::error::operation_aborted || !acceptor.is_open()) return;
    if (!error && state.waiting < kMostWaiting) {
      beast::error_code ignored;
      socket.set_option(Tcp::no_delay(true), ignored);
      std::make_shared<Connection>(std::move(socket), state)->run();
    } else if (!error) {
      state.count(&ServeSummary::refused);
    }
    accept();
  });
}

/// Those who answer are closed in good order; after a second the others are cut.
void LiveServer::Impl::finish(int tries) {
  if (state.clients.empty() || tries == 0) return context.stop();
  const auto patience = std::make_shared<net::steady_timer>(context, std::chrono::milliseconds(20));
  patience->async_wait([this, patience, tries](beast::error_code) { finish(tries - 1); });
}

LiveServer::LiveServer(LiveHub& hub, ServeOptions options, std::vector<ServedRequest> requests)
    : impl_(std::make_unique<Impl>(hub, std::move(options), std::move(requests))) {
  Impl& m = *impl_;
  m.listen();
  m.accept();
  hub.on_news([&m] {
    if (m.stopping || m.posted.exchange(true)) return;
    net::post(m.context, [&m] {
      m.posted = false;
      for (ServedClient* client : m.state.clients) client->pump();
      m.state.update_wishes();
    });
  });
  m.thread = std::thread([&m] {
    name_trace_thread("serve");
    m.context.run();
  });
}

LiveServer::~LiveServer() {
  stop();
}

void LiveServer::stop() {
  Impl& m = *impl_;
  if (m.stopping.exchange(true)) return;
  net::post(m.context, [&m] {
    beast::error_code ignored;
    m.acceptor.close(ignored);
    for (ServedClient* client : std::set(m.state.clients))
      client->end(websocket::close_code::going_away, "the server ends");
    m.finish(50);
  });
  m.thread.join();
  m.state.hub.want(0);
}

uint16_t LiveServer::port() const {
  return impl_->acceptor.local_endpoint().port();
}

std::string LiveServer::url() const {
  const ServeOptions& options = impl_->state.options;
  const bool any = options.address == "0.0.0.0" || options.address == "::";
  const std::string host = impl_->state.loopback ? "localhost" : any ? "THIS-MACHINE" : options.address;
  return "http://" + host + ":" + std::to_string(port()) + "/" +
         (options.token.empty() ? "" : "?token=" + options.token);
}

void LiveServer::carry_out(
    const std::function<std::string(size_t request, const std::string& argument)>& handle) {
  std::vector<ServerState::Call> calls;
  {
    const std::lock_guard lock(impl_->state.mutex);
    calls.swap(impl_->state.calls);
  }
  for (const ServerState::Call& one : calls) {
    std::string answer, failure;
    try {
      answer = handle(one.call.service, one.call.argument);
    } catch (const std::exception& error) {
      failure = error.what();
    }
    net::post(impl_->context, [one, answer, failure] {
      const auto client = one.client.lock();
      if (!client) return;
      if (failure.empty())
        client->say(call_answer(one.call, answer));
      else
        client->say(call_failure({one.call.service + 1, one.call.id, {}}, failure));
    });
  }
}

ServeSummary LiveServer::summary() const {
  const std::lock_guard lock(impl_->state.mutex);
  return impl_->state.summary;
}

std::string describe(const ServeSummary& s) {
  const auto count = [](uint64_t n) { return static_cast<unsigned long long>(n); };
  std::string line = text("served %llu clients: %llu messages, %.1f MB, %llu dropped", count(s.clients),
                          count(s.sent), 1e-6 * static_cast<double>(s.bytes), count(s.dropped));
  if (s.stalled > 0) line += text("; %llu did not read and were closed", count(s.stalled));
  if (s.refused > 0) line += text("; %llu refused", count(s.refused));
  return line;
}

}  // namespace palpate
