#include "perf/lab/dataset/dataset_report.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>

#include "engine/base/json.h"
#include "engine/base/text.h"
#include "perf/lab/dataset/file.h"
#include "perf/lab/dataset/journal.h"

namespace palpate::lump {
namespace {

using Json = json::Value;

std::string duration(double s) {
  const auto whole = static_cast<long long>(std::llround(s));
  if (whole < 60) return palpate::text("%lld s", whole);
  if (whole < 3600) return palpate::text("%lld min %lld s", whole / 60, whole % 60);
  if (whole < 86400) return palpate::text("%lld h %lld min", whole / 3600, whole % 3600 / 60);
  return palpate::text("%lld d %lld h", whole / 86400, whole % 86400 / 3600);
}

struct Extent {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  void add(double value) {
    if (std::isnan(value)) return;
    low = std::min(low, value);
    high = std::max(high, value);
  }
  bool any() const { return low <= high; }
};

std::string shapes_of(const Sweep& sweep) {
  std::string text;
  for (const InclusionShape shape : sweep.shapes)
    text += (text.empty() ? "" : ", ") + std::string(to_string(shape));
  return text;
}

std::string sweep_text(const Sweep& s) {
  const auto grid = [](const std::array<uint32_t, 3>& c) {
    return palpate::text("%u x %u x %u", c[0], c[1], c[2]);
  };
  return "sweep           seed " + std::to_string(s.seed) + ", " + grid(s.cells) +
         (s.two_grids() ? " and " + grid(s.coarser_cells) : "") +
         palpate::text(" cells%s, maps of %u x %u nodes, %u loads to %.3g to %.3g %% of the thickness\n",
                       s.follows_lumps() ? " that follow the lump" : "", s.nodes[0], s.nodes[1], s.loads,
                       100 * s.greatest_press.low, 100 * s.greatest_press.high) +
         "                " + shapes_of(s) +
         palpate::text("; %.3g %% without a lump, %.3g %% of the lumps in the middle\n",
                       100 * s.no_lump_fraction, 100 * s.centred_fraction) +
         (s.has_skin()
              ? palpate::text("                under a skin of %.3g to %.3g mm, %.3g to %.3g times as "
                              "stiff as the tissue\n",
                              s.skin_mm.low, s.skin_mm.high, s.skin_ratio.low, s.skin_ratio.high)
              : std::string()) +
         (s.plate_slides() ? std::string()
          : s.plate_sticks
              ? std::string("                under a plate that sticks to the tissue\n")
              : palpate::text("                under a plate with a friction of %.3g\n", s.plate_friction));
}

}  // namespace

std::string progress_text(const DatasetProgress& p) {
  std::string text = palpate::text("%u of %u cases", p.done, p.cases);
  if (p.done_now > 0 && p.wall_s > 0) {
    const double rate = p.done_now / p.wall_s;
    text += palpate::text(", %.1f a minute", 60 * rate);
    if (p.done < p.cases) text += ", " + duration((p.cases - p.done) / rate) + " left";
  }
  if (p.not_converged > 0) text += palpate::text(", %u not converged", p.not_converged);
  return text;
}

std::string dataset_text(const DatasetJob& job, const DatasetReport& r) {
  const DatasetProgress& p = r.progress;
  std::string text = progress_text(p);
  if (p.done_now > 0)
    text += palpate::text("; %u of them now, in %s, by %u process%s with %u thread%s", p.done_now,
                          duration(p.wall_s).c_str(), r.processes, r.processes == 1 ? "" : "es", r.threads,
                          r.threads == 1 ? "" : "s");
  text += "\n";
  if (r.damaged > 0)
    text += palpate::text("done again: %zu cases that were found damaged in the journal\n", r.damaged);
  if (r.written) text += "written: " + job.file.string() + "\n";
  if (r.complete && !r.written) text += job.file.string() + " is complete already\n";
  if (!r.complete)
    text += "what is done is kept in " + lump_journal_of(job.file).string() +
            "; the same command goes on from there\n";
  return text;
}

json::Value dataset_json(const DatasetJob& job, const DatasetReport& r) {
  return Json{{"file", job.file.string()},
              {"complete", r.complete},
              {"written", r.written},
              {"cases", r.progress.cases},
              {"done", r.progress.done},
              {"done_now", r.progress.done_now},
              {"not_converged", r.progress.not_converged},
              {"damaged_and_done_again", r.damaged},
              {"processes", r.processes},
              {"threads_each", r.threads},
              {"wall_s", r.progress.wall_s},
              {"busy_s", r.busy_s},
              {"sweep", to_json(job.sweep)}};
}

Facts dataset_info(const std::filesystem::path& file) {
  std::error_code error;
  const std::filesystem::path journal = lump_journal_of(file);
  const bool being_made = std::filesystem::exists(journal, error);
  if (being_made && !std::filesystem::exists(file, error)) {
    const Journal::Glance glance = Journal::glance(journal);
    return {palpate::text("being made      %zu cases done by %s\n", glance.cases, glance.program.c_str()) +
                sweep_text(glance.sweep),
            Json{{"complete", false},
                 {"program", glance.program},
                 {"done", glance.cases},
                 {"sweep", to_json(glance.sweep)}}};
  }

  const Data data = read_lump_file(file);
  std::array<size_t, 3> states{};
  std::array<size_t, 5> shapes{};  // the last: no lump
  struct Row {
    const char *name, *unit;
    Extent extent = {};
  };
  std::array<Row, 10> rows{{{"diameter_mm", "mm"},
                            {"depth_mm", "mm"},
                            {"stiffness_ratio", ""},
                            {"offset_mm", "mm"},
                            {"thickness_mm", "mm"},
                            {"young_Pa", "Pa"},
                            {"press_mm", "mm"},
                            {"force_N", "N"},
                            {"pressure_Pa", "Pa"},
                            {"least_volume_ratio", ""}}};
  for (const Sample& sample : data.samples) {
    ++states[static_cast<size_t>(sample.state)];
    ++shapes[sample.what.lump ? static_cast<size_t>(sample.what.lump->shape) : 4];
    if (sample.what.lump) {
      rows[0].extent.add(sample.what.lump->diameter_mm);
      rows[1].extent.add(sample.what.lump->depth_mm);
      rows[2].extent.add(sample.what.lump->stiffness_ratio);
      for (const double offset : sample.what.lump->offset_mm) rows[3].extent.add(offset);
    }
    rows[4].extent.add(sample.what.thickness_mm);
    rows[5].extent.add(sample.what.young_Pa);
    for (const double press : sample.what.press_mm) rows[6].extent.add(press);
    for (const double force : sample.force_N) rows[7].extent.add(force);
    for (const PressureMap& map : sample.pressure_Pa)
      for (const float pressure : map.values) rows[8].extent.add(double{pressure});
    for (const double ratio : sample.least_volume_ratio) rows[9].extent.add(ratio);
  }

  const size_t n = data.samples.size();
  std::string text =
      palpate::text(
          "data set        %zu cases from number %u on, by %s: %zu good, %zu not converged, %zu not done\n",
          n, data.first, data.program.c_str(), states[1], states[2], states[0]) +
      sweep_text(data.sweep);
  text += palpate::text(
      "lumps           %zu spheres, %zu ellipsoids, %zu upright and %zu lying cylinders, %zu without\n",
      shapes[0], shapes[1], shapes[2], shapes[3], shapes[4]);
  Json ranges;
  for (const Row& row : rows) {
    if (!row.extent.any()) continue;
    text += palpate::text("%-22s %.4g to %.4g %s\n", row.name, row.extent.low, row.extent.high, row.unit);
    ranges[row.name] = {row.extent.low, row.extent.high};
  }
  if (being_made) text += "more cases of it are being made, or were: " + journal.string() + "\n";
  Json value = {{"complete", states[0] == 0 && !being_made},
                {"program", data.program},
                {"first", data.first},
                {"cases", n},
                {"good", states[1]},
                {"not_converged", states[2]},
                {"not_done", states[0]}};
  for (size_t s = 0; s < 4; ++s) value["shapes"][to_string(static_cast<InclusionShape>(s))] = shapes[s];
  value["no_lump"] = shapes[4];
  value["ranges"] = ranges;
  value["sweep"] = to_json(data.sweep);
  return {text, value};
}

}  // namespace palpate::lump
