// Parser of one line of a CSV table, from this program or another.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace palpate {

/// Its cells: cut at any of `separators`, without the blanks around them and the quotes ("" within quotes is
/// one quote, and separators and blanks there are text). One cell at least.
std::vector<std::string> csv_cells(std::string_view line, std::string_view separators = ",");

/// Without blanks, line ends and quotes around it.
std::string trimmed(std::string_view text);

}  // namespace palpate
