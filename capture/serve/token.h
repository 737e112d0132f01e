// Tokens that clients of a server for other machines must show.
#pragma once

#include <string>
#include <string_view>

namespace palpate {

/// A token of 128 random bits in 32 letters.
std::string new_token();
/// Whether two tokens are the same, in a time that does not depend on where they differ.
bool same_token(std::string_view a, std::string_view b);

}  // namespace palpate
