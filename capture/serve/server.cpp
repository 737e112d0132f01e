#include "capture/serve/server.h"

#include <sys/random.h>

#include <algorithm>
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

constexpr size_t kMostHead_B = 8 << 10;
constexpr size_t kMostWaiting = 16;  // connections that are no clients yet

std::string_view view(beast::string_view text) {
  return {text.data(), text.size()};
}

/// "localhost" of "localhost:8765", "[::1]" of "[::1]:8765".
std::string_view host_alone(std::string_view host) {
  const size_t bracket = host.find(']');
  const size_t colon = host.find(':', bracket == std::string_view::npos ? 0 : bracket);
  return host.substr(0, colon);
}

bool is_this_machine(std::string_view host) {
  const std::string_view name = host_alone(host);
  return name == "localhost" || name == "[::1]" || name == "127.0.0.1";
}

/// The token of "/path?token=..." or of "Authorization: Bearer ...".
std::string_view token_of(const HttpRequest& request) {
  constexpr std::string_view kBearer = "Bearer ";
  const std::string_view header = view(request[http::field::authorization]);
  if (header.starts_with(kBearer)) return header.substr(kBearer.size());
  constexpr std::string_view kKey = "token=";
  const std::string_view target = view(request.target());
  for (size_t at = target.find('?'); at != std::string_view::npos; at = target.find('&', at + 1)) {
    const std::string_view part = target.substr(at + 1);
    if (part.starts_with(kKey)) return part.substr(kKey.size(), part.find('&') - kKey.size());
  }
  return {};
}

std::string session_name() {
  return utc_now() + "-" + std::to_string(monotonic_ns());
}

}  // namespace

/// A connection until it is a client: one request, one answer.
class Connection : public std::enable_shared_from_this<Connection> {
 public:
  Connection(Tcp::socket socket, ServerState& state) : state_(state), stream_(std::move(socket)) {
    ++state_.waiting;
    parser_.header_limit(kMostHead_B);
    parser_.body_limit(0);
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
    const HttpRequest& request = parser_.get();
    const std::string_view host = view(request[http::field::host]);
    if (state_.loopback && !is_this_machine(host))
      return refuse(http::status::forbidden,
                    "This server is of this machine alone: open http://localhost.\n");
    if (!state_.options.token.empty() && !same_token(token_of(request), state_.options.token))
      return refuse(http::status::unauthorized,
                    "Wanted the token that palpate printed: add ?token=... to the address.\n");
    if (websocket::is_upgrade(request)) return upgrade(request, host);
    if (request.method() != http::verb::get) return refuse(http::status::method_not_allowed, "GET only.\n");
    const std::string_view target = view(request.target());
    const std::string_view path = target.substr(0, target.find('?'));
    if (path == "/") return send(http::status::ok, "text/html; charset=utf-8", state_.options.page);
    send(http::status::not_found, "text/plain; charset=utf-8", "There is nothing here; the page is at /.\n");
  }

  void upgrade(const HttpRequest& request, std::string_view host) {
    const std::string_view origin = view(request[http::field::origin]);
    const size_t behind = origin.find("://");
    const bool own = behind != std::string_view::npos && origin.substr(behind + 3) == host;
    if (!origin.empty() && !own &&
        std::ranges::find(state_.options.origins, origin) == state_.options.origins.end())
      return refuse(http::status::forbidden,
                    "Pages of other hosts may not connect, unless --allow-origin names them.\n");
    if (state_.clients.size() >= LiveServer::kMostClients)
      return refuse(http::status::service_unavailable, "There are as many clients as can be served.\n");
    stream_.expires_never();
    std::make_shared<ServedClient>(stream_.release_socket(), state_)->accept(request);
  }

  void refuse(http::status status, const char* why) {
    state_.count(&ServeSummary::refused);
    send(status, "text/plain; charset=utf-8", why);
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
  http::request_parser<http::empty_body> parser_;
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

std::string new_token() {
  std::array<uint8_t, 16> bytes{};
  size_t got = 0;
  while (got < bytes.size()) {
    const ssize_t count = ::getrandom(bytes.data() + got, bytes.size() - got, 0);
    if (count > 0) got += static_cast<size_t>(count);
  }
  std::string token;
  for (const uint8_t byte : bytes) token += text("%02x", byte);
  return token;
}

bool same_token(std::string_view a, std::string_view b) {
  volatile unsigned different = a.size() == b.size() ? 0 : 1;
  for (size_t i = 0; i < b.size(); ++i) {
    const auto mine = static_cast<unsigned char>(b[i]);
    const auto other = i < a.size() ? static_cast<unsigned char>(a[i]) : static_cast<unsigned char>(~mine);
    different = different | (mine ^ other);
  }
  return different == 0;
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
