#include "capture/serve/token.h"

#include <sys/random.h>

#include <array>
#include <cstdint>

#include "engine/base/text.h"

namespace palpate {

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

}  // namespace palpate
