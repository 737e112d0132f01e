// Commands of the program palpate: the function that adds each.
#pragma once

#include "viz/commands/support/common.h"

namespace palpate {

/// Each adds one command to the program; `chosen` is what to run once the command line is parsed.
void add_devices(CommandLine& program, Common& common, Command& chosen);
void add_cameras(CommandLine& program, Common& common, Command& chosen);
void add_process(CommandLine& program, Common& common, Command& chosen);
void add_export(CommandLine& program, Common& common, Command& chosen);
void add_simulate(CommandLine& program, Common& common, Command& chosen);
void add_integrate(CommandLine& program, Common& common, Command& chosen);
void add_live(CommandLine& program, Common& common, Command& chosen);
void add_serve(CommandLine& program, Common& common, Command& chosen);
void add_record(CommandLine& program, Common& common, Command& chosen);
void add_replay(CommandLine& program, Common& common, Command& chosen);
void add_compare(CommandLine& program, Common& common, Command& chosen);
void add_demo(CommandLine& program, Common& common, Command& chosen);
void add_calibrate(CommandLine& program, Common& common, Command& chosen);
void add_setup(CommandLine& program, Common& common, Command& chosen);
void add_check(CommandLine& program, Common& common, Command& chosen);
void add_gallery(CommandLine& program, Common& common, Command& chosen);
void add_profile(CommandLine& program, Common& common, Command& chosen);
void add_optics(CommandLine& program, Common& common, Command& chosen);
void add_lump(CommandLine& program, Common& common, Command& chosen);
void add_contact(CommandLine& program, Common& common, Command& chosen);
void add_strain(CommandLine& program, Common& common, Command& chosen);
void add_match(CommandLine& program, Common& common, Command& chosen);
void add_wrench(CommandLine& program, Common& common, Command& chosen);
void add_map(CommandLine& program, Common& common, Command& chosen);
void add_modulus(CommandLine& program, Common& common, Command& chosen);
/// The list of sources in a window: what the program does without a command, where there is a display.
Command start_command(Common& common);

}  // namespace palpate
