// Text with numbers in it.
#pragma once

#include <string>
#include <vector>

namespace palpate {

/// printf into a string of the length that it takes.
std::string text(const char* format, ...) __attribute__((format(printf, 1, 2)));

/// The one of `words` that `word` was probably meant to be: a letter or two wrong, missing, too many or
/// swapped, more in long words, capital or small; or the one that it begins. Empty where none is near.
std::string nearest_word(const std::string& word, const std::vector<std::string>& words);
/// ", did you mean 'NEAREST'?", or empty where none is near.
std::string did_you_mean(const std::string& word, const std::vector<std::string>& words);

/// The names in a list such as "size=WxH, bits=8|16": what is before `mark` in each part between commas.
std::vector<std::string> names_before(const std::string& list, char mark);

}  // namespace palpate
