// palpate calibrate lookup: from presses of a known ball into a gray gel to its table of depth over change.
#include <memory>

#include "capture/calibrate/workflow/workflow.h"
#include "viz/commands/calibrate/balls.h"
#include "viz/commands/calibrate/calibrate.h"
#include "viz/commands/command.h"
#include "viz/commands/support/options.h"

namespace palpate {

void add_calibrate_lookup(CommandLine& group, Common& common, Command& chosen) {
  CommandLine* command = group.add_subcommand(
      "lookup", "Depth of a gray gel from a table over its change of gray, by presses of a ball");
  auto options = std::make_shared<BallRequest>();
  add_ball_options(*command, *options, common, "Presses: an image, a folder of images, a video, a session",
                   "pitch, crop, quad, contact.signal");
  add_common(
      *command, common,
      "  palpate calibrate lookup press.png --sensor gel.json --ball-radius-mm 4 --background rest.png \\\n"
      "      --out gel2.json\n"
      "Depth 0 is the rim of the contact, where the gray begins to change. Errors are of presses that "
      "the table did\n"
      "not use; of one press alone, of every other of eight sectors.\n");
  command->callback([&common, &chosen, options] {
    chosen = [&common, options] {
      take_table(*options);
      return report_of(calibrate_lookup, *options, common);
    };
  });
}

}  // namespace palpate
