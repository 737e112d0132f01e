#include "capture/run/process/files_for_others.h"

namespace palpate {

void add_log(const AlignedLog& log, FilesForOthers& files, int64_t begun_ns, const std::string& root) {
  NumberTable table{log.table.name, describe(log.clock), log.time_s, {}};
  for (const LogColumn& column : log.table.columns)
    table.columns.push_back({column.name, column.unit, column.values});
  if (files.mcap) files.mcap->add(table, begun_ns, root);
  if (files.episode) files.episode->add(table, root);
}

}  // namespace palpate
