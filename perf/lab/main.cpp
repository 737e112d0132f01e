// The program palpate-lab: the laboratory.
#include "perf/lab/commands/commands.h"
#include "viz/commands/support/program.h"

// NOLINTNEXTLINE(bugprone-exception-escape): what reporting an error throws may end the program
int main(int argc, char** argv) {
  using namespace palpate;
  const Program program{
      .name = "palpate-lab",
      .about = "the laboratory of palpate: models, data sets, training, studies and benchmarks.",
      .examples =
          "  palpate-lab forward --size-mm 12 --out out/lump       what a lump in tissue shows on the "
          "surface\n"
          "  palpate-lab dataset train.h5 --count 1200             presses of many lumps, with their truth\n"
          "  palpate-lab train train.h5 --out my.lump              a network for palpate lump estimate\n"
          "  palpate-lab evaluate lump held_out.h5 --network my.lump   do its intervals hold the truth?\n"
          "  palpate-lab help COMMAND                              options and examples of one command\n",
      .commands = {add_forward, add_dataset, add_info, add_train, add_evaluate, add_stability, add_figures,
                   add_bench, add_goals, add_tune, add_compile}};
  return run_program(program, argc, argv);
}
