#include "engine/base/json.h"

#include <algorithm>
#include <iterator>
#include <nlohmann/json.hpp>
#include <numeric>
#include <unordered_map>
#include <utility>

namespace palpate::json {
namespace {

/// A scalar as the library writes it.
std::string scalar(const nlohmann::json& value, Utf8 utf8) {
  return value.dump(-1, ' ', utf8 == Utf8::Ascii,
                    utf8 == Utf8::Strict ? nlohmann::json::error_handler_t::strict
                                         : nlohmann::json::error_handler_t::replace);
}

}  // namespace

Value::Value(const char* text) : kind_(Kind::Text), text_(text) {}
Value::Value(std::string text) : kind_(Kind::Text), text_(std::move(text)) {}
Value::Value(std::string_view text) : kind_(Kind::Text), text_(text) {}

Value::Value(std::initializer_list<Value> values) {
  const bool pairs = std::all_of(values.begin(), values.end(), [](const Value& v) {
    return v.is_array() && v.size() == 2 && v.items_[0].is_string();
  });
  kind_ = pairs ? Kind::Object : Kind::Array;
  if (pairs)
    for (const Value& v : values) (*this)[v.items_[0].text_] = v.items_[1];
  else
    items_ = values;
}

Value::Value(const Value& other) = default;
Value::Value(Value&& other) noexcept
    : kind_(std::exchange(other.kind_, Kind::Null)),
      integer_(other.integer_),
      number_(other.number_),
      text_(std::move(other.text_)),
      items_(std::move(other.items_)),
      keys_(std::move(other.keys_)) {
  other.items_.clear();
  other.keys_.clear();
}
Value& Value::operator=(const Value& other) {
  return *this = Value(other);
}
Value& Value::operator=(Value&& other) noexcept {
  std::swap(kind_, other.kind_);
  std::swap(integer_, other.integer_);
  std::swap(number_, other.number_);
  text_.swap(other.text_);
  items_.swap(other.items_);
  keys_.swap(other.keys_);
  return *this;
}

Value::~Value() {
  std::vector<Value> rest = std::move(items_);
  while (!rest.empty()) {
    std::vector<Value> inner = std::move(rest.back().items_);
    rest.pop_back();
    std::move(inner.begin(), inner.end(), std::back_inserter(rest));
  }
}

Value Value::array(std::initializer_list<Value> values) {
  Value value;
  value.kind_ = Kind::Array;
  value.items_ = values;
  return value;
}

Value Value::object() {
  Value value;
  value.kind_ = Kind::Object;
  return value;
}

void Value::need(Kind kind, const char* name) const {
  static constexpr const char* kNames[] = {"null",   "boolean", "number", "number",
                                           "number", "string",  "array",  "object"};
  if (kind_ != kind)
    throw Error(std::string("type must be ") + name + ", but is " + kNames[static_cast<size_t>(kind_)]);
}

const Value* Value::find(std::string_view key) const {
  const auto at = std::find(keys_.begin(), keys_.end(), key);
  return at == keys_.end() ? nullptr : &items_[static_cast<size_t>(at - keys_.begin())];
}

const Value& Value::at(std::string_view key) const {
  need(Kind::Object, "object");
  const Value* found = find(key);
  if (!found) throw Error("key '" + std::string(key) + "' not found");
  return *found;
}

const Value& Value::at(size_t index) const {
  need(Kind::Array, "array");
  if (index >= items_.size()) throw Error("array index " + std::to_string(index) + " is out of range");
  return items_[index];
}

Value& Value::operator[](std::string_view key) {
  if (is_null()) kind_ = Kind::Object;
  need(Kind::Object, "object");
  if (const Value* found = find(key)) return const_cast<Value&>(*found);
  keys_.emplace_back(key);
  return items_.emplace_back();
}

void Value::push_back(Value value) {
  if (is_null()) kind_ = Kind::Array;
  need(Kind::Array, "array");
  items_.push_back(std::move(value));
}

void Value::update(const Value& object) {
  object.need(Kind::Object, "object");
  for (size_t i = 0; i < object.items_.size(); ++i) (*this)[object.keys_[i]] = object.items_[i];
}

void Value::erase(std::string_view key) {
  need(Kind::Object, "object");
  const auto at = std::find(keys_.begin(), keys_.end(), key);
  if (at == keys_.end()) return;
  items_.erase(items_.begin() + (at - keys_.begin()));
  keys_.erase(at);
}

double Value::number() const {
  if (kind_ == Kind::Integer) return static_cast<double>(integer_);
  if (kind_ == Kind::Unsigned) return static_cast<double>(static_cast<uint64_t>(integer_));
  need(Kind::Number, "number");
  return number_;
}

bool Value::boolean() const {
  need(Kind::Boolean, "boolean");
  return integer_ != 0;
}

const std::string& Value::text() const {
  need(Kind::Text, "string");
  return text_;
}

const Value& Value::need_array() const {
  need(Kind::Array, "array");
  return *this;
}

int64_t Value::whole(int64_t least, int64_t most) const {
  if (kind_ == Kind::Number || !is_number()) need(Kind::Integer, "whole number");
  // Unsigned numbers beyond int64_t have the sign bit set.
  if ((kind_ == Kind::Unsigned && integer_ < 0) || integer_ < least || integer_ > most)
    throw Error("a whole number from " + std::to_string(least) + " to " + std::to_string(most) +
                " expected, " + dump() + " found");
  return integer_;
}

uint64_t Value::whole_unsigned(uint64_t most) const {
  if (kind_ == Kind::Number || !is_number()) need(Kind::Unsigned, "whole number");
  const auto value = static_cast<uint64_t>(integer_);
  if ((kind_ == Kind::Integer && integer_ < 0) || value > most)
    throw Error("a whole number from 0 to " + std::to_string(most) + " expected, " + dump() + " found");
  return value;
}

bool operator==(const Value& a, const Value& b) {
  if (a.is_number() && b.is_number()) {
    if (a.kind_ != Value::Kind::Number && b.kind_ != Value::Kind::Number)
      return a.integer_ == b.integer_ && (a.kind_ == b.kind_ || a.integer_ >= 0);
    return a.number() == b.number();
  }
  if (a.kind_ != b.kind_ || a.size() != b.size()) return false;
  if (a.is_object()) {
    for (size_t i = 0; i < a.size(); ++i) {
      const Value* other = b.find(a.keys_[i]);
      if (!other || !(a.items_[i] == *other)) return false;
    }
    return true;
  }
  return a.integer_ == b.integer_ && a.text_ == b.text_ &&
         std::equal(a.items_.begin(), a.items_.end(), b.items_.begin());
}

void Value::sort_own_keys() {
  std::vector<size_t> order(keys_.size());
  std::iota(order.begin(), order.end(), size_t{0});
  std::sort(order.begin(), order.end(), [this](size_t a, size_t b) { return keys_[a] < keys_[b]; });
  std::vector<std::string> keys;
  std::vector<Value> items;
  for (const size_t i : order) {
    keys.push_back(std::move(keys_[i]));
    items.push_back(std::move(items_[i]));
  }
  keys_.swap(keys);
  items_.swap(items);
}

void Value::sort_keys() {
  for (Value& item : items_) item.sort_keys();
  if (is_object()) sort_own_keys();
}

void Value::write(std::string& out, int indent, int depth, Utf8 utf8) const {
  switch (kind_) {
    case Kind::Null:
      out += "null";
      return;
    case Kind::Boolean:
      out += integer_ != 0 ? "true" : "false";
      return;
    case Kind::Integer:
      out += std::to_string(integer_);
      return;
    case Kind::Unsigned:
      out += std::to_string(static_cast<uint64_t>(integer_));
      return;
    case Kind::Number:
      out += scalar(number_, utf8);
      return;
    case Kind::Text:
      out += scalar(text_, utf8);
      return;
    case Kind::Array:
    case Kind::Object:
      break;
  }
  const char open = is_array() ? '[' : '{', close = is_array() ? ']' : '}';
  out += open;
  const auto new_line = [&](int at) {
    if (indent >= 0) out.append(1, '\n').append(static_cast<size_t>(indent * at), ' ');
  };
  for (size_t i = 0; i < items_.size(); ++i) {
    if (i > 0) out += ',';
    new_line(depth + 1);
    if (is_object()) out.append(scalar(keys_[i], utf8)).append(indent >= 0 ? ": " : ":");
    items_[i].write(out, indent, depth + 1, utf8);
  }
  if (!items_.empty()) new_line(depth);
  out += close;
}

std::string Value::dump(int indent, Utf8 utf8) const {
  std::string out;
  try {
    write(out, indent, 0, utf8);
  } catch (const nlohmann::json::exception& error) {
    throw Error(error.what());
  }
  return out;
}

/// Builds a tree from the events of the library's parser.
class Builder {
 public:
  using Float = nlohmann::json::number_float_t;
  explicit Builder(const ParseOptions& options) : options_(options) {}

