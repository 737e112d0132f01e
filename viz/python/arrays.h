// NumPy arrays in and out. What comes in is copied once; what goes out owns its memory and is read-only.
#pragma once

#include <pybind11/numpy.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "viz/python/errors.h"

namespace palpate::python {

namespace py = pybind11;

using Shape = std::vector<py::ssize_t>;

/// "(480, 640)".
std::string shape_text(const Shape& shape);

/// An array of real numbers: dtype float16 to float64, or whole numbers; any strides, lists too. `name`
/// stands for it in messages. Throws Refusal where it is none.
py::array real_array(const py::handle& given, const char* name);
Shape shape_of(const py::array& array);

/// Whether numbers that are not finite are refused.
enum class Finite { Asked, Free };

/// The numbers of a real array, in C order; `shape` receives its shape. Throws Refusal naming the first place
/// that is not finite.
template <typename T>
std::vector<T> numbers(const py::handle& given, const char* name, Shape& shape,
                       Finite finite = Finite::Asked);
extern template std::vector<float> numbers<float>(const py::handle&, const char*, Shape&, Finite);
extern template std::vector<double> numbers<double>(const py::handle&, const char*, Shape&, Finite);

/// The same of so many axes. `wanted` says what they are: "rows x columns".
template <typename T>
std::vector<T> numbers_of(const py::handle& given, const char* name, size_t axes, const char* wanted,
                          Shape& shape, Finite finite = Finite::Asked) {
  std::vector<T> values = numbers<T>(given, name, shape, finite);
  if (shape.size() != axes)
    throw bad_argument(std::string(name) + " of " + wanted, "shape " + shape_text(shape),
                       std::string("an array of ") + std::to_string(axes) + (axes == 1 ? " axis" : " axes"));
  return values;
}

/// An array that takes `values` over, not to be written to.
template <typename T>
py::array_t<T> hand_out(std::vector<T> values, const Shape& shape) {
  auto owned = std::make_unique<std::vector<T>>(std::move(values));
  T* const data = owned->data();
  const py::capsule owner(owned.get(), [](void* p) { delete static_cast<std::vector<T>*>(p); });
  static_cast<void>(owned.release());
  py::array_t<T> array(shape, data, owner);
  py::detail::array_proxy(array.ptr())->flags &= ~py::detail::npy_api::NPY_ARRAY_WRITEABLE_;
  return array;
}
/// The same with one axis.
template <typename T>
py::array_t<T> hand_out(std::vector<T> values) {
  const auto count = static_cast<py::ssize_t>(values.size());
  return hand_out(std::move(values), {count});
}

/// An array of one number or flag an item, which `get` (a member, or a function of the item) gives.
template <typename Items, typename Get>
py::object column(const Items& items, Get get) {
  using Value = std::decay_t<std::invoke_result_t<Get, const typename Items::value_type&>>;
  constexpr bool kFlags = std::is_same_v<Value, bool>;
  std::vector<std::conditional_t<kFlags, uint8_t, Value>> values;
  values.reserve(items.size());
  for (const auto& item : items) values.push_back(std::invoke(get, item));
  py::object array = hand_out(std::move(values));
  return kFlags ? array.attr("view")("bool") : array;
}

}  // namespace palpate::python
