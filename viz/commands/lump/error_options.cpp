#include "viz/commands/lump/error_options.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string_view>

#include "engine/base/normal.h"
#include "engine/base/text.h"
#include "palpate/error.h"
#include "viz/commands/support/number_text.h"

namespace palpate {
namespace {

/// "--young-Pa 4000 or --young-Pa 4000+-400", within the range.
std::string example(const std::string& option, double least, double most) {
  const bool small = most < 4000;
  const double value = small ? std::max(least, std::min(2.0, most)) : 4000;
  return option + palpate::text(" %g or ", value) + option + palpate::text(" %g+-%g", value, value / 10);
}

struct ValueAndSd {
  std::optional<double> value, sd;  ///< none: no number
};

/// "4", whose standard deviation is 0, or "4+-0.4".
ValueAndSd value_and_sd(const std::string& text) {
  const size_t mark = text.find("+-");
  return {
      number_in(std::string_view(text).substr(0, mark)),
      mark == std::string::npos ? std::optional(0.0) : number_in(std::string_view(text).substr(mark + 2))};
}

}  // namespace

double stated_value(const std::string& option, const std::string& text, double least, double most,
                    double& share) {
  const auto [value, sd] = value_and_sd(text);
  const bool numbers = value && sd && *value >= least && *value <= most && *sd >= 0;
  if (numbers && text.find("+-") != std::string::npos) share = kNormal90 * *sd / *value;
  if (!numbers || share > 0.5)
    throw Error(Failure::Usage,
                palpate::text("%s as a value from %g to %g, or with its standard deviation of at most 30 %%",
                              option.c_str(), least, most),
                "'" + text + "'", example(option, least, most));
  return *value;
}

std::optional<lump::Skin> skin_of(const SkinOptions& o, double block_thickness_mm) {
  if (o.thickness_mm.empty() && o.ratio.empty()) return std::nullopt;
  if (o.thickness_mm.empty() || o.ratio.empty())
    throw Error(Failure::Usage, "a skin's thickness and its modulus over the tissue's",
                o.ratio.empty() ? "--skin-mm alone" : "--skin-ratio alone", "--skin-mm 2 --skin-ratio 3");
  lump::Skin skin;
  double thickness = 0, ratio = 0;  // of 90 % intervals
  skin.thickness_mm = stated_value("--skin-mm", o.thickness_mm, 0.05, block_thickness_mm / 2, thickness);
  skin.stiffness_ratio = stated_value("--skin-ratio", o.ratio, 0.05, 50, ratio);
  skin.thickness_sd = thickness / kNormal90;
  skin.ratio_sd = ratio / kNormal90;
  return skin;
}

std::optional<lump::Plate> plate_of(const PlateOptions& o) {
  if (o.friction.empty() && !o.sticks) return std::nullopt;
  if (!o.friction.empty() && o.sticks)
    throw Error(Failure::Usage, "either a plate that sticks or one that slides with friction",
                "--plate-sticks and --plate-friction", "one of the two");
  lump::Plate plate;
  plate.sticks = o.sticks;
  if (o.sticks) return plate;
  const auto [friction, sd] = value_and_sd(o.friction);
  if (!friction || !sd || !(*friction >= 0 && *friction <= 2) || !(*sd >= 0 && *sd <= 0.5))
    throw Error(Failure::Usage,
                "--plate-friction as a value from 0 to 2, or with its standard deviation of at most 0.5",
                "'" + o.friction + "'", "--plate-friction 0.1 or --plate-friction 0.1+-0.03");
  plate.friction = *friction;
  plate.friction_sd = *sd;
  return plate;
}

}  // namespace palpate
