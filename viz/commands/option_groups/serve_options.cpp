#include "viz/commands/option_groups/serve_options.h"

#include "capture/serve/token.h"
#include "palpate/error.h"
#include "viz/commands/support/options.h"

namespace palpate {

void ServeChoice::add_to(CommandLine& command, bool always) {
  if (always)
    on = true;
  else
    command.add_flag(
        "--serve", on,
        "Serve touch, depth and pictures live: a page for browsers and Foxglove's WebSocket protocol");
  command.add_setting("--port", port, Check::range(uint64_t{0}, uint64_t{65535}),
                      "Port to serve on; 0: a free one");
  command.add_option("--address", address, "Address to serve on; others than this machine's need a token")
      ->capture_default_str();
  token_option_ =
      command
          .add_option("--token", token_,
                      "Clients must show this token, in ?token= or as Authorization: Bearer; without a "
                      "value one is made and printed")
          ->expected(0, 1);
  command.add_option("--allow-origin", origins,
                     "Page of another host that may connect, such as https://app.foxglove.dev (repeatable)");
}

ServeOptions ServeChoice::options() const {
  ServeOptions options;
  options.address = address;
  options.port = static_cast<uint16_t>(port);
  options.origins = origins;
  if (token_option_ && token_option_->count() > 0) options.token = token_.empty() ? new_token() : token_;
  constexpr size_t kShortest = 16;
  if (!options.token.empty() && options.token.size() < kShortest)
    throw Error(Failure::Usage, "a token of at least 16 letters", std::to_string(options.token.size()),
                "--token without a value, which makes one");
  return options;
}

}  // namespace palpate
