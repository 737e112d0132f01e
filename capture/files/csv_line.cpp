#include "capture/files/csv_line.h"

namespace palpate {
namespace {

bool blank(char c) {
  return c == ' ' || c == '\t' || c == '\r';
}

}  // namespace

std::vector<std::string> csv_cells(std::string_view line, std::string_view separators) {
  std::vector<std::string> cells(1);
  bool inside = false;
  size_t quoted = 0;  // of the cell, up to where blanks are text
  const auto end_cell = [&] {
    std::string& cell = cells.back();
    while (cell.size() > quoted && blank(cell.back())) cell.pop_back();
    quoted = 0;
  };
  for (size_t i = 0; i < line.size(); ++i) {
    const char c = line[i];
    std::string& cell = cells.back();
    if (c == '"' && inside && i + 1 < line.size() && line[i + 1] == '"') {
      cell += line[++i];
    } else if (c == '"') {
      inside = !inside;
      quoted = cell.size();
    } else if (!inside && separators.find(c) != std::string_view::npos) {
      end_cell();
      cells.emplace_back();
    } else if (inside || !blank(c) || !cell.empty()) {
      cell += c;
    }
  }
  end_cell();
  return cells;
}

std::string trimmed(std::string_view text) {
  const auto around = [](char c) { return blank(c) || c == '"'; };
  while (!text.empty() && around(text.front())) text.remove_prefix(1);
  while (!text.empty() && around(text.back())) text.remove_suffix(1);
  return std::string(text);
}

}  // namespace palpate
