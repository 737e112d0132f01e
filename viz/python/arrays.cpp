#include "viz/python/arrays.h"

#include <algorithm>

namespace palpate::python {

std::string shape_text(const Shape& shape) {
  std::string text = "(";
  for (size_t i = 0; i < shape.size(); ++i) text += (i ? ", " : "") + std::to_string(shape[i]);
  return text + (shape.size() == 1 ? ",)" : ")");
}

py::array real_array(const py::handle& given, const char* name) {
  py::array array = py::array::ensure(given);
  if (!array) {
    PyErr_Clear();
    throw bad_argument(std::string(name) + " as an array of numbers",
                       std::string("a ") + Py_TYPE(given.ptr())->tp_name, "numpy.asarray");
  }
  constexpr std::string_view kReal = "fiu";
  if (kReal.find(array.dtype().kind()) == std::string_view::npos)
    throw bad_argument(std::string(name) + " of real numbers (float16 to float64, or whole)",
                       "dtype " + py::str(array.dtype()).cast<std::string>(), "array.astype(numpy.float32)");
  return array;
}

Shape shape_of(const py::array& array) {
  return {array.shape(), array.shape() + array.ndim()};
}

template <typename T>
std::vector<T> numbers(const py::handle& given, const char* name, Shape& shape, Finite finite) {
  const py::array array = real_array(given, name);
  shape = shape_of(array);
  const auto dense = py::array_t<T, py::array::c_style | py::array::forcecast>::ensure(array);
  if (!dense) throw py::error_already_set();
  std::vector<T> values(dense.data(), dense.data() + dense.size());
  if (finite == Finite::Free) return values;
  const auto bad = std::find_if_not(values.begin(), values.end(), [](T v) { return std::isfinite(v); });
  if (bad == values.end()) return values;
  auto left = static_cast<py::ssize_t>(bad - values.begin());
  Shape place(shape.size());
  for (size_t axis = shape.size(); axis-- > 0; left /= shape[axis]) place[axis] = left % shape[axis];
  throw bad_argument(std::string("finite numbers in ") + name,
                     (std::isnan(*bad) ? "NaN at index " : "infinity at index ") + shape_text(place),
                     "numpy.isfinite to find them all");
}

template std::vector<float> numbers<float>(const py::handle&, const char*, Shape&, Finite);
template std::vector<double> numbers<double>(const py::handle&, const char*, Shape&, Finite);

}  // namespace palpate::python
