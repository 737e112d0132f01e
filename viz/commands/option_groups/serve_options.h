// --serve and what goes with it, of commands that measure live.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "capture/serve/server.h"

namespace palpate {

class CommandLine;
class CommandOption;

struct ServeChoice {
  bool on = false;
  std::string address = "127.0.0.1";
  uint64_t port = kServePort;
  std::vector<std::string> origins;

  /// `always`: the command serves whatever is said, and needs no --serve.
  void add_to(CommandLine& command, bool always = false);
  /// For the server, with a token where one is wanted.
  ServeOptions options() const;

 private:
  std::string token_;
  CommandOption* token_option_ = nullptr;
};

}  // namespace palpate
