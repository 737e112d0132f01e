// Pieces of HTML pages.
#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

namespace palpate {

/// Text as HTML shows it: no tag, entity or attribute can come out of it.
std::string html_escaped(const std::string& text);
/// A whole page in the one style of reports: light or dark as the reader's screen is, black on white on
/// paper, one column where it is narrow. `body` may use the classes answer, notice, warning, small, missing,
/// number, two (side by side), cards and card.
std::string html_page(const std::string& title, const std::string& body);
/// A table of names and values.
std::string html_rows(const std::vector<std::pair<std::string, std::string>>& rows);
/// The plot in an SVG file as a <figure>, or a line that says why there is none.
std::string html_figure(const std::filesystem::path& svg);
/// The <svg> element alone, without the XML declaration before it.
std::string svg_element(const std::string& svg);

}  // namespace palpate
