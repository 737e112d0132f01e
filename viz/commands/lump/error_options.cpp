#include "viz/commands/lump/error_options.h"

#include <charconv>
#include <optional>
#include <string_view>

#include "engine/base/normal.h"
#include "engine/base/text.h"
#include "palpate/error.h"

namespace palpate {
namespace {

std::optional<double> number_in(std::string_view text) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

}  // namespace

double stated_value(const std::string& option, const std::string& text, double least, double most,
                    double& share) {
  const size_t mark = text.find("+-");
  const auto value = number_in(std::string_view(text).substr(0, mark));
  const auto sd =
      mark == std::string::npos ? std::optional(0.0) : number_in(std::string_view(text).substr(mark + 2));
  const bool numbers = value && sd && *value >= least && *value <= most && *sd >= 0;
  if (numbers && mark != std::string::npos) share = kNormal90 * *sd / *value;
  if (!numbers || share > 0.5)
    throw Error(Failure::Usage,
                palpate::text("%s as a value from %g to %g, or with its standard deviation of at most 30 %%",
                              option.c_str(), least, most),
                "'" + text + "'", option + " 4000 or " + option + " 4000+-400");
  return *value;
}

}  // namespace palpate
