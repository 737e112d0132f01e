// A report whose facts are said once: each is a line for people and a value for programs.
#pragma once

#include <string>
#include <utility>

#include "engine/base/json.h"

namespace palpate {

struct Facts {
  std::string text;
  json::Value json = json::Value::object();

  /// `line`: with its line break; empty where programs alone get the value.
  void add(const std::string& key, json::Value value, const std::string& line = {}) {
    json[key] = std::move(value);
    text += line;
  }
  /// Adds a line for people alone: a heading, or several values together.
  void say(const std::string& line) { text += line; }
  void take(const Facts& more) {
    text += more.text;
    json.update(more.json);
  }
};

}  // namespace palpate