  bool null() { return put(Value()); }
  bool boolean(bool value) { return put(value); }
  bool number_integer(int64_t value) { return put(value); }
  bool number_unsigned(uint64_t value) { return put(value); }
  bool number_float(Float value, const std::string&) { return put(value); }
  bool string(std::string& value) { return put(std::move(value)); }
  bool binary(nlohmann::json::binary_t&) { return false; }
  bool start_object(size_t) { return open(Value::object()); }
  bool start_array(size_t) { return open(Value::array()); }
  bool end_array() { return close(); }
  bool end_object() {
    if (options_.sorted_keys) open_.back().sort_own_keys();
    return close();
  }
  bool key(std::string& key) {
    if (options_.unique_keys && places_.back().contains(key)) throw KeyTwice(key);
    keys_.back() = std::move(key);
    return true;
  }
  [[noreturn]] bool parse_error(size_t, const std::string&, const nlohmann::detail::exception& error) {
    // The library puts its own code in front, and of a syntax error the words "parse error".
    std::string what = error.what();
    const size_t at = what.find("at line"), code = what.find("] ");
    what = at != std::string::npos ? "an error " + what.substr(at) : what.substr(code + 2);
    for (char& c : what)
      if (c < ' ' || c > '~') c = '?';  // it quotes the bytes, which may be no text
    // All that was read of a string, where it does not end.
    constexpr size_t kStart = 220, kEnd = 60;
    if (what.size() > kStart + kEnd) what.replace(kStart, what.size() - kStart - kEnd, "...");
    throw Error(what);
  }
  Value take() { return std::move(whole_); }

