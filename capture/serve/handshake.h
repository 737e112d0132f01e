// Who may connect to the server of live data: one request of HTTP, judged without a socket. Boost's headers
// are heavy: only the server's own sources include this.
#pragma once

#include <boost/beast/http.hpp>
#include <cstdint>
#include <string_view>

#include "capture/serve/serve_options.h"

namespace palpate {

using RequestParser = boost::beast::http::request_parser<boost::beast::http::empty_body>;
using HttpRequest = boost::beast::http::request<boost::beast::http::empty_body>;

/// Bytes that a request's head may have; a body it may not.
inline constexpr uint32_t kMostHead_B = 8 << 10;
inline void bound(RequestParser& parser) {
  parser.header_limit(kMostHead_B);
  parser.body_limit(0);
}

inline std::string_view view(boost::beast::string_view text) {
  return {text.data(), text.size()};
}

/// What a request gets.
struct Verdict {
  enum class Kind : uint8_t { Client, Page, Nothing, Refused };
  Kind kind = Kind::Refused;
  boost::beast::http::status status = boost::beast::http::status::ok;  ///< where it becomes no client
  const char* why = "";                                                ///< in a line, where it gets nothing
};

/// `loopback`: the server listens to this machine alone; `full`: no more clients can be served.
Verdict judged(const HttpRequest& request, const ServeOptions& options, bool loopback, bool full);

/// The protocol to answer a client with; empty: none that it offers is spoken.
std::string_view protocol_of(const HttpRequest& request);

}  // namespace palpate
