#include "engine/base/text.h"

#include <algorithm>
#include <cctype>
#include <cstdarg>
#include <cstdio>

namespace palpate {
namespace {

std::string small_letters(std::string word) {
  for (char& c : word) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return word;
}

// Letters to change, add, drop or swap with their neighbour (optimal string alignment).
size_t edits(const std::string& a, const std::string& b) {
  std::vector<std::vector<size_t>> d(a.size() + 1, std::vector<size_t>(b.size() + 1));
  for (size_t i = 0; i <= a.size(); ++i) d[i][0] = i;
  for (size_t j = 0; j <= b.size(); ++j) d[0][j] = j;
  for (size_t i = 1; i <= a.size(); ++i)
    for (size_t j = 1; j <= b.size(); ++j) {
      d[i][j] = std::min({d[i - 1][j] + 1, d[i][j - 1] + 1, d[i - 1][j - 1] + (a[i - 1] != b[j - 1])});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
        d[i][j] = std::min(d[i][j], d[i - 2][j - 2] + 1);
    }
  return d[a.size()][b.size()];
}

}  // namespace

std::string text(const char* format, ...) {
  va_list arguments, again;
  va_start(arguments, format);
  va_copy(again, arguments);
  const int length = std::vsnprintf(nullptr, 0, format, arguments);
  va_end(arguments);
  std::string written(static_cast<size_t>(std::max(length, 0)), '\0');
  std::vsnprintf(written.data(), written.size() + 1, format, again);
  va_end(again);
  return written;
}

std::string nearest_word(const std::string& word, const std::vector<std::string>& words) {
  constexpr size_t kLongest = 64;  // no name is longer
  if (word.empty() || word.size() > kLongest) return {};
  const std::string meant = small_letters(word);
  std::string nearest;
  size_t fewest = 1 + (meant.size() > 3) + meant.size() / 8 + 1;
  for (const std::string& one : words) {
    if (one.size() > kLongest) continue;
    const size_t count = edits(meant, small_letters(one));
    if (count < fewest && 2 * count < std::max(meant.size(), one.size())) {
      fewest = count;
      nearest = one;
    }
  }
  if (!nearest.empty() || meant.size() < 3) return nearest;
  std::vector<std::string> longer;
  for (const std::string& one : words)
    if (small_letters(one).starts_with(meant)) longer.push_back(one);
  return longer.size() == 1 ? longer.front() : "";
}

std::string did_you_mean(const std::string& word, const std::vector<std::string>& words) {
  const std::string nearest = nearest_word(word, words);
  return nearest.empty() ? "" : ", did you mean '" + nearest + "'?";
}

std::vector<std::string> names_before(const std::string& list, char mark) {
  std::vector<std::string> names;
  for (size_t start = 0; start < list.size();) {
    const size_t end = std::min(list.find(',', start), list.size());
    const std::string part = list.substr(start, end - start);
    const size_t first = part.find_first_not_of(' ');
    const size_t last = part.find(mark);
    if (first != std::string::npos && last != std::string::npos)
      names.push_back(part.substr(first, last - first));
    start = end + 1;
  }
  return names;
}

}  // namespace palpate
