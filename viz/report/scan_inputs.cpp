// What a report says of where a scan comes from.
#include <ctime>
#include <utility>

#include "engine/base/text.h"
#include "engine/lump/network/network.h"
#include "viz/report/scan_report.h"

namespace palpate {
namespace {

std::string now_utc() {
  const std::time_t now = std::time(nullptr);
  std::tm utc{};
  gmtime_r(&now, &utc);
  char line[32];
  std::strftime(line, sizeof line, "%Y-%m-%dT%H:%M:%SZ", &utc);
  return line;
}

}  // namespace

ScanReport::ScanReport() : made(now_utc()) {}

void ScanReport::take_hand(HandAnswer found) {
  answer = std::move(found.scan);
  hand = std::move(found.rows);
}

void ScanReport::add_block(const std::array<double, 3>& block_mm, double young_Pa) {
  inputs.emplace_back("block", text("%g x %g x %g mm", block_mm[0], block_mm[1], block_mm[2]));
  inputs.emplace_back("tissue", text("Young's modulus %g Pa", young_Pa));
}

void ScanReport::add_errors(const lump::ErrorSources& errors) {
  inputs.emplace_back("errors covered by the intervals",
                      text("modulus %g %%, thickness %g %%, pitch %g %%, light, place", 100 * errors.young,
                           100 * errors.thickness, 100 * errors.pitch));
}

ScanReport report_of(const SeenScan& scan, const std::string& input) {
  ScanReport report;
  report.add_block(scan.reading.block_mm, scan.reading.young_Pa);
  report.inputs.emplace_back("presses by hand", input);
  report.model = "refined: " + lump::load_network("")->made_from();
  report.add_errors({});
  if (scan.answer) report.take_hand(*scan.answer);
  return report;
}

}  // namespace palpate
