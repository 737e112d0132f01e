// palpate_stub TEMPLATE FILE: the stub of the Python module. Each line "# quantities: LIST" of the template
// becomes the attributes of that list.
#include <cstdio>
#include <exception>
#include <fstream>
#include <stdexcept>

#include "capture/files/output_file.h"
#include "engine/grip/grip_quantities.h"
#include "viz/python/quantities.h"

namespace palpate::python {
namespace {

std::string type_of(QuantityKind kind, bool none) {
  const std::string type = kind == QuantityKind::Estimated ? "Estimate"
                           : kind == QuantityKind::Number  ? "float"
                           : kind == QuantityKind::Whole   ? "int"
                           : kind == QuantityKind::Word    ? "str"
                                                           : "bool";
  return none ? type + " | None" : type;
}

template <typename Of>
std::string attributes(std::span<const MeasuredQuantity<Of>> quantities, std::string_view prefix = "") {
  std::string lines;
  each_attribute(quantities, prefix, [&lines](const Attribute<Of>& a) {
    const std::string indent(4, ' ');
    lines += indent + "@property\n" + indent + "def " + a.name + "(self) -> " +
             type_of(a.quantity.kind, a.quantity.none) + ":\n" + indent + indent + "\"\"\"" +
             documentation(a) + "\"\"\"\n";
  });
  return lines;
}

/// Without those of _Shape, which a touch and a contact inherit.
template <typename Of>
std::string own_attributes(std::span<const MeasuredQuantity<Of>> quantities) {
  const std::string all = attributes(quantities), shape = attributes(shape_quantities());
  const size_t at = all.find(shape);
  if (at == std::string::npos) throw std::logic_error("attributes without those of _Shape");
  return all.substr(0, at) + all.substr(at + shape.size());
}

std::string attributes_of(const std::string& list) {
  if (list == "shape") return attributes(shape_quantities());
  if (list == "contact") return own_attributes(contact_quantities());
  if (list == "frame") return attributes(frame_quantities());
  if (list == "touch") return own_attributes(touch_quantities());
  if (list == "wrench") return attributes(touch_quantities(), kWrench);
  if (list == "motion") return attributes(touch_quantities(), kMotion);
  if (list == "grip") return attributes(grip_quantities());
  if (list == "truth") return attributes(true_quantities());
  throw std::logic_error("no list of quantities '" + list + "'");
}

void write_stub(const char* from, const char* to) {
  constexpr std::string_view kMark = "    # quantities: ";
  std::ifstream in(from);
  if (!in) throw std::runtime_error(std::string("no file ") + from);
  std::string text;
  for (std::string line; std::getline(in, line);)
    text += line.starts_with(kMark) ? attributes_of(line.substr(kMark.size())) : line + "\n";
  write_whole(to, std::string_view(text));
}

}  // namespace
}  // namespace palpate::python

int main(int count, char** words) try {
  if (count != 3) throw std::invalid_argument("palpate_stub TEMPLATE FILE");
  palpate::python::write_stub(words[1], words[2]);
  return 0;
} catch (const std::exception& error) {
  std::fprintf(stderr, "palpate_stub: %s\n", error.what());
  return 1;
}
