#include "capture/run/process/verify_recording.h"

#include <algorithm>
#include <vector>

#include "capture/files/measurements.h"
#include "capture/files/tables/csv_table.h"
#include "engine/base/text.h"

namespace palpate {
namespace {

/// Columns that no table of separate pictures has. Earlier versions wrote zeros into these cells.
const std::vector<std::string>& followed_names() {
  using C = MeasuredColumns;
  static const std::vector<std::string> names = csv_cells(
      Measurements::header({C::Shear | C::Slipping | C::ShiftMillimetres | C::ShiftPixels | C::Skin}));
  return names;
}

}  // namespace

bool MeasuredFrames::next(Frame& frame) {
  while (session_.next(frame)) {
    gap_ = gap_ || frame.after_gap;
    if (!session_.recorded(frame.sequence)) continue;
    frame.after_gap = gap_;
    gap_ = false;
    return true;
  }
  return false;
}

// Columns by their names: a session that was recorded before there were others is compared in those it has.
void RecordedCheck::add(const Session& session, const Touch& touch) {
  const std::vector<std::string> names = csv_cells(session.recorded_names()),
                                 was = csv_cells(session.recorded(touch.sequence).value_or("")),
                                 today = csv_cells(Measurements::cell_names()),
                                 is = csv_cells(Measurements::cells(touch, session.info().outputs));
  const auto cell = [](const std::vector<std::string>& cells, size_t i) {
    return i < cells.size() ? cells[i] : std::string();
  };
  for (size_t i = 0; i < names.size(); ++i) {
    const auto there = std::ranges::find(today, names[i]);
    if (there == today.end()) continue;
    if (session.info().separate && std::ranges::find(followed_names(), names[i]) != followed_names().end())
      continue;
    const std::string recorded = cell(was, i), now = cell(is, static_cast<size_t>(there - today.begin()));
    if (recorded == now) continue;
    if (++different == 1)
      first_difference =
          text("frame %llu: %s was '%s', is '%s'", static_cast<unsigned long long>(touch.sequence),
               names[i].c_str(), recorded.c_str(), now.c_str());
    return;
  }
  ++equal;
}

}  // namespace palpate
