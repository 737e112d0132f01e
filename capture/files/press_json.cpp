#include "capture/files/press_json.h"

#include "capture/files/lump_maps.h"
#include "engine/base/json.h"

namespace palpate {

using Json = json::Value;

std::string to_json(const std::vector<PressAnswer>& presses) {
  Json all = Json::array();
  for (const PressAnswer& p : presses) {
    Json press = {{"press", p.press},
                  {"first_frame", p.first_frame},
                  {"last_frame", p.last_frame},
                  {"time_s", p.time_s},
                  {"highest_N", p.highest_N},
                  {"loads_N", p.loads_N},
                  {"saturated_share", p.saturated_fraction},
                  {"finished", !p.unfinished}};
    if (p.estimate)
      press["estimate"] = json::parse(estimate_json(*p.estimate));
    else
      press["trouble"] = p.trouble;
    all.push_back(std::move(press));
  }
  return all.dump();
}

}  // namespace palpate
