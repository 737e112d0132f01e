#include "viz/report/html.h"

#include <fstream>
#include <iterator>

#include "engine/base/text.h"
#include "viz/look/theme.h"

namespace palpate {
namespace {

std::string variables(const viz::Theme& t) {
  std::string css;
  const auto set = [&css](const char* name, viz::Rgb c) {
    css += text("--%s: #%02x%02x%02x; ", name, c.red, c.green, c.blue);
  };
  set("ground", t.panel);
  set("field", t.field);
  set("frame", t.frame);
  set("grid", t.grid);
  set("text", t.text);
  set("faint", t.faint);
  set("chosen", t.chosen);
  set("doubtful", t.doubtful);
  set("wrong", t.wrong);
  return css;
}

// Plots are drawn for a white ground; on a dark screen those without a map are turned dark, hues as they are.
// Inter takes the x of x86_64 for a sign of multiplication unless it is told not to.
constexpr const char* kStyle = R"(
body { font: 16px/1.5 Inter, "DejaVu Sans", Verdana, sans-serif; font-variant-numeric: tabular-nums;
  font-variant-ligatures: no-contextual;
  color: var(--text); background: var(--ground); max-width: 1120px; margin: 1.5em auto; padding: 0 1em; }
h1 { font-size: 1.5em; line-height: 1.25; margin: 0.4em 0; }
h2 { font-size: 1.1em; margin: 1.6em 0 0.4em; padding-bottom: 0.2em; border-bottom: 1px solid var(--grid); }
table { border-collapse: collapse; font-size: 0.88em; margin: 0.6em 0; display: block; overflow-x: auto; }
th, td { padding: 0.2em 0.9em 0.2em 0; text-align: left; vertical-align: top; font-weight: normal; }
th { color: var(--faint); white-space: nowrap; }
td.number, th.number { text-align: right; white-space: nowrap; }
tr + tr > td, tr + tr > th { border-top: 1px solid var(--grid); }
figure { margin: 1em 0; } figcaption { color: var(--faint); font-size: 0.88em; }
figure svg { background: #fff; border-radius: 6px; } svg, img { max-width: 100%; height: auto; }
.answer { font-size: 1.2em; margin: 0.6em 0; }
.notice, .warning { background: var(--field); border-left: 4px solid var(--chosen); padding: 0.4em 0.9em; margin: 0.5em 0; }
.warning { border-color: var(--doubtful); } ul.warning { padding-left: 2em; }
.small { color: var(--faint); font-size: 0.88em; } .missing { color: var(--wrong); }
.two { display: grid; grid-template-columns: 1fr 1fr; gap: 0 2em; }
.cards { display: grid; grid-template-columns: repeat(auto-fill, minmax(min(30em, 100%), 1fr)); gap: 1em; }
.card { border: 1px solid var(--frame); border-radius: 6px; padding: 0 1em 1em; }
.card h2 { border: 0; margin-top: 0.8em; } .card img { width: 100%; }
@media screen and (prefers-color-scheme: dark) {
  figure svg:not(:has(image)) { filter: invert(0.91) hue-rotate(180deg); } }
@media (max-width: 720px) { .two { grid-template-columns: 1fr; } }
@page { size: A4; margin: 10mm; }
@media print { body { color: #000; background: #fff; font-size: 9.5px; max-width: none; margin: 0; padding: 0; print-color-adjust: exact; }
  .two { grid-template-columns: 1fr 1fr; } h2 { break-after: avoid; } figure, tr { break-inside: avoid; }
  .two figure svg, figure:first-of-type svg { max-height: 48mm; } }
)";

}  // namespace

std::string html_page(const std::string& title, const std::string& body) {
  return "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
         "<meta name=\"viewport\" content=\"width=device-width\">\n"
         "<meta name=\"color-scheme\" content=\"light dark\">\n<title>" +
         html_escaped(title) + "</title>\n<style>\n:root { " + variables(viz::light_theme()) +
         "}\n@media screen and (prefers-color-scheme: dark) { :root { " + variables(viz::dark_theme()) +
         "} }" + kStyle + "</style>\n</head>\n<body>\n" + body + "</body>\n</html>\n";
}

std::string html_escaped(const std::string& text) {
  std::string escaped;
  for (const char c : text) {
    switch (c) {
      case '&':
        escaped += "&amp;";
        break;
      case '<':
        escaped += "&lt;";
        break;
      case '>':
        escaped += "&gt;";
        break;
      case '"':
        escaped += "&quot;";
        break;
      case '\'':
        escaped += "&#39;";
        break;
      default:
        escaped += c;
    }
  }
  return escaped;
}

std::string svg_element(const std::string& svg) {
  const size_t start = svg.find("<svg");
  const size_t end = svg.rfind("</svg>");
  if (start == std::string::npos || end == std::string::npos) return "";
  return svg.substr(start, end + 6 - start);
}

std::string html_rows(const std::vector<std::pair<std::string, std::string>>& rows) {
  std::string text = "<table>\n";
  for (const auto& [name, value] : rows)
    text += "<tr><th>" + html_escaped(name) + "</th><td>" + html_escaped(value) + "</td></tr>\n";
  return text + "</table>\n";
}

std::string html_figure(const std::filesystem::path& svg) {
  std::ifstream in(svg, std::ios::binary);
  const std::string text{std::istreambuf_iterator<char>(in), {}};
  return "<figure>" + (text.empty() ? "<p>no plot: gnuplot is not there</p>\n" : svg_element(text)) +
         "</figure>\n";
}

}  // namespace palpate