 private:
  bool put(Value value) {
    if (open_.empty())
      whole_ = std::move(value);
    else if (open_.back().is_object())
      set(keys_.back(), std::move(value));
    else
      open_.back().push_back(std::move(value));
    return true;
  }
  /// As the object's operator[], without a look at all of its keys: files may have a million.
  void set(std::string& key, Value value) {
    Value& object = open_.back();
    const auto [place, is_new] = places_.back().try_emplace(key, object.items_.size());
    if (!is_new) {
      object.items_[place->second] = std::move(value);
      return;
    }
    object.keys_.push_back(std::move(key));
    object.items_.push_back(std::move(value));
  }
  bool open(Value value) {
    if (options_.deepest != 0 && open_.size() >= options_.deepest)
      throw TooDeep("arrays and objects nest deeper than " + std::to_string(options_.deepest));
    open_.push_back(std::move(value));
    keys_.emplace_back();
    places_.emplace_back();
    return true;
  }
  bool close() {
    Value value = std::move(open_.back());
    open_.pop_back();
    keys_.pop_back();
    places_.pop_back();
    return put(std::move(value));
  }

  const ParseOptions& options_;
  Value whole_;
  std::vector<Value> open_;
  std::vector<std::string> keys_;                                // one for each open value
  std::vector<std::unordered_map<std::string, size_t>> places_;  // of its keys
};

Value parse(std::string_view text, ParseOptions options) {
  Builder builder(options);
  nlohmann::json::sax_parse(text.begin(), text.end(), &builder, nlohmann::json::input_format_t::json, true,
                            options.comments);
  return builder.take();
}

}  // namespace palpate::json
