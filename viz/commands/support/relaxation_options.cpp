#include "viz/commands/support/relaxation_options.h"

#include <algorithm>
#include <string_view>

#include "engine/base/text.h"
#include "palpate/error.h"
#include "viz/commands/support/number_text.h"

namespace palpate {
std::optional<lump::Relaxation> relaxation_of(const RelaxationOptions& o) {
  if (o.series.empty()) return std::nullopt;
  lump::Relaxation relaxation = o.times;
  double lost = 0;
  std::string_view rest = o.series;
  for (bool more = true; more;) {
    const size_t comma = rest.find(',');
    const std::string_view term = rest.substr(0, comma);
    const size_t colon = std::min(term.find(':'), term.size());
    const auto share = number_in(term.substr(0, colon)),
               time_s = number_in(term.substr(std::min(colon + 1, term.size())));
    if (!share || !time_s || !(*share > 0 && *time_s > 0))
      throw Error(Failure::Usage, "--relaxation as shares and times above 0", "'" + std::string(term) + "'",
                  "--relaxation 0.2:3,0.1:30");
    relaxation.terms.push_back({*share, *time_s});
    lost += *share;
    more = comma != std::string_view::npos;
    if (more) rest.remove_prefix(comma + 1);
  }
  if (!(lost < 1))
    throw Error(Failure::Usage, "--relaxation with shares below 1 in all", palpate::text("%g", lost),
                "shares of the modulus right after a step, 0.2:3,0.1:30");
  return relaxation;
}

}  // namespace palpate
