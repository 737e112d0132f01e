// palpate-lab compile on the command line.
#include "tests/lab/lab_program.h"

namespace palpate {
namespace {

using CompileCommand = LabProgram;

// Mesa's Radeon driver compiles for hardware that is not there.
TEST_F(CompileCommand, CompilesKernelsForARadeon) {
  if (!fs::exists("/usr/share/vulkan/icd.d/radeon_icd.x86_64.json"))
    GTEST_SKIP() << "*** KERNELS NOT COMPILED FOR A GPU: Mesa's Radeon driver is not installed "
                    "(mesa-vulkan-drivers) ***";
  const Ended ended = run({"compile", "vega10", "--out", folder_ / "out"});
  ASSERT_EQ(ended.exit_code, 0) << ended.err;
  EXPECT_TRUE(contains(ended.out, "Kernels compiled for vega10"));
  const Table table(slurp(folder_ / "out" / "compiled.csv"));
  table.expect_whole();
  EXPECT_GT(table.rows.size(), 100u);
  size_t contacts = 0;
  for (size_t row = 0; row < table.rows.size(); ++row) {
    EXPECT_EQ(table.at(row, "family"), "vega10");
    const double registers = std::stod(table.at(row, "VGPRs"));
    EXPECT_TRUE(registers > 0 && registers <= 256) << table.at(row, "kernel");
    EXPECT_GT(std::stod(table.at(row, "instructions")), 10) << table.at(row, "kernel");
    contacts += table.at(row, "kernel") == "contact_tile_color";
  }
  EXPECT_GE(contacts, 1u);
  expect_refusal({"compile", "voodoo2"}, 5, {"voodoo2", "navi21"});
}

}  // namespace
}  // namespace palpate
