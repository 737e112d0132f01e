// JSON of the program's answers, read with another library than the program's own writer uses.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

extern template class nlohmann::basic_json<>;  // compiled once, in json.cpp

namespace palpate {

using Json = nlohmann::json;

/// Throws Json::parse_error.
Json parse_json(const std::string& text);

}  // namespace palpate
