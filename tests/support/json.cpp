#include "tests/support/json.h"

template class nlohmann::basic_json<>;

namespace palpate {

Json parse_json(const std::string& text) {
  return Json::parse(text);
}

}  // namespace palpate
