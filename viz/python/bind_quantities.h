// Quantities of the lists as attributes of Python's classes.
#pragma once

#include <pybind11/pybind11.h>

#include <limits>
#include <string>

#include "viz/python/estimate.h"
#include "viz/python/quantities.h"

namespace palpate::python {

/// NaN for a missing quantity that is a number, else None.
template <typename Of>
pybind11::object as_python(const MeasuredQuantity<Of>& q, const Of& of) {
  constexpr double none = std::numeric_limits<double>::quiet_NaN();
  const QuantityValue value = q.value(of);
  if (q.kind == QuantityKind::Estimated) {
    const Estimate* known = std::get_if<Estimate>(&value);
    const Estimate* shown = shown_estimate(q, value);
    return pybind11::cast(Measured{shown ? shown->value : none, shown ? shown->standard_error : none,
                                   to_string(known ? known->validity : Estimate{}.validity), q.unit});
  }
  if (const bool* flag = std::get_if<bool>(&value)) return pybind11::cast(*flag);
  if (const uint64_t* count = std::get_if<uint64_t>(&value)) return pybind11::cast(*count);
  if (const double* number = std::get_if<double>(&value)) return pybind11::cast(*number);
  if (const auto* word = std::get_if<std::string_view>(&value)) return pybind11::cast(std::string(*word));
  return q.kind == QuantityKind::Number && !q.none ? pybind11::object(pybind11::cast(none))
                                                   : pybind11::none();
}

/// Each quantity as an attribute; `of` gives what has them.
template <typename Class, typename Of, typename Get>
void bind_quantities(Class& bound, std::span<const MeasuredQuantity<Of>> quantities, Get of,
                     std::string_view prefix = "") {
  each_attribute(quantities, prefix, [&bound, of](const Attribute<Of>& a) {
    const std::string doc = documentation(a);
    bound.def_property_readonly(
        a.name.c_str(),
        [&q = a.quantity, of](const typename Class::type& self) { return as_python<Of>(q, of(self)); },
        doc.c_str());
  });
}

}  // namespace palpate::python
