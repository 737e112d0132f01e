// The program palpate: the instrument.
#include "viz/commands/command.h"
#include "viz/commands/support/program.h"
#include "viz/render/desktop.h"

namespace {

using namespace palpate;

/// Commands that palpate-lab has now (perf/lab).
constexpr MovedCommand kMoved[] = {
    {"lump dataset", "palpate-lab dataset"},
    {"lump info", "palpate-lab info"},
    {"lump train", "palpate-lab train"},
    {"lump evaluate", "palpate-lab evaluate lump"},
    {"lump figures", "palpate-lab figures"},
    {"lump stability", "palpate-lab stability"},
    {"evaluate table", "palpate-lab evaluate table"},
    {"evaluate match", "palpate-lab evaluate match"},
    {"evaluate modulus", "palpate-lab evaluate modulus"},
    {"evaluate force", "palpate-lab evaluate force"},
    {"evaluate", "palpate-lab evaluate"},
    {"forward sweep", "palpate-lab forward sweep"},
    {"forward convergence", "palpate-lab forward convergence"},
    {"forward", "palpate-lab forward"},
    {"profile --compile", "palpate-lab compile"},
    {"tune", "palpate-lab tune"},
};

/// Without a command there is the list of sources, where it can be shown.
std::string no_list_of_sources() {
  if (viz::display_available()) return {};
  return "no command was given, and the list of sources needs a window: " + viz::desktop_message() +
         "; try: palpate --help, or palpate demo --headless";
}

}  // namespace

// NOLINTNEXTLINE(bugprone-exception-escape): what reporting an error throws may end the program
int main(int argc, char** argv) {
  const Program program{
      .name = "palpate",
      .about = "a camera behind a silicone pad as a calibrated touch instrument.",
      .examples =
          "  palpate                               a window with what there is to open: cameras, recordings\n"
          "  palpate demo --out out/demo           measure a simulated palpation, compare with the truth\n"
          "  palpate live                          a simulated palpation, live in a window\n"
          "  palpate record --camera /dev/video0 --sensor my_sensor.json --out out/press\n"
          "  palpate process out/press --out out/measured\n"
          "  palpate help COMMAND                  options and examples of one command\n",
      .commands = {add_live,    add_serve,   add_record,   add_replay,    add_compare,
                   add_process, add_export,  add_simulate, add_integrate, add_devices,
                   add_cameras, add_demo,    add_setup,    add_check,     add_calibrate,
                   add_gallery, add_profile, add_optics,   add_strain,    add_contact,
                   add_wrench,  add_modulus, add_lump,     add_match,     add_map},
      .start = start_command,
      .no_start = no_list_of_sources,
      .moved = kMoved};
  return run_program(program, argc, argv);
}
