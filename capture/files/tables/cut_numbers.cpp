#include "capture/files/tables/cut_numbers.h"

#include <algorithm>

namespace palpate {

bool is_digits(std::string_view text) {
  return !text.empty() && text.find_first_not_of("0123456789") == std::string_view::npos;
}

bool is_whole_number(std::string_view text) {
  if (!text.empty() && (text.front() == '-' || text.front() == '+')) text.remove_prefix(1);
  return is_digits(text);
}

bool CutNumbers::fits(const std::vector<std::string>& cells) const {
  if (cells.size() < 4 || (cells_ != 0 && cells.size() != cells_)) return false;
  const size_t first = cells.size() % 2;
  if (first == 1 && !is_whole_number(cells[0])) return false;
  for (size_t i = first; i < cells.size(); i += 2) {
    const std::string_view whole = cells[i];
    if (!is_whole_number(whole) || !is_digits(cells[i + 1]) || cells[i + 1].size() < 2) return false;
    const std::string_view digits = whole.substr(is_digits(whole) ? 0 : 1);
    if (digits.size() > 1 && digits.front() == '0') return false;
  }
  return true;
}

void CutNumbers::add(const std::vector<std::string>& cells) {
  possible_ = possible_ && fits(cells);
  if (!possible_) return;
  const bool is_first = cells_ == 0;
  cells_ = cells.size();
  pairs_.resize(cells_ / 2);
  for (size_t i = 0; i < pairs_.size(); ++i) {
    Digits& digits = pairs_[i];
    const std::string& now = cells[cells_ % 2 + 2 * i + 1];
    if (is_first) digits.count = now.size();
    possible_ = possible_ && now.size() == digits.count;
    digits.from_zero = digits.from_zero || now.front() == '0';
    digits.rise = digits.rise && (is_first || now >= digits.last);
    digits.fall = digits.fall && (is_first || now <= digits.last);
    digits.last = now;
    if (digits.values.size() < kManyValues && std::ranges::find(digits.values, now) == digits.values.end())
      digits.values.push_back(now);
  }
}

bool CutNumbers::all_cut() const {
  return possible_ && !pairs_.empty() && std::ranges::all_of(pairs_, [](const Digits& digits) {
           return digits.from_zero && !digits.rise && !digits.fall && digits.values.size() == kManyValues;
         });
}

}  // namespace palpate
