// palpate-lab compile: what Mesa's compiler for Radeon GPUs makes of each kernel, without such a GPU.
#include "capture/files/output_file.h"
#include "perf/lab/commands/commands.h"
#include "perf/lab/kernels/compiled.h"
#include "perf/profile/report/tables.h"
#include "viz/commands/support/options.h"

namespace palpate {
namespace {

/// No device is measured, nor needed.
Report compile(const Common& common, const std::vector<std::string>& names) {
  std::map<std::string, std::vector<perf::CompiledKernel>> families;
  Report report;
  for (const std::string& family : names) {
    families[family] = perf::compile_for(family);
    report.text += perf::to_text(perf::table_of(family, families[family])) + "\n";
  }
  report.json = perf::to_json(families);
  if (!common.out.empty()) {
    make_output_folder(common.out);
    write_whole(common.out / "compiled.csv", std::string_view(perf::to_csv(families)));
    report.text += "written: " + (common.out / "compiled.csv").string() + "\n";
  }
  return report;
}

}  // namespace

void add_compile(CommandLine& program, Common& common, Command& chosen) {
  CommandLine* command = program.add_subcommand(
      "compile", "Compile each kernel for Radeon GPUs, without having one: registers, spills, latency");
  auto families = std::make_shared<std::vector<std::string>>();
  command->add_option("FAMILY", *families, "navi21, gfx1100, vega10, polaris10, or another that Mesa knows")
      ->required();
  command->add_option("--out", common.out, "Folder for compiled.csv");
  add_common(*command, common,
             "  palpate-lab compile gfx1100\n"
             "  palpate-lab compile navi21 vega10 --out out/compiled\n");
  command->runs(chosen, [&common, families] { return compile(common, *families); });
}

}  // namespace palpate
