// palpate lump: size, depth and stiffness of a lump hidden in tissue.
#include "viz/commands/lump/lump.h"
#include "viz/commands/support/options.h"

namespace palpate {

void add_lump(CommandLine& program, Common& common, Command& chosen) {
  CommandLine* group = program.add_subcommand("lump", "Size, depth and stiffness of a lump hidden in tissue");
  group->require_subcommand(1);
  group->footer(
      "Examples:\n"
      "  palpate lump scan --simulate --out out/scan\n"
      "  palpate lump estimate a.npy b.npy --force-N 1,2 --young-Pa 4000\n"
      "  palpate lump compare out/may out/june --out out/compared\n"
      "  palpate lump limit --force-N 1,2 --young-Pa 4000 --noise-Pa 20\n"
      "  palpate help lump scan\n");
  add_lump_estimate(*group, common, chosen);
  add_lump_scan(*group, common, chosen);
  add_lump_compare(*group, common, chosen);
  add_lump_limit(*group, common, chosen);
}

}  // namespace palpate
