#include "perf/profile/report/report.h"

#include <algorithm>

#include "perf/profile/report/answers.h"
#include "perf/profile/report/tables.h"
#include "viz/report/html.h"

namespace palpate::perf {
namespace {

std::string heading(const std::string& text) {
  return "<h2>" + html_escaped(text) + "</h2>\n";
}
std::string paragraph(const std::string& text, const char* kind = "") {
  return std::string("<p") + kind + ">" + html_escaped(text) + "</p>\n";
}
constexpr const char* kWarning = " class=\"warning\"";

bool is_number(const std::string& cell) {
  return !cell.empty() && (cell[0] == '-' || (cell[0] >= '0' && cell[0] <= '9')) &&
         cell.find(" x ") == std::string::npos;
}

std::string html_table(const Table& table) {
  std::vector<bool> numeric;
  for (size_t i = 0; i < table.columns.size(); ++i) {
    numeric.push_back(std::all_of(table.rows.begin(), table.rows.end(),
                                  [&](const auto& row) { return is_number(row[i]); }));
  }
  std::string text = "<table>\n";
  const auto add = [&](const std::vector<std::string>& cells, const std::string& tag) {
    text += "<tr>";
    for (size_t i = 0; i < cells.size(); ++i)
      text.append("<")
          .append(tag)
          .append(numeric[i] ? " class=\"number\">" : ">")
          .append(html_escaped(cells[i]))
          .append("</")
          .append(tag)
          .append(">");
    text += "</tr>\n";
  };
  add(table.columns, "th");
  for (const auto& row : table.rows) add(row, "td");
  return text + "</table>\n";
}

std::string section(const Table& table) {
  return heading(table.title) + (table.note.empty() ? "" : paragraph(table.note)) + html_table(table);
}

std::string figures_html(const std::vector<DrawnPlot>& plots) {
  std::string text;
  for (const DrawnPlot& drawn : plots) {
    if (drawn.svg.empty()) continue;
    text += "<figure>\n" + svg_element(drawn.svg) + "\n<figcaption>" + html_escaped(drawn.plot.caption) +
            "</figcaption>\n</figure>\n";
  }
  return text.empty()
             ? paragraph("No plots: gnuplot was not there. The tables below hold all figures.", kWarning)
             : text;
}

Table machine_table(const Machine& m) {
  return {"Machine",
          "",
          {"", ""},
          {{"device", m.device + " (" + m.device_type + ", " + bytes_text(m.device_memory_bytes) + ")"},
           {"driver", m.driver + ", Vulkan " + m.vulkan},
           {"CPU", m.cpu + ", " + std::to_string(m.cpu_threads) + " threads, " + bytes_text(m.memory_bytes)},
           {"system", m.system},
           {"palpate", m.palpate + ", " + m.compiler},
           {"libraries", m.libraries},
           {"date", m.date_utc}}};
}

std::string clock_text(const Ceiling& c) {
  if (c.clock == "GPU") {
    return "Stages are timed by the GPU's timestamps: on a large copy they agree with the host's clock "
           "(ratio " +
           figure(c.clock_ratio) + ").";
  }
  return "The GPU's timestamps are not trusted: on a large copy they give " + figure(c.clock_ratio) +
         " of the host's time. Stages are submitted one by one and timed by the host, each with the " +
         figure(c.submit_ms) + " ms that a submission costs.";
}

}  // namespace

std::string html_report(const Profile& profile, const std::vector<DrawnPlot>& plots) {
  std::string body = "<h1>palpate profile: " + html_escaped(profile.machine.device) + "</h1>\n";
  body += "<p><strong>" + html_escaped(headline(profile)) + "</strong></p>\n";
  if (!profile.complete)
    body += paragraph("This run was ended before it was complete; what it had finished is here.", kWarning);
  body += html_table(machine_table(profile.machine));
  body += heading("Method");
  body += paragraph(
      "Totals are measured without GPU timers, stages with them, since timers cost a tenth of a frame on "
      "some drivers. After one uncounted run "
      "each way of doing a thing runs in turn with the others (A B C A B C ...), so that a machine that "
      "drifts drifts for all. "
      "CPU time is that of the process, all threads, a driver that computes on the CPU included. Medians and "
      "quartiles are of single runs.");
  body += paragraph(clock_text(profile.ceiling));
  body +=
      paragraph("Time budget " + figure(profile.budget_s) + " s, used " + figure(profile.elapsed_s) + " s.");
  body += heading("Pictures");
  std::string few;
  for (const std::string& reading : readings_of(profile))
    if (!has_curves(profile.sizes, reading)) few += (few.empty() ? "" : ", ") + reading;
  if (!few.empty())
    body += paragraph("A curve over the size of frames takes three sizes; the tables have those of: " + few +
                      ".");
  body += figures_html(plots);
  for (const Table& table : tables_of(profile)) body += section(table);
  return html_page("palpate profile: " + profile.machine.device, body);
}

std::string html_report(const MachineComparison& comparison, const std::vector<DrawnPlot>& plots) {
  std::string body = "<h1>palpate profile: machines side by side</h1>\n<p>";
  for (const std::string& name : comparison.names) body += html_escaped(name) + "<br>";
  body += "</p>\n";
  for (const std::string& note : comparison.notes) body += paragraph(note, kWarning);
  for (size_t i = 1; i < comparison.frames.size(); ++i)
    if (comparison.frames[i].ratio) body += paragraph(frame_sentence(comparison, i));
  body += figures_html(plots);
  for (const Table& table : tables_of(comparison)) body += section(table);
  return html_page("palpate profile: machines side by side", body);
}

}  // namespace palpate::perf
