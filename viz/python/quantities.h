// The quantities of a touch as attributes of Python's classes: the module binds them, the stub describes
// them.
#pragma once

#include <string>
#include <string_view>

#include "capture/files/true_quantities.h"
#include "engine/measure/quantities.h"

namespace palpate::python {

// Beginnings of the attributes of a touch's wrench and of its object's motion.
constexpr std::string_view kWrench = "wrench.", kMotion = "motion.";

/// An attribute of one class.
template <typename Of>
struct Attribute {
  const MeasuredQuantity<Of>& quantity;
  std::string name;
  std::string older_of;  ///< the name that is to be used instead; empty: it is this one
};

/// Calls `with` for each attribute of `quantities` that begins with `prefix`, without it; "": those of no
/// other class.
template <typename Of, typename With>
void each_attribute(std::span<const MeasuredQuantity<Of>> quantities, std::string_view prefix, With with) {
  for (const MeasuredQuantity<Of>& q : quantities) {
    const std::string name = python_name(q);
    const bool inside = name.find('.') != std::string::npos;
    if (name.empty() || inside == prefix.empty() || !name.starts_with(prefix)) continue;
    const std::string own = name.substr(prefix.size());
    with(Attribute<Of>{q, own, {}});
    if (q.python_also) with(Attribute<Of>{q, q.python_also + prefix.size(), own});
  }
}

/// Its description.
template <typename Of>
std::string documentation(const Attribute<Of>& attribute) {
  if (!attribute.older_of.empty()) return "Older name of ``" + attribute.older_of + "``.";
  std::string doc;
  for (const char c : std::string_view(attribute.quantity.sentence))
    doc += c == '`' ? "``" : std::string(1, c);
  return doc;
}

}  // namespace palpate::python
