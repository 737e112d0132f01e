#include "viz/as_recorded.h"

#include <sstream>

#include "capture/measurements.h"

namespace palpate {
namespace {

std::string column_and_values(const std::string& recorded, const std::string& now) {
  std::istringstream names(Measurements::cell_names()), was(recorded), is(now);
  std::string name, a, b;
  while (std::getline(names, name, ',')) {
    a.clear(), b.clear();
    std::getline(was, a, ',');
    std::getline(is, b, ',');
    if (a != b) return name.append(" was '").append(a).append("', is '").append(b).append("'");
  }
  return "another number of columns";
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

void RecordedCheck::add(const Session& session, const Touch& touch) {
  const std::optional<std::string> recorded = session.recorded(touch.sequence);
  const std::string now = Measurements::cells(touch, session.info().outputs);
  if (recorded == now) {
    ++equal;
    return;
  }
  if (++different == 1)
    first_difference =
        "frame " + std::to_string(touch.sequence) + ": " + column_and_values(recorded.value_or(""), now);
}

}  // namespace palpate
