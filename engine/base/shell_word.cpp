#include "engine/base/shell_word.h"

namespace palpate {

std::string in_quotes(const std::string& word) {
  const bool plain = !word.empty() && word.find_first_of(" '\"?&*;()$<>|\\") == std::string::npos;
  return plain ? word : "'" + word + "'";
}

}  // namespace palpate
