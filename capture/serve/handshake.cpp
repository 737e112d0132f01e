#include "capture/serve/handshake.h"

#include <algorithm>
#include <boost/beast/websocket/rfc6455.hpp>

#include "capture/serve/foxglove.h"
#include "capture/serve/token.h"

namespace palpate {
namespace {

namespace http = boost::beast::http;

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

/// A page of this server, one that was named, or no page at all.
bool may_come_from(std::string_view origin, std::string_view host, const ServeOptions& options) {
  const size_t behind = origin.find("://");
  const bool own = behind != std::string_view::npos && origin.substr(behind + 3) == host;
  return origin.empty() || own || std::ranges::find(options.origins, origin) != options.origins.end();
}

}  // namespace

Verdict judged(const HttpRequest& request, const ServeOptions& options, bool loopback, bool full) {
  using enum Verdict::Kind;
  const std::string_view host = view(request[http::field::host]);
  if (loopback && !is_this_machine(host))
    return {Refused, http::status::forbidden,
            "This server is of this machine alone: open http://localhost.\n"};
  if (!options.token.empty() && !same_token(token_of(request), options.token))
    return {Refused, http::status::unauthorized,
            "Wanted the token that palpate printed: add ?token=... to the address.\n"};
  if (boost::beast::websocket::is_upgrade(request)) {
    if (!may_come_from(view(request[http::field::origin]), host, options))
      return {Refused, http::status::forbidden,
              "Pages of other hosts may not connect, unless --allow-origin names them.\n"};
    if (full)
      return {Refused, http::status::service_unavailable, "There are as many clients as can be served.\n"};
    return {Client, http::status::switching_protocols};
  }
  if (request.method() != http::verb::get) return {Refused, http::status::method_not_allowed, "GET only.\n"};
  const std::string_view target = view(request.target());
  if (target.substr(0, target.find('?')) == "/") return {Page, http::status::ok};
  return {Nothing, http::status::not_found, "There is nothing here; the page is at /.\n"};
}

std::string_view protocol_of(const HttpRequest& request) {
  return chosen_protocol(view(request[http::field::sec_websocket_protocol]));
}

}  // namespace palpate
