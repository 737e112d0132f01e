#include "perf/lab/study/lump_network_figure.h"

#include <algorithm>
#include <limits>

namespace palpate {
namespace {

// The picture's own units: 1280 x 760 pixels are 128 x 76.
constexpr double kWide = 128, kHigh = 76;
constexpr double kBoxLow = 2, kBoxHigh = 22;         // the inverse way
constexpr double kTopLow = 65, kTopHigh = 72;        // the forward way
constexpr double kNetLow = 31, kNetHigh = 58;        // the network between them
constexpr double kNamesLeft = 22, kNamesRight = 17;  // beside the dots, for what goes in and out
constexpr size_t kLettersOfBox = 31;
constexpr uint32_t kMostDots = 14;  // of a layer; of more the first and last are drawn

void label(PlotPanel& sheet, const std::string& text, double x, double y, const char* align,
           double points = 9, size_t colour = kPlotBlack) {
  PlotCurve& words = sheet.add("", {x}, {y}, colour, PlotCurve::Style::Words);
  words.words = {text};
  words.align = align;
  words.size = points / 18;
}

void rectangle(PlotPanel& sheet, double left, double right, double low, double high, size_t colour) {
  PlotCurve& fill = sheet.add("", {left, right}, {low, low}, colour, PlotCurve::Style::Band);
  fill.low = {low, low};
  fill.high = {high, high};
  sheet.add("", {left, right, right, left, left}, {low, low, high, high, low}, kPlotGray).width = 1;
}

void arrow(PlotPanel& sheet, double x0, double y0, double x1, double y1) {
  PlotCurve& line = sheet.add("", {x0}, {y0}, 4, PlotCurve::Style::Arrows);
  line.low = {x1 - x0};
  line.high = {y1 - y0};
  line.width = 1.6;
}

/// Lines of at most so many letters, broken between words.
std::vector<std::string> wrapped(const std::string& text, size_t letters) {
  std::vector<std::string> lines = {""};
  for (size_t from = 0; from < text.size();) {
    const size_t end = std::min(text.find(' ', from), text.size());
    const std::string word = text.substr(from, end - from);
    if (!lines.back().empty() && lines.back().size() + 1 + word.size() > letters) lines.emplace_back();
    lines.back() += (lines.back().empty() ? "" : " ") + word;
    from = end + 1;
  }
  return lines;
}

std::string widths_text(const lump::Stage& stage) {
  std::string text;
  for (const uint32_t width : stage.widths) text += (text.empty() ? "" : ", ") + std::to_string(width);
  return text.empty() ? "" : "numbers: " + text;
}

/// A box with its name, what goes in and what comes out.
void box(PlotPanel& sheet, const lump::Stage& stage, double left, double right) {
  rectangle(sheet, left, right, kBoxLow, kBoxHigh, stage.kind == lump::Stage::Kind::Search ? 6 : 5);
  double y = kBoxHigh - 1.3;
  for (const std::string& line : wrapped(stage.name, kLettersOfBox - 4)) {
    label(sheet, line, (left + right) / 2, y, "center", 11);
    y -= 1.9;
  }
  const auto lines = [&](const std::string& text, size_t colour) {
    for (const std::string& line : wrapped(text, kLettersOfBox)) {
      label(sheet, line, left + 0.8, y, "left", 9, colour);
      y -= 1.6;
    }
  };
  for (const std::string& in : stage.inputs) lines("in: " + in, 4);
  if (!stage.widths.empty()) lines(widths_text(stage), 0);
  for (const std::string& out : stage.outputs) lines((stage.inputs.empty() ? "" : "out: ") + out, kPlotBlack);
}

/// Where the drawn dots of a layer lie; NaN for the gap.
std::vector<double> dots(uint32_t width) {
  const uint32_t drawn = std::min(width, kMostDots);
  const double step = (kNetHigh - kNetLow) / kMostDots;
  std::vector<double> places;
  for (uint32_t i = 0; i < drawn; ++i) {
    // A gap where not all are drawn.
    const double gap = width > drawn ? (i < drawn / 2 ? 0.4 : -0.4) : 0;
    places.push_back((kNetLow + kNetHigh) / 2 + ((drawn - 1) / 2.0 - i + gap) * step);
  }
  return places;
}

/// The layers as columns of dots, all joined with all of the next.
void network(PlotPanel& sheet, const lump::Stage& stage, double from, double to) {
  const double left = from + kNamesLeft, right = to - kNamesRight;
  std::vector<std::vector<double>> columns, nodes(2), links(2);
  const auto add = [](std::vector<std::vector<double>>& block, double x, double y) {
    block[0].push_back(x);
    block[1].push_back(y);
  };
  for (const uint32_t width : stage.widths) columns.push_back(dots(width));
  // Inputs have names: all of them are drawn.
  const bool named = stage.inputs.size() == stage.widths.front();
  if (named) {
    columns.front().clear();
    for (size_t i = 0; i < stage.inputs.size(); ++i)
      columns.front().push_back(kNetHigh -
                                (kNetHigh - kNetLow) * static_cast<double>(i) /
                                    static_cast<double>(std::max<size_t>(1, stage.inputs.size() - 1)));
  }
  const double step = (right - left) / static_cast<double>(std::max<size_t>(1, columns.size() - 1));
  for (size_t c = 0; c < columns.size(); ++c) {
    const double x = left + step * static_cast<double>(c);
    for (const double y : columns[c]) {
      add(nodes, x, y);
      for (const double next : c + 1 < columns.size() ? columns[c + 1] : std::vector<double>()) {
        add(links, x, y);
        add(links, x + step, next);
        add(links, kPlotAuto, kPlotAuto);
      }
    }
    const bool hidden = c > 0 && c + 1 < columns.size();
    label(sheet,
          std::to_string(stage.widths[c]) + (hidden   ? " tanh"
                                             : c == 0 ? " in"
                                                      : " out"),
          x, kNetLow - 2, "center");
    if (stage.widths[c] > columns[c].size()) label(sheet, "...", x, (kNetLow + kNetHigh) / 2, "center");
  }
  const double middle = (kNetLow + kNetHigh) / 2;
  const auto beside = [&](const std::vector<std::string>& texts, double at_x, const char* place,
                          size_t letters) {
    std::vector<std::string> lines;
    for (const std::string& text : texts)
      for (std::string& line : wrapped(text, letters)) lines.push_back(std::move(line));
    double y = middle + 0.8 * static_cast<double>(lines.size());
    for (const std::string& line : lines) {
      label(sheet, line, at_x, y, place);
      y -= 1.7;
    }
  };
  for (size_t i = 0; named && i < stage.inputs.size(); ++i)
    label(sheet, stage.inputs[i], left - 1.2, columns.front()[i], "right");
  if (!named) beside(stage.inputs, left - 1.2, "right", 28);
  beside(stage.outputs, right + 1.2, "left", 21);
  label(sheet,
        stage.name + (stage.copies > 1 ? ": the mean of " + std::to_string(stage.copies) + " networks" : ""),
        (left + right) / 2, kNetHigh + 2.2, "center", 11);
  sheet.add("", links[0], links[1], kPlotGray).width = 0.2;
  sheet.add("", nodes[0], nodes[1], 0, PlotCurve::Style::Points).size = 0.8;
}

}  // namespace

Plot network_figure(const std::vector<lump::Stage>& stages, const std::string& made_from) {
  PlotPanel sheet{.x_range = {{0, kWide}}, .y_range = {{0, kHigh}}, .bare = true};
  std::vector<const lump::Stage*> row, networks;
  for (const lump::Stage& stage : stages)
    (stage.kind == lump::Stage::Kind::Network ? networks : row).push_back(&stage);
  const double gap = 2.6, width = (kWide - 4 - gap * static_cast<double>(row.size() - 1)) /
                                  static_cast<double>(std::max<size_t>(1, row.size()));
  double search = kWide / 2;
  for (size_t i = 0; i < row.size(); ++i) {
    const double left = 2 + (width + gap) * static_cast<double>(i);
    box(sheet, *row[i], left, left + width);
    if (i > 0) arrow(sheet, left - gap, (kBoxLow + kBoxHigh) / 2, left, (kBoxLow + kBoxHigh) / 2);
    if (row[i]->kind == lump::Stage::Kind::Search) search = left + width / 2;
  }
  label(sheet, "the inverse way: from a reading to the lump", 2, kBoxHigh + 1.6, "left", 12);
  label(sheet, "the forward way: finite elements at large strain, and networks taught by them", 2,
        kTopHigh + 2, "left", 12);
  rectangle(sheet, 2, kWide - 2, kTopLow, kTopHigh, 2);
  double y = kTopHigh - 1.5;
  for (const std::string& line : wrapped("taught by presses of known lumps: " + made_from, 190)) {
    label(sheet, line, 3, y, "left");
    y -= 1.7;
  }
  const double fraction = kWide / static_cast<double>(std::max<size_t>(1, networks.size()));
  for (size_t n = 0; n < networks.size(); ++n) {
    const double from = fraction * static_cast<double>(n),
                 middle = from + (fraction + kNamesLeft - kNamesRight) / 2;
    network(sheet, *networks[n], from, from + fraction);
    arrow(sheet, middle, kTopLow, middle, kNetHigh + 3.6);
    arrow(sheet, middle, kNetLow - 3.4, search + (n == 0 ? -3 : 3), kBoxHigh);
  }
  return {.panels = {sheet}, .width_px = 1280, .height_px = 760};
}

}  // namespace palpate
