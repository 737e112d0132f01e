#include "viz/commands/support/forward_options.h"

#include <charconv>

#include "palpate/error.h"

namespace palpate {

std::array<uint32_t, 3> parse_cells(const std::string& option, const std::string& text,
                                    const std::string& example) {
  std::array<uint32_t, 3> cells{};
  const char* at = text.data();
  const char* end = at + text.size();
  for (size_t c = 0; c < 3; ++c) {
    const auto [next, error] = std::from_chars(at, end, cells[c]);
    if (error != std::errc() || (c < 2 ? next == end || *next != 'x' : next != end))
      throw Error(Failure::Usage, option + " AxBxC", "'" + text + "'", option + " " + example);
    at = next + 1;
  }
  return cells;
}

const std::map<std::string, InclusionShape>& lump_shapes() {
  static const std::map<std::string, InclusionShape> shapes = {{"sphere", InclusionShape::Sphere},
                                                               {"ellipsoid", InclusionShape::Ellipsoid},
                                                               {"cylinder", InclusionShape::Cylinder},
                                                               {"lying", InclusionShape::LyingCylinder}};
  return shapes;
}

}  // namespace palpate
