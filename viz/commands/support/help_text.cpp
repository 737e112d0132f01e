#include "viz/commands/support/help_text.h"

#include <algorithm>
#include <sstream>

namespace palpate {
namespace {

constexpr size_t kIndent = 2, kMostName = 26;

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

/// Words in lines of at most kHelpColumns: the first begins at column `used`, the others at `indent`.
std::string wrapped(const std::string& text, size_t used, size_t indent) {
  std::istringstream words(text);
  std::string lines;
  size_t column = used;
  for (std::string word; words >> word;) {
    const bool first = lines.empty();
    if (!first && column + 1 + word.size() > kHelpColumns) {
      lines += "\n" + std::string(indent, ' ') + word;
      column = indent + word.size();
    } else {
      lines += (first ? "" : " ") + word;
      column += word.size() + (first ? 0 : 1);
    }
  }
  return lines;
}

/// The part of a text that fits, up to the last of its own breaks outside parentheses.
std::string beginning(const std::string& text, size_t width) {
  if (text.size() <= width) return text;
  const std::string dots = " ...";
  size_t end = 0;
  int open = 0;
  for (size_t i = 0; i + 1 < text.size() && i + dots.size() <= width; ++i) {
    const bool breaks = (text[i + 1] == ' ' && std::string(";:,.").find(text[i]) != std::string::npos) ||
                        (text[i] == ' ' && text[i + 1] == '(');
    if (breaks && open == 0) end = i;
    open += text[i] == '(';
    open -= text[i] == ')';
  }
  constexpr size_t kLeast = 12;
  return text.substr(0, end >= kLeast ? end : text.rfind(' ', width - dots.size())) + dots;
}

size_t name_width(const std::vector<HelpOption>& options) {
  size_t width = 0;
  for (const HelpOption& one : options)
    if (one.names.size() <= kMostName) width = std::max(width, one.names.size());
  return width;
}

std::string padded(const std::string& names, size_t width) {
  return std::string(kIndent, ' ') + names +
         std::string(names.size() < width ? width - names.size() + 2 : 2, ' ');
}

std::string one_line(const HelpOption& option, size_t width) {
  const std::string names = padded(option.names, width);
  return names + beginning(option.about, kHelpColumns - names.size()) + "\n";
}

std::string many_lines(const HelpOption& option, size_t width) {
  const size_t indent = kIndent + width + 2;
  const std::string names = padded(option.names, width);
  const bool long_names = names.size() > indent;
  return names + (long_names ? "\n" + std::string(indent, ' ') : "") + wrapped(option.about, indent, indent) +
         "\n";
}

std::string head(const Help& help) {
  const std::string usage = "Usage: ";
  return wrapped(help.command + ": " + help.about, 0, 0) + "\n\n" + usage +
         wrapped(help.command + help.usage, usage.size(), usage.size() + 2) + "\n";
}

}  // namespace

std::string short_help(const Help& help) {
  std::vector<HelpOption> main = help.positional;
  std::string groups;
  for (const HelpGroup& group : help.groups) {
    if (group.name.empty()) {
      main.insert(main.end(), group.options.begin(), group.options.end());
      continue;
    }
    std::string names = group.name + ":";
    for (const HelpOption& option : group.options)
      names += " " + option.names.substr(0, option.names.find(' '));
    groups += wrapped(names, 0, kIndent) + "\n";
  }
  std::vector<std::string> lines;
  for (const HelpOption& option : help.commands) lines.push_back(one_line(option, name_width(help.commands)));
  for (const HelpOption& option : main) lines.push_back(one_line(option, name_width(main)));
  const std::string first = head(help),
                    last = "Everything, with notes and exit codes: " + help.command + " --help-all\n";
  const auto count = [](const std::string& text) {
    return static_cast<size_t>(std::count(text.begin(), text.end(), '\n'));
  };
  std::vector<std::string> examples = lines_of(help.examples);
  size_t room =
      kHelpLines - std::min(kHelpLines, count(first) + lines.size() + count(groups) + count(last) + 1);
  // A command's own first example is there however many options it has.
  examples.resize(std::min(examples.size(), std::max<size_t>(room, 1)));
  room -= std::min(room, examples.size());
  // Columns that are left go to the texts that were cut, the shortest first.
  for (size_t extra = 1; extra <= room; ++extra)
    for (size_t i = 0; i < lines.size(); ++i) {
      const bool command = i < help.commands.size();
      const std::vector<HelpOption>& options = command ? help.commands : main;
      const std::string all =
          many_lines(options[command ? i : i - help.commands.size()], name_width(options));
      if (count(lines[i]) != 1 || count(all) != 1 + extra || extra > room) continue;
      lines[i] = all;
      room -= extra;
    }
  std::string text = first;
  for (const std::string& line : lines) text += line;
  text += groups;
  if (!examples.empty()) text += "Examples:\n";
  for (const std::string& example : examples) text += example + "\n";
  return text + last;
}

std::string whole_help(const Help& help) {
  std::string text = head(help);
  const auto add = [&text](const std::string& name, const std::vector<HelpOption>& options) {
    if (options.empty()) return;
    text += "\n" + name + ":\n";
    for (const HelpOption& option : options) text += many_lines(option, name_width(options));
  };
  add("Commands", help.commands);
  add("Arguments", help.positional);
  for (const HelpGroup& group : help.groups) add(group.name.empty() ? "Options" : group.name, group.options);
  if (!help.examples.empty()) text += "\nExamples:\n" + help.examples;
  if (!help.notes.empty()) text += "\n" + help.notes;
  return text;
}

}  // namespace palpate
