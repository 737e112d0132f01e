// JSON values: ordered objects, arrays, texts and numbers, read and written without a heavy header.
#pragma once

#include <array>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <limits>
#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

namespace palpate::json {

/// Text that is no JSON, or a value of another kind than the one asked for.
class Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};
/// An object that writes a key twice, where that is refused.
class KeyTwice : public Error {
 public:
  explicit KeyTwice(const std::string& which) : Error("key '" + which + "' twice"), key(which) {}
  std::string key;
};

/// Arrays and objects within each other beyond what is allowed.
class TooDeep : public Error {
 public:
  using Error::Error;
};

/// Treatment of bytes that are not UTF-8 when a text is written: an Error, or U+FFFD in their place.
/// Ascii: as Replace, and all beyond ASCII is written as \u escapes.
enum class Utf8 : uint8_t { Strict, Replace, Ascii };

class Value;

template <typename T>
concept Integer = std::is_integral_v<T> && !std::is_same_v<T, bool>;
/// Anything that can be walked through, other than a text or a value: becomes an array, a map an object.
template <typename T>
concept Range = !std::is_convertible_v<const T&, std::string_view> && !std::is_same_v<T, Value> &&
                requires(const T& range) {
  range.begin();
  range.end();
  typename T::value_type;
};

/// Objects keep the order in which their keys were set. Numbers are written with the fewest digits that read
/// back as the same value; those that are not finite as null.
class Value {
 public:
  enum class Kind : uint8_t { Null, Boolean, Integer, Unsigned, Number, Text, Array, Object };

  Value() = default;
  Value(std::nullptr_t) {}
  Value(bool value) : kind_(Kind::Boolean), integer_(value) {}
  template <json::Integer T>
  Value(T value)
      : kind_(std::is_signed_v<T> ? Kind::Integer : Kind::Unsigned), integer_(static_cast<int64_t>(value)) {}
  template <std::floating_point T>
  Value(T value) : kind_(Kind::Number), number_(static_cast<double>(value)) {}
  Value(const char* text);
  Value(std::string text);
  Value(std::string_view text);
  /// Pairs of a text and a value are an object, anything else is an array.
  Value(std::initializer_list<Value> values);
  template <json::Range T>
  Value(const T& range) : kind_(Kind::Array) {
    if constexpr (requires { typename T::mapped_type; }) {
      kind_ = Kind::Object;
      for (const auto& [key, value] : range) (*this)[key] = Value(value);
    } else {
      for (const auto& one : range) push_back(static_cast<typename T::value_type>(one));
    }
  }
  Value(const Value& other);
  Value(Value&& other) noexcept;
  Value& operator=(const Value& other);
  Value& operator=(Value&& other) noexcept;
  ~Value();  ///< does not recurse: files may nest deeper than a stack is

  static Value array(std::initializer_list<Value> values = {});
  static Value object();

  Kind kind() const { return kind_; }
  bool is_null() const { return kind_ == Kind::Null; }
  bool is_boolean() const { return kind_ == Kind::Boolean; }
  bool is_number() const { return kind_ >= Kind::Integer && kind_ <= Kind::Number; }
  bool is_string() const { return kind_ == Kind::Text; }
  bool is_array() const { return kind_ == Kind::Array; }
  bool is_object() const { return kind_ == Kind::Object; }
  bool is_structured() const { return is_array() || is_object(); }

  /// Number of items of an array or object; 0 for null, 1 for anything else.
  size_t size() const { return is_structured() ? items_.size() : is_null() ? 0 : 1; }
  bool empty() const { return size() == 0; }
  /// The values of an array or object, in order.
  const Value* begin() const { return items_.data(); }
  const Value* end() const { return items_.data() + items_.size(); }
  /// The keys of an object, in the order of its values.
  const std::vector<std::string>& keys() const { return keys_; }

  bool contains(std::string_view key) const { return find(key) != nullptr; }
  /// Null where there is none, or this is no object.
  const Value* find(std::string_view key) const;
  const Value& at(std::string_view key) const;
  const Value& at(size_t index) const;
  const Value& operator[](std::string_view key) const { return at(key); }
  const Value& operator[](size_t index) const { return at(index); }
  /// The value of a key, null as long as it is not set; null becomes an object.
  Value& operator[](std::string_view key);

  /// Null becomes an array.
  void push_back(Value value);
  /// Sets all of another object's keys.
  void update(const Value& object);
  /// Nothing happens where there is no such key.
  void erase(std::string_view key);

  bool is_unsigned() const { return kind_ == Kind::Unsigned; }
  double number() const;
  bool boolean() const;
  const std::string& text() const;
  /// As a text, boolean, number, or array of these. Throws where it is of another kind, no whole number for
  /// an integer or beyond its range, or an array of another length.
  template <typename T>
  T get() const {
    T value{};
    get_to(value);
    return value;
  }
  void get_to(std::string& value) const { value = text(); }
  void get_to(bool& value) const { value = boolean(); }
  template <std::floating_point T>
  void get_to(T& value) const {
    value = static_cast<T>(number());
  }
  template <json::Integer T>
  void get_to(T& value) const {
    value = static_cast<T>(std::is_signed_v<T>
                               ? whole(std::numeric_limits<T>::min(), std::numeric_limits<T>::max())
                               : static_cast<int64_t>(whole_unsigned(std::numeric_limits<T>::max())));
  }
  template <typename T, size_t N>
  void get_to(std::array<T, N>& values) const {
    if (need_array().size() != N)
      throw Error("an array of " + std::to_string(N) + " expected, of " + std::to_string(size()) + " found");
    for (size_t i = 0; i < N; ++i) items_[i].get_to(values[i]);
  }
  template <typename T>
  void get_to(std::vector<T>& values) const {
    values.clear();
    for (const Value& item : need_array().items_) values.push_back(item.get<T>());
  }

  /// Numbers by their value, objects whatever the order of their keys.
  friend bool operator==(const Value& a, const Value& b);

  /// `indent` < 0: on one line.
  std::string dump(int indent = -1, Utf8 utf8 = Utf8::Strict) const;
  /// Objects in the order of their keys' bytes, at all depths.
  void sort_keys();

 private:
  friend class Builder;
  void need(Kind kind, const char* name) const;
  const Value& need_array() const;
  int64_t whole(int64_t least, int64_t most) const;
  uint64_t whole_unsigned(uint64_t most) const;
  void sort_own_keys();
  void write(std::string& out, int indent, int depth, Utf8 utf8) const;

  Kind kind_ = Kind::Null;
  int64_t integer_ = 0;  // booleans and unsigned numbers too
  double number_ = 0;
  std::string text_;
  std::vector<Value> items_;
  std::vector<std::string> keys_;
};

/// How parse() takes what JSON leaves open.
struct ParseOptions {
  bool comments = false;     ///< are skipped
  bool unique_keys = false;  ///< throws KeyTwice; otherwise the last value of a key counts
  bool sorted_keys = false;  ///< see Value::sort_keys()
  size_t deepest = 0;        ///< arrays and objects within each other; more throw TooDeep; 0: any depth
};
/// Throws Error that names the line.
Value parse(std::string_view text, ParseOptions options = {});

}  // namespace palpate::json
